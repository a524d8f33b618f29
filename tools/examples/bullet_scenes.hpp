// Runs scenes in Bullet that compare Bullet's friction with that of bristles. All kinds of friction take
// turns in one run, so that their times compare.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tools/examples/bullet_friction.hpp"
#include "tools/examples/run_scenes.hpp"

namespace bullet_example {

/// Kind of friction in a scene. stock: Bullet's, with default options. anchored: Bullet's, with the options
/// that hold best (friction anchors, two directions, 50 iterations). bristle: patches of bristles, with
/// Bullet's other settings at their defaults.
enum class Friction { stock, anchored, bristle };
const char* to_string(Friction friction);

/// World of Bullet that owns its objects. No body may sleep; otherwise sleeping, not friction, would hold a
/// body at rest.
class World {
 public:
  World(Friction friction, const btVector3& gravity, const bristle::Coefficients& law,
        const FrictionOptions& options);

  /// Adds a box with these half edges (m) and mass (kg); mass 0 fixes it in place.
  btRigidBody& add_box(const btVector3& half, const btVector3& position, double mass_kg, double coefficient);
  btRigidBody& add_cylinder(const btVector3& half, const btVector3& position, double mass_kg,
                            double coefficient);
  /// Adds a floor at z = 0 of n x n squares of two triangles each, with edges of `edge` (m).
  btRigidBody& add_triangles(int n, double edge, double coefficient);
  btRigidBody& add_ball(double radius, const btVector3& position, double mass_kg, double coefficient);
  /// Adds a square plate on three round feet at the corners of an equilateral triangle, whose loads follow
  /// from statics. `position` (m): centre of the plate, plate_height above the floor.
  btRigidBody& add_plate(const btVector3& position, double mass_kg, double coefficient);
  void step(double dt_s);
  double time() const { return static_cast<double>(steps_) * dt_s_; }
  int contact_points() const;

  btDiscreteDynamicsWorld& world() { return *world_; }
  btRigidBody& body(std::size_t i) { return *bodies_[i].body; }
  std::size_t bodies() const { return bodies_.size(); }
  /// Returns the solver with bristles, or null in a world with Bullet's own friction.
  const BristleSolver* bristles() const { return bristles_; }

 private:
  struct Body {
    std::vector<std::unique_ptr<btCollisionShape>> parts;
    std::unique_ptr<btTriangleMesh> triangles;
    std::unique_ptr<btCollisionShape> shape;
    std::unique_ptr<btDefaultMotionState> pose;
    std::unique_ptr<btRigidBody> body;
  };
  btRigidBody& add(std::unique_ptr<btCollisionShape> shape, const btVector3& position, double mass_kg,
                   double coefficient);

  Friction friction_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btDbvtBroadphase broadphase_;
  std::vector<Body> bodies_;
  std::unique_ptr<btSequentialImpulseConstraintSolver> solver_;
  const BristleSolver* bristles_ = nullptr;
  std::unique_ptr<btDiscreteDynamicsWorld> world_;  // destroyed before the objects above, used by the world
  double dt_s_ = 0.0;
  long steps_ = 0;
};

struct Scene {
  std::string name, title;
  double seconds = 4.0, dt_s = 1.0 / 240.0;  ///< simulated time, s; time step, s
  btVector3 gravity = {0, 0, btScalar(-9.81)};
  bristle::Coefficients law = bristle::Coefficients{}
                                  .with_kinetic(0.5)
                                  .with_peak(0.55)
                                  .with_presliding_length(20e-6)
                                  .with_damping_per_newton(0.5);
  FrictionOptions options;
  std::function<void(World&)> build;
  std::size_t body = 1;                               ///< index of the body whose motion is recorded
  std::function<void(World&)> drive = [](World&) {};  ///< function that applies forces before each step
};

/// Makes a scene with a block of 200 g on a slope of 15 degrees, where it needs about half of its friction;
/// it is tapped five times a second for the first two seconds. Taps show whether friction lets it creep.
Scene tapped_block(double dt_s = 1.0 / 240.0);
/// Makes a scene with a stack of boxes at rest on a tilted plane. The top box is observed, because errors of
/// all boxes add up there.
Scene stack(int boxes = 5, double dt_s = 1.0 / 240.0, double seconds = 60.0);
/// Makes a scene with a flat box pushed at a corner for 0.2 s: it slides, turns and comes to rest.
Scene pushed_box();
/// Makes the scene of pushed_box() with a plate on three feet, whose loads are known from statics, in place
/// of the box.
Scene pushed_plate(double dt_s = 1.0 / 240.0);
inline constexpr double pushed_mass = 0.5, pushed_half = 0.1, plate_height = 0.004, feet_radius = 0.1,
                        pushed_coefficient = 0.4;  // kg, m (radius, height of the plate, and of its feet)

// Push of the box in pushed_box(): force (N), lever arm about the centre (m), beginning and end (s).
inline constexpr double push_force = 4.0, push_arm = 0.1, push_begin = 0.1, push_end = 0.3;
/// Make a scene with a cylinder that stands on a slope of 10 degrees, and one with a box on a slope made of
/// triangles. Bullet lists other points of their faces from step to step, so patches must be carried over.
Scene cylinder_on_slope();
Scene box_on_triangles();
/// Makes a scene with sixteen boxes side by side on a slope, to time 64 contact points.
Scene many_boxes();
std::vector<Scene> all_scenes();

struct Sample {
  double t;
  double position[3];  ///< m
  double turn;         ///< rotation of the body about z, rad
};

using Run = bristle_example::SceneRun<Friction, Sample>;

/// Runs a scene with all kinds of friction from one start. The kinds take turns, a tenth of a simulated
/// second each, so that their times compare.
std::vector<Run> run(const Scene& scene, const std::vector<Friction>& kinds);

}  // namespace bullet_example
