#include "tools/libraries/scene/scene_stepper.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include <bristle/error.hpp>

#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/scene/waveform.hpp"

namespace cli {
namespace {

bristle::PatchBatch make_batch(const bristle::BatchOptions& options) {
  try {
    return bristle::PatchBatch(options);
  } catch (const bristle::Error& error) {
    throw UserError(error.what());
  }
}

}  // namespace

std::uint64_t step_count(const Scene& scene) {
  const double steps = scene.duration.value_or(scene.trace_length()) / scene.dt;
  if (!(steps < 1e12)) throw UserError(fmt::format("{}: {} steps are too many", scene.file, steps));
  return static_cast<std::uint64_t>(std::max(1.0, std::floor(steps + 0.5)));
}

SceneStepper::SceneStepper(const Scene& scene, const bristle::BatchOptions& options,
                           const ShareDone& progress)
    : scene_(scene), batch_(make_batch(options)) {
  add_patches(progress);
  add_bodies();
  batch_.warm_up();
}

SceneCopy SceneStepper::make_copy(std::size_t p, std::uint32_t number, const double* line) const {
  const ScenePatch& patch = scene_.patches[p];
  SceneCopy copy;
  copy.patch = p;
  copy.name = patch.count == 1 ? patch.name : fmt::format("{}.{}", patch.name, number);
  if (!patch.motion) return copy;
  copy.delay = number * patch.motion->delay_per_copy;
  if (patch.motion->turn_per_copy != 0.0) {
    copy.cosine = cosine_of_turns(number * patch.motion->turn_per_copy);
    copy.sine = sine_of_turns(number * patch.motion->turn_per_copy);
  }
  if (line) {
    copy.axis[0] = copy.cosine * line[0] - copy.sine * line[1];
    copy.axis[1] = copy.sine * line[0] + copy.cosine * line[1];
    copy.cosine = line[0];
    copy.sine = -line[1];
  }
  copy.last = patch.motion->at(0.0);
  return copy;
}

void SceneStepper::add_patches(const ShareDone& progress) {
  const auto total = static_cast<double>(scene_.patch_count());
  for (std::size_t p = 0; p < scene_.patches.size(); ++p) {
    const ScenePatch& patch = scene_.patches[p];
    double line[2];
    const bool turned = patch.motion && patch.options.axes == 1 && patch.motion->moves_along_y() &&
                        patch.motion->stays_on_line(line);
    for (std::uint32_t i = 0; i < patch.count; ++i) {
      if (progress && copies_.size() % 16 == 0) progress(static_cast<double>(copies_.size()) / total);
      const std::uint32_t number = i * patch.stride;
      bristle::PatchOptions copy_options = patch.options;
      copy_options.seed += number;
      copy_options.key = copies_.size();
      bristle::Motion motion;
      try {
        motion.id = batch_.add(scene_.materials[patch.material].material, copy_options);
      } catch (const bristle::Error& error) {
        throw UserError(fmt::format("{}: {}", patch.where, error.what()));
      }
      copies_.push_back(make_copy(p, number, turned ? line : nullptr));
      motions_.push_back(motion);
    }
  }
  responses_.resize(motions_.size());
}

void SceneStepper::add_bodies() {
  // Indices, in the batch's arrays, of the copies of each patch of the scene.
  std::vector<std::vector<std::size_t>> copies_of(scene_.patches.size());
  for (std::size_t c = 0; c < copies_.size(); ++c) copies_of[copies_[c].patch].push_back(c);
  for (const SceneBody& body : scene_.bodies) {
    std::vector<std::size_t> own;
    for (const std::size_t p : body.patches) own.insert(own.end(), copies_of[p].begin(), copies_of[p].end());
    std::sort(own.begin(), own.end());
    bodies_.emplace_back(body, std::move(own));
  }
}

void SceneStepper::prescribe(double t) {
  for (std::size_t c = 0; c < copies_.size(); ++c) {
    SceneCopy& copy = copies_[c];
    const auto& motion = scene_.patches[copy.patch].motion;
    if (!motion) continue;
    const double own_t = std::max(t - copy.delay, 0.0);
    const double own_end = std::max(t + scene_.dt - copy.delay, 0.0);
    const Position next = motion->at(own_end);
    const double dx = next.x - copy.last.x, dy = next.y - copy.last.y;
    copy.last = next;
    motions_[c].displacement[0] = copy.cosine * dx - copy.sine * dy;
    const bool planar = scene_.patches[copy.patch].options.axes == 1;
    motions_[c].displacement[1] = planar ? 0.0 : copy.sine * dx + copy.cosine * dy;
    motions_[c].normal_load = motion->load_over(own_t, own_end - own_t);
  }
}

std::vector<double> SceneStepper::body_states() const {
  std::vector<double> states;
  for (const BodyMotion& body : bodies_) {
    states.insert(states.end(), std::begin(body.position()), std::end(body.position()));
    states.insert(states.end(), std::begin(body.velocity()), std::end(body.velocity()));
  }
  return states;
}

void SceneStepper::set_body_states(bristle::Span<const double> states, std::uint64_t steps) {
  // Recomputes the prescribed motions up to the restored time instead of reading them. A paced run prepares
  // the next step's motions early, so a saved position would be a step ahead.
  if (steps > 0) prescribe(static_cast<double>(steps - 1) * scene_.dt);
  const double* at = states.data();
  for (BodyMotion& body : bodies_) {
    body.set_motion({at[0], at[1]}, {at[2], at[3]});
    at += 4;
  }
}

void SceneStepper::step(double t) {
  for (BodyMotion& body : bodies_) body.solve(batch_, t, scene_.dt, motions_);
  report_ =
      batch_.step(scene_.dt, {motions_.data(), motions_.size()}, {responses_.data(), responses_.size()});
  for (BodyMotion& body : bodies_) body.finish(scene_.dt, responses_);
}

}  // namespace cli
