// The contact model of infinitely many bristles: a list of cohorts (core/patches/COHORTS.md), which the
// kernels move along a path.
#pragma once

#include <cstdint>
#include <memory>

#include "core/cohort_table.hpp"
#include "core/materials/survival_table.hpp"
#include "core/patches/cohorts/glide.hpp"
#include "core/patches/columns.hpp"
#include "core/patches/contact_model.hpp"

namespace bristle::detail {

constexpr double default_resolution = 8.0;  ///< pieces of path per mean snap length, unless the options say
                                            ///< otherwise
constexpr double highest_resolution = 128.0;
constexpr std::uint32_t default_cohorts = 96;   ///< most cohorts of a patch of default_resolution
constexpr double bound_margin = 0x1p-40;        ///< scaled length that exceeds the rounding error of any
                                                ///< deflection
constexpr double least_cohort_spread = 0.05;    ///< least cv of a law for an infinite brush; with a smaller
                                                ///< one, too many bristles snap at once
constexpr double full_mass = 70368744177664.0;  ///< 2^46 units of mass, the mass of all bristles of a
                                                ///< patch at the highest load

/// Units of mass that Patch::whole counts as one bristle. At the highest load the count is 256, the cost of a
/// step in bristles.
constexpr double mass_per_count = 274877906944.0;                          // 2^38
constexpr double sum_per_mass_length = fixed_per_length / mass_per_count;  // units of Patch::sum per unit of
                                                                           // mass x length, 2^6

/// State of ageing of a patch. The births of its cohorts follow it in memory.
struct alignas(64) CohortAgeing {
  Int128 base = 0;          ///< time from which births are counted, in clock units from PatchRecord::epoch
  double per_length = 0.0;  ///< s per scaled length of the present straight slide
  double until = 0.0;       ///< end of the present straight slide, s from `base`
  double oldest = 0.0;      ///< birth of the oldest cohort when the present straight slide began, s from
                            ///< `base`

  // Cache: snaps of a bristle per scaled length of steady sliding (`snap_rate`), and the time per length for
  // which this value was computed; 0 = not known.
  double rate_per_length = 0.0, snap_rate = 0.0;
};

/// Record of an infinite brush. Its base CohortState has the mass; Patch has zeta and overload.
struct Cohorts : PatchRecord, CohortState {
  CohortLaw law{};
  const CohortKernels* kernels = nullptr;
  /// Noise of a patch that fluctuates (fluctuation.hpp), else null.
  const CohortNoise* noise = nullptr;
  std::int64_t slid_to[2] = {0, 0};  ///< patch position at the end of the present straight slide, whose
                                     ///< length is `run`
  double follow = 0.0;               ///< scaled path of a slide after which the cohorts are carried: they
                                     ///< move with the patch unchanged

  /// Scaled path after which a long step that began with straight bristles is in steady sliding; 0 =
  /// `follow`.
  double forget = 0.0;
  Glide glide;          ///< state of a glide (glide.hpp) if the patch is in one, and the recent path of the
                        ///< patch
  bool glides = false;  ///< whether the patch may glide; it does not if it ages or fluctuates

  // Constants of glides, in scaled lengths (glide.cpp, make.cpp).
  double memory = 0.0;             ///< path that bristles remember: mean square over mean deflection of
                                   ///< steady sliding
  double long_step = 0.0;          ///< length of a step after which earlier turns of the path do not matter
  double node_distance = 0.0;      ///< path between two measurements of the curvature
  double per_lag = 0.0;            ///< one over the path by which the force lags behind a change of curvature
  double highest_curve = 0.0;      ///< largest curvature of the path at which a patch glides, rad per scaled
                                   ///< length
  double chord_share = 0.0;        ///< factor that Glide::chord_share is calculated from
  double snap_rest = 0.0;          ///< fraction of a snap that no report of snaps has counted yet
  std::uint32_t pieces = 0;        ///< pieces of path per mean snap length, rounded up, which
                                   ///< PatchInfo::bristles reports
  std::uint32_t detail = 0;        ///< number of `pieces` in use, as PatchBatch::set_detail set it
  double* rows = nullptr;          ///< cohorts in rows of 8, with 8 columns each (CohortColumn)
  CohortAgeing* ageing = nullptr;  ///< state of ageing; null if the material does not age

  template <class Self, class Visit>
  static void columns(Self& r, Visit&& visit) {
    visit(r.rows, ColumnRule{"rows", r.capacity * cohort_columns, Filler::zero, true});
    const std::uint32_t births = r.capacity / static_cast<std::uint32_t>(sizeof *r.ageing / sizeof(double));
    visit(r.ageing, ColumnRule{"ageing", r.ages() ? 1 + births : 0, Filler::zero, true});
  }
  std::uint32_t used_numbers() const noexcept {
    return (count + cohort_lanes - 1) / cohort_lanes * cohort_row;
  }
  /// Returns the number of cache lines to request ahead: the record and the rows in use, at most 64.
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

/// Returns the position of the patch relative to the base from which its cohorts' places are counted.
inline double place(const Patch& p, const CohortState& s, int axis) noexcept {
  return to_lengths(difference(p.position[axis], s.base[axis]));
}

// --------------------------------------------------------------------------------------- time (ageing.cpp)

/// Returns the births of the cohorts and the present time, counted from their base; all 0 where the material
/// does not age.
CohortTimes times_of(const Patch& p) noexcept;
/// Sets the base of births to the present time. For a patch without cohorts, or whose births are set next.
void begin_time(const Patch& p) noexcept;
/// Moves the base of births close to the present time; the births stay where they are in time.
void follow_time(const Patch& p) noexcept;
double find_oldest(const Cohorts& r) noexcept;
/// Returns g, the factor by which ageing has increased the snap lengths of cohort i; 1 where the material
/// does not age.
double strength_of(const Patch& p, const CohortTimes& times, std::uint32_t i) noexcept;

// ---------------------------------------------------------------------------------------- rows (state.cpp)

/// Removes all cohorts of a patch that goes out of contact.
void clear_cohorts(Cohorts& r) noexcept;
/// Removes cohorts whose mass is 0; the last cohorts take their places. `births`: null where the material
/// does not age.
void remove_empty(CohortState& s, double* rows, double* births) noexcept;
void remove_empty(Cohorts& r) noexcept;
/// Recomputes the sums of mass x place over the cohorts.
void find_moment(CohortState& s, const double* rows) noexcept;
/// Returns the sum of mass x |z|^2, including the variance of place that joining cohorts has lost
/// (CohortState::spread).
double cohort_squares(const Patch& p) noexcept;
/// Returns the energy, J, of a unit of mass with a deflection of one scaled length.
double joules_per_unit(const Patch& p) noexcept;
/// Returns the sum of deflections along one axis, rounded, in the units of Patch::sum.
Int128 deflections_at(const CohortState& s, double at, int axis) noexcept;
/// Updates number of bristles, sums and unit of force in the patch's shared part after cohorts, load or
/// material changed outside a step.
void note_cohorts(Patch& p) noexcept;
void note_sum(Patch& p, int axis, std::int64_t noted) noexcept;

// ----------------------------------------------------- make, load, step, material, state

void set_pieces(Cohorts& r, std::uint32_t detail) noexcept;
double apply_cohort_load(Patch& p, double normal_load_n) noexcept;
void advance_cohorts(Patch& p, PatchStep& step, StepSums& sums) noexcept;
/// Whether a move is so long that the state at its end does not depend on the state at its start. `forget`:
/// shortest length of such a move.
bool is_forgetful(const Cohorts& r, const CohortMove& move, double forget) noexcept;
/// Whether the pieces of a move that forgets its start are stepped before slide_far(). With shared renewal
/// slide_far() gives only the state at the end, but not the sums along the path.
bool needs_pieces(const Cohorts& r, const CohortMove& move) noexcept;
/// Returns the snaps of a bristle per scaled length of steady sliding, at the speed of a move.
double find_snap_rate(const Cohorts& r, const CohortTimes& times) noexcept;
/// Makes a step that forgets its start: replaces the cohorts by those of steady sliding at its end, and adds
/// the sums along its path.
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

/// Whether this material allows an infinite brush.
bool allows_cohorts(const Material& material) noexcept;

Patch make_cohorts(std::shared_ptr<const CompiledMaterial> material, const PatchOptions& options,
                   const KernelTable& kernels, double zeta_max);

}  // namespace bristle::detail
