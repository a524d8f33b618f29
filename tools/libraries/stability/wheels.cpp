// Simulates a quarter of a car on one wheel that climbs a slope, stops and rolls back. The contact, a bed of
// bristles, couples the car's mass and the wheel's inertia.
#include <algorithm>
#include <cmath>

#include <bristle/bed.hpp>

#include "tools/libraries/stability/stability.hpp"

namespace cli {
namespace {

constexpr double load = 4000.0, friction = 0.9, mass = 400.0, radius = 0.3, half = 0.07;
// Start speed of the car (m/s), simulated time (s), and force of gravity down the slope (N).
constexpr double start = 2.0, seconds = 8.0, downhill = 0.05 * load;

struct Car {
  bristle::BedBatch beds;
  bristle::BedMotion motion;
  bristle::BedResponse out;
  double per_car, per_rim, dt;  ///< speed gained by 1 N in a step, of car and of rim, m/s per N; time step, s
  double speed = start, rim = start, at = 0.0;

  explicit Car(const WheelRow& row)
      : per_car(row.dt_s / mass), per_rim(row.dt_s * radius * radius / row.inertia), dt(row.dt_s) {
    bristle::BedOptions options;
    options.max_normal_load = motion.normal_load = load;
    motion.id =
        beds.add(bristle::BedMaterial(friction).with_slip_stiffness(row.slip_stiffness, row.slip_stiffness),
                 bristle::BedShape::wheel_row(half), options);
  }
  /// Sets the bed's motion in a step for a friction force on the wheel, with speeds as they are after `share`
  /// of the step. Returns the car's displacement, m.
  double move(double force, double share) {
    const double path = dt * (speed + share * per_car * (force - downhill));
    motion.rolled[0] = dt * (rim - share * per_rim * force);
    motion.displacement[0] = path - motion.rolled[0];
    return path;
  }
  void step(double force, double share) {
    at += move(force, share);
    beds.step({&motion, 1}, {&out, 1});
    speed += per_car * (force - downhill);
    rim -= per_rim * force;
  }
  /// Solves for the mean force of a step by Newton's method, with the bed's tangent stiffness as slope and
  /// within bounds.
  void step_midpoint() {
    double high = 1.001 * friction * load, low = -high, force = out.force[0];
    for (int i = 0; i < 30; ++i) {
      move(force, 0.5);
      const bristle::BedResponse trial = beds.find_force(motion);
      const double off = force - trial.mean[0];
      if (std::fabs(off) < 1e-8 * load) break;
      (off > 0.0 ? high : low) = force;
      const double next = force - off / (1.0 + 0.25 * dt * (per_car + per_rim) * trial.tangent[0][0]);
      force = next > low && next < high ? next : 0.5 * (low + high);
    }
    step(force, 0.5);
  }
  double energy() const {
    return 0.5 * (mass * speed * speed + dt / per_rim * rim * rim) + out.stored + downhill * at;
  }
};

WheelResult drive(const WheelRow& row, bool midpoint) {
  Car car(row);
  WheelResult result;
  double before = car.energy();
  for (long k = 0; k < std::lround(seconds / row.dt_s); ++k) {
    midpoint ? car.step_midpoint() : car.step(car.out.force[0], 1.0);
    const double now = car.energy();
    result.gained_j = std::max(result.gained_j, now - before);
    before = now;
  }
  // Compares with the speed of rolling without slip, where the wheel's inertia adds to the car's mass.
  const double heavy = mass + row.inertia / (radius * radius);
  result.speed_error = car.speed - (start - downhill / heavy * seconds);
  return result;
}

}  // namespace

std::vector<WheelRow> wheel_rows() {
  std::vector<WheelRow> rows;
  for (const double slip_stiffness : {1e4, 1e6, 1e8})
    for (const double inertia : {0.05, 20.0})
      for (const double dt : {1e-3, 1e-2}) rows.push_back({slip_stiffness, inertia, dt, 0.0, {}, {}});
  return rows;
}

void run_wheel(WheelRow& row) {
  const Car car(row);
  row.k = row.dt_s * (car.per_car + car.per_rim) * car.beds.info(car.motion.id).stiffness;
  row.midpoint = drive(row, true);
  row.held = drive(row, false);
}

}  // namespace cli
