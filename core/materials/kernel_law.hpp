// A material prepared for the kernels: its lengths in scaled units, and the constants by which kernels sample
// its snap lengths.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "bristle/material.hpp"
#include "core/kernel_table.hpp"
#include "core/materials/renewal_law.hpp"
#include "core/materials/strata.hpp"

namespace bristle::detail {

class BrushCells;

/// Material with its constants in scaled lengths. Made once per material on the thread that adds patches,
/// then never changed, and shared by patches.
struct CompiledMaterial {
  Material material;
  double metres_per_length = 1.0;  ///< m per scaled length: a power of two near the mean snap length
  double lengths_per_metre = 1.0;
  double shortest = 0.0;  ///< bounds of every snap length, scaled: `shortest` and `longest`
  double longest = 0.0;
  double residual = 0.0;   ///< Material::residual_length in scaled lengths
  double snap_rate = 0.0;  ///< snaps of a bristle per scaled length of steady sliding, without ageing
  double kinetic = 0.0;    ///< mean deflection in slow steady sliding, scaled; without ageing
  /// Whether steps need the redraw kernels. They do if the rule is redraw and the spread is not negligible.
  bool redraw = false;
  /// Whether the law is a single length. All bristles then stay in phase for ever and errors do not average
  /// out, so remainders of a path are computed in double at every speed.
  bool single_length = false;
  /// Peak friction over normal load without ageing, from which the force limit follows.
  double peak_coefficient = 0.0;
  std::uint64_t hash = 0;  ///< hash of all parameters of the material
  /// Constants of the law, for kernels that sample lengths. It points into `table` and `biased_table`;
  /// make_sampling_tables() fills all three members.
  mutable KernelLaw law{};

  mutable std::vector<double> table, biased_table;
  /// Snap lengths at the 128 probabilities spread_share(k), scaled, which stand for the law in sums with
  /// ageing; empty without ageing.
  std::vector<double> spread;

  /// Makes the tables from which representatives with SnapRule::redraw sample their lengths, unless they
  /// exist: it takes milliseconds. The infinite brush does not need them. Any thread that adds patches may
  /// call it.
  void make_sampling_tables() const;
  /// Returns the constants of shared renewal (a snap makes other bristles start afresh): the path after which
  /// a slide is steady, and how often renewed bristles snap again. The first call computes them.
  const RenewalLaw& renewal() const;

  /// Returns the cells of the survival function for infinite brushes, which the first call computes. Any
  /// thread that adds patches may call it.
  const BrushCells& brush_cells() const;

  /// Returns the law as n strata (a few weighted lengths), for SnapRule::slide. Strata are remembered, so
  /// only the first call with this n computes them; any thread may call it.
  std::shared_ptr<const Strata> strata(std::uint32_t n) const;

  CompiledMaterial() = default;
  CompiledMaterial(const CompiledMaterial&) = delete;
  CompiledMaterial& operator=(const CompiledMaterial&) = delete;

 private:
  void fill_sampling_tables() const;
  mutable std::once_flag sampling_made_;
  mutable std::once_flag brush_cells_made_;
  mutable std::shared_ptr<const BrushCells> brush_cells_;
  mutable std::once_flag renewal_made_;
  mutable RenewalLaw renewal_;
  mutable std::mutex strata_lock_;
  mutable std::map<std::uint32_t, std::shared_ptr<const Strata>> strata_;
};

/// Number of quantiles that stand for a law in sums over it. Their probabilities spread_share(k) are t^3 (10
/// - 15 t + 6 t^2) at the midpoints of equal steps of t, so they lie close together at both ends of the law.
inline constexpr int spread_size = 128;
double spread_share(int k) noexcept;
double spread_weight(int k) noexcept;

/// Calculates the constants by which bristles jump over many snaps at once, from the moments 0 to 5 of the
/// path between two snaps (moment[0] is 1).
void fill_jump_sums(const double (&moment)[6], KernelLaw& law) noexcept;
/// Calculates the constants for jumping over k snaps at once under a narrow law, and on which paths such
/// jumps are allowed.
void fill_narrow_jumps(const double (&moment)[6], double cv, KernelLaw& law) noexcept;

/// Checks a material and prepares it for the kernels. Throws bristle::Error for a parameter out of range.
std::shared_ptr<const CompiledMaterial> compile_material(const Material& material);

}  // namespace bristle::detail
