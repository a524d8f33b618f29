// The friction of a patch as a linear equation, and the equations of bodies that touch on many patches: what
// coupling.hpp and solvers of engines have in common. Header-only, over Eigen: link bristle::eigen. Not part
// of bristle.hpp.
//
// An engine treats a patch as a spring and a damper that act at the end of the step, and a patch whose spring
// exceeds the force limit as a constant force. Either it solves all bodies at once (BodySystem), and again
// after each release():
//
//   do {
//     ... masses and constraints into `system`
//     for (contacts) system.add(columns, rows, share * f.slope().asDiagonal(), share * f.force(s0));
//     system.solve(change);
//   } while (some f.release(slip after the change));
//
// or it sweeps over the contacts (LinearFriction::impulse). Where the springs may not hold, a secant from the
// patch's own answer to the slip found so far takes their place (LinearFriction::through).
//
// Equations: core/MODEL.md, section 21. Nothing here locks; only BodySystem allocates.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <Eigen/Core>
#include <Eigen/LU>

#include "bristle/patch.hpp"

namespace bristle {

/// Linear model of a patch's force on a body under one normal load: steady - (spring + damping) s at the slip
/// velocity s.
struct LinearFriction {
  using Vector = Eigen::Matrix<double, 2, 1, Eigen::DontAlign>;
  Vector steady = Vector::Zero();  ///< force at rest, N
  Vector spring = Vector::Zero();  ///< part of the slope along each axis that comes from stiffness, N s/m
  double damping = 0.0;            ///< part of the slope that comes from dampers, N s/m
  double limit = 0.0;              ///< largest elastic force, N
  double load = 0.0;               ///< normal load for which the model holds, N
  bool bounded = true;             ///< whether the elastic force may not exceed the limit
  bool slips = false;              ///< whether release() has set the elastic force to the limit

  LinearFriction() = default;
  /// Makes spring and damper of a patch from its response `rest` to no displacement in a step of dt_s.
  /// `scale`: friction coefficient of the contact over the coefficient of the patch's material.
  LinearFriction(const Response& rest, double dt_s, double normal_load, double scale = 1.0) noexcept
      : steady(scale * rest.elastic[0], scale * rest.elastic[1]),
        spring(Vector::Constant(scale * dt_s * rest.stiffness)),
        damping(scale * rest.damping),
        limit(scale * rest.force_limit),
        load(normal_load) {}

  /// Makes the line through the answer `there` of a patch to the slip velocity `slip` (m/s). Its slope is the
  /// secant from `rest`, the elastic force without slip under this load (N), because the tangent, 0 in
  /// sliding, would brake a solver's iterations. `axes`: stiffness along each axis over the mean of both.
  static LinearFriction through(const Response& there, const Vector& rest, const Vector& slip, double dt_s,
                                double normal_load, double scale = 1.0,
                                const Vector& axes = Vector::Ones()) noexcept {
    const Vector d = dt_s * slip;
    const double squared = d.dot(axes.cwiseProduct(d));
    const Vector lost = rest - Vector(there.elastic[0], there.elastic[1]);
    const double stiffness =
        squared > 0.0 ? std::clamp(lost.dot(d) / squared, 0.0, there.stiffness) : there.stiffness;
    LinearFriction line;
    line.spring = scale * dt_s * stiffness * axes;
    line.damping = scale * there.damping;
    line.steady = scale * Vector(there.end[0], there.end[1]) + line.slope().cwiseProduct(slip);
    line.limit = scale * there.force_limit;
    line.load = normal_load;
    line.bounded = false;
    return line;
  }

  /// Returns the fall of the friction per slip velocity along each axis, N s/m.
  Vector slope() const noexcept { return spring + Vector::Constant(damping); }
  Vector force(const Vector& slip) const noexcept { return steady - slope().cwiseProduct(slip); }

  /// Lets the patch slip if its elastic force at this slip velocity exceeds the limit. The patch then pulls
  /// with the limit in the direction of that force, and only its damper depends on the slip. Returns whether
  /// the patch slips.
  bool release(const Vector& slip) noexcept {
    if (slips || !bounded || !(spring.maxCoeff() > 0.0)) return false;
    const Vector elastic = steady - spring.cwiseProduct(slip);
    const double size = elastic.norm();
    if (!(size > limit)) return false;
    steady = elastic * (limit / size);
    spring.setZero();
    return slips = true;
  }

  /// Returns the friction impulse (N s) that is consistent with the slip it leaves while other contacts stay,
  /// for a solver that sweeps over contacts. `normal`: normal impulse of the step, N s, to which the friction
  /// is proportional. `mobility`: change of the slip per impulse, 1/kg. `free`: slip without the impulse,
  /// m/s. Bristles that a falling load lifts lose their force; those that a rising load adds are straight.
  Vector impulse(double normal, double dt_s, const Eigen::Matrix2d& mobility,
                 const Vector& free) const noexcept {
    const double share = normal / load;  // duration of the step, s, scaled by the change of the load
    const auto solve = [&](const Vector& held, const Vector& per_slip) -> Vector {
      const Eigen::Matrix2d system = Eigen::Matrix2d::Identity() + (share * per_slip).asDiagonal() * mobility;
      return system.inverse() * (held - (share * per_slip).cwiseProduct(free));
    };
    const Vector found = solve(std::min(share, dt_s) * steady, slope());
    if (!bounded) return found;
    const Vector elastic = found + share * damping * (free + mobility * found);
    const double size = elastic.norm();
    if (!(size > share * limit)) return found;
    return solve(share * limit / size * elastic, Vector::Constant(damping));
  }
};

/// Linear equations for the changes of velocity of bodies that touch: a symmetric positive matrix of masses,
/// and of the gain of friction and other contact forces. Each line is stored from its first entry on (skyline
/// storage), which is short for stacks of bodies. With six unknowns a body this takes less than half the time
/// of Eigen's SimplicialLLT, analysis included.
class BodySystem {
 public:
  /// Starts new equations with `size` unknowns. Only the diagonal of the matrix has entries until couple()
  /// makes room for more.
  void begin(int size) {
    first_.resize(static_cast<std::size_t>(size));
    for (int i = 0; i < size; ++i) first_[static_cast<std::size_t>(i)] = i;
  }
  /// Makes room for an entry in line i and column j (j <= i) of the matrix. Call it for all entries before
  /// set_zero().
  void couple(int i, int j) { first(i) = std::min(first(i), j); }
  /// Makes room for the entries of a contact that joins the unknowns columns[0] to columns[count - 1].
  void couple(const int* columns, std::size_t count) {
    int low = size();
    for (std::size_t k = 0; k < count; ++k)
      if (columns[k] >= 0) low = std::min(low, columns[k]);
    for (std::size_t k = 0; k < count; ++k)
      if (columns[k] >= 0) couple(columns[k], low);
  }
  /// Allocates the entries of the matrix, and sets them and the right-hand side to 0. Call it after the last
  /// couple().
  void set_zero() {
    start_.clear();
    std::size_t entries = 0;
    for (int i = 0; i < size(); ++i) {
      start_.push_back(entries);
      entries += static_cast<std::size_t>(i + 1 - first(i));
    }
    entries_.assign(entries, 0.0);
    right.setZero(size());
  }
  int size() const { return static_cast<int>(first_.size()); }
  std::size_t entries() const { return entries_.size(); }
  /// Returns a pointer to line i, such that line(i)[j] is the entry in column j.
  double* line(int i) {
    return entries_.data() + start_[static_cast<std::size_t>(i)] - static_cast<std::size_t>(first(i));
  }

  /// Adds a contact to the equations: its force is pull - gain (rows u), so rows' gain rows is added to the
  /// matrix and rows' pull to the right-hand side (' is the transpose). columns[k] is the unknown of column k
  /// of `rows`; -1 if that cannot move. Pass force and gain multiplied by the time step.
  template <int forces, int size>
  void add(const int* columns, const Eigen::Ref<const Eigen::Matrix<double, forces, size>>& rows,
           const Eigen::Matrix<double, forces, forces>& gain, const Eigen::Matrix<double, forces, 1>& pull) {
    const Eigen::Index n = rows.cols();
    for (Eigen::Index i = 0; i < n; ++i) {
      if (columns[i] < 0) continue;
      const Eigen::Matrix<double, forces, 1> weighted = gain * rows.col(i);
      double* const to = line(columns[i]);
      for (Eigen::Index k = 0; k < n; ++k)
        if (columns[k] >= 0 && columns[k] <= columns[i]) to[columns[k]] += weighted.dot(rows.col(k));
      right[columns[i]] += pull.dot(rows.col(i));
    }
  }

  /// Replaces the matrix by its Cholesky factor. Call it before substitute().
  void factor() {
    for (int i = 0; i < size(); ++i) {
      double* const a = line(i);
      for (int j = first(i); j < i; ++j) {
        const double* const b = line(j);
        a[j] = (a[j] - dot(a, b, std::max(first(i), first(j)), j)) / b[j];
      }
      a[i] = std::sqrt(a[i] - dot(a, a, first(i), i));
    }
  }
  /// Replaces the right-hand side of the equations by their solution. Call it after factor().
  void substitute() {
    for (int i = 0; i < size(); ++i) {
      const double* const a = line(i);
      right[i] = (right[i] - dot(a, right.data(), first(i), i)) / a[i];
    }
    for (int i = size() - 1; i >= 0; --i) {
      const double* const a = line(i);
      right[i] /= a[i];
      for (int j = first(i); j < i; ++j) right[j] -= right[i] * a[j];
    }
  }

  Eigen::VectorXd right;  ///< right-hand side; after substitute() the changes of velocity

 private:
  int& first(int i) { return first_[static_cast<std::size_t>(i)]; }
  static double dot(const double* a, const double* b, int from, int to) {
    return Eigen::Map<const Eigen::VectorXd>(a + from, to - from)
        .dot(Eigen::Map<const Eigen::VectorXd>(b + from, to - from));
  }

  std::vector<int> first_;
  std::vector<std::size_t> start_;
  std::vector<double> entries_;
};

}  // namespace bristle
