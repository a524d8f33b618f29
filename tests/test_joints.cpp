// Joints (joint_friction.hpp) against closed forms, an implementation bristle by bristle, and difference
// quotients.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "bristle/bristle.h"
#include "bristle/error.hpp"
#include "bristle/joint_friction.hpp"
#include "bristle/snap_length.hpp"
#include "core/materials/strata.hpp"
#include "expect.hpp"

namespace bristle_test::test_joints {

using namespace bristle;

namespace {

/// Returns the material of a strong servo's gear, with a different value in every field.
JointMaterial gear() {
  JointMaterial m;
  m.stiffness = 300.0;
  m.viscous = 0.03;
  m.kinetic.base = 0.4;
  m.kinetic.motor[joint_driving] = 0.12;
  m.kinetic.motor[joint_driven] = 0.3;
  m.kinetic.outside[joint_driving] = 0.05;
  m.kinetic.outside[joint_driven] = 0.08;
  m.static_part.base = 0.15;
  m.static_part.motor[joint_driving] = 0.04;
  m.static_part.motor[joint_driven] = 0.07;
  m.static_part.outside[joint_driving] = 0.02;
  m.static_part.outside[joint_driven] = 0.03;
  m.stribeck_speed = 0.5;
  return m;
}

double& number_of(JointMaterial& m, unsigned p) { return reinterpret_cast<double*>(&m)[p]; }

/// A batch of one joint, with the outputs of its last step.
struct OneJoint {
  JointFriction batch;
  double torque = 0, mean = 0, by_angle = 0, by_speed = 0, by_motor = 0, by_outside = 0;
  double gradient[joint_parameters] = {};
  Status status = Status::ok;
  bool gradients;

  explicit OneJoint(const JointMaterial& m, const JointOptions& options = {}, const BatchOptions& how = {})
      : batch(1, {&m, 1}, options, how), gradients(options.gradients) {}
  void go(double angle, double speed, double motor, double outside, bool keep = true) {
    const JointInput in{{&angle, 1}, {&speed, 1}, {&motor, 1}, {&outside, 1}};
    JointOutput out{{&torque, 1},   {&mean, 1},       {&by_angle, 1}, {&by_speed, 1},
                    {&by_motor, 1}, {&by_outside, 1}, {&status, 1},   {}};
    if (gradients) out.gradient = gradient;
    keep ? batch.step(in, out) : batch.find_torque(in, out);
  }
};

/// A plain implementation of a joint, bristle by bristle, written from the header's description and not from
/// the library's source. T is double or long double.
template <class T>
struct Judge {
  T number[joint_parameters];
  std::vector<T> share, length, z;
  std::vector<int> side;  ///< direction in which each bristle slid in the last step; 0 if it stuck
  T before = 0, torque = 0, mean = 0;

  Judge(const JointMaterial& m, int n, double spread)
      : z(static_cast<std::size_t>(n), T(0)), side(z.size(), 0) {
    std::copy_n(&m.stiffness, +joint_parameters, number);
    const auto strata =
        detail::make_strata(SnapLength::lognormal(1.0, spread), static_cast<std::uint32_t>(n));
    share.assign(strata.share.begin(), strata.share.end());
    length.assign(strata.length.begin(), strata.length.end());
  }
  /// Returns a joint's loss torques at the torques `motor` and `outside`, for motion in the direction `sign`.
  /// `base` is the index of their first parameter, the loss without torque.
  T losses(unsigned base, T motor, T outside, int sign) const {
    const unsigned direction = motor * T(sign) > 0 ? joint_driving : joint_driven;
    return number[base] + number[base + 1 + direction] * std::abs(motor) +
           number[base + 3 + direction] * std::abs(outside);
  }
  void go(T angle, T speed, T motor, T outside) {
    const T d = angle - before, fall = number[joint_stribeck_speed];
    const int sign = d < 0 ? -1 : 1;
    const T left = fall > 0 ? std::exp(-(speed / fall) * (speed / fall)) : T(0);
    torque = mean = 0;
    for (std::size_t i = 0; i < z.size(); ++i) {
      const auto limit = [&](int s, bool holds) {
        return (losses(joint_base, motor, outside, s) +
                (holds ? 1 : left) * losses(joint_static_base, motor, outside, s)) *
               length[i] / number[joint_stiffness];
      };
      int slides = 0;
      for (const int s : {1, -1})
        if (z[i] * T(s) > limit(s, side[i] == 0)) {
          z[i] = T(s) * limit(s, false);
          slides = s;
        }
      const T holds = limit(sign, (side[i] == 0 && slides == 0) || z[i] * T(sign) < 0);
      const T to_go = holds - z[i] * T(sign);
      T average = z[i] + d / 2;
      if (to_go < std::abs(d)) {
        const T sticks = std::max(to_go, T(0)) / std::abs(d);
        average = sticks * (z[i] + sticks * d / 2) + (1 - sticks) * T(sign) * limit(sign, false);
        z[i] = T(sign) * limit(sign, false);
        slides = sign;
      } else {
        z[i] += d;
      }
      side[i] = slides;
      torque -= number[joint_stiffness] * share[i] * z[i];
      mean -= number[joint_stiffness] * share[i] * average;
    }
    torque -= number[joint_viscous] * speed;
    mean -= number[joint_viscous] * speed;
    before = angle;
  }
};

/// A motion that sticks, slides, reverses and jumps, under varying torques.
struct Wander {
  std::mt19937 random{7};
  double angle = 0.3, speed = 0, motor = 0, outside = 0;
  double dt = 1e-3;
  explicit Wander(unsigned seed) : random(seed) {}
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  }
  void go() {
    const double size = std::pow(10.0, uniform(-6.0, -1.5));
    const double d = uniform(0, 1) < 0.1 ? 0.0 : size * uniform(-1.0, 1.3);
    angle += d;
    speed = d / dt;
    if (uniform(0, 1) < 0.5) motor = uniform(0, 1) < 0.1 ? 0.0 : uniform(-2, 2);
    if (uniform(0, 1) < 0.5) outside = uniform(0, 1) < 0.1 ? 0.0 : uniform(-2, 2);
  }
};

/// Rotor under a joint's friction, stepped implicitly by the derivatives of the friction, so that stiff
/// joints need no short steps.
struct Rotor {
  OneJoint joint;
  double inertia, angle = 0, speed = 0;
  Rotor(const JointMaterial& m, double kg_m2) : joint(m), inertia(kg_m2) { joint.go(0, 0, 0, 0); }
  void go(double dt, double motor, double outside) {
    for (int i = 0; i < 8; ++i) {
      joint.go(trial + 0.0, (trial - angle) / dt, motor, outside, false);
      const double residual =
          inertia * (trial - angle - dt * speed) - dt * dt * (joint.torque + motor + outside);
      const double slope = inertia - dt * dt * joint.by_angle - dt * std::min(joint.by_speed, 0.0);
      const double change = residual / slope;
      trial -= change;
      if (std::abs(change) < 1e-16) break;
    }
    speed = (trial - angle) / dt;
    angle = trial;
    joint.go(angle, speed, motor, outside);
  }
  double trial = 0;
};

}  // namespace

TEST_CASE(
    "A joint holds 0.3 N m under 3 N m of static friction for an hour without creep, and lets go at 3.1",
    "[joints]") {
  JointMaterial m;
  m.stiffness = 500;
  m.viscous = 0.05;
  m.kinetic.base = 2.5;
  m.static_part.base = 0.5;
  m.stribeck_speed = 0.5;
  Rotor rotor(m, 0.01);
  const double dt = 1e-3;
  for (int i = 0; i < 60000; ++i) rotor.go(dt, 0, std::min(0.3, i * 1e-4));
  const double at_rest = rotor.angle;
  CHECK(at_rest == Approx(0.3 / 500).epsilon(0.05));
  const int hour = static_cast<int>(bristle_test::test_size(3600000));
  for (int i = 0; i < hour; ++i) rotor.go(dt, 0, 0.3);
  CHECK(std::abs(rotor.angle - at_rest) <= 1e-18);
  // Pushes the rotor for ten seconds with up to 2.99 N m, just below the joint's static friction.
  for (int i = 0; i < 30000; ++i) rotor.go(dt, 0, std::min(2.99, 0.3 + i * 1.5e-4));
  CHECK(std::abs(rotor.speed) < 1e-9);
  CHECK(rotor.angle < 0.1);
  for (int i = 0; i < 3000; ++i) rotor.go(dt, 0, 3.1);
  CHECK(rotor.angle > 1.0);
  CHECK(rotor.speed > 1.0);
}

TEST_CASE("A sliding joint has the torque of its losses by direction, load and speed", "[joints]") {
  const JointMaterial m = gear();
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-3, 3);
  for (int trial = 0; trial < 200; ++trial) {
    OneJoint joint(m);
    const double motor = any(random), outside = any(random), speed = any(random);
    joint.go(0, 0, motor, outside);
    joint.go(speed, speed, motor, outside);
    const bool drives = motor * speed > 0;
    const double w = std::exp(-std::pow(speed / m.stribeck_speed, 2));
    const double friction =
        0.4 + (drives ? 0.12 : 0.3) * std::abs(motor) + (drives ? 0.05 : 0.08) * std::abs(outside) +
        w * (0.15 + (drives ? 0.04 : 0.07) * std::abs(motor) + (drives ? 0.02 : 0.03) * std::abs(outside));
    expect_near(joint.torque, -std::copysign(friction, speed) - 0.03 * speed, 1e-12, "torque in sliding");
    expect(joint.by_angle == 0.0, "a sliding joint has no stiffness");
  }
  // A joint without a motor torque counts as driven by the outside torque.
  OneJoint joint(m);
  joint.go(0, 0, 0, 2);
  joint.go(1, 1e3, 0, 2);
  CHECK(joint.torque == Approx(-(0.4 + 0.08 * 2) - 0.03 * 1e3).epsilon(1e-14));
}

TEST_CASE("A motor lifts and holds a weight, and lets it down, at the torques of its two directions",
          "[joints]") {
  // A weight pulls by 2 N m. The motor torque t lifts if (1 - a) t = 2 + base + b 2 and lowers if (1 + a') t
  // = 2 - base - b' 2, with the losses (base, a, b) of driving and (base, a', b') of being driven.
  JointMaterial m = gear();
  m.static_part = {};
  m.viscous = 0;
  const double lifts = (2 + 0.4 + 0.05 * 2) / (1 - 0.12), lets_down = (2 - 0.4 - 0.08 * 2) / (1 + 0.3);
  const auto final_speed = [&](double motor) {
    Rotor rotor(m, 0.01);
    for (int i = 0; i < 2000; ++i)
      rotor.go(1e-3, motor * std::min(i * 1e-3, 1.0), -2 * std::min(i * 1e-3, 1.0));
    return rotor.speed;
  };
  CHECK(final_speed(lifts + 0.01) > 0.01);
  CHECK(std::abs(final_speed(lifts - 0.01)) < 1e-7);
  CHECK(std::abs(final_speed(lets_down + 0.01)) < 1e-7);
  CHECK(final_speed(lets_down - 0.01) < -0.01);
}

TEST_CASE("First loading of a joint follows the law of its bristles, and its error falls with their square",
          "[joints]") {
  JointMaterial m;
  m.stiffness = 200;
  m.kinetic.base = 1.5;
  const double length = 1.5 / 200;
  const SnapLength law = SnapLength::lognormal(1.0, 0.4);
  const auto worst = [&](int bristles) {
    JointOptions options;
    options.bristles = bristles;
    OneJoint joint(m, options);
    joint.go(0, 0, 0, 0);
    double error = 0;
    for (int i = 1; i < 400; ++i) {
      const double x = 0.01 * i;
      joint.go(x * length, 0, 0, 0);
      const double expected = x * law.survival(x) + law.partial_moment(1, x);
      error = std::max(error, std::abs(joint.torque / -1.5 - expected));
    }
    // Back from steady sliding by 2 x: the torque changes by twice that of first loading by x.
    joint.go(20 * length, 0, 0, 0);
    for (int i = 1; i < 400; ++i) {
      const double x = 0.01 * i;
      joint.go((20 - 2 * x) * length, 0, 0, 0);
      const double expected = 1 - 2 * (x * law.survival(x) + law.partial_moment(1, x));
      error = std::max(error, 0.5 * std::abs(joint.torque / -1.5 - expected));
    }
    return error;
  };
  CHECK(worst(8) < 2.1e-3);
  CHECK(worst(32) < 1.3e-4);
  CHECK(worst(8) / worst(32) > 12);
  // With equal lengths of all bristles, the joint is a spring up to that length and then has Coulomb
  // friction.
  JointOptions alike;
  alike.spread = 0;
  alike.bristles = 1;
  OneJoint joint(m, alike);
  joint.go(0, 0, 0, 0);
  joint.go(0.5 * length, 0, 0, 0);
  CHECK(joint.torque == Approx(-0.75).epsilon(1e-14));
  CHECK(joint.by_angle == Approx(-200).epsilon(1e-14));
  joint.go(1.5 * length, 0, 0, 0);
  CHECK(joint.torque == Approx(-1.5).epsilon(1e-14));
  // Mean over a step in which the torque rises from 0.75 to 1.5 in the first half, then stays at 1.5.
  CHECK(joint.mean == Approx(-1.3125).epsilon(1e-14));
}

TEST_CASE("Joints have the torque and the mean of a plain implementation bristle by bristle", "[joints]") {
  for (const int features : {0, 1, 2, 3, 4}) {
    JointMaterial m = gear();
    if ((features & 1) == 0)
      for (int k = 0; k < 2; ++k)
        m.kinetic.motor[k] = m.kinetic.outside[k] = m.static_part.motor[k] = m.static_part.outside[k] = 0;
    if ((features & 2) == 0) m.static_part = {};
    if (features == 4) {
      m = gear();
      m.stribeck_speed = 0;
    }
    OneJoint joint(m);
    Judge<double> judge(m, 8, 0.4);
    Wander wander(static_cast<unsigned>(features));
    judge.before = wander.angle;
    joint.go(wander.angle, 0, 0, 0);
    for (int i = 0; i < 5000; ++i) {
      wander.go();
      joint.go(wander.angle, wander.speed, wander.motor, wander.outside);
      judge.go(wander.angle, wander.speed, wander.motor, wander.outside);
      expect_near(joint.torque, judge.torque, 1e-10, "torque at the end");
      expect_near(joint.mean, judge.mean, 1e-10, "mean");
    }
  }
}

TEST_CASE("A joint never gives more energy than it took, whatever its loads", "[joints]") {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    JointMaterial m = gear();
    if (seed % 2 == 0) m.stribeck_speed = 0;
    OneJoint joint(m);
    Wander wander(seed);
    joint.go(wander.angle, 0, 0, 0);
    double taken = 0, least = 0;
    for (int i = 0; i < 5000; ++i) {
      const double before = wander.angle;
      wander.go();
      joint.go(wander.angle, wander.speed, wander.motor, wander.outside);
      taken -= joint.mean * (wander.angle - before);
      least = std::min(least, taken);
    }
    expect(least > -1e-12, "energy is made");
    expect(taken > 0.1, "energy is taken");
  }
}

TEST_CASE("A pendulum on a joint stops and stays", "[joints]") {
  JointMaterial m;
  m.stiffness = 400;
  m.viscous = 0.002;
  m.kinetic.base = 0.05;
  m.static_part.base = 0.02;
  m.stribeck_speed = 0.2;
  Rotor rotor(m, 0.02);
  rotor.joint.batch.reset();
  rotor.joint.go(1.0, 0, 0, 0);
  rotor.angle = rotor.trial = 1.0;
  const auto gravity = [&] { return -1.0 * std::sin(rotor.angle); };
  for (int i = 0; i < 60000; ++i) rotor.go(1e-3, 0, gravity());
  const double stopped = rotor.angle;
  for (int i = 0; i < 100000; ++i) rotor.go(1e-3, 0, gravity());
  CHECK(std::abs(rotor.angle - stopped) <= 1e-17);
  CHECK(std::abs(std::sin(stopped)) <= 0.07);
}

// Difference quotients of the plain implementation in long double, whose own error is below 1e-9.
TEST_CASE("Derivatives of a joint's torque are right to 1e-6 where no bristle begins or ends to slide",
          "[joints]") {
  for (const double stribeck : {0.5, 0.0}) {
    JointMaterial m = gear();
    m.stribeck_speed = stribeck;
    OneJoint joint(m);
    Judge<long double> judge(m, 8, 0.4);
    Wander wander(11);
    judge.before = wander.angle;
    joint.go(wander.angle, 0, 0, 0);
    int checked[4] = {};
    for (int i = 0; i < 1500; ++i) {
      wander.go();
      const double x[4] = {wander.angle, wander.speed, wander.motor, wander.outside};
      joint.go(x[0], x[1], x[2], x[3]);
      const double by[4] = {joint.by_angle, joint.by_speed, joint.by_motor, joint.by_outside};
      for (int k = 0; k < 4; ++k) {
        const long double h = k == 0 ? 1e-9L : 1e-6L;
        Judge<long double> low = judge, high = judge;
        long double less[4] = {x[0], x[1], x[2], x[3]}, more[4] = {x[0], x[1], x[2], x[3]};
        less[k] -= h;
        more[k] += h;
        // Skips inputs at which the torque has a kink: a motor or outside torque near 0, and the derivative
        // by angle of a joint that does not move.
        if (k >= 2 && less[k] * more[k] <= 0) continue;
        if (k == 0 && std::abs(x[0] - judge.before) <= h) continue;
        low.go(less[0], less[1], less[2], less[3]);
        high.go(more[0], more[1], more[2], more[3]);
        if (low.side != high.side) continue;
        ++checked[k];
        expect_near(static_cast<double>((high.torque - low.torque) / (2 * h)), by[k], 1e-6,
                    "derivative by a number of the input");
      }
      judge.go(x[0], x[1], x[2], x[3]);
    }
    for (const int n : checked) CHECK(n > 1000);
  }
}

TEST_CASE("Derivatives of a joint's torque by its material are right to 1e-6 through a whole run",
          "[joints]") {
  JointMaterial no_fall = gear(), no_static_part = gear(), no_load = gear();
  no_fall.stribeck_speed = 0.0;
  no_static_part.static_part = {};
  no_load.kinetic = {0.4, {}, {}};
  no_load.static_part = {0.15, {}, {}};
  for (const JointMaterial& m : {gear(), no_fall, no_static_part, no_load}) {
    JointOptions with;
    with.gradients = true;
    OneJoint joint(m, with), plain(m);
    // Runs for each parameter of the material, with that parameter lowered and raised by a relative 1e-6, or
    // by 1e-6 if it is 0.
    std::vector<Judge<long double>> low, high;
    for (unsigned p = 0; p < joint_parameters; ++p) {
      low.emplace_back(m, 8, 0.4);
      high.emplace_back(m, 8, 0.4);
      const long double change = 1e-6L * (low[p].number[p] != 0 ? low[p].number[p] : 1);
      low[p].number[p] -= change;
      high[p].number[p] += change;
    }
    Wander wander(5);
    for (auto* all : {&low, &high})
      for (auto& judge : *all) judge.before = wander.angle;
    for (OneJoint* one : {&joint, &plain}) one->go(wander.angle, 0, 0, 0);
    // Whether a bristle slid in only one of the two runs, which leaves a difference until it slides in both.
    std::vector<std::vector<bool>> apart(joint_parameters, std::vector<bool>(8, false));
    int checked = 0;
    for (int i = 0; i < 500; ++i) {
      wander.go();
      for (OneJoint* one : {&joint, &plain})
        one->go(wander.angle, wander.speed, wander.motor, wander.outside);
      expect(joint.torque == plain.torque, "gradients leave the torque as it is");
      for (unsigned p = 0; p < joint_parameters; ++p) {
        if (p == joint_stribeck_speed && m.stribeck_speed == 0.0) continue;
        for (auto* judge : {&low[p], &high[p]})
          judge->go(wander.angle, wander.speed, wander.motor, wander.outside);
        bool same = true;
        for (std::size_t b = 0; b < 8; ++b) {
          if (low[p].side[b] != high[p].side[b])
            apart[p][b] = true;
          else if (low[p].side[b] != 0)
            apart[p][b] = false;
          same &= !apart[p][b];
        }
        if (!same) continue;
        ++checked;
        const long double slope = (high[p].torque - low[p].torque) / (high[p].number[p] - low[p].number[p]);
        expect_near(static_cast<double>(slope), joint.gradient[p],
                    1e-6 * std::max(1.0, std::abs(joint.gradient[p])),
                    "derivative by a number of the material");
      }
    }
    CHECK(checked > 450 * static_cast<int>(joint_parameters));
  }
}

TEST_CASE("Joints refuse arrays of another length, and begin with the first good angle", "[joints]") {
  const JointMaterial m = gear();
  constexpr std::size_t n = 20;
  JointFriction joints(n, {&m, 1});
  std::vector<double> angle(n, 0.0), speed(n, 0.0), torque(n);
  const std::uint64_t stepped = joints.state_hash();
  CHECK(joints.step({{angle.data(), n - 1}, {}, {}, {}}, {torque}).status == Status::bad_input);
  CHECK(joints.step({angle, {speed.data(), 1}, {}, {}}, {torque}).status == Status::bad_input);
  JointOutput wants_gradient{torque};
  std::vector<double> gradient(n * joint_parameters);
  wants_gradient.gradient = gradient;
  CHECK(joints.step({angle, {}, {}, {}}, wants_gradient).status == Status::bad_input);
  CHECK(joints.state_hash() == stepped);
  JointOptions with;
  with.gradients = true;
  JointFriction gives(n, {&m, 1}, with);
  CHECK(gives.step({angle, {}, {}, {}}, wants_gradient).status == Status::ok);
  wants_gradient.gradient = {gradient.data(), n};
  CHECK(gives.step({angle, {}, {}, {}}, wants_gradient).status == Status::bad_input);
  // Checks that a joint whose first step had bad input starts as a fresh one in the next step.
  OneJoint late(m), other(m);
  late.go(std::nan(""), 0, 0, 0);
  for (OneJoint* joint : {&late, &other}) {
    joint->go(0.7, 0, 0, 0);
    joint->go(0.701, 0, 0, 0);
  }
  CHECK(late.torque == other.torque);
}

TEST_CASE("Joints of one angle and torque, one sliding and one stuck for a step, have two hashes",
          "[joints]") {
  OneJoint slides(gear()), stuck(gear());
  for (OneJoint* joint : {&slides, &stuck}) {
    joint->go(0, 0, 0, 0);
    joint->go(0.1, 0, 0, 0);
  }
  stuck.go(0.1, 0, 0, 0);
  CHECK(slides.torque == Approx(stuck.torque).epsilon(1e-14));
  CHECK(slides.batch.state_hash() != stuck.batch.state_hash());
  // At high speed the static part of friction falls, but only in a joint that slid in the step before; a
  // joint that was stuck for a step keeps it.
  for (OneJoint* joint : {&slides, &stuck}) joint->go(0.1 - 1e-6, -1e3, 0, 0);
  CHECK(slides.torque - 0.03 * 1e3 == Approx(-0.4).epsilon(1e-3));
  CHECK(stuck.torque - 0.03 * 1e3 == Approx(-0.55).epsilon(1e-3));
}

TEST_CASE("Materials of joints out of range are refused by name", "[joints]") {
  for (unsigned p = 0; p < joint_parameters; ++p)
    for (const double x : {-1e-3, 1e13, std::numeric_limits<double>::quiet_NaN()}) {
      JointMaterial m = gear();
      number_of(m, p) = x;
      const std::string message = message_of([&] { JointFriction(1, {&m, 1}); });
      CHECK(names(message, {"JointMaterial", "allowed is"}));
    }
  const JointMaterial m = gear();
  JointOptions options;
  options.bristles = 65;
  CHECK(names(message_of([&] { JointFriction(1, {&m, 1}, options); }), {"bristles", "65"}));
  CHECK(names(message_of([&] { JointFriction(1, {}); }), {"material"}));
  // A gradient has columns only for the parameters that a joint uses.
  JointMaterial coulomb;
  coulomb.stiffness = 1;
  coulomb.kinetic.base = 1;
  const auto bytes = [&](const JointMaterial& its) {
    return JointFriction(16000, {&its, 1}).memory_bytes() / 16000;
  };
  CHECK(bytes(coulomb) == (1 + 8) * 8);
  CHECK(bytes(m) == (1 + 8 + 8) * 8);
}

TEST_CASE("The C interface resets one joint, and refuses in words", "[joints][c]") {
  const JointMaterial m = gear();
  bristle_joint_material its;
  static_assert(sizeof its == sizeof m);
  std::memcpy(&its, &m, sizeof m);
  bristle_joints* joints = nullptr;
  REQUIRE(bristle_joints_create(3, &its, 1, nullptr, nullptr, &joints) == BRISTLE_OK);
  bristle_joint_step step;
  REQUIRE(bristle_init_joint_step(&step, sizeof step) == BRISTLE_OK);
  CHECK(bristle_joints_step(joints, &step, nullptr) == BRISTLE_BAD_ARGUMENT);  // the array `angle` is missing
  double angle[3] = {}, gradient[3 * joint_parameters];
  step.angle = angle;
  REQUIRE(bristle_joints_step(joints, &step, nullptr) == BRISTLE_OK);
  const std::uint64_t stepped = bristle_joints_state_hash(joints);
  CHECK(bristle_joints_reset_one(joints, 3) == BRISTLE_REFUSED);
  CHECK(bristle_joints_restore_state(joints, &its, 3) == BRISTLE_REFUSED);
  step.gradient = gradient;
  for (const auto call : {&bristle_joints_step, &bristle_joints_find_torque}) {
    CHECK(call(joints, &step, nullptr) == BRISTLE_REFUSED);
    CHECK(bristle_last_error() == std::string("step.gradient needs bristle_joint_options.gradients"));
  }
  CHECK(bristle_joints_state_hash(joints) == stepped);
  CHECK(bristle_joints_reset_one(joints, 1) == BRISTLE_OK);
  CHECK(bristle_joints_state_hash(joints) != stepped);
  bristle_joints_destroy(joints);
  bristle_joints_destroy(nullptr);
  its.stiffness = 0.0;
  CHECK(bristle_joints_create(3, &its, 1, nullptr, nullptr, &joints) == BRISTLE_REFUSED);
  CHECK(std::string(bristle_last_error()).find("stiffness") != std::string::npos);
}

}  // namespace bristle_test::test_joints
