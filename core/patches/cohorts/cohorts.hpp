// The contact model of infinitely many bristles (Population::infinite): a list of cohorts, which the kernels
// move along a path. A cohort is all bristles that were last straight at one place and have been bent alike
// since. Equations: core/patches/COHORTS.md.
#pragma once

#include <cstdint>
#include <memory>

#include "core/cohort_table.hpp"
#include "core/materials/survival_table.hpp"
#include "core/patches/cohorts/glide.hpp"
#include "core/patches/columns.hpp"
#include "core/patches/contact_model.hpp"

namespace bristle::detail {

/// Pieces into which a path of one mean snap length is divided, unless the options say otherwise.
constexpr double default_resolution = 8.0;
constexpr double highest_resolution = 128.0;
constexpr std::uint32_t default_cohorts = 96;  ///< most cohorts of a patch that has the default resolution
/// Margin, a scaled length, by which bounds on snapping are reduced. It is more than the rounding error of
/// any deflection, so no snap is missed.
constexpr double bound_margin = 0x1p-40;
/// Least spread (cv) of a snap-length law for an infinite brush. With less spread too many bristles would
/// snap at once for cohorts to resolve.
constexpr double least_cohort_spread = 0.05;
/// Mass of all bristles of a patch at its highest load: 2^46 units, so that masses are whole numbers.
constexpr double full_mass = 70368744177664.0;

/// Units of mass that count as one bristle in Patch::whole. A patch at its highest load has 256 of them,
/// because an infinite brush costs about as much to step as 256 bristles.
constexpr double mass_per_count = 274877906944.0;  // 2^38
// Units of Patch::sum per unit of mass and scaled length, 2^6.
constexpr double sum_per_mass_length = fixed_per_length / mass_per_count;

/// Ageing state of a patch. The births of the cohorts follow it in memory.
struct alignas(64) CohortAgeing {
  Int128 base = 0;          ///< time from which births are counted, in 2^-64 s since PatchRecord::epoch
  double per_length = 0.0;  ///< time per scaled length of the present straight slide, s
  double until = 0.0;       ///< end of the present straight slide, s since `base`
  /// Birth of the oldest cohort when the present straight slide began, s after `base`.
  double oldest = 0.0;

  // Cache of a snap rate: `snap_rate` is the number of snaps of a bristle per scaled length of steady
  // sliding, at the time per length `rate_per_length` (0 = not known).
  double rate_per_length = 0.0, snap_rate = 0.0;
};

/// State of an infinite brush without its cohorts. The number in contact and the overload are in the struct
/// Patch.
struct CohortScalars : CohortState {
  /// Position of the patch at the end of its present straight slide, whose length is `run`. A step that
  /// begins elsewhere begins a new slide.
  std::int64_t slid_to[2] = {0, 0};
  /// Fraction of a snap that no response has reported yet, because responses report whole snaps.
  double snap_fraction = 0.0;
  /// Recent path of the patch and, in a glide, its state. A glide is a slide on a slowly turning path,
  /// computed without visiting cohorts.
  Glide glide;
};

/// Record of an infinite brush: its properties, its state, and pointers to its cohorts.
struct Cohorts : PatchRecord, CohortScalars {
  CohortLaw law{};
  const CohortKernels* kernels = nullptr;
  /// Path of a slide, scaled, after which cohorts need not be stepped: from then on they move along with the
  /// patch unchanged.
  double follow = 0.0;

  /// Path of a step, scaled, after which bristles that were straight slide steadily. With renewal, bristles
  /// bent against the step need more (find_forgetting_path). 0 = as long as `follow`.
  double forget = 0.0;
  bool glides = false;  ///< whether the patch may glide; one that ages may not

  // Constants for glides (steady slides on bent paths), in scaled lengths; derived in make.cpp. The first is
  // the path that bristles remember: mean squared deflection over mean deflection in steady sliding.
  double memory = 0.0;
  double long_step = 0.0;      ///< length of a step at whose end earlier turns of the path do not matter
  double node_distance = 0.0;  ///< path between two measurements of the curvature of the path
  double per_lag = 0.0;        ///< one over the path by which the force lags behind a changed curvature
  /// Largest curvature, rad per scaled length, of a path on which a patch may glide.
  double highest_curve = 0.0;
  double chord_share = 0.0;  ///< factor from which Glide::chord_share (angle of a chord) is computed
  /// Pieces of path per mean snap length that the options ask for, rounded up. PatchInfo::representatives
  /// reports it.
  std::uint32_t pieces = 0;
  double* rows = nullptr;          ///< data of the cohorts: rows of 8 cohorts with 8 columns (CohortColumn)
  CohortAgeing* ageing = nullptr;  ///< births of cohorts and times of the slide; null without ageing

  template <class Self, class Visit>
  static void columns(Self& r, Visit&& visit) {
    visit(r.rows, ColumnRule{"rows", r.capacity * cohort_columns, Filler::zero, true});
    const std::uint32_t births = r.capacity / static_cast<std::uint32_t>(sizeof *r.ageing / sizeof(double));
    visit(r.ageing, ColumnRule{"ageing", r.ages() ? 1 + births : 0, Filler::zero, true});
  }
  std::uint32_t used_numbers() const noexcept {
    return (count + cohort_lanes - 1) / cohort_lanes * cohort_row;
  }
  /// Returns how many cache lines are worth prefetching before a step: record and rows in use, at most 64.
  std::uint8_t fetched_lines() const noexcept {
    const std::uint32_t lines = static_cast<std::uint32_t>(sizeof(Cohorts) / 64 + 1) + used_numbers() / 8;
    return static_cast<std::uint8_t>(lines < 64 ? lines : 64);
  }
  bool ages() const noexcept { return material->material.ageing_strength != 0.0; }
  double* births() const noexcept { return reinterpret_cast<double*>(ageing + 1); }
  bool rubs() const noexcept { return law.residual > 0.0 || law.renewal > 0.0; }
  double zeta_max() const noexcept { return full_weight; }
  double units_per_bristle() const noexcept { return full_mass / full_weight; }
};

inline Cohorts& cohorts(const Patch& p) noexcept { return static_cast<Cohorts&>(*p.record); }

/// Returns the position of the patch along an axis, relative to the base of its cohorts' places, scaled.
inline double place(const Patch& p, const CohortState& s, int axis) noexcept {
  return to_lengths(difference(p.position[axis], s.base[axis]));
}

// --------------------------------------------------------------------------------------- time (ageing.cpp)

/// Returns the present time and the birth times of the cohorts, in s after the base of births. All are 0 if
/// the material does not age.
CohortTimes times_of(const Patch& p) noexcept;
/// Sets the base of births to the present time, for a patch that has no cohorts yet.
void begin_time(const Patch& p) noexcept;
/// Moves the base of births to the present time once it lies 2^20 ageing times back. Ages stay, except for
/// rounding.
void follow_time(const Patch& p) noexcept;
double find_oldest(const Cohorts& r) noexcept;
/// Returns g, the factor by which ageing has lengthened the snap lengths of cohort i; 1 if the material does
/// not age.
double strength_of(const Patch& p, const CohortTimes& times, std::uint32_t i) noexcept;

// ---------------------------------------------------------------------------------------- rows (state.cpp)

/// Removes all cohorts from a patch that has lost contact.
void clear_cohorts(Cohorts& r) noexcept;
/// Removes cohorts whose mass is 0; the last cohorts move into their rows. `births`: column of birth times,
/// null if the material does not age.
void remove_empty(CohortState& s, double* rows, double* births) noexcept;
void remove_empty(Cohorts& r) noexcept;
/// Recomputes the sums of mass x place over the cohorts. The mean deflection follows from them.
void find_moment(CohortState& s, const double* rows) noexcept;
/// Returns the sum of mass x |z|^2 over all bristles, with z the deflection, from which the stored energy
/// follows. It includes the variance of place that was lost when bristles joined one cohort
/// (CohortState::spread) and, in a glide, the change since its start.
double cohort_squares(const Patch& p) noexcept;
/// Adds the sum of mass x |z|^2 over the cohorts to `sum`, for a patch at the place `at`.
double squares_at(const CohortState& s, const double* rows, const double (&at)[2], double sum) noexcept;
/// Returns the elastic energy, J, of one unit of mass bent by one scaled length, by which cohort_squares() is
/// multiplied.
double joules_per_unit(const Patch& p) noexcept;
/// Returns the sum of deflections along one axis for a patch at the place `at`, rounded, in units of
/// Patch::sum.
Int128 deflections_at(const CohortState& s, double at, int axis) noexcept;
/// Updates the part of a patch that all contact models share: number of bristles, sums of deflections, unit
/// of force. Call it after a change of cohorts, load or material outside a step.
void note_cohorts(Patch& p) noexcept;
void note_sum(Patch& p, int axis, std::int64_t noted) noexcept;

// ----------------------------------------------------- make, load, step, material, state

void set_pieces(Cohorts& r) noexcept;
double apply_cohort_load(Patch& p, double normal_load_n) noexcept;
void advance_cohorts(Patch& p, PatchStep& step, StepSums& sums) noexcept;
/// Returns whether a move is so long, at least `forget`, that the state at its end does not depend on the
/// state at its start.
inline bool is_forgetful(const CohortMove& move, double forget) noexcept { return move.length >= forget; }
/// Returns whether a move must be stepped in pieces although it forgets its start. With shared renewal
/// slide_far() gives only the state at the end, while mean force and energy need the pieces.
bool needs_pieces(const Cohorts& r, const CohortMove& move) noexcept;
/// Returns the number of snaps of a bristle per scaled length of steady sliding, at a given speed.
double find_snap_rate(const Cohorts& r, const CohortTimes& times) noexcept;
/// Makes a step that forgets its start without stepping through it: replaces the cohorts by those of steady
/// sliding at its end, and adds work, energy and snaps along its path.
void slide_far(const Cohorts& r, CohortState& s, double* rows, const CohortMove& a, CohortTotals& t) noexcept;
void take_over_cohorts(Patch& to, Patch& from) noexcept;
double find_cohort_energy(const Patch& p) noexcept;
std::uint64_t hash_cohorts(const Patch& p) noexcept;
void read_cohorts(const Patch& p, std::size_t count, Span<double> zx, Span<double> zy,
                  Span<double> delta) noexcept;
std::uint64_t cohort_signature(const Patch& p) noexcept;
void save_cohorts(const Patch& p, ByteWriter& write) noexcept;
const char* find_cohort_fault(const Patch& p, const Patch& contact, ByteReader read) noexcept;
void restore_cohorts(Patch& p, std::uint32_t seed, ByteReader read) noexcept;

/// Returns whether bristles of this material can be computed as an infinite brush, by rule and law.
bool allows_cohorts(const Material& material) noexcept;

/// Makes an infinite brush out of contact. With `zeta_max` above 0 it replaces a patch whose options these
/// are: `options.bristles` is then the largest number of cohorts, which stays.
Patch make_cohorts(std::shared_ptr<const CompiledMaterial> material, const PatchOptions& options,
                   const KernelTable& kernels, double zeta_max);

}  // namespace bristle::detail
