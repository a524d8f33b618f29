// `bristle fit --joint`: numbers from logs of made-up joints.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "expect.hpp"
#include "tools/files/user_error.hpp"
#include "tools/fitting/joint.hpp"

using namespace bristle;
using cli::JointEstimate;
using cli::JointFit;
using cli::JointLog;

namespace {

constexpr double inertia = 0.05;

JointMaterial gear() {
  JointMaterial m;
  m.stiffness = 200.0;
  m.viscous = 0.08;
  m.kinetic.base = 0.3;
  m.kinetic.motor[joint_driving] = 0.08;
  m.kinetic.motor[joint_driven] = 0.25;
  m.static_part.base = 0.15;
  m.stribeck_speed = 0.4;
  return m;
}

/// A weight of 2 N m on a servo that follows sines, holds, and lets it down: 12 s at 1 kHz.
JointLog made_up_log() {
  const JointMaterial m = gear();
  JointFriction joint(1, {&m, 1}, cli::joint_fit_options());
  JointLog log;
  log.name = "made up";
  log.has_speed = log.has_outside = true;
  std::mt19937 random(4);
  std::normal_distribution<double> noise(0.0, 0.01);
  double angle = 0.0, speed = 0.0, torque = 0.0, by_angle = 0.0, by_speed = 0.0;
  const double dt = 1e-3;
  for (int tick = 0; tick < 12000; ++tick) {
    const double t = tick * dt, phase = std::fmod(t, 3.0);
    const double goal = phase < 2.0 ? 0.8 * std::sin(6.283185307 * (0.5 + t / 12.0) * phase) : 0.6;
    const double motor = phase > 2.7 ? 0.3 : 12.0 * (goal - angle) - 1.0 * speed;
    const double outside = -2.0 * std::sin(angle);
    log.t.push_back(t);
    log.angle.push_back(angle);
    log.speed.push_back(speed);
    log.motor.push_back(motor + noise(random));
    log.outside.push_back(outside);
    double next = speed;
    for (int i = 0; i < 8; ++i) {
      const double there = angle + dt * next;
      joint.find_torque({{&there, 1}, {&next, 1}, {&motor, 1}, {&outside, 1}},
                        {{&torque, 1}, {}, {&by_angle, 1}, {&by_speed, 1}});
      next -= (inertia * (next - speed) - dt * (motor + outside + torque)) /
              (inertia - dt * (dt * by_angle + std::min(by_speed, 0.0)));
    }
    speed = next;
    angle += dt * speed;
    joint.step({{&angle, 1}, {&speed, 1}, {&motor, 1}, {&outside, 1}}, {{&torque, 1}});
  }
  return log;
}

const JointEstimate& number_of(const JointFit& fit, const std::string& name) {
  return *std::find_if(fit.numbers.begin(), fit.numbers.end(),
                       [&](const JointEstimate& e) { return e.name == name; });
}

}  // namespace

TEST_CASE("A fit of a joint recovers its numbers by direction", "[fit][joints]") {
  const JointFit fit = cli::fit_joint(made_up_log(), 1e9);
  // Of torques of some 3 N m: a step of the simulation is not the mean of its ends.
  CHECK(fit.fitted_rms < 0.05);
  const auto check = [&](const char* name, double expected, double tolerance) {
    const JointEstimate& e = number_of(fit, name);
    INFO(name << " " << e.value << " (" << e.low << " to " << e.high << ")");
    CHECK(e.determined);
    CHECK(std::abs(e.value / expected - 1.0) < tolerance);
  };
  check("inertia", inertia, 0.02);
  check("viscous", 0.08, 0.1);
  check("base", 0.3, 0.1);
  check("motor driving", 0.08, 0.2);
  check("motor driven", 0.25, 0.1);
  check("stiffness", 200.0, 0.1);
}

TEST_CASE(
    "On a log of a joint with losses by direction the brush is closer than Coulomb's friction and LuGre",
    "[fit][joints]") {
  const std::vector<JointFit> fits = cli::judge_joint(made_up_log(), 6.0);
  REQUIRE(fits.size() == 8);
  CHECK(fits.back().model == "brush");
  CHECK(fits.back().judged_rms < 0.05);
  for (const JointFit& fit : fits)
    if (fit.model == "Coulomb (m1)" || fit.model == "LuGre")
      CHECK(fit.judged_rms > 2.0 * fits.back().judged_rms);
}

TEST_CASE("Logs of joints are read with units, currents and pendulums, and refused by name",
          "[fit][joints]") {
  std::string rows;
  for (int i = 0; i < 60; ++i) rows += std::to_string(i) + ", " + std::to_string(i % 7) + ", 500\n";
  const JointLog log = cli::parse_joint_log("t [ms], angle [deg], current [mA]\n" + rows, "log", 2.0, 3.0);
  REQUIRE(log.t.size() == 60);
  CHECK(log.t[2] == Approx(0.002));
  CHECK(log.angle[2] == Approx(2.0 * 0.017453292519943295));
  CHECK(log.motor[2] == Approx(1.0));
  CHECK(log.outside[2] == Approx(-3.0 * std::sin(log.angle[2])));
  CHECK(log.speed[2] == Approx((log.angle[3] - log.angle[1]) / 0.002));
  const auto refusal = [&](const std::string& text, std::optional<double> constant = {}) {
    try {
      cli::parse_joint_log(text, "log", constant, {});
    } catch (const cli::UserError& error) {
      return std::string(error.what());
    }
    return std::string("(none)");
  };
  CHECK_THROWS_AS(cli::fit_joint(log, 1e9), cli::UserError);  // 60 ms
  CHECK(bristle_test::names(refusal("t,angle\n" + rows), {"log:1", "motor"}));
  CHECK(bristle_test::names(refusal("t,angle,current\n" + rows), {"--torque-constant"}));
  CHECK(bristle_test::names(refusal("t,motor,x\n" + rows), {"angle"}));
  CHECK(bristle_test::names(refusal("t,angle,motor\n1,2,3\n2,3,4\n"), {"at least 50"}));
}
