// Example of a rolling bed: the wheel of a car creeps while it brakes, stops, and stands on a slope.
#include <bristle/bed.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

int main(int argc, char** argv) {
  using namespace bristle;
  const double slip_stiffness = argc > 1 ? std::atof(argv[1]) : 80e3;  // N per unit slip
  const double load = 4000.0, radius = 0.3, dt = 1e-3;
  BedOptions options;
  options.max_normal_load = load;
  BedBatch beds;
  const BedId contact = beds.add(BedMaterial(1.0, 0.9).with_slip_stiffness(slip_stiffness, 60e3),
                                 BedShape::wheel_row(0.07), options);

  // A quarter of a car on one wheel: car's speed (m/s), wheel's spin (rad/s), torque of the brake (N m).
  double speed = 10.0, spin = speed / radius;
  const double mass = 400.0, inertia = 1.0, slope = 0.05 * mass * 9.81, brake = 900.0;
  const double per_force = dt * dt * (1.0 / mass + radius * radius / inertia);  // slip per force, m/N
  double force = 0.0, fastest = 0.0;
  for (int tick = 0; tick < 8000; ++tick) {
    // begin
    BedMotion motion;
    motion.id = contact;
    motion.normal_load = load;
    // Finds the force of the road that agrees with the motion which it causes. A stiff bed turns its force
    // round within a fraction of a tick, so the search stays between bounds that close in on the answer.
    double next_speed = speed, next_spin = spin, low = -1.01 * load, high = 1.01 * load;
    for (int i = 0; i < 40; ++i) {
      next_speed = speed + dt * (force - slope) / mass;
      next_spin = spin - dt * radius * force / inertia;
      next_spin -= std::clamp(next_spin, -dt * brake / inertia, dt * brake / inertia);  // stops it at most
      motion.displacement[0] = (next_speed - radius * next_spin) * dt;  // slip of the tyre over the road, m
      motion.rolled[0] = radius * next_spin * dt;                       // path rolled by its tread, m
      const BedResponse trial = beds.find_force(motion);
      const double off = force - trial.force[0];
      if (std::abs(off) < 1e-9 * load) break;
      (off > 0.0 ? high : low) = force;
      const double newton = force - off / (1.0 + trial.tangent[0][0] * per_force);
      force = newton > low && newton < high ? newton : 0.5 * (low + high);
    }
    speed = next_speed;
    spin = next_spin;
    BedResponse response;
    beds.step({&motion, 1}, {&response, 1});
    // end
    if (tick >= 7000 && speed * speed > fastest * fastest) fastest = speed;
    if (tick % 1000 == 0)
      std::printf("%4.1f s: car %6.3f m/s, wheel %6.3f m/s, force %7.1f N, %3.0f %% slips\n", tick * dt,
                  speed, radius * spin, response.force[0], 100.0 * response.slipping_share);
  }
  std::printf("fastest in the last second: %.2g m/s\n", fastest);
  return fastest < 1e-4 && fastest > -1e-4 ? 0 : 1;
}
