// Example of a rolling bed: the wheel of a car creeps while it brakes, stops, and stands on a slope.
#include <bristle/bed.hpp>

#include <cstdio>

int main() {
  using namespace bristle;
  const double load = 4000.0, radius = 0.3, dt = 1e-3;
  BedOptions options;
  options.max_normal_load = load;
  BedBatch beds;
  const BedId contact =
      beds.add(BedMaterial(1.0, 0.9).with_slip_stiffness(80e3, 60e3), BedShape::wheel_row(0.07), options);

  // A quarter of a car on one wheel: car's speed (m/s), wheel's spin (rad/s), torque of the brake (N m).
  double speed = 10.0, spin = speed / radius;
  const double mass = 400.0, inertia = 1.0, slope = 0.05 * mass * 9.81, brake = 900.0;
  double fastest = 0.0;
  for (int tick = 0; tick < 8000; ++tick) {
    // begin
    BedMotion motion;
    motion.id = contact;
    motion.displacement[0] = (speed - radius * spin) * dt;  // slip of the tyre over the road, m
    motion.rolled[0] = radius * spin * dt;                  // path rolled by its tread, m
    motion.normal_load = load;
    // Solves implicitly: the force that this motion would give, and the force's change with the motion.
    const BedResponse trial = beds.find_force(motion);
    const double stiffness = trial.tangent[0][0];
    const double per_force = dt * dt * (1.0 / mass + radius * radius / inertia);
    const double force = trial.force[0] / (1.0 + stiffness * per_force);
    speed += dt * (force - slope) / mass;
    spin -= dt * radius * force / inertia;
    // Stops the wheel within the step, or brakes it with the largest torque if that does not suffice.
    const double stop = inertia * spin / dt;
    const double torque = stop > brake ? brake : stop < -brake ? -brake : stop;
    spin -= dt * torque / inertia;
    motion.displacement[0] = (speed - radius * spin) * dt;
    motion.rolled[0] = radius * spin * dt;
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
