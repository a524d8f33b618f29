// Beds: elastic bodies in contact, which slip from the rim, pivot and roll.
//
// Every bristle of a contact patch (patch.hpp) is as stiff per newton as every other, so a patch slips
// everywhere at once. Under an elastic body stiffness follows the area and the limit of friction follows the
// pressure: the rim slips first. A bed is a list of bristles at positions, each with a stiffness and a limit
// of its own, which slide at that limit (they do not snap). A bed answers displacement, spin and rolling with
// force and torque.
//
//   bristle::BedBatch beds;
//   const auto tip = beds.add(bristle::BedMaterial(0.8).with_presliding(1e-3),
//                             bristle::BedShape::disc(8e-3, bristle::BedPressure::hertz), {10.0});
//   beds.step({&motion, 1}, {&response, 1});
//
// The axes of a bed are those of the contact; x is the direction in which a wheel rolls. Not modelled: the
// half-space itself (a load at one point deforms no other point), lubrication, temperature, plasticity.
// Equations and error bounds: core/beds/BEDS.md.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "bristle/export.hpp"
#include "bristle/patch.hpp"
#include "bristle/patch_batch.hpp"
#include "bristle/set_field.hpp"
#include "bristle/span.hpp"

namespace bristle {

/// Names a bed of one batch, as PatchId names a patch. 0 = none.
struct BedId {
  std::uint64_t value = 0;
  /// Id that a full pool (KeyedBeds) gives a new contact. A motion with it gets Status::no_capacity and no
  /// force.
  static constexpr BedId no_capacity() noexcept { return {PatchId::no_capacity().value}; }
  explicit operator bool() const noexcept { return value != 0 && value != no_capacity().value; }
  friend bool operator==(BedId a, BedId b) noexcept { return a.value == b.value; }
  friend bool operator!=(BedId a, BedId b) noexcept { return a.value != b.value; }
};

/// Distribution of the pressure over the contact. The letter r is 0 at the centre and 1 on the edge; on a row
/// and a rectangle it is x over the half length.
enum class BedPressure : unsigned char {
  uniform,
  parabolic,  ///< 1 - r^2: a tyre; the traction bound of Kalker's simplified theory
  hertz       ///< (1 - r^2)^1/2: smooth elastic bodies
};

/// Growth of the contact's size with the load. A shape's size is the one at the load
/// BedOptions::max_normal_load.
enum class BedGrowth : unsigned char {
  fixed,       ///< size does not depend on the load
  cube_root,   ///< both half widths grow: spheres and ellipses (Hertz)
  square_root  ///< the half length along x grows: cylinders (Hertz), tyres
};

/// A bristle of BedShape::list.
struct BedCell {
  double position[2] = {0.0, 0.0};  ///< position of the bristle from the centre, m, 0 to 1e3 in magnitude
  /// Stiffness relative to the other bristles, > 0: usually the area that it stands for.
  double stiffness = 1.0;
  double load = 1.0;  ///< share of the normal load, relative to the other bristles, >= 0
};

/// Outline, pressure and grid of a bed: what BedBatch::add takes. Make one by a factory; add checks it.
struct BedShape {
  enum class Kind : unsigned char { row, ellipse, rectangle, list };
  Kind kind = Kind::row;
  BedPressure pressure = BedPressure::parabolic;
  BedGrowth growth = BedGrowth::fixed;
  bool rolls = false;  ///< whether the bed rolls: its surface moves through the contact
  /// Half widths along x and y at full load, m; 0 = calculated from the material's radius.
  double half[2] = {0.0, 0.0};
  /// Numbers of bristles: along x, and of rows. For an ellipse that does not roll: of rings, and of cells in
  /// each ring.
  int cells[2] = {0, 0};
  std::vector<BedCell> list;  ///< bristles of a shape of Kind::list

  /// Makes a sphere on a plane, or two spheres, by dimensional reduction (Popov and Hess 2015): exact for
  /// Cattaneo's and Mindlin's contact under any history of load. A row resists no spin and does not roll.
  /// `cells`: 2 to 65536; the error of the force falls with their square: test_beds.
  static BedShape sphere_row(int cells = 32, double radius_of_contact_m = 0.0) {
    BedShape shape;
    shape.growth = BedGrowth::cube_root;
    shape.half[0] = radius_of_contact_m;
    shape.cells[0] = cells;
    shape.cells[1] = 1;
    return shape;
  }
  /// Makes one row of bristles through which a wheel or a roller rolls along x.
  static BedShape wheel_row(double half_length_m, BedPressure pressure = BedPressure::parabolic,
                            int cells = 32) {
    BedShape shape = rectangle(half_length_m, 0.0, pressure, cells, 1);
    shape.kind = Kind::row;
    shape.rolls = true;
    return shape;
  }
  /// Makes a cylinder that lies along y and rolls along x, under Hertz's pressure. The half width grows with
  /// the root of the load.
  static BedShape cylinder_row(double half_length_m, int cells = 32) {
    return wheel_row(half_length_m, BedPressure::hertz, cells).grown(BedGrowth::square_root);
  }
  /// Makes a disc or ellipse that slides, spins and does not roll. `rings` of `around` cells each (0 = three
  /// times the rings). Half widths of 0 take Hertz's from the material's radius.
  static BedShape ellipse(double half_x_m, double half_y_m, BedPressure pressure, int rings = 7,
                          int around = 0) {
    BedShape shape;
    shape.kind = Kind::ellipse;
    shape.pressure = pressure;
    shape.half[0] = half_x_m;
    shape.half[1] = half_y_m;
    shape.cells[0] = rings;
    shape.cells[1] = around == 0 ? 3 * rings : around;
    return shape;
  }
  static BedShape disc(double radius_m, BedPressure pressure, int rings = 7, int around = 0) {
    return ellipse(radius_m, radius_m, pressure, rings, around);
  }
  /// Makes a rectangle that slides and spins; .rolling() lets it roll along x. `nx` cells in each of `ny`
  /// rows.
  static BedShape rectangle(double half_x_m, double half_y_m, BedPressure pressure, int nx = 16, int ny = 8) {
    BedShape shape;
    shape.kind = Kind::rectangle;
    shape.pressure = pressure;
    shape.half[0] = half_x_m;
    shape.half[1] = half_y_m;
    shape.cells[0] = nx;
    shape.cells[1] = ny;
    return shape;
  }
  /// Makes a bed of bristles at given positions. Their shares of the load are the same under every load.
  static BedShape from_list(std::vector<BedCell> cells) {
    BedShape shape;
    shape.kind = Kind::list;
    shape.pressure = BedPressure::uniform;
    shape.list = std::move(cells);
    return shape;
  }
  /// Makes a bed of any outline from an nx by ny grid over the given box. A cell becomes a bristle where
  /// `pressure` (relative, at x and y in m) is above 0; a cell at the edge counts by the share of its 4 x 4
  /// samples that lie inside. Throws bristle::Error if `pressure` is above 0 nowhere.
  BRISTLE_API static BedShape from_pressure(double half_x_m, double half_y_m, int nx, int ny,
                                            const std::function<double(double, double)>& pressure);

  /// Makes the bed roll: the bristles of an ellipse or a rectangle are laid out in `rows` of `along` cells,
  /// so that they can move through the contact. A disc rolls in any direction, other shapes along x only.
  BedShape& rolling(int along, int rows) {
    rolls = true;
    cells[0] = along;
    cells[1] = rows;
    return *this;
  }
  BedShape& grown(BedGrowth law) {
    growth = law;
    return *this;
  }
};

/// Friction and elasticity of a bed. Exactly one of the elasticities must be given.
struct BedMaterial {
  /// Coefficient of static friction; > 0, at most 100, not below kinetic_friction.
  double static_friction = 0.0;
  /// Coefficient of kinetic friction, > 0. A bristle that has begun to slide keeps to this limit, if static
  /// friction is higher, until it has stuck for a step or the motion reverses.
  double kinetic_friction = 0.0;

  /// @name Elastic bodies under the bristles. Only sphere_row and disc accept them.
  ///@{
  double normal_modulus = 0.0;  ///< combined modulus E*, Pa: 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2
  double shear_modulus = 0.0;   ///< combined modulus G*, Pa: 1/G* = (2 - nu1)/(4 G1) + (2 - nu2)/(4 G2)
  double radius = 0.0;  ///< combined radius R, m: 1/R = 1/R1 + 1/R2; 0 where the shape states its size
  ///@}

  /// Kalker's flexibilities L1, L2, L3 (deformation per traction along x, along y and in spin) at full load,
  /// m^3/N.
  double flexibility[3] = {0.0, 0.0, 0.0};
  /// Stiffness for rolling shapes, given as force per unit slip, N, along x and y at full load.
  double slip_stiffness[2] = {0.0, 0.0};
  double presliding = 0.0;  ///< the displacement at which every bristle slides, under full load, m

  BedMaterial() = default;
  explicit BedMaterial(double friction) : static_friction(friction), kinetic_friction(friction) {}
  BedMaterial(double static_mu, double kinetic_mu)
      : static_friction(static_mu), kinetic_friction(kinetic_mu) {}

  /// Sets one elastic body of shear modulus G and Poisson's ratio nu (0 to 0.5) on a rigid one.
  BedMaterial& with_elastic(double shear_modulus_pa, double poisson, double radius_m = 0.0) {
    normal_modulus = 2.0 * shear_modulus_pa / (1.0 - poisson);
    shear_modulus = 4.0 * shear_modulus_pa / (2.0 - poisson);
    radius = radius_m;
    return *this;
  }
  /// Sets two elastic bodies of equal shear modulus and Poisson's ratio.
  BedMaterial& with_elastic_pair(double shear_modulus_pa, double poisson, double radius_m = 0.0) {
    with_elastic(0.5 * shear_modulus_pa, poisson, radius_m);
    return *this;
  }
  BedMaterial& with_flexibility(double x, double y, double spin) {
    flexibility[0] = x;
    flexibility[1] = y;
    flexibility[2] = spin;
    return *this;
  }
  BedMaterial& with_slip_stiffness(double x, double y) {
    slip_stiffness[0] = x;
    slip_stiffness[1] = y;
    return *this;
  }
  BedMaterial& with_presliding(double metres) { return detail::set(*this, presliding, metres); }
};

struct BedOptions {
  /// Full load, N, > 0: the load at which the shape has its given size. Above it the friction limits still
  /// grow with the load and the size does not.
  double max_normal_load = 1.0;

  /// Whether a step computes all fields of BedResponse. If not, it computes `status`, `force` and `torque`,
  /// and the other fields are 0.
  bool all_outputs = true;
  /// Longest piece of a rolling step, in lengths of the contact, 1e-3 to 10. A longer step is divided into
  /// pieces if the bed spins or all outputs are asked for.
  double longest_piece = 0.0625;
};

/// Input of one bed for one step. Status::bad_input is set by NaN, infinity, a magnitude above 1e5 m or 3.2
/// rad, a negative load or one above 1e15 N, and rolling that the bed cannot do.
struct BedMotion {
  BedId id;
  /// Displacement of the moving body's surface against the other, where they touch, m. A wheel of radius r
  /// that rolls over the ground by x and turns by w has x - w r.
  double displacement[2] = {0.0, 0.0};
  double spin = 0.0;  ///< turn of the moving body against the surface about the normal, rad

  /// Distance, m, by which the bristles' surface has moved through the contact, positive where the contact
  /// moves to greater x or y on that surface. For a wheel it is radius times turn, so 0 while the wheel is
  /// locked. Bristles that leave the contact are lost, new ones enter straight.
  double rolled[2] = {0.0, 0.0};
  double normal_load = 0.0;  ///< load on the bed, N
};

/// Output of one bed for one step. Forces act ON the moving body.
struct BedResponse {
  BedId id;
  Status status = Status::ok;
  std::uint32_t reserved = 0;    ///< padding with a value, so that responses may be compared by memcmp
  double force[2] = {0.0, 0.0};  ///< force at the end of the step, N
  double torque = 0.0;           ///< torque about the centre, at the end of the step, N m
  /// Force averaged over the step, N. The energy put in is -(mean . displacement + mean_torque spin): exact
  /// for a bed that neither rolls nor is stiffer along one axis, otherwise as good as the mean
  /// (core/beds/BEDS.md).
  double mean[2] = {0.0, 0.0};
  double mean_torque = 0.0;  ///< torque averaged over the step, N m
  double dissipated = 0.0;   ///< energy that was put in during the step and not stored, J
  double stored = 0.0;       ///< elastic energy at the end of the step, J
  /// Derivative of force and torque by the displacement (N/m, N, N m) for implicit solvers: force(d + e) ~
  /// force(d) - tangent e. Only bristles that stick contribute.
  double tangent[3][3] = {};
  double slipping_share = 0.0;  ///< share of the contact that slips, by stiffness, 0 to 1
};

struct BedInfo {
  std::uint32_t bristles = 0;
  double half[2] = {0.0, 0.0};      ///< half widths under the last load, m
  double normal_load = 0.0;         ///< load of the last step, N
  double stiffness = 0.0;           ///< stiffness along x, N/m, the sum over all bristles at full load
  double longest_deflection = 0.0;  ///< largest deflection at which a bristle slides at full load, m
  std::uint64_t memory_bytes = 0;
};

/// State of one bristle of a bed, for pictures. Position in m, deflection and limit in m, stiffness in N/m.
struct BedBristle {
  double position[2] = {0.0, 0.0};
  double deflection[2] = {0.0, 0.0};
  double stiffness = 0.0;
  double limit = 0.0;
};

/// Beds, stepped together. A bed's bits do not depend on the number of threads, the instruction set, or the
/// other beds of the batch.
///
/// Thread rule: one side (PatchBatch). Nothing allocates but the constructor, add, remove and
/// restore_state. A step never throws or locks, and waits for its own workers only.
class BRISTLE_API BedBatch {
 public:
  /// Makes an empty batch. The options (threads, instruction set) are those of PatchBatch. Throws
  /// bristle::Error.
  explicit BedBatch(const BatchOptions& options = {});
  ~BedBatch();
  BedBatch(BedBatch&&) noexcept;
  BedBatch& operator=(BedBatch&&) noexcept;

  /// Adds a bed, out of contact. Throws bristle::Error for values out of range, and unless the material gives
  /// exactly one elasticity and the shape takes it.
  BedId add(const BedMaterial& material, const BedShape& shape, const BedOptions& options = {});
  void remove(BedId id);  ///< throws bristle::Error if there is no such bed

  /// Steps the beds that `in` names; others rest. out[i] is the response to in[i]. `out` must be as long as
  /// `in`, otherwise every status is Status::bad_input.
  StepReport step(Span<const BedMotion> in, Span<BedResponse> out) noexcept;
  /// Returns the response that step would give, without changing any bed. For implicit solvers.
  BedResponse find_force(const BedMotion& motion) noexcept;
  /// Returns a bed to its state after add: out of contact, all bristles straight. Returns false if there is
  /// no such bed.
  bool reset(BedId id) noexcept;

  /// Returns size, load and stiffness of a bed, and the largest deflection at which one of its bristles
  /// slides; zeros for an unknown id.
  BedInfo info(BedId id) const noexcept;

  /// Writes position and deflection of the bristles of a bed, for pictures, as many as fit. Returns the
  /// number written.
  std::size_t read_bristles(BedId id, Span<BedBristle> out) const noexcept;
  std::uint64_t state_hash(BedId id) const noexcept;  ///< state hash of one bed, 0 for an unknown id
  std::uint64_t state_hash() const noexcept;          ///< hash of all beds in the order of their slots

  std::size_t state_size() const noexcept;
  /// Writes the state of all beds. Returns the bytes written, 0 if `to` is too small.
  std::size_t save_state(Span<std::byte> to) const noexcept;
  /// Restores a saved state into a batch with the same beds, added in the same order. Materials are not
  /// compared. If the state does not fit or is damaged, throws bristle::Error and leaves the beds unchanged.
  void restore_state(Span<const std::byte> from);

  std::size_t bed_count() const noexcept;
  int threads() const noexcept;
  const char* isa() const noexcept;

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace bristle
