// Measurements of an invented joint whose parameters are known, to check what a fit finds.
#pragma once

#include <algorithm>
#include <cmath>
#include <random>

#include "tools/libraries/fitting/joint.hpp"

namespace bristle_test {

inline constexpr double made_up_inertia = 0.05;  // kg m^2

/// Returns the friction parameters of the invented joint. Seeds other than 0 multiply each parameter by a
/// factor of 0.7 to 1.4.
inline bristle::JointMaterial made_up_gear(unsigned seed = 0) {
  bristle::JointMaterial m;
  m.stiffness = 200.0;
  m.viscous = 0.08;
  m.kinetic.base = 0.3;
  m.kinetic.motor[bristle::joint_driving] = 0.08;
  m.kinetic.motor[bristle::joint_driven] = 0.25;
  m.static_part.base = 0.15;
  m.stribeck_speed = 0.4;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> factor(0.7, 1.4);
  if (seed != 0)
    for (double* number = &m.stiffness; number <= &m.stribeck_speed; ++number) *number *= factor(random);
  return m;
}

/// Returns the log of an invented joint's servo that moves a weight of 2 N m in sines, holds it, and lowers
/// it: simulated at 10 kHz, recorded at 1 kHz, with noise of 10 mN m on the motor's torque.
inline cli::JointLog made_up_log(double seconds, unsigned seed = 0) {
  const bristle::JointMaterial m = made_up_gear(seed);
  bristle::JointFriction joint(1, {&m, 1}, cli::joint_fit_options());
  cli::JointLog log;
  log.name = "made up";
  log.has_speed = log.has_outside = true;
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0.0, 0.01);
  const double swing = seed == 0 ? 0.8 : std::uniform_real_distribution<double>(0.5, 1.1)(random);
  double angle = 0.0, speed = 0.0, torque = 0.0, by_angle = 0.0, by_speed = 0.0;
  const double dt = 1e-4;
  for (int k = 0; k < std::lround(seconds / dt); ++k) {
    const double t = k * dt, phase = std::fmod(t, 3.0);
    const double goal = phase < 2.0 ? swing * std::sin(6.283185307 * (0.5 + t / 12.0) * phase) : 0.6;
    const double motor = phase > 2.7 ? 0.3 : 12.0 * (goal - angle) - 1.0 * speed;
    const double outside = -2.0 * std::sin(angle);
    if (k % 10 == 0) {
      log.t.push_back(t);
      log.angle.push_back(angle);
      log.speed.push_back(speed);
      log.motor.push_back(motor + noise(random));
      log.outside.push_back(outside);
    }
    double next = speed, there = angle, change = 1.0;
    for (int i = 0; i < 8 && std::abs(change) > 1e-12; ++i) {
      there = angle + dt * next;
      joint.find_torque({{&there, 1}, {&next, 1}, {&motor, 1}, {&outside, 1}},
                        {{&torque, 1}, {}, {&by_angle, 1}, {&by_speed, 1}});
      change = (made_up_inertia * (next - speed) - dt * (motor + outside + torque)) /
               (made_up_inertia - dt * (dt * by_angle + std::min(by_speed, 0.0)));
      next -= change;
    }
    speed = next;
    angle += dt * speed;
    joint.step({{&angle, 1}, {&speed, 1}, {&motor, 1}, {&outside, 1}}, {{&torque, 1}});
  }
  return log;
}

}  // namespace bristle_test
