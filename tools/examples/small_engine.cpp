// A small physics engine to read: boxes on a plane and on each other, sequential impulses (PGS), and friction
// by Coulomb's clamp or by a patch of bristles at each corner. What bristles need is marked "bristles:". A
// box is tapped, a stack stands on a slope that moves, a push is held, a box is thrown. Exits with 1 unless
// bristles hold where Coulomb's clamp creeps or lets go, and slide as far as they should.
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

struct Box {
  double mass;        // kg
  Vector3d half;      // half edges of the box, m
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
  /// Returns the velocity along `a` that a unit impulse along `b` causes at the same point `arm` (m from the
  /// centre), 1/kg.
  double mobility(const Vector3d& arm, const Vector3d& a, const Vector3d& b) const {
    return a.dot(b) / mass + arm.cross(a).dot(inverse_inertia * arm.cross(b));
  }
  // Inverse of the inertia in the world's axes, recomputed in every step because the box turns, 1/(kg m^2).
  Matrix3d inverse_inertia = Matrix3d::Zero();
};

/// Contact of a corner of a box with the plane or with the top of another box.
struct Contact {
  std::uint64_t key = 0;     // number made of both bodies and the corner, the same in every step
  int box = 0;               // box with the corner
  int below = -1;            // box whose top it touches; -1: the plane
  Vector3d corner{0, 0, 0};  // corner from the box's centre, in the box's axes, m
  // Position of the corner at the beginning of the step, m, seen from what is below: in the axes of the box
  // below, or from the plane. The slip of the step is measured from it.
  Vector3d under{0, 0, 0};
  Vector3d arm{0, 0, 0};        // corner from the box's centre, in the world's axes
  Vector3d arm_below{0, 0, 0};  // corner from the centre of the box below, in the world's axes
  Vector3d up{0, 0, 1};         // normal of the surface below
  double gap = 0.0;             // height over that surface, m; negative inside it
  double normal_impulse = 0.0;  // normal impulse, N s; starts at that of the step before
  Vector2d impulse{0, 0};       // N s, friction impulse along frame.along() and aside()
  bristle::ContactFrame frame;
  Matrix2d mobility = Matrix2d::Zero();  // change of slip per unit friction impulse, 1/kg

  // Friction of the corner: its patch, a linear model of the patch's force that PGS uses, and the patch's
  // elastic force (N) without slip, under the load of the model.
  bristle::PatchId patch;
  double load = 0.0;  // normal load in the step before, N
  bristle::LinearFriction model;
  Vector2d elastic{0, 0};
};

enum class Friction { coulomb, bristles };

class World {
 public:
  World(Friction kind, double slope_rad, std::vector<Box> all)
      : boxes(std::move(all)),
        gravity_(g * std::sin(slope_rad), 0.0, -g * std::cos(slope_rad)),
        kind_(kind),
        // bristles: makes one batch, and a pool that gives each key (box and corner) its patch. All memory is
        // allocated here.
        patches_(batch_, bristle::Material::from_coefficients(law),
                 bristle::PatchOptions{}.with_max_normal_load(highest_load),
                 bristle::KeyedOptions{}.with_capacity(64)) {
    batch_.warm_up();
  }

  void step(double h) {
    for (Box& box : boxes) {
      box.inverse_inertia = box.inertia().inverse();
      box.velocity += h * (gravity_ + box.push / box.mass);
    }
    find_contacts(h);
    int iterations = 20;
    if (kind_ == Friction::coulomb)
      // Starts the iterations with the impulses of the step before (warm start), which are nearly right.
      for (const Contact& c : contacts) push(c, c.normal_impulse, c.impulse);
    else
      iterations = solve_bodies(h) ? 4 : 20;
    for (int i = 0; i < iterations; ++i) {
      for (Contact& c : contacts) solve_normal(c, h);
      // bristles: takes forces from the patches themselves in the later half of the iterations, because the
      // linear models may not hold.
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
    plane += h * plane_velocity;
    if (kind_ == Friction::bristles) step_patches(h);
  }

  /// Returns the distance of a box from the plane's origin, down the plane, m. It shows how far the box has
  /// crept or slid.
  double travelled(int box) const { return boxes[box].position[0] - plane[0]; }

  std::vector<Box> boxes;
  std::vector<Contact> contacts;
  Vector3d plane{0, 0, 0}, plane_velocity{0, 0, 0};  // origin of the plane z = 0, which moves along itself

 private:
  static constexpr int sweeps = 2;
  // Softness of normal impulses in solve_bodies(), relative to their mobility. It lets four corners share the
  // load that three could carry.
  static constexpr double softness = 3e-3;
  static constexpr double highest_load = 50.0;  // highest load of one corner, N

  /// Lists the corners near the plane or the top of a box. Each keeps its impulses and patch of the step
  /// before.
  void find_contacts(double h) {
    std::vector<Contact> before;
    before.swap(contacts);
    for (int b = 0; b < static_cast<int>(boxes.size()); ++b) {
      for (int corner = 0; corner < 8; ++corner) {
        const Vector3d sign(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
        for (int below = -1; below < static_cast<int>(boxes.size()); ++below) {
          Contact c;
          c.key = static_cast<std::uint64_t>((8 * b + corner) * 64 + below + 1);
          bool known = false;
          for (const Contact& old : before) {
            if (old.key != c.key) continue;
            c = old;
            known = true;
          }
          c.box = b;
          c.below = below;
          c.corner = sign.cwiseProduct(boxes[b].half);
          c.arm = boxes[b].turn * c.corner;
          if (below == b || !touches(c)) continue;
          if (!known) c.frame = bristle::ContactFrame(c.up);
          // Turns the axes of the friction with the mean rotation of both bodies, so that bristles keep their
          // direction on them.
          c.frame.carry(c.up, h * boxes[b].spin,
                        below < 0 ? Vector3d(0, 0, 0) : Vector3d(h * other(c)->spin));
          const Vector3d axes[2] = {c.frame.along(), c.frame.aside()};
          for (int i = 0; i < 2; ++i)
            for (int k = 0; k < 2; ++k) c.mobility(i, k) = mobility(c, axes[i], axes[k]);
          if (kind_ == Friction::bristles) begin(c, h);
          contacts.push_back(c);
        }
      }
    }
    patches_.end_step();  // bristles: returns the patches of corners that do not touch to the pool
  }

  /// Computes the height of a corner over the surface below. Returns whether the corner is so near that it
  /// may touch.
  bool touches(Contact& c) {
    const Vector3d corner = boxes[c.box].position + c.arm;
    const Box* box = other(c);
    if (box == nullptr) {
      c.under = corner - plane;
      c.gap = corner[2];
    } else {
      c.up = box->turn * Vector3d::UnitZ();
      c.arm_below = corner - box->position;
      c.under = box->turn.conjugate() * c.arm_below;
      c.gap = c.under[2] - box->half[2];
      if (std::abs(c.under[0]) > box->half[0] || std::abs(c.under[1]) > box->half[1]) return false;
    }
    return std::abs(c.gap) < 0.005;
  }

  Box* other(const Contact& c) { return c.below < 0 ? nullptr : &boxes[c.below]; }
  double mobility(const Contact& c, const Vector3d& a, const Vector3d& b) {
    return boxes[c.box].mobility(c.arm, a, b) + (other(c) ? other(c)->mobility(c.arm_below, a, b) : 0.0);
  }
  void push(const Contact& c, double normal, const Vector2d& friction) {
    const Vector3d impulse = normal * c.up + friction[0] * c.frame.along() + friction[1] * c.frame.aside();
    boxes[c.box].add(impulse, c.arm);
    if (other(c)) other(c)->add(-impulse, c.arm_below);
  }
  /// Returns the velocity of the corner against the surface below, m/s.
  Vector3d velocity(const Contact& c) {
    return boxes[c.box].velocity_at(c.arm) - (other(c) ? other(c)->velocity_at(c.arm_below) : plane_velocity);
  }
  Vector2d slip(const Contact& c) {
    const Vector3d v = velocity(c);
    return {c.frame.along().dot(v), c.frame.aside().dot(v)};
  }
  /// Returns the normal speed, m/s, that a contact aims at: one that just closes the gap in this step, or one
  /// that pushes a corner that is too deep out over several steps.
  static double wanted_speed(const Contact& c, double h) {
    // Accepted depth of overlap, m, and the share of the excess that each step removes.
    constexpr double allowed = 1e-4, share = 0.1;
    return c.gap > 0.0 ? -c.gap / h : share * std::max(-c.gap - allowed, 0.0) / h;
  }

  void solve_normal(Contact& c, double h) {
    const double missing = (wanted_speed(c, h) - c.up.dot(velocity(c))) / mobility(c, c.up, c.up);
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

  /// bristles: makes the linear model of the patch's force, from its force without slip. The patch itself
  /// does not change.
  void begin(Contact& c, double h) {
    c.patch = patches_.find_or_add(c.key);
    // Evaluates the patch of a new contact, whose load is not known yet, at the highest load; the force is
    // scaled later.
    const double load = c.load > 0.0 ? c.load : highest_load;
    c.model = {batch_.find_force(h, {c.patch, {0.0, 0.0}, load}), h, load};
    c.elastic = c.model.steady;
  }

  /// bristles: solves all boxes at once, with soft normal impulses and the linear models, because in a stack
  /// iterations carry changes too slowly from box to box. Returns whether few iterations are enough after
  /// that: no contact pulls, and loads are nearly those of the linear models. (LinearFriction::release finds
  /// contacts that slip.)
  bool solve_bodies(double h) {
    system_.begin(6 * static_cast<int>(boxes.size()));
    for (int box = 0; box < static_cast<int>(boxes.size()); ++box)
      system_.couple(Unknowns(box, -1).column, 12);
    for (const Contact& c : contacts) system_.couple(Unknowns(c.box, c.below).column, 12);
    system_.set_zero();
    for (int at = 0; at < system_.size(); at += 6) {
      const Matrix3d inertia = boxes[at / 6].inertia();
      for (int i = 0; i < 3; ++i) {
        system_.line(at + i)[at + i] = boxes[at / 6].mass;
        for (int k = 0; k <= i; ++k) system_.line(at + 3 + i)[at + 3 + k] = inertia(i, k);
      }
    }
    std::vector<Levers> levers;          // velocity along, aside and up, per velocity and spin of both bodies
    std::vector<Vector3d> pulls, gains;  // impulse without change of velocity, N s, and lost per m/s of it
    for (const Contact& c : contacts) {
      const Vector3d axes[3] = {c.frame.along(), c.frame.aside(), c.up};
      Levers& of = levers.emplace_back();
      for (int a = 0; a < 3; ++a)
        of.col(a) << axes[a], c.arm.cross(axes[a]), -axes[a], -c.arm_below.cross(axes[a]);
      const double stiffness = 1.0 / (softness * mobility(c, c.up, c.up));
      Vector3d& gain = gains.emplace_back(0, 0, stiffness);
      Vector3d& pull = pulls.emplace_back(0, 0, stiffness * (wanted_speed(c, h) - c.up.dot(velocity(c))));
      if (c.load > 0.0) {
        gain.head<2>() = h * c.model.slope();
        pull.head<2>() = h * c.model.force(slip(c));
      }
      system_.add(Unknowns(c.box, c.below).column, of, gain.asDiagonal(), pull);
    }
    system_.factor();
    system_.substitute();
    bool nearly = true;
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      Contact& c = contacts[i];
      Vector3d change = levers[i].topRows<6>().transpose() * system_.right.segment<6>(6 * c.box);
      if (c.below >= 0)
        change += levers[i].bottomRows<6>().transpose() * system_.right.segment<6>(6 * c.below);
      const Vector3d impulse = pulls[i] - gains[i].cwiseProduct(change);
      c.impulse = impulse.head<2>();
      c.normal_impulse = std::max(impulse[2], 0.0);
      push(c, c.normal_impulse, c.impulse);
      nearly = nearly && std::abs(impulse[2] / h - c.load) < 0.1 * (impulse[2] / h + c.load);
    }
    return nearly;
  }

  /// bristles: corrects the linear model by the patch's force at the present slip and load. The patch itself
  /// does not change.
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

  /// bristles: steps all patches once, under the final loads, by the distance that each corner has moved over
  /// what is below. By velocity times time step a box that turns would drift outwards.
  void step_patches(double h) {
    std::vector<bristle::Motion> motions;
    for (Contact& c : contacts) {
      const double load = c.normal_impulse / h;
      // Ignores changes of the load in the solver's last digits, so that patches at rest stay exactly at
      // rest.
      if (std::abs(load - c.load) > 1e-6 * load) c.load = load;
      const Box& box = boxes[c.box];
      const Vector3d from = other(c) ? other(c)->position + other(c)->turn * c.under : plane + c.under;
      const Vector3d moved = box.position + box.turn * c.corner - from;
      motions.push_back({c.patch, {moved.dot(c.frame.along()), moved.dot(c.frame.aside())}, c.load});
    }
    std::vector<bristle::Response> responses(motions.size());
    batch_.step(h, motions, responses);
  }

  /// Numbers of the unknowns of two bodies in the equations, velocity and spin of each; -1: cannot move.
  struct Unknowns {
    Unknowns(int box, int below) {
      for (int i = 0; i < 12; ++i) {
        const int body = i < 6 ? box : below;
        column[i] = body < 0 ? -1 : 6 * body + i % 6;
      }
    }
    int column[12];
  };
  using Levers = Eigen::Matrix<double, 12, 3>;

  Vector3d gravity_;
  Friction kind_;
  bristle::BodySystem system_;
  bristle::PatchBatch batch_;
  bristle::KeyedPatches patches_;
};

constexpr double h = 1.0 / 240.0;  // s
const Box block{0.2, {0.05, 0.05, 0.02}, {0.0, 0.0, 0.02}};

/// Returns how far ten taps move a block down a slope of 20 degrees, m. During each tap, 12 ms, the block
/// needs more than kinetic friction and less than the peak, so it should not creep.
double tapped(Friction kind) {
  World world(kind, 20.0 * M_PI / 180.0, {block});
  double before = 0.0;
  for (int k = 0; k < 960; ++k) {
    if (k == 240) before = world.travelled(0);
    world.boxes[0].push = k >= 240 && k < 720 && k % 48 < 3 ? Vector3d(0.1, 0.2, 0.3) : Vector3d(0, 0, 0);
    world.step(h);
  }
  return world.travelled(0) - before;
}

/// Returns how fast the top of a stack of five blocks creeps, m/s. The stack stands on a slope of 10 degrees
/// that moves to and fro along itself, 4 times a second with 2 m/s^2. The friction needed stays below kinetic
/// friction.
double stacked(Friction kind) {
  std::vector<Box> boxes(5, block);
  for (int i = 0; i < 5; ++i) {
    Box& box = boxes[i];
    box.half.head<2>().array() -= 0.003 * i;
    box.position[2] += 0.04 * i;
  }
  World world(kind, 10.0 * M_PI / 180.0, boxes);
  double before = 0.0;
  for (int k = 0; k < 1440; ++k) {
    if (k == 960) before = world.travelled(4);
    const double turns = 2.0 * M_PI * 4.0;
    world.plane_velocity[0] = 2.0 / turns * std::sin(turns * h * (k + 1));
    world.step(h);
  }
  return (world.travelled(4) - before) / (480.0 * h);
}

/// Returns how far a block on a level plane moves, m, under a push that grows to 1.04 times kinetic friction
/// in a second and is held there for another.
double held(Friction kind) {
  World world(kind, 0.0, {block});
  for (int k = 0; k < 480; ++k) {
    world.boxes[0].push[0] = std::min(k / 240.0, 1.0) * 1.04 * mu * block.mass * g;
    world.step(h);
  }
  return world.travelled(0);
}

/// Returns how far a block thrown at 2 m/s slides, over the exact v^2 / (2 mu g). Semi-implicit steps of time
/// h shorten the path by h v / 2.
double thrown(Friction kind) {
  World world(kind, 0.0, {block});
  for (int k = 0; k < 240; ++k) world.step(h);
  const double speed = 2.0, start = world.travelled(0);
  world.boxes[0].velocity[0] = speed;
  for (int k = 0; k < 240; ++k) world.step(h);
  return (world.travelled(0) - start) / (speed * speed / (2.0 * mu * g) - 0.5 * h * speed);
}

}  // namespace

int main() {
  const struct {
    const char* name;
    double (*run)(Friction);
    double scale;
  } scenes[] = {{"tapped ten times on a slope: moved, um", tapped, 1e6},
                {"stack of five on a moving slope: creeps, um/s", stacked, 1e6},
                {"push above kinetic friction, held: moved, um", held, 1e6},
                {"thrown: slid, over Coulomb's law", thrown, 1.0}};
  double clamp[4], brush[4];
  std::printf("%-46s %12s %12s\n", "", "Coulomb", "bristles");
  for (int i = 0; i < 4; ++i) {
    clamp[i] = scenes[i].scale * scenes[i].run(Friction::coulomb);
    brush[i] = scenes[i].scale * scenes[i].run(Friction::bristles);
    std::printf("%-46s %12.4g %12.4g\n", scenes[i].name, clamp[i], brush[i]);
  }
  const bool held_by_bristles = std::abs(brush[0]) < 5.0 && std::abs(brush[1]) < 0.05 && brush[2] < 20.0;
  const bool let_go_by_clamp = clamp[0] > 50.0 && clamp[1] > 2.0 && clamp[2] > 5e4;
  const bool slid = std::abs(clamp[3] - 1.0) < 2e-4 && std::abs(brush[3] - 1.0) < 2e-3;
  return held_by_bristles && let_go_by_clamp && slid ? 0 : 1;
}
