// Joints in MuJoCo: bristles in place of its frictionloss.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include <bristle/error.hpp>

#include "tools/examples/mujoco_joints.hpp"
#include "tools/examples/mujoco_scenes.hpp"

namespace bristle_test::test_mujoco_joints {

namespace {

/// Arm of two links of 0.3 m with 1 kg at their ends, horizontal: 8.8 N m at the shoulder, 2.9 at the elbow.
const std::string arm = R"(<mujoco><option timestep="0.002"/><worldbody><body>
  <joint name="shoulder" type="hinge" axis="0 1 0" frictionloss="LOSS1" damping="0.05"/>
  <geom type="sphere" size="0.02" pos="0.3 0 0" mass="1" contype="0" conaffinity="0"/>
  <body pos="0.3 0 0"><joint name="elbow" type="hinge" axis="0 1 0" frictionloss="LOSS2" damping="0.05"/>
    <geom type="sphere" size="0.02" pos="0.3 0 0" mass="1" contype="0" conaffinity="0"/></body>
  </body></worldbody>
  <actuator><motor joint="shoulder"/><motor joint="elbow"/></actuator></mujoco>)";

/// Returns the arm's model, with the attributes `loss1` and `loss2` on its joints and the actuators `more`.
std::string arm_with(const std::string& loss1, const std::string& loss2, const std::string& more = "") {
  std::string xml = arm;
  xml.replace(xml.find("LOSS1"), 5, loss1);
  xml.replace(xml.find("LOSS2"), 5, loss2);
  return xml.insert(xml.find("</actuator>"), more);
}

struct World {
  mujoco_example::Model model;
  mujoco_example::Data data;
  World(const char* loss1, const char* loss2, const std::string& more = "")
      : model(mujoco_example::load(arm_with(loss1, loss2, more))), data(mujoco_example::make_data(*model)) {}
};

bristle::JointMaterial gear(double base) {
  bristle::JointMaterial m;
  m.stiffness = 2000.0;
  m.viscous = 0.5;
  m.kinetic.base = base;
  m.kinetic.motor[bristle::joint_driving] = 0.1;
  m.kinetic.motor[bristle::joint_driven] = 0.3;
  m.kinetic.outside[bristle::joint_driving] = m.kinetic.outside[bristle::joint_driven] = 0.05;
  return m;
}

}  // namespace

TEST_CASE("An arm in MuJoCo hangs on the friction of its joints without creep, where frictionloss creeps",
          "[mujoco][joints]") {
  World ours("0", "0"), theirs("10", "4");
  const bristle::JointMaterial gears[] = {gear(10.0), gear(4.0)};
  mujoco_example::BristleJoints joints(*ours.model, {0, 1}, gears);
  const auto run = [&](double seconds) {
    for (int i = 0; i < static_cast<int>(seconds / 0.002); ++i) {
      joints.step(*ours.model, *ours.data);
      mj_step(theirs.model.get(), theirs.data.get());
    }
  };
  run(20.0);
  const double before = ours.data->qpos[0], before_elbow = ours.data->qpos[1],
               its_before = theirs.data->qpos[0];
  run(60.0);
  CHECK(std::abs(before) < 0.02);
  CHECK(std::abs(ours.data->qpos[0] - before) < 1e-9);
  CHECK(std::abs(ours.data->qpos[1] - before_elbow) < 1e-9);
  CHECK(std::abs(theirs.data->qpos[0] - its_before) > 1e-3);
  CHECK(std::abs(joints.torque()[0] + (0.3 + 0.6) * 9.81) < 0.02);  // the shoulder carries both links' weight
}

// Shakes the arm for a minute at 2 Hz, with torques below friction: 0.4 to 8.4 N m of 12 in the shoulder, 2.9
// of 5 in the elbow.
TEST_CASE("An arm in MuJoCo that is shaken does not creep on bristles; on frictionloss and on LuGre it does",
          "[mujoco][joints]") {
  const auto creep = [](World& world, mujoco_example::BristleJoints* joints) {
    double before = 0.0;
    for (int i = 0; i < 40000; ++i) {
      if (i == 10000) before = world.data->qpos[0];
      world.data->qfrc_applied[0] = -4.4 + 4.0 * std::sin(4.0 * M_PI * world.data->time);
      joints != nullptr ? joints->step(*world.model, *world.data)
                        : mj_step(world.model.get(), world.data.get());
    }
    return std::abs(world.data->qpos[0] - before);
  };
  World ours("0", "0");
  const bristle::JointMaterial gears[] = {gear(12.0), gear(5.0)};
  mujoco_example::BristleJoints joints(*ours.model, {0, 1}, gears);
  CHECK(creep(ours, &joints) < 1e-9);
  World theirs("12", "5");
  CHECK(creep(theirs, nullptr) > 0.01);
#if mjVERSION_HEADER >= 3007000
  const auto motor = [](const std::string& joint, const std::string& limit) {
    return "<dcmotor joint='" + joint + "' input='none' resistance='1' motorconst='1e-6' lugre='2000 20 " +
           limit + ' ' + limit + " 0.1'/>";
  };
  World lugre("0", "0", motor("shoulder", "12") + motor("elbow", "5"));
  // LuGre's bristles are so stiff that explicit integration would be unstable.
  lugre.model->opt.integrator = mjINT_IMPLICITFAST;
  CHECK(creep(lugre, nullptr) > 0.01);
  CHECK(lugre.data->warning[mjWARN_BADQACC].number == 0);
#endif
}

TEST_CASE("An arm in MuJoCo is lifted at the torque of driving and let down at that of being driven",
          "[mujoco][joints]") {
  // Lets only the elbow move; high friction holds the shoulder. Gravity acts on the elbow with 2.943 N m in
  // the positive direction.
  const double weight = 0.3 * 9.81, base = 0.5;
  const double lifts = (weight + base + 0.05 * weight) / (1 - 0.1);
  const double lets_down = (weight - base - 0.05 * weight) / (1 + 0.3);
  const auto speed_at = [&](double torque) {
    World world("0", "0");
    const bristle::JointMaterial gears[] = {gear(100.0), gear(base)};
    mujoco_example::BristleJoints joints(*world.model, {0, 1}, gears);
    for (int i = 0; i < 250; ++i) {
      world.data->ctrl[1] = -torque;
      joints.step(*world.model, *world.data);
    }
    return world.data->qvel[1];
  };
  CHECK(speed_at(1.02 * lifts) < -0.01);
  CHECK(std::abs(speed_at(0.97 * lifts)) < 0.003);
  CHECK(std::abs(speed_at(1.03 * lets_down)) < 0.003);
  CHECK(speed_at(0.97 * lets_down) > 0.01);
}

TEST_CASE("An arm in MuJoCo stands still on joints too stiff for an explicit step", "[mujoco][joints]") {
  for (const double stiffness : {1e5, 1e7, 1e9}) {
    World world("0", "0");
    bristle::JointMaterial gears[] = {gear(12.0), gear(5.0)};
    for (bristle::JointMaterial& m : gears) m.stiffness = stiffness;
    mujoco_example::BristleJoints joints(*world.model, {0, 1}, gears);
    double fastest = 0.0;
    for (int i = 0; i < 1000; ++i) {
      joints.step(*world.model, *world.data);
      if (i >= 500)
        fastest = std::max({fastest, std::abs(world.data->qvel[0]), std::abs(world.data->qvel[1])});
    }
    INFO("stiffness " << stiffness << " N m/rad");
    CHECK(fastest < 1e-12);
  }
}

TEST_CASE("Joints that MuJoCo's model lacks are refused", "[mujoco][joints]") {
  World world("0", "0");
  const bristle::JointMaterial m = gear(1.0);
  CHECK_THROWS_AS(mujoco_example::BristleJoints(*world.model, {2}, {&m, 1}), bristle::Error);
  CHECK_THROWS_AS(mujoco_example::BristleJoints(*world.model, {-1}, {&m, 1}), bristle::Error);
}

}  // namespace bristle_test::test_mujoco_joints
