// A material prepared for the kernels: scaled lengths and the constants of its snap-length law.
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
#include "core/materials/survival_table.hpp"

namespace bristle::detail {

/// A material with its constants in scaled lengths. Made once per material on the thread that adds patches;
/// never changed afterwards, and shared by patches.
struct CompiledMaterial {
  Material material;
  double metres_per_length = 1.0;  ///< m per scaled length: a power of two near the mean snap length
  double lengths_per_metre = 1.0;
  double shortest = 0.0;  ///< bounds of every snap length, scaled: `shortest` and `longest`
  double longest = 0.0;
  double residual = 0.0;          ///< Material::residual_length in scaled lengths
  double snap_rate = 0.0;         ///< snaps of a bristle per scaled length of steady sliding, without ageing
  double kinetic = 0.0;           ///< mean deflection in slow steady sliding, scaled; without ageing
  bool redraw = false;            ///< whether the redraw kernels are needed: the rule is redraw and the
                                  ///< spread not negligible
  bool single_length = false;     ///< whether the law is a single length, for which remainders of a path are
                                  ///< computed in double at every speed
  double peak_coefficient = 0.0;  ///< peak friction over normal load (Material::peak_coefficient), without
                                  ///< ageing
  std::uint64_t hash = 0;         ///< hash of all parameters of the material
  mutable KernelLaw law{};        ///< constants of the law for the kernels, with pointers into `table` and
                                  ///< `biased_table`; make_draws() fills all three

  mutable std::vector<double> table, biased_table;
  std::vector<double> spread;  ///< quantiles of the law at the 128 probabilities spread_share(k), scaled;
                               ///< empty without ageing

  /// Makes the tables from which representatives with SnapRule::redraw sample their lengths; the infinite
  /// brush does not need them. Takes milliseconds the first time, and nothing after that. Any thread that
  /// adds patches may call it.
  void make_draws() const;
  /// Returns the survival function for the infinite brush, which the first call computes. Any thread that
  /// adds patches may call it.
  const SurvivalTable& survival() const;
  /// Returns the constants of shared renewal (snaps straighten other bristles too): the path after which a
  /// slide is steady, and how often renewed bristles snap again. The first call computes them.
  const RenewalLaw& renewal() const;

  /// Returns the law as n strata, for SnapRule::slide. The first call with this n computes them; any thread
  /// may call it.
  std::shared_ptr<const Strata> strata(std::uint32_t n) const;

  CompiledMaterial() = default;
  CompiledMaterial(const CompiledMaterial&) = delete;
  CompiledMaterial& operator=(const CompiledMaterial&) = delete;

 private:
  void fill_draws() const;
  mutable std::once_flag draws_made_;
  mutable std::once_flag survival_made_;
  mutable SurvivalTable survival_;
  mutable std::once_flag renewal_made_;
  mutable RenewalLaw renewal_;
  mutable std::mutex strata_lock_;
  mutable std::map<std::uint32_t, std::shared_ptr<const Strata>> strata_;
};

/// Number of quantiles that stand for a law in sums over it. Their probabilities spread_share(k), t^3 (10 -
/// 15 t + 6 t^2) at the midpoints of equal steps of t, lie close together at both ends of the law.
inline constexpr int spread_size = 128;
double spread_share(int k) noexcept;
double spread_weight(int k) noexcept;

/// Fills the constants of jumps over many snaps from the moments of the path from snap to snap, moment[0] = 1
/// to moment[5].
void fill_jump_sums(const double (&moment)[6], KernelLaw& law) noexcept;
/// Fills the constants for jumping over k snaps at once under a narrow law, and the paths that suit it.
void fill_narrow_jumps(const double (&moment)[6], double cv, KernelLaw& law) noexcept;

/// Prepares a material for the kernels. Throws bristle::Error when the material is out of range.
std::shared_ptr<const CompiledMaterial> compile_material(const Material& material);

}  // namespace bristle::detail
