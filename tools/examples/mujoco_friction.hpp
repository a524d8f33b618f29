// Friction of bristles in MuJoCo: its own contacts keep the normal force and lose friction, a bristle patch
// at each contact point takes its place. An adapter to copy and to change; MuJoCo 2.2.
//
//   mjModel* model = mj_loadXML(...);
//   mujoco_example::remove_friction(*model);
//   mujoco_example::BristleFriction friction(*model, bristle::Coefficients{}.with_presliding_length(20e-6));
//   while (...) friction.step(*model, *data);          // in place of mj_step(model, data)
//
// A patch belongs to a pair of geoms and to a point: contacts are made anew in every step, and each takes
// over the patch of the nearest point of the step before. Coefficients of friction stay those of the model
// (mjContact::friction[0]); the shape of the law is that of the material.
//
// The order of a step: mj_step1; mj_fwdActuation, mj_fwdAcceleration; a clipped predictor finds how each
// contact will slip (one linear solve for each group of bodies that touch), and PatchBatch::find_force how
// its patch will answer; that goes to qfrc_applied for the time of mj_step2. Then the patches step by what
// the contacts really slipped: they follow the bodies, and nothing drifts. Normal loads are those of the step
// before.
//
// Not covered: friction about the normal and rolling friction (condim 4 and 6), RK4 (mj_step2 has none).
#pragma once

#include <cstdint>
#include <vector>

#include <mujoco/mujoco.h>
#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <bristle/bristle.hpp>
#include <bristle/contact_frame.hpp>

namespace mujoco_example {

/// Makes every contact of the model frictionless (condim 1). Coefficients stay where they are.
void remove_friction(mjModel& model);

struct FrictionOptions {
  /// Of each contact point. The infinite brush has no noise and costs less; a law with SnapRule::keep needs
  /// Population::representatives.
  bristle::PatchOptions patch = bristle::PatchOptions{}
                                    .with_max_normal_load(10.0)
                                    .with_population(bristle::Population::infinite)
                                    .with_resolution(4)
                                    .with_cohorts(24);
  double reach = 0.01;           ///< m: a contact point that moves farther in one step is a new one
  std::uint32_t contacts = 256;  ///< at once; contacts beyond have no friction
};

class BristleFriction {
 public:
  /// `law`: its kinetic coefficient is replaced by that of each contact, peak over kinetic stays. Throws
  /// bristle::Error.
  BristleFriction(const mjModel& model, const bristle::Coefficients& law,
                  const FrictionOptions& options = {});

  /// One step of the model's timestep, in place of mj_step. What stands in qfrc_applied counts and is left as
  /// it is.
  void step(const mjModel& model, mjData& data);
  /// After mj_resetData, or when bodies were put elsewhere: every contact is new.
  void forget_contacts();

  /// A contact of the last step.
  struct Contact {
    std::uint64_t key = 0;
    bristle::PatchId patch;
    bristle::ContactFrame frame;        ///< normal from geom1 to geom2
    Eigen::Vector3d point = {0, 0, 0};  ///< m, in the world
    Eigen::Vector2d force = {0, 0};     ///< N along frame.along() and aside(), on geom2's body
    double normal_load = 0.0;           ///< N, of MuJoCo's solver in this step
    double scale = 1.0;                 ///< the contact's coefficient over the material's
    Eigen::Vector2d slip = {0, 0};      ///< m/s, predicted
    bristle::Response response;         ///< of its patch, where the bodies are now
    int bodies[2] = {0, 0};             ///< of geom1 and geom2
    int row = -1;                       ///< of its normal force among MuJoCo's constraints
  };
  const std::vector<Contact>& contacts() const { return contacts_; }
  const bristle::KeyedPatches& patches() const { return patches_; }

 private:
  using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  /// Bodies that touch, directly or over others: what moves them, and their contacts. The equations of one
  /// island know nothing of the others, so each is solved by itself.
  struct Island {
    std::vector<int> dofs;              // of the model, ascending
    std::vector<std::size_t> contacts;  // places in contacts_
    RowMatrix jacobian;                 // 3 rows a contact, a column for each of `dofs`
    Eigen::VectorXd velocity;           // of `dofs`
  };

  void match(const mjModel& model, const mjData& data);
  void take_over(const mjModel& model, const mjData& data, const mjContact& found, std::uint64_t key);
  void find_islands(const mjModel& model);
  int top_of(int tree);
  void set_jacobian(const mjModel& model, const mjData& data, Island& island);
  void set_equation(const mjModel& model, const mjData& data, const Island& island);
  void predict(const mjModel& model, const mjData& data, const Island& island);
  bool clip(double dt_s, const Island& island);
  void find_forces(double dt_s);
  void move_patches(const mjModel& model, const mjData& data);

  double kinetic_;
  bristle::PatchBatch batch_;
  bristle::KeyedPatches patches_;
  bristle::ContactMatcher matcher_;
  std::vector<Contact> contacts_, before_;  // before_: by key
  std::vector<const mjContact*> found_;
  std::vector<bristle::ContactPoint> points_;
  std::vector<std::uint64_t> keys_;
  std::vector<bristle::Motion> motions_;
  std::vector<bristle::Response> responses_;
  std::vector<Island> islands_;  // the first island_count_ are in use
  std::size_t island_count_ = 0;
  std::vector<int> tree_, island_of_;  // by body: what it hangs on; its island. -1: none
  std::vector<int> column_;            // by degree of freedom: its column in its island
  RowMatrix fixed_, system_;           // of an island: without patches; with them
  Eigen::LLT<RowMatrix> factor_;
  Eigen::VectorXd fixed_right_, right_, slip_, elastic_, gain_, other_constraints_;
  std::vector<double> stiffness_, applied_;
};

}  // namespace mujoco_example
