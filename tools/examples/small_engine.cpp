// A small engine to read: boxes on a plane, sequential impulses (PGS), and friction by Coulomb's clamp or by
// a patch of bristles at each corner. What bristles need is marked "bristles:". A box is tapped on a slope,
// another is thrown: exits with 1 when a box on bristles creeps, stops at a wrong place or loses count of its
// energy. Boxes that rest on boxes need more: the warm start of core/guides/GUIDE_ENGINES.md.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <vector>

#include <Eigen/Dense>

#include <bristle/bristle.hpp>
#include <bristle/contact_frame.hpp>
#include <bristle/linear_friction.hpp>

namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double mu = 0.5, g = 9.81;
const auto law = bristle::Coefficients{}.with_kinetic(mu).with_peak(1.1 * mu).with_presliding_length(2e-5);
const Vector3d up = Vector3d::UnitZ();  // normal of the plane z = 0; a slope tilts gravity

struct Box {
  double mass;        // kg
  Vector3d half;      // half edges, m
  Vector3d position;  // m
  Vector3d velocity{0, 0, 0}, spin{0, 0, 0};
  Vector3d push{0, 0, 0};  // applied at the centre of the box, N
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();

  Matrix3d inertia() const {
    const Vector3d squares = half.cwiseProduct(half);
    const Matrix3d axes = turn.toRotationMatrix();
    return axes * Vector3d(mass / 3.0 * (Vector3d::Constant(squares.sum()) - squares)).asDiagonal() *
           axes.transpose();
  }
  void add(const Vector3d& impulse, const Vector3d& arm) {
    velocity += impulse / mass;
    spin += inverse_inertia * arm.cross(impulse);
  }
  Vector3d velocity_at(const Vector3d& arm) const { return velocity + spin.cross(arm); }
  /// Returns velocity along `a` at `arm` (m from the centre), per unit impulse along `b` there, 1/kg.
  double mobility(const Vector3d& arm, const Vector3d& a, const Vector3d& b) const {
    return a.dot(b) / mass + arm.cross(a).dot(inverse_inertia * arm.cross(b));
  }
  Matrix3d inverse_inertia = Matrix3d::Zero();  // in the world's axes, for this step, 1/(kg m^2)
};

/// Corner of a box that touches the plane.
struct Contact {
  std::uint64_t key = 0;  // number made of box and corner, the same in every step
  std::size_t box = 0;
  Vector3d corner{0, 0, 0};     // corner from the box's centre, in the box's axes, m
  Vector3d arm{0, 0, 0};        // as `corner`, in the world's axes
  Vector3d place{0, 0, 0};      // corner in the world at the begin of the step, m
  double gap = 0.0;             // m, height over the plane; negative inside it
  double normal_impulse = 0.0;  // normal impulse, N s; starts at that of the step before
  Vector2d impulse{0, 0};       // N s, friction impulse along frame.along() and aside()
  bristle::ContactFrame frame;
  Matrix2d mobility = Matrix2d::Zero();  // velocity change per unit impulse in the plane, 1/kg

  // bristles: the patch of the corner, a linear model of its force for PGS, and its elastic force without
  // slip under the load of the model, N.
  bristle::PatchId patch;
  double load = 0.0;  // normal load in the step before, N
  bristle::LinearFriction model;
  Vector2d elastic{0, 0};
};

enum class Friction { coulomb, bristles };

class World {
 public:
  World(Friction kind, double slope_rad, const Box& box)
      : boxes{box},
        gravity_(g * std::sin(slope_rad), 0.0, -g * std::cos(slope_rad)),
        kind_(kind),
        // bristles: one batch, and a pool that gives each key (box and corner) its patch. All memory is
        // allocated here.
        patches_(batch_, bristle::Material::from_coefficients(law),
                 bristle::PatchOptions{}
                     .with_max_normal_load(highest_load)
                     .with_outputs(bristle::Outputs::end | bristle::Outputs::energy),
                 bristle::KeyedOptions{}.with_capacity(64)) {
    batch_.warm_up();
  }

  void step(double h) {
    for (Box& box : boxes) {
      box.inverse_inertia = box.inertia().inverse();
      box.velocity += h * (gravity_ + box.push / box.mass);
    }
    find_contacts(h);
    // Starts the iterations with the impulses of the step before (warm start).
    for (const Contact& c : contacts) push(c, c.normal_impulse, c.impulse);
    for (int i = 0; i < iterations; ++i) {
      for (Contact& c : contacts) solve_normal(c, h);
      // bristles: in the later half of the iterations forces come from the patches themselves.
      if (kind_ == Friction::bristles && i >= iterations / 2 && i % 2 == 0)
        for (Contact& c : contacts) ask(c, h);
      for (int sweep = 0; sweep < sweeps; ++sweep)
        for (Contact& c : contacts) kind_ == Friction::coulomb ? clamp(c) : rub(c, h);
    }
    for (Box& box : boxes) {
      box.position += h * box.velocity;
      const Vector3d turned = h * box.spin;
      box.turn = Eigen::Quaterniond(Eigen::AngleAxisd(turned.norm(), turned.stableNormalized())) * box.turn;
      box.turn.normalize();
    }
    if (kind_ == Friction::bristles) step_patches(h);
  }

  /// Returns the energy, J: kinetic, of height above the plane's origin, and of bent bristles.
  double energy() const {
    double sum = 0.0;
    for (const Box& b : boxes)
      sum += 0.5 * (b.mass * b.velocity.squaredNorm() + b.spin.dot(b.inertia() * b.spin)) -
             b.mass * gravity_.dot(b.position);
    for (const Contact& c : contacts) sum += batch_.stored_energy(c.patch);
    return sum;
  }

  std::vector<Box> boxes;
  std::vector<Contact> contacts;
  double lost = 0.0;  // energy lost to friction of bristles, J

 private:
  static constexpr int iterations = 20, sweeps = 2;
  static constexpr double highest_load = 50.0;  // highest load of one corner, N

  /// Lists the corners near the plane. Each keeps its impulses and patch of the step
  /// before.
  void find_contacts(double h) {
    std::vector<Contact> before;
    before.swap(contacts);
    for (std::size_t b = 0; b < boxes.size(); ++b) {
      const Box& box = boxes[b];
      for (unsigned corner = 0; corner < 8; ++corner) {
        const Vector3d sign(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1),
            at = sign.cwiseProduct(box.half), arm = box.turn * at;
        const double gap = up.dot(box.position + arm);
        if (gap > 0.005) continue;
        Contact c;
        c.frame = bristle::ContactFrame(up);
        c.key = 8 * b + corner;
        for (const Contact& old : before)
          if (old.key == c.key) c = old;
        c.box = b;
        c.corner = at;
        c.arm = arm;
        c.place = box.position + arm;
        c.gap = gap;
        // Turns the axes of a contact with the mean rotation of box and plane.
        c.frame.carry(up, h * box.spin, Vector3d::Zero());
        const Vector3d axes[2] = {c.frame.along(), c.frame.aside()};
        for (int i = 0; i < 2; ++i)
          for (int k = 0; k < 2; ++k) c.mobility(i, k) = box.mobility(arm, axes[i], axes[k]);
        if (kind_ == Friction::bristles) begin(c, h);
        contacts.push_back(c);
      }
    }
    patches_.end_step();  // bristles: returns the patches of corners that do not touch to the pool
  }

  void push(const Contact& c, double normal, const Vector2d& friction) {
    boxes[c.box].add(normal * up + friction[0] * c.frame.along() + friction[1] * c.frame.aside(), c.arm);
  }
  Vector2d slip(const Contact& c) const {
    const Vector3d v = boxes[c.box].velocity_at(c.arm);
    return {c.frame.along().dot(v), c.frame.aside().dot(v)};
  }

  /// Finds the normal impulse that lets the corner just close its gap in this step, and pushes a corner that
  /// is too deep out over several steps.
  void solve_normal(Contact& c, double h) {
    constexpr double allowed = 1e-4, share = 0.1;  // accepted depth of overlap, m; share of the excess that
                                                   // each step removes
    const double wanted = c.gap > 0.0 ? -c.gap / h : share * std::max(-c.gap - allowed, 0.0) / h;
    const Box& box = boxes[c.box];
    const double missing = (wanted - up.dot(box.velocity_at(c.arm))) / box.mobility(c.arm, up, up);
    const double impulse = std::max(c.normal_impulse + missing, 0.0);
    push(c, impulse - c.normal_impulse, {0, 0});
    c.normal_impulse = impulse;
  }

  /// Applies Coulomb friction: the impulse that ends the slip, but at most mu times the normal impulse.
  void clamp(Contact& c) {
    Vector2d impulse = c.impulse - slip(c) / c.mobility.trace();  // impulse along the slip
    const double size = impulse.norm(), highest = mu * c.normal_impulse;
    if (size > highest) impulse *= highest / size;
    push(c, 0.0, impulse - c.impulse);
    c.impulse = impulse;
  }

  /// bristles: makes the linear model of the patch's force from its force without slip. The patch does not
  /// change.
  void begin(Contact& c, double h) {
    c.patch = patches_.find_or_add(c.key);
    // Finds the force of a new contact, whose load is unknown, at the highest load; it is scaled later.
    const double load = c.load > 0.0 ? c.load : highest_load;
    c.model = {batch_.find_force(h, {c.patch, {0.0, 0.0}, load}), h, load};
    c.elastic = c.model.steady;
  }

  /// bristles: corrects the linear model by the patch's force at the present slip and load. The patch does
  /// not change.
  void ask(Contact& c, double h) {
    if (c.normal_impulse == 0.0) return;
    const Vector2d s = slip(c), d = h * s;
    const double load = c.normal_impulse / h;
    c.elastic *= load / c.model.load;
    c.model = bristle::LinearFriction::through(batch_.find_force(h, {c.patch, {d[0], d[1]}, load}), c.elastic,
                                               s, h, load);
  }

  /// bristles: finds the friction impulse that is consistent with the slip it leaves.
  void rub(Contact& c, double h) {
    const Vector2d free = slip(c) - c.mobility * c.impulse;
    const Vector2d impulse = c.model.impulse(c.normal_impulse, h, c.mobility, free);
    push(c, 0.0, impulse - c.impulse);
    c.impulse = impulse;
  }

  /// bristles: steps all patches once, under the final loads, by how far each corner has moved along the
  /// plane. By velocities a box that turns would drift outwards.
  void step_patches(double h) {
    std::vector<bristle::Motion> motions;
    for (Contact& c : contacts) {
      const double load = c.normal_impulse / h;
      // Ignores load changes in the solver's last digits, so that patches at rest stay exactly at rest.
      if (std::abs(load - c.load) > 1e-6 * load) c.load = load;
      const Box& box = boxes[c.box];
      const Vector3d moved = box.position + box.turn * c.corner - c.place;
      motions.push_back({c.patch, {moved.dot(c.frame.along()), moved.dot(c.frame.aside())}, c.load});
    }
    std::vector<bristle::Response> responses(motions.size());
    batch_.step(h, motions, responses);
    for (const bristle::Response& r : responses) lost += r.dissipated + r.contact_loss + r.damper_work;
  }

  Vector3d gravity_;
  Friction kind_;
  bristle::PatchBatch batch_;
  bristle::KeyedPatches patches_;
};

constexpr double h = 1.0 / 240.0;  // s
const Box block{0.2, {0.05, 0.05, 0.02}, {0.0, 0.0, 0.02}};

/// Returns how far a block on a slope of 15 degrees moves (m) in its last second. It is tapped five times a
/// second for two seconds, then left alone for two.
double creep_after_taps(Friction kind) {
  World world(kind, 15.0 * M_PI / 180.0, block);
  double before = 0.0;
  for (int k = 0; k < 960; ++k) {
    world.boxes[0].push = k < 480 && k % 48 < 3 ? Vector3d(0.0, 0.3, -1.0) : Vector3d(0, 0, 0);
    world.step(h);
    if (k == 719) before = world.boxes[0].position[0];
  }
  const double at = world.boxes[0].position[0], creep = at - before;
  std::printf("  on the slope: moved %.2f um, in the last second %.2g um\n", 1e6 * at, 1e6 * creep);
  return creep;
}

/// Returns whether a block thrown at 2 m/s slides v^2 / (2 mu g) far, as it should, and friction accounts for
/// its energy. Semi-implicit steps of time h shorten the path by h v / 2.
bool throw_block(Friction kind) {
  World world(kind, 0.0, block);
  for (int k = 0; k < 240; ++k) world.step(h);
  const double speed = 2.0, start = world.boxes[0].position[0], lost = world.lost;
  world.boxes[0].velocity[0] = speed;
  const double thrown = world.energy();
  for (int k = 0; k < 240; ++k) world.step(h);
  const double way = world.boxes[0].position[0] - start, half_step = 0.5 * h * speed;
  const double should = speed * speed / (2.0 * mu * g) - half_step;
  const double left = thrown - world.energy() - (world.lost - lost) - mu * block.mass * g * half_step;
  std::printf("  thrown: slid %.4f of the way\n", way / should);
  if (kind == Friction::coulomb) return std::abs(way / should - 1.0) < 2e-4;
  std::printf("  energy that the books leave out: %.2g of the throw's\n", left / thrown);
  return std::abs(way / should - 1.0) < 2e-4 && std::abs(left / thrown) < 1e-6;
}

}  // namespace

int main() {
  bool right = true;
  for (const Friction kind : {Friction::coulomb, Friction::bristles}) {
    std::puts(kind == Friction::coulomb ? "Coulomb's clamp" : "bristles");
    right = std::abs(creep_after_taps(kind)) < 1e-11 && throw_block(kind) && right;
  }
  return right ? 0 : 1;
}
