// Friction that depends on the direction of motion (struct Lay: grooves, fibres, hair). Motions are mapped to
// axes in which the bristles of a patch are isotropic, and forces are mapped back.
#pragma once

#include "bristle/material.hpp"
#include "bristle/patch.hpp"
#include "core/common/hashing.hpp"
#include "core/materials/turn.hpp"

namespace bristle::detail {

/// Map between the axes of a patch and its isotropic axes, in which kernels and bounds work. The first
/// isotropic axis runs along the lay (grain), the second across it. Lengths across are stretched so that
/// every bristle's limit is a circle.
struct LayMap {
  Turn along;  ///< direction of the lay (the grain of the surface) in the axes of the patch
  /// Factor of a length across the lay when it is mapped to isotropic axes: stiffness ratio over limit ratio.
  double stretch = 1.0;
  double limit = 1.0;  ///< force across the lay over the force in isotropic axes: Lay::limit_ratio
  /// Elastic energy of a deflection across the lay over that in isotropic axes; 1 if the stiffness ratio is
  /// the limit ratio squared.
  double energy = 1.0;
  /// Asymmetry of the limit: (1 + lean) times the material's limit for motion along the lay, and (1 - lean)
  /// times for motion against it.
  double lean = 0.0;
  double stiffest = 1.0;   ///< largest stiffness of any direction, divided by the material's
  double strongest = 1.0;  ///< largest limit of any direction, divided by the material's

  bool is_isotropic() const noexcept { return stretch == 1.0 && limit == 1.0 && lean == 0.0; }
  /// Returns whether energies differ from those in isotropic axes. Then the dissipated energy of a step is
  /// computed as its work less the change of stored energy.
  bool books_work() const noexcept { return energy != 1.0 || lean != 0.0; }
  /// Returns the least energy that a slide can dissipate, over all directions of motion, divided by the
  /// energy computed in isotropic axes.
  double least_loss() const noexcept { return (energy < 1.0 ? energy : 1.0) * (1.0 - magnitude(lean)); }

  void to_isotropic(const double (&real)[2], double (&isotropic)[2]) const noexcept {
    isotropic[0] = along.cosine * real[0] + along.sine * real[1];
    isotropic[1] = stretch * (along.cosine * real[1] - along.sine * real[0]);
  }
  void to_real_force(double (&force)[2]) const noexcept {
    const double across[2] = {force[0], limit * force[1]};
    along.apply(across, force);
  }
  void to_real_length(double& x, double& y) const noexcept {
    const double isotropic[2] = {x, y / stretch};
    double real[2];
    along.apply(isotropic, real);
    x = real[0];
    y = real[1];
  }
  void add_to(Hasher& hasher) const noexcept {
    for (const double x : {along.cosine, along.sine, stretch, limit, lean}) hasher.add(x);
  }
};

/// Returns the map to isotropic axes for a lay that check_lay() has accepted.
LayMap map_of(const Lay& lay) noexcept;
/// Throws bristle::Error for a lay that a patch of this material and these options cannot have.
void check_lay(const Material& material, const PatchOptions& chosen);

}  // namespace bristle::detail
