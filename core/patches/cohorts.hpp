// The infinite brush of one patch: a list of cohorts (core/patches/COHORTS.md). Beside representatives
// (patch_state.hpp) it is the other way to compute what the bristles of a patch do.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "bristle/patch.hpp"
#include "core/cohort_table.hpp"
#include "core/materials/kernel_law.hpp"
#include "core/materials/survival_table.hpp"

namespace bristle::detail {

constexpr double default_resolution = 8.0;        ///< pieces per mean snap length
constexpr std::uint32_t default_cohorts = 32;     ///< capacity
constexpr double least_cohort_spread = 0.05;      ///< cv below which a brush snaps too much in step
constexpr double full_mass = 70368744177664.0;    ///< 2^46 units of mass at the highest load

/// The snap lengths of a material as cohorts read them. Immutable, shared by the patches of a material.
struct CohortBrush {
  SurvivalTable table;
  double cv = 0.0;
};
/// Throws bristle::Error when the material is none for an infinite brush.
std::shared_ptr<const CohortBrush> make_cohort_brush(const CompiledMaterial& material);

/// What changes in a patch from step to step beside its rows. Copied and saved as one.
struct CohortContact : CohortState {
  double normal_load = 0.0;  ///< N
  double zeta = 0.0;         ///< bristles in contact, physical
  double overload = 1.0;     ///< zeta / zeta_max where that is above 1
  double zeta_max = 0.0;     ///< full_mass units of mass

  // --- left over from a change of load or material, booked with the next step
  double pending_dissipated = 0.0;  ///< J
  double pending_loss = 0.0;        ///< J
  double pending_snaps = 0.0;       ///< bristles; the fraction that is not reported yet too
};

struct CohortPatch : CohortContact {
  PatchOptions options;
  std::shared_ptr<const CompiledMaterial> material;
  std::shared_ptr<const CohortBrush> brush;
  CohortLaw law{};
  const CohortKernels* kernels = nullptr;
  double resolution = default_resolution;
  bool skips = true;  ///< steps within the slack visit no cohort; false for tests

  struct Free {
    void operator()(double* memory) const noexcept;
  };
  std::unique_ptr<double[], Free> rows;

  std::size_t row_numbers() const noexcept { return capacity / cohort_lanes * cohort_row; }
  std::size_t used_numbers() const noexcept {
    return (count + cohort_lanes - 1) / cohort_lanes * std::size_t{cohort_row};
  }
  double units_per_bristle() const noexcept { return full_mass / zeta_max; }
};

/// A patch out of contact. `resolution` 0 and `cohorts` 0 = the defaults. Throws bristle::Error.
std::unique_ptr<CohortPatch> make_cohorts(std::shared_ptr<const CompiledMaterial> material,
                                          std::shared_ptr<const CohortBrush> brush,
                                          const PatchOptions& options, const CohortKernels& kernels,
                                          double resolution = 0.0, std::uint32_t cohorts = 0);

/// The patch as make_cohorts makes it.
void reset_cohorts(CohortPatch& patch) noexcept;
/// Pieces per mean snap length from now on.
void set_resolution(CohortPatch& patch, double resolution) noexcept;

/// Changes the load, N >= 0. Returns the elastic energy that left, J.
double apply_cohort_load(CohortPatch& patch, double normal_load_n) noexcept;

/// One step. The motion is a good one (patch_state.hpp).
void step_cohorts(CohortPatch& patch, const Motion& motion, double dt_s, Response& out) noexcept;
/// What a step would answer; the patch stays as it is.
void find_cohorts(const CohortPatch& patch, const Motion& motion, double dt_s, Response& out) noexcept;

/// Elastic energy, J.
double find_stored_energy(const CohortPatch& patch) noexcept;
/// Mass of all cohorts one by one, whole units: what CohortState::mass says.
double count_mass(const CohortPatch& patch) noexcept;
std::uint64_t hash_cohorts(const CohortPatch& patch) noexcept;

/// State and rows of `from` into `to`, made with the same capacity at least.
void copy_cohorts(const CohortPatch& from, CohortPatch& to) noexcept;
/// Moves the state of a patch into one made for another material.
void take_over(CohortPatch& to, const CohortPatch& from) noexcept;

}  // namespace bristle::detail
