// The closed loops of `bristle stability` against tables of linear theory and of an independent simulation.
#include <catch2/catch.hpp>

#include <cmath>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

#include "expect.hpp"
#include "reference_table.hpp"
#include "tools/libraries/stability/stability.hpp"

namespace bristle_test::test_stability {

using cli::LoopResult;
using cli::Scheme;
using cli::Verdict;

namespace {

Scheme scheme_of_case(const std::string& text) {
  if (text.find("semi-implicit") != std::string::npos) return Scheme::semi_implicit;
  if (text.find("explicit") != std::string::npos) return Scheme::explicit_euler;
  if (text.find("backward") != std::string::npos) return Scheme::hold_difference;
  return Scheme::hold;
}

/// Returns the highest k at which the linear loop of an explicit scheme is stable, below 1000.
double highest_stable(Scheme scheme, double c, double beta) {
  double low = 1e3, high = low;
  for (; !cli::linearly_stable(scheme, low, c, beta); low /= 1.05) high = low;
  for (int bisection = 0; bisection < 50; ++bisection) {
    const double middle = 0.5 * (low + high);
    (cli::linearly_stable(scheme, middle, c, beta) ? low : high) = middle;
  }
  return low;
}

}  // namespace

TEST_CASE("The linear loops have the spectral radii and limits of theory", "[stability]") {
  for (const Row& row : read_table("stability_cases.csv")) {
    const double k = number(row, "k=KT2/m"), c = number(row, "c=CT/m");
    CAPTURE(row.at("case"));
    // Tolerance: the table has twelve digits, and at a double root an error of 1e-12 in a coefficient is one
    // of 1e-6 in the root.
    CHECK(cli::linear_radius(Scheme::explicit_euler, k, c, 0.0) ==
          Approx(number(row, "rho_explicit_euler")).epsilon(1e-5));
    CHECK(cli::linear_radius(Scheme::semi_implicit, k, c, 0.0) ==
          Approx(number(row, "rho_semi_implicit")).epsilon(1e-5));
    CHECK(cli::linear_radius(Scheme::hold_difference, k, c, 0.0) ==
          Approx(number(row, "rho_zoh_backward_diff")).epsilon(1e-5));
  }
  for (const Row& row : read_table("stability_limits.csv")) {
    const std::string& scheme = row.at("scheme");
    const double c = number(row, "c=C*T/m"), beta = number(row, "beta=b*T/m");
    if (scheme.find("ZOH") == std::string::npos) continue;
    CAPTURE(scheme, c, beta);
    CHECK(highest_stable(Scheme::hold_difference, c, beta) ==
          Approx(number(row, "kmax_numeric")).epsilon(1e-8));
  }
  // Stability limits of loops that use the step's mean force; the expected values have three digits.
  CHECK(highest_stable(Scheme::device_mean, 0.0, 0.01) == Approx(0.0100).margin(5e-5));
  CHECK(highest_stable(Scheme::device_mean, 0.0, 0.1) == Approx(0.103).margin(5e-4));
  CHECK(highest_stable(Scheme::device_mean, 0.0, 0.5) == Approx(0.579).margin(5e-4));
  CHECK(highest_stable(Scheme::semi_implicit_mean, 0.3, 0.0) == Approx(0.6).epsilon(1e-8));
}

TEST_CASE("A mass on the brush settles and rings as the independent simulation says", "[stability]") {
  for (const Row& row : read_table("closed_loop_cases.csv")) {
    const std::string& name = row.at("case");
    cli::LoopSetup s;
    s.scheme = scheme_of_case(name);
    s.mass_kg = number(row, "m_kg");
    s.dt_s = number(row, "T");
    s.stiffness = number(row, "K");
    s.damping = number(row, "C");
    if (row.at("vs") != "inf") s.stribeck_velocity = number(row, "vs");
    s.device_damping = number(row, "b");
    s.mean_snap_length = number(row, "dbar_m");
    s.rule = bristle::SnapRule::keep;
    s.bristles = 900;
    s.start_velocity = number(row, "v0_m_per_s");
    s.stop_early = false;
    const LoopResult result = cli::run_loop(s);
    const double amplitude = result.peak_to_peak_m / s.mean_snap_length;
    const double expected = number(row, "x_pp_over_dbar");
    CAPTURE(name, s.start_velocity, amplitude, expected, to_string(result.verdict));
    const bool rings = row.at("verdict") == "rings";
    // The reference table calls a loop settled if its amplitude is below 2 % of dbar, and ringing if it is
    // above and does not fall. The program says that both grow while nothing has snapped.
    if (rings) {
      CHECK(result.verdict != Verdict::settles);
    } else {
      CHECK((result.verdict == Verdict::settles || (result.verdict == Verdict::grows && expected < 0.02)));
    }
    CHECK_FALSE(result.unbounded);
    // Tolerances. While nothing snaps the motion is linear, and only the table and displacements (2^-44 of
    // dbar a step) are rounded. From the virgin state 900 bristles follow the virgin curve to some 1/900 at
    // each snap. After sliding the bristles are at random: the amplitude, a maximum over a quarter of the
    // run, is known to a tenth. Case J is far beyond its limit and chaotic: a last bit of another system's
    // exp shows in it.
    const bool linear = s.start_velocity < 0.05 && expected < 0.4;
    const bool chaotic = name[0] == 'J';
    const double tolerance = linear                    ? 1e-6
                             : s.start_velocity < 0.05 ? (chaotic ? 0.02 : 0.005)
                                                       : (chaotic ? 0.35 : 0.1);
    CHECK(amplitude == Approx(expected).epsilon(tolerance).margin(1e-8));
  }
}

TEST_CASE("A loop on any bristles settles within the linear limit and not beyond it, and rests on a slope",
          "[stability]") {
  using bristle::Population;
  using bristle::SnapRule;
  const cli::StabilityOptions usual{true, 1, "", ""};
  const auto [population, rule] = GENERATE_REF(std::pair(usual.population, usual.rule),
                                               std::pair(Population::representatives, SnapRule::keep),
                                               std::pair(Population::infinite, SnapRule::redraw),
                                               std::pair(Population::representatives, SnapRule::slide));
  const cli::StabilityOptions options{true, 1, "", "", population, rule};
  const bool is_usual = population == usual.population && rule == usual.rule;
  CAPTURE(static_cast<int>(population), static_cast<int>(rule));
  // All schemes, weakly and strongly damped, on the usual bristles; four of the schemes on others.
  std::vector<Scheme> schemes = {Scheme::semi_implicit, Scheme::midpoint, Scheme::hold, Scheme::device};
  if (is_usual) schemes = cli::mapped_schemes();
  for (const Scheme scheme : schemes)
    for (const double second : {0.05, 0.5}) {
      if (second == 0.05 && !is_usual) continue;
      const double c = cli::is_device(scheme) ? 0.0 : second, beta = cli::is_device(scheme) ? second : 0.0;
      // Starts a quarter below and a quarter beyond the stability limit, where the amplitude changes in a
      // step by a few per cent of `second`, clearly over thousands of steps.
      const double limit = cli::is_implicit(scheme) ? 8.0 : highest_stable(scheme, c, beta);
      for (const bool inside : {true, false}) {
        const double k = limit * (inside ? 0.75 : 1.25);
        for (const bool sliding : {false, true}) {
          CAPTURE(to_string(scheme), second, k, sliding);
          const LoopResult result = cli::run_loop(cli::cell_setup(scheme, k, second, sliding, options));
          CHECK((result.verdict == Verdict::settles) == (inside || cli::is_implicit(scheme)));
          // Bound: snaps limit the swing of a spring that is too stiff for the step to dbar plus the path in
          // one step, k dbar.
          if (is_usual && !inside) CHECK(result.peak_to_peak_m < 20.0 * (1.0 + k) * 1e-5);
        }
      }
    }
  for (const Scheme scheme : {Scheme::predictor, Scheme::midpoint}) {
    const cli::RestRow row = cli::rest_on_slope(scheme, is_usual ? test_size(20000) * 1e-3 : 5.0, options);
    CAPTURE(to_string(scheme), row.first_second_m, row.creep_m);
    CHECK(row.first_second_m > 1e-6);
    CHECK(row.first_second_m < 15e-6);  // the block settles within a longest snap length
    CHECK(std::abs(row.creep_m) < (is_usual ? 1e-12 : 1e-11));
  }
}

TEST_CASE("A sliding mass stops where the friction of its rule takes its energy", "[stability]") {
  // Friction is K dbar with slide, half of it with keep; the implicit couplings lose a few per cent.
  for (const bristle::SnapRule rule : {bristle::SnapRule::keep, bristle::SnapRule::slide})
    for (const cli::StopRow& row : cli::stopping_distances(rule)) {
      if (row.scheme != Scheme::midpoint || row.slide < 100.0) continue;
      CAPTURE(static_cast<int>(rule), row.k);
      CHECK(row.ratio == Approx(1.0).margin(0.02));
    }
}

TEST_CASE("A damper too strong for the step is not bounded by snaps", "[stability]") {
  const cli::StabilityOptions options{true, 1, "", ""};
  for (const Scheme scheme : {Scheme::explicit_euler, Scheme::semi_implicit, Scheme::hold}) {
    CHECK(cli::run_loop(cli::cell_setup(scheme, 0.1, 2.5, true, options)).unbounded);
    CHECK_FALSE(cli::run_loop(cli::cell_setup(scheme, 6.0, 0.5, true, options)).unbounded);
  }
  for (const Scheme scheme : {Scheme::predictor, Scheme::midpoint}) {
    CHECK(cli::run_loop(cli::cell_setup(scheme, 0.1, 2.5, true, options)).verdict == Verdict::settles);
  }
}

TEST_CASE("A force one step late costs damping of K T/2, the mean force K T", "[stability]") {
  // Expected damping. With the end force it is exact, the sum of d^2 over displacements d; the mean force
  // adds products of successive d, smaller by cos(2 pi / 1000).
  CHECK(cli::late_force_damping(false) == Approx(0.5).epsilon(2e-3));
  CHECK(cli::late_force_damping(true) == Approx(1.0).epsilon(2e-3));
}

TEST_CASE("A wheel under a car rolls up a slope and back, however stiff, where a held force is without bound",
          "[stability][beds]") {
  for (cli::WheelRow row : cli::wheel_rows()) {
    if (row.dt_s < 5e-3) continue;
    cli::run_wheel(row);
    CAPTURE(row.slip_stiffness, row.inertia, row.dt_s, row.k);
    CHECK(std::abs(row.midpoint.speed_error) < 2e-3);
    CHECK(row.midpoint.gained_j < 1e-7);
    // A wheel at rest with k > 4 (K T^2 / inertia) rings and gains energy if force is held over a step.
    if (row.k > 4.0) CHECK(row.held.gained_j > 1.0);
    if (row.k < 1.0) CHECK(row.held.gained_j < 1e-6);
  }
}

TEST_CASE("Where simulation and linear theory disagree, the map says why", "[stability]") {
  using cli::Why;
  const auto why = [](Scheme scheme, double k, double second, bool stable, Verdict verdict,
                      Verdict from_sticking) {
    cli::MapCell cell;
    cell.k = k;
    cell.second = second;
    cell.linear_stable = stable;
    cell.verdict = verdict;
    cell.sticking.verdict = from_sticking;
    return cli::why_of(cell, scheme, 4000.0);
  };
  constexpr Verdict settles = Verdict::settles, rings = Verdict::rings;
  const Scheme scheme = Scheme::semi_implicit;
  const double limit = highest_stable(scheme, 0.5, 0.0);
  CHECK(why(scheme, 0.5 * limit, 0.5, true, settles, settles) == Why::agree);
  CHECK(why(scheme, 2.0 * limit, 0.5, false, rings, rings) == Why::agree);
  CHECK(why(scheme, limit * (1.0 + 1e-9), 0.5, false, settles, settles) == Why::at_the_limit);
  CHECK(why(scheme, 2.0 * limit, 0.5, false, settles, settles) == Why::snaps_damp);
  // A damper alone multiplies the velocity by 1 - c in an explicit step.
  CHECK(why(scheme, 0.1, 2.5, true, rings, rings) == Why::damper_in_sliding);
  CHECK(why(Scheme::device, 0.01, 0.5, true, rings, settles) == Why::encoder);
  for (const Scheme any : {scheme, Scheme::midpoint}) {
    CHECK(why(any, 0.5 * limit, 0.5, true, rings, settles) == Why::after_sliding);
    CHECK(why(any, 0.5 * limit, 0.5, true, rings, rings) == Why::other);
  }
}

TEST_CASE("The stability report holds every cell, limit and reason", "[stability]") {
  cli::StabilityResult result;
  result.ks = {0.1};
  result.seconds = {0.5};
  cli::SchemeMap map;
  map.scheme = Scheme::semi_implicit;
  map.cells.resize(2);
  map.cells[0].linear_stable = true;
  map.cells[1].verdict = Verdict::rings;
  map.cells[1].why = cli::Why::after_sliding;
  result.maps = {map};
  const auto report = nlohmann::json::parse(cli::stability_json({}, result));
  CHECK(report["schema"] == "bristle-stability-1");
  CHECK(report["maps"][0]["fraction_agreeing"] == 0.5);
  CHECK(report["maps"][0]["cells"][1]["verdict"] == "rings");
  CHECK(report["maps"][0]["why_not"].size() == 1);
  const std::string table = cli::stability_table({}, result);
  CHECK(table.find("agree %") != std::string::npos);
  CHECK(table.find(" 50.0") != std::string::npos);
  const std::string csv = cli::stability_csv(result);
  CHECK(csv.find("\ncell,1,") != std::string::npos);
  CHECK(csv.find("\nlimit,1,") != std::string::npos);
}

TEST_CASE(
    "A spring pulls a mass steadily over a contact that ages above the critical stiffness, and in jerks "
    "below",
    "[stability][ageing]") {
  for (const cli::SpringPull& pull : cli::pulls()) {
    CAPTURE(pull.name);
    // Disturbs the speed so slowly that the force changes by the slope of steady friction over speed.
    const double v = pull.speed_m_per_s, omega = 1e-3 * v / pull.material.snap_length.mean();
    const double slope =
        pull.load_n *
        (pull.material.kinetic_coefficient(1.001 * v) - pull.material.kinetic_coefficient(0.999 * v)) /
        (0.002 * v);
    CHECK(slope < 0.0);
    CHECK(cli::sliding_stiffness(pull, {0.0, omega}).imag() / omega == Approx(slope).epsilon(1e-3));
    const double critical = cli::critical_stiffness(pull);
    const Scheme scheme = pull.mass_kg > 10.0 ? Scheme::midpoint : Scheme::predictor;
    CHECK(cli::run_pull(pull, scheme, 1.1 * critical, 0.02, 20.0).growth < 0.0);
    CHECK(cli::run_pull(pull, scheme, 0.9 * critical, 0.02, 20.0).growth > 0.0);
  }
}

TEST_CASE("A contact that ages and slides in jerks takes no more than the spring gives",
          "[stability][ageing][energy]") {
  const cli::SpringPull pull = cli::pulls().at(0);
  const cli::PullResult jerks =
      cli::run_pull(pull, Scheme::midpoint, 0.25 * cli::critical_stiffness(pull), 0.2, 20.0);
  CHECK(jerks.slowest < 0.05);
  CHECK(jerks.fastest > 10.0);
  CHECK(jerks.energy_error < 1e-9 * jerks.work);
  // Checks that without ageing a spring of the same stiffness pulls the block steadily.
  cli::SpringPull plain = pull;
  plain.material.ageing_strength = 0.0;
  CHECK(cli::critical_stiffness(plain) == 0.0);
  const cli::PullResult steady =
      cli::run_pull(plain, Scheme::midpoint, 0.25 * cli::critical_stiffness(pull), 0.2, 20.0);
  CHECK(steady.fastest < 1.05);
  CHECK(steady.slowest > 0.95);
}

}  // namespace bristle_test::test_stability
