// The interface between core and kernels for beds: plain structs of raw pointers and a table of functions, as
// in kernel_table.hpp. core/beds/BEDS.md has the equations. Units make all numbers of a column of order 1:
// deflections and limits are divided by the bed's unit of deflection, positions by its larger half width,
// stiffnesses by the bed's stiffness at full load.
#pragma once

#include <cstdint>

#include "core/kernel_table.hpp"

namespace bristle::detail {

/// Columns of a bed, with one number for each bristle. They lie in blocks (16 bristles of each column, then
/// the next 16), and their length is a multiple of lane_count. Columns that a step reads come first,
/// constants last, to save memory traffic.
enum BedColumn : std::uint32_t {
  bed_tip_x,  ///< x of the bristle's tip: position of its root less its deflection
  bed_tip_y,
  /// Relative pressure at the bristle. The bristle's kinetic friction limit is this number times
  /// BedStep::limit_of_pressure.
  bed_pressure,
  bed_over_pressure2,  ///< inverse square of bed_pressure; 0 where there is no pressure
  bed_stiffness,       ///< stiffness of the part of the bristle's cell that is in contact
  bed_x,               ///< x of the bristle; if the bed can roll, of the middle of its cell's part in contact
  bed_y,
  bed_slid,  ///< 1 if the bristle slid in the last step, so that it bears only its kinetic limit
  /// Share of the cell's present contact that was in contact before the step too. A step multiplies the
  /// deflection by it, because the part that has just come into contact is straight.
  bed_kept,
  bed_moved,  ///< share of the step's motion that bends the bristle: below 1 if its cell has just entered
  bed_along,  ///< position of a rolling bristle in its row, in half lengths of the row, -1 - h/2 to 1 + h/2

  // Columns of constants:
  bed_own,  ///< stiffness of the bristle when its whole cell is in contact
  /// Size of the contact, squared, at which the cell begins to touch. In a rolling bed: position of the
  /// cell's row across the rows, -1 to 1.
  bed_inner,
  /// Size of the contact, squared, from which on the whole cell touches. In a rolling bed: half length of the
  /// cell's row at full load.
  bed_outer,
  bed_share,  ///< factor of the relative pressure at the cell; in a rolling bed the inverse of bed_outer

  bed_old_pressure,  ///< bed_pressure before the rolling of this step; no state, written and read within it
  bed_columns,
  bed_state_columns = bed_own
};

/// Returns the index of bristle i in a column, for the order of blocks described above.
constexpr std::size_t bed_index(BedColumn c, std::size_t i) noexcept {
  return ((i / lane_count) * bed_columns + c) * lane_count + i % lane_count;
}

enum class BedProfile : std::uint32_t { uniform, parabolic, hertz };

/// Size of a bed's contact under its load, and displacement of its bristles' roots: what kernels need to
/// set the bristles' positions.
struct BedPositions {
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
  /// Factors that give a bristle's position from its coordinates along its row and across it: [0, 1] for its
  /// x, [2, 3] for its y. x is the difference of both terms, y their sum.
  float axes[4];
  /// Displacement of the bristles' roots by translation along x and y [0, 1], then by turning [2, 3], again
  /// along x and y.
  float root[4];
};

struct BedStep {
  std::uint32_t count;
  /// Displacement of the roots before the step, in the parts of BedPositions::root; zeros after rolling.
  float root[4];
  /// Displacement of the bristles' roots in this step, in the same four parts as BedPositions::root.
  float motion[4];
  bool torque;  ///< Whether the torque is computed also in a step without spin.
  /// Whether every tip is rewritten relative to a root at displacement zero, as after rolling or a long
  /// motion.
  bool rolled;
  bool rolls;            ///< Whether the bed rolled just before this step (bed_old_pressure).
  float half_rolled[2];  ///< half of the distance rolled in the step, as a vector; 0 without rolling
  /// Whether the motion is very short. Recomputing the position of a tip would then lose its path in
  /// rounding, so the path is added to the stored position, with `spread` (-1/2 to 1/2 of a digit) added
  /// before rounding. Only kernels with all outputs read it.
  bool creeps;
  float spread;
  float limit_of_pressure;
  float pressure_of_limit2;   ///< one over the square of BedStep::limit_of_pressure
  float kinetic_over_static;  ///< kinetic over static limit of friction
  float static_over_kinetic;  ///< static over kinetic limit of friction
  float gain;                 ///< deflection along y over that along x, of equal displacements; 1: isotropic
};

/// Sums over the bristles of a bed, in its units, from which the response is made.
struct BedSums {
  /// Force, the sum over the bristles of stiffness times deflection, and torque, the sum of its moments, at
  /// the end of the step.
  double force[2], torque;

  // Sums that are filled only by kernels which compute all outputs:
  double slipping;  ///< stiffness of the bristles that slid in the step
  double mean[2], mean_torque;
  /// Sums of stiffness x squared deflection at the end of the step, along x and y.
  double energy[2];
  /// Sum of stiffness x squared deflection at the beginning of the step, after bed_kept has reduced the
  /// deflections; 0 without bed_reloaded.
  double start_energy;
  /// Force and torque at the beginning of the step, after bed_kept has reduced the deflections; 0 without
  /// bed_reloaded. Rolling compares them with the force of the last step to find what the entering bristles
  /// lack.
  double start[2], start_torque;
  /// Stiffness of the bristles that entered the contact in this step: all of it, and the same with each
  /// bristle weighted by the share of its path on which it sticks. Both are 0 without rolling.
  double entered, entered_stuck;
  /// Energy dissipated by bristles that slide, or whose deflection drops to a lower limit.
  double dissipated;
  /// Sums over the bristles that did not slide, for the tangent: of their stiffness, and of stiffness times
  /// x, y, x^2 and y^2.
  double stuck, stuck_x, stuck_y, stuck_xx, stuck_yy;
};

/// Bits of an index into BedKernels::step.
enum BedVariant : std::uint32_t {
  bed_spins = 1,
  /// Flag of a step in which the contact rolled or changed its size, a limit fell, or the motion is long.
  /// Only then are bed_kept and bed_moved read.
  bed_reloaded = 2,
  bed_all_outputs = 4,
  bed_drops = 8,
  bed_variants = 16
};

struct BedKernels {
  void (*step[bed_variants])(const BedStep&, float* columns, BedSums&);
  /// Fills the columns of stiffness and pressure, and bed_kept, for a new size of the contact. Returns the
  /// sum of stiffness x pressure.
  double (*set_positions)(const BedPositions&, float* columns);
  /// Fills the columns that set_positions() fills, and the positions of bristles and tips, for a bed that can
  /// roll but does not in this step.
  double (*set_rows)(const BedPositions&, float* columns);
  /// Moves the cells along their rows by BedPositions::rolled, which is not 0. Fills the columns that
  /// set_positions() fills, positions and bed_moved, but not the tips, which must be relative to roots at
  /// displacement zero.
  double (*roll)(const BedPositions&, float* columns);
  /// Subtracts the displacement of its root, BedPositions::root, from each tip. The caller sets that
  /// displacement to zero, so deflections stay as they are.
  void (*rebase)(const BedPositions&, float* columns);
};

}  // namespace bristle::detail
