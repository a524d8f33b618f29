// The interface between core and kernels for beds: plain structs of raw pointers and a table of functions, as
// in kernel_table.hpp. The equations are in core/beds/BEDS.md. Units make all numbers of a column of order 1:
// deflections and limits are divided by the bed's unit of deflection, places by its larger half width,
// stiffnesses by the bed's stiffness at full load.
#pragma once

#include <cstdint>

#include "core/kernel_table.hpp"

namespace bristle::detail {

/// Columns of a bed, one number a bristle; the count is a multiple of lane_count. Columns lie in blocks:
/// 16 bristles of each column, then the next 16. Columns that a step reads come first, constants last.
enum BedColumn : std::uint32_t {
  bed_tip_x,  ///< x of the bristle's tip: place of its root less its deflection
  bed_tip_y,
  bed_pressure,        ///< relative pressure at the bristle; times BedStep::limit_of_pressure it is the
                       ///< bristle's kinetic limit
  bed_over_pressure2,  ///< inverse square of bed_pressure; 0 where there is no pressure
  bed_stiffness,       ///< stiffness of the part of the bristle's cell that is in contact
  bed_x,               ///< x of the bristle; if the bed can roll, of the middle of its cell's part in contact
  bed_y,
  bed_slid,   ///< 1 if the bristle slid in the last step, so that it holds only its kinetic limit
  bed_kept,   ///< share of the cell's present contact that was in contact before the step too; the deflection
              ///< is multiplied by it
  bed_moved,  ///< share of the step's motion that bends the bristle: below 1 if its cell has just entered
  bed_along,  ///< place of a rolling bristle in its row, in half lengths of the row, -1 - h/2 to 1 + h/2

  // Columns of constants.
  bed_own,    ///< stiffness of the bristle when its whole cell is in contact
  bed_inner,  ///< squared size of the contact at which the cell begins to touch; in a rolling bed: place
              ///< of the cell's row across the rows, -1 to 1
  bed_outer,  ///< squared size of the contact from which the whole cell touches; in a rolling bed: half
              ///< length of the cell's row at full load
  bed_share,  ///< factor of the relative pressure at the cell; in a rolling bed the inverse of bed_outer

  bed_old_pressure,  ///< bed_pressure before the rolling of this step; no state, written and read within it
  bed_columns,
  bed_state_columns = bed_own
};

/// Returns the index of bristle i in a column.
constexpr std::size_t bed_place(BedColumn c, std::size_t i) noexcept {
  return ((i / lane_count) * bed_columns + c) * lane_count + i % lane_count;
}

enum class BedProfile : std::uint32_t { uniform, parabolic, hertz };

/// Size of a bed's contact under its load, and displacement of the bristles' roots.
struct BedPlaces {
  std::uint32_t count;
  BedProfile profile;
  float size2;          ///< squared size of the contact, relative to its size at full load
  float inverse_size2;  ///< one over size2; 0 for a contact without size

  // Data of a rolling bed:
  bool chords;        ///< Whether the rows of cells end on an ellipse; if not, all rows end at `edge`.
  float edge;         ///< half length of the part of each row in contact, relative to that at full load
  float rolled;       ///< distance rolled, in half lengths of the contact at full load; positive is forward
  float over_rolled;  ///< one over the distance rolled, without sign
  bool turned;        ///< Whether the rows have turned, so that rolling changes y too.
  float cell;         ///< h, width of a cell along its row, in half lengths of the row
  float axes[4];      ///< factors of a bristle's place along the row and across it in its x [0, 1] and its
                      ///< y [2, 3]; x is the difference of both terms, y their sum
  float root[4];      ///< displacement of the bristles' roots by translation along x and y [0, 1], then by
                      ///< turning along x and y [2, 3]
};

struct BedStep {
  std::uint32_t count;
  float root[4];         ///< displacement of the roots before the step, as BedPlaces::root; zeros after
                         ///< rolling
  float motion[4];       ///< displacement of the bristles' roots in this step, in the same four parts as
                         ///< BedPlaces::root
  bool torque;           ///< Whether the torque is computed also in a step without spin.
  bool rolled;           ///< Whether every tip is rewritten relative to a root at zero, as after rolling or a
                         ///< long motion.
  bool rolls;            ///< Whether the bed rolled just before this step (bed_old_pressure).
  float half_rolled[2];  ///< half of the distance rolled in the step, as a vector; 0 without rolling
  /// Whether the motion is very short. Then each tip's path is added to its place, instead of recomputing the
  /// place, and `spread` (-1/2 to 1/2 of a digit) is added before rounding. Only kernels with all outputs
  /// read it.
  bool creeps;
  float spread;
  float limit_of_pressure;
  float pressure_of_limit2;  ///< one over the square of BedStep::limit_of_pressure
  float limit_over_hold;     ///< kinetic over static limit of friction
  float hold_over_limit;     ///< static over kinetic limit of friction
  float gain;                ///< deflection along y over that along x, of equal displacements; 1: isotropic
};

/// Sums over the bristles of a bed, in its units.
struct BedSums {
  double force[2], torque;  ///< sums of stiffness x deflection (force) and of their moments (torque) at the
                            ///< end of the step

  // Sums that only kernels with all outputs fill:
  double slipping;  ///< stiffness of the bristles that slid in the step
  double mean[2], mean_torque;
  double energy[2];               ///< sums of stiffness x squared deflection at the end
                                  ///< of the step, along x and y
  double start_energy;            ///< sum of stiffness x squared deflection at the
                                  ///< beginning of the step, after bed_kept has reduced
                                  ///< the deflections; 0 without bed_carried
  double start[2], start_torque;  ///< force and torque at the beginning of the step, after bed_kept has
                                  ///< reduced the deflections; 0 without bed_carried
  double entered, entered_stuck;  ///< stiffness that has entered in this step, and its
                                  ///< part on that part of the motion on which it
                                  ///< sticks; 0 without rolling
  double dissipated;              ///< energy dissipated by sliding, and by deflections
                                  ///< that drop to a limit
  double stuck, stuck_x, stuck_y, stuck_xx, stuck_yy;  ///< sums over the bristles that did not slide: of
                                                       ///< their stiffness, and of stiffness times x, y,
                                                       ///< x^2 and y^2
};

/// Bits of an index into BedKernels::step.
enum BedVariant : std::uint32_t {
  bed_spins = 1,
  bed_carried = 2,  ///< set if the contact rolled or changed its size, a limit fell, or the motion is long;
                    ///< only then are bed_kept and bed_moved read
  bed_all_outputs = 4,
  bed_drops = 8,
  bed_variants = 16
};

struct BedKernels {
  void (*step[bed_variants])(const BedStep&, float* columns, BedSums&);
  /// Fills bed_kept and the columns of stiffness and pressure for a new size of the contact. Returns the sum
  /// of stiffness x pressure.
  double (*place)(const BedPlaces&, float* columns);
  /// Fills the columns of place(), and places and tips, for a bed that can roll but did not in this step.
  double (*place_rows)(const BedPlaces&, float* columns);
  /// Moves the cells along their rows by BedPlaces::rolled, which is not 0, and fills the columns of place(),
  /// places and bed_moved. Does not write the tips, which must be relative to roots at zero.
  double (*roll)(const BedPlaces&, float* columns);
  /// Subtracts from each tip its root's displacement BedPlaces::root, which the caller resets to zero, so
  /// that deflections stay.
  void (*rebase)(const BedPlaces&, float* columns);
};

}  // namespace bristle::detail
