// Friction of bristles in MuJoCo: its own contacts keep the normal force and lose friction, a bristle patch
// at each contact point replaces it. An adapter to copy and to change; run with MuJoCo 2.2.2 and
// 3.12.1.
//
//   mjModel* model = mj_loadXML(...);
//   const auto dims = mujoco_example::remove_friction(*model);
//   mujoco_example::BristleFriction friction(*model, dims,
//                                            bristle::Coefficients{}.with_presliding_length(20e-6));
//   while (...) friction.step(*model, *data);          // in place of mj_step(model, data)
//
// A patch belongs to a pair of geoms and to a point. MuJoCo lists contacts without names in every step, and
// each contact takes over the patch of the nearest point of the step before, seen from the smaller of the two
// geoms. Where MuJoCo lists other points of the same surfaces from step to step (meshes, equal boxes),
// patches stay where they are and carry the load of the pair. Coefficients of friction stay those of the
// model (mjContact::friction[0]); the shape of the law is that of the material.
//
// The model's condim says what a contact resists. 1: nothing; 3: slip, a patch without extent; 4: slip and
// spin, a disc with an even pressure. MuJoCo's torsional coefficient, a length, is the highest torque over
// the normal force. A disc that spins resists with 2/3 mu N R: so R = 3/2 torsional / sliding coefficient.
// Bristles do not resist rolling: condim 6 is refused, or served as 4 if the options say so.
// Contacts of round geoms can have beds, through which elastic wheels roll (FrictionOptions::rolling).
//
// The order of a step. After mj_step1, mj_fwdActuation and mj_fwdAcceleration, a clipped predictor finds how
// each contact will slip (one linear solve for all bodies that touch), and PatchBatch::find_force how its
// patch will answer. The answers are among the passive forces in mj_step2. Once the next mj_step1 has placed
// the bodies, patches and beds step by the actual slip of the contacts, taken from poses
// (bristle::SlipByPoses). They follow the bodies, so nothing drifts, even on turning surfaces. Normal loads
// are those of the step before, for a new contact those of the step without friction.
//
// Not covered: rolling friction, RK4 (mj_step2 has none).
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include <mujoco/mujoco.h>
#include <Eigen/Core>
#include <bristle/bristle.hpp>
#include <bristle/contact_frame.hpp>
#include <bristle/keyed_beds.hpp>
#include <bristle/linear_friction.hpp>

#include "rolling_bed.hpp"

namespace mujoco_example {

/// The condim (number that says which motions a contact resists) of each geom and of each listed pair.
struct ContactDims {
  std::vector<int> geom, pair;
};
/// Makes every contact of the model frictionless (condim 1), and keeps the friction coefficients. Returns the
/// condims that the contacts had, by which bristles resist.
ContactDims remove_friction(mjModel& model);

/// Options of the friction. With ContactOptions::rolling each contact whose smaller geom is a sphere,
/// capsule, cylinder or ellipsoid has a bed, which resists slip and spin with condim 3 as well as 4.
struct FrictionOptions : bristle_example::ContactOptions {
  /// Number of rings of cells in a disc (condim 4): 1, 2 or 3 rings have 4, 12 or 27 cells. More are more
  /// exact and take longer.
  int rings = 1;
  /// Writes the velocity of a geom's own surface (a belt) into `velocity`, as MuJoCo 3.11's `surfacevel`:
  /// linear (m/s) and angular (rad/s), in the geom's frame. By default that of the model, if it has any.
  std::function<void(const mjModel& model, int geom, double (&velocity)[6])> surface_velocity;
  bool leave_out_rolling = false;  ///< whether condim 6 is treated as condim 4, not refused
};

class BristleFriction {
 public:
  /// Makes the friction of a model. Each contact replaces the kinetic coefficient of `law` by its own and
  /// keeps its ratio of peak to kinetic. Throws bristle::Error, for condim 2 and 6 and RK4 among others.
  BristleFriction(const mjModel& model, const ContactDims& dims, const bristle::Coefficients& law,
                  const FrictionOptions& options = {});

  /// Makes one step of the model with friction; call it in place of mj_step.
  void step(const mjModel& model, mjData& data);
  /// Computes accelerations, constraint forces and sensors of the present state with friction. Call it in
  /// place of mj_forward, which knows no bristles.
  void forward(const mjModel& model, mjData& data);
  /// Writes the force of contact `id` of data.contact as mj_contactForce does, but with the friction of the
  /// bristles: N along the axes of mjContact::frame, N m about them. Call it after step() or forward().
  void contact_force(const mjModel& model, const mjData& data, int id, mjtNum (&force)[6]) const;
  /// Returns the generalised friction force of this step, for programs that make a step by their own calls
  /// instead of step(). Call it after mj_fwdAcceleration, add the result to the forces before
  /// mj_fwdConstraint, and call end_step() later. Further calls in the same step have no effect.
  const Eigen::VectorXd& find_friction(const mjModel& model, mjData& data);
  /// Records loads and velocities of a step that began with find_friction(). Call it when MuJoCo has advanced
  /// the velocities. The patches step in the next find_friction(), when the bodies are in their new places.
  void end_step(const mjModel& model, const mjData& data);
  /// Adds the friction to force and torque sensors, which MuJoCo has computed without it. For programs that
  /// call find_friction(): step() and forward() do this. Sensors with a delay keep MuJoCo's value.
  void correct_sensors(const mjModel& model, mjData& data) const;
  /// Treats every contact as new, with straight bristles. Call it after mj_resetData or after bodies were
  /// moved by hand.
  void forget_contacts();

  /// State of the friction as bytes: deflections of all bristles, and what belongs to them.
  using State = std::vector<std::byte>;
  /// Returns the present state of the friction. Restored together with MuJoCo's data (mj_copyData), it
  /// repeats a run to the bit.
  State save() const;
  void save(State& to) const;
  /// Restores a state that this object, or another one made with the same arguments, has saved. Throws
  /// bristle::Error for a state that does not fit, also if this object has room for more contacts than the
  /// other had; every contact is then new.
  void restore(const State& state);
  /// Returns the number of contacts for which there was room in the object that saved a state.
  static std::uint32_t capacity_of(const State& state);
  /// Returns the largest size, bytes, that a state saved after end_step() can have with the present room for
  /// contacts.
  std::size_t largest_state() const;

  /// Contact point with friction, in its state after the last step.
  struct Contact {
    std::uint64_t key = 0;
    bristle::PatchId patch;       ///< id of the patch in the batch, or of a disc in the extended patches
    bristle::ContactFrame frame;  ///< contact frame; its normal points from geom1 to geom2
    /// Turn of each body, rad, that `frame` has not yet followed, because it is too small to matter.
    Eigen::Vector3d turn[2] = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
    Eigen::Vector3d point = {0, 0, 0};  ///< position of the contact point in the world, m

    /// Friction force along frame.along() and aside(), N, and torque about the normal, N m, on the body of
    /// geom2.
    Eigen::Vector3d force = {0, 0, 0};
    bool is_new = true;        ///< whether this contact did not exist in the step before
    bool is_listed = true;     ///< whether MuJoCo lists the contact; if not, the pair touches at other points
    bool is_asleep = false;    ///< whether the bodies sleep (MuJoCo 3), so that the contact keeps its state
    bool is_disc = false;      ///< whether the contact resists spin (condim 4)
    double radius = 0.0;       ///< radius of the contact, if it is a disc, m
    double normal_load = 0.0;  ///< normal load from MuJoCo's solver in this step, N

    /// Friction coefficient of the contact over that of the material; the forces of the patch are multiplied
    /// by it.
    double scale = 1.0;
    /// Predicted slip velocity: m/s along the normal and the two axes, rad/s about the normal.
    Eigen::Vector4d velocity = Eigen::Vector4d::Zero();
    int bodies[2] = {0, 0};  ///< ids of the bodies of geom1 and geom2

    /// Index of the contact's normal force among MuJoCo's constraint forces; -1 for a contact that MuJoCo
    /// does not list.
    int row = -1;
    std::size_t first_cell = 0, cells = 0;
    bristle::ExtendedMotion moved;  ///< displacement and turn of a disc contact in this step
    bristle::BedId bed;             ///< bed of a round geom's contact, which then has no patch

   private:
    friend class BristleFriction;
    int geoms[2] = {0, 0};  // the geom that may roll, or the smaller one; the other one
    bristle::SlipByPoses slip;
    std::uint64_t pair = 0;
    Eigen::Vector3d position =
        Eigen::Vector3d::Zero();  // point from the smaller geom's centre, in its axes, m
    // Velocity of the surfaces against each other beyond that of the bodies (belts), in the axes of
    // `velocity`.
    Eigen::Vector4d surface = Eigen::Vector4d::Zero();
    int surfaces = -1;       // index in surfaces_ if MuJoCo lists other points of the pair than before
    int joined = -1;         // index of the contact whose patch carries the load of this one, or below 0
    double on_points = 0.0;  // load of this step on the contact's points, N
    Eigen::Vector3d moved_by_velocity = Eigen::Vector3d::Zero();  // slip (m) and spin (rad) of the last step
    // Slip of the last step over its time, less the slip velocity, m/s. The difference repeats in this step:
    // bodies that turn move along arcs, while MuJoCo moves them along tangents.
    Eigen::Vector2d arc = Eigen::Vector2d::Zero();
    // Linear model of the bed's force at a velocity v of slip and spin: steady - slope v.
    Eigen::Vector3d steady = Eigen::Vector3d::Zero();
    Eigen::Matrix3d slope = Eigen::Matrix3d::Zero();
    // Index of the contact's first entry in dofs_ and levers_, and number of its entries; 0 if they are not
    // known yet.
    std::size_t first_dof = 0, dofs = 0;
    // Slip velocity at the start of the step, in the axes of `velocity`.
    Eigen::Vector4d start = Eigen::Vector4d::Zero();
  };
  const std::vector<Contact>& contacts() const { return contacts_; }
  const bristle::KeyedPatches& points() const { return points_; }
  const bristle::KeyedPatches* discs() const {
    return discs_ ? &*discs_ : nullptr;
  }  ///< patches of the contacts that are discs; null if no contact may spin

 private:
  /// Cell of a contact's patch. A point contact has one cell, a disc several.
  struct Cell {
    bristle::Response response;     ///< response of the cell's bristles to no slip, at the step's start
    Eigen::Vector2d at = {0, 0};    ///< offset of the cell from the contact point, m
    bristle::LinearFriction model;  ///< model of the cell in the linear solve
  };
  /// Transposed Jacobian of a contact: its velocity along the normal and both axes and its spin, per unit
  /// velocity of each degree of freedom, which has a line.
  using Levers = Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, 4>>;

  void prepare(const mjModel& model, mjData& data);
  Eigen::Vector4d surface_velocity(const mjModel& model, const mjData& data, const Contact& contact) const;
  void match(const mjModel& model, const mjData& data);
  void list(const mjModel& model, const mjData& data, const mjContact& found);
  void list_asleep(const mjModel& model, const mjData& data);
  void keep_asleep(std::uint64_t key);
  void reserve(std::size_t contacts);
  void add_cells(const Contact* old, Contact& contact);
  template <class AnyContact, class Visit>
  static void visit_fields(AnyContact& contact, Visit& visit);
  /// Visits the batches, pools and the matcher, whose states are parts of the saved state, in its order.
  template <class AnyFriction, class Visit>
  static void visit_parts(AnyFriction& of, Visit&& visit);
  void read(const State& state);
  void add_wrenches(const mjModel& model, mjData& data) const;
  const bristle::BodyPose& pose_of(const mjModel& model, const mjData& data, const Contact& contact,
                                   int side);
  const Contact* find_before(std::uint64_t key);
  void take_over(const mjModel& model, const mjData& data, const mjContact& found, std::uint64_t key,
                 const Eigen::Vector3d* held_at);
  void join(const mjModel& model, const mjData& data, const mjContact& found, std::uint64_t key);
  void hold(const mjModel& model, const mjData& data, const bristle::HeldContact& held);
  void find_surfaces();
  void share_loads(const mjData& data);
  void carry_frame(const mjModel& model, const mjData& data, const Eigen::Vector3d& normal, Contact& contact);
  int dim_of(const mjModel& model, const mjContact& contact) const;
  void set_levers(const mjModel& model, const mjData& data, const Contact* old, Contact& contact);
  Levers levers_of(const Contact& contact);
  void begin_new_contacts(const mjModel& model, mjData& data);
  void number_dofs(const mjModel& model);
  void solve(const mjModel& model, const mjData& data);
  template <int forces, class Gain, class Pull>
  void add(const Contact& contact, const Gain& gain, const Pull& pull);
  bool release_cells();
  bristle::BedMotion bed_motion(const mjModel& model, const mjData& data, const Contact& contact,
                                const Eigen::Vector3d& moved) const;
  void guess_beds(const mjModel& model, const mjData& data);
  void sum_cells(const Contact& contact, Eigen::Matrix3d& gain, Eigen::Vector3d& pull) const;
  void find_forces(const mjModel& model, const mjData& data);
  void step_patches(const mjModel& model, const mjData& data);
  Eigen::Vector3d moved_by_poses(const mjModel& model, const mjData& data, Contact& contact);
  void set_motions(Contact& contact, const Eigen::Vector3d& moved);
  void turn_disc(const Contact& contact);

  double kinetic_;
  double presliding_length_;  // m
  ContactDims dims_;
  bristle::PatchBatch batch_;
  bristle::KeyedPatches points_;
  bristle::ExtendedPatches patches_;  // extended patches of the contacts that are discs
  std::optional<bristle::KeyedPatches> discs_;
  bristle::BedBatch bed_batch_;
  std::optional<bristle::KeyedBeds> beds_;
  double bed_friction_ = 1.0;  // kinetic coefficient of the beds' material
  bristle::ContactMatcher matcher_;
  std::vector<Contact> contacts_, before_;
  std::size_t next_before_ = 0;  // index in before_ at which the next contact is probably found

  // Poses of the two geoms of the contact that was asked for last. The next contact mostly has the same
  // geoms.
  std::pair<int, bristle::BodyPose> near_[2] = {{-1, {}}, {-1, {}}};

  // Keys of the contacts in before_ with their indices, sorted by key. Filled only if contacts come in
  // another order than in the step before.
  std::vector<std::pair<std::uint64_t, std::size_t>> by_key_;
  std::vector<Cell> cells_, cells_before_;
  std::vector<const mjContact*> found_;
  std::vector<bristle::ContactPoint> found_points_;
  std::vector<double> found_normals_;
  std::vector<std::uint64_t> keys_;
  bristle::SurfaceLoads surfaces_;        // pairs of surfaces whose listed points have changed
  std::vector<bristle::Motion> motions_;  // motions of all cells, as the batch gets them
  std::vector<bristle::Response> responses_;
  std::vector<bristle::BedMotion> bed_motions_;
  std::vector<bristle::BedResponse> bed_responses_;
  std::vector<bristle::PatchCell> positions_;
  std::vector<int> dofs_, dofs_before_;  // degrees of freedom of each contact, ascending
  std::vector<double> levers_;           // transposed Jacobians, four values for each entry of dofs_
  std::vector<int> tree_start_;          // first degree of freedom of each kinematic tree
  // Order of the unknowns. `trees_`: kinematic trees in contact, in the order of their columns in the matrix.
  // `column_`: for each degree of freedom its column, -1 if its tree touches nothing.
  std::vector<int> trees_, column_;
  std::vector<std::pair<int, int>> touching_;  // pairs of trees in contact, in both orders
  std::vector<int> columns_;                   // matrix column of each entry of dofs_
  bristle::BodySystem system_;
  Eigen::VectorXd friction_, other_constraints_;
  std::function<void(const mjModel&, int, double (&)[6])> surface_velocity_;
  bool moved_ = true;     // whether bodies have moved since contacts were matched with patches
  bool slipped_ = false;  // whether patches have yet to step by the slip of the last step
};

/// Makes `steps` steps of many data of one model with friction, shared among threads. Before each step calls
/// `drive` (if given) with the index of the data. Each data has a friction object of its own, so results do
/// not depend on the number of threads.
void roll_out(const mjModel& model, const std::vector<mjData*>& data,
              const std::vector<BristleFriction*>& frictions, int steps, int threads,
              const std::function<void(std::size_t, const mjModel&, mjData&)>& drive = {});

}  // namespace mujoco_example
