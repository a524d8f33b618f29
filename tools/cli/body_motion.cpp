#include "tools/cli/body_motion.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace cli {
namespace {

constexpr int usual_evaluations = 8;
constexpr int most_evaluations = 50;
constexpr double tolerance = 1e-10;        // of the largest force in the equation
constexpr double single_tolerance = 1e-7;  // what single precision can tell: its forces move in small stairs
constexpr double force_floor = 1e-3;       // of the load: forces below it count as this large

// Whether to go on: for the tolerance up to a number of evaluations that is usually enough, after that for
// what single precision can tell.
bool unsolved(double residual, double force_scale, int evaluations) noexcept {
  return evaluations < usual_evaluations
             ? residual > tolerance * force_scale
             : residual > single_tolerance * force_scale && evaluations < most_evaluations;
}

}  // namespace

BodyMotion::BodyMotion(const SceneBody& body, std::vector<std::size_t> patches, double stiffness_per_newton,
                       double damping_per_newton, double viscous_friction)
    : body_(body),
      patches_(std::move(patches)),
      stiffness_per_newton_(stiffness_per_newton),
      damping_per_newton_(damping_per_newton),
      viscous_(viscous_friction),
      velocity_{body.velocity[0], body.velocity[1]} {}

double BodyMotion::load_per_patch(double t) const noexcept {
  const double total = body_.mass * body_.gravity + load_at(body_.extra_load, t);
  return std::max(total, 0.0) / static_cast<double>(patches_.size());
}

// F_ext + F_mean(d) - m (v1 - v0) / T. It falls with d: by 2 m / T^2 for inertia, and by at most half the
// stiffness of all bristles stuck (the mean deflection of a stuck bristle moves by d / 2) and the dampers.
BodyMotion::Force2 BodyMotion::residual(bristle::PatchBatch& batch, double dt, bristle::Motion* motions,
                                        const Force2& d) noexcept {
  ++evaluations_;
  Force2 friction;
  for (const std::size_t p : patches_) {
    motions[p].displacement[0] = d.x;
    motions[p].displacement[1] = d.y;
    const bristle::Response response = batch.find_force(dt, motions[p]);
    friction.x += response.mean[0];
    if (body_.axes == 2) friction.y += response.mean[1];
  }
  const double inertia = 2.0 * body_.mass / dt;
  force_scale_ = std::max({force_scale_, std::fabs(friction.x), std::fabs(friction.y)});
  return {applied_[0] + friction.x - inertia * (d.x / dt - velocity_[0]),
          applied_[1] + friction.y - inertia * (d.y / dt - velocity_[1])};
}

void BodyMotion::note(double residual_n) noexcept {
  ++statistics_.solves;
  statistics_.iterations += static_cast<std::uint64_t>(evaluations_);
  statistics_.worst_iterations = std::max(statistics_.worst_iterations, evaluations_);
  if (force_scale_ > 0.0) {
    statistics_.worst_residual = std::max(statistics_.worst_residual, residual_n / force_scale_);
  }
}

// Secant steps, none shorter than the bound on the slope demands; once the root lies between two points they
// stay there, and secants that do not shrink that interval give way to a bisection. The friction of a few
// thousand bristles that redraw over many snaps is not continuous in d: each may take one snap more. Where
// the residual changes sign in such a jump no displacement solves the equation, and the better end is taken.
void BodyMotion::solve_one_axis(bristle::PatchBatch& batch, double dt, bristle::Motion* motions) noexcept {
  struct Point {
    double d, residual;
  };
  const auto at = [&](double d) { return Point{d, residual(batch, dt, motions, {d, 0.0}).x}; };
  const auto better = [](const Point& p, const Point& q) {
    return std::fabs(p.residual) < std::fabs(q.residual) ? p : q;
  };
  Point last = at(dt * velocity_[0]);
  Point best = last;
  Point low{-INFINITY, INFINITY}, high{INFINITY, -INFINITY};  // residual > 0 at low, < 0 at high
  double slope = slope_bound_;
  int slow = 0;  // steps in a row that did not halve the interval
  while (unsolved(std::fabs(best.residual), force_scale_, evaluations_)) {
    (last.residual > 0.0 ? low : high) = last;
    const bool bracketed = std::isfinite(low.d) && std::isfinite(high.d);
    const double width = high.d - low.d;
    const bool jump = bracketed && low.residual - high.residual > 2.0 * slope_bound_ * width;
    if (jump && evaluations_ >= usual_evaluations) break;
    double next = last.d + last.residual / slope;
    if (bracketed && (slow > 3 || !(next > low.d && next < high.d))) next = low.d + 0.5 * width;
    if (next == last.d || (bracketed && !(next > low.d && next < high.d)))
      break;  // no number lies in between
    const Point point = at(next);
    // Clear of rounding in tiny steps and of the falling branches of the friction curve.
    slope =
        std::clamp((last.residual - point.residual) / (point.d - last.d), 1e-2 * slope_bound_, slope_bound_);
    const double left = point.residual > 0.0 ? high.d - point.d : point.d - low.d;
    slow = bracketed && left > 0.5 * width ? slow + 1 : 0;
    last = point;
    best = better(point, best);
  }
  displacement_[0] = best.d;
  note(std::fabs(best.residual));
}

// Broyden's method, begun with the bound on the slope, and begun again from the best point whenever the
// residual does not shrink; a second time in a row means that the friction jumps there, as above.
void BodyMotion::solve_two_axes(bristle::PatchBatch& batch, double dt, bristle::Motion* motions) noexcept {
  const auto length = [](const Force2& f) { return std::sqrt(f.x * f.x + f.y * f.y); };
  Force2 d{dt * velocity_[0], dt * velocity_[1]};
  Force2 r = residual(batch, dt, motions, d);
  double norm = length(r);
  double bound = slope_bound_;
  double jxx = bound, jxy = 0.0, jyx = 0.0, jyy = bound;  // minus the Jacobian
  while (unsolved(norm, force_scale_, evaluations_)) {
    const double determinant = jxx * jyy - jxy * jyx;
    Force2 step{(jyy * r.x - jxy * r.y) / determinant, (jxx * r.y - jyx * r.x) / determinant};
    const double longest = 1e2 * norm / slope_bound_;
    if (!(determinant > 0.0) || !(length(step) <= longest)) {
      step = {r.x / bound, r.y / bound};
      jxx = jyy = bound;
      jxy = jyx = 0.0;
    }
    const Force2 trial{d.x + step.x, d.y + step.y};
    if (trial.x == d.x && trial.y == d.y) break;
    const Force2 rt = residual(batch, dt, motions, trial);
    const double trial_norm = length(rt);
    if (trial_norm < norm) {
      const double s2 = step.x * step.x + step.y * step.y;
      // -J learns the change seen along the step.
      const double ex = (r.x - rt.x) - (jxx * step.x + jxy * step.y);
      const double ey = (r.y - rt.y) - (jyx * step.x + jyy * step.y);
      jxx += ex * step.x / s2;
      jxy += ex * step.y / s2;
      jyx += ey * step.x / s2;
      jyy += ey * step.y / s2;
      d = trial;
      r = rt;
      norm = trial_norm;
    } else {
      if (jxx == bound && jyy == bound && jxy == 0.0 && jyx == 0.0) {
        if (evaluations_ >= usual_evaluations) break;
        bound *= 2.0;
      }
      jxx = jyy = bound;
      jxy = jyx = 0.0;
    }
  }
  displacement_[0] = d.x;
  displacement_[1] = d.y;
  note(norm);
}

void BodyMotion::solve(bristle::PatchBatch& batch, double t, double dt, bristle::Motion* motions) noexcept {
  body_.applied_force(t + 0.5 * dt, applied_);
  const double load = load_per_patch(t + 0.5 * dt);
  for (const std::size_t p : patches_) motions[p].normal_load = load;
  const double total_load = load * static_cast<double>(patches_.size());
  slope_bound_ = 2.0 * body_.mass / (dt * dt) + 0.5 * stiffness_per_newton_ * total_load +
                 (damping_per_newton_ * total_load + viscous_) / dt;
  force_scale_ = std::max({std::fabs(applied_[0]), std::fabs(applied_[1]), force_floor * total_load});
  evaluations_ = 0;
  if (body_.axes == 1) {
    solve_one_axis(batch, dt, motions);
  } else {
    solve_two_axes(batch, dt, motions);
  }
  for (const std::size_t p : patches_) {
    motions[p].displacement[0] = displacement_[0];
    motions[p].displacement[1] = displacement_[1];
  }
}

void BodyMotion::finish(double dt, const bristle::Response* responses) noexcept {
  double force[2] = {applied_[0], applied_[1]};
  for (const std::size_t p : patches_) {
    for (int axis = 0; axis < body_.axes; ++axis) force[axis] += responses[p].mean[axis];
  }
  for (int axis = 0; axis < body_.axes; ++axis) {
    velocity_[axis] += dt * force[axis] / body_.mass;
    position_[axis] += displacement_[axis];
  }
  highest_speed_ =
      std::max(highest_speed_, std::sqrt(velocity_[0] * velocity_[0] + velocity_[1] * velocity_[1]));
}

}  // namespace cli
