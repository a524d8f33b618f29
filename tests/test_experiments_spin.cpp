// The experiments on contacts with an extent (limit surface, first turn, coin, plate held at a corner,
// wheels, balls, impacts): their numbers against tables and closed forms.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "expect.hpp"
#include "experiment_runs.hpp"
#include "reference_table.hpp"
#include "tools/libraries/rivals/coulomb_disc.hpp"

namespace bristle_test::test_experiments_spin {

namespace {

// Returns the highest value in a column of the rows.
double highest(const std::vector<cli::SeriesRow>& rows, std::size_t column) {
  double most = -INFINITY;
  for (const cli::SeriesRow& row : rows) most = std::max(most, row.values[column]);
  return most;
}

}  // namespace

TEST_CASE("Brush and LuGre slide and spin as the table of the limit surface says", "[experiment][spin]") {
  const std::vector<std::string> models = {"lugre", "brush_infinite"};
  const cli::ExperimentResult result =
      run("limit-surface", {"ratios=0,0.05,0.1,0.25,0.5,0.9,1,1.1,1.5,2,5"}, models);
  for (const std::string& model : models) {
    const auto rows = rows_of(result, "limit", model);
    int found = 0;
    double worst = 0.0;
    for (const Row& row : read_table("spin_limit.csv")) {
      if (row.at("pressure") != "uniform") continue;
      const auto at_ratio = at(rows, number(row, "v_over_omegaR"), 1e-9);
      if (at_ratio == std::nullopt) continue;
      ++found;
      worst = std::max(worst, std::fabs(at_ratio->values[1] - number(row, "F_over_muN")));
      worst = std::max(worst, std::fabs(at_ratio->values[3] - number(row, "T_over_muNR")));
    }
    INFO(model);
    CHECK(found == 11);
    CHECK(worst < 0.01);
    CHECK(finding(result, "limit_surface", model) == Approx(100.0 * worst).margin(0.01));
    CHECK(is_shown(result, "limit_surface", model));
  }
  // Checks that two rings of cells are too coarse for 1 %, and that the experiment reports the miss.
  const cli::ExperimentResult coarse = run("limit-surface", {"rings=2"}, {"brush_infinite"});
  CHECK(!is_shown(coarse, "limit_surface", "brush_infinite"));
}

TEST_CASE("A disc turned from rest follows the table, with its peak", "[experiment][spin]") {
  const std::string model = "brush_infinite";
  const Sets sets = {"rings=12", "resolution=16"};
  const cli::ExperimentResult result = run("pure-spin", sets, {model});
  const auto turned = rows_of(result, "turn", model), pulled = rows_of(result, "pull", model);
  int found = 0;
  double peak = 0.0;
  for (const Row& row : read_table("spin_virgin.csv")) {
    if (row.at("dist") != "uniform_0.5_1.5" || row.at("pressure") != "uniform") continue;
    const std::string s = row.at("s=phi*R/dbar");
    if (s.rfind("peak", 0) == 0) {
      peak = number(row, "T_over_T_kinetic");
      continue;
    }
    const double x = std::stod(s);
    const auto after =
        std::find_if(turned.begin(), turned.end(), [&](const cli::SeriesRow& r) { return r.values[0] >= x; });
    if (after == turned.end()) continue;
    const auto before = after - 1;
    const double between = (x - before->values[0]) / (after->values[0] - before->values[0]);
    const double torque = 1.5 * ((1.0 - between) * before->values[1] + between * after->values[1]);
    ++found;
    INFO("s = " << s);
    CHECK(torque == Approx(number(row, "T_over_T_kinetic")).margin(0.005));
  }
  CHECK(found > 10);
  CHECK(1.5 * highest(turned, 1) == Approx(peak).epsilon(0.005));
  CHECK(finding(result, "spin_peak", model) == Approx(peak).epsilon(0.005));
  // Expected peak of a first pull: 0.625 mean snap lengths, over the kinetic 13/24 (reference/README.md).
  CHECK(highest(pulled, 1) == Approx(0.625 * 24.0 / 13.0).epsilon(0.002));
  CHECK(finding(result, "spin_peak_share", model) == Approx(peak / (0.625 * 24.0 / 13.0)).epsilon(0.005));
  CHECK(finding(result, "torsion_spring", model) == Approx(1.0).epsilon(1e-6));
  // Pulls a spinning disc at a tenth of the rim's speed: friction is a tenth of kinetic friction, without a
  // peak.
  const auto spinning = rows_of(result, "spinning", model);
  CHECK(spinning.back().values[1] == Approx(rivals::coulomb_disc(0.1).force).epsilon(0.02));
  CHECK(highest(spinning, 1) < 1.05 * rivals::coulomb_disc(0.1).force);
  CHECK(std::fabs(finding(result, "peak_lost", model)) < 0.05);
}

TEST_CASE("A coin slows as the equations of motion with the closed form say", "[experiment][spin]") {
  const double start = 4.0, friction = 0.4 * 9.81;  // m/s, m/s^2
  const std::vector<std::string> models = {"coulomb", "lugre", "brush_infinite"};
  const cli::ExperimentResult result = run("coin", {"ratios=0.5,2", "cells_across=15"}, models);
  for (const double ratio : {0.5, 2.0}) {
    double v = start * ratio / (1.0 + ratio), rim = start / (1.0 + ratio), time = 0.0;
    std::vector<double> times, speeds, rims;
    while (v + rim > 0.03 * start) {  // integrates by the midpoint rule
      const double h = 1e-4;
      const rivals::DiscFriction a = rivals::coulomb_disc(v / rim);
      const rivals::DiscFriction b =
          rivals::coulomb_disc((v - 0.5 * h * friction * a.force) / (rim - h * friction * a.torque));
      v -= h * friction * b.force;
      rim -= 2.0 * h * friction * b.torque;
      time += h;
      times.push_back(time);
      speeds.push_back(v);
      rims.push_back(rim);
    }
    for (const std::string& model : models) {
      INFO(model << " from " << ratio);
      int compared = 0;
      for (const cli::SeriesRow& row : rows_of(result, "coin", model)) {
        if (row.values[0] != ratio || row.values[1] > times.back()) continue;
        const auto k = static_cast<std::size_t>(std::lround(row.values[1] / 1e-4)) - 1;
        if (k >= times.size()) continue;
        expect_near(row.values[2], speeds[k], 0.01 * start, "speed of the centre");
        expect_near(row.values[3], rims[k], 0.01 * start, "speed of the rim");
        ++compared;
      }
      CHECK(compared > 30);
      CHECK(finding(result, "coin_ratio", model) < 0.12);
      CHECK(is_shown(result, "stops_at_once", model));
    }
  }
}

TEST_CASE("A plate at its corner: friction at its mean distance, and LuGre cells that drift",
          "[experiment][spin]") {
  const cli::ExperimentResult result =
      run("held-corner", {"cycles=8"}, {"lugre", "elasto_plastic", "brush_infinite", "brush_keep"});
  for (const char* model : {"lugre", "elasto_plastic", "brush_infinite", "brush_keep"}) {
    INFO(model);
    CHECK(finding(result, "corner_moment", model) == Approx(1.0).epsilon(0.01));
  }
  CHECK(finding(result, "corner_holds", "lugre") > 1.0);  // creep of a plate held at its corner, um per cycle
  CHECK(!is_shown(result, "corner_holds", "lugre"));
  for (const char* model : {"elasto_plastic", "brush_infinite", "brush_keep"}) {
    INFO(model);
    CHECK(std::fabs(finding(result, "corner_holds", model)) < 1e-3);
  }
}

TEST_CASE("Wheels creep as closed forms and the table of the tyre say", "[experiment][beds]") {
  const cli::ExperimentResult result =
      run("creep-curve", {}, {"lugre_tyre", "slip_formula", "fastsim", "bed"});
  int found = 0;
  for (const Row& row : read_table("tyre_steady.csv")) {
    if (row.at("direction_deg") != "90") continue;
    const auto there = at(rows_of(result, "curve", "bed"), number(row, "slip_times_2a_over_l0") / 4.0, 1e-9);
    if (there == std::nullopt) continue;
    ++found;
    CHECK(there->values[1] == Approx(number(row, "Fy_over_muN")).margin(1e-3));
    CHECK(there->values[2] == Approx(-2.0 * number(row, "Mz_over_muN2a")).margin(1e-3));
  }
  CHECK(found >= 3);
  // All wheel models have the same stiffness at small creepage; the LuGre tyre follows d / (1 + 6/7 x 3 s).
  for (const char* model : {"slip_formula", "lugre_tyre"}) {
    const auto first = at(rows_of(result, "curve", model), 0.02, 1e-9);
    const double closed = model == std::string("lugre_tyre") ? 0.06 / 1.06 : 0.06;
    CHECK(first->values[1] == Approx(closed).epsilon(2e-3));
  }
  CHECK(finding(result, "relaxation_length", "bed") == Approx(2.0 - 2.0 * std::exp(-0.5)).margin(2e-3));
  CHECK(finding(result, "relaxation_length", "lugre_tyre") == Approx(12.0 / 7.0 / 1.03).epsilon(0.01));
  // FASTSIM's error is of first order, so that four times the cells leave a quarter of it.
  const double coarse = finding(result, "creep_force", "fastsim");
  CHECK(finding(run("creep-curve", {"cells=64"}, {"fastsim"}), "creep_force", "fastsim") ==
        Approx(0.5 * coarse).epsilon(0.05));
}

TEST_CASE("A ball rolls as Galileo's, and lags by Carter's share of its way", "[experiment][beds]") {
  const cli::ExperimentResult result = run("rolling-ball", {"time=1"}, {"coulomb", "bed"});
  // The centre of a ball gains as much speed as its surface loses: ratio 1 / (1 + 2/5 (1 - creepage)).
  const double creepage = rows_of(result, "slope", "bed").back().values[3];
  CHECK(creepage > 3e-3);
  CHECK(finding(result, "rolls_down", "bed") == Approx(1.0 + 2.0 / 7.0 * creepage).margin(1e-4));
  CHECK(finding(result, "thrown_rolls", "bed") == Approx(5.0 / 7.0).margin(1e-3));
  // A regularised Coulomb contact slips at a speed that its force sets, so when a ball moves twice as fast it
  // creeps half as much per distance.
  CHECK(finding(result, "creeps_by_distance", "coulomb") == Approx(0.5).margin(0.01));
}

TEST_CASE("A sphere strikes as impulse and momentum say, and springs back", "[experiment][beds]") {
  const cli::ExperimentResult result =
      run("oblique-impact", {"angles=20,60", "spins=30,80"}, {"coulomb", "bed"});
  CHECK(finding(result, "slides_through", "bed") < 0.01);
  CHECK(finding(result, "slides_through", "coulomb") < 0.01);
  CHECK(finding(result, "recoils", "bed") == Approx(-1.41).margin(0.03));
  CHECK(finding(result, "recoils", "coulomb") == Approx(0.0).margin(1e-6));
}

}  // namespace bristle_test::test_experiments_spin
