// Measures a step of some fifty thousand joints (4,096 robots of 12 joints), of a single joint, and of a
// single robot. Compares them with a user's plain loop, and with a mere copy of inputs to outputs.
#include <bristle/joint_friction.hpp>

#include "bench/plain_loops.hpp"
#include "measured_scene.hpp"
#include "suites.hpp"

namespace bristle_bench {

namespace {

using namespace bristle;

constexpr std::size_t joint_count = 50000;
constexpr double stiffness = 300.0, base = 0.4, by_motor = 0.12;

/// Inputs and outputs of all joints. `swing` is the angle that each joint moves in a step, rad.
struct JointArrays {
  std::vector<double> angle, speed, motor, outside, torque;
  std::vector<double> more[3];
  int ticks = 0;

  explicit JointArrays(std::size_t n) : angle(n), speed(n), motor(n), outside(n), torque(n) {
    for (auto& x : more) x.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      motor[i] = 0.01 * static_cast<double>(i % 201) - 1.0;
      outside[i] = 0.013 * static_cast<double>(i % 157) - 1.0;
    }
  }
  void go(double swing) {
    const double d = ticks++ / 8 % 2 == 0 ? swing : -swing;
    for (double& x : angle) x += d;
    for (double& x : speed) x = d / tick;
  }
};

JointMaterial gear(bool all) {
  JointMaterial m;
  m.stiffness = stiffness;
  m.kinetic.base = base;
  m.kinetic.motor[joint_driving] = by_motor;
  m.kinetic.motor[joint_driven] = by_motor;
  if (!all) return m;
  m.viscous = 0.03;
  m.kinetic.motor[joint_driven] = 0.3;
  m.kinetic.outside[joint_driving] = 0.05;
  m.kinetic.outside[joint_driven] = 0.08;
  m.static_part = m.kinetic;
  m.stribeck_speed = 0.5;
  return m;
}

struct JointScene {
  JointScene(bool all, int threads, std::size_t n)
      : joints(n, std::vector<JointMaterial>{gear(all)}, {}, BatchOptions{}.with_threads(threads)),
        arrays(n) {}
  void step(double swing, bool all) {
    arrays.go(swing);
    JointOutput out{arrays.torque};
    if (all) {
      out.mean = arrays.more[0];
      out.by_angle = arrays.more[1];
      out.by_speed = arrays.more[2];
    }
    joints.step({arrays.angle, arrays.speed, arrays.motor, arrays.outside}, out);
  }
  JointFriction joints;
  JointArrays arrays;
};

/// Adds a benchmark of joints that move by `swing` (rad) per step, eight steps forward and eight back.
void add_joint_benchmark(const std::string& motion, double swing, bool all, int threads,
                         std::size_t n = joint_count) {
  const std::string name = "joints/" + motion + (all ? "/all/" : "/load/") + std::to_string(threads) +
                           "threads" + (n == joint_count ? "" : "/" + std::to_string(n));
  add_benchmark(name, [=](benchmark::State& state) {
    auto& scene =
        keep_while_named<JointScene>(name, [&] { return std::make_shared<JointScene>(all, threads, n); });
    for (auto _ : state) scene.step(swing, all);
    state.SetLabel(std::to_string(n) + " joints of 8 bristles");
  });
}

}  // namespace

void register_joints() {
  for (const bool all : {false, true})
    for (const int threads : {1, 2}) {
      add_joint_benchmark("stick", 1e-6, all, threads);
      add_joint_benchmark("slide", 1e-3, all, threads);
    }
  for (const std::size_t n : {1, 12}) add_joint_benchmark("slide", 1e-3, false, 1, n);
  add_benchmark("joints/slide/load/plain", [](benchmark::State& state) {
    JointArrays arrays(joint_count);
    plain::JointLoop loop(joint_count, stiffness, base, by_motor);
    for (auto _ : state) {
      arrays.go(1e-3);
      loop.step(arrays.angle.data(), arrays.motor.data(), arrays.torque.data());
      benchmark::ClobberMemory();
    }
    state.SetLabel("a loop of 8 clamps a joint, one thread");
  });
  add_benchmark("joints/copy", [](benchmark::State& state) {
    JointArrays arrays(joint_count), to(joint_count);
    for (auto _ : state) {
      arrays.go(1e-3);
      to.angle = arrays.angle;
      to.speed = arrays.speed;
      to.motor = arrays.motor;
      to.outside = arrays.outside;
      to.torque = arrays.torque;
      for (int k = 0; k < 3; ++k) to.more[k] = arrays.more[k];
      benchmark::ClobberMemory();
    }
    state.SetLabel("copies four arrays of input and four of output");
  });
}

}  // namespace bristle_bench
