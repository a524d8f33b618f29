#include "tools/examples/bullet_scenes.hpp"

#include <algorithm>
#include <cmath>

namespace bullet_example {

namespace {

constexpr double pi = 3.14159265358979323846;

btScalar scalar(double x) { return static_cast<btScalar>(x); }
btVector3 vector(double x, double y, double z) { return {scalar(x), scalar(y), scalar(z)}; }

btVector3 gravity_on_slope(double degrees) {
  const double angle = degrees * pi / 180.0;
  return vector(9.81 * std::sin(angle), 0.0, -9.81 * std::cos(angle));
}

/// Adds a floor, a wide box whose upper side is z = 0.
void add_floor(World& world, double coefficient) {
  world.add_box(vector(5.0, 5.0, 0.5), vector(0.0, 0.0, -0.5), 0.0, coefficient);
}

double heading(const btTransform& pose) {
  const btMatrix3x3& turned = pose.getBasis();
  return std::atan2(static_cast<double>(turned[1][0]), static_cast<double>(turned[0][0]));
}

/// Runs one world of a scene, with one kind of friction, and records the observed body.
class Stepper {
 public:
  Stepper(const Scene& scene, Friction kind)
      : scene_(scene), world_(kind, scene.gravity, scene.law, scene.options) {
    scene.build(world_);
    sample();
  }

  double time_step() const { return scene_.dt_s; }
  int step() {
    scene_.drive(world_);
    world_.step(scene_.dt_s);
    return world_.contact_points();
  }
  void sample() {
    const btTransform& pose = world_.body(scene_.body).getWorldTransform();
    Sample now{world_.time(), {}, heading(pose)};
    for (int a = 0; a < 3; ++a) now.position[a] = static_cast<double>(pose.getOrigin()[a]);
    if (!result.samples.empty()) {
      const double last = result.samples.back().turn;
      now.turn = last + std::remainder(now.turn - last, 2.0 * pi);
    }
    result.samples.push_back(now);
  }
  static double creep(const std::vector<Sample>& s) {
    const std::size_t from = s.size() * 3 / 4;
    return (s.back().position[0] - s[from].position[0]) / (s.back().t - s[from].t);
  }

  Run result;

 private:
  const Scene& scene_;
  World world_;
};

}  // namespace

const char* to_string(Friction friction) {
  switch (friction) {
    case Friction::stock:
      return "Bullet";
    case Friction::anchored:
      return "Bullet, anchors";
    case Friction::bristle:
      break;
  }
  return "bristle";
}

World::World(Friction friction, const btVector3& gravity, const bristle::Coefficients& law,
             const FrictionOptions& options)
    : friction_(friction), dispatcher_(&configuration_) {
  if (friction == Friction::bristle) {
    auto solver = std::make_unique<BristleSolver>(dispatcher_, law, options);
    bristles_ = solver.get();
    solver_ = std::move(solver);
  } else {
    solver_ = std::make_unique<btSequentialImpulseConstraintSolver>();
  }
  world_ =
      std::make_unique<btDiscreteDynamicsWorld>(&dispatcher_, &broadphase_, solver_.get(), &configuration_);
  world_->setGravity(gravity);
  dispatcher_.setDispatcherFlags(dispatcher_.getDispatcherFlags() &
                                 ~btCollisionDispatcher::CD_USE_RELATIVE_CONTACT_BREAKING_THRESHOLD);
  if (friction == Friction::anchored) {
    world_->getSolverInfo().m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
    world_->getSolverInfo().m_numIterations = 50;
  }
}

btRigidBody& World::add(std::unique_ptr<btCollisionShape> shape, const btVector3& position, double mass_kg,
                        double coefficient) {
  btVector3 inertia(0, 0, 0);
  if (mass_kg > 0.0) shape->calculateLocalInertia(scalar(mass_kg), inertia);
  Body made;
  made.pose = std::make_unique<btDefaultMotionState>(btTransform(btQuaternion::getIdentity(), position));
  made.body = std::make_unique<btRigidBody>(
      btRigidBody::btRigidBodyConstructionInfo(scalar(mass_kg), made.pose.get(), shape.get(), inertia));
  made.shape = std::move(shape);
  btRigidBody& body = *made.body;
  // Sets the root of the wanted friction coefficient on each body, because Bullet multiplies the coefficients
  // of both bodies.
  body.setFriction(scalar(std::sqrt(coefficient)));
  body.setActivationState(DISABLE_DEACTIVATION);
  if (friction_ == Friction::anchored)
    body.setCollisionFlags(body.getCollisionFlags() | btCollisionObject::CF_HAS_FRICTION_ANCHOR);
  world_->addRigidBody(&body);
  bodies_.push_back(std::move(made));
  return body;
}

btRigidBody& World::add_box(const btVector3& half, const btVector3& position, double mass_kg,
                            double coefficient) {
  auto box = std::make_unique<btBoxShape>(half);
  box->setMargin(scalar(std::min(0.001, 0.5 * static_cast<double>(half[half.minAxis()]))));
  return add(std::move(box), position, mass_kg, coefficient);
}

btRigidBody& World::add_cylinder(const btVector3& half, const btVector3& position, double mass_kg,
                                 double coefficient) {
  auto cylinder = std::make_unique<btCylinderShapeZ>(half);
  cylinder->setMargin(scalar(0.001));
  return add(std::move(cylinder), position, mass_kg, coefficient);
}

btRigidBody& World::add_triangles(int n, double edge, double coefficient) {
  auto triangles = std::make_unique<btTriangleMesh>();
  const auto at = [&](int i, int j) { return vector(edge * (i - 0.5 * n), edge * (j - 0.5 * n), 0.0); };
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      triangles->addTriangle(at(i, j), at(i + 1, j), at(i, j + 1));
      triangles->addTriangle(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
    }
  btRigidBody& body = add(std::make_unique<btBvhTriangleMeshShape>(triangles.get(), true),
                          vector(0.0, 0.0, 0.0), 0.0, coefficient);
  bodies_.back().triangles = std::move(triangles);
  return body;
}

btRigidBody& World::add_ball(double radius, const btVector3& position, double mass_kg, double coefficient) {
  return add(std::make_unique<btSphereShape>(scalar(radius)), position, mass_kg, coefficient);
}

btRigidBody& World::add_plate(const btVector3& position, double mass_kg, double coefficient) {
  auto whole = std::make_unique<btCompoundShape>();
  std::vector<std::unique_ptr<btCollisionShape>> parts;
  const auto put = [&](std::unique_ptr<btCollisionShape> part, const btVector3& at) {
    whole->addChildShape(btTransform(btQuaternion::getIdentity(), at), part.get());
    parts.push_back(std::move(part));
  };
  auto plate = std::make_unique<btBoxShape>(vector(pushed_half, pushed_half, 0.5 * plate_height));
  plate->setMargin(scalar(0.25 * plate_height));
  put(std::move(plate), vector(0.0, 0.0, 0.0));
  for (int i = 0; i < 3; ++i) {
    const double angle = 2.0 * pi / 3.0 * i;
    put(std::make_unique<btSphereShape>(scalar(plate_height)),
        vector(feet_radius * std::cos(angle), feet_radius * std::sin(angle), 0.0));
  }
  btRigidBody& body = add(std::move(whole), position, mass_kg, coefficient);
  bodies_.back().parts = std::move(parts);
  const double along = mass_kg * pushed_half * pushed_half / 3.0;
  body.setMassProps(scalar(mass_kg), vector(along, along, 2.0 * along));
  body.updateInertiaTensor();
  return body;
}

void World::step(double dt_s) {
  dt_s_ = dt_s;
  world_->stepSimulation(scalar(dt_s), 0);  // makes one step of exactly dt_s
  ++steps_;
}

int World::contact_points() const {
  int points = 0;
  for (int m = 0; m < dispatcher_.getNumManifolds(); ++m)
    points += const_cast<btCollisionDispatcher&>(dispatcher_).getManifoldByIndexInternal(m)->getNumContacts();
  return points;
}

Scene tapped_block(double dt_s) {
  Scene scene;
  scene.name = "tapped_block";
  scene.title = "block on a slope of 15 degrees, tapped for 2 s, steps of 1/" +
                std::to_string(std::lround(1.0 / dt_s)) + " s";
  scene.dt_s = dt_s;
  scene.gravity = gravity_on_slope(15.0);
  scene.build = [](World& world) {
    add_floor(world, 0.5);
    world.add_box(vector(0.05, 0.05, 0.02), vector(0.0, 0.0, 0.02), 0.2, 0.5);
  };
  scene.drive = [](World& world) {
    const bool tap = world.time() < 2.0 && std::fmod(world.time() + 1e-9, 0.2) < 0.01;
    if (tap) world.body(1).applyCentralForce(vector(0.0, 0.3, -1.0));  // force sideways and into the slope, N
  };
  return scene;
}

Scene stack(int boxes, double dt_s, double seconds) {
  Scene scene;
  const std::string rate = std::to_string(std::lround(1.0 / dt_s));
  scene.name = "stack_" + std::to_string(boxes) + "_" + rate;
  scene.title =
      std::to_string(boxes) + " boxes on each other on a slope of 10 degrees, steps of 1/" + rate + " s";
  scene.seconds = seconds;
  scene.dt_s = dt_s;
  scene.gravity = gravity_on_slope(10.0);
  scene.options.patch.with_max_normal_load(40.0);
  scene.body = static_cast<std::size_t>(boxes);
  scene.build = [boxes](World& world) {
    add_floor(world, 0.5);
    for (int i = 0; i < boxes; ++i)
      world.add_box(vector(0.1, 0.1, 0.03), vector(0.0, 0.0, 0.03 + 0.06 * i), 0.5, 0.5);
  };
  return scene;
}

Scene pushed_box() {
  Scene scene;
  scene.name = "pushed_box";
  scene.title = "box pushed off its centre";
  scene.seconds = 2.0;
  scene.law.with_kinetic(pushed_coefficient).with_peak(1.1 * pushed_coefficient);
  scene.build = [](World& world) {
    add_floor(world, pushed_coefficient);
    world.add_box(vector(pushed_half, pushed_half, plate_height), vector(0.0, 0.0, plate_height), pushed_mass,
                  0.4);
  };
  scene.drive = [](World& world) {
    const double t = world.time() + 1e-9;
    if (t < push_begin || t >= push_end) return;
    world.body(1).applyCentralForce(vector(push_force, 0.0, 0.0));
    // Adds the torque of the push about the vertical: its force along x acts at y = push_arm, not at the
    // centre.
    world.body(1).applyTorque(vector(0.0, 0.0, -push_arm * push_force));
  };
  return scene;
}

Scene pushed_plate(double dt_s) {
  Scene scene = pushed_box();
  scene.name = "pushed_plate";
  scene.title = "plate on three feet pushed off its centre, steps of 1/" +
                std::to_string(std::lround(1.0 / dt_s)) + " s";
  scene.dt_s = dt_s;
  scene.build = [](World& world) {
    add_floor(world, pushed_coefficient);
    world.add_plate(vector(0.0, 0.0, plate_height), pushed_mass, pushed_coefficient);
  };
  return scene;
}

Scene cylinder_on_slope() {
  Scene scene;
  scene.name = "cylinder";
  scene.title = "cylinder that stands on a slope of 10 degrees";
  scene.seconds = 8.0;
  scene.gravity = gravity_on_slope(10.0);
  scene.build = [](World& world) {
    add_floor(world, 0.5);
    world.add_cylinder(vector(0.05, 0.05, 0.04), vector(0.0, 0.0, 0.04), 0.2, 0.5);
  };
  return scene;
}

Scene box_on_triangles() {
  Scene scene;
  scene.name = "box_on_triangles";
  scene.title = "box on a slope of 10 degrees, made of triangles";
  scene.seconds = 8.0;
  scene.gravity = gravity_on_slope(10.0);
  scene.build = [](World& world) {
    world.add_triangles(21, 0.07, 0.5);
    world.add_box(vector(0.05, 0.05, 0.02), vector(0.0, 0.0, 0.02), 0.2, 0.5);
  };
  return scene;
}

Scene many_boxes() {
  Scene scene;
  scene.name = "many_boxes";
  scene.title = "sixteen boxes side by side on a slope of 15 degrees";
  scene.gravity = gravity_on_slope(15.0);
  scene.build = [](World& world) {
    add_floor(world, 0.5);
    for (int i = 0; i < 16; ++i)
      world.add_box(vector(0.05, 0.05, 0.02), vector(0.0, 0.15 * i, 0.02), 0.2, 0.5);
  };
  return scene;
}

std::vector<Scene> all_scenes() {
  return {tapped_block(),
          tapped_block(1.0 / 60.0),
          stack(4, 1.0 / 60.0, 20.0),
          stack(8, 1.0 / 60.0, 20.0),
          stack(),
          pushed_box(),
          pushed_plate(),
          cylinder_on_slope(),
          box_on_triangles(),
          many_boxes()};
}

std::vector<Run> run(const Scene& scene, const std::vector<Friction>& kinds) {
  return bristle_example::run_scene<Stepper>(scene, kinds, 0.1);
}

}  // namespace bullet_example
