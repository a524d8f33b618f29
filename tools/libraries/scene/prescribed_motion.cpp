#include "tools/libraries/scene/prescribed_motion.hpp"

#include <algorithm>
#include <cmath>

#include "tools/libraries/scene/waveform.hpp"

namespace cli {
namespace {

// Interpolates the rows of a motion linearly at time t. Before the first and after the last row the motion
// stands still. Of several rows at one time, the last counts.
MotionRow interpolate(const std::vector<MotionRow>& rows, double t) noexcept {
  const auto after = std::upper_bound(rows.begin(), rows.end(), t,
                                      [](double time, const MotionRow& row) { return time < row.t; });
  if (after == rows.begin()) return rows.front();
  if (after == rows.end()) return rows.back();
  const MotionRow& a = *(after - 1);
  const MotionRow& b = *after;
  const double share = (t - a.t) / (b.t - a.t);
  return {t, a.x + share * (b.x - a.x), a.y + share * (b.y - a.y), a.load + share * (b.load - a.load)};
}

}  // namespace

Position PrescribedMotion::at(double t) const noexcept {
  switch (type) {
    case MotionType::hold:
      return {};
    case MotionType::ramp: {
      const double moving = std::clamp(t, from, until) - from;
      return {velocity[0] * moving, velocity[1] * moving};
    }
    case MotionType::sine: {
      const double wave = sine_of_turns(frequency * t + phase);
      return {amplitude[0] * wave, amplitude[1] * wave};
    }
    case MotionType::keyframes:
    case MotionType::trace: {
      const MotionRow row = interpolate(rows(), t);
      return {row.x, row.y};
    }
  }
  return {};
}

double PrescribedMotion::load_over(double t, double dt) const noexcept {
  return load_steps.empty() ? interpolate(rows(), t + dt).load : load_at(load_steps, t + 0.5 * dt);
}

bool PrescribedMotion::moves_along_y() const noexcept {
  return velocity[1] != 0.0 || amplitude[1] != 0.0 || turn_per_copy != 0.0 ||
         std::any_of(rows().begin(), rows().end(), [](const MotionRow& row) { return row.y != 0.0; });
}

bool PrescribedMotion::stays_on_line(double (&direction)[2]) const noexcept {
  direction[0] = 1.0;
  direction[1] = 0.0;
  // Direction of the motion: the velocity of a ramp or the amplitude of a sine, whichever is not zero.
  double far[2] = {velocity[0] + amplitude[0], velocity[1] + amplitude[1]};
  const auto length = [](double x, double y) { return std::sqrt(x * x + y * y); };
  for (const MotionRow& row : rows()) {
    const double x = row.x - rows().front().x, y = row.y - rows().front().y;
    if (length(x, y) > length(far[0], far[1])) {
      far[0] = x;
      far[1] = y;
    }
  }
  const double longest = length(far[0], far[1]);
  if (!(longest > 0.0)) return true;
  direction[0] = far[0] / longest;
  direction[1] = far[1] / longest;
  return std::all_of(rows().begin(), rows().end(), [&](const MotionRow& row) {
    const double x = row.x - rows().front().x, y = row.y - rows().front().y;
    return std::fabs(x * direction[1] - y * direction[0]) <= 1e-12 * longest;
  });
}

double load_at(const std::vector<LoadStep>& steps, double t) noexcept {
  double load = 0.0;
  for (const LoadStep& step : steps) {
    if (step.t <= t) load = step.load;
  }
  return load;
}

}  // namespace cli
