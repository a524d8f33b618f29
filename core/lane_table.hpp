// The interface between core and kernels for contacts in lanes: sixteen contacts of equal material and
// options form a block, one contact in each lane. Every quantity is a column of sixteen numbers, one for each
// lane. No lane reads another, so a contact's bits depend neither on the instruction set nor on threads or
// other contacts.
#pragma once

#include <cstdint>

#include "core/kernel_table.hpp"

namespace bristle::detail {

/// A column of a block: one number for each of its sixteen contacts.
template <class Number>
struct alignas(64) LaneColumn {
  Number lane[lane_count];
};

/// Constants that all contacts of a block share: the law of their springs, and constants of material and
/// options.
template <class T>
struct SlideLaw {
  const T* limit;               ///< deflection at which each spring slides, scaled lengths
  const T* per_limit;           ///< one over the limit of each spring
  const T* weight;              ///< share of each spring in the contact's stiffness; the shares sum to 1
  double stiffness_per_newton;  ///< stiffness of a contact per newton of its load, N per scaled length
  double whole;                 ///< sum of the weights, 1 but for roundings
  double metres_per_length;     ///< m per scaled length
  /// Matrix that maps a displacement, m, to isotropic axes, in scaled lengths. Rows: along the lay, across
  /// it.
  double to[2][2];
  double from[2][2];          ///< map of a force from isotropic axes to the axes of the contact
  double energy;              ///< LayMap::energy
  double lean;                ///< LayMap::lean
  double least_loss;          ///< LayMap::least_loss()
  double kinetic;             ///< limit of a sliding spring over that of a sticking one: 1 - drop
  double ageing_rate;         ///< 1 / Material::ageing_time, 1/s
  double ageing_strength;     ///< Material::ageing_strength
  std::uint32_t ageing_form;  ///< form of ageing: 1 saturating, 0 logarithmic
  std::uint32_t springs;
};

/// Numbers of a contact that its springs have in common. The force of a spring is its column x (or y) +
/// `base`.
struct LaneState {
  /// Force that every spring that sticks has gained since the stored forces were last written, N. Steps of
  /// sticking springs change only this number.
  LaneColumn<double> base[2];
  /// Stiffness, N per scaled length; 0 = no contact. It belongs to the present load; after a fall of the load
  /// it belongs to the earlier, higher one until sliding has lowered it.
  LaneColumn<double> stiffness;
  LaneColumn<double> phase;  ///< position in the sequence that spreads rounding evenly over steps, in [0, 1)
};

/// State of sixteen contacts. `x`, `y` and `since` have one column for each spring.
template <class T>
struct SlideColumns {
  LaneState* state;
  LaneColumn<T>* x;  ///< stored force along x over the spring's weight, N
  LaneColumn<T>* y;  ///< stored force along y; null with one axis
  /// Time at which the spring last slid, s of the contact's time; null without drop and ageing.
  LaneColumn<double>* since;
};

/// Number of cells in which the survival function of most laws is a quadratic: few, so that they fit into
/// vector registers.
constexpr std::uint32_t few_brush_cells = 32;
constexpr std::uint32_t most_cohorts = 384;  ///< largest number of cohorts of a contact
/// Smallest S(R) of a cohort that takes bristles (BrushColumns::left): their number is divided by it.
constexpr double least_left = 1e-7;

/// Survival function S of a law of snap lengths, for deflections x without the residual length: 1 up to
/// `low`, 0 from `high` on. Between, S is c0 + f (c1 + f c2), where f in [0, 1] is the position in a cell.
/// Cells are equally long, or lengthen with y = 1 + (x - low) per_length: `per_octave` equal cells for each
/// power of two of y.
template <class T>
struct BrushSurvival {
  const T *c0, *c1, *c2;  ///< coefficients of each cell, on boundaries of 64 bytes
  T low, high;
  T per_length;         ///< cells per scaled length if they are equally long
  T per_octave;         ///< 0: cells are equally long
  std::uint32_t cells;  ///< few_brush_cells or more
};

/// Constants that all contacts of a block of infinite brushes share. Lengths are scaled.
template <class T>
struct BrushLaw {
  const BrushSurvival<T>* survival;
  double stiffness_per_newton;  ///< as in SlideLaw
  double metres_per_length;     ///< m per scaled length
  double to[2][2];              ///< as in SlideLaw
  double from[2][2];
  double energy;    ///< LayMap::energy
  double residual;  ///< residual length l_r, scaled
  double renewal;   ///< Material::shared_renewal
  double piece;     ///< usual length of a piece of path that is computed at once, scaled
  double slow;      ///< distance from the ends of a step from which its pieces grow, scaled
  double growth;    ///< greatest length of a piece over `piece`
  double forget;    ///< longest path that a step computes, scaled; beyond it the slide is steady
  /// Largest factor by which the squared distance of two cohorts may grow when they are moved apart. 1: none
  /// is moved.
  double most_apart;
  double least_share;         ///< share of the load below which a cohort is negligible
  double snaps_per_newton;    ///< number of bristles in contact per newton of load
  double ageing_rate;         ///< 1 / Material::ageing_time, 1/s
  double ageing_strength;     ///< Material::ageing_strength
  std::uint32_t ageing_form;  ///< as in SlideLaw
  std::uint32_t cohorts;      ///< number of cohorts of a contact, 8 to most_cohorts
};

/// State of sixteen infinite brushes. Cohort 0 takes the newborn bristles and cohort 1 those that came into
/// contact last; the others are closed, the newest first. The pointers of the first group have one column
/// for each cohort.
template <class T>
struct BrushColumns {
  /// `base` is the position of the patch relative to the lane's own origin, scaled and in isotropic axes;
  /// `stiffness` is that of the load of which the cohorts have shares; `phase` is the part of a snap that
  /// is not reported yet, in [0, 1).
  LaneState* state;
  LaneColumn<T>* x;      ///< position of the patch where the cohort's bristles were last straight, scaled
  LaneColumn<T>* y;      ///< null with one axis
  LaneColumn<T>* reach;  ///< greatest deflection so far beyond the residual length, over the growth by age
  LaneColumn<T>* fresh;  ///< share of the load that the cohort would have if no bristle had snapped; 0: empty
  LaneColumn<T>* left;   ///< survival function at `reach`
  LaneColumn<T>* low;    ///< lowest and highest rank of the cohort's bristles, as shares of the load
  LaneColumn<T>* high;
  LaneColumn<double>*
      birth;  ///< contact's time, s, at which the cohort's bristles were straight; null without ageing

  // Columns of the contact, one each.
  LaneColumn<T>* begin[2][2];    ///< where the two open cohorts begin; [cohort][axis]
  LaneColumn<T>* residue[2][2];  ///< what rounding took from the mean positions of the open cohorts
  LaneColumn<T>* moment[2];      ///< sum over the cohorts of share x position
  LaneColumn<T>* owed;           ///< hazard of renewals not yet made
  LaneColumn<T>* owed_path;      ///< path along which that grew, scaled
  LaneColumn<T>* slack;          ///< path along which certainly no bristle snaps, scaled
  /// Sum over the bristles of cohort 0, and of the one closed before it, of share x squared distance of the
  /// position from that of its cohort: twice the energy that the positions of the cohorts lack.
  LaneColumn<T>* spread;
  LaneColumn<T>* pair;  ///< 1 while cohort 2 waits for cohort 0, from which it will be moved apart
  /// 1 once the load has risen; until then all bristles came into contact together, their ranks are [0, 1]
  /// and `low` and `high` are not used.
  LaneColumn<T>* ranked;
  std::uint32_t* used;  ///< one number: cohorts from there on are empty in all lanes

  /// Calls visit(column, entries) for each column of a block with this number of cohorts. Always inlined,
  /// because objects of different instruction sets must not share a function.
  template <class Visit>
  [[gnu::always_inline]] void list(std::uint32_t cohorts, bool has_y, bool has_births, Visit&& visit) {
    LaneColumn<T>** const of_cohorts[] = {&reach, &fresh, &left, &low, &high};
    LaneColumn<T>** const of_contact[] = {&owed, &owed_path, &slack, &spread, &pair, &ranked};
    visit(x, cohorts);
    if (has_y) visit(y, cohorts);
    for (LaneColumn<T>** const column : of_cohorts) visit(*column, cohorts);
    if (has_births) visit(birth, cohorts);
    for (int axis = 0; axis < 2; ++axis) {
      for (int open = 0; open < 2; ++open) {
        visit(begin[open][axis], 1u);
        visit(residue[open][axis], 1u);
      }
      visit(moment[axis], 1u);
    }
    for (LaneColumn<T>** const column : of_contact) visit(*column, 1u);
  }
};

/// Input of a step of a block: columns of sixteen numbers, which may lie in a caller's own arrays.
struct LaneInput {
  const double* displacement[2];  ///< displacement, m, in the contact's axes; with one axis y is not read
  const double* load;             ///< normal load, N, 0 to 1e15
  const double* start;            ///< time of the contact at the start, s (SlideColumns::since)
  double duration;                ///< s
  std::uint32_t named;            ///< bits of the lanes that the step moves; other contacts keep their state
  bool stores;                    ///< whether the step changes the state; false for a trial
  const void* ahead = nullptr;  ///< columns of the block that is stepped next, to be prefetched; may be null
};

/// Output of a step of a block: columns of sixteen numbers, which may lie in a caller's own arrays; null with
/// a kernel that does not compute them. Numbers of contacts that the step does not name are invalid.
struct LaneOutput {
  double* end[2];        ///< elastic force on the body at the end of the step, N
  double* mean[2];       ///< elastic force on the body, mean over the step, N
  double* stiffness;     ///< N/m; may be null
  double* dissipated;    ///< J
  double* contact_loss;  ///< elastic energy lost by the change of load, J
  double* slid;          ///< number of springs that slid
};

template <class T>
struct LaneKernels {
  using Slide = void (*)(const SlideLaw<T>&, const SlideColumns<T>&, const LaneInput&, const LaneOutput&);
  /// Step functions by what they compute. First index: axes - 1; second: 0 end force and stiffness, 1 all
  /// outputs, 2 with drop or ageing.
  Slide slide[2][3];
  using Brush = void (*)(const BrushLaw<T>&, const BrushColumns<T>&, const LaneInput&, const LaneOutput&);
  /// First index: axes - 1; second: 0 end force and stiffness, 1 all outputs; forces are equal to the bit.
  Brush brush[2][2];
};

/// Findings on the motions of sixteen contacts, by which a step skips what none needs. They cover contacts
/// that the step does not name, too.
struct LaneChecks {
  bool any_bad;    ///< A number is not finite, or a load not within 0 to the highest.
  bool any_still;  ///< A contact has no displacement, under the load that it had.
  bool all_still;
  bool any_above;  ///< A load is above `light`.
};

struct LaneTable {
  /// Checks the motions of a block. All columns have to be given, unlike those of a step, except velocities,
  /// which may be null. `loads`: loads of the last step. `light`: load up to which no contact is overloaded.
  LaneChecks (*check)(const LaneInput&, const double* const (&velocity)[2], const LaneColumn<double>& loads,
                      double light, double highest_load);
  LaneKernels<float> f32;
  LaneKernels<double> f64;  ///< kernels for double precision; null in a build without it
};
template <class T>
const LaneKernels<T>& lane_kernels_of(const LaneTable& table) {
  if constexpr (sizeof(T) == sizeof(double))
    return table.f64;
  else
    return table.f32;
}

}  // namespace bristle::detail
