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
  /// Factor by which a length across the lay is stretched when it is mapped to isotropic axes: stiffness
  /// ratio over limit ratio.
  double stretch = 1.0;
  double limit = 1.0;  ///< force across the lay over the force in isotropic axes: Lay::limit_ratio
  /// Elastic energy of a deflection across the lay over the energy computed for it in isotropic axes; 1 if
  /// the stiffness ratio is the limit ratio squared.
  double energy = 1.0;
  /// Asymmetry of the limit: (1 + lean) times the material's limit for motion along the lay, and (1 - lean)
  /// times for motion against it.
  double lean = 0.0;
  double stiffest = 1.0;   ///< largest stiffness of any direction, divided by the material's
  double strongest = 1.0;  ///< largest limit of any direction, divided by the material's

  bool is_isotropic() const noexcept { return stretch == 1.0 && limit == 1.0 && lean == 0.0; }
  /// Returns whether energies differ from those computed in isotropic axes. If so, the dissipated energy of a
  /// step is computed as its work less the change of stored energy.
  bool books_work() const noexcept { return energy != 1.0 || lean != 0.0; }
  /// Returns the least energy that a slide can dissipate, over all directions of motion, as a factor of the
  /// energy computed in isotropic axes. It is above 0, so every slide takes energy.
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

/// Calculates the map to isotropic axes for a lay that check_lay() has accepted.
LayMap map_of(const Lay& lay) noexcept;
/// Checks that a patch of this material and these options can have this lay, and throws bristle::Error if
/// not.
void check_lay(const Material& material, const PatchOptions& chosen);

}  // namespace bristle::detail
