#include "tools/libraries/accuracy/error.hpp"

#include <algorithm>
#include <cmath>

#include <bristle/material.hpp>

#include "tools/libraries/scene/scene_stepper.hpp"

namespace cli {
namespace {

constexpr std::size_t closed_form_times = 60;
constexpr std::size_t closed_form_copies = 4;

void add_to(std::vector<double>& sum, const std::vector<double>& part) {
  if (sum.empty()) sum.resize(part.size());
  for (std::size_t i = 0; i < part.size(); ++i) sum[i] += part[i];
}

void add_to(ForceRecord& sum, const ForceRecord& part) {
  sum.steps = part.steps;
  sum.copies = part.copies;
  sum.patch_of = part.patch_of;
  add_to(sum.end, part.end);
  add_to(sum.mean, part.mean);
  add_to(sum.position, part.position);
  add_to(sum.work_end, part.work_end);
  add_to(sum.work_mean, part.work_mean);
}

void scale(ForceRecord& record, double factor) {
  for (auto* values : {&record.end, &record.mean, &record.position, &record.work_end, &record.work_mean}) {
    for (double& x : *values) x *= factor;
  }
}

// Returns the force of the reference run over a longer step that consists of `parts` of its own steps and
// ends with step `last`: the mean force if `mean` is set, otherwise the force at the end.
double reference_force(const ForceRecord& r, std::size_t last, std::size_t copy, std::size_t axis,
                       std::uint32_t parts, bool mean) {
  if (!mean) return r.end[r.at(last, copy) + axis];
  double sum = 0.0;
  for (std::uint32_t i = 0; i < parts; ++i) sum += r.mean[r.at(last - i, copy) + axis];
  return sum / parts;
}

struct Sums {
  double difference2 = 0.0, reference2 = 0.0, most2 = 0.0, path2 = 0.0, work = 0.0, reference_work = 0.0;
};

// Returns the closed-form friction (N, along the motion) on a body that starts at `motion.from` and then
// moves at constant speed under constant load; t is the time in s.
double ramp_force(const bristle::Material& m, const PrescribedMotion& motion, double load, double t) {
  const double speed = std::hypot(motion.velocity[0], motion.velocity[1]);
  const double moving = std::clamp(t, motion.from, motion.until) - motion.from;
  const double dbar = m.snap_length.mean();
  const double zeta = m.bristles_in_contact(load);
  const double elastic =
      zeta * m.bristle_stiffness * dbar * bristle::virgin_deflection(m, speed * moving / dbar);
  return -elastic - (zeta * m.damping_at(speed) + m.viscous_friction) * speed;
}

bool has_closed_form(const ScenePatch& patch, const bristle::Material& m, double duration) {
  if (!patch.motion || patch.motion->type != MotionType::ramp || patch.motion->load_steps.size() != 1)
    return false;
  const double far = std::hypot(patch.motion->velocity[0], patch.motion->velocity[1]) * duration;
  return far > 0.0 && far < 1e6 * m.snap_length.mean();
}

}  // namespace

void Reference::add(const ForceRecord& record) { add_to(runs_++ % 2 == 0 ? mean_ : other_, record); }

void Reference::finish() {
  ForceRecord first = mean_, second = other_;
  scale(first, 2.0 / runs_);
  scale(second, 2.0 / runs_);
  add_to(mean_, other_);
  scale(mean_, 1.0 / runs_);
  other_ = {};
  for (const PatchError& e : compare(first, second, 1, false)) floor_.push_back(0.5 * e.rms);
}

std::vector<PatchError> compare(const ForceRecord& record, const ForceRecord& reference, std::uint32_t parts,
                                bool mean) {
  const std::size_t patches =
      record.patch_of.empty() ? 0 : *std::max_element(record.patch_of.begin(), record.patch_of.end()) + 1;
  std::vector<Sums> sums(patches);
  const std::size_t steps = std::min(record.steps, reference.steps / parts);
  const std::vector<double>& forces = mean ? record.mean : record.end;
  for (std::size_t c = 0; c < record.copies; ++c) {
    Sums& s = sums[record.patch_of[c]];
    for (std::size_t k = 0; k < steps; ++k) {
      const std::size_t last = (k + 1) * parts - 1;
      double difference2 = 0.0, path2 = 0.0;
      for (std::size_t axis = 0; axis < 2; ++axis) {
        const double expected = reference_force(reference, last, c, axis, parts, mean);
        const double difference = forces[record.at(k, c) + axis] - expected;
        difference2 += difference * difference;
        s.reference2 += expected * expected;
        if (record.position.empty()) continue;
        const double off =
            record.position[record.at(k, c) + axis] - reference.position[reference.at(last, c) + axis];
        path2 += off * off;
      }
      s.difference2 += difference2;
      s.most2 = std::max(s.most2, difference2);
      s.path2 = std::max(s.path2, path2);
    }
    s.work += (mean ? record.work_mean : record.work_end)[c];
    s.reference_work += reference.work_mean.empty() ? reference.work_end[c] : reference.work_mean[c];
  }
  std::vector<PatchError> errors;
  for (std::size_t p = 0; p < patches; ++p) {
    const Sums& s = sums[p];
    const auto count = static_cast<double>(steps) *
                       static_cast<double>(std::count(record.patch_of.begin(), record.patch_of.end(), p));
    PatchError e;
    if (s.reference2 > 0.0) {
      e.rms = std::sqrt(s.difference2 / s.reference2);
      e.max = std::sqrt(s.most2 * count / s.reference2);
    }
    if (s.reference_work != 0.0) e.energy = std::fabs(s.work / s.reference_work - 1.0);
    e.path = std::sqrt(s.path2);
    errors.push_back(e);
  }
  return errors;
}

ClosedForm::ClosedForm(const Scene& scene, double dt_s, std::uint32_t most_parts)
    : patches_(scene.patches.size()) {
  const double duration = scene.duration.value_or(scene.trace_length());
  const auto rows = static_cast<std::size_t>(duration / (dt_s * most_parts) + 1e-9);
  std::size_t copy = 0;
  for (const ScenePatch& patch : scene.patches) {
    const bristle::Material& m = scene.materials[patch.material].material;
    for (std::uint32_t i = 0; i < patch.count; ++i, ++copy) {
      if (i >= closed_form_copies || !has_closed_form(patch, m, duration)) continue;
      const PrescribedMotion& motion = *patch.motion;
      const double turn = 2.0 * M_PI * motion.turn_per_copy * i * patch.stride;
      const double delay = motion.delay_per_copy * i * patch.stride;
      const double speed = std::hypot(motion.velocity[0], motion.velocity[1]);
      const double ex = (std::cos(turn) * motion.velocity[0] - std::sin(turn) * motion.velocity[1]) / speed;
      const double ey = (std::sin(turn) * motion.velocity[0] + std::cos(turn) * motion.velocity[1]) / speed;
      // Spaces the compared times evenly on a log scale, because the loading curve bends early.
      std::size_t last = 0;
      for (std::size_t k = 1; k <= closed_form_times; ++k) {
        const auto row = static_cast<std::size_t>(
            std::ceil(std::pow(static_cast<double>(rows), static_cast<double>(k) / closed_form_times)));
        if (row == last || row > rows) continue;
        last = row;
        const std::size_t step = row * most_parts - 1;
        const double t = static_cast<double>(step + 1) * dt_s - delay;
        if (t <= motion.from || t >= motion.until) continue;
        const double force = ramp_force(m, motion, motion.load_steps.front().load, t);
        points_.push_back({copy, step, {force * ex, force * ey}});
      }
    }
  }
}

std::vector<std::optional<double>> ClosedForm::compare(const ForceRecord& record, std::uint32_t parts) const {
  std::vector<double> difference2(patches_), force2(patches_);
  for (const Point& point : points_) {
    const std::size_t p = record.patch_of[point.copy];
    const std::size_t step = (point.step + 1) / parts - 1;
    if (step >= record.steps) continue;
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double difference = record.end[record.at(step, point.copy) + axis] - point.force[axis];
      difference2[p] += difference * difference;
      force2[p] += point.force[axis] * point.force[axis];
    }
  }
  std::vector<std::optional<double>> errors(patches_);
  for (std::size_t p = 0; p < patches_; ++p) {
    if (force2[p] > 0.0) errors[p] = std::sqrt(difference2[p] / force2[p]);
  }
  return errors;
}

}  // namespace cli
