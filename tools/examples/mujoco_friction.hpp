// Friction of bristles in MuJoCo: its own contacts keep the normal force and lose friction, a bristle patch
// at each contact point takes its place. An adapter to copy and to change; MuJoCo 2.2.
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
// contact will slip (one linear solve for each group of bodies that touch), and PatchBatch::find_force how
// its patch will answer; that goes to qfrc_applied for the time of mj_step2. Then the patches step by what
// the contacts really slipped: they follow the bodies, and nothing drifts. Normal loads are those of the step
// before, of a new contact those of the step without friction.
//
// Not covered: rolling friction, RK4 (mj_step2 has none).
#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include <mujoco/mujoco.h>
#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <bristle/bristle.hpp>
#include <bristle/contact_frame.hpp>

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
    bool is_new = true;                    ///< not found in the step before
    double radius = 0.0;                   ///< m, of a disc
    double normal_load = 0.0;              ///< N, of MuJoCo's solver in this step
    double scale = 1.0;                    ///< the contact's coefficient over the material's
    Eigen::Vector3d slip = {0, 0, 0};      ///< m/s, m/s, rad/s, predicted
    int bodies[2] = {0, 0};                ///< of geom1 and geom2
    int row = -1;                          ///< of its normal force among MuJoCo's constraints
    Eigen::Index first_row = 0, rows = 2;  ///< of its island's Jacobian: slip, and spin if it is a disc
    std::size_t first_cell = 0, cells = 0;
    bristle::ExtendedMotion moved;  ///< of a disc, in this step
  };
  const std::vector<Contact>& contacts() const { return contacts_; }
  const bristle::KeyedPatches& points() const { return points_; }
  const bristle::KeyedPatches* discs() const {
    return discs_ ? &*discs_ : nullptr;
  }  ///< null: none asked for

 private:
  /// One cell of a patch: a point has one, a disc several.
  struct Cell {
    bristle::Response response;          ///< where the bodies are now
    Eigen::Vector2d at = {0, 0};         ///< m, from the contact point
    double stiffness = 0.0, gain = 0.0;  ///< in the prediction: N/m; N s/m with the damper's
    Eigen::Vector2d elastic = {0, 0};    ///< N, likewise
  };

  using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  /// Bodies that touch, directly or over others: what moves them, and their contacts. The equations of one
  /// island know nothing of the others, so each is solved by itself.
  struct Island {
    std::vector<int> dofs;                // of the model, ascending
    std::vector<std::size_t> contacts;    // places in contacts_
    std::size_t cells = 0;                // of these
    RowMatrix jacobian, normal_jacobian;  // 2 or 3 rows a contact, and 1; a column for each of `dofs`
    Eigen::VectorXd velocity;             // of `dofs`
  };

  void match(const mjModel& model, const mjData& data);
  const Contact* find_before(std::uint64_t key);
  void take_over(const mjModel& model, const mjData& data, const mjContact& found, std::uint64_t key,
                 int dim);
  static void carry_frame(const mjModel& model, const mjData& data, const Eigen::Vector3d& normal, bool disc,
                          Contact& contact);
  int dim_of(const mjModel& model, const mjContact& contact) const;
  void find_islands(const mjModel& model);
  int top_of(int tree);
  void set_jacobian(const mjModel& model, const mjData& data, Island& island);
  void add_body(const mjModel& model, const mjData& data, const Contact& contact, int body, double sign,
                Eigen::Index normal_row, Island& island);
  void begin_new_contacts(const mjModel& model, mjData& data);
  void set_equation(const mjModel& model, const mjData& data, const Island& island);
  void predict(double dt_s, const Island& island);
  template <int size>
  void solve(double dt_s, const RowMatrix& jacobian);
  void begin_prediction(double dt_s, const Island& island);
  void sum_cells(const Contact& contact, const Island& island);
  bool clip(double dt_s, const Island& island);
  void find_forces(double dt_s);
  void apply_forces(mjData& data);
  void move_patches(const mjModel& model, const mjData& data);
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
  std::vector<Island> islands_;  // the first island_count_ are in use
  std::size_t island_count_ = 0;
  std::vector<int> tree_, island_of_;  // by body: what it hangs on; its island, or -1
  std::vector<int> column_;            // by degree of freedom: its column in its island
  RowMatrix fixed_;                    // of an island, without patches: lower triangle
  RowMatrix gain_;                     // of every contact, times its rows of the Jacobian
  Eigen::VectorXd fixed_right_, right_, slip_, start_slip_, pull_, other_constraints_;
  std::vector<double> applied_;
};

}  // namespace mujoco_example
