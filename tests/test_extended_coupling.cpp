// Bodies that slide and turn on extended patches: rest, energy, stability, and the paths of a coin.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

#include <bristle/extended_coupling.hpp>

#include "expect.hpp"
#include "scenes.hpp"

using namespace bristle_test;
using bristle::BodyVector;
using bristle::Coefficients;
using bristle::ExtendedContact;
using bristle::ExtendedMotion;
using bristle::ExtendedPatches;
using bristle::ExtendedResponse;
using bristle::Outline;
using bristle::Population;
using bristle::Pressure;
using Eigen::Vector3d;

namespace {

constexpr double pi = 3.141592653589793;

enum class Way { predictor, midpoint };
const char* name_of(Way way) { return way == Way::predictor ? "predictor" : "midpoint"; }
const char* name_of(Population population) {
  return population == Population::infinite ? "infinite" : "representatives";
}

/// Representatives in the widest precision that the build has, for the energy.
PatchOptions options_of(Population population, double max_load, std::uint32_t bristles = 2400) {
  PatchOptions options = PatchOptions{}
                             .with_max_normal_load(max_load)
                             .with_population(population)
                             .with_outputs(Outputs::all);
  if (population == Population::representatives)
    options.with_bristles(bristles).with_precision(precisions().back());
  return options;
}

/// Redraw over half to one and a half `length`, no damper: kinetic friction 13/24 stiffness length per newton.
Material rubber(double kinetic, double length, double damping = 0.0) {
  return plain_material(SnapLength::uniform(0.5 * length, 1.5 * length), SnapRule::redraw)
      .with_bristle_stiffness(kinetic * 24.0 / 13.0 / length)
      .with_bristle_damping(damping)
      .with_stribeck_velocity(1e12);
}

template <int Dof>
struct Body {
  void add(const Material& material, const PatchOptions& options, const Outline& outline, double load_n,
           ExtendedContact<Dof> contact) {
    contact.place = motions.size();
    contacts.push_back(contact);
    ExtendedMotion motion;
    motion.id = patches.add(material, options, outline);
    motion.normal_load = load_n;
    motions.push_back(motion);
    responses.emplace_back();
  }
  void step(Way way, const BodyVector<Dof>& force, double dt_s = tick) {
    if (way == Way::predictor) {
      bristle::predict_displacements(patches, cells, dt_s, body, force, contacts, motions);
    } else {
      report = bristle::solve_displacements(patches, cells, dt_s, body, force, contacts, motions);
    }
    status = status | patches.step(dt_s, motions, responses).status;
    if (way == Way::predictor) {
      bristle::apply_end_forces(dt_s, body, force, contacts, responses);
    } else {
      bristle::apply_mean_forces(dt_s, body, force, contacts, responses);
    }
    for (int a = 0; a < 3; ++a) pose[a] += motions[0].displacement[a];
    for (const ExtendedResponse& r : responses) lost += r.dissipated + r.contact_loss + r.damper_work;
  }
  void step(Way way) { step(way, Eigen::Matrix<double, Dof, 1>::Zero()); }
  double kinetic_energy() const {
    const Eigen::Matrix<double, Dof, 1> u = body.velocity;
    return 0.5 * u.dot(body.mass * u);
  }
  double stored_energy() const {
    double sum = 0.0;
    for (const ExtendedMotion& m : motions) sum += patches.stored_energy(m.id);
    return sum;
  }

  PatchBatch batch;
  ExtendedPatches patches{batch};
  bristle::CellContacts<Dof> cells;
  bristle::MovingBody<Dof> body;
  std::vector<ExtendedContact<Dof>> contacts;
  std::vector<ExtendedMotion> motions;
  std::vector<ExtendedResponse> responses;
  bristle::SolveReport report;
  Status status = Status::ok;
  Vector3d pose = Vector3d::Zero();  ///< of the first patch
  double lost = 0.0;                 ///< J
};

/// A flat disc that slides and turns in the plane.
struct Disc : Body<3> {
  static constexpr double radius = 0.01, mass = 0.1, load = 1.0;
  Disc(const Material& material, const PatchOptions& options, int rings) {
    body.mass.diagonal() << mass, mass, 0.5 * mass * radius * radius;
    add(material, options, Outline::disc(radius, Pressure::uniform, rings), load, {});
    batch.warm_up();
  }
};

/// Force and torque of a uniform disc with bristles that are short beside it, over mu N and mu N R: the mean
/// direction of the slip, as a plain sum in polar coordinates.
void limit_surface(double v, double spin_r, double& force, double& torque) {
  constexpr int rings = 60, around = 120;
  force = torque = 0.0;
  double weights = 0.0;
  for (int i = 0; i < rings; ++i) {
    const double r = (i + 0.5) / rings;
    for (int k = 0; k < around; ++k) {
      const double angle = 2.0 * pi * (k + 0.5) / around;
      const double x = v - spin_r * r * std::sin(angle), y = spin_r * r * std::cos(angle);
      const double speed = std::hypot(x, y);
      force += r * x / speed;
      torque += r * r * (y * std::cos(angle) - x * std::sin(angle)) / speed;
      weights += r;
    }
  }
  force /= weights;
  torque /= weights;
}

}  // namespace

TEST_CASE("A disc under a force and a torque that swing below the limit does not creep or turn in an hour",
          "[extended][coupling][creep]") {
  const Population population = GENERATE(Population::infinite, Population::representatives);
  const Way way = GENERATE(Way::predictor, Way::midpoint);
  CAPTURE(name_of(population), name_of(way));
  constexpr double dt = 0.02, length = 10e-6;
  Disc disc(Material::from_coefficients(
                Coefficients{}.with_presliding_length(length).with_damping_per_newton(100.0)),
            options_of(population, Disc::load, 200), 2);
  const double limit = 0.4 * Disc::load;
  const auto swing = [&](int steps) {
    for (int i = 0; i < steps; ++i) {
      const double share = 0.15 * (1.0 + std::sin(2.0 * pi * i / 10.0));
      disc.step(way, Vector3d(share * limit, 0.0, share * 2.0 / 3.0 * limit * Disc::radius), dt);
    }
  };
  const int minute = static_cast<int>(60.0 / dt);
  swing(minute);
  const Vector3d start = disc.pose;
  CHECK(start[0] > 0.05 * length);
  CHECK(start[2] * Disc::radius > 0.05 * length);
  swing(static_cast<int>(test_size(59)) * minute);
  CHECK(disc.status == Status::ok);
  WARN("moved " << (disc.pose - start).transpose() << " from " << start.transpose());
}
