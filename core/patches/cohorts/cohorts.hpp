// The contact model of infinitely many bristles: a list of cohorts (core/patches/COHORTS.md). The kernels
// move them along a path.
#pragma once

#include <cstdint>
#include <memory>

#include "core/cohort_table.hpp"
#include "core/materials/survival_table.hpp"
#include "core/patches/cohorts/glide.hpp"
#include "core/patches/columns.hpp"
#include "core/patches/contact_model.hpp"

namespace bristle::detail {

constexpr double default_resolution = 8.0;  ///< pieces of path per mean snap length
constexpr double highest_resolution = 128.0;
constexpr std::uint32_t default_cohorts = 96;   ///< most cohorts of a patch at the default resolution
constexpr double bound_margin = 0x1p-40;        ///< scaled length above the rounding error of a deflection
constexpr double least_cohort_spread = 0.05;    ///< cv below which too many bristles of a brush snap in step
constexpr double full_mass = 70368744177664.0;  ///< 2^46 units of mass, the mass at the highest load
/// Units of mass that the shared part counts as one bristle: Patch::whole is 256 at the highest load, the
/// cost of a step in bristles.
constexpr double mass_per_count = 274877906944.0;                          // 2^38
constexpr double sum_per_mass_length = fixed_per_length / mass_per_count;  // units of the shared part's sum
                                                                           // per unit of mass x length, 2^6

/// State of a patch that ages, beside its cohorts. The births of the cohorts follow it in memory.
struct alignas(64) CohortAgeing {
  Int128 base = 0;          ///< time from which births count, clock units from PatchRecord::epoch
  double per_length = 0.0;  ///< s per scaled length of the straight slide that the patch is in
  double until = 0.0;       ///< end of that slide, s from base
  double oldest = 0.0;      ///< birth of the oldest cohort at the start of that slide
  // Cache: snaps of a bristle per scaled length of a steady slide (`snap_rate`), and the speed to which it
  // belongs; 0 = not known.
  double rate_per_length = 0.0, snap_rate = 0.0;
};

/// The infinite brush of one patch. CohortState has mass and cohorts; Patch has zeta and overload.
struct Cohorts : PatchRecord, CohortState {
  CohortLaw law{};
  const CohortKernels* kernels = nullptr;
  /// Noise of a patch that fluctuates (fluctuation.hpp), else null.
  const CohortNoise* noise = nullptr;
  std::int64_t slid_to[2] = {0, 0};  ///< position at the end of the straight slide of length `run`
  double follow = 0.0;               ///< scaled path of a slide after which its cohorts are carried along
                                     ///< unchanged
  /// Scaled path after which a step from straight bristles slides steadily; 0 = `follow`.
  double forget = 0.0;
  Glide glide;          ///< The glide that the patch is in, with the course of the path behind the patch.
  bool glides = false;  ///< whether the patch may glide, which needs no ageing and no fluctuation
  // Constants of glides, scaled lengths (glide.cpp, make.cpp).
  double memory = 0.0;             ///< path that bristles remember: mean square over mean length
  double long_step = 0.0;          ///< chord length of a step after which no turn before it matters
  double node_distance = 0.0;      ///< path between two measurements of the curvature
  double per_lag = 0.0;            ///< one over the path by which the force lags behind the curvature
  double highest_curve = 0.0;      ///< largest curvature of a glide, rad per scaled length
  double chord_share = 0.0;        ///< chord share that find_arc() takes, see Glide::chord_share
  double snap_rest = 0.0;          ///< bristles that snapped and are not yet reported, a fraction below one
  std::uint32_t pieces = 0;        ///< resolution, rounded up; reported as PatchInfo::bristles
  std::uint32_t detail = 0;        ///< pieces in use, of these
  double* rows = nullptr;          ///< columns in rows of 8 cohorts, 8 columns each
  CohortAgeing* ageing = nullptr;  ///< null if the material does not age

  template <class Self, class Visit>
  static void columns(Self& r, Visit&& visit) {
    visit(r.rows, ColumnRule{"rows", r.capacity * cohort_columns, Filler::zero, true});
    const std::uint32_t births = r.capacity / static_cast<std::uint32_t>(sizeof *r.ageing / sizeof(double));
    visit(r.ageing, ColumnRule{"ageing", r.ages() ? 1 + births : 0, Filler::zero, true});
  }
  std::uint32_t used_numbers() const noexcept {
    return (count + cohort_lanes - 1) / cohort_lanes * cohort_row;
  }
  /// Returns the number of cache lines of the record and of the rows in use.
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

/// Returns the position of the patch relative to the base of its cohorts' places.
inline double place(const Patch& p, const CohortState& s, int axis) noexcept {
  return to_lengths(difference(p.position[axis], s.base[axis]));
}

// --------------------------------------------------------------------------------------- time (ageing.cpp)

/// Returns the births of a patch's cohorts and the time since their base; all 0 where the material does not
/// age.
CohortTimes times_of(const Patch& p) noexcept;
/// Sets the base of births to the present time, for a patch without cohorts, or whose births are set next.
void begin_time(const Patch& p) noexcept;
/// Moves the base of births close to the present time, with the births unchanged in time.
void follow_time(const Patch& p) noexcept;
double find_oldest(const Cohorts& r) noexcept;
/// Returns g of cohort i, 1 where the material does not age.
double strength_of(const Patch& p, const CohortTimes& times, std::uint32_t i) noexcept;

// ---------------------------------------------------------------------------------------- rows (state.cpp)

/// Takes the patch out of contact, with no cohort left.
void clear_cohorts(Cohorts& r) noexcept;
/// Removes cohorts without mass; the last cohorts take their places. `births`: null where the material does
/// not age.
void remove_empty(CohortState& s, double* rows, double* births) noexcept;
void remove_empty(Cohorts& r) noexcept;
/// Recomputes the sums of mass x place over the cohorts.
void find_moment(CohortState& s, const double* rows) noexcept;
/// Returns the sum of mass x |z|^2, including the spread that merging removed from the places
/// (CohortState::spread).
double cohort_squares(const Patch& p) noexcept;
/// Returns the energy of a unit of mass x length^2, J.
double joules_per_unit(const Patch& p) noexcept;
/// Returns the sum of deflections along one axis, in units of the shared part, rounded.
Int128 deflections_at(const CohortState& s, double at, int axis) noexcept;
/// Updates count, sums and unit of force in the shared part after cohorts, load or material changed outside a
/// step.
void note_cohorts(Patch& p) noexcept;
void note_sum(Patch& p, int axis, std::int64_t noted) noexcept;

// --------------------------------------------------------------------------- make, load, step, material,
// state

void set_pieces(Cohorts& r, std::uint32_t detail) noexcept;
double apply_cohort_load(Patch& p, double normal_load_n) noexcept;
void advance_cohorts(Patch& p, PatchStep& step, StepSums& sums) noexcept;
/// Whether a move is so long that the state at its end does not depend on that at its start. `forget`: the
/// least such path.
bool is_forgetful(const Cohorts& r, const CohortMove& move, double forget) noexcept;
/// Whether a move that forgets its start is stepped in pieces before slide_far(): with shared renewal
/// slide_far() gives the state at the end, but not the sums along the path.
bool needs_pieces(const Cohorts& r, const CohortMove& move) noexcept;
/// Returns the snaps of a bristle per scaled length of steady sliding at the speed of a move.
double find_snap_rate(const Cohorts& r, const CohortTimes& times) noexcept;
/// Takes a step that forgets its start: sets the cohorts of steady sliding at its end, and adds the sums
/// along its path.
void slide_far(const Cohorts& r, CohortState& s, double* rows, const CohortMove& a, CohortTotals& t) noexcept;
void take_over_cohorts(Patch& to, Patch& from) noexcept;
double find_cohort_energy(const Patch& p) noexcept;
std::uint64_t hash_cohorts(const Patch& p) noexcept;
void read_cohorts(const Patch& p, std::size_t count, Span<double> zx, Span<double> zy,
                  Span<double> delta) noexcept;
std::uint64_t cohort_signature(const Patch& p) noexcept;
std::size_t saved_cohorts_size(const Patch& p) noexcept;
void save_cohorts(const Patch& p, ByteWriter& write) noexcept;
const char* find_cohort_fault(const Patch& p, const Patch& contact, ByteReader read) noexcept;
void restore_cohorts(Patch& p, std::uint32_t seed, ByteReader read) noexcept;

/// Whether an infinite brush can have this material.
bool allows_cohorts(const Material& material) noexcept;

Patch make_cohorts(std::shared_ptr<const CompiledMaterial> material, const PatchOptions& options,
                   const KernelTable& kernels, double zeta_max);

}  // namespace bristle::detail
