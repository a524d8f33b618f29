// The two solves behind coupling.hpp (predictor and midpoint rule), and the types for a body and its
// contacts.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <type_traits>
#include <utility>

#include <Eigen/Core>

#include "bristle/linear_friction.hpp"
#include "bristle/patch_batch.hpp"
#include "bristle/span.hpp"

namespace bristle {

/// Keeps an argument of type T out of the deduction of Dof, so that arrays and Eigen expressions may be
/// passed for it.
template <class T>
using Given = std::enable_if_t<true, T>;

template <int Dof>
using BodyVector = Eigen::Matrix<double, Dof, 1, Eigen::DontAlign>;

/// Body with Dof velocity components: 1 on a rail, 2 if it slides in a plane without turning, 6 for a free
/// rigid body.
template <int Dof>
struct MovingBody {
  /// Mass matrix M, positive definite; kg for linear, kg m^2 for angular velocities.
  Eigen::Matrix<double, Dof, Dof, Eigen::DontAlign> mass = Eigen::Matrix<double, Dof, Dof>::Identity();
  BodyVector<Dof> velocity = Eigen::Matrix<double, Dof, 1>::Zero();  ///< velocity u, m/s, rad/s
};

/// Patch under a body. The caller sets `index`, `axes`, `jacobian` and `ground_velocity`; the solvers write
/// the other fields.
template <int Dof>
struct BodyContact {
  std::size_t index = 0;  ///< index of the contact's patch in the arrays of motions and responses
  int axes = 2;           ///< number of tangential axes of the patch
  /// Matrix J that gives the slip velocity from the body's velocity u as J u - ground_velocity.
  Eigen::Matrix<double, 2, Dof, Eigen::DontAlign> jacobian = Eigen::Matrix<double, 2, Dof>::Identity();
  Eigen::Matrix<double, 2, 1, Eigen::DontAlign> ground_velocity =
      Eigen::Vector2d::Zero();  ///< velocity of the other surface in the tangent plane, m/s

  double stiffness = 0.0, damping = 0.0, force_limit = 0.0;
  double plain_damping = 0.0;  ///< damping without the part from strengthening with speed
  bool ages = false;
  Eigen::Matrix<double, 2, 1, Eigen::DontAlign> force = Eigen::Vector2d::Zero(),
                                                trial_force = Eigen::Vector2d::Zero();
  Eigen::Matrix<double, 2, 2, Eigen::DontAlign> slope = Eigen::Matrix2d::Zero();
  LinearFriction linear;  ///< model of the patch in the predictor's linear solves
};

/// Effort and accuracy of a solution of the equation of motion: number of evaluations and remaining error.
struct SolveReport {
  int evaluations = 0;  ///< number of evaluations of the friction of all contacts
  /// Error that remains in the equation of motion, over its largest force, both in the norm sqrt(f M^-1 f).
  double residual = 0.0;
};

namespace detail {

/// Cholesky factor of a small positive definite matrix. Eigen's own takes seconds to compile for each size.
template <int Size>
class Cholesky {
 public:
  explicit Cholesky(const Eigen::Matrix<double, Size, Size>& matrix) noexcept : l_(matrix) {
    for (int k = 0; k < Size; ++k) {
      for (int j = 0; j < k; ++j)
        for (int i = k; i < Size; ++i) l_(i, k) -= l_(i, j) * l_(k, j);
      l_(k, k) = std::sqrt(l_(k, k));
      for (int i = k + 1; i < Size; ++i) l_(i, k) /= l_(k, k);
    }
  }
  Eigen::Matrix<double, Size, 1> solve(Eigen::Matrix<double, Size, 1> right) const noexcept {
    for (int i = 0; i < Size; ++i) {
      for (int k = 0; k < i; ++k) right[i] -= l_(i, k) * right[k];
      right[i] /= l_(i, i);
    }
    for (int i = Size - 1; i >= 0; --i) {
      for (int k = i + 1; k < Size; ++k) right[i] -= l_(k, i) * right[k];
      right[i] /= l_(i, i);
    }
    return right;
  }

 private:
  Eigen::Matrix<double, Size, Size> l_;  // the factor, below and on the diagonal
};

/// Solves small linear equations by elimination with partial pivoting.
template <int Size>
Eigen::Matrix<double, Size, 1> eliminate(Eigen::Matrix<double, Size, Size> a,
                                         Eigen::Matrix<double, Size, 1> right) noexcept {
  for (int k = 0; k < Size; ++k) {
    int pivot = k;
    for (int i = k + 1; i < Size; ++i)
      if (std::fabs(a(i, k)) > std::fabs(a(pivot, k))) pivot = i;
    for (int j = k; j < Size; ++j) std::swap(a(k, j), a(pivot, j));
    std::swap(right[k], right[pivot]);
    for (int i = k + 1; i < Size; ++i) {
      const double factor = a(i, k) / a(k, k);
      for (int j = k + 1; j < Size; ++j) a(i, j) -= factor * a(k, j);
      right[i] -= factor * right[k];
    }
  }
  for (int i = Size - 1; i >= 0; --i) {
    for (int j = i + 1; j < Size; ++j) right[i] -= a(i, j) * right[j];
    right[i] /= a(i, i);
  }
  return right;
}

template <int Dof>
Eigen::Vector2d slip_of(const BodyContact<Dof>& c, const Eigen::Matrix<double, Dof, 1>& u) noexcept {
  Eigen::Vector2d slip = c.jacobian * u - c.ground_velocity;
  if (c.axes == 1) slip[1] = 0.0;
  return slip;
}

template <int Dof>
void set_displacements(double dt_s, const Eigen::Matrix<double, Dof, 1>& u,
                       Span<const BodyContact<Dof>> contacts, Span<Motion> motions) noexcept {
  for (const BodyContact<Dof>& c : contacts) {
    const Eigen::Vector2d slip = slip_of<Dof>(c, u);
    motions[c.index].displacement[0] = dt_s * slip[0];
    motions[c.index].displacement[1] = dt_s * slip[1];
    motions[c.index].has_velocity = false;
  }
}

template <int Dof, class Contact, class AnyResponse, int Size>
void apply_forces(double dt_s, MovingBody<Dof>& body, const BodyVector<Dof>& external,
                  Span<const Contact> contacts, Span<const AnyResponse> responses,
                  double (AnyResponse::*force)[Size]) noexcept {
  Eigen::Matrix<double, Dof, 1> impulse = dt_s * external;
  for (const Contact& c : contacts) {
    Eigen::Matrix<double, Size, 1> f(responses[c.index].*force);
    if constexpr (Size == 2)
      if (c.axes == 1) f[1] = 0.0;
    impulse.noalias() += dt_s * c.jacobian.transpose() * f;
  }
  body.velocity += Cholesky<Dof>(body.mass).solve(impulse);
}

// Returns theta, the share of the new velocity in the displacement of a step, T ((1 - theta) u0 + theta u1).
// A half gives the right stopping distance; dampers that stop the body within the step need more, otherwise
// they would reverse it. For a body against a damper alone the exact value is 1 - theta = 1/c - 1/(e^c - 1),
// c = C T / m. This function is within 0.033 of it without an exponential, and never lets a damper reverse
// the velocity.
template <int Dof>
double implicit_share(double dt_s, const MovingBody<Dof>& body,
                      Span<const BodyContact<Dof>> contacts) noexcept {
  const Cholesky<Dof> mass(body.mass);
  double c = 0.0;  // bound on the fastest decay of the velocity by damping
  for (const BodyContact<Dof>& contact : contacts) {
    double mobility = 0.0;
    for (int a = 0; a < contact.axes; ++a) {
      const Eigen::Matrix<double, Dof, 1> row = contact.jacobian.row(a).transpose();
      mobility = std::max(mobility, row.dot(mass.solve(row)));
    }
    c += dt_s * contact.damping * mobility;
  }
  return 1.0 - (1.0 + c / 3.0) / (2.0 + c + c * c / 3.0);
}

// Solves the equation of motion, linear in the contacts' forces, stiffnesses and dampings, and repeats while
// a contact exceeds its force limit, with that contact's force fixed at the limit. Returns the mean (1 -
// theta) u0 + theta u1 of the velocities before (u0) and after (u1) the step.
template <int Dof>
Eigen::Matrix<double, Dof, 1> predict_velocity(double dt_s, const MovingBody<Dof>& body,
                                               const BodyVector<Dof>& external,
                                               Span<BodyContact<Dof>> contacts) noexcept {
  using Vector = Eigen::Matrix<double, Dof, 1>;
  using Matrix = Eigen::Matrix<double, Dof, Dof>;
  const double theta = implicit_share<Dof>(dt_s, body, contacts);
  Vector mean = body.velocity;
  // Repeats the solution. Each pass sets contacts above their force limit to that limit, where they stay.
  for (std::size_t pass = 0; pass <= contacts.size(); ++pass) {
    Matrix a = body.mass;
    Vector b = body.mass * body.velocity + theta * dt_s * external;
    for (const BodyContact<Dof>& c : contacts) {
      Eigen::Matrix<double, 2, Dof> jacobian = c.jacobian;
      if (c.axes == 1) jacobian.row(1).setZero();
      const double gain = theta * dt_s * c.linear.slope()[0];
      a.noalias() += gain * jacobian.transpose() * jacobian;
      b.noalias() += jacobian.transpose() * (theta * dt_s * c.linear.steady + gain * c.ground_velocity);
    }
    mean = Cholesky<Dof>(a).solve(b);
    bool released = false;
    for (BodyContact<Dof>& c : contacts) released = c.linear.release(slip_of<Dof>(c, mean)) || released;
    if (!released) break;
  }
  return mean;
}

// Sets the damping of contacts that strengthen with speed to its value at the velocity u; returns whether a
// value changed. The force of strengthening hardly depends on speed, so the damping at the old, higher
// velocity would be too weak to stop a body within the step. The force's potential is concave in the squared
// speed, so the potential of the linear problem lies above it and repeated solves converge.
template <int Dof>
bool strengthen(const PatchBatch& batch, const Eigen::Matrix<double, Dof, 1>& u,
                Span<BodyContact<Dof>> contacts, Span<const Motion> motions) noexcept {
  constexpr double tolerance = 1e-6;
  bool changed = false;
  for (BodyContact<Dof>& c : contacts) {
    const Motion& m = motions[c.index];
    const double damping =
        c.plain_damping + batch.strengthening_damping(m.id, m.normal_load, slip_of<Dof>(c, u).norm());
    changed = changed || std::fabs(damping - c.damping) > tolerance * damping;
    c.damping = damping;
  }
  return changed;
}

// Corrects contacts that age. Their force limit assumes a long rest, but they may slide with far less force,
// so a spring up to that limit would stop a body that really slides. Evaluates the force of each contact at
// its displacement with the velocity u. If the force was clipped, it becomes the limit; otherwise a secant
// replaces the spring. Returns whether a contact changed.
template <int Dof>
bool try_forces(PatchBatch& batch, double dt_s, const Eigen::Matrix<double, Dof, 1>& u,
                Span<BodyContact<Dof>> contacts, Span<const Motion> motions) noexcept {
  constexpr double small = 1e-3;
  bool changed = false;
  for (BodyContact<Dof>& c : contacts) {
    if (!c.ages) continue;
    const Eigen::Vector2d slip = dt_s * slip_of<Dof>(c, u);
    if (!(slip.squaredNorm() > 0.0)) continue;
    Motion trial = motions[c.index];
    for (int a = 0; a < 2; ++a) trial.displacement[a] = slip[a];
    trial.has_velocity = false;
    const Response there = batch.find_force(dt_s, trial);
    const Eigen::Vector2d force(there.elastic[0], c.axes == 2 ? there.elastic[1] : 0.0);
    const bool clipped = c.linear.slips;
    double& taken = clipped ? c.force_limit : c.slope(0, 0);
    const double found =
        clipped ? force.norm() : std::max(slip.dot(c.trial_force - force) / slip.squaredNorm(), 0.0);
    if (found > (1.0 - small) * taken) continue;
    taken = found;
    changed = true;
  }
  return changed;
}

// Stands for `Follow` where the contacts' Jacobians do not depend on the velocity: it changes nothing.
struct FixedJacobians {
  template <class Vector>
  bool operator()(const Vector&) const noexcept {
    return false;
  }
};

// Predicts the mean (1 - theta) u0 + theta u1 of old and new velocity, as described in coupling.hpp.
// `motions` contains ids and loads. `follow` sets the contacts' Jacobians and ground velocities, where they
// depend on the body's velocity, and returns whether they changed much.
template <int Dof, class Follow = FixedJacobians>
Eigen::Matrix<double, Dof, 1> predict_mean_velocity(
    PatchBatch& batch, double dt_s, const MovingBody<Dof>& body, const BodyVector<Dof>& external,
    Span<BodyContact<Dof>> contacts, Span<const Motion> motions, const Follow& follow = {}) noexcept {
  follow(Eigen::Matrix<double, Dof, 1>(body.velocity));
  bool strengthens = false, ages = false;
  for (BodyContact<Dof>& c : contacts) {
    Motion rest = motions[c.index];
    const Eigen::Vector2d slip = slip_of<Dof>(c, body.velocity);
    for (int a = 0; a < 2; ++a) {
      rest.displacement[a] = 0.0;
      rest.velocity[a] = a < c.axes ? slip[a] : 0.0;
    }
    rest.has_velocity = true;
    const Response now = batch.find_force(dt_s, rest);
    c.trial_force = {now.elastic[0], c.axes == 2 ? now.elastic[1] : 0.0};
    c.slope(0, 0) = now.stiffness;
    c.damping = now.damping;
    c.force_limit = now.force_limit;
    const double strengthening = batch.strengthening_damping(rest.id, rest.normal_load, slip.norm());
    c.plain_damping = std::max(now.damping - strengthening, 0.0);
    strengthens = strengthens || strengthening > 0.0;
    c.ages = batch.ages(rest.id);
    ages = ages || c.ages;
  }
  const auto predict = [&] {
    for (BodyContact<Dof>& c : contacts) {
      c.linear = {};
      c.linear.steady = c.trial_force;
      c.linear.spring.setConstant(dt_s * c.slope(0, 0));
      c.linear.damping = c.damping;
      c.linear.limit = c.force_limit;
    }
    return predict_velocity<Dof>(dt_s, body, external, contacts);
  };
  Eigen::Matrix<double, Dof, 1> mean = predict();
  constexpr int most_turns = 4, most_trials = 4, most_solves = 60;
  for (int i = 0; i < most_turns && follow(mean); ++i) mean = predict();
  for (int i = 0; ages && i < most_trials; ++i) {
    if (!try_forces<Dof>(batch, dt_s, mean, contacts, motions)) break;
    mean = predict();
  }
  for (int i = 0; strengthens && i < most_solves; ++i) {
    if (!strengthen<Dof>(batch, mean, contacts, motions)) break;
    mean = predict();
  }
  return mean;
}

// Stopping rule of the midpoint solver. The relative residual must be below 1e-10 in the first evaluations
// and below 1e-7 after them, because forces in single precision change in small steps.
class Effort {
 public:
  explicit Effort(double force_scale) noexcept : force_scale_(force_scale) {}
  void count(double force) noexcept {
    ++evaluations_;
    force_scale_ = std::max(force_scale_, force);
  }
  bool thorough() const noexcept { return evaluations_ >= usual_evaluations; }
  bool unsolved(double residual) const noexcept {
    return thorough() ? residual > single_tolerance * force_scale_ && evaluations_ < most_evaluations
                      : residual > tolerance * force_scale_;
  }
  void begin_again() noexcept { evaluations_ = 0; }
  void add(const Effort& before) noexcept { evaluations_ += before.evaluations_; }
  SolveReport report(double residual) const noexcept {
    return {evaluations_, force_scale_ > 0.0 ? residual / force_scale_ : 0.0};
  }

 private:
  static constexpr int usual_evaluations = 8;
  static constexpr int most_evaluations = 50;
  // Largest relative residual of a solution: error over the largest force in the equation.
  static constexpr double tolerance = 1e-10;
  static constexpr double single_tolerance = 1e-7;  // tolerance from usual_evaluations evaluations on
  double force_scale_;
  int evaluations_ = 0;
};

// Finds the root of a falling function that is at most as steep as steepest_so_far(), which may grow with
// each evaluation. The search takes secant steps, none shorter than the bound requires. Once two points
// bracket the root, they stay between them, and a bisection replaces secants that do not shrink the interval.
// Where the function jumps through 0 there is no root, and the end with the smaller residual is taken.
template <class Residual, class Steepest>
double find_falling_root(const Residual& residual_at, double start, const Steepest& steepest_so_far,
                         const Effort& effort) noexcept {
  struct Point {
    double x, residual;
  };
  const auto at = [&](double x) { return Point{x, residual_at(x)}; };
  constexpr double no_end = std::numeric_limits<double>::infinity();
  Point last = at(start), best = last;
  // Ends of the interval that contains the root: residual > 0 at low, < 0 at high.
  Point low{-no_end, no_end}, high{no_end, -no_end};
  double slope = steepest_so_far();
  int slow = 0;  // number of steps in a row that did not halve the bracket
  while (effort.unsolved(std::fabs(best.residual))) {
    const double steepest = steepest_so_far();
    (last.residual > 0.0 ? low : high) = last;
    const bool bracketed = std::isfinite(low.x) && std::isfinite(high.x);
    const double width = high.x - low.x;
    const bool jump = bracketed && low.residual - high.residual > 2.0 * steepest * width;
    if (jump && effort.thorough()) break;
    double next = last.x + last.residual / slope;
    if (bracketed && (slow > 3 || !(next > low.x && next < high.x))) next = low.x + 0.5 * width;
    if (next == last.x || (bracketed && !(next > low.x && next < high.x)))
      break;  // stops where no double lies between the two ends
    const Point point = at(next);
    // Keeps the secant's slope within bounds. Rounding in tiny steps and falling branches of the friction
    // curve would give slopes of the wrong sign or size.
    slope = std::clamp((last.residual - point.residual) / (point.x - last.x), 1e-2 * steepest, steepest);
    const double left = point.residual > 0.0 ? high.x - point.x : point.x - low.x;
    slow = bracketed && left > 0.5 * width ? slow + 1 : 0;
    last = point;
    if (std::fabs(point.residual) < std::fabs(best.residual)) best = point;
  }
  return best.x;
}

/// Solves the midpoint rule M (u1 - u0) = T (f + sum of J^T F_mean(d)), d = T (J (u0 + u1) / 2 - g), for the
/// midpoint velocity (u0 + u1) / 2. `Follow` sets J and g of all contacts at a midpoint velocity, where they
/// depend on it.
template <int Dof, class Follow = FixedJacobians>
class MidpointSolver {
  using Vector = Eigen::Matrix<double, Dof, 1>;
  using Matrix = Eigen::Matrix<double, Dof, Dof>;

 public:
  MidpointSolver(PatchBatch& batch, double dt_s, const MovingBody<Dof>& body, const BodyVector<Dof>& external,
                 Span<BodyContact<Dof>> contacts, Span<Motion> motions, const Follow& follow = {}) noexcept
      : batch_(batch),
        dt_s_(dt_s),
        external_(external),
        start_(body.velocity),
        inertia_((2.0 / dt_s) * body.mass),
        mass_(body.mass),
        contacts_(contacts),
        motions_(motions),
        follow_(follow),
        effort_(weight_of(external_)) {}

  /// Solves the midpoint equation; writes the midpoint velocity into `u`, the displacements into the motions.
  SolveReport solve(Vector& u) noexcept {
    u = start_;
    const bool one_axis = contacts_.size() == 1 && contacts_[0].axes == 1;
    double residual = 0.0;
    if (Dof == 1)
      residual = solve_on_line(u, Vector::Ones());
    else
      residual = one_axis ? solve_on_line(u, contacts_[0].jacobian.row(0).transpose()) : solve_all(u);
    move_contacts(u);
    SolveReport report = effort_.report(residual);
    if (lacks_mean_) report.residual = std::numeric_limits<double>::infinity();
    return report;
  }

 private:
  // Smallest force, as a share of the normal load, to which the tolerance refers. Without it a body at rest
  // without force would have to be solved to an error of 0.
  static constexpr double load_share = 1e-3;

  // Returns the size of a force or torque in the norm sqrt(f M^-1 f), M the mass matrix, in which forces and
  // torques are comparable.
  double weight_of(const Vector& force) const noexcept {
    return std::sqrt(std::max(force.dot(mass_.solve(force)), 0.0));
  }

  void move_contacts(const Vector& u) noexcept {
    follow_(u);
    set_displacements<Dof>(dt_s_, u, contacts_, motions_);
  }

  // Returns the friction on the body at the midpoint velocity u. Writes each contact's force into trial_force
  // and bounds on its slope into stiffness and damping.
  Vector friction(const Vector& u) noexcept {
    move_contacts(u);
    Vector sum = Vector::Zero();
    Vector largest = Vector::Zero();
    for (BodyContact<Dof>& c : contacts_) {
      const Motion& motion = motions_[c.index];
      const Response response = batch_.find_force(dt_s_, motion);
      c.trial_force = {response.mean[0], c.axes == 2 ? response.mean[1] : 0.0};
      lacks_mean_ = lacks_mean_ || lacks_mean(response);
      c.stiffness = response.stiffness;
      c.damping = std::max(c.damping, response.damping);
      sum.noalias() += c.jacobian.transpose() * c.trial_force;
      largest.noalias() += c.jacobian.row(0).transpose() * (load_share * motion.normal_load);
    }
    effort_.count(std::max(weight_of(sum), weight_of(largest)));
    return sum;
  }
  Vector residual(const Vector& u) noexcept { return external_ + friction(u) - inertia_ * (u - start_); }

  // Returns an upper bound on how fast a contact's friction grows with the body's midpoint velocity. The mean
  // deflection of a stuck bristle changes by half the displacement; dampers get the whole velocity.
  double steepest(const BodyContact<Dof>& c) const noexcept { return 0.5 * dt_s_ * c.stiffness + c.damping; }

  // Solves for one number: the velocity of a body on a rail, or, where the only contact has one axis, the
  // velocity at the contact. `along`: its gradient by the body's velocity. The body then moves as if it had
  // the mass that a force along this gradient feels.
  double solve_on_line(Vector& u, const Vector& along) noexcept {
    const Vector per_force = mass_.solve(along);  // change of velocity per impulse along the gradient
    const double mobility = along.dot(per_force);
    const Vector free = start_ + 0.5 * dt_s_ * mass_.solve(external_);
    if (!(mobility > 0.0)) {  // contact that cannot move the body: only the external force acts
      u = free;
      return 0.0;
    }
    const Vector direction = per_force / mobility;
    const double free_velocity = along.dot(free), weight = std::sqrt(mobility);
    const auto body_at = [&](double velocity) -> Vector {
      return free + direction * (velocity - free_velocity);
    };
    forget_damping();
    double best = std::numeric_limits<double>::infinity();
    const auto at = [&](double velocity) {
      const double value = weight * direction.dot(residual(body_at(velocity)));
      best = std::min(best, std::fabs(value));
      return value;
    };
    const auto steepest_of_all = [&] {
      double sum = 2.0 / (dt_s_ * mobility);
      for (const BodyContact<Dof>& c : contacts_) {
        const double slip = c.jacobian.row(0).dot(direction);
        sum += steepest(c) * slip * slip;
      }
      return weight * sum;
    };
    u = body_at(find_falling_root(at, along.dot(start_), steepest_of_all, effort_));
    return best;
  }

  void forget_damping() noexcept {
    for (BodyContact<Dof>& c : contacts_) c.damping = 0.0;
  }
  // Sets the slope of each contact's friction against velocity to `factor` times its upper bound, as a start
  // of Broyden's method.
  void set_steepest(double factor) noexcept {
    for (BodyContact<Dof>& c : contacts_) c.slope = Eigen::Matrix2d::Identity() * (factor * steepest(c));
  }
  void keep_trial() noexcept {
    for (BodyContact<Dof>& c : contacts_) c.force = c.trial_force;
  }
  // Corrects the slope of each contact's friction by the change of its force in this step (Broyden's method);
  // the body's inertia needs no correction.
  void learn(const Vector& step) noexcept {
    for (BodyContact<Dof>& c : contacts_) {
      Eigen::Vector2d slip = c.jacobian * step;
      if (c.axes == 1) slip[1] = 0.0;
      const double squared = slip.squaredNorm();
      if (!(squared > 0.0)) continue;
      const Eigen::Vector2d error = c.force - c.trial_force - c.slope * slip;
      c.slope += error * slip.transpose() / squared;
    }
  }
  Matrix slope_of_residual() const noexcept {
    Matrix a = inertia_;
    for (const BodyContact<Dof>& c : contacts_) {
      if (c.axes == 2) {
        a.noalias() += c.jacobian.transpose() * c.slope * c.jacobian;
      } else {
        a.noalias() += c.jacobian.row(0).transpose() * c.slope(0, 0) * c.jacobian.row(0);
      }
    }
    return a;
  }

  // Solves the midpoint equation from the velocity before the step. If stiff bristles stop a body far short
  // of where it would go, the search from there does not converge; it then restarts from the velocity at
  // which the bristles stop the body.
  double solve_all(Vector& u) noexcept {
    const double norm = solve_from(u);
    if (!(effort_.report(norm).residual > 0.05)) return norm;
    Vector sticking = sticking_velocity();
    const Effort spent = effort_;
    effort_.begin_again();
    const double its_norm = solve_from(sticking);
    effort_.add(spent);
    if (!(its_norm < norm)) return norm;
    u = sticking;
    return its_norm;
  }

  // Returns the midpoint velocity of a body that its contacts stop: all resist with the upper bounds of their
  // slopes.
  Vector sticking_velocity() noexcept {
    set_steepest(1.0);
    Vector pull = Vector::Zero();
    for (const BodyContact<Dof>& c : contacts_)
      pull.noalias() -= c.jacobian.transpose() * (c.slope * slip_of<Dof>(c, start_));
    return start_ + eliminate<Dof>(slope_of_residual(), pull);
  }

  // Searches by Broyden's method with a slope for each contact. The slopes start at their bounds. The search
  // restarts from the best point whenever the residual does not shrink; a second restart in a row means that
  // the friction jumps there.
  double solve_from(Vector& u) noexcept {
    forget_damping();
    Vector r = residual(u);
    double norm = weight_of(r);
    keep_trial();
    double factor = 1.0;
    set_steepest(factor);
    bool fresh = true;
    while (effort_.unsolved(norm)) {
      Vector step = eliminate<Dof>(slope_of_residual(), r);
      // Resets the slopes to their bounds if a step is far too long. Slopes learnt across a jump of the
      // friction may be far too small.
      const double length = std::sqrt(0.5 * dt_s_ * step.dot(inertia_ * step));
      if (!fresh && !(length <= 1e2 * 0.5 * dt_s_ * norm)) {
        set_steepest(factor);
        fresh = true;
        step = eliminate<Dof>(slope_of_residual(), r);
      }
      const Vector trial = u + step;
      if (trial == u) break;
      const Vector trial_residual = residual(trial);
      const double trial_norm = weight_of(trial_residual);
      if (trial_norm < norm) {
        learn(step);
        keep_trial();
        fresh = false;
        u = trial;
        r = trial_residual;
        norm = trial_norm;
      } else {
        if (fresh) {
          if (effort_.thorough()) break;
          factor *= 2.0;
        }
        set_steepest(factor);
        fresh = true;
      }
    }
    return norm;
  }

  PatchBatch& batch_;
  double dt_s_;
  Vector external_, start_;
  Matrix inertia_;  // inertia matrix of the midpoint equation, 2 M / T
  Cholesky<Dof> mass_;
  Span<BodyContact<Dof>> contacts_;
  Span<Motion> motions_;
  Follow follow_;
  Effort effort_;
  bool lacks_mean_ = false;  // whether a patch has a force but no mean force
};

}  // namespace detail
}  // namespace bristle
