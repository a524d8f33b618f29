// One bed: its constants, its state, its columns.
#pragma once

#include <cstdint>
#include <memory>
#include <new>

#include "bristle/bed.hpp"
#include "core/bed_table.hpp"

namespace bristle::detail {

struct FreeColumns {
  void operator()(float* columns) const noexcept { ::operator delete[](columns, std::align_val_t{64}); }
};
using BedMemory = std::unique_ptr<float[], FreeColumns>;
/// Makes the columns of `count` bristles, all zero. Throws std::bad_alloc.
BedMemory make_columns(std::uint32_t count);

/// State of a bed beside its columns. Plain data; scaled as in bed_table.hpp unless a unit is named.
struct BedState {
  double root[4] = {0.0, 0.0, 0.0, 0.0};
  double size = 0.0;               ///< of the contact, in its size at full load
  double load = 0.0;               ///< N
  double pressure_sum = 0.0;       ///< of stiffness x relative pressure
  double limit_of_pressure = 0.0;  ///< BedStep::limit_of_pressure
  double rolled[2] = {0.0, 0.0};   ///< m, not yet carried
  double along[2] = {1.0, 0.0};    ///< direction of the rows
  double force[2] = {0.0, 0.0};    ///< BedSums::force, torque and energy of the last step
  double torque = 0.0;
  double energy[2] = {0.0, 0.0};
  bool rolled_last = false;  ///< Whether the columns of shares are those of rolling.
};

struct Bed {
  std::uint32_t generation = 0;  ///< 0: none lives here
  std::uint32_t count = 0;       ///< bristles with padding
  std::uint32_t bristles = 0;
  BedProfile profile = BedProfile::uniform;
  BedGrowth growth = BedGrowth::fixed;
  bool rolls = false, turns_rows = false, has_chords = false, resists_spin = false, all_outputs = false,
       drops = false;
  bool isotropic = true;        ///< Whether all three gains are 1: then the kernels' account of energy holds.
  double half[2] = {0.0, 0.0};  ///< m, at full load
  double length = 0.0;          ///< m, unit of places
  double deflection = 0.0;      ///< m, unit of deflections
  double stiffness = 0.0;       ///< N/m, unit of stiffnesses
  double gain[2] = {1.0, 1.0};  ///< scaled deflection over displacement, along x and y
  double spin_gain[2] = {1.0, 1.0};              ///< likewise, of the displacement by spin
  double per_metre[2] = {}, per_radian[2] = {};  ///< scaled motion over displacement and spin
  double friction = 0.0;                         ///< kinetic
  double hold_over_limit = 1.0;
  double full_load = 0.0;       ///< N
  double longest_piece = 0.0;   ///< m, of rolling
  double cell = 0.0;            ///< BedPlaces::cell
  double most_pressure = 0.0;   ///< largest relative pressure at full load
  std::uint64_t last_step = 0;  ///< number of the step that named it last
  BedState state;
  BedMemory columns;

  float& at(BedColumn c, std::size_t i) const noexcept { return columns[bed_place(c, i)]; }
};

/// Checks the caller's material, shape and options and makes a bed. Throws Error.
Bed make_bed(const BedMaterial& material, const BedShape& shape, const BedOptions& options,
             const BedKernels& kernels);
/// Writes places, stiffnesses and pressures under the present size, after rolling by a distance (m) along the
/// rows, which may have turned since the last time. Returns the sum of stiffness x pressure.
double place(Bed& bed, const BedKernels& kernels, double rolled, bool turned = false) noexcept;
/// Unbends all bristles, out of contact.
void unbend(Bed& bed, const BedKernels& kernels) noexcept;
/// Steps a bed by a motion whose id and rolling are known to be good.
void step_bed(Bed& bed, const BedKernels& kernels, const BedMotion& motion, BedResponse& out) noexcept;
/// Whether a bed can make this motion.
bool accepts(const Bed& bed, const BedMotion& motion) noexcept;
/// Whether steps can bring a bed into this state. `columns` are as the bed's; their constants are not read.
bool is_possible(const Bed& bed, const BedState& state, const float* columns) noexcept;

}  // namespace bristle::detail
