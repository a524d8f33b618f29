#include "core/patches/lay.hpp"

#include <algorithm>
#include <cmath>

#include "core/common/check_fields.hpp"

namespace bristle {

bool operator==(const Lay& x, const Lay& y) noexcept { return detail::same_fields(x, y); }

namespace detail {
namespace {

/// Returns the largest distance from the origin to the ellipse of force limits, which is the highest force in
/// any direction. Its half axes are 1 along the lay and `limit` across, its centre is at (lean, 0).
double find_strongest(double limit, double lean) noexcept {
  const double wide = limit * limit - 1.0, off = std::abs(lean);
  // Finds the point of the ellipse at the largest distance. The squared distance (x + off)^2 + limit^2 (1 -
  // x^2) is largest at x = off / (limit^2 - 1) if limit^2 - 1 exceeds `off`, otherwise at the end x = 1.
  const double x = wide > off ? off / wide : 1.0;
  return std::sqrt(square(x + off) + square(limit) * (1.0 - x * x));
}

}  // namespace

LayMap map_of(const Lay& lay) noexcept {
  LayMap map;
  map.limit = lay.limit_ratio;
  map.stretch = lay.stiffness_ratio > 0.0 ? lay.stiffness_ratio / lay.limit_ratio : lay.limit_ratio;
  map.energy = map.limit / map.stretch;
  map.lean = (lay.to_over_fro - 1.0) / (lay.to_over_fro + 1.0);
  if (map.is_isotropic()) return LayMap{};
  map.along = turn_by(lay.angle);
  map.stiffest = std::max(1.0, map.limit * map.stretch);
  map.strongest = find_strongest(map.limit, map.lean);
  return map;
}

void check_lay(const Material& m, const PatchOptions& chosen) {
  constexpr const char* where = "PatchOptions";
  const Lay& lay = chosen.lay;
  const LayMap map = map_of(lay);
  if (map.is_isotropic()) return;
  if (chosen.axes == 1 && (lay.angle != 0.0 || map.limit != 1.0 || map.stretch != 1.0))
    refuse(where, "axes", chosen.axes, "2 with a lay, but for lay.to_over_fro, which one axis along it has");
  if (map.energy != 1.0) {
    if (chosen.population == Population::infinite)
      refuse(where, "lay.stiffness_ratio", lay.stiffness_ratio,
             "0 (limit_ratio squared) with population infinite, whose merged cohorts keep the energy of both "
             "axes as one; or take Population::representatives");
    if (m.residual_length != 0.0)
      refuse(
          where, "lay.stiffness_ratio", lay.stiffness_ratio,
          "0 (limit_ratio squared) with Material::residual_length: a bristle that snaps from the softer axis "
          "to a residual along the stiffer one would gain energy");
  }
  if (map.lean == 0.0) return;
  if (m.snap_rule != SnapRule::slide || m.drop != 0.0 || m.ageing_strength != 0.0)
    refuse(
        where, "lay.to_over_fro", lay.to_over_fro,
        "1, or SnapRule::slide without drop and ageing: else a bristle's limit is no fixed ellipse about a "
        "point beside its root, so there is no bound on snapping");
  if (map.energy != 1.0)
    refuse(where, "lay.to_over_fro", lay.to_over_fro,
           "1 unless stiffness_ratio is 0 (limit_ratio squared): else sliding could give energy");
}

}  // namespace detail
}  // namespace bristle
