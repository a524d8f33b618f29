// Bristles in a second engine: Bullet's contacts with patches in place of its own friction.
#include <catch2/catch.hpp>

#include <array>
#include <cmath>
#include <set>

#include "tools/examples/bullet_scenes.hpp"

namespace bristle_test::test_bullet {

using namespace bullet_example;

namespace {

constexpr double gravity = 9.81;
using Vector2 = std::array<double, 2>;

/// A world of Bullet whose contacts have bristles, with a floor of friction coefficient 0.5.
struct OnFloor {
  explicit OnFloor(double floor = 0.5, double dt = 1.0 / 240.0, double reach = FrictionOptions{}.reach)
      : OnFloor(floor, dt, options(reach)) {}
  OnFloor(double floor, double dt, const FrictionOptions& options)
      : world(Friction::bristle, btVector3(0, 0, -gravity), law(), options), dt_s(dt) {
    world.add_box(btVector3(50, 50, 0.5), btVector3(0, 0, -0.5), 0.0, floor);
  }
  static bristle::Coefficients law() {
    return bristle::Coefficients{}.with_kinetic(0.5).with_peak(0.55).with_presliding_length(5e-6);
  }
  static FrictionOptions options(double reach) {
    FrictionOptions to;
    to.reach = reach;
    return to;
  }
  void run(double seconds) {
    for (long i = std::lround(seconds / dt_s); i > 0; --i) world.step(dt_s);
  }
  World world;
  double dt_s;
};

/// A ball that rolls under a constant torque, its contact a bed with these slip stiffnesses (N).
struct DrivenBall {
  static constexpr double radius = 0.1, mass = 0.3, torque = 0.02, dt_s = 1.0 / 240.0;  // m, kg, N m

  explicit DrivenBall(const Vector2& slip_stiffness)
      : stiffness(slip_stiffness),
        world(Friction::bristle, btVector3(0, 0, -gravity), OnFloor::law(), options(slip_stiffness)) {}
  static FrictionOptions options(const Vector2& slip_stiffness) {
    FrictionOptions to = OnFloor::options(1e-3);
    to.rolling.emplace();
    to.rolling->material =
        bristle::BedMaterial(0.5).with_slip_stiffness(slip_stiffness[0], slip_stiffness[1]);
    to.rolling->shape = bristle::BedShape::disc(0.005, bristle::BedPressure::parabolic).rolling(32, 8);
    to.rolling->options.max_normal_load = mass * gravity;
    return to;
  }
  void add_ball() { ball = &world.add_ball(radius, btVector3(0, 0, radius), mass, 0.5); }
  /// Adds a table that can turn: it has no weight, and its mass holds it in place.
  btRigidBody& add_table() {
    btRigidBody& table = world.add_box(btVector3(5, 5, 0.5), btVector3(0, 0, -0.5), 1e7, 0.5);
    table.setGravity(btVector3(0, 0, 0));
    return table;
  }
  void run(int steps) {
    for (int i = 0; i < steps; ++i) world.step(dt_s);
  }

  /// Drives the ball for 1 s with this heading, and checks force and creep (slip per rolled distance) of the
  /// last 0.1 s. `turn`: angle from the world's axes to those of the bed, which lie in the body below (rad).
  void check_creep(double heading, double turn) {
    const Eigen::Vector2d ahead(std::cos(heading), std::sin(heading));
    const Eigen::Vector2d force = torque / radius / 1.4 * ahead;
    Eigen::Vector2d creep(0, 0);
    for (int i = 0; i < 240; ++i) {
      ball->applyTorque(btVector3(-torque * ahead[1], torque * ahead[0], 0));
      run(1);
      const auto& contacts = world.bristles()->contacts();
      REQUIRE(contacts.size() == 1);
      if (i < 216) continue;
      const auto& c = *contacts[0];
      const double side = c.bodies[0] == ball ? 1.0 : -1.0;
      const auto on_ball = [&](const double(&of)[2]) -> Eigen::Vector2d {
        return side * (of[0] * c.frame.along() + of[1] * c.frame.aside()).head<2>();
      };
      CHECK((on_ball(c.force) - force).norm() < 0.01 * force.norm());
      CHECK((on_ball(c.response.end) - force).norm() < 0.03 * force.norm());
      const btVector3 spin = ball->getAngularVelocity(), speed = ball->getLinearVelocity();
      const double lever = ball->getWorldTransform().getOrigin().z() - c.point[2];
      const Eigen::Vector2d rolling(lever * spin.y(), -lever * spin.x());
      creep += (rolling - Eigen::Vector2d(speed.x(), speed.y())) / rolling.norm() / 24.0;
    }
    const Eigen::Rotation2Dd to_world(turn);
    const Eigen::Vector2d in_bed = to_world.inverse() * force;
    const Eigen::Vector2d expected =
        to_world * Eigen::Vector2d(in_bed[0] / stiffness[0], in_bed[1] / stiffness[1]);
    CAPTURE(creep[0], creep[1], expected[0], expected[1]);
    CHECK((creep - expected).norm() < 0.04 * expected.norm());
  }

  Vector2 stiffness;
  World world;
  btRigidBody* ball = nullptr;
};

}  // namespace

TEST_CASE("In Bullet a tapped block stays on its slope, and friction balances its weight", "[bullet]") {
  for (const double dt : {1.0 / 240.0, 1.0 / 60.0}) {
    const Scene scene = tapped_block(dt);
    INFO(scene.title);
    const Run held = run(scene, {Friction::bristle})[0];
    CHECK(std::fabs(held.creep) < 1e-12);
    CHECK(std::fabs(held.samples.back().position[0]) < 10e-6);
    CHECK(std::fabs(held.samples.back().position[1]) < 1e-6);
    CHECK(held.samples.back().position[0] > 1e-6);  // the box must move until bent bristles hold it

    World world(Friction::bristle, scene.gravity, scene.law, scene.options);
    scene.build(world);
    for (int i = 0; i < 300; ++i) world.step(dt);
    Eigen::Vector3d force(0, 0, 0);
    for (const auto* c : world.bristles()->contacts()) {
      const double side = c->bodies[0] == &world.body(1) ? 1.0 : -1.0;
      force += side * (c->force[0] * c->frame.along() + c->force[1] * c->frame.aside());
    }
    const double downhill = 0.2 * gravity * std::sin(15.0 * M_PI / 180.0);
    CHECK(force[0] == Approx(-downhill).epsilon(1e-6));
    CHECK(std::fabs(force[1]) < 1e-6 * downhill);
  }
}

TEST_CASE("In Bullet stacks of four and eight boxes fall with Bullet's friction and rest on bristles",
          "[bullet]") {
  for (const Scene& scene : {stack(4, 1.0 / 60.0, 10.0), stack(8, 1.0 / 60.0, 10.0),
                             stack(8, 1.0 / 120.0, 10.0), stack(4, 1.0 / 240.0, 5.0)}) {
    INFO(scene.title);
    const Run held = run(scene, {Friction::bristle})[0];
    CHECK(std::fabs(held.creep) < 1e-9);
    CHECK(std::fabs(held.samples.back().position[0]) < 5e-3);
    CHECK(held.contacts == Approx(4.0 * static_cast<double>(scene.body)).epsilon(0.01));
  }
  CHECK(run(stack(4, 1.0 / 60.0, 10.0), {Friction::stock})[0].samples.back().position[0] > 0.1);
}

TEST_CASE("In Bullet a stack at rest needs no iteration, unless a body resists rolling", "[bullet]") {
  struct Counted : BristleSolver {
    using BristleSolver::BristleSolver;
    btScalar solveSingleIteration(int iteration, btCollisionObject** bodies, int body_count,
                                  btPersistentManifold** manifolds, int manifold_count,
                                  btTypedConstraint** constraints, int constraint_count,
                                  const btContactSolverInfo& info, btIDebugDraw* drawer) override {
      ++iterations;
      return BristleSolver::solveSingleIteration(iteration, bodies, body_count, manifolds, manifold_count,
                                                 constraints, constraint_count, info, drawer);
    }
    int iterations = 0;
  };
  for (const bool rolling : {false, true}) {
    const Scene scene = stack(4, 1.0 / 60.0);
    World world(Friction::bristle, scene.gravity, scene.law, scene.options);
    Counted solver(*world.world().getDispatcher(), scene.law, scene.options);
    world.world().setConstraintSolver(&solver);
    scene.build(world);
    for (std::size_t i = 0; rolling && i < world.bodies(); ++i) world.body(i).setRollingFriction(0.01);
    for (int i = 0; i < 600; ++i) world.step(scene.dt_s);
    solver.iterations = 0;
    for (int i = 0; i < 100; ++i) world.step(scene.dt_s);
    CHECK(solver.iterations == (rolling ? 1000 : 100));
  }
}

TEST_CASE("In Bullet a plate turns by I w^2 / (2 mu W r)", "[bullet]") {
  OnFloor floor;
  btRigidBody& plate = floor.world.add_box(btVector3(0.1, 0.1, 0.001), btVector3(0, 0, 0.001), 0.5, 0.5);
  floor.run(0.2);
  plate.setAngularVelocity(btVector3(0, 0, 8));
  double turned = 0.0;
  for (int i = 0; i < 144; ++i) {
    floor.run(floor.dt_s);
    turned += plate.getAngularVelocity().z() * floor.dt_s;
  }
  const double inertia = 0.5 * (0.2 * 0.2 + 0.2 * 0.2) / 12.0, arm = std::hypot(0.1, 0.1);
  // Bullet turns bodies by the spin at a step's end, so a braking body stops half a step's turn short.
  CHECK(turned ==
        Approx(inertia * 64.0 / (2.0 * 0.5 * 0.5 * gravity * arm) - 0.5 * floor.dt_s * 8.0).epsilon(0.03));
  CHECK(plate.getAngularVelocity().length() < 1e-6);
}

TEST_CASE("In Bullet a box slides v^2 / (2 mu g) on the same patches, at any speed", "[bullet]") {
  for (const double speed : {0.1, 1.0, 3.0}) {
    INFO(speed << " m/s");
    OnFloor floor;
    btRigidBody& box = floor.world.add_box(btVector3(0.1, 0.1, 0.004), btVector3(0, 0, 0.004), 0.5, 0.5);
    floor.run(0.2);
    std::set<std::uint64_t> before, after;
    for (const auto* c : floor.world.bristles()->contacts()) before.insert(c->key);
    const double start = box.getWorldTransform().getOrigin().x();
    box.setLinearVelocity(btVector3(0.8 * speed, 0.6 * speed, 0));
    floor.run(0.02);
    for (const auto* c : floor.world.bristles()->contacts()) after.insert(c->key);
    for (const std::uint64_t key : after) CHECK(before.count(key) == 1);
    CHECK(before.size() == 4);
    floor.run(0.8);
    // Bullet moves bodies by the velocity at a step's end, so a braking body stops half a step's path short.
    const double path = speed * speed / (2.0 * 0.5 * gravity) - 0.5 * floor.dt_s * speed;
    CHECK(box.getWorldTransform().getOrigin().x() - start == Approx(0.8 * path).epsilon(0.02));
    CHECK(box.getLinearVelocity().length() < 1e-6);
  }
}

TEST_CASE(
    "In Bullet friction of a thrown, a spun and a rolling ball is that of Coulomb at any speed and reach",
    "[bullet]") {
  for (const double reach : {0.01, 1e-5}) {
    for (const double speed : {0.01, 1.0, 8.0, 100.0}) {
      INFO(speed << " m/s, reach " << reach << " m");
      const auto run_ball = [&](double along, double about) {
        OnFloor floor(0.5, 1.0 / 60.0, reach);
        btRigidBody& ball = floor.world.add_ball(0.1, btVector3(0, 0, 0.1), 0.3, 0.5);
        floor.run(0.1);
        ball.setLinearVelocity(btVector3(along, 0, 0));
        ball.setAngularVelocity(btVector3(0, about / 0.1, 0));
        floor.run(0.1);
        return ball.getLinearVelocity().x();
      };
      const double lost = 0.5 * gravity * 0.1, until_rolling = 2.0 / 7.0 * speed;
      CHECK(speed - run_ball(speed, 0.0) == Approx(std::min(lost, until_rolling)).epsilon(0.01));
      CHECK(run_ball(0.0, speed) == Approx(std::min(lost, until_rolling)).epsilon(0.01));
      CHECK(run_ball(speed, speed) == Approx(speed).epsilon(1e-6));
    }
  }
}

TEST_CASE("In Bullet a ball on a bed rolls on, and slides with the friction of its contact",
          "[bullet][beds]") {
  FrictionOptions options = DrivenBall::options({40.0, 40.0});
  options.rolling->material = bristle::BedMaterial(0.8).with_slip_stiffness(40.0, 40.0);
  OnFloor floor(0.5, DrivenBall::dt_s, options);
  btRigidBody& ball = floor.world.add_ball(DrivenBall::radius, btVector3(0, 0, 0.1), DrivenBall::mass, 0.5);
  floor.run(0.2);
  for (int i = 0; i < 240; ++i) {
    ball.applyTorque(btVector3(0, DrivenBall::torque, 0));
    floor.run(floor.dt_s);
  }
  const double speed = ball.getLinearVelocity().x();
  CHECK(speed == Approx(DrivenBall::torque / DrivenBall::radius / (1.4 * DrivenBall::mass)).epsilon(0.01));
  floor.run(1.0);
  CHECK(ball.getLinearVelocity().x() == Approx(speed).epsilon(0.002));
  // A ball that slides without spin has the friction of the contact, not of the bed's material.
  ball.setLinearVelocity(btVector3(3, 0, 0));
  ball.setAngularVelocity(btVector3(0, 0, 0));
  floor.run(0.05);
  CHECK(3.0 - ball.getLinearVelocity().x() == Approx(0.05 * 0.5 * gravity).epsilon(0.05));
}

TEST_CASE("In Bullet a driven ball creeps by force over slip stiffness along each axis of the body below",
          "[bullet][beds]") {
  for (const auto& stiffness : {Vector2{20.0, 200.0}, Vector2{200.0, 20.0}, Vector2{30.0, 60.0}})
    for (const double heading : {0.0, M_PI / 6.0, M_PI / 2.0})
      for (const double turn : {0.0, 1.2}) {
        CAPTURE(stiffness[0], stiffness[1], heading, turn);
        DrivenBall driven(stiffness);
        btRigidBody& table = driven.add_table();
        driven.add_ball();
        driven.run(48);
        table.setAngularVelocity(btVector3(0, 0, turn * 4.0));
        driven.run(60);
        table.setAngularVelocity(btVector3(0, 0, 0));
        driven.check_creep(heading, turn);
      }
}

TEST_CASE("In Bullet the smaller of two balls rolls on their bed, whichever comes first", "[bullet][beds]") {
  for (const bool large_first : {true, false}) {
    CAPTURE(large_first);
    DrivenBall driven({40.0, 40.0});
    // Bullet drops a contact of two balls that part, so they touch by some depth (m).
    driven.world.world().getSolverInfo().m_linearSlop = btScalar(1e-4);
    const auto add_large = [&] { driven.world.add_ball(1000.0, btVector3(0, 0, -1000.0), 0.0, 0.5); };
    if (large_first) add_large();
    driven.add_ball();
    if (!large_first) add_large();
    driven.run(48);
    driven.check_creep(0.0, 0.0);
  }
}

TEST_CASE("In Bullet a bed goes back when its contact is lost or forgotten", "[bullet][beds]") {
  FrictionOptions options = OnFloor::options(1e-3);
  options.contacts = 1;  // a bed that is kept leaves none for the next contact, which then has a patch
  options.rolling.emplace();
  options.rolling->material = bristle::BedMaterial(0.8).with_slip_stiffness(40.0, 40.0);
  options.rolling->shape = bristle::BedShape::disc(0.005, bristle::BedPressure::parabolic).rolling(8, 4);
  options.rolling->options.max_normal_load = 0.3 * gravity;
  OnFloor floor(0.5, 1.0 / 240.0, options);
  btRigidBody& first = floor.world.add_ball(0.1, btVector3(0, 0, 0.1), 0.3, 0.5);
  btRigidBody& second = floor.world.add_ball(0.1, btVector3(1, 0, 0.4), 0.3, 0.5);
  const auto only_contact = [&] {
    const auto& contacts = floor.world.bristles()->contacts();
    REQUIRE(contacts.size() == 1);
    CHECK(contacts[0]->bed);
    return *contacts[0];
  };
  const auto force = [&] {
    const bristle::Response response = only_contact().response;
    return std::hypot(response.end[0], response.end[1]);
  };
  floor.run(0.1);
  only_contact();
  first.setLinearVelocity(btVector3(0, 0, 6));
  floor.run(0.5);
  only_contact();
  CHECK(second.getWorldTransform().getOrigin().z() < 0.11);

  for (int i = 0; i < 24; ++i) {
    second.applyTorque(btVector3(0, 0.02, 0));
    floor.run(floor.dt_s);
  }
  const double bent = force();
  CHECK(bent > 0.02);
  dynamic_cast<BristleSolver&>(*floor.world.world().getConstraintSolver()).forget_contacts();
  second.setLinearVelocity(btVector3(0, 0, 0));
  second.setAngularVelocity(btVector3(0, 0, 0));
  floor.run(floor.dt_s);
  CHECK(force() < 0.05 * bent);
}

TEST_CASE("In Bullet friction between two moving bodies keeps their momentum", "[bullet]") {
  OnFloor floor(0.0);
  btRigidBody& plank = floor.world.add_box(btVector3(1, 0.2, 0.02), btVector3(0, 0, 0.02), 1.0, 0.5);
  btRigidBody& box = floor.world.add_box(btVector3(0.05, 0.05, 0.02), btVector3(0, 0, 0.06), 0.25, 0.5);
  floor.run(0.1);
  box.setLinearVelocity(btVector3(1, 0, 0));
  floor.run(0.1);
  const auto momentum = [&] { return 0.25 * box.getLinearVelocity().x() + plank.getLinearVelocity().x(); };
  CHECK(momentum() == Approx(0.25).epsilon(1e-6));
  CHECK(box.getLinearVelocity().x() == Approx(1.0 - 0.1 * 0.5 * gravity).epsilon(0.02));
  floor.run(0.4);
  CHECK(momentum() == Approx(0.25).epsilon(1e-6));
  CHECK(box.getLinearVelocity().x() == Approx(0.2).epsilon(1e-3));
  CHECK(plank.getLinearVelocity().x() == Approx(0.2).epsilon(1e-3));
}

TEST_CASE("In Bullet a thousand contacts hold on 15 degrees, with room for three at first", "[bullet]") {
  FrictionOptions options = OnFloor::options(0.01);
  options.contacts = 3;
  const double angle = 15.0 * M_PI / 180.0;
  World world(Friction::bristle, btVector3(gravity * std::sin(angle), 0, -gravity * std::cos(angle)),
              OnFloor::law(), options);
  world.add_box(btVector3(50, 50, 0.5), btVector3(0, 0, -0.5), 0.0, 0.5);
  for (int i = 0; i < 250; ++i)
    world.add_box(btVector3(0.05, 0.05, 0.02), btVector3(0.2 * (i % 16), 0.2 * (i / 16), 0.02), 0.2, 0.5);
  for (int i = 0; i < 60; ++i) world.step(1.0 / 240.0);
  CHECK((world.bristles()->contacts().size() == 1000 && world.bristles()->patches().size() == 1000));
  CHECK(world.bristles()->patches().refused() == 0);
  for (std::size_t i = 1; i < world.bodies(); ++i)
    CHECK(std::fabs(world.body(i).getWorldTransform().getOrigin().x() -
                    0.2 * static_cast<double>((i - 1) % 16)) < 1e-5);
}

TEST_CASE("In Bullet a box rests on a turntable, at 1.5 rad/s and 1 m", "[bullet]") {
  World world(Friction::bristle, btVector3(0, 0, -gravity), OnFloor::law(), OnFloor::options(0.01));
  btRigidBody& table = world.add_box(btVector3(1.5, 1.5, 0.05), btVector3(0, 0, -0.05), 1e7, 0.6);
  table.setGravity(btVector3(0, 0, 0));
  btRigidBody& box = world.add_box(btVector3(0.05, 0.05, 0.02), btVector3(1, 0, 0.02), 0.5, 0.6);
  const auto run = [&](double seconds) {
    for (long i = std::lround(seconds * 240.0); i > 0; --i) {
      table.setLinearVelocity(btVector3(0, 0, 0));
      table.setAngularVelocity(btVector3(0, 0, std::min(1.5, 0.5 * world.time())));
      world.step(1.0 / 240.0);
    }
    return table.getWorldTransform().invXform(box.getWorldTransform().getOrigin());
  };
  const btVector3 begin = run(5.0);
  const btVector3 end = run(60.0);
  CHECK(begin.x() == Approx(1.0).epsilon(1e-3));
  CHECK((end - begin).length() < 1e-7);
}

TEST_CASE("In Bullet an upright cylinder and a box on a mesh of triangles rest on 10 degrees", "[bullet]") {
  for (Scene scene : {cylinder_on_slope(), box_on_triangles()}) {
    INFO(scene.title);
    scene.seconds = 20.0;
    const Run held = run(scene, {Friction::bristle})[0];
    CHECK(std::fabs(held.creep) < 0.01e-6);
    CHECK(std::fabs(held.samples.back().position[0]) < 50e-6);
    CHECK(std::fabs(held.samples.back().turn) < 1e-3);
  }
}

TEST_CASE("In Bullet patches wait for sleeping bodies, and go back when contact is lost", "[bullet]") {
  const Scene scene = tapped_block();
  World world(Friction::bristle, scene.gravity, scene.law, scene.options);
  scene.build(world);
  const auto run = [&](int steps) {
    for (int i = 0; i < steps; ++i) world.step(scene.dt_s);
  };
  const auto position = [&] { return world.body(1).getWorldTransform().getOrigin().x(); };
  run(240);
  const double held = position();
  world.body(1).forceActivationState(ISLAND_SLEEPING);
  run(50);
  CHECK(world.bristles()->contacts().empty());
  CHECK(world.bristles()->patches().size() == 4);
  world.body(1).forceActivationState(DISABLE_DEACTIVATION);
  run(240);
  CHECK(std::fabs(position() - held) < 1e-9);
  // Checks that Bullet's own friction coefficients are unchanged.
  auto& dispatcher = *world.world().getDispatcher();
  for (int m = 0; m < dispatcher.getNumManifolds(); ++m)
    for (int p = 0; p < dispatcher.getManifoldByIndexInternal(m)->getNumContacts(); ++p)
      CHECK(dispatcher.getManifoldByIndexInternal(m)->getContactPoint(p).m_combinedFriction == Approx(0.5));
  world.body(1).setLinearVelocity(btVector3(0, 0, 2));
  run(24);
  CHECK(world.bristles()->patches().size() == 0);
}

}  // namespace bristle_test::test_bullet
