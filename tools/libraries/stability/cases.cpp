// Runs single cases that `bristle stability` reports beside its maps: stiff and soft materials in SI units,
// stopping distances, a force that acts one step late, and rest on a slope.
#include <array>
#include <cmath>

#include <bristle/patch_batch.hpp>

#include "tools/libraries/scene/couplings.hpp"
#include "tools/libraries/stability/stability.hpp"

namespace cli {

std::vector<CaseRow> stability_cases() {
  const auto row = [](std::string name, Scheme scheme, double mass, double stiffness, double damping,
                      double device_damping, double dt, double mean_snap_length) {
    CaseRow r;
    r.name = std::move(name);
    r.setup.scheme = scheme;
    r.setup.mass_kg = mass;
    r.setup.dt_s = dt;
    r.setup.stiffness = stiffness;
    r.setup.damping = damping;
    r.setup.device_damping = device_damping;
    r.setup.mean_snap_length = mean_snap_length;
    r.setup.rule = bristle::SnapRule::keep;
    r.setup.bristles = 900;
    r.setup.stop_early = false;
    r.start_velocities = {1e-5, 1e-3, 1e-2, 1e-1, 1.0};
    return r;
  };
  std::vector<CaseRow> rows = {
      row("A  k + 2c = 2.6", Scheme::semi_implicit, 0.1, 80000, 90, 0, 1e-3, 1e-5),
      row("B  k + 2c = 4.4", Scheme::semi_implicit, 0.1, 80000, 178.8854382, 0, 1e-3, 1e-5),
      row("C  no damper", Scheme::explicit_euler, 0.1, 800, 0, 0, 1e-4, 1e-3),
      row("D  no damper", Scheme::hold, 0.1, 800, 0, 0, 1e-3, 1e-3),
      row("E  b = 0.63 K T", Scheme::hold, 0.1, 800, 0, 0.5, 1e-3, 1e-3),
      row("F  b = 0.38 K T", Scheme::hold, 0.1, 800, 0, 0.3, 1e-3, 1e-3),
      row("G  C = 0.5 N s/m", Scheme::hold_difference, 0.1, 800, 0.5, 0, 1e-3, 1e-3),
      row("H  C fades, vs = 1 cm/s", Scheme::hold_difference, 0.1, 800, 0.5, 0, 1e-3, 1e-3),
      row("I  k = 0.8, c = 0.9", Scheme::hold_difference, 0.1, 80000, 90, 0, 1e-3, 1e-5),
      row("J  b = 0.013 K T", Scheme::hold, 0.075, 80000, 0, 1, 1e-3, 1e-5)};
  rows[7].setup.stribeck_velocity = 1e-2;
  return rows;
}

// Measures the distances in which a mass in steady sliding stops, over the true ones. Without dampers
// friction is a constant F, so a mass m at speed v truly stops after m v^2 / (2 F).
std::vector<StopRow> stopping_distances(bristle::SnapRule rule) {
  StabilityOptions options;
  options.rule = rule;
  std::vector<StopRow> rows;
  for (const double k : {0.08, 0.8, 8.0}) {
    for (const double slide : {20.0, 300.0}) {
      for (const Scheme scheme :
           {Scheme::predictor, Scheme::midpoint, Scheme::linear_always, Scheme::semi_implicit}) {
        LoopSetup s = cell_setup(scheme, k, 0.0, true, options);
        s.bristles = 5000;
        s.start_velocity *= std::sqrt(slide / 20.0);
        s.steps = 400;
        const double distance = 0.5 * s.mass_kg * s.start_velocity * s.start_velocity / s.kinetic_n();
        rows.push_back({k, slide, scheme, run_loop(s).distance_m / distance});
      }
    }
  }
  return rows;
}

// Returns the device damping b, in units of K T, that absorbs the energy which arises because a friction
// force is held over the next step. Over a sticking patch moved to and fro, the held force does the work sum
// F_i d_(i+1), with force F_i and displacement d_i of step i; the damping takes sum b d_i^2 / T.
double late_force_damping(bool mean) {
  constexpr double dt = 1e-3, dbar = 1e-5, stiffness = 1000.0;
  constexpr int samples = 1000;  // time steps in one swing of the patch
  bristle::PatchBatch batch;
  bristle::Motion motion;
  motion.id = batch.add(
      bristle::Material{}
          .with_bristle_stiffness(stiffness / 1000.0)
          .with_normal_stiffness(1000.0)
          .with_snap_length(bristle::SnapLength::uniform(0.5 * dbar, 1.5 * dbar)),
      bristle::PatchOptions{}
          .with_axes(1)
          .with_outputs(bristle::Outputs::mean)
          .with_precision(BRISTLE_WITH_DOUBLE ? bristle::Precision::double_ : bristle::Precision::single));
  batch.warm_up();
  motion.normal_load = 1.0;
  bristle::Response response;
  double force = 0.0, work = 0.0, squares = 0.0, last = 0.0;
  for (int i = 0; i <= samples; ++i) {
    const double x = 0.4 * dbar * std::sin(2.0 * M_PI * i / samples);
    motion.displacement[0] = x - last;
    last = x;
    work += force * motion.displacement[0];
    squares += motion.displacement[0] * motion.displacement[0];
    batch.step(dt, {&motion, 1}, {&response, 1});
    force = mean ? response.mean[0] : response.end[0];
  }
  return work / (squares / dt) / (stiffness * dt);
}

// Lets a plate rest on a slope and measures its creep. Its feet are level with the centre of mass, so that
// friction cannot tip it.
RestRow rest_on_slope(Scheme scheme, double seconds, const StabilityOptions& options) {
  constexpr double dt = 1e-3, mass = 0.25, gravity = 9.80665, kinetic = 0.4, steepness = 2.0 / 3.0 * kinetic;
  const double cosine = 1.0 / std::sqrt(1.0 + steepness * steepness);
  const double load = mass * gravity * cosine / 4.0;
  const auto material = bristle::Material::from_coefficients(bristle::Coefficients{}
                                                                 .with_rule(options.rule)
                                                                 .with_kinetic(kinetic)
                                                                 .with_damping_per_newton(30.0)
                                                                 .with_stribeck_velocity(2e-3));
  bristle::PatchBatch batch;
  std::array<bristle::Motion, 4> motions;
  std::array<bristle::Response, 4> responses;
  std::array<bristle::BodyContact<6>, 4> feet;
  for (std::size_t i = 0; i < 4; ++i) {
    motions[i].id = batch.add(material, bristle::PatchOptions{}
                                            .with_max_normal_load(2.0 * load)
                                            .with_bristles(500)
                                            .with_population(options.population)
                                            .with_outputs(bristle::Outputs::mean)
                                            .with_seed(static_cast<std::uint32_t>(i + 1)));
    motions[i].normal_load = load;
    const Eigen::Vector3d arm(i & 1 ? 0.05 : -0.05, i & 2 ? 0.03 : -0.03, 0.0);
    feet[i] = bristle::rigid_contact(i, arm, Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY());
  }
  batch.warm_up();
  auto body = bristle::rigid_body(mass, Eigen::Vector3d(1e-4, 2e-4, 3e-4).asDiagonal());
  bristle::BodyVector<6> force = Eigen::Matrix<double, 6, 1>::Zero();
  force[0] = mass * gravity * cosine * steepness;

  RestRow row;
  row.scheme = scheme;
  const auto steps = static_cast<std::uint64_t>(seconds / dt);
  double x = 0.0;
  for (std::uint64_t i = 0; i < steps; ++i) {
    const double v0 = body.velocity[0];
    if (scheme == Scheme::predictor) {
      bristle::predict_displacements<6>(batch, dt, body, force, feet, motions);
      batch.step(dt, motions, responses);
      bristle::apply_end_forces<6>(dt, body, force, feet, responses);
    } else {
      bristle::solve_displacements<6>(batch, dt, body, force, feet, motions);
      batch.step(dt, motions, responses);
      bristle::apply_mean_forces<6>(dt, body, force, feet, responses);
    }
    x += 0.5 * dt * (v0 + body.velocity[0]);
    if (i + 1 == static_cast<std::uint64_t>(1.0 / dt)) row.first_second_m = x;
  }
  row.seconds = static_cast<double>(steps) * dt;
  row.creep_m = x - row.first_second_m;
  row.creep_over_snap_length = row.creep_m / material.snap_length.mean();
  return row;
}

}  // namespace cli
