// Bristles in a real engine: MuJoCo's contacts with patches in place of its own friction.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#ifdef BRISTLE_MUJOCO_PLUGIN
#include <dlfcn.h>
#endif

#include "tools/examples/mujoco_friction.hpp"
#include "tools/examples/mujoco_scenes.hpp"

namespace bristle_test::test_mujoco {

using namespace mujoco_example;

namespace {

constexpr double gravity = 9.81;

/// A MuJoCo scene moved with bristles. Their friction has almost no peak and no damper.
class World {
 public:
  static bristle::Coefficients law() {
    return bristle::Coefficients{}.with_kinetic(0.5).with_peak(0.55).with_presliding_length(5e-6);
  }
  explicit World(const std::string& xml, const bristle::Coefficients& law = World::law(),
                 std::uint32_t contacts = 16, double reach = FrictionOptions{}.reach,
                 const std::optional<bristle_example::RollingBed>& rolling = std::nullopt)
      : model(load(xml)), data(make_data(*model)) {
    const ContactDims dims = remove_friction(*model);
    FrictionOptions options;
    options.patch = bristle::PatchOptions{}.with_max_normal_load(5.0).with_bristles(4000);
    options.contacts = contacts;
    options.reach = reach;
    options.rolling = rolling;
    friction = std::make_unique<BristleFriction>(*model, dims, law, options);
  }
  explicit World(const Scene& scene, std::uint32_t contacts = 16) : World(scene.xml, law(), contacts) {
    drive = scene.drive;
  }

  void run(double seconds) {
    const double end = data->time + seconds - 0.5 * model->opt.timestep;
    while (data->time < end) {
      drive(*model, *data);
      friction->step(*model, *data);
    }
  }
  /// Returns the sum of contact forces on the second geom of each contact, N.
  Eigen::Vector3d force() const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const auto& c : friction->contacts())
      sum += c.force[0] * c.frame.along() + c.force[1] * c.frame.aside();
    return sum;
  }

  Model model;
  Data data;
  std::unique_ptr<BristleFriction> friction;
  std::function<void(const mjModel&, mjData&)> drive = [](const mjModel&, mjData&) {};
};

std::string on_floor(const std::string& geom, double height, double mu, double timestep = 0.001) {
  return R"(<mujoco><option timestep=")" + std::to_string(timestep) +
         R"("/><default><geom solref="0.01 1" friction=")" + std::to_string(mu) +
         R"( 0.005 0.0001"/></default><worldbody><geom type="plane" size="50 50 1"/><body name="body" pos="0 0 )" +
         std::to_string(height) + R"("><freejoint/>)" + geom + "</body></worldbody></mujoco>";
}

/// Body of a flat box that hardly tips: half lengths 0.1, 0.1 and 0.001 m, 0.5 kg.
const std::string plate = R"(<geom type="box" size="0.1 0.1 0.001" mass="0.5"/>)";

}  // namespace

TEST_CASE("In MuJoCo a pinched capsule creeps with stock friction and holds with bristles", "[mujoco]") {
  std::vector<Scene> scenes = {pinch(5.9, 0.0, "0.02 1"), pinch(12.0), pinch(60.0), pinch(36.0, 24.0)};
  for (Scene& scene : scenes) {
    INFO(scene.title);
    scene.seconds = 2.0;
    const std::vector<Run> runs = run(scene, {Friction::stock, Friction::bristle});
    CHECK(runs[0].creep > 30e-6);
    CHECK(std::fabs(runs[1].creep) < 0.01e-6);
    CHECK(runs[1].samples.back().travel < 150e-6);  // the box falls 0.12 mm until the pads close
  }
}

TEST_CASE("In MuJoCo a tapped block stays on its slope with bristles, and friction balances its weight",
          "[mujoco]") {
  const Scene scene = tapped_block();
  const std::vector<Run> runs = run(scene, {Friction::stock, Friction::bristle});
  CHECK(runs[0].creep > 30e-6);
  CHECK(std::fabs(runs[1].creep) < 0.001e-6);
  CHECK(runs[1].samples.back().travel < 60e-6);

  World world(scene);
  world.run(4.0);
  const double downhill = 0.2 * gravity * std::sin(15.0 * M_PI / 180.0);
  CHECK(world.force()[0] == Approx(-downhill).epsilon(1e-5));
  CHECK(std::fabs(world.force()[1]) < 1e-5 * downhill);
}

TEST_CASE("In MuJoCo a plate turns by I w^2 / (2 mu W r)", "[mujoco]") {
  World turning(on_floor(plate, 0.001, 0.5));
  turning.run(0.2);
  turning.data->qvel[5] = 8.0;
  turning.run(0.6);
  const double inertia = 0.5 * (0.2 * 0.2 + 0.2 * 0.2) / 12.0;
  const double angle = 2.0 * std::atan2(turning.data->qpos[6], turning.data->qpos[3]);
  CHECK(angle == Approx(inertia * 64.0 / (2.0 * 0.5 * 0.5 * gravity * std::hypot(0.1, 0.1))).epsilon(0.02));
  CHECK(std::fabs(turning.data->qvel[5]) < 3e-9);  // MuJoCo 3 leaves 1.4e-9
}

TEST_CASE("In MuJoCo friction is that of Coulomb at any speed, of a plate, a thrown ball and a spun one",
          "[mujoco]") {
  for (const double speed : {0.01, 1.0, 5.5, 20.0, 100.0}) {
    INFO(speed << " m/s");
    constexpr double dt = 0.002, seconds = 0.02;
    World plate_world(on_floor(plate, 0.001, 0.5, dt));
    plate_world.run(0.2);
    plate_world.data->qvel[0] = speed;
    plate_world.run(seconds);
    const double lost = 0.5 * gravity * seconds;
    CHECK(plate_world.data->qvel[0] == Approx(std::max(speed - lost, 0.0)).margin(0.02 * lost));

    // Returns the ball's speed at the end of the slip. A loss of mu g in speed adds 5/2 mu g / r to the spin,
    // r the radius, until the ball rolls.
    const auto run_ball = [&](double along, double about, int condim = 3) {
      World world(on_floor(
          R"(<geom type="sphere" size="0.1" mass="0.3" condim=")" + std::to_string(condim) + R"("/>)", 0.1,
          0.5, dt));
      world.run(0.2);
      world.data->qvel[0] = along;
      world.data->qvel[4] = about / 0.1;
      world.run(seconds);
      return world.data->qvel[0];
    };
    const double until_rolling = 2.0 / 7.0 * speed;
    CHECK(run_ball(speed, 0.0) == Approx(speed - std::min(lost, until_rolling)).margin(0.02 * lost));
    CHECK(run_ball(speed, 0.0, 4) == Approx(speed - std::min(lost, until_rolling)).margin(0.02 * lost));
    CHECK(run_ball(0.0, speed) == Approx(std::min(lost, until_rolling)).margin(0.02 * lost));
    // Starts in rolling. The ball sinks in by 2e-4 of its radius, which changes speed over spin.
    CHECK(run_ball(speed, speed) == Approx(speed).epsilon(3e-4));
  }
}

TEST_CASE("In MuJoCo a wheel on a bed creeps by force over slip stiffness, and stands with its brake on",
          "[mujoco][beds]") {
  constexpr double slip_stiffness = 40.0, mass = 1.3, radius = 0.1;  // N per unit slip, kg, m
  const auto wheel = [](const char* ground, const char* hub, const std::string& gravity_vector) {
    return std::string(R"(<mujoco><option timestep="0.002" gravity=")") + gravity_vector +
           R"("/><default><geom solref="0.01 1" friction="0.5 0.005 0.0001"/></default><worldbody>)" +
           ground +
           R"(<body name="body" pos="0 0 0.1"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>
<geom type="sphere" size="0.01" mass="1" contype="0" conaffinity="0"/><body><joint name="hub" type="hinge"
axis="0 1 0" )" +
           hub + R"(/><geom type="sphere" size="0.1" mass="0.3"/></body></body></worldbody>
<actuator><motor joint="hub"/></actuator></mujoco>)";
  };
  bristle_example::RollingBed bed;
  bed.material = bristle::BedMaterial(0.5).with_slip_stiffness(slip_stiffness, slip_stiffness);
  bed.shape = bristle::BedShape::disc(0.0005, bristle::BedPressure::parabolic).rolling(32, 8);
  bed.options.max_normal_load = mass * gravity;

  // Tests a plane, always MuJoCo's geom1, and a box, for which the sphere is geom1 and every sign turns.
  for (const char* ground :
       {R"(<geom type="plane" size="50 50 1"/>)", R"(<geom type="box" size="50 50 1" pos="0 0 -1"/>)"}) {
    INFO(ground);
    World world(wheel(ground, "", "0 0 -9.81"), World::law(), 16, 0.01, bed);
    world.drive = [](const mjModel&, mjData& data) { data.ctrl[0] = 0.02; };
    world.run(2.0);
    const double speed = world.data->qvel[0];
    // Expects that the motor's torque over the radius accelerates the ball's mass plus 2/5 of it (spin).
    const double acceleration = 0.02 / radius / (mass + 0.4 * 0.3), force = mass * acceleration;
    CHECK(speed == Approx(2.0 * acceleration).epsilon(0.01));
    // The force's lever arm is shorter than the wheel's radius, as the wheel sinks in.
    const double lever = radius + world.data->qpos[1] - world.friction->contacts().at(0).point[2];
    const double rolling = lever * world.data->qvel[2];
    CHECK((rolling - speed) / rolling == Approx(force / slip_stiffness).epsilon(0.02));

    // Parks the wheel on a slope of 20 % with a brake that hardly turns.
    World parked(wheel(ground, R"(damping="1e9")", "1.924 0 -9.619"), World::law(), 16, 0.01, bed);
    parked.run(3.0);
    const double before = parked.data->qpos[0];
    parked.run(10.0);
    CHECK(std::fabs(parked.data->qpos[0] - before) < 1e-9);
    CHECK(std::fabs(parked.force()[0]) == Approx(mass * 1.924).epsilon(1e-4));
  }
}

TEST_CASE("In MuJoCo the force on a wheel that rolls askew acts behind its middle", "[mujoco][beds]") {
  constexpr double radius = 0.005, stiffness = 40.0, angle = 0.02;  // radius of contact, N per unit slip, rad
  bristle_example::RollingBed bed;
  bed.material = bristle::BedMaterial(0.5).with_slip_stiffness(stiffness, stiffness);
  bed.shape = bristle::BedShape::disc(radius, bristle::BedPressure::uniform).rolling(64, 16);
  bed.options.max_normal_load = gravity;
  World world(R"(<mujoco><option timestep="0.001"/>
<default><geom solref="0.01 1" friction="0.5 0.005 0.0001"/></default>
<worldbody><geom type="plane" size="50 50 1"/><body name="body" pos="0 0 0.1">
  <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/><joint type="hinge" axis="0.02 1 0"/>
  <geom type="sphere" size="0.1" mass="1"/></body></worldbody></mujoco>)",
              World::law(), 16, 0.01, bed);
  world.run(0.2);
  world.drive = [](const mjModel&, mjData& data) {
    data.qvel[0] = 0.5;
    data.qvel[2] = 5.0;
  };
  world.run(0.2);
  const auto& contact = world.friction->contacts().at(0);
  const double aside = world.force()[1];
  CHECK(aside == Approx(-stiffness * angle).epsilon(0.03));
  // The bed's deflection grows from the leading edge of each row of bristles. Rows of half length a (1 -
  // y^2)^1/2 together act 3 pi / 32 of the diameter behind the middle.
  CHECK(contact.force[2] == Approx(-3.0 * M_PI / 32.0 * radius * aside).epsilon(0.03));
}

TEST_CASE("In MuJoCo a ball on a bed rolls down a slope with 5/7 of g sin a", "[mujoco][beds]") {
  std::string xml = on_floor(R"(<geom type="sphere" size="0.1" mass="0.3"/>)", 0.1, 0.5, 0.002);
  xml.replace(xml.find("timestep"), 8, R"(gravity="0.9 0.3 -9.7" timestep)");
  bristle_example::RollingBed bed;
  bed.material = bristle::BedMaterial(0.8).with_presliding(20e-6);
  bed.shape = bristle::BedShape::disc(0.002, bristle::BedPressure::hertz).rolling(16, 8);
  bed.options.max_normal_load = 3.0;
  World world(xml, World::law(), 2, 0.01, bed);
  world.run(2.0);
  CHECK(world.data->qvel[0] == Approx(2.0 * 5.0 / 7.0 * 0.9).epsilon(0.005));
  CHECK(world.data->qvel[1] == Approx(2.0 * 5.0 / 7.0 * 0.3).epsilon(0.005));
  // Throws a ball without spin: it slides with the coefficient of the contact, not of the bed's material.
  const double limit = 0.5 * 0.3 * 9.7;
  const auto throw_ball = [&] {
    world.data->qvel[0] = 3.0;
    world.data->qvel[4] = 0.0;
    world.run(0.01);
    CHECK(world.force().norm() == Approx(limit).epsilon(0.02));
    mju_zero(world.data->qvel, static_cast<int>(world.model->nv));
  };
  // Checks that a bed that was lifted or forgotten is not bent when the ball is put down again.
  for (const bool lift : {true, false, true, false}) {
    throw_ball();
    world.data->qpos[2] = lift ? 1.0 : 0.1;
    if (lift) world.run(0.004);
    world.data->qpos[2] = 0.0999;
    mju_zero(world.data->qvel, static_cast<int>(world.model->nv));
    if (!lift) world.friction->forget_contacts();
    world.run(0.002);
    CHECK(world.force().norm() < 0.5 * limit);
    world.run(0.1);
  }
  // Spins the ball about the normal: the bed resists with 3 pi / 16 of friction times contact radius, and the
  // axes stay on the plane.
  const Eigen::Vector3d along = world.friction->contacts().at(0).frame.along();
  mju_zero4(world.data->qpos + 3);
  world.data->qpos[3] = 1.0;
  world.drive = [](const mjModel&, mjData& data) { data.qvel[5] = 20.0; };
  world.run(0.02);
  CHECK(std::fabs(world.friction->contacts().at(0).force[2]) ==
        Approx(3.0 * M_PI / 16.0 * limit * 0.002).epsilon(0.03));
  CHECK((world.friction->contacts().at(0).frame.along() - along).norm() < 1e-6);
}

TEST_CASE("In MuJoCo stiff bristles come to rest at steps of 4 ms", "[mujoco]") {
  for (const double speed : {1.0, 0.1, 0.02}) {
    INFO(speed << " m/s");
    constexpr double step = 0.004;
    // Stiffness times (time step)^2 over the plate's mass is 32 here, and six times that against turning.
    World world(on_floor(plate, 0.001, 0.5, step));
    world.run(0.2);
    const double start = world.data->qpos[0];
    world.data->qvel[0] = speed;
    world.run(0.6);
    // MuJoCo moves bodies by the velocity at a step's end, so the braking plate stops half a step's distance
    // earlier.
    const double path = std::max(speed * speed / (2.0 * 0.5 * gravity) - 0.5 * step * speed, 0.0);
    CHECK(world.data->qpos[0] - start == Approx(path).epsilon(0.02).margin(5e-6));
    for (int i = 0; i < 6; ++i) CHECK(std::fabs(world.data->qvel[i]) < 1e-8);  // MuJoCo 3 leaves 8e-9
  }
}

TEST_CASE("In MuJoCo a plate on bristles of one length comes to rest a whole number of lengths away",
          "[mujoco]") {
  // Bristles that keep one length delta are bent by the path less n delta, whatever happened before. At rest
  // without force they are straight, so the plate stops at a multiple of delta, if its patch moved exactly
  // with it.
  constexpr double delta = 50e-6;
  World world(on_floor(plate, 0.001, 0.5), bristle::Coefficients::paper()
                                               .with_kinetic(0.5)
                                               .with_peak(1.0)
                                               .with_presliding_length(delta)
                                               .with_law(bristle::SnapLaw::single)
                                               .with_rule(bristle::SnapRule::keep));
  world.run(0.2);
  const double start = world.data->qpos[0];
  world.data->qvel[0] = 0.3;
  world.run(0.5);
  const double lengths = (world.data->qpos[0] - start) / delta;
  CHECK(lengths > 100.0);
  CHECK(std::fabs(lengths - std::round(lengths)) < 0.01);
}

TEST_CASE("In MuJoCo the axes of a contact turn by half of the ball's spin, however slow it is", "[mujoco]") {
  World world(on_floor(R"(<geom type="sphere" size="0.1" mass="0.3"/>)", 0.1, 0.5));
  world.run(0.2);
  const Eigen::Vector3d before = world.friction->contacts().at(0).frame.along();
  world.drive = [](const mjModel&, mjData& data) { data.qvel[5] = 2e-4; };  // turn by 2e-7 rad in each step
  world.run(2.0);
  const bristle::ContactFrame& frame = world.friction->contacts().at(0).frame;
  const double angle = before.cross(frame.along()).dot(frame.normal());
  CHECK(std::fabs(angle) == Approx(0.5 * 2e-4 * 2.0).margin(1.1e-6));
}

TEST_CASE(
    "In MuJoCo a box held 20 mm off its centre and shaken turns with stock friction, and does not with "
    "bristles",
    "[mujoco]") {
  Scene scene = held_off_centre();
  scene.seconds = 4.0;
  const std::vector<Run> runs = run(scene, {Friction::stock, Friction::bristle});
  const auto turn = [](const Run& r) { return r.samples.back().turn * 180.0 / M_PI; };
  const auto slip = [](const Run& r) {  // Returns how far (m) a box slips once the fingers hold it.
    return std::fabs(r.samples.back().travel - r.samples[r.samples.size() / 4 - 1].travel);
  };
  CHECK(turn(runs[0]) > 5.0);
  CHECK(std::fabs(turn(runs[1])) < 0.02);
  CHECK(slip(runs[0]) > 100e-6);
  CHECK(slip(runs[1]) < 0.01e-6);

  // Checks that point contacts in place of discs let the box turn until it hangs below the fingers.
  scene.seconds = 0.5;
  scene.xml.replace(scene.xml.find("condim=\"4\""), 10, "condim=\"3\"");
  CHECK(std::fabs(turn(run(scene, {Friction::bristle})[0])) > 45.0);
}

TEST_CASE("In MuJoCo a box held by three fingertips stays in a hand that rests and in one that shakes",
          "[mujoco]") {
  for (const bool shaken : {false, true}) {
    const Scene scene = fingertips(shaken);
    INFO(scene.title);
    const std::vector<Run> runs = run(scene, {Friction::stock, Friction::bristle});
    CHECK(runs[0].creep > 30e-6);
    CHECK(std::fabs(runs[1].creep) < 0.01e-6);  // creep over whole periods of the shaking
    CHECK(std::fabs(runs[1].samples.back().turn) < 1e-3);
    // Checks that the box sticks to the hand and moves with it, 28 mm up and down.
    double highest = -1.0, lowest = 1.0;
    for (std::size_t i = runs[1].samples.size() / 2; i < runs[1].samples.size(); ++i) {
      highest = std::max(highest, runs[1].samples[i].travel);
      lowest = std::min(lowest, runs[1].samples[i].travel);
    }
    const double stroke = shaken ? 2.0 * 10.0 / (36.0 * M_PI * M_PI) : 0.0;
    CHECK(highest - lowest == Approx(stroke).epsilon(0.1).margin(1e-9));
  }
}

TEST_CASE("In MuJoCo a tower of ten plates keeps within a presliding length of where a push found it",
          "[mujoco]") {
  // Pushes the fifth plate of a stack with 3 N, at once or rising for a second. Six plates press on its lower
  // face, whose friction holds 5.9 N.
  for (const double ramp_s : {0.0, 1.0}) {
    INFO(ramp_s << " s");
    const Scene scene = tower(3.0, ramp_s);
    const std::vector<Run> runs = run(scene, {Friction::stock, Friction::bristle});
    CHECK(runs[0].samples.back().travel > 200e-6);
    CHECK(runs[1].contacts == Approx(40.0).epsilon(0.01));
    CHECK(std::fabs(runs[1].samples.back().travel) < 20e-6);
    CHECK(std::fabs(runs[1].creep) < 1e-9);
  }
}

TEST_CASE("In MuJoCo a ball that spins about the vertical loses torsional coefficient times weight",
          "[mujoco]") {
  // MuJoCo's default torsional friction coefficient is 5 mm: a torque of 0.005 m g against a moment of
  // inertia of 2/5 m r^2.
  const std::string ball = R"(<geom type="sphere" size="0.1" mass="0.3" condim="4"/>)";
  World world(on_floor(ball, 0.1, 0.5));
  world.run(0.2);
  REQUIRE(world.friction->discs()->size() == 1);
  CHECK(world.friction->points().size() == 0);
  const Eigen::Vector3d along = world.friction->contacts().at(0).frame.along();
  world.data->qvel[5] = 4.0;
  world.run(0.05);
  const double before = world.data->qvel[5];
  world.run(0.1);
  const double loss = 0.005 * gravity / (0.4 * 0.01);
  CHECK((before - world.data->qvel[5]) / 0.1 == Approx(loss).epsilon(0.01));
  // The spin of the step is predicted but for the difference of peak and kinetic friction, and the axes stay
  // on the plane.
  const double step = world.model->opt.timestep;
  CHECK(world.friction->contacts().at(0).velocity[3] ==
        Approx(world.data->qvel[5]).margin(0.3 * loss * step));
  CHECK((world.friction->contacts().at(0).frame.along() - along).norm() < 1e-6);
  world.run(0.5);
  // A slow spin is left: the ball swings on its bristles, because they have no dampers here.
  CHECK(std::fabs(world.data->qvel[5]) < 1e-4);
  // Checks that bristles hold a torque of half the torsional friction.
  world.data->qfrc_applied[5] = 0.5 * 0.005 * 0.3 * gravity;
  world.run(0.2);
  const double held = world.data->qpos[6];
  world.run(0.5);
  // Allows the turn by which the bristles are bent, 4e-4 in all, so the test excludes only a steady drift.
  CHECK(std::fabs(world.data->qpos[6] - held) < 1e-6);
  CHECK(world.friction->contacts().at(0).force[2] == Approx(-world.data->qfrc_applied[5]).epsilon(1e-5));
}

TEST_CASE("In MuJoCo a frictionless contact stays so, and rolling friction is refused aloud", "[mujoco]") {
  const auto box = [](const char* condim) {
    std::string xml = on_floor(plate, 0.001, 0.5);
    for (std::size_t at = 0; (at = xml.find("<geom type", at)) != std::string::npos; at += 5)
      xml.insert(at + 5, std::string(" condim=\"") + condim + "\"");
    return xml;
  };
  World slippery(box("1"));
  slippery.run(0.2);
  slippery.data->qvel[0] = 0.5;
  slippery.run(0.5);
  CHECK(slippery.data->qvel[0] == Approx(0.5).epsilon(1e-6));

  const Model model = load(box("6"));
  const ContactDims dims = remove_friction(*model);
  CHECK_THROWS_WITH(BristleFriction(*model, dims, bristle::Coefficients{}),
                    Catch::Contains("geom 0 has condim 6") && Catch::Contains("leave_out_rolling"));
  CHECK_THROWS_WITH(BristleFriction(*model, {{3, 2}, {}}, bristle::Coefficients{}),
                    Catch::Contains("geom 1 has condim 2"));
  FrictionOptions options;
  options.leave_out_rolling = true;
  CHECK(BristleFriction(*model, dims, bristle::Coefficients{}, options).discs() != nullptr);
  model->opt.integrator = mjINT_RK4;
  CHECK_THROWS_WITH(BristleFriction(*model, dims, bristle::Coefficients{}, options), Catch::Contains("RK4"));
}

TEST_CASE("In MuJoCo the geom of higher priority says what a contact resists, else the larger condim",
          "[mujoco]") {
  const auto slides = [](const char* floor, const char* box) {
    std::string xml = on_floor(plate, 0.001, 0.5);
    std::size_t at = xml.find("<geom type");
    xml.insert(at + 5, std::string(" ") + floor);
    for (at = xml.find("<geom type", at + 10); at != std::string::npos; at = xml.find("<geom type", at + 10))
      xml.insert(at + 5, std::string(" ") + box);
    World world(xml);
    world.run(0.2);
    world.data->qvel[0] = 0.5;
    world.run(0.5);
    return world.data->qvel[0] > 0.49;
  };
  CHECK_FALSE(slides("condim=\"1\"", "condim=\"3\""));
  CHECK_FALSE(slides("condim=\"3\"", "condim=\"1\""));
  CHECK(slides("condim=\"1\" priority=\"1\"", "condim=\"3\""));
  CHECK_FALSE(slides("condim=\"1\"", "condim=\"3\" priority=\"1\""));
  CHECK(slides("condim=\"3\"", "condim=\"1\" priority=\"1\""));
}

TEST_CASE("In MuJoCo a contact that begins in sliding has kinetic friction from its first step", "[mujoco]") {
  // In the step the plate moves by little more than a presliding length (1 mm), so that straight bristles
  // would reach less than kinetic friction, and bristles bent the other way far less.
  World world(on_floor(plate, 0.001, 0.5), World::law().with_presliding_length(1e-3));
  world.run(0.2);
  world.friction->forget_contacts();
  world.data->qvel[0] = 1.2;
  world.friction->step(*world.model, *world.data);
  CHECK(1.2 - world.data->qvel[0] == Approx(0.5 * gravity * world.model->opt.timestep).epsilon(0.05));
}

TEST_CASE("In MuJoCo a force in qfrc_applied counts and stays as it was", "[mujoco]") {
  World world(on_floor(plate, 0.001, 0.5));
  world.data->qfrc_applied[0] = 1.0 / 3.0;
  world.run(1.0);
  CHECK(world.data->qfrc_applied[0] == 1.0 / 3.0);
  CHECK(std::all_of(world.data->qfrc_applied + 1, world.data->qfrc_applied + 6,
                    [](double f) { return f == 0.0; }));
  CHECK(world.force()[0] == Approx(-1.0 / 3.0).epsilon(1e-6));
}

TEST_CASE("In MuJoCo a plate on a thousand feet holds on 15 degrees, with room for sixteen at first",
          "[mujoco]") {
  std::string xml =
      R"(<mujoco><option timestep="0.002" gravity="2.539 0 -9.476"/><size nconmax="1000" njmax="2000"/>
<default><geom solref="0.01 1" friction="0.6 0.005 0.0001"/></default><worldbody>
<geom type="plane" size="50 50 1"/><body name="body" pos="0 0 0.01"><freejoint/>)";
  for (int i = 0; i < 1000; ++i)
    xml += "<geom type=\"sphere\" size=\"0.01\" mass=\"0.001\" pos=\"" + std::to_string(0.03 * (i % 40)) +
           " " + std::to_string(0.03 * (i / 40)) + " 0\"/>";
  World world(xml + "</body></worldbody></mujoco>");
  world.run(0.1);
  CHECK(world.friction->points().capacity() >= 1000);
  CHECK(world.friction->points().size() == 1000);
  CHECK(world.friction->points().refused() == 0);
  const double held = world.data->qpos[0];
  CHECK(held < 1e-5);
  world.run(0.2);
  CHECK(std::fabs(world.data->qpos[0] - held) < 1e-9);
  CHECK(world.force()[0] == Approx(-2.539).epsilon(1e-3));
}

TEST_CASE("In MuJoCo a box rests on a table that turns and on one that swings", "[mujoco]") {
  for (const bool swings : {false, true}) {
    INFO(swings);
    World world(turntable(0.0));
    double speed = 0.0;
    world.drive = [&](const mjModel&, mjData& data) {
      speed = std::min(speed + 1e-3, 1.5);
      data.qvel[0] = speed * (swings ? std::cos(0.5 * M_PI * data.time) : 1.0);
    };
    const auto position = [&] {  // in the table's frame, m
      const double angle = world.data->qpos[0], x = world.data->qpos[1], y = world.data->qpos[2];
      return Eigen::Vector2d(std::cos(angle) * x + std::sin(angle) * y,
                             std::cos(angle) * y - std::sin(angle) * x);
    };
    world.run(8.0);
    const Eigen::Vector2d begin = position();
    world.run(24.0);
    // Stepped by velocities alone the box would drift outwards by w^2 r dt / 2, up to 2.25 mm/s.
    CHECK((position() - begin).norm() < (swings ? 1e-7 : 1e-8));
    CHECK(begin.norm() == Approx(1.0).epsilon(1e-3));
  }
}

TEST_CASE("In MuJoCo bodies whose contacts hop from corner to corner rest with bristles", "[mujoco]") {
  for (Scene scene : {mesh_on_slope(false), mesh_on_slope(true), equal_tower()}) {
    INFO(scene.title);
    scene.seconds = scene.name == "equal_tower" ? 40.0 : 100.0;
    const Run held = run(scene, {Friction::bristle})[0];
    // Fits a line through the travel of the second half: the bodies jitter by a micrometre as their normal
    // forces hop.
    double n = 0.0, t = 0.0, x = 0.0, tt = 0.0, tx = 0.0;
    for (std::size_t i = held.samples.size() / 2; i < held.samples.size(); ++i) {
      const Sample& s = held.samples[i];
      n += 1.0, t += s.t, x += s.travel, tt += s.t * s.t, tx += s.t * s.travel;
    }
    CHECK(std::fabs((n * tx - t * x) / (n * tt - t * t)) < 0.01e-6);
    CHECK(std::fabs(held.samples.back().travel) < 20e-6);
    CHECK(std::fabs(held.samples.back().turn) < 1e-3);
  }
}

TEST_CASE("In MuJoCo a box of a mesh slides, pivots and tips as one of a primitive", "[mujoco]") {
  const auto end = [](bool mesh, double along, double spin, double lift) {
    Scene scene = mesh_on_slope(false);
    if (!mesh) {
      const std::string geom = "type=\"mesh\" mesh=\"box\"";
      scene.xml.replace(scene.xml.find(geom), geom.size(), "type=\"box\" size=\"0.05 0.05 0.02\"");
    }
    World world(scene);
    world.run(0.5);
    world.data->qvel[0] = along;
    world.data->qvel[5] = spin;
    world.data->qvel[4] = lift;
    world.run(1.0);
    return Eigen::Vector3d(world.data->qpos[0], world.data->qpos[2],
                           2.0 * std::atan2(world.data->qpos[6], world.data->qpos[3]));
  };
  CHECK(end(true, 1.0, 0.0, 0.0)[0] == Approx(end(false, 1.0, 0.0, 0.0)[0]).epsilon(0.02));
  CHECK(end(true, 0.0, 10.0, 0.0)[2] == Approx(end(false, 0.0, 10.0, 0.0)[2]).epsilon(0.05));
  const Eigen::Vector3d tipped[2] = {end(true, 0.0, 0.0, 3.0), end(false, 0.0, 0.0, 3.0)};
  CHECK((tipped[0] - tipped[1]).head<2>().norm() < 2e-3);
}

TEST_CASE("In MuJoCo patches go back when contacts are lost and come again when they are found", "[mujoco]") {
  World world(on_floor(plate, 0.001, 0.5));
  for (int hop = 0; hop < 20; ++hop) {
    world.run(0.1);
    CHECK(world.friction->points().size() == 4);
    world.data->qvel[2] = 0.3;
    world.run(0.02);
    CHECK(world.friction->points().size() == 0);
  }
  CHECK(world.friction->points().refused() == 0);
}

namespace {

/// A block of 0.2 kg on a plate of 0.1 kg, gravity at 15 degrees. Sensors of force and torque under the plate
/// have axes of their own, and the block does not stand above them.
std::string on_force_plate() {
  return R"(<mujoco><option timestep="0.002" gravity="2.539 0 -9.476"/>
<default><geom solref="0.01 1" friction="0.6 0.005 0.0001"/></default>
<worldbody><body name="plate" pos="0 0 -0.01"><geom type="box" size="0.2 0.2 0.01" mass="0.1"/>
<site name="under" pos="0.02 -0.03 -0.01" euler="20 40 60"/></body>
<body name="body" pos="0.06 0.04 0.02"><freejoint/><geom type="box" size="0.05 0.05 0.02" mass="0.2"/></body></worldbody>
<sensor><force site="under"/><torque site="under"/></sensor></mujoco>)";
}

/// Checks that the sensors under the plate read the support of bodies at rest: a force against all weights,
/// and a torque about the site against their moments and against a torque `about` that turns a body (N m).
void expect_support(const mjModel& model, const mjData& data,
                    const Eigen::Vector3d& about = Eigen::Vector3d::Zero()) {
  using Vector = Eigen::Map<const Eigen::Vector3d>;
  const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> axes(data.site_xmat);
  Eigen::Vector3d force = Eigen::Vector3d::Zero(), torque = -about;
  for (int body = 1; body < model.nbody; ++body) {
    const Eigen::Vector3d weight = model.body_mass[body] * Vector(model.opt.gravity);
    force -= weight;
    torque -= (Vector(data.xipos + 3 * body) - Vector(data.site_xpos)).cross(weight);
  }
  CHECK((axes * Vector(data.sensordata) - force).norm() < 1e-3 * force.norm());
  CHECK((axes * Vector(data.sensordata + 3) - torque).norm() < 1e-3 * torque.norm());
}

}  // namespace

TEST_CASE("In MuJoCo force sensors, contact forces and accelerations know the friction of bristles",
          "[mujoco]") {
  World world(on_force_plate());
  world.run(1.0);
  const Eigen::Vector3d gravity_vector(2.539, 0.0, -9.476);
  const auto expect_held = [&] {
    expect_support(*world.model, *world.data);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int i = 0; i < world.data->ncon; ++i) {
      mjtNum force[6], in_world[3];
      world.friction->contact_force(*world.model, *world.data, i, force);
      mju_mulMatTVec(in_world, world.data->contact[i].frame, force, 3, 3);
      sum += Eigen::Vector3d(in_world[0], in_world[1], in_world[2]);
    }
    CHECK((sum + 0.2 * gravity_vector).norm() < 1e-3 * 0.2 * gravity);
    for (int i = 0; i < 6; ++i) CHECK(std::fabs(world.data->qacc[i]) < 1e-3);
  };
  expect_held();
  mj_forward(world.model.get(), world.data.get());
  CHECK(world.data->qacc[0] > 2.5);  // MuJoCo itself believes that the block slides
  world.friction->forward(*world.model, *world.data);
  expect_held();
  const mjtNum before = world.data->qpos[0];
  world.run(0.1);
  CHECK(std::fabs(world.data->qpos[0] - before) < 1e-9);
  CHECK(std::all_of(world.data->xfrc_applied, world.data->xfrc_applied + 18,
                    [](mjtNum f) { return f == 0.0; }));
}

TEST_CASE("In MuJoCo a torque sensor under a plate reads the friction that keeps a ball from turning on it",
          "[mujoco]") {
  World world(R"(<mujoco><option timestep="0.002"/>
<default><geom solref="0.01 1" condim="4" friction="0.5 0.005 0.0001"/></default>
<worldbody><body pos="0 0 -0.01"><geom type="box" size="0.2 0.2 0.01" mass="0.1"/>
<site name="under" euler="20 40 60"/></body>
<body name="body" pos="0 0 0.1"><freejoint/><geom type="sphere" size="0.1" mass="0.3"/></body></worldbody>
<sensor><force site="under"/><torque site="under" cutoff="0.006"/></sensor></mujoco>)");
  world.run(0.2);
  const double about = world.data->qfrc_applied[5] = 0.5 * 0.005 * 0.3 * gravity;
  world.run(0.5);
  expect_support(*world.model, *world.data, {0.0, 0.0, about});
  mjtNum force[6];
  REQUIRE(world.data->ncon == 1);
  world.friction->contact_force(*world.model, *world.data, 0, force);
  const auto& contact = world.data->contact[0];
  const double on_ball = contact.geom2 == 1 ? force[3] : -force[3];
  CHECK(on_ball * contact.frame[2] == Approx(-about).epsilon(1e-3));
  // A weight far off the sensor gives torques beyond its cutoff.
  world.data->qfrc_applied[5] = 0.0;
  world.data->qpos[0] = world.data->qpos[1] = 0.15;
  world.friction->forget_contacts();
  world.run(0.2);
  double largest = 0.0;
  for (int i = 3; i < 6; ++i) largest = std::max(largest, std::fabs(world.data->sensordata[i]));
  CHECK(largest == 0.006);
}

TEST_CASE("In MuJoCo the linear solve predicts the slip and the spin of the step that follows", "[mujoco]") {
  // Shakes a box whose weight is off its centre, on a table that turns against a spring. Its corners carry
  // unequal loads, so that the arms of normal forces and of friction count.
  for (const char* condim : {"3", "4"}) {
    INFO("condim " << condim);
    World world(
        R"(<mujoco><option timestep="0.002"/><default><geom solref="0.01 1" friction="0.5 0.005 0.0001" condim=")" +
        std::string(condim) + R"("/></default><worldbody>
<body><joint type="hinge" axis="0 0 1" pos="0.3 0 0" stiffness="200" damping="0.1"/>
  <geom type="box" size="0.5 0.5 0.05" pos="0 0 -0.05" mass="5"/></body>
<body name="body" pos="0 0 0.02"><freejoint/><geom type="box" size="0.1 0.05 0.02" mass="0.3"/>
  <geom type="box" size="0.02 0.02 0.05" pos="0.07 0.03 0.07" mass="0.2" contype="0" conaffinity="0"/></body>
</worldbody></mujoco>)");
    world.drive = [](const mjModel&, mjData& data) {
      for (int i = 1; i < 7; ++i)
        data.qfrc_applied[i] = (i < 4 ? 0.1 : 0.003) * std::sin((60.0 + 10.0 * i) * data.time);
    };
    world.run(0.5);
    Eigen::Vector4d largest = Eigen::Vector4d::Zero(), error = largest;
    for (int i = 0; i < 50; ++i) {
      world.run(world.model->opt.timestep);
      CHECK(world.friction->contacts().size() == 4);
      for (const auto& c : world.friction->contacts()) {
        Eigen::Matrix<double, 3, 7, Eigen::RowMajor> shift[2], turn[2];
        for (int k = 0; k < 2; ++k)
          mj_jac(world.model.get(), world.data.get(), shift[k].data(), turn[k].data(), c.point.data(),
                 c.bodies[k]);
        const Eigen::Map<const Eigen::Matrix<double, 7, 1>> qvel(world.data->qvel);
        const Eigen::Vector3d slip = (shift[1] - shift[0]) * qvel, spin = (turn[1] - turn[0]) * qvel;
        const Eigen::Vector4d made(c.frame.normal().dot(slip), c.frame.along().dot(slip),
                                   c.frame.aside().dot(slip), c.frame.normal().dot(spin));
        largest = largest.cwiseMax(made.cwiseAbs());
        error = error.cwiseMax((c.velocity - made).cwiseAbs());
      }
    }
    CAPTURE(largest.transpose(), error.transpose());
    for (int a = 0; a < 4; ++a) CHECK(error[a] < 0.02 * largest[a]);
  }
}

TEST_CASE("In MuJoCo copied data and friction repeat a run to the bit, alone and over threads", "[mujoco]") {
  World world(tapped_block());
  world.run(0.83);
  const BristleFriction::State state = world.friction->save();
  const auto copy = [&] {
    World other(tapped_block(), 32);
    other.friction = nullptr;
    const ContactDims dims{std::vector<int>(static_cast<std::size_t>(other.model->ngeom), 3), {}};
    FrictionOptions options;
    options.patch = bristle::PatchOptions{}.with_max_normal_load(5.0).with_bristles(4000);
    options.contacts = 16;
    other.friction = std::make_unique<BristleFriction>(*other.model, dims, World::law(), options);
    other.friction->restore(state);
    mj_copyData(other.data.get(), world.model.get(), world.data.get());
    return other;
  };
  std::vector<World> copies;
  for (int i = 0; i < 8; ++i) copies.push_back(copy());
  world.run(0.5);
  std::vector<mjData*> data;
  std::vector<BristleFriction*> frictions;
  for (World& other : copies) {
    data.push_back(other.data.get());
    frictions.push_back(other.friction.get());
  }
  roll_out(*world.model, data, frictions, 250, 3,
           [&](std::size_t, const mjModel& model, mjData& of) { world.drive(model, of); });
  for (const mjData* of : data) {
    CHECK(std::equal(of->qpos, of->qpos + 7, world.data->qpos));
    CHECK(std::equal(of->qvel, of->qvel + 6, world.data->qvel));
  }
  // Without the friction's state the block settles anew.
  World bare = copy();
  bare.friction->forget_contacts();
  bare.run(0.5);
  CHECK_FALSE(std::equal(bare.data->qpos, bare.data->qpos + 7, world.data->qpos));
}

TEST_CASE("In MuJoCo a belt carries a box at its speed, and holds one that is tied", "[mujoco]") {
  FrictionOptions options;
  options.patch.with_max_normal_load(5.0);
  options.surface_velocity = [](const mjModel&, int geom, double(&velocity)[6]) {
    if (geom == 0) velocity[0] = 0.5;
  };
  const Model model = load(on_floor(plate, 0.001, 0.5));
  const ContactDims dims = remove_friction(*model);
  BristleFriction friction(*model, dims, World::law(), options);
  const Data data = make_data(*model);
  const auto run = [&](double seconds) {
    for (const double end = data->time + seconds - 5e-4; data->time < end;) friction.step(*model, *data);
  };
  run(0.05);
  CHECK(data->qvel[0] == Approx(0.05 * 0.5 * gravity).epsilon(0.05));
  run(1.0);
  CHECK(data->qvel[0] == Approx(0.5).epsilon(1e-6));
  const double start = data->qpos[0];
  run(2.0);
  CHECK(data->qpos[0] - start == Approx(1.0).epsilon(1e-6));
  // A box held in place slides on the belt: kinetic friction.
  for (int i = 0; i < 500; ++i) {
    data->qvel[0] = 0.0;
    friction.step(*model, *data);
  }
  double force = 0.0;
  for (const auto& c : friction.contacts()) force += c.frame.force({c.force[0], c.force[1]})[0];
  CHECK(force == Approx(0.5 * 0.5 * gravity).epsilon(0.02));
}

TEST_CASE("In MuJoCo a belt that turns about a pole pushes a box at a right angle to its arm", "[mujoco]") {
  FrictionOptions options;
  options.patch.with_max_normal_load(5.0);
  options.surface_velocity = [](const mjModel&, int geom, double(&velocity)[6]) {
    if (geom == 0) velocity[5] = 5.0;
  };
  const Model model = load(on_floor(R"(<geom type="box" size="0.01 0.01 0.001" mass="0.5"/>)", 0.001, 0.5));
  const ContactDims dims = remove_friction(*model);
  BristleFriction friction(*model, dims, World::law(), options);
  const Data data = make_data(*model);
  data->qpos[0] = 0.2;  // where the belt has 1 m/s along y
  while (data->time < 0.0495) friction.step(*model, *data);
  CHECK(data->qvel[1] == Approx(0.05 * 0.5 * gravity).epsilon(0.05));
  CHECK(std::fabs(data->qvel[0]) < 0.02);
}

#ifdef BRISTLE_MUJOCO_PLUGIN
namespace {

/// A scene with the plugin in place of MuJoCo's own friction. `keys`: its configuration beside that of
/// World::law().
Model load_with_plugin(std::string xml, const std::string& keys = "") {
  static const bool loaded = (mj_loadPluginLibrary(BRISTLE_MUJOCO_PLUGIN), true);
  REQUIRE(loaded);
  const std::string instance = R"(<plugin plugin="bristle.friction"><instance name="friction">
<config key="presliding_length" value="5e-6"/><config key="peak_over_kinetic" value="1.1"/>
<config key="damping_per_newton" value="0"/><config key="max_normal_load" value="20"/>)" +
                               keys + "</instance></plugin>";
  xml.replace(xml.find("<default><geom"), 14,
              "<extension>" + instance + "</extension><default><geom condim=\"1\"");
  return load(xml);
}
void run_for(const mjModel& model, mjData& data, double seconds, const Scene& scene) {
  for (const double end = data.time + seconds - 0.5 * model.opt.timestep; data.time < end;) {
    scene.drive(model, data);
    mj_step(&model, &data);
  }
}

}  // namespace

TEST_CASE("In MuJoCo 3 mj_step with the plugin moves a capsule as BristleFriction::step does", "[mujoco]") {
  Scene scene = pinch(12.0);
  const Model plain = load(scene.xml);
  const ContactDims dims = remove_friction(*plain);
  FrictionOptions options;
  options.patch.with_max_normal_load(20.0);
  BristleFriction friction(*plain, dims, World::law(), options);
  const Data held = make_data(*plain);
  while (held->time < 0.5) {
    scene.drive(*plain, *held);
    friction.step(*plain, *held);
  }

  const Model model = load_with_plugin(scene.xml);
  const Data data = make_data(*model);
  const auto run = [&] {
    while (data->time < 0.5) {
      scene.drive(*model, *data);
      mj_step(model.get(), data.get());
      // Calls mj_forward() again, as viewers do, which must not count as a step.
      mj_forward(model.get(), data.get());
    }
  };
  run();
  for (int i = 0; i < model->nq; ++i) CHECK(data->qpos[i] == Approx(held->qpos[i]).margin(1e-9));
  const double fallen = data->qpos[4];
  CHECK(fallen < -1e-6);
  CHECK(std::fabs(data->qvel[4]) < 1e-9);
  mj_resetData(model.get(), data.get());
  run();
  CHECK(data->qpos[4] == Approx(fallen).margin(1e-12));
}

TEST_CASE("In MuJoCo 3 mj_setState and mj_copyData carry the plugin's bristles: roll-outs equal to the bit",
          "[mujoco]") {
  for (const char* condim : {"3", "4"}) {
    INFO("condim " << condim);
    const Scene scene = tapped_block();
    const Model model =
        load_with_plugin(scene.xml, std::string("<config key=\"condim\" value=\"") + condim + "\"/>");
    const Data data = make_data(*model), other = make_data(*model), copy = make_data(*model);
    constexpr int all = mjSTATE_INTEGRATION;
    const auto state = [&](const mjData& of) {
      std::vector<mjtNum> numbers(static_cast<std::size_t>(mj_stateSize(model.get(), all)));
      mj_getState(model.get(), &of, numbers.data(), all);
      return numbers;
    };
    const auto is_equal = [&](const mjData& a, const mjData& b) { return state(a) == state(b); };
    run_for(*model, *data, 0.83, scene);
    const std::vector<mjtNum> saved = state(*data);
    CHECK(std::all_of(saved.begin(), saved.end(), [](mjtNum x) { return std::isfinite(x); }));
    run_for(*model, *other, 0.1, scene);  // has bristles of its own, and gets others
    mj_setState(model.get(), other.get(), saved.data(), all);
    mj_copyData(copy.get(), model.get(), data.get());
    run_for(*model, *data, 0.5, scene);
    run_for(*model, *other, 0.5, scene);
    run_for(*model, *copy, 0.5, scene);
    CHECK(is_equal(*data, *other));
    CHECK(is_equal(*data, *copy));
    // The same data returns to its own past.
    mj_setState(model.get(), data.get(), saved.data(), all);
    run_for(*model, *data, 0.5, scene);
    CHECK(is_equal(*data, *other));
    // Without the bristles the block settles anew.
    mj_setState(model.get(), data.get(), saved.data(), all & ~mjSTATE_PLUGIN);
    run_for(*model, *data, 0.5, scene);
    CHECK_FALSE(is_equal(*data, *other));
    // Copied to and fro in every step the block stays.
    const mjtNum before = other->qpos[0];
    mj_setState(model.get(), other.get(), saved.data(), all);
    for (int i = 0; i < 500; ++i) {
      mj_copyData(copy.get(), model.get(), other.get());
      mj_step(model.get(), copy.get());
      mj_copyData(other.get(), model.get(), copy.get());
    }
    CHECK(std::fabs(other->qpos[0] - before) < 2e-6);
  }
}

TEST_CASE("In MuJoCo 3 the plugin's state has room for the contacts of its key, and says when it has not",
          "[mujoco]") {
  const Scene scene = ten_blocks();
  const auto hold = [&](const char* contacts) {
    const Model model =
        load_with_plugin(scene.xml, std::string("<config key=\"contacts\" value=\"") + contacts + "\"/>");
    const Data data = make_data(*model), other = make_data(*model);
    static int warnings;
    warnings = 0;
    auto* const before = mju_user_warning;
    mju_user_warning = [](const char*) { ++warnings; };
    run_for(*model, *data, 0.5, scene);
    std::vector<mjtNum> state(static_cast<std::size_t>(mj_stateSize(model.get(), mjSTATE_INTEGRATION)));
    mj_getState(model.get(), data.get(), state.data(), mjSTATE_INTEGRATION);
    mj_setState(model.get(), other.get(), state.data(), mjSTATE_INTEGRATION);
    run_for(*model, *data, 0.2, scene);
    run_for(*model, *other, 0.2, scene);
    mju_user_warning = before;
    const bool equal = std::equal(data->qpos, data->qpos + model->nq, other->qpos);
    CHECK(data->qpos[0] < 1e-4);  // friction holds all blocks in any case
    return std::make_pair(equal, warnings);
  };
  CHECK(hold("40") == std::make_pair(true, 0));
  CHECK(hold("8") == std::make_pair(false, 2));  // one in each data
  CHECK_FALSE(hold("0").first);
}

TEST_CASE("In MuJoCo 3 a block that sleeps and wakes keeps its bristles, and where it is", "[mujoco]") {
  // Returns how far the block moves in the last five of thirteen taps, after each of which it sleeps. It
  // falls asleep before it has settled, so the first taps move it by 0.5 um in all; straight bristles would
  // move it by 5.6 um after each tap.
  const auto tap = [&](const mjModel& model, mjData& data, const auto& step) {
    const auto rest = [&](double seconds) {
      for (const double end = data.time + seconds; data.time < end;) step();
    };
    rest(1.0);
    mjtNum before = 0.0;
    for (int i = 0; i < 13; ++i) {
      if (i == 8) before = data.qpos[0];
      CHECK(data.ntree_awake == 0);
      data.xfrc_applied[8] = -1.0;  // wakes the block
      rest(0.01);
      CHECK(data.ntree_awake == model.ntree);
      data.xfrc_applied[8] = 0.0;
      rest(0.4);
    }
    return std::fabs(data.qpos[0] - before);
  };
  Scene scene = tapped_block();
  scene.xml.insert(scene.xml.find("<default>"), "<option><flag sleep=\"enable\"/></option>");
  const Model model = load_with_plugin(scene.xml);
  const Data data = make_data(*model);
  CHECK(tap(*model, *data, [&] { mj_step(model.get(), data.get()); }) < 0.01e-6);
  World world(scene.xml);
  CHECK(tap(*world.model, *world.data, [&] { world.friction->step(*world.model, *world.data); }) < 0.01e-6);
}

TEST_CASE("In MuJoCo 3 force sensors know the friction of the plugin, and so does bristle_contact_force",
          "[mujoco]") {
  const Model model = load_with_plugin(on_force_plate());
  const Data data = make_data(*model);
  Scene none;
  run_for(*model, *data, 1.0, none);
  const Eigen::Vector3d gravity_vector(2.539, 0.0, -9.476);
  const auto expect_held = [&] {
    expect_support(*model, *data);
    for (int i = 0; i < 6; ++i) CHECK(std::fabs(data->qacc[i]) < 1e-3);
  };
  expect_held();
  mj_forward(model.get(), data.get());
  expect_held();
  CHECK(std::all_of(data->xfrc_applied, data->xfrc_applied + 18, [](mjtNum f) { return f == 0.0; }));
  using ContactForce = void (*)(const mjModel*, const mjData*, int, mjtNum*);
  void* const library = dlopen(BRISTLE_MUJOCO_PLUGIN, RTLD_NOW | RTLD_NOLOAD);
  REQUIRE(library != nullptr);
  const auto contact_force = reinterpret_cast<ContactForce>(dlsym(library, "bristle_contact_force"));
  REQUIRE(contact_force != nullptr);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int i = 0; i < data->ncon; ++i) {
    mjtNum force[6], in_world[3];
    contact_force(model.get(), data.get(), i, force);
    mju_mulMatTVec(in_world, data->contact[i].frame, force, 3, 3);
    sum += Eigen::Vector3d(in_world[0], in_world[1], in_world[2]);
  }
  CHECK((sum + 0.2 * gravity_vector).norm() < 1e-3 * 0.2 * gravity);
}

TEST_CASE("In MuJoCo 3 belts of the model carry boxes on bristles, and adhesion holds them", "[mujoco]") {
  const auto run = [](const std::string& xml, bool bristles) {
    const Model model = load(xml);
    const Data data = make_data(*model);
    std::optional<BristleFriction> friction;
    if (bristles) {
      const ContactDims dims = remove_friction(*model);
      friction.emplace(*model, dims, World::law());
    }
    while (data->time < 1.5) {
      if (friction)
        friction->step(*model, *data);
      else
        mj_step(model.get(), data.get());
    }
    return Eigen::Vector3d(data->qpos[0], data->qpos[1], data->qpos[2]);
  };
  const auto with = [](const char* attribute, const char* gravity_vector) {
    std::string xml = on_floor(R"(<geom type="box" size="0.05 0.05 0.02" mass="0.2"/>)", 0.0199, 0.5);
    xml.insert(xml.find("type=\"plane\""), std::string(attribute) + " ");
    xml.replace(xml.find("timestep"), 8, std::string(gravity_vector) + " timestep");
    return xml;
  };
  const std::string belt = with("surfacevel=\"1 0 0 0 0 0\"", "");
  const double carried = run(belt, true)[0];
  CHECK(carried > 1.0);
  CHECK(carried == Approx(run(belt, false)[0]).epsilon(0.002));
  // A wall in whose plane gravity acts. At four corners, 1.5 N of adhesion each hold the weight of 1.96 N by
  // friction of 0.5, and 0.75 N do not.
  const char* along = "gravity=\"9.81 0 0\"";
  CHECK(run(with("margin=\"0.001\" gap=\"0.001\" adhesion=\"1.5\"", along), true)[0] < 50e-6);
  const double slides = run(with("margin=\"0.001\" gap=\"0.001\" adhesion=\"0.75\"", along), true)[0];
  CHECK(slides == Approx(0.5 * (gravity - 0.5 * 3.0 / 0.2) * 1.5 * 1.5).epsilon(0.02));
}
#endif

}  // namespace bristle_test::test_mujoco
