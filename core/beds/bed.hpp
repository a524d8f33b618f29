// The inside of a bed, the bristles under the contact area of an elastic body (BEDS.md): its constants, its
// state, the columns of its bristles, and the functions that bed_batch.cpp calls.
#pragma once

#include <cstdint>
#include <memory>
#include <new>

#include "bristle/bed.hpp"
#include "core/bed_table.hpp"
#include "core/patches/fields.hpp"

namespace bristle::detail {

struct FreeColumns {
  void operator()(float* columns) const noexcept { ::operator delete[](columns, std::align_val_t{64}); }
};
using BedMemory = std::unique_ptr<float[], FreeColumns>;
/// Allocates the columns (one array per number of a bristle) of a bed of `count` bristles, all zero. Throws
/// std::bad_alloc.
BedMemory make_columns(std::uint32_t count);

/// State of a bed except its columns: plain data, saved and restored byte by byte. Numbers are in the bed's
/// units (bed_table.hpp) unless a unit is named.
struct BedState {
  double root[4] = {0.0, 0.0, 0.0, 0.0};
  double size = 0.0;  ///< size of the contact, relative to its size at full load
  double load = 0.0;  ///< present normal load, N
  /// Sum over the bristles of stiffness x relative pressure, in the bed's units. The limits of all bristles
  /// together must equal friction coefficient times load, so this sum scales them.
  double pressure_sum = 0.0;
  double limit_of_pressure = 0.0;  ///< limit of a bristle's deflection at relative pressure 1, scaled
  /// Distance rolled, m, that is not yet done: rolling waits until it is long enough for single
  /// precision to move the bristles.
  double rolled[2] = {0.0, 0.0};
  double along[2] = {1.0, 0.0};  ///< unit vector along the rows of bristles
  double force[2] = {0.0, 0.0};  ///< BedSums::force of the last step, scaled; torque and energy too
  double torque = 0.0;
  double energy[2] = {0.0, 0.0};
  /// Whether the columns bed_kept and bed_moved may still have values of a step that rolled, and must be
  /// reset.
  bool rolled_last = false;
};

struct Bed {
  /// Generation of the bed in this slot, by which ids of earlier beds in the slot are refused; 0: no bed.
  std::uint32_t generation = 0;
  std::uint32_t count = 0;  ///< number of entries of a column: bristles, padded to a multiple of 16
  std::uint32_t bristles = 0;
  BedProfile profile = BedProfile::uniform;
  BedGrowth growth = BedGrowth::fixed;
  bool rolls = false, turns_rows = false, has_chords = false, resists_spin = false, all_outputs = false,
       drops = false;
  /// Whether the bed is equally stiff along x, along y and in spin (gains of 1), as the energy sums of the
  /// kernels assume. The gain along x is always 1.
  bool isotropic = true;
  double half[2] = {0.0, 0.0};  ///< half widths at full load, m
  double length = 0.0;          ///< length by which positions are divided in the columns, m
  double deflection = 0.0;      ///< length by which deflections are divided, m
  /// Stiffness of all bristles together along x at full load, N/m, which is the unit of the stiffnesses of
  /// single bristles.
  double stiffness = 0.0;
  double gain[2] = {1.0, 1.0};  ///< deflection of a bristle over the displacement of the bed, along x and y
  /// Gains of spin: deflection of a bristle over the displacement of its root by spin, along x and y.
  double spin_gain[2] = {1.0, 1.0};
  /// Displacement of the bristles' roots, in the bed's units, per metre of displacement, and per radian of
  /// spin at the distance `length` from the centre.
  double per_metre[2] = {}, per_radian[2] = {};
  double friction = 0.0;  ///< coefficient of kinetic friction
  double static_over_kinetic = 1.0;
  double full_load = 0.0;       ///< full load (BedOptions::max_normal_load), N
  double longest_piece = 0.0;   ///< longest piece of a rolling step that is cut, at full load, m
  double cell = 0.0;            ///< width of a cell along its row, over half the length of the row
  std::uint32_t in_row = 0;     ///< number of cells of a row; 0: the bed has no rows that roll
  double most_pressure = 0.0;   ///< largest relative pressure of a bristle at full load
  std::uint64_t last_step = 0;  ///< number of the last step for which the caller gave the bed a motion
  BedState state;
  BedMemory columns;

  float& at(BedColumn c, std::size_t i) const noexcept { return columns[bed_index(c, i)]; }
};

/// Makes a bed from the caller's material, shape and options, which it checks. Throws Error.
Bed make_bed(const BedMaterial& material, const BedShape& shape, const BedOptions& options,
             const BedKernels& kernels);
/// Writes the columns of stiffness and pressure for the present size of the contact, after the load or a roll
/// has changed it. The bed has rolled by `rolled` (m) along its rows; if it can roll, writes the column of
/// positions too. `turned`: whether the rows have turned since the last call. Returns the sum of stiffness x
/// pressure.
double set_positions(Bed& bed, const BedKernels& kernels, double rolled, bool turned = false) noexcept;
/// Sets the cells of a bed that rolls to their initial positions along their rows. Each row is shifted by a
/// part of a cell's width, so that cells of different rows enter the contact one after the other; two rows at
/// equal distance from the middle get equal shifts.
void stand_rows(Bed& bed) noexcept;
/// Resets a bed to its state when added: all bristles straight, out of contact, cells at their initial
/// positions.
void unbend(Bed& bed, const BedKernels& kernels) noexcept;
/// Ends the sliding of a bed that does not move in this step: bristles that slid in the last step get their
/// static limits back.
void rest(Bed& bed) noexcept;
/// Steps a bed by a motion that accepts() has allowed, and writes its response.
void step_bed(Bed& bed, const BedKernels& kernels, const BedMotion& motion, BedResponse& out) noexcept;
/// Returns whether a bed can make a motion: its numbers are valid, and it rolls only if the bed can roll in
/// that direction.
bool accepts(const Bed& bed, const BedMotion& motion) noexcept;
/// Checks a saved state of a bed before it is restored. Returns null if it is good, otherwise the name of a
/// value that the bed cannot have. `columns` are laid out as the bed's; their constants are not read.
const char* find_bed_fault(const Bed& bed, const BedState& state, const float* columns) noexcept;

/// Allowed ranges of those saved numbers that depend on the bed and its load.
struct BedRanges {
  double size = 0.0, limit_of_pressure = 0.0;  ///< the only values allowed
  double rolled[2] = {}, root[4] = {};         ///< largest magnitudes
  bool turns_rows = false;
};
/// Calls `visit` with each number of a bed's saved state and its allowed range, in the order of saving.
/// Saving, restoring and checking share this list.
template <class State, class Visit>
void bed_fields(State& s, const BedRanges& most, Visit&& visit) {
  // Largest plausible force, torque or energy in a saved state: more than sixteen sums of floats can reach. A
  // larger number means damaged bytes.
  constexpr double most_sum = 1e45;
  const double limit = most.limit_of_pressure;
  for (int k = 0; k < 4; ++k) visit(s.root[k], FieldRule{"a root's position", -most.root[k], most.root[k]});
  visit(s.size, FieldRule{"size", most.size - 1e-9, most.size + 1e-9});
  visit(s.load, FieldRule{"load", 0.0, highest_load});
  visit(s.pressure_sum, FieldRule{"pressure_sum", 0.0});
  visit(s.limit_of_pressure, FieldRule{"limit_of_pressure", limit * (1.0 - 1e-9), limit * (1.0 + 1e-9)});
  for (int k = 0; k < 2; ++k) visit(s.rolled[k], FieldRule{"rolled", -most.rolled[k], most.rolled[k]});
  visit(s.along[0], FieldRule{"along", most.turns_rows ? -1.0 - 1e-6 : 1.0, 1.0 + 1e-6});
  visit(s.along[1],
        FieldRule{"along", most.turns_rows ? -1.0 - 1e-6 : 0.0, most.turns_rows ? 1.0 + 1e-6 : 0.0});
  for (auto& force : s.force) visit(force, FieldRule{"force", -most_sum, most_sum});
  visit(s.torque, FieldRule{"torque", -most_sum, most_sum});
  for (auto& energy : s.energy) visit(energy, FieldRule{"energy", 0.0, most_sum});
}

}  // namespace bristle::detail
