// The seam between core and kernels for beds (for joints: joint_table.hpp): plain structs of raw pointers and
// a table of functions, as in kernel_table.hpp. The equations are in core/beds/BEDS.md.
//
// Deflections and limits are scaled by the bed's unit of deflection, places by its half width, stiffnesses by
// the bed's stiffness at full load: all numbers of a column are of order 1.
#pragma once

#include <cstdint>

#include "core/joint_table.hpp"
#include "core/kernel_table.hpp"

namespace bristle::detail {

/// Columns of a bed, one number a bristle; the count is a multiple of lane_count. They lie in blocks: 16
/// bristles of each column, then the next 16. What a step reads comes first, constants last.
enum BedColumn : std::uint32_t {
  bed_tip_x,  ///< where the tip stands: the root's place less the deflection
  bed_tip_y,
  bed_pressure,        ///< relative; times BedStep::limit_of_pressure the limit
  bed_over_pressure2,  ///< its inverse, squared; 0 where there is none
  bed_stiffness,       ///< of the part in contact
  bed_x,               ///< of the middle of the part in contact
  bed_y,
  bed_slid,   ///< 1: slid in the last step and holds its kinetic limit only
  bed_kept,   ///< share of the part in contact that was in contact before: dilutes the deflection
  bed_moved,  ///< share of the step over which the part in contact has been in contact, on average
  bed_along,  ///< rolling: place in its row, in half lengths of the row, -1 - h/2 to 1 + h/2
  // Columns of constants.
  bed_own,    ///< stiffness where all of the cell is in contact
  bed_inner,  ///< squared size at which the cell begins to be in contact; rolling: the row's y
  bed_outer,  ///< squared size from which all of it is; rolling: the row's half length at full load
  bed_share,  ///< factor of its pressure; rolling: the inverse of bed_outer
  bed_columns,
  bed_state_columns = bed_own
};

/// Returns the place of the number of bristle i in a column.
constexpr std::size_t bed_place(BedColumn c, std::size_t i) noexcept {
  return ((i / lane_count) * bed_columns + c) * lane_count + i % lane_count;
}

enum class BedProfile : std::uint32_t { uniform, parabolic, hertz };

/// Size of a bed's contact under its load, and the motion of its roots.
struct BedPlaces {
  std::uint32_t count;
  BedProfile profile;
  float size2;          ///< squared size of the contact, in its size at full load
  float inverse_size2;  ///< its inverse
  // Data of a rolling bed:
  bool chords;        ///< Whether a row ends on an ellipse; else on `edge`.
  float edge;         ///< half length of all rows in contact
  float rolled;       ///< in half lengths of a row of length 1; signed, forward is +
  float over_rolled;  ///< inverse of its magnitude
  bool turned;        ///< Whether the rows have turned, so that y changes too.
  float cell;         ///< h, width of a cell in half lengths of its row
  float axes[4];      ///< x and y of a place: along its row x [0], across it x [1]; likewise [2], [3]
  float root[4];      ///< where the roots have gone: x, y, and the turn as it counts along x and y
};

struct BedStep {
  std::uint32_t count;
  float root[4];         ///< at the beginning, as in BedPlaces; zeros where rows have rolled
  float motion[4];       ///< of the step
  bool torque;           ///< Whether the torque is asked for, where nothing spins.
  bool rolled;           ///< Whether every tip is written, relative to a root at zero: rolling, long motion.
  float half_rolled[2];  ///< rolling: half the distance rolled, as a vector
  float limit_of_pressure;
  float pressure_of_limit2;  ///< its inverse, squared
  float limit_over_hold;     ///< kinetic over static friction
  float hold_over_limit;     ///< its inverse
};

/// Sums over a bed, in its units.
struct BedSums {
  double force[2], torque;  ///< stiffness x deflection at the end
  // Sums that only kernels with all outputs fill:
  double slipping;  ///< stiffness that slid
  double mean[2], mean_torque;
  double energy[2];                                    ///< stiffness x z^2 at the end, by axis
  double start_energy;                                 ///< at the beginning, of what stayed in contact
  double dissipated;                                   ///< stiffness x what slid away
  double stuck, stuck_x, stuck_y, stuck_xx, stuck_yy;  ///< stiffness that did not slide, and its moments
};

/// Variants of a step: bits of the index.
enum BedVariant : std::uint32_t {
  bed_spins = 1,
  bed_carried = 2,  ///< places, load or size have changed: bed_kept and bed_moved count, limits may fall
  bed_all_outputs = 4,
  bed_drops = 8,
  bed_variants = 16
};

struct BedKernels {
  void (*step[bed_variants])(const BedStep&, float* columns, BedSums&);
  /// Fills stiffness, pressure and bed_kept of a bed under another size. Returns the sum of their products.
  double (*place)(const BedPlaces&, float* columns);
  /// As place, of a bed that can roll, whose rows stand.
  double (*place_rows)(const BedPlaces&, float* columns);
  /// As place_rows, after rolling by BedPlaces::rolled, which is not 0. Tips are relative to roots at zero.
  double (*roll)(const BedPlaces&, float* columns);
  /// Makes tips relative to roots at zero, where they were relative to BedPlaces::root.
  void (*rebase)(const BedPlaces&, float* columns);
  JointKernel joint[joint_variants];
};

}  // namespace bristle::detail
