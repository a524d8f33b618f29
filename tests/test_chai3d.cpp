// CHAI3D's finger proxy with the friction of a brush, over stand-ins for the CHAI3D classes that it uses.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include <Eigen/Geometry>

#include "expect.hpp"
#include "tools/examples/chai3d_finger_proxy.hpp"

namespace bristle_test::test_chai3d {

using namespace chai3d;
using bristle::Coefficients;
using bristle::Material;
using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

constexpr double tick = 1e-3, radius = 0.005, stiffness = 500.0, kinetic = 0.6;

Material skin() {
  return Material::from_coefficients(Coefficients{}
                                         .with_kinetic(kinetic)
                                         .with_peak(0.66)
                                         .with_presliding_length(0.2e-3)
                                         .with_damping_per_newton(2.0));
}

/// Returns the distance function of a floor: everything below z = 0, from x = `from` to `to`.
cGenericObject::Distance floor_between(double from = -1e9, double to = 1e9) {
  return [=](const Vector3d& p, Vector3d& normal) {
    normal = Vector3d::UnitZ();
    return p[0] >= from && p[0] < to ? p[2] : 1.0;
  };
}
/// Returns the distance of p from a wall that fills the half-space x < 0, and sets the wall's normal.
double wall(const Vector3d& p, Vector3d& normal) {
  normal = Vector3d::UnitX();
  return p[0];
}
Matrix3d turned_by(double angle) { return Eigen::AngleAxisd(angle, Vector3d::UnitZ()).toRotationMatrix(); }

/// A haptic tool in a world, with a brush in place of the proxy's friction.
struct Tool {
  explicit Tool(cWorld& world, const Vector3d& start, const BrushProxyOptions& options = {},
                const Material& material = skin())
      : position(start) {
    point.m_algorithmFingerProxy->initialize(&world, chai(start));
    point.setRadiusContact(radius);
    brush = install_brush(point, material, options);
  }
  Vector3d hold_at(const Vector3d& place) {
    position = place;
    force = eigen(point.m_algorithmFingerProxy->computeForces(chai(place), {}));
    return force;
  }
  template <class Each>
  void go(const Vector3d& to, double speed, const Each& each) {
    const Vector3d from = position;
    const int ticks = std::max(1, static_cast<int>(std::ceil((to - from).norm() / (speed * tick))));
    for (int i = 1; i <= ticks; ++i) {
      hold_at(from + (static_cast<double>(i) / ticks) * (to - from));
      each();
    }
  }
  void go(const Vector3d& to, double speed) {
    go(to, speed, [] {});
  }
  Vector3d friction() const { return eigen(brush->getTangentialForce()); }
  double wall_force() const { return eigen(brush->getNormalForce()).norm(); }

  cHapticPoint point;
  BrushFingerProxy* brush = nullptr;
  Vector3d position, force = Vector3d::Zero();
};

constexpr double depth = 0.004;  // depth of penetration at which the wall force is 2 N, m

}  // namespace

TEST_CASE("A block pinched by two CHAI3D tools holds, and goes where they go", "[chai3d]") {
  constexpr double half = 0.02, mass = 0.1;
  cWorld world;
  cGenericObject block([](const Vector3d& p, Vector3d& normal) {
    normal = p[0] < 0.0 ? Vector3d(-1, 0, 0) : Vector3d(1, 0, 0);
    return std::fabs(p[0]) - half;
  });
  world.objects = {&block};
  const double reach = half + radius - depth;
  // The block swings on its bristles, so they get a damper that works at any speed and brings it to rest.
  const Material damped = Material::from_coefficients(Coefficients{}
                                                          .with_kinetic(kinetic)
                                                          .with_peak(0.66)
                                                          .with_presliding_length(0.2e-3)
                                                          .with_damping_per_newton(0.5)
                                                          .with_stribeck_velocity(1.0));
  Tool left(world, {-1.0, 0, 0}, {}, damped), right(world, {1.0, 0, 0}, {}, damped);
  double height = 0.0, velocity = 0.0, lift = 0.0;
  const auto step = [&](double gravity) {
    const Vector3d on_tools = left.hold_at({-reach, 0, lift}) + right.hold_at({reach, 0, lift});
    velocity += tick * (-gravity - on_tools[2] / mass);
    height += tick * velocity;
    block.place = chai(Vector3d(0, 0, height));
  };
  for (int i = 0; i < 2000; ++i) step(9.81);
  const double held = height;
  CHECK(held < 0.0);
  CHECK(held > -0.2e-3);
  for (int i = 0; i < 1000; ++i) step(9.81);
  CHECK(std::fabs(height - held) < 1e-9);  // checks that the held block does not creep
  CHECK(left.friction()[2] == Approx(-0.5 * mass * 9.81).epsilon(1e-4));
  for (int i = 0; i < 500; ++i) {
    lift += 0.1 * tick;
    step(9.81);
  }
  for (int i = 0; i < 1000; ++i) step(9.81);
  CHECK(height - held == Approx(0.05).margin(0.5e-3));
  // Makes the block too heavy for the grip: it slides, and the bristles pull with the force that the wall
  // load allows.
  for (int i = 0; i < 50; ++i) step(60.0);
  CHECK(velocity < -0.5);
  const bristle::Response& response = left.brush->response();
  CHECK(std::hypot(response.elastic[0], response.elastic[1]) ==
        Approx(kinetic * stiffness * depth).epsilon(0.01));
}

TEST_CASE("Friction under a CHAI3D tool is that of its motion over the object", "[chai3d]") {
  cWorld world;
  cGenericObject disc(floor_between());
  world.objects = {&disc};
  const Vector3d start(0.05, 0, radius - depth);
  const auto turn_to = [&](double angle) { disc.turned = chai_rotation(turned_by(angle)); };

  SECTION("held still on a disc that turns, it is pulled along") {
    Tool tool(world, start);
    for (int i = 0; i < 200; ++i) {
      turn_to(0.01 * i);
      tool.hold_at(start);
    }
    CHECK(tool.wall_force() == Approx(stiffness * depth));
    CHECK(tool.friction()[1] == Approx(kinetic * stiffness * depth).epsilon(0.01));
    CHECK(std::fabs(tool.friction()[0]) < 0.02);
    CHECK(std::fabs(tool.friction()[2]) < 1e-12);
  }
  SECTION("riding on it, it feels nothing but what was bent before, which turns with it") {
    Tool tool(world, start);
    tool.hold_at(start);
    const Vector3d pulled = start + Vector3d(0.05e-3, 0, 0);
    tool.go(pulled, 0.001);
    const Vector3d bent = tool.hold_at(pulled);
    const double friction = tool.friction().norm();
    CHECK(friction > 0.3);
    for (int i = 1; i <= 500; ++i) {
      const Matrix3d turned = turned_by(0.01 * i);
      disc.turned = chai_rotation(turned);
      disc.place = chai(Vector3d(0.001 * i, 0, 0));
      const Vector3d force = tool.hold_at(Vector3d(0.001 * i, 0, 0) + turned * pulled);
      expect((force - turned * bent).norm() < 1e-6, "as it was, seen from the disc");
    }
    CHECK(tool.friction().norm() == Approx(friction).epsilon(1e-6));
  }
}

TEST_CASE("A count of an encoder makes the force step that count_step says", "[chai3d]") {
  constexpr double count = 20e-6;
  for (const double scale : {1.0, 5.0}) {
    cWorld world;
    cGenericObject ground(floor_between());
    world.objects = {&ground};
    const Material soft = Material::from_coefficients(
        Coefficients{}.with_kinetic(kinetic).with_peak(kinetic).with_presliding_length(10.0 * scale * count));
    const Vector3d start(0, 0, radius - depth);
    Tool tool(world, start, {}, soft);
    tool.hold_at(start);
    const auto said = tool.brush->count_step(count, scale, stiffness * depth);
    const double first = -tool.hold_at(start + Vector3d(scale * count, 0, 0))[0];
    // The tolerance is wide because the weakest bristles snap at once, which lowers the first force.
    CHECK(first == Approx(said.force_n).epsilon(0.1));
    CHECK(first <= said.force_n * (1.0 + 1e-9));
    CHECK(said.force_n == Approx(1.95 * kinetic * stiffness * depth / 10.0).epsilon(0.05));
    CHECK(said.share == Approx(0.195).epsilon(0.05));
    // Expects as warning the damping that keeps a hand passive, K T / 2, where K is the stiffness that the
    // hand feels, `scale` times that of the brush.
    CHECK(said.damping_n_s_per_m == Approx(0.5 * tick * said.force_n / count).epsilon(1e-9));
  }
}

TEST_CASE("A damper takes the velocity of a scaled device from many counts where the resolution is set",
          "[chai3d]") {
  constexpr double count = 20e-6, scale = 5.0;
  const Material damped = Material::from_coefficients(Coefficients{}
                                                          .with_kinetic(kinetic)
                                                          .with_peak(kinetic)
                                                          .with_presliding_length(2e-3)
                                                          .with_damping_per_newton(5.0)
                                                          .with_stribeck_velocity(10.0));
  double jump[2];
  for (const bool windowed : {false, true}) {
    cWorld world;
    cGenericObject ground(floor_between());
    world.objects = {&ground};
    Vector3d start(0, 0, radius - depth);
    Tool tool(world, start, BrushProxyOptions{}.with_resolution(windowed ? scale * count : 0.0), damped);
    double last = 0.0;
    jump[windowed ? 1 : 0] = 0.0;
    for (int i = 0; i < 1000; ++i) {  // moves the hand at 7 mm/s
      const double x = scale * count * std::floor(7e-6 * i / count);
      const double now = tool.hold_at(start + Vector3d(x, 0, 0))[0];
      if (i > 200) jump[windowed ? 1 : 0] = std::max(jump[windowed ? 1 : 0], std::fabs(now - last));
      last = now;
    }
  }
  // Without the velocity's filter, one encoder count in a tick is a velocity of 0.1 m/s, of which the damper
  // (2 N times 5 s/m) makes 1 N.
  CHECK(jump[0] > 0.9);
  CHECK(jump[1] < 0.3 * jump[0]);
}

TEST_CASE("What was set on CHAI3D's proxy stays when a brush takes its place", "[chai3d]") {
  cWorld world;
  cHapticPoint point;
  cAlgorithmFingerProxy& old = *point.m_algorithmFingerProxy;
  old.initialize(&world, cVector3d(1, 2, 3));
  old.setProxyRadius(0.003);
  old.m_useDynamicProxy = true;
  old.m_collisionSettings.m_checkVisibleObjects = true;
  old.m_forceShadingAngleThreshold = 0.5;
  old.m_frictionDynHysteresisMultiplier = 0.7;
  old.setEpsilonBaseValue(1e-5);
  BrushFingerProxy* brush = install_brush(point, skin());
  CHECK(point.m_algorithmFingerProxy == brush);
  CHECK(brush->getProxyRadius() == 0.003);
  CHECK(brush->m_collisionSettings.m_collisionRadius == 0.003);
  CHECK(brush->m_collisionSettings.m_checkVisibleObjects);
  CHECK(brush->m_useDynamicProxy);
  CHECK(brush->m_forceShadingAngleThreshold == 0.5);
  CHECK(brush->m_frictionDynHysteresisMultiplier == 0.7);
  CHECK(brush->getEpsilonBaseValue() == 1e-5);
  CHECK(brush->getWorld() == &world);
  CHECK(eigen(brush->getDeviceGlobalPosition()) == Vector3d(1, 2, 3));
}

TEST_CASE("A CHAI3D tool that leaves and returns finds straight bristles", "[chai3d]") {
  cWorld world;
  auto ground = std::make_unique<cGenericObject>(floor_between());
  world.objects = {ground.get()};
  const Vector3d start(0, 0, radius - depth), above(0.1, 0, 0.02), back(0.2, 0, radius - depth);
  Tool tool(world, start);
  tool.hold_at(start);
  tool.go({0.05, 0, start[2]}, 0.1);
  CHECK(-tool.friction()[0] == Approx(kinetic * stiffness * depth).epsilon(0.01));
  tool.go(above, 0.1);
  CHECK(tool.force == Vector3d::Zero());
  // Deletes the touched object, which the friction must not read afterwards.
  world.objects.clear();
  ground.reset();
  tool.hold_at(above + Vector3d(0.01, 0, 0));
  cGenericObject moved(floor_between());
  moved.place = chai(Vector3d(0, 0, 0.001));
  moved.turned = chai_rotation(turned_by(1.0));
  world.objects = {&moved};
  tool.go(back + Vector3d(0, 0, 0.02), 0.5);
  tool.go(back, 0.1);
  CHECK(tool.friction().norm() < 1e-9);
  tool.go(back + Vector3d(0, 0.02, 0), 0.1);
  CHECK(-tool.friction()[1] == Approx(kinetic * stiffness * (depth + 0.001)).epsilon(0.01));
}

TEST_CASE("Sliding from one CHAI3D object to the next makes no gap in friction", "[chai3d]") {
  cWorld world;
  cGenericObject here(floor_between(-1.0, 0.0)), there(floor_between(0.0, 1.0));
  // An object with another origin that continues `here`.
  there.place = chai(Vector3d(0, 0.3, 0));
  world.objects = {&here, &there};
  const Vector3d start(-0.01, 0, radius - depth);
  Tool tool(world, start);
  tool.hold_at(start);
  tool.go({-0.005, 0, start[2]}, 0.01);
  double least = 1e9, most = 0.0;
  tool.go({0.005, 0, start[2]}, 0.01, [&] {
    least = std::min(least, -tool.friction()[0]);
    most = std::max(most, -tool.friction()[0]);
  });
  CHECK(least > 0.999 * most);
  // Largest force so far, with the damper's part.
  CHECK(most == Approx(kinetic * stiffness * depth).epsilon(0.05));
}

TEST_CASE("A CHAI3D object in the memory of one that was deleted under the tool makes no jerk", "[chai3d]") {
  const bool shares_material = GENERATE(false, true);
  cWorld world;
  std::optional<cGenericObject> ground(floor_between());
  world.objects = {&*ground};
  const Vector3d start(0, 0, radius - depth);
  Tool tool(world, start);
  tool.hold_at(start);
  const Vector3d held = tool.hold_at(start + Vector3d(0.05e-3, 0, 0));
  CHECK(tool.friction().norm() > 0.3);
  const auto material = ground->m_material;
  ground.emplace(floor_between());
  // Object with another frame, its top in the old place.
  ground->place = chai(Vector3d(0.3, 0.1, 0));
  ground->turned = chai_rotation(turned_by(1.0));
  if (shares_material) {
    ground->m_material = material;
    tool.brush->restart();
  }
  CHECK((tool.hold_at(tool.position) - held).norm() < 1e-9);
  ground->turned = chai_rotation(turned_by(1.5));  // the patch's frame turns with the object one tick later
  tool.hold_at(tool.position);
  CHECK(tool.friction().norm() == Approx(kinetic * stiffness * depth).epsilon(0.15));
}

TEST_CASE("In an edge the walls bear friction together, and on a sphere it follows the surface", "[chai3d]") {
  cWorld world;
  cGenericObject ground(floor_between()), side(wall);
  world.objects = {&ground, &side};
  Tool tool(world, {radius - 0.003, 0, radius - depth});
  const double both = stiffness * std::hypot(0.003, depth);
  tool.go({radius - 0.003, 0.05, radius - depth}, 0.01);
  CHECK(tool.brush->getNumCollisionEvents() == 2);
  CHECK(tool.friction()[1] == Approx(-kinetic * both).epsilon(0.03));
  CHECK(tool.wall_force() == Approx(both).epsilon(1e-9));
  CHECK(std::hypot(tool.friction()[0], tool.friction()[2]) < 1e-6);

  cGenericObject sphere([](const Vector3d& p, Vector3d& normal) {
    normal = p.normalized();
    return p.norm() - 0.1;
  });
  world.objects = {&sphere};
  const double from_centre = 0.1 + radius - depth;
  tool.brush->restart();
  for (int i = 0; i <= 2000; ++i) {
    const double angle = 0.5e-3 * i;
    tool.hold_at(from_centre * Vector3d(std::sin(angle), 0, std::cos(angle)));
    if (i < 100) continue;
    const Vector3d ahead(std::cos(angle), 0, -std::sin(angle));
    expect(std::fabs(tool.friction().dot(ahead) + kinetic * stiffness * depth) < 0.05 * stiffness * depth,
           "against the motion");
    expect(std::fabs(tool.friction()[1]) < 1e-6, "not aside");
    expect(std::fabs(tool.friction().dot(eigen(tool.brush->getNormalForce()))) < 1e-12, "in the surface");
  }
}

TEST_CASE("A CHAI3D tool whose frame turns drags its brush over the object, and not where it was restarted",
          "[chai3d]") {
  for (const bool restarted : {false, true}) {
    cWorld world;
    cGenericObject ground(floor_between());
    world.objects = {&ground};
    // The tool's point is fixed in the tool's frame, so the hand does not move relative to it.
    Vector3d on_device(0.02, 0, radius - depth);
    Tool tool(world, on_device);
    tool.hold_at(on_device);
    const auto turn_frame = [&](double angle) {
      if (restarted) tool.brush->restart();
      tool.hold_at(turned_by(angle) * on_device);
    };
    for (int i = 1; i <= 500; ++i) turn_frame(1e-3 * i);
    if (restarted) {
      CHECK(tool.friction().norm() < 1e-9);
    } else {  // friction acts against the motion of the tool, across its arm
      CHECK(tool.friction().norm() == Approx(kinetic * stiffness * depth).epsilon(0.05));
      CHECK(tool.friction().normalized().dot(turned_by(0.5) * Vector3d(0, -1, 0)) > 0.99);
    }
  }
}

TEST_CASE("By default a CHAI3D tool renders cohorts, and the mean of a tick only where asked for",
          "[chai3d]") {
  CHECK(BrushProxyOptions{}.patch.population == bristle::Population::infinite);
  double pull[2];  // in the first tick, which moves 0.1 um, N
  for (const bool mean : {false, true}) {
    cWorld world;
    cGenericObject ground(floor_between());
    world.objects = {&ground};
    const Vector3d start(0, 0, radius - depth);
    const Material undamped = Material::from_coefficients(
        Coefficients{}.with_kinetic(kinetic).with_peak(kinetic).with_presliding_length(0.1e-3));
    Tool tool(world, start, BrushProxyOptions{}.with_mean(mean), undamped);
    tool.hold_at(start);
    tool.hold_at(start + Vector3d(0.1e-6, 0, 0));
    pull[mean ? 1 : 0] = -tool.friction()[0];
  }
  CHECK(pull[0] > 0.0);
  CHECK(pull[1] == Approx(0.5 * pull[0]).epsilon(0.01));
}

}  // namespace bristle_test::test_chai3d
