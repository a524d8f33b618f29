// The paper's loop among the rivals (z += v dt; if z > delta then z = 0) loses the path beyond the snap:
// tests of how much friction this lacks.
#include <catch2/catch.hpp>

#include <cmath>
#include <random>

#include "brute_force.hpp"
#include "expect.hpp"
#include "reference_table.hpp"
#include "scenes.hpp"
#include "statistics.hpp"
#include "tools/libraries/rivals/paper_loop.hpp"

namespace bristle_test::test_paper_loop {

using rivals::PaperLoop;

namespace {

/// Steps a paper's loop along x, and returns the mean of its deflections over dbar.
double bend(PaperLoop& loop, double path, double load_n) {
  return -loop.step({path, 0.0}, tick, load_n).end.x / (load_n * dbar);
}

bool whole(double x) { return std::abs(x - std::round(x)) < 1e-9; }

}  // namespace

TEST_CASE("The paper's loop loses the friction that the table of its bias says", "[physics]") {
  const std::vector<Row> rows = read_table("naive_discretisation.csv");
  const std::uint32_t n = test_size(5000);
  const double discrepancy = golden_discrepancy(n);
  int points = 0;
  for (const NamedLaw& law : reference_laws()) {
    for (const Row& row : rows) {
      if (row.at("dist") != law.name) continue;
      const double h = number(row, "h_over_dbar");
      if (h < 0.05) continue;  // smaller steps give the same result, slowly
      const bool single = law.law.law() == bristle::SnapLaw::single;
      // Skips steps of which a single snap length is a multiple, because rounding decides there.
      if (single && whole(1.0 / h)) continue;
      const SnapRule rule = row.at("variant") == "fixed" ? SnapRule::keep : SnapRule::redraw;
      INFO(law.name << ", " << table_name(rule) << ", step of " << h << " mean lengths");
      const int steps = h < 0.3 ? 1200 : 500;
      PaperLoop loop(plain_material(law.law, rule), n, n, 3);
      for (int k = 0; k < 200; ++k) bend(loop, h * dbar, n);
      // Averages with weights that fade in and out, because each bristle is periodic and the average covers
      // few periods: a cut period adds less error.
      double sum = 0.0;
      double weights = 0.0;
      for (int k = 0; k < steps; ++k) {
        const double weight = 1.0 - std::cos(2.0 * M_PI * (k + 0.5) / steps);
        sum += weight * bend(loop, h * dbar, n);
        weights += weight;
      }
      const double mean = sum / weights;
      const double expected = number(row, "f_naive_closed");
      double tolerance = 0.002;  // error left by the longest periods, mean snap lengths
      if (rule == SnapRule::keep) {
        // Tolerance with keep: stratified lengths delta average h/2 floor(delta/h), h the step, with an
        // error of its variation, h/2 x longest/h, times the discrepancy.
        tolerance += discrepancy * 0.5 * law.law.quantile(0.9999) / dbar;
      } else {
        // Tolerance with redraw, by renewal-reward theory: between two snaps a bristle of length delta adds
        // delta^2/2 to the path integral of the deflection, f delta on average (f: mean deflection). The
        // deviation of the difference gives the sampling error.
        const double m2 = law.law.moment(2) / (dbar * dbar);
        const double m3 = law.law.moment(3) / (dbar * dbar * dbar);
        const double m4 = law.law.moment(4) / (dbar * dbar * dbar * dbar);
        const double f = 0.5 * m2;
        const double cycle = std::sqrt(0.25 * m4 - f * m3 + f * f * m2) + h;
        tolerance += sigmas * 1.3 * cycle / std::sqrt(1.0 * n * steps * h / (1.0 + h));
      }
      expect_near(mean, expected, tolerance, "mean force over zeta sigma0 dbar");
      ++points;
    }
  }
  CHECK(points > 120);
}

TEST_CASE("The paper's loop resets a bristle beyond its snap length to zero", "[step]") {
  constexpr std::uint32_t n = 600;
  for (const bool redraws : {false, true}) {
    PaperLoop loop(plain_material(uniform, redraws ? SnapRule::redraw : SnapRule::keep), n, n, 5);
    std::mt19937_64 random(11);
    std::uniform_real_distribution<double> flat(-0.6, 0.9);
    for (int step = 0; step < 200; ++step) {
      const double dx = flat(random) * dbar, dy = flat(random) * dbar;
      BruteForcePatch brute(n, single_quantile(1.0), false, 1);
      for (std::uint32_t i = 0; i < n; ++i) {
        brute.bristles()[i].zx = loop.deflection(i).x;
        brute.bristles()[i].zy = loop.deflection(i).y;
        brute.bristles()[i].delta = loop.snap_length(i);
      }
      const std::uint64_t before = loop.snaps();
      const rivals::Force force = loop.step({dx, dy}, tick, n);
      const BruteStep b = brute.literal_step(dx, dy);
      expect_near(-force.end.x, b.end_x * n, 1e-11 * n * dbar, "end force x");
      expect_near(-force.end.y, b.end_y * n, 1e-11 * n * dbar, "end force y");
      expect_near(force.mean.x, force.end.x, 0.0, "mean force, the end force");
      expect_near(static_cast<double>(loop.snaps() - before), b.snaps * n, 0.1, "snaps");
    }
  }
}

TEST_CASE("The paper's loop has no friction left when a step exceeds every snap length", "[step]") {
  PaperLoop loop(plain_material(uniform, SnapRule::redraw), 500, 500.0, 1);
  for (int k = 0; k < 20; ++k) {
    const rivals::Force force = loop.step({1.2 * dbar, 1.0 * dbar}, tick, 500.0);
    CHECK(force.end.x == 0.0);
    CHECK(force.end.y == 0.0);
  }
  CHECK(loop.snaps() == 20 * 500);
}

TEST_CASE("Of the paper's loop as many bristles touch as the load asks for, and dampers act on them",
          "[step]") {
  const Material material =
      plain_material(uniform, SnapRule::keep).with_bristle_damping(0.2).with_viscous_friction(3.0);
  PaperLoop loop(material, 100, 400.0, 1);
  // All stick, under half the load half of them: 200 bristles of 1 N/m and 0.2 exp(-v / vs) N s/m.
  const double v = 1e-4, path = v * tick, damping = 200.0 * material.damping_at(v) + 3.0;
  CHECK(loop.step({path, 0.0}, tick, 200.0).end.x == Approx(-200.0 * path - damping * v));
  // The other half came straight into contact: the first half alone is bent by the first step.
  CHECK(loop.step({path, 0.0}, tick, 400.0).end.x ==
        Approx(-600.0 * path - (400.0 * material.damping_at(v) + 3.0) * v));
  CHECK(loop.step({path, 0.0}, tick, 0.0).end.x == 0.0);
  CHECK(loop.step({0.0, 0.0}, tick, 400.0).end.x == 0.0);
}

}  // namespace bristle_test::test_paper_loop
