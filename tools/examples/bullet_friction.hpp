// Friction of bristles in Bullet: a constraint solver in which a patch of bristles at each contact point
// replaces Bullet's friction. An adapter to copy and to change; Bullet 2.89 to 3.24, float or
// double.
//
//   btCollisionDispatcher dispatcher(&configuration);
//   bullet_example::BristleSolver solver(dispatcher, bristle::Coefficients{}.with_presliding_length(20e-6));
//   btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
//   world.stepSimulation(...)                                       // as usual
//
// A patch belongs to a pair of bodies and to a point of one that moves. Each contact takes over the patch of
// the nearest point of the step before. (Bullet's manifolds persist too, but they treat a point that moves by
// more than 2 % of its shape's size in a step as new.) Where Bullet lists other points of the same surfaces
// from step to step (an upright cylinder, a mesh of triangles), patches stay where they are and carry the
// load of the pair. Coefficients of friction stay those of the bodies (btManifoldPoint::m_combinedFriction);
// the shape of the law is that of the material. Islands, joints, sleeping bodies and sub-steps work as
// before.
//
// The order of a step. One linear solve for all bodies of a group gives the impulses that Bullet's iterations
// begin with. (A stack that is solved by iterations alone has an error in each step, and creeps.) Bullet's
// sequential impulses find the normal impulses. In every sweep each patch adds the impulse with which it
// answers to the slip at the end of the step, with its stiffness and damping implicit and its elastic force
// clipped at the force limit. From half of the sweeps on, answers of the patches themselves
// (PatchBatch::find_force) replace the clipped springs. At the beginning of the next step, when
// Bullet has moved the bodies, the patches step by the slip of the contacts, taken from poses
// (bristle::SlipByPoses), under the normal impulses of the step. They follow the bodies, so nothing drifts,
// even on turning surfaces.
//
// Contacts of round bodies can have beds, through which elastic wheels roll (FrictionOptions::rolling).
//
// Not covered: btMultiBody, btSequentialImpulseConstraintSolverMt, anisotropic friction. Bullet's own rolling
// and spinning friction still work beside it.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <btBulletDynamicsCommon.h>
#include <Eigen/Core>

#include <bristle/bristle.hpp>
#include <bristle/contact_frame.hpp>
#include <bristle/keyed_beds.hpp>
#include <bristle/linear_friction.hpp>

#include "rolling_bed.hpp"

namespace bullet_example {

/// Options of the friction. With ContactOptions::rolling each contact of a sphere, capsule or cylinder has a
/// bed, which resists slip; resistance to spin stays Bullet's.
struct FrictionOptions : bristle_example::ContactOptions {
  /// Number of passes over the friction of all contacts in each of Bullet's iterations. The feet of a stuck
  /// body equalise their loads slowly: at steps of 1/60 s a block rocks on its bristles with 1 pass, and
  /// comes to rest with 4.
  int sweeps = 4;
};

class BristleSolver : public btSequentialImpulseConstraintSolver {
 public:
  BT_DECLARE_ALIGNED_ALLOCATOR();

  /// Makes the solver for a world with this dispatcher. Each contact replaces the kinetic coefficient of
  /// `law` by its own and keeps its ratio of peak to kinetic. Throws bristle::Error.
  BristleSolver(btDispatcher& dispatcher, const bristle::Coefficients& law,
                const FrictionOptions& options = {});
  ~BristleSolver() override;

  /// Contact point with friction, in its state after the last step.
  struct Contact {
    std::uint64_t key = 0;
    bristle::PatchId patch;
    /// Axes of the contact in space. The normal points from body B of the manifold to body A.
    bristle::ContactFrame frame;
    Eigen::Vector3d point = {0, 0, 0};  ///< position of the contact point in the world, m
    double force[2] = {0, 0};  ///< friction along frame.along() and frame.aside(), N, acting on body A
    double normal_load = 0.0;  ///< N
    double scale = 1.0;        ///< friction coefficient of the contact over that of the material
    bristle::BedId bed;        ///< bed, if a body is round; the contact's patch then rests
    /// Response of the contact's patch or bed in the step before, not yet multiplied by `scale`.
    bristle::Response response;
    bool is_listed = true;  ///< whether Bullet lists the contact; if not, the pair touches at other points
    const btCollisionObject* bodies[2] = {nullptr, nullptr};  ///< bodies A and B

   private:
    friend class BristleSolver;
    struct Side {
      int body = -1;
      btVector3 linear[2], angular[2];  // change of the body's velocity and spin per impulse along an axis
      btVector3 axis[2], moment[2];     // slip along an axis = axis . velocity + moment . spin
    };
    int row = -1;    // index in Bullet's list of the contact's normal row, or of another one of its surfaces
    int round = -1;  // index, in bodies and sides, of the body that rolls on the bed, or -1
    // Vector from the centre of the round body to the contact, m, and rotations of both bodies in this step,
    // rad.
    Eigen::Vector3d arm = Eigen::Vector3d::Zero();
    Eigen::Vector3d turns[2] = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
    std::uint64_t pair = 0;
    // The two bodies as Bullet's objects, also where a body is static.
    const btCollisionObject* objects[2] = {nullptr, nullptr};
    int rider = 0;  // index of the body that may roll, or of the smaller one
    bristle::SlipByPoses slip;
    // Slip velocity that follows from the velocities of the bodies, m/s, and by how much the slip of the last
    // step exceeded it (`arc`). The excess repeats in this step: bodies that turn move along arcs, while
    // Bullet moves them along tangents.
    Eigen::Matrix<double, 2, 1, Eigen::DontAlign> by_velocity = Eigen::Vector2d::Zero(),
                                                  arc = Eigen::Vector2d::Zero();
    int surfaces = -1;       // index in surfaces_ if Bullet lists other points of the pair than before
    double share = 1.0;      // share of the load of its surfaces
    double on_points = 0.0;  // load of this step on the contact's points, N
    Eigen::Vector3d held_at = Eigen::Vector3d::Zero();  // position of a contact that is not listed, m
    Side sides[2];
    Eigen::Matrix<double, 2, 2, Eigen::DontAlign> mobility = Eigen::Matrix2d::Zero();  // 1/kg
    // Slip velocity at the start of the step, m/s. The iterations find that at its end.
    Eigen::Matrix<double, 2, 1, Eigen::DontAlign> start = Eigen::Vector2d::Zero();
    Eigen::Matrix<double, 2, 1, Eigen::DontAlign> impulse = Eigen::Vector2d::Zero();  // N s
    bristle::LinearFriction answer;  // model of the force, made under some load
  };

  /// Returns the contacts of the last step, except those of sleeping islands.
  const std::vector<const Contact*>& contacts() const { return listed_; }
  const bristle::KeyedPatches& patches() const { return patches_; }

  /// Treats every contact as new, with straight bristles. Call it after bodies were moved by hand. reset()
  /// does the same.
  void forget_contacts();
  void reset() override;
  void prepareSolve(int bodies, int manifolds) override;
  void allSolved(const btContactSolverInfo& info, btIDebugDraw* drawer) override;

 protected:
  void convertContacts(btPersistentManifold** manifolds, int count, const btContactSolverInfo& info) override;
  btScalar solveSingleIteration(int iteration, btCollisionObject** bodies, int body_count,
                                btPersistentManifold** manifolds, int manifold_count,
                                btTypedConstraint** constraints, int constraint_count,
                                const btContactSolverInfo& info, btIDebugDraw* drawer) override;
  btScalar solveGroupCacheFriendlyFinish(btCollisionObject** bodies, int count,
                                         const btContactSolverInfo& info) override;

 private:
  /// Point that Bullet lists, with its contact: the index of the contact in known_, and whether the contact
  /// lies elsewhere on the same surfaces.
  struct Listed {
    const btManifoldPoint* point;
    std::size_t contact;
    bool joined;
  };
  void step_patches();
  void match();
  void reserve(std::size_t contacts);
  void hold(const bristle::HeldContact& held);
  void find_surfaces();
  void share_loads(double dt_s);
  const Listed* find_listed(const btManifoldPoint& point) const;
  void begin(Contact& contact, int row, double dt_s);
  void set_sides(Contact& contact, const Eigen::Vector3d& position);
  void guess_answer(Contact& contact, double dt_s);
  bristle::Response find_force(const Contact& contact, const Eigen::Vector2d& slip, double load, double dt_s);
  Eigen::Vector2d axes_of(const Contact& contact) const;
  void set_secant(Contact& contact, const Eigen::Vector2d& slip, const bristle::Response& rest, double load,
                  double dt_s);
  void ask_patch(Contact& contact, double dt_s);
  double rub(Contact& contact, double dt_s);
  void push(Contact& contact, const Eigen::Vector2d& impulse);
  bool solve_at_once(double dt_s);
  double rub_all(double dt_s);
  void list_unknowns(double dt_s);
  struct System;
  Eigen::Vector2d slip_of(const Contact& contact) const;
  double normal_impulse(const Contact& contact) const;

  btDispatcher& dispatcher_;
  double kinetic_, highest_load_;
  int friction_sweeps_;
  bristle::PatchBatch batch_;
  bristle::KeyedPatches patches_;
  bristle::BedBatch bed_batch_;
  std::optional<bristle::KeyedBeds> beds_;
  double bed_friction_ = 1.0;  // kinetic coefficient of the beds' material
  // Stiffness of the beds along each axis, over the mean of both axes.
  Eigen::Matrix<double, 2, 1, Eigen::DontAlign> bed_axes_ = Eigen::Vector2d::Ones();
  bristle::ContactMatcher matcher_;
  std::vector<Contact> known_, before_;  // contacts of all bodies, sleeping ones included
  std::vector<std::size_t> index_;       // for each KeyedContact::index, the index of its contact in known_
  std::vector<const btManifoldPoint*> found_;
  std::vector<bristle::ContactPoint> points_;
  std::vector<const btPersistentManifold*> of_;  // manifold of each point in found_
  std::vector<double> normals_;
  std::vector<std::uint64_t> keys_;
  std::vector<Listed> sorted_points_;   // sorted by the points' addresses
  bristle::SurfaceLoads surfaces_;      // pairs of surfaces whose listed points have changed
  std::vector<std::vector<int>> rows_;  // rows of each of these pairs in Bullet's list
  // Pairs of bodies that touch, sorted, with their manifolds.
  std::vector<std::pair<std::uint64_t, const btPersistentManifold*>> touching_;
  std::size_t first_of_group_ = 0;  // index in solved_ of the first contact of the islands being solved
  std::vector<Contact*> solved_;
  std::vector<const Contact*> listed_;
  std::vector<bristle::Motion> motions_;
  std::vector<bristle::Response> responses_;
  std::vector<bristle::BedMotion> bed_motions_;
  std::vector<bristle::BedResponse> bed_responses_;
  std::vector<btScalar> coefficients_;
  double last_dt_s_ = 0.0;
  std::unique_ptr<System> system_;
};

}  // namespace bullet_example
