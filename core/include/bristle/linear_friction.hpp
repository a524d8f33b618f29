// The friction of a patch as a linear equation, and the equations of bodies that touch on many patches: what
// coupling.hpp and solvers of engines have in common. Header-only, over Eigen: link bristle::eigen. Not part
// of bristle.hpp.
//
// An engine treats a patch as a spring and a damper that act at the end of the step, and a patch whose spring
// exceeds the force limit as a constant force. Either it solves all bodies at once (BodySystem), and again
// after each release():
//
//   system.begin(unknowns);  // then couple() the unknowns of each contact
//   do {
//     system.set_zero();
//     ... masses into system.line(i), forces times the time step into system.right
//     for (contacts) system.add(columns, levers, share * f.slope().asDiagonal(), share * f.force(s0));
//     system.factor();
//     system.substitute();  // system.right is now the change of velocity
//   } while (some f.release(slip after the change));
//
// or it sweeps over the contacts (LinearFriction::impulse). Where the springs may slip, a secant from the
// patch's own answer to the slip found so far replaces them (LinearFriction::through).
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
  double load = 0.0;               ///< normal load for which the model is valid, N
  bool limited = true;             ///< whether the elastic force may not exceed the limit
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
    line.limited = false;
    return line;
  }

  /// Returns the fall of the friction per slip velocity along each axis, N s/m.
  Vector slope() const noexcept { return spring + Vector::Constant(damping); }
  Vector force(const Vector& slip) const noexcept { return steady - slope().cwiseProduct(slip); }

  /// Lets the patch slip if its elastic force at this slip velocity exceeds the limit. The patch then pulls
  /// with the limit in the direction of that force, and only its damper depends on the slip. Returns whether
  /// the patch slips.
  bool release(const Vector& slip) noexcept {
    if (slips || !limited || !(spring.maxCoeff() > 0.0)) return false;
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
    const auto solve = [&](const Vector& force, const Vector& per_slip) -> Vector {
      const Eigen::Matrix2d system = Eigen::Matrix2d::Identity() + (share * per_slip).asDiagonal() * mobility;
      return system.inverse() * (force - (share * per_slip).cwiseProduct(free));
    };
    const Vector found = solve(std::min(share, dt_s) * steady, slope());
    if (!limited) return found;
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
    std::fill_n(sum_.first, 2, -1);
  }
  int size() const { return static_cast<int>(first_.size()); }
  std::size_t entries() const { return entries_.size(); }
  /// Returns a pointer to line i, such that line(i)[j] is the entry in column j.
  double* line(int i) {
    return entries_.data() + start_[static_cast<std::size_t>(i)] - static_cast<std::size_t>(first(i));
  }

  /// Adds a contact to the equations: its force is pull - gain (levers' u), so levers gain levers' is added
  /// to the matrix and levers pull to the right-hand side (' is the transpose). `levers` has a line for each
  /// unknown and a column for each force; columns[i] is the unknown of line i, -1 if that cannot move. Pass
  /// force and gain multiplied by the time step.
  template <class Levers, class Gain, class Pull>
  void add(const int* columns, const Eigen::MatrixBase<Levers>& levers, const Gain& gain, const Pull& pull) {
    for (Eigen::Index i = 0; i < levers.rows(); ++i) {
      if (columns[i] < 0) continue;
      const Eigen::Matrix<double, Levers::ColsAtCompileTime, 1> weighted = gain * levers.row(i).transpose();
      double* const to = line(columns[i]);
      for (Eigen::Index k = 0; k < levers.rows(); ++k)
        if (columns[k] >= 0 && columns[k] <= columns[i]) to[columns[k]] += levers.row(k).dot(weighted);
      right[columns[i]] += levers.row(i).dot(pull);
    }
  }
  /// Adds a contact of one or two free bodies, whose six unknowns each begin at column first[0] and first[1];
  /// -1 if a body cannot move. Like add(), but faster: contacts of the same bodies, added one after another,
  /// are summed before they enter the matrix. `levers` has six lines for each body.
  template <class Levers, class Gain, class Pull>
  void add_bodies(const int (&first)[2], const Eigen::MatrixBase<Levers>& levers, const Gain& gain,
                  const Pull& pull) {
    constexpr int forces = Levers::ColsAtCompileTime;
    if (first[0] != sum_.first[0] || first[1] != sum_.first[1]) flush(first);
    const auto add_half = [&](int side, const Eigen::Matrix<double, 6, forces>& half) {
      const Eigen::Matrix<double, forces, 6> weighted = gain * half.transpose();
      sum_.own[side] += half.lazyProduct(weighted);
      sum_.pull[side] += half.lazyProduct(pull);
      return weighted;
    };
    if constexpr (Levers::RowsAtCompileTime == 6) {
      add_half(0, levers);
    } else {
      static_assert(Levers::RowsAtCompileTime == 12, "one or two bodies");
      const Eigen::Matrix<double, 6, forces> half = levers.template bottomRows<6>();
      if (first[0] >= 0) {
        const Eigen::Matrix<double, forces, 6> weighted = add_half(0, levers.template topRows<6>());
        if (first[1] >= 0) sum_.between += half.lazyProduct(weighted);
      }
      if (first[1] >= 0) add_half(1, half);
    }
  }

  /// Replaces the matrix by its Cholesky factor, with the reciprocals of its diagonal. Call it before
  /// substitute().
  void factor() {
    flush({-1, -1});
    for (int i = 0; i < size(); ++i) {
      double* const a = line(i);
      for (int j = first(i); j < i; ++j) {
        const double* const b = line(j);
        a[j] = (a[j] - dot(a, b, std::max(first(i), first(j)), j)) * b[j];
      }
      a[i] = 1.0 / std::sqrt(a[i] - dot(a, a, first(i), i));
    }
  }
  /// Replaces the right-hand side of the equations by their solution. Call it after factor().
  void substitute() {
    for (int i = 0; i < size(); ++i) {
      const double* const a = line(i);
      right[i] = (right[i] - dot(a, right.data(), first(i), i)) * a[i];
    }
    for (int i = size() - 1; i >= 0; --i) {
      const double* const a = line(i);
      right[i] *= a[i];
      for (int j = first(i); j < i; ++j) right[j] -= right[i] * a[j];
    }
  }

  Eigen::VectorXd right;  ///< right-hand side; after substitute() the changes of velocity

 private:
  /// Sum of the contacts of one pair of bodies that are not in the matrix yet.
  struct Sum {
    int first[2] = {-1, -1};  ///< first unknown of each body, -1 if it cannot move
    Eigen::Matrix<double, 6, 6, Eigen::DontAlign> own[2], between;  ///< `between`: lines of body 1
    Eigen::Matrix<double, 6, 1, Eigen::DontAlign> pull[2];
  };

  int& first(int i) { return first_[static_cast<std::size_t>(i)]; }
  /// Returns the sum of a[k] b[k] for k from `from` to `to` - 1.
  static double dot(const double* a, const double* b, int from, int to) {
    double even = 0.0, odd = 0.0;
    for (; from + 1 < to; from += 2) {
      even += a[from] * b[from];
      odd += a[from + 1] * b[from + 1];
    }
    return from < to ? even + a[from] * b[from] + odd : even + odd;
  }
  /// Puts the sum of the contacts of two bodies into the matrix, and begins one of the bodies `next`.
  void flush(const int (&next)[2]) {
    for (int side = 0; side < 2; ++side) {
      const int at = sum_.first[side];
      if (at >= 0) {
        for (int i = 0; i < 6; ++i)
          for (int j = 0; j <= i; ++j) line(at + i)[at + j] += sum_.own[side](i, j);
        right.segment<6>(at) += sum_.pull[side];
      }
      sum_.own[side].setZero();
      sum_.pull[side].setZero();
    }
    const int a = sum_.first[0], b = sum_.first[1];
    for (int i = 0; a >= 0 && b >= 0 && i < 6; ++i)
      for (int j = 0; j < 6; ++j) (b > a ? line(b + i)[a + j] : line(a + j)[b + i]) += sum_.between(i, j);
    sum_.between.setZero();
    std::copy_n(next, 2, sum_.first);
  }

  std::vector<int> first_;
  std::vector<std::size_t> start_;
  std::vector<double> entries_;
  Sum sum_;
};

}  // namespace bristle
