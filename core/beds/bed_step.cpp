// Steps one bed: applies the load, which sets the size of the contact, cuts rolling into pieces, and converts
// to and from the bed's units for the kernels.
#include <algorithm>
#include <cmath>

#include "core/beds/bed.hpp"
#include "core/materials/elementary.hpp"

namespace bristle::detail {

namespace {

/// Displacement of the bristles' roots, in units of deflection, above which rebase() resets it to zero.
/// Deflections are differences of root and tip; farther away, single precision would not represent them to
/// 5e-7.
constexpr double farthest_root = 8.0;
/// Motion of a step, in limits at relative pressure 1, below which a bed counts as creeping. Single precision
/// represents the position of a tip only to 1e-7 limits, so the rounding of such small motions is spread over
/// the steps. The second number is the displacement of the roots, in the same unit, above which rebase()
/// resets it to zero while the bed creeps.
constexpr double creep = 0x1p-10, farthest_creeping = 0.25;
/// Ratio of two limits below which a fall from one to the other rewrites all tips relative to roots at
/// displacement zero. A tip represents its bristle's deflection only to 6e-8 of the deflection before the
/// fall.
constexpr double deep_fall = 0x1p-10;
/// Limit at relative pressure 1, in units of deflection, below which a bed counts as free of friction,
/// because the load is so small.
constexpr double least_limit = 1e-12;
/// Motion, in units of the largest friction limit, after which every bristle is bent along the motion
/// whatever its state was before.
constexpr double longest_motion = 1e6;
/// Distance of rolling, in half lengths of the contact, below which rolling is only added up. The bristles
/// move once the sum has grown to this distance.
constexpr double least_rolled = 0x1p-13;
/// Largest distance, in half lengths of the contact, by which rolling moves the cells. A longer roll replaces
/// every cell in contact anyway, and single precision would lose their positions.
constexpr double longest_roll = 64.0;
/// Least size of the contact, relative to full load, from which lengths of pieces and of stored rolling are
/// calculated. They would vanish with the load otherwise.
constexpr double least_size = 0.05;
/// Length of the first and of the last part of a long rolling step that are cut into pieces, in lengths of
/// the contact. Between these parts the bed rolls steadily and needs no pieces.
constexpr double cut_lengths = 1.5;

/// Largest displacement or roll (m) and spin (rad) of a step.
constexpr double most_moved = 1e5, most_spin = 3.2;

bool within(double x, double most) noexcept { return std::abs(x) <= most; }

/// Returns the cube root of a number from 0 to 1, relative error 7e-15, by two steps of Halley's method from
/// an estimate with a third of the exponent. It avoids the C library, whose bits differ between machines.
double cube_root(double x) noexcept {
  if (x < 1e-300) return 0.0;
  if (x == 1.0) return 1.0;
  double y = from_bits(bits_of(x) / 3 + 0x2a9f7893782da1ceu);
  for (int i = 0; i < 2; ++i) {
    const double cube = y * y * y;
    y = y * ((cube + (x + x)) / (cube + cube + x));
  }
  return y;
}

/// Returns the size of the contact under a load, relative to its size at full load, by the law of BedGrowth.
double size_under(const Bed& bed, double load) noexcept {
  const double share = std::min(load / bed.full_load, 1.0);
  if (bed.growth == BedGrowth::cube_root) return cube_root(share);
  return bed.growth == BedGrowth::square_root ? square_root(share) : 1.0;
}

double limit_under(const Bed& bed, const BedState& s) noexcept {
  return s.pressure_sum > 0.0 ? bed.friction * s.load / (bed.stiffness * bed.deflection * s.pressure_sum)
                              : 0.0;
}

/// Returns the longest motion of the whole bed, in units of deflection, that is computed in full when the
/// caller asks only for the force at its end. A longer motion ends in the same state and is shortened to this
/// length.
double longest_under(const Bed& bed, const BedState& s) noexcept {
  return longest_motion * std::max(bed.most_pressure * s.limit_of_pressure, least_limit);
}

/// Returns the distance, m, below which rolling is only added up for later.
double most_waiting(const Bed& bed, const BedState& s) noexcept {
  return least_rolled * bed.half[0] * std::max(s.size, least_size);
}

}  // namespace

double set_positions(Bed& bed, const BedKernels& kernels, double rolled, bool turned) noexcept {
  const BedState& s = bed.state;
  BedPositions positions{};
  positions.count = bed.count;
  positions.profile = bed.profile;
  const double size2 = s.size * s.size;
  positions.size2 = static_cast<float>(size2);
  positions.inverse_size2 = static_cast<float>(size2 > 1e-30 ? 1.0 / size2 : 0.0);
  if (!bed.rolls) return kernels.set_positions(positions, bed.columns.get());
  positions.chords = bed.has_chords;
  positions.edge = static_cast<float>(s.size);
  const double to_x = bed.half[0] / bed.length, to_y = bed.half[1] / bed.length;
  positions.axes[0] = static_cast<float>(s.along[0] * to_x);
  positions.axes[1] = static_cast<float>(s.along[1] * to_y);
  positions.axes[2] = static_cast<float>(s.along[1] * to_x);
  positions.axes[3] = static_cast<float>(s.along[0] * to_y);
  for (int k = 0; k < 4; ++k) positions.root[k] = static_cast<float>(s.root[k]);
  positions.cell = static_cast<float>(bed.cell);
  if (rolled == 0.0) return kernels.set_rows(positions, bed.columns.get());
  positions.rolled = static_cast<float>(std::clamp(rolled / bed.half[0], -longest_roll, longest_roll));
  positions.over_rolled = static_cast<float>(bed.half[0] / magnitude(rolled));
  positions.turned = turned;
  return kernels.roll(positions, bed.columns.get());
}

namespace {

/// Straightens all bristles of a bed. Position and size of the contact stay.
void straighten(Bed& bed) noexcept {
  for (std::uint32_t i = 0; i < bed.count; ++i)
    for (const BedColumn c : {bed_tip_x, bed_tip_y, bed_slid}) bed.at(c, i) = 0.0f;
  for (double& r : bed.state.root) r = 0.0;
}

}  // namespace

void rest(Bed& bed) noexcept {
  for (std::uint32_t i = 0; bed.drops && i < bed.count; ++i) bed.at(bed_slid, i) = 0.0f;
}

void stand_rows(Bed& bed) noexcept {
  if (bed.in_row == 0) return;
  const double h = bed.cell;
  const std::uint32_t rows = bed.bristles / bed.in_row;
  for (std::uint32_t i = 0; i < bed.bristles; ++i) {
    const std::uint32_t row = i / bed.in_row;
    const double phase = 0.6180339887498949 * std::min(row, rows - 1 - row);
    const double shifted = i % bed.in_row + (phase - static_cast<int>(phase));
    bed.at(bed_along, i) = static_cast<float>(-1.0 - 0.5 * h + h * shifted);
  }
}

void unbend(Bed& bed, const BedKernels& kernels) noexcept {
  straighten(bed);
  stand_rows(bed);
  bed.state = BedState{};
  bed.state.size = size_under(bed, 0.0);
  set_positions(bed, kernels, 0.0);
  // Calls set_positions() twice, because the column bed_kept compares two calls. After the second call the
  // cells of a contact of fixed size count as already in contact, with straight bristles.
  bed.state.pressure_sum = set_positions(bed, kernels, 0.0);
}

bool accepts(const Bed& bed, const BedMotion& motion) noexcept {
  bool good =
      motion.normal_load >= 0.0 && motion.normal_load <= highest_load && within(motion.spin, most_spin);
  for (int k = 0; k < 2; ++k)
    good = good && within(motion.displacement[k], most_moved) && within(motion.rolled[k], most_moved);
  if (!good) return false;
  if (!bed.rolls) return motion.rolled[0] == 0.0 && motion.rolled[1] == 0.0;
  return bed.turns_rows || motion.rolled[1] == 0.0;
}

const char* find_bed_fault(const Bed& bed, const BedState& s, const float* columns) noexcept {
  BedRanges most{.size = size_under(bed, s.load),
                 .limit_of_pressure = limit_under(bed, s),
                 .turns_rows = bed.turns_rows};
  if (bed.rolls) most.rolled[0] = most_waiting(bed, s);
  if (bed.turns_rows) most.rolled[1] = most.rolled[0];
  // Largest displacement of the roots that a step leaves: run_kernel() resets a larger one to zero, and a
  // motion longer than `farthest_root` is not added to it.
  const double most_root = farthest_root + std::max(farthest_root, farthest_creeping * s.limit_of_pressure);
  for (double& root : most.root) root = 1.000001 * most_root;
  const char* fault = nullptr;
  bed_fields(s, most, [&fault](double x, const FieldRule& rule) {
    if (fault == nullptr && !is_allowed(x, rule)) fault = rule.name;
  });
  if (fault != nullptr) return fault;
  if (!within(square(s.along[0]) + square(s.along[1]) - 1.0, 1e-6)) return "along";
  if (s.rolled_last && !bed.rolls) return "rolled_last";

  constexpr double widest = 4.0;     // largest coordinate of a bristle's position, scaled
  constexpr double rounding = 1e-6;  // relative rounding error of the position of a bristle's tip
  const double farthest = most_root * (1.0 + widest);  // largest displacement of a bristle's root
  // Number of equal terms, in single precision, above which one more term does not change the sum. It
  // limits the rounding error of a saved sum.
  constexpr double most_added = 0x1p25;
  // Farthest tip of a cell out of contact, which may have left under any load and by one motion of any
  // length.
  double farthest_tip[2];
  for (int k = 0; k < 2; ++k) {
    const double motion = most_moved * bed.per_metre[k] + widest * most_spin * bed.per_radian[k];
    farthest_tip[k] =
        1.000001 * (farthest + (bed.all_outputs ? motion : std::min(motion, longest_under(bed, s)))) +
        2.0 * bed.static_over_kinetic * highest_load / bed.full_load;
  }
  double sum = 0.0, stiffness = 0.0;
  for (std::uint32_t i = 0; i < bed.count; ++i) {
    const auto at = [&](BedColumn c) { return static_cast<double>(columns[bed_index(c, i)]); };
    const double k = at(bed_stiffness), pressure = at(bed_pressure), over2 = at(bed_over_pressure2);
    const double most_pressure = bed.rolls ? 1.001 : 1.001 * static_cast<double>(bed.at(bed_share, i));
    bool good = k >= 0.0 && k <= 1.1 * static_cast<double>(bed.at(bed_own, i)) && pressure >= 0.0 &&
                pressure <= most_pressure && (k > 0.0) == (pressure > 0.0) && over2 >= 0.0 &&
                (k > 0.0 ? within(over2 * pressure * pressure - 1.0, 1e-3) : over2 == 0.0) &&
                within(at(bed_x), widest) && within(at(bed_y), widest) &&
                within(at(bed_along), 1.001 + bed.cell) &&
                (at(bed_slid) == 0.0 || (at(bed_slid) == 1.0 && bed.drops)) &&
                within(at(bed_kept) - 0.5, 0.5) && within(at(bed_moved) - 0.5, 0.5);
    const double reach =
        2.0 * bed.static_over_kinetic * s.limit_of_pressure * std::max(bed.most_pressure, most_pressure);
    const double turned[2] = {0.0 - s.root[2] * at(bed_y), s.root[3] * at(bed_x)};
    for (int axis = 0; axis < 2; ++axis) {
      const double tip = at(axis == 0 ? bed_tip_x : bed_tip_y);
      // Limits the deflection of a cell in contact by twice the largest static limit plus the rounding error
      // of a far position. For a cell out of contact only the position of the tip is bounded.
      good = good && (k > 0.0 ? within(s.root[axis] + turned[axis] - tip, reach + rounding * farthest)
                              : within(tip, (bed.all_outputs ? 2.0 : most_added) * farthest_tip[axis]));
    }
    if (!good) return "a bristle";
    sum += k * pressure;
    stiffness += k;
  }
  // Limits the saved force, which a bed at rest repeats, by twice the static limit plus what rounding adds.
  for (int k = 0; k < 2; ++k) {
    const double dust = rounding * farthest * stiffness;
    const double limit = 2.0 * bed.static_over_kinetic * s.limit_of_pressure * sum + dust;
    if (!within(s.force[k], limit) || !within(s.torque, 2.0 * widest * limit)) return "force";
  }
  // Compares the sum of pressures with the columns, because the sum scales the limits under every later load.
  return within(s.pressure_sum - sum, 0.01 * sum + 1e-30) ? nullptr : "pressure_sum";
}

namespace {

/// Motion of a bed in one step, or in one of the pieces into which a rolling step is cut.
struct Piece {
  double motion[4];  ///< scaled displacement along x and y, and by spin along x and y
  double rolled[2];  ///< distance rolled along x and y, m
  bool reloaded;
  bool falls_deep;  ///< whether the load has let the limit fall below `deep_fall` of its last value
};

/// Outputs of a step: the sums of its last piece, and averages over all its pieces.
struct StepSum {
  BedSums last;
  double mean[2] = {0.0, 0.0};
  double mean_torque = 0.0;
};

/// Moves the origin of all positions to the present root: root displacement zero, tips moved along.
/// Deflections stay the same and keep their precision.
void rebase(Bed& bed, const BedKernels& kernels) noexcept {
  BedPositions positions{};
  positions.count = bed.count;
  for (int k = 0; k < 4; ++k) {
    positions.root[k] = static_cast<float>(bed.state.root[k]);
    bed.state.root[k] = 0.0;
  }
  kernels.rebase(positions, bed.columns.get());
}

double largest_of(const double (&values)[4]) noexcept {
  return std::max(std::max(std::abs(values[0]), std::abs(values[1])),
                  std::max(std::abs(values[2]), std::abs(values[3])));
}

void run_kernel(Bed& bed, const BedKernels& kernels, const Piece& piece, BedSums& sums) noexcept {
  BedState& s = bed.state;
  const bool presses = s.limit_of_pressure > least_limit;
  if (!presses && !bed.all_outputs) {
    straighten(bed);
    sums = BedSums{};
    s.force[0] = s.force[1] = s.torque = 0.0;
    return;
  }
  const double most_motion = largest_of(piece.motion);
  const bool goes_far = most_motion > farthest_root || piece.falls_deep;
  const bool creeps =
      presses && !piece.reloaded && most_motion > 0.0 && most_motion < creep * s.limit_of_pressure;
  const double far = creeps ? farthest_creeping * s.limit_of_pressure : farthest_root;
  if (goes_far || largest_of(s.root) > far) rebase(bed, kernels);
  if (goes_far && !piece.reloaded)
    for (std::uint32_t i = 0; i < bed.count; ++i) bed.at(bed_kept, i) = bed.at(bed_moved, i) = 1.0f;
  BedStep step{};
  step.count = bed.count;
  step.creeps = creeps;
  if (creeps) {
    // Offsets rounding by a multiple of the golden ratio modulo 1. Such offsets are evenly spread, so the
    // rounding errors of many small steps cancel instead of adding up, however the bed moves.
    const double turns =
        1e9 * 0.6180339887498949 / s.limit_of_pressure * ((s.root[0] + s.root[1]) + (s.root[2] + s.root[3]));
    step.spread = static_cast<float>(turns - std::floor(turns) - 0.5);
  }
  step.limit_of_pressure = presses ? static_cast<float>(s.limit_of_pressure) : 0.0f;
  step.pressure_of_limit2 = presses ? static_cast<float>(1.0 / square(s.limit_of_pressure)) : 0.0f;
  step.static_over_kinetic = static_cast<float>(bed.static_over_kinetic);
  step.gain = static_cast<float>(bed.gain[1]);
  step.kinetic_over_static = bed.drops ? static_cast<float>(1.0 / bed.static_over_kinetic) : 1.0f;
  // Shortens a long motion if the caller asks only for the force at its end. The bristles end bent alike, and
  // single precision can represent the square of the shorter length.
  double share = 1.0;
  const double longest = longest_under(bed, s);
  if (!bed.all_outputs && most_motion > longest) share = longest / most_motion;
  step.rolls = piece.rolled[0] != 0.0 || piece.rolled[1] != 0.0;
  step.rolled = goes_far || step.rolls;
  step.torque = bed.resists_spin;
  for (int k = 0; k < 4; ++k) {
    const double motion = share * piece.motion[k];
    step.root[k] = static_cast<float>(s.root[k]);
    step.motion[k] = static_cast<float>(motion);
    if (!step.rolled) s.root[k] += motion;
  }
  for (int k = 0; k < 2 && piece.reloaded; ++k)
    step.half_rolled[k] = static_cast<float>(0.5 * piece.rolled[k] / bed.length);
  const bool spins =
      piece.motion[2] != 0.0 || piece.motion[3] != 0.0 || step.root[2] != 0.0f || step.root[3] != 0.0f;
  const unsigned variant = (spins ? bed_spins : 0u) | (piece.reloaded || goes_far ? bed_reloaded : 0u) |
                           (bed.all_outputs || creeps ? bed_all_outputs : 0u) | (bed.drops ? bed_drops : 0u);
  kernels.step[variant](step, bed.columns.get(), sums);
  for (int k = 0; k < 2; ++k) s.force[k] = sums.force[k];
  s.torque = sums.torque;
  if (!presses) straighten(bed);
}

/// Moves the rows of cells by the distance rolled in this piece, then steps the bristles. The mean force of
/// the kernel assumes that bristles enter the contact at the start of the piece, while they enter all along
/// it; on average half of the force that they lack there is added, as far as those bristles stick.
void roll_piece(Bed& bed, const BedKernels& kernels, const Piece& piece, double share, bool turned,
                StepSum& sum) noexcept {
  BedState& s = bed.state;
  const double distance = piece.rolled[0] * s.along[0] + piece.rolled[1] * s.along[1];
  const double before[3] = {s.force[0], s.force[1], s.torque};
  if (largest_of(s.root) > 0.0) rebase(bed, kernels);
  s.pressure_sum = set_positions(bed, kernels, distance, turned);
  s.rolled_last = true;
  s.limit_of_pressure = limit_under(bed, s);
  run_kernel(bed, kernels, piece, sum.last);
  const BedSums& last = sum.last;
  const double half = 0.5 * (last.entered > 0.0 ? last.entered_stuck / last.entered : 1.0);
  for (int k = 0; k < 2; ++k) sum.mean[k] += share * (last.mean[k] + half * (before[k] - last.start[k]));
  sum.mean_torque += share * (last.mean_torque + half * (before[2] - last.start_torque));
}

/// Turns the rows of a disc's cells to the direction of rolling, by at most a quarter turn, since the disc
/// can also roll backward along them. Returns whether they turned.
bool turn_rows(BedState& s) noexcept {
  const double length = square_root(square(s.rolled[0]) + square(s.rolled[1]));
  const double sign = s.rolled[0] * s.along[0] + s.rolled[1] * s.along[1] < 0.0 ? -1.0 : 1.0;
  bool turned = false;
  for (int k = 0; k < 2; ++k) {
    const double along = sign * s.rolled[k] / length;
    turned = turned || along != s.along[k];
    s.along[k] = along;
  }
  return turned;
}

/// Rolls by the stored distance s.rolled. Cuts it into pieces if the direction of slip may turn on it,
/// or if the caller asks for the mean force.
void roll(Bed& bed, const BedKernels& kernels, const double (&motion)[4], StepSum& sum) noexcept {
  BedState& s = bed.state;
  bool turned = bed.turns_rows && turn_rows(s);
  const double rolled[2] = {s.rolled[0], s.rolled[1]};
  s.rolled[0] = s.rolled[1] = 0.0;
  const bool cuts = bed.all_outputs || motion[2] != 0.0 || motion[3] != 0.0;
  const auto go = [&](double share, int times) {
    Piece piece{};
    piece.reloaded = true;
    if (times != 1) share /= times;
    for (int k = 0; k < 4; ++k) piece.motion[k] = motion[k] * share;
    for (int k = 0; k < 2; ++k) piece.rolled[k] = rolled[k] * share;
    for (int i = 0; i < times; ++i) {
      roll_piece(bed, kernels, piece, share, turned, sum);
      turned = false;
    }
  };
  if (!cuts) return go(1.0, 1);
  const double distance = square_root(square(rolled[0]) + square(rolled[1]));
  const double size = std::max(s.size, least_size), piece_length = bed.longest_piece * size;
  const double cut = cut_lengths * 2.0 * bed.half[0] * size;
  const auto pieces = [&](double part) { return static_cast<int>(part / piece_length * (1.0 - 1e-9)) + 1; };
  if (distance > 2.0 * cut + piece_length) {
    const double share = cut / distance;
    go(share, pieces(cut));
    go(1.0 - 2.0 * share, 1);
    go(share, pieces(cut));
  } else {
    go(1.0, pieces(distance));
  }
}

void write_tangent(const Bed& bed, const BedSums& sums, double (&tangent)[3][3]) noexcept {
  const double k = bed.stiffness, r = bed.length;
  tangent[0][0] = k * bed.gain[0] * sums.stuck;
  tangent[1][1] = k * bed.gain[1] * sums.stuck;
  tangent[0][1] = tangent[1][0] = 0.0;
  tangent[0][2] = 0.0 - k * r * bed.spin_gain[0] * sums.stuck_y;
  tangent[1][2] = k * r * bed.spin_gain[1] * sums.stuck_x;
  tangent[2][0] = 0.0 - k * r * bed.gain[0] * sums.stuck_y;
  tangent[2][1] = k * r * bed.gain[1] * sums.stuck_x;
  tangent[2][2] = k * r * r * (bed.spin_gain[0] * sums.stuck_yy + bed.spin_gain[1] * sums.stuck_xx);
}

}  // namespace

void step_bed(Bed& bed, const BedKernels& kernels, const BedMotion& motion, BedResponse& out) noexcept {
  BedState& s = bed.state;
  const double unit_force = bed.stiffness * bed.deflection;
  const double unit_energy = unit_force * bed.deflection;
  const auto stored = [&] {
    return 0.5 * unit_energy * (s.energy[0] / bed.gain[0] + s.energy[1] / bed.gain[1]);
  };
  const double stored_before = bed.all_outputs ? stored() : 0.0;
  const double spin = bed.resists_spin ? motion.spin : 0.0;
  double scaled[4];
  for (int k = 0; k < 2; ++k) {
    scaled[k] = bed.per_metre[k] * motion.displacement[k];
    scaled[2 + k] = bed.per_radian[k] * spin;
  }

  // Applies the load of the step, which sets the size of the contact.
  bool reloaded = false, falls_deep = false;
  const double limit_before = s.limit_of_pressure;
  if (motion.normal_load != s.load) {
    const double size = size_under(bed, motion.normal_load);
    const bool resized = size != s.size;
    s.size = size;
    s.load = motion.normal_load;
    // Calls set_positions() also when the size has not changed, so that the column bed_kept becomes 1 again.
    // Otherwise the entry of a part of the contact in the last step would reduce its bristle's deflection
    // once more.
    if (bed.growth != BedGrowth::fixed || s.rolled_last) s.pressure_sum = set_positions(bed, kernels, 0.0);
    s.rolled_last = false;
    s.limit_of_pressure = limit_under(bed, s);
    reloaded = resized || s.limit_of_pressure < limit_before;
    falls_deep = s.limit_of_pressure < deep_fall * limit_before;
  }

  for (int k = 0; k < 2; ++k) s.rolled[k] += motion.rolled[k];
  const bool rolls = bed.rolls && square(s.rolled[0]) + square(s.rolled[1]) >= square(most_waiting(bed, s));
  const bool rests = !reloaded && !rolls && scaled[0] == 0.0 && scaled[1] == 0.0 && scaled[2] == 0.0;
  StepSum sum;
  sum.last = BedSums{};
  if (rests && !bed.all_outputs) {
    // Gives the force of the last step again: the bed has not moved, and no friction limit has fallen.
    rest(bed);
  } else if (rolls) {
    if (reloaded) {  // applies the changed load without motion; rolling follows
      Piece piece{};
      piece.reloaded = true;
      piece.falls_deep = falls_deep;
      run_kernel(bed, kernels, piece, sum.last);
    }
    roll(bed, kernels, scaled, sum);
  } else {
    Piece piece{};
    for (int k = 0; k < 4; ++k) piece.motion[k] = scaled[k];
    piece.reloaded = reloaded;
    piece.falls_deep = falls_deep;
    run_kernel(bed, kernels, piece, sum.last);
    if (bed.all_outputs) {
      for (int k = 0; k < 2; ++k) sum.mean[k] = sum.last.mean[k];
      sum.mean_torque = sum.last.mean_torque;
    }
  }

  out.status = s.load > bed.full_load ? Status::overload : Status::ok;
  for (int k = 0; k < 2; ++k) out.force[k] = 0.0 - unit_force * s.force[k];
  out.torque = 0.0 - unit_force * bed.length * s.torque;
  if (!bed.all_outputs) return;
  const double energy_before = s.energy[0] + s.energy[1];
  for (int k = 0; k < 2; ++k) s.energy[k] = sum.last.energy[k];
  for (int k = 0; k < 2; ++k) out.mean[k] = 0.0 - unit_force * sum.mean[k];
  out.mean_torque = 0.0 - unit_force * bed.length * sum.mean_torque;
  out.stored = stored();
  if (!rolls && bed.isotropic) {
    const double left = reloaded ? std::max(energy_before - sum.last.start_energy, 0.0) : 0.0;
    out.dissipated = unit_energy * (sum.last.dissipated + 0.5 * left);
  } else {
    const double work =
        out.mean[0] * motion.displacement[0] + out.mean[1] * motion.displacement[1] + out.mean_torque * spin;
    out.dissipated = stored_before - out.stored - work;
  }
  const double all = sum.last.slipping + sum.last.stuck;
  if (all > 0.0) out.slipping_share = sum.last.slipping / all;
  write_tangent(bed, sum.last, out.tangent);
}

}  // namespace bristle::detail
