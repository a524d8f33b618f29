// Steady sliding: mean force, its fluctuation in time, dissipated energy, and the force as a function of
// speed.
#include <catch2/catch.hpp>

#include <cmath>

#include "expect.hpp"
#include "reference_table.hpp"
#include "scenes.hpp"
#include "statistics.hpp"

namespace bristle_test::test_steady {

TEST_CASE("Sliding of 900 bristles has the kinetic force and the fluctuation in time of the tables",
          "[physics]") {
  const std::vector<Row> fluctuation = read_table("fluctuation_zeta900.csv");
  const std::vector<Row> summary = read_table("summary.csv");
  constexpr std::uint32_t n = 900;
  const int steps = static_cast<int>(test_size(20000));
  for (Precision precision : precisions()) {
    for (const NamedLaw& law : reference_laws()) {
      if (law.law.law() == bristle::SnapLaw::single)
        continue;  // skips a single length, which keeps its phase for ever
      for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
        INFO(name_of(precision) << ", " << law.name << ", " << table_name(rule));
        const Row key{{"dist", law.name}, {"variant", table_name(rule)}};
        const double kinetic = number(find_row(summary, key), "f_kinetic");
        const double relative_sd = number(find_row(summary, key), "rel_sd_F_zeta900_in_time");
        OnePatch patch(plain_material(law.law, rule), plain_options(n, 2, precision));
        // Chooses steps. SnapRule::keep: bristles snap at fixed positions, so the time average is one over
        // phases, which long steps cover soonest. SnapRule::redraw: after 2.3 mean lengths little memory is
        // left, and the step is too short to jump over snaps.
        const double h = dbar * (rule == SnapRule::keep ? 37.1234567 : 2.3);
        patch.step(0.0, 0.0, n);
        for (int k = 0; k < 60; ++k) patch.step(h, 0.0, n);
        std::vector<double> force, mean_force;
        double dissipated = 0.0;
        double snaps = 0.0;
        for (int k = 0; k < steps; ++k) {
          const Response r = patch.step(h, 0.0, n);
          force.push_back(-r.elastic[0] / (n * dbar));
          mean_force.push_back(-r.mean[0] / (n * dbar));
          dissipated += r.dissipated;
          snaps += static_cast<double>(r.snaps);
        }
        const Sample f = describe(force);
        // Column sd_in_time_ref has the fluctuation in closed form; with SnapRule::keep that of the table's
        // own sample of 900 lengths.
        const double table_sd = number(find_row(fluctuation, key), "sd_in_time_ref");
        const double of_squares = law.law.moment(4) / (law.law.moment(2) * law.law.moment(2)) - 1.0;
        const double luck = rule == SnapRule::keep ? sigmas * 0.5 * std::sqrt(of_squares / n) : 1e-9;
        expect_near(relative_sd * kinetic, table_sd, luck * table_sd, "closed form against the table");

        // Tolerance: with SnapRule::keep lengths are stratified, so their mean is off by 1/n of a length.
        const double population = rule == SnapRule::keep ? 3.0 / n : 0.0;
        expect_near(f.mean, kinetic, sigmas * f.error() + population, "kinetic force");
        // Tolerance of twice the textbook error, because successive forces are slightly correlated.
        const double sd_error = 2.0 * sigmas * 0.5 * error_of_variance(steps);
        expect_near(std::sqrt(f.variance), relative_sd * kinetic, sd_error * relative_sd * kinetic,
                    "fluctuation");

        // Checks that mean forces average as end forces do, and that the dissipated energy is kinetic
        // friction times distance.
        const double mean_error = sigmas * f.error() + population;
        expect_near(describe(mean_force).mean, kinetic, mean_error, "average of the step means");
        expect_near(dissipated / (1.0 * n * steps * h * dbar), kinetic, mean_error,
                    "dissipated per distance");
        // Expects one snap per bristle and mean length (SnapRule::redraw), or per own length: E[1/delta].
        if (rule == SnapRule::redraw) {
          expect_near(snaps * dbar / (1.0 * n * steps * h), 1.0,
                      sigmas * law.law.cv() / std::sqrt(1.0 * n * steps * h / dbar) + 1e-3,
                      "snaps per mean length");
        }
      }
    }
  }
}

TEST_CASE("The kinetic coefficient is that of the closed form at any weight and stiffness", "[physics]") {
  const std::uint32_t n = test_size(50000);
  for (const char* set : {"hand_10um", "device_1mm", "canudas95_scaled"}) {
    for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
      INFO(set << ", " << table_name(rule));
      const Row row = find_row(read_table("param_sets.csv"), {{"set", set}, {"variant", table_name(rule)}});
      const double length = number(row, "dbar_m");
      const double load = number(row, "N_N");
      const Material material = Material{}
                                    .with_bristle_stiffness(number(row, "sigma0_N_per_m"))
                                    .with_normal_stiffness(number(row, "sigma_perp_N_per_m"))
                                    .with_asperity_height_deviation(number(row, "sigma_m"))
                                    .with_snap_length(SnapLength::uniform(0.5 * length, 1.5 * length))
                                    .with_snap_rule(rule);
      // Represents 900 physical bristles by n lighter ones, of which a third is out of contact.
      OnePatch patch(material, PatchOptions{}.with_max_normal_load(1.5 * load).with_bristles(n));
      for (int k = 0; k < 60; ++k) patch.step(0.83 * length, 0.0, load);
      if (rule == SnapRule::keep) patch.step(1000.37 * length, 0.0, load);
      const Response r = patch.step(0.3 * length, 0.0, load);
      const double kinetic = number(row, "Fk_N");
      // Relative standard deviation of one bristle: 30 times that of 900 bristles (summary.csv).
      const double one = 30.0 * 0.0223;
      expect_near(-r.end[0], kinetic, kinetic * sigmas * one / std::sqrt(n / 1.5), "friction force");
      expect_near(material.kinetic_coefficient() * load, kinetic, 1e-8 * kinetic, "kinetic coefficient");
      expect_near(r.stiffness, number(row, "K_N_per_m"), 1e-8 * r.stiffness, "stiffness");
    }
  }
}

namespace {

/// Returns the material of a parameter set of steady_force_velocity.csv, with damper and viscous friction.
Material damped_material(const Row& row, bristle::DamperDecay decay) {
  const Row set = find_row(read_table("param_sets.csv"), {{"set", row.at("set")}, {"variant", "fixed"}});
  const double length = number(set, "dbar_m");
  // Normal stiffness by load over (zeta sigma), because the table's own column has too few digits.
  const double normal_stiffness = number(set, "N_N") / (number(set, "zeta") * number(set, "sigma_m"));
  return Material{}
      .with_bristle_stiffness(number(row, "Fk_N") * 2.0 / (number(set, "zeta") * length))
      .with_bristle_damping(number(row, "C_Ns_per_m") / number(set, "zeta"))
      .with_viscous_friction(number(row, "sigma2_Ns_per_m"))
      .with_stribeck_velocity(number(row, "vs_m_per_s"))
      .with_normal_stiffness(normal_stiffness)
      .with_asperity_height_deviation(number(set, "sigma_m"))
      .with_snap_length(SnapLength::uniform(0.5 * length, 1.5 * length))
      .with_snap_rule(SnapRule::keep)
      .with_damper_decay(decay);
}
double load_of(const Row& row) {
  return number(find_row(read_table("param_sets.csv"), {{"set", row.at("set")}, {"variant", "fixed"}}),
                "N_N");
}

}  // namespace

TEST_CASE("Dampers and lubricant add to the kinetic force what the table of speeds says", "[physics]") {
  const std::vector<Row> rows = read_table("steady_force_velocity.csv");
  for (bristle::DamperDecay decay : {bristle::DamperDecay::exponential, bristle::DamperDecay::gaussian}) {
    const char* column = decay == bristle::DamperDecay::exponential ? "F_exp_abs_N" : "F_exp_gauss_N";
    for (const Row& row : rows) {
      const double v = number(row, "v_m_per_s");
      INFO(row.at("set") << ", " << column << ", v = " << v << " m/s");
      const double load = load_of(row);
      OnePatch patch(damped_material(row, decay),
                     PatchOptions{}.with_max_normal_load(load).with_bristles(900).with_outputs(Outputs::all));
      // Checks oblique motion: the damper force depends on the magnitude of the velocity, and acts along it.
      const double dt = 1e-4;
      const Response r = patch.step(0.6 * v * dt, -0.8 * v * dt, load, dt);
      const double damper = number(row, column) - number(row, "Fk_N");
      const double tolerance = 1e-10 * number(row, column);  // the reference table has 12 digits
      expect_near(-r.damper[0], 0.6 * damper, tolerance, "damper force x");
      expect_near(-r.damper[1], -0.8 * damper, tolerance, "damper force y");
      expect_near(r.end[0], r.elastic[0] + r.damper[0], 1e-15, "end = elastic + damper");
      if (v > 0.0) expect_near(r.damping, damper / v, tolerance / v, "damping, the secant");
      if (v == 0.0) {
        expect_near(r.damping, number(row, "C_Ns_per_m") + number(row, "sigma2_Ns_per_m"), 1e-9 * r.damping,
                    "damping at rest");
      }
      expect_near(r.damper_work, damper * v * dt, tolerance * v * dt, "damper work");

      // Checks that the caller's velocity replaces displacement / dt in the damper, and nowhere else.
      Motion motion;
      motion.id = patch.id;
      motion.normal_load = load;
      motion.has_velocity = true;
      motion.velocity[0] = 0.6 * v;
      motion.velocity[1] = -0.8 * v;
      const Response given = patch.step(motion, dt);
      expect_near(-given.damper[0], 0.6 * damper, tolerance, "damper force x for a given velocity");
      expect_near(-given.damper[1], -0.8 * damper, tolerance, "damper force y for a given velocity");
      expect_near(given.elastic[0], r.elastic[0], 0.0, "elastic force, which no velocity changes");
      expect_near(given.damper_work, 0.0, 0.0, "damper work without displacement");
    }
  }
}

TEST_CASE("The force over speed has its maximum and minimum where Lambert's W puts them", "[physics]") {
  const std::vector<Row> rows = read_table("steady_force_velocity.csv");
  int found = 0;
  for (const Row& extremum : read_table("steady_force_velocity_extrema.csv")) {
    const Row row = find_row(rows, {{"set", extremum.at("set")}});
    const auto decay = extremum.at("reading_of_eq5") == "exp(-|v|/vs)" ? bristle::DamperDecay::exponential
                                                                       : bristle::DamperDecay::gaussian;
    INFO(extremum.at("set") << ", " << extremum.at("reading_of_eq5"));
    const double load = load_of(row);
    const double vs = number(row, "vs_m_per_s");
    OnePatch patch(damped_material(row, decay), PatchOptions{}.with_max_normal_load(load).with_axes(1));
    const auto force = [&](double u) {
      Motion motion;
      motion.id = patch.id;
      motion.normal_load = load;
      motion.has_velocity = true;
      motion.velocity[0] = u * vs;
      return number(row, "Fk_N") - patch.step(motion).damper[0];
    };
    // Here viscous friction (sigma2) is so strong beside the damper that force over speed has no extremum.
    if (extremum.at("u_max").empty()) {
      for (double u = 0.0; u < 20.0; u += 0.1)
        expect(force(u + 0.1) > force(u), "the force grows with speed");
      continue;
    }
    ++found;
    for (const auto& [at, value, sign] :
         {std::tuple{"u_max", "F_at_u_max_N", 1.0}, {"u_min", "F_at_u_min_N", -1.0}}) {
      const double u = number(extremum, at);
      const double f = force(u);
      expect_near(f, number(extremum, value), 1e-10 * f, value);
      expect(sign * (f - force(0.99 * u)) > 0.0, "an extremum, seen from below");
      expect(sign * (f - force(1.01 * u)) > 0.0, "an extremum, seen from above");
    }
  }
  CHECK(found == 4);
}

TEST_CASE("Without contact there is no force at all, the viscous one included", "[physics]") {
  OnePatch patch(Material{}.with_viscous_friction(5.0).with_bristle_damping(0.1),
                 PatchOptions{}.with_outputs(Outputs::all));
  const Response r = patch.step(1e-4, -1e-4, 0.0);
  for (int axis = 0; axis < 2; ++axis) {
    CHECK(r.end[axis] == 0.0);
    CHECK(r.mean[axis] == 0.0);
    CHECK(r.elastic[axis] == 0.0);
    CHECK(r.damper[axis] == 0.0);
  }
  CHECK(r.damping == 0.0);
  CHECK(r.stiffness == 0.0);
  CHECK(r.force_limit == 0.0);
  CHECK(r.damper_work == 0.0);
}

}  // namespace bristle_test::test_steady
