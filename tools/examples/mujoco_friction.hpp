// Friction of bristles in MuJoCo: its own contacts keep the normal force and lose friction, a bristle patch
// at each contact point takes its place. An adapter to copy and to change; run with MuJoCo 2.2.2 and
// 3.12.1.
//
//   mjModel* model = mj_loadXML(...);
//   const auto dims = mujoco_example::remove_friction(*model);
//   mujoco_example::BristleFriction friction(*model, dims,
//                                            bristle::Coefficients{}.with_presliding_length(20e-6));
//   while (...) friction.step(*model, *data);          // in place of mj_step(model, data)
//
// A patch belongs to a pair of geoms and to a point: MuJoCo lists contacts without names in every step, and
// each takes over the patch of the nearest point of the step before, seen from the smaller of the two geoms.
// Coefficients of friction stay those of the model (mjContact::friction[0]); the shape of the law is that of
// the material.
//
// The model's condim says what a contact resists. 1: nothing; 3: slip, a patch without extent; 4: slip and
// spin, a disc with an even pressure. MuJoCo's torsional coefficient, a length, is the highest torque over
// the normal force. A disc that spins resists with 2/3 mu N R: so R = 3/2 torsional / sliding coefficient.
// Bristles do not resist rolling: condim 6 is refused, or served as 4 if the options say so.
//
// The order of a step: mj_step1; mj_fwdActuation, mj_fwdAcceleration; a clipped predictor finds how each
// contact will slip (one linear solve for all bodies that touch), and PatchBatch::find_force
// how its patch will answer; that goes to qfrc_applied for the time of mj_step2. Then the patches step by
// what the contacts really slipped: they follow the bodies, and nothing drifts. Normal loads are those of the
// step before, of a new contact those of the step without friction.
//
// Not covered: rolling friction, RK4 (mj_step2 has none).
#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include <mujoco/mujoco.h>
#include <Eigen/Core>
#include <bristle/bristle.hpp>
#include <bristle/contact_frame.hpp>

#include "skyline.hpp"

namespace mujoco_example {

/// Motions that the contacts of a model resist: the condim of its geoms and pairs.
struct ContactDims {
  std::vector<int> geom, pair;
};
/// Makes every contact of the model frictionless (condim 1). Coefficients stay where they are. Returns what
/// the condims were.
ContactDims remove_friction(mjModel& model);

struct FrictionOptions {
  /// Of each contact point. The infinite brush has no noise and costs less; a law with SnapRule::keep needs
  /// Population::representatives.
  bristle::PatchOptions patch = bristle::PatchOptions{}
                                    .with_max_normal_load(10.0)
                                    .with_population(bristle::Population::infinite)
                                    .with_resolution(4)
                                    .with_cohorts(24);
  int rings = 1;                   ///< of the discs of condim 4: 4, 12, 27 cells
  bool leave_out_rolling = false;  ///< serve condim 6 as condim 4
  /// m: a contact point that moves farther in one step, as seen from the smaller of its geoms, is a new one.
  double reach = 0.01;
  std::uint32_t contacts = 256;  ///< at once; contacts beyond have no friction
};

class BristleFriction {
 public:
  /// `law`: its kinetic coefficient is replaced by that of each contact, peak over kinetic stays. Throws
  /// bristle::Error, for condim 6 among others.
  BristleFriction(const mjModel& model, const ContactDims& dims, const bristle::Coefficients& law,
                  const FrictionOptions& options = {});

  /// One step of the model's timestep, in place of mj_step. What stands in qfrc_applied counts and is left as
  /// it is.
  void step(const mjModel& model, mjData& data);
  /// The halves of step(), for a program that has a step of its own. First, after mj_fwdAcceleration: the
  /// generalised force of friction in this step, which the caller adds to the others before mj_fwdConstraint.
  /// Repeated calls within a step do no harm.
  const Eigen::VectorXd& find_friction(const mjModel& model, mjData& data);
  /// Second, after the velocities have been advanced: the patches step by what the contacts slipped.
  void end_step(const mjModel& model, const mjData& data);
  /// After mj_resetData, or when bodies were put elsewhere: every contact is new.
  void forget_contacts();

  /// A contact of the last step.
  struct Contact {
    std::uint64_t key = 0;
    bristle::PatchId patch;       ///< of the batch; of a disc that of the extended patches
    bristle::ContactFrame frame;  ///< normal from geom1 to geom2
    Eigen::Vector3d turn[2] = {Eigen::Vector3d::Zero(),
                               Eigen::Vector3d::Zero()};  ///< rad, not yet in `frame`
    Eigen::Vector3d point = {0, 0, 0};                    ///< m, in the world
    /// N along frame.along() and aside(), N m about the normal, on geom2's body
    Eigen::Vector3d force = {0, 0, 0};
    bool is_new = true;                                  ///< not found in the step before
    bool is_disc = false;                                ///< of condim 4
    double radius = 0.0;                                 ///< m, of a disc
    double normal_load = 0.0;                            ///< N, of MuJoCo's solver in this step
    double scale = 1.0;                                  ///< the contact's coefficient over the material's
    Eigen::Vector4d velocity = Eigen::Vector4d::Zero();  ///< m/s along normal and axes, rad/s; predicted
    int bodies[2] = {0, 0};                              ///< of geom1 and geom2
    int row = -1;                                        ///< of its normal force among MuJoCo's constraints
    std::size_t first_cell = 0, cells = 0;
    bristle::ExtendedMotion moved;  ///< of a disc, in this step

   private:
    friend class BristleFriction;
    std::size_t first_dof = 0, dofs = 0;              // of dofs_ and rows_
    Eigen::Vector4d start = Eigen::Vector4d::Zero();  // `velocity` at the beginning of the step
  };
  const std::vector<Contact>& contacts() const { return contacts_; }
  const bristle::KeyedPatches& points() const { return points_; }
  const bristle::KeyedPatches* discs() const {
    return discs_ ? &*discs_ : nullptr;
  }  ///< null: none asked for

 private:
  /// One cell of a patch: a point has one, a disc several.
  struct Cell {
    bristle::Response response;    ///< where the bodies are now
    Eigen::Vector2d at = {0, 0};   ///< m, from the contact point
    Eigen::Vector2d way = {0, 0};  ///< of its force, once it slips in the prediction
    bool slips = false;
  };
  /// Rows of a contact: velocity along its normal and axes, spin; a column for each degree of freedom.
  using Rows = Eigen::Map<Eigen::Matrix<double, 4, Eigen::Dynamic>>;

  void match(const mjModel& model, const mjData& data);
  const Contact* find_before(std::uint64_t key);
  void take_over(const mjModel& model, const mjData& data, const mjContact& found, std::uint64_t key,
                 int dim);
  void carry_frame(const mjModel& model, const mjData& data, const Eigen::Vector3d& normal, Contact& contact);
  int dim_of(const mjModel& model, const mjContact& contact) const;
  void set_rows(const mjModel& model, const mjData& data, const Contact* old, Contact& contact);
  Rows rows_of(const Contact& contact);
  void begin_new_contacts(const mjModel& model, mjData& data);
  void number_dofs(const mjModel& model);
  void solve(const mjModel& model, const mjData& data);
  template <int size>
  void add_contact(const Contact& contact, const Eigen::Matrix4d& gain, const Eigen::Vector4d& pull);
  bool clip(double dt_s);
  void sum_cells(double dt_s, const Contact& contact, Eigen::Matrix3d& gain, Eigen::Vector3d& pull) const;
  void find_forces(double dt_s);
  void set_motions(Contact& contact, const Eigen::Vector3d& moved);
  void turn_disc(const Contact& contact);

  double kinetic_;
  double presliding_length_;  // m
  ContactDims dims_;
  bristle::PatchBatch batch_;
  bristle::KeyedPatches points_;
  bristle::ExtendedPatches patches_;  // of the discs
  std::optional<bristle::KeyedPatches> discs_;
  bristle::ContactMatcher matcher_;
  std::vector<Contact> contacts_, before_;
  std::size_t next_before_ = 0;  // of before_: the one that is likely to come next
  std::vector<std::pair<std::uint64_t, std::size_t>> by_key_;  // places in before_, once somebody asked
  std::vector<Cell> cells_, cells_before_;
  std::vector<const mjContact*> found_;
  std::vector<bristle::ContactPoint> found_points_;
  std::vector<std::uint64_t> keys_;
  std::vector<bristle::Motion> motions_;  // of all cells
  std::vector<bristle::Response> responses_;
  std::vector<bristle::PatchCell> places_;
  std::vector<int> dofs_, dofs_before_;  // of each contact, ascending
  std::vector<double> rows_;             // of each contact, four for each of its dofs_
  std::vector<int> tree_start_;          // by root body, the first of its degrees of freedom
  std::vector<int> trees_, column_;      // touched, in an order that keeps neighbours close; by dof, or -1
  std::vector<std::pair<int, int>> touching_;  // trees, both ways
  bristle_example::Skyline system_;
  Eigen::VectorXd change_;  // of velocity, by column
  Eigen::VectorXd friction_, other_constraints_;
  std::vector<double> applied_;
  bool moved_ = true;  // since the contacts were matched
};

}  // namespace mujoco_example
