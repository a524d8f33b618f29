// Example of joint friction: an arm on a geared motor is lifted, held without the motor, and lowered.
#include <bristle/joint_friction.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>

int main() {
  // begin
  using namespace bristle;
  JointMaterial gear;
  gear.stiffness = 500.0;  // N m/rad
  gear.viscous = 0.3;      // N m s/rad
  gear.kinetic.base = 0.8;
  gear.kinetic.motor[joint_driving] = 0.10;  // share of the motor's torque while the motor drives
  gear.kinetic.motor[joint_driven] = 0.35;   // share while the arm drives the motor
  gear.static_part.base = 0.4;
  gear.stribeck_speed = 0.3;  // rad/s
  JointFriction joints(1, {&gear, 1});

  const double inertia = 0.2, weight = 1.0, dt = 1e-3;  // kg m^2; N m at the horizontal; s
  double angle = 0.0, speed = 0.0, motor = 0.0, outside = 0.0;
  double torque = 0.0, by_angle = 0.0, by_speed = 0.0;
  const JointInput in{{&angle, 1}, {&speed, 1}, {&motor, 1}, {&outside, 1}};
  const JointOutput out{{&torque, 1}, {}, {&by_angle, 1}, {&by_speed, 1}};
  joints.step(in, out);  // sets the angle at which the gear is unbent
  for (int tick = 0; tick < 8000; ++tick) {
    const double time = tick * dt;
    motor = time < 2.0 ? 4.0 * (1.2 - angle) - 2.0 * speed + 2.0 : time < 5.0 ? 0.0 : -0.6;
    outside = -weight * std::sin(angle);
    // Implicit step: Newton's method for the speed at its end.
    const double angle_before = angle, speed_before = speed;
    for (int i = 0; i < 6; ++i) {
      angle = angle_before + dt * speed;
      joints.find_torque(in, out);
      const double left = inertia * (speed - speed_before) - dt * (motor + outside + torque);
      const double slope = inertia - dt * (dt * by_angle + std::min(by_speed, 0.0));
      speed -= left / slope;
    }
    angle = angle_before + dt * speed;
    joints.step(in, out);
    if (tick % 1000 == 999)
      std::printf("%.0f s: angle %.6f rad, speed %9.2e rad/s, motor %5.2f N m, friction %6.3f N m\n", time,
                  angle, speed, motor, torque);
  }
  // end
  return std::abs(speed) < 0.01 && angle < 0.5 ? 0 : 1;  // whether the arm came down and stopped
}
