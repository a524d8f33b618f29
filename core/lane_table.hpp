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
