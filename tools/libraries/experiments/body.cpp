#include "tools/libraries/experiments/body.hpp"

#include <algorithm>
#include <cmath>

namespace cli {
namespace {

// Largest residual of the equation of motion, relative to its largest force, with which a step counts as
// solved.
constexpr double tolerance = 1e-11;
constexpr int usual_evaluations = 8;
constexpr int most_evaluations = 90;

struct Root {
  double d, residual;
  int evaluations;
};

// Finds the root of a residual that falls with the displacement d. Uses secants between the closest points of
// either sign, and bisects when two steps did not halve the bracket. If a finite brush redraws, friction
// jumps where one more bristle snaps. If the residual changes sign in such a jump, there is no root, and the
// side with the smaller residual is returned.
template <class Residual>
Root solve(const Residual& residual, double d, double slope, double accepted) {
  double low = -INFINITY, high = INFINITY;  // bracket of the root: residual > 0 at low, < 0 at high
  double at_low = 0.0, at_high = 0.0;
  Root best{d, residual(d), 1};
  double last_d = d, last = best.residual, secant = slope;
  int slow = 0;
  while (std::fabs(best.residual) > accepted && best.evaluations < most_evaluations) {
    (last > 0.0 ? low : high) = last_d;
    (last > 0.0 ? at_low : at_high) = last;
    const bool bracketed = std::isfinite(low) && std::isfinite(high);
    const double width = high - low;
    const bool jump = bracketed && at_low - at_high > 2.0 * slope * width;
    if (jump && best.evaluations >= usual_evaluations) break;
    double next = last_d + last / secant;
    if (bracketed && (slow >= 2 || !(next > low && next < high))) {
      next = low + 0.5 * width;
      slow = 0;
    }
    // Stops when there is no floating-point number between the two points that enclose the root.
    if (next == last_d || (bracketed && !(next > low && next < high))) break;
    const double r = residual(next);
    secant = std::clamp((last - r) / (next - last_d), 1e-3 * slope, slope);
    if (bracketed) slow += (r > 0.0 ? high - next : next - low) > 0.5 * width;
    last_d = next;
    last = r;
    ++best.evaluations;
    if (std::fabs(r) < std::fabs(best.residual)) {
      best.d = next;
      best.residual = r;
    }
  }
  return best;
}

}  // namespace

double SlidingBlock::advance(Subject& subject, const Pull& pull, double dt_s, double load_n) {
  const double inertia = 2.0 * mass_ / dt_s;
  double scale = std::max(std::fabs(pull.force_n), 1e-3 * load_n);
  const auto residual = [&](double d) {
    const double friction = subject.find_force({d, 0.0}, dt_s, load_n).mean.x;
    scale = std::max(scale, std::fabs(friction));
    return pull.force_n - pull.stiffness * d + friction - inertia * (d / dt_s - velocity_);
  };
  const double slope = inertia / dt_s + pull.stiffness + subject.slope_bound(dt_s, load_n);
  const Root root = solve(residual, dt_s * velocity_, slope, tolerance * scale);
  const double friction = subject.step({root.d, 0.0}, dt_s, load_n).mean.x;
  velocity_ += dt_s * (pull.force_n - pull.stiffness * root.d + friction) / mass_;
  position_ += root.d;
  worst_residual_ = std::max(worst_residual_, std::fabs(root.residual) / scale);
  worst_evaluations_ = std::max(worst_evaluations_, root.evaluations);
  return friction;
}

}  // namespace cli
