// The paper's loop (z += v dt; if z > delta then z = 0) loses the path beyond the snap: tests of how much
// friction this lacks.
#include <catch2/catch.hpp>

#include <cmath>
#include <random>

#include "brute_force.hpp"
#include "expect.hpp"
#include "reference_table.hpp"
#include "scenes.hpp"
#include "statistics.hpp"

namespace bristle_test::test_literal_rule {

namespace {

PatchOptions literal_options(std::uint32_t n, int axes, Precision precision) {
  return with_literal_rule(plain_options(n, axes, precision));
}

bool whole(double x) { return std::abs(x - std::round(x)) < 1e-9; }

}  // namespace

TEST_CASE("The literal rule loses the friction that the table of its bias says", "[physics]") {
  const std::vector<Row> rows = read_table("naive_discretisation.csv");
  const std::uint32_t n = test_size(5000);
  const double discrepancy = golden_discrepancy(n);
  int points = 0;
  for (Precision precision : precisions()) {
    for (const NamedLaw& law : reference_laws()) {
      for (const Row& row : rows) {
        if (row.at("dist") != law.name) continue;
        const double h = number(row, "h_over_dbar");
        if (h < 0.05) continue;  // smaller steps give the same result, slowly
        const bool single = law.law.law() == bristle::SnapLaw::single;
        // Skips steps of which a single snap length is a multiple, because rounding decides there.
        if (single && whole(1.0 / h)) continue;
        const SnapRule rule = row.at("variant") == "fixed" ? SnapRule::keep : SnapRule::redraw;
        INFO(name_of(precision) << ", " << law.name << ", " << table_name(rule) << ", step of " << h
                                << " mean lengths");
        const int steps = h < 0.3 ? 1200 : 500;
        OnePatch patch(plain_material(law.law, rule), literal_options(n, 1, precision));
        patch.step(0.0, 0.0, n);
        for (int k = 0; k < 200; ++k) patch.step(h * dbar, 0.0, n);
        // Averages with weights that fade in and out, because each bristle is periodic and the average covers
        // few periods: a cut period adds less error.
        double sum = 0.0;
        double weights = 0.0;
        for (int k = 0; k < steps; ++k) {
          const double weight = 1.0 - std::cos(2.0 * M_PI * (k + 0.5) / steps);
          sum -= weight * patch.step(h * dbar, 0.0, n).elastic[0];
          weights += weight;
        }
        const double mean = sum / (weights * n * dbar);
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
  }
  CHECK(points > static_cast<int>(precisions().size()) * 120);
}

TEST_CASE(
    "The literal rule resets a bristle beyond its snap length to zero and reports the end force as mean",
    "[step]") {
  constexpr std::uint32_t n = 600;
  for (Precision precision : precisions()) {
    for (int axes : {1, 2}) {
      INFO(name_of(precision) << ", axes " << axes);
      OnePatch patch(plain_material(SnapLength::uniform(0.5 * dbar, 1.5 * dbar), SnapRule::keep),
                     literal_options(n, axes, precision));
      patch.step(0.0, 0.0, n);
      BruteForcePatch brute(n, single_quantile(1.0), false, 1);
      const Bristles start = read(patch, n);
      for (std::uint32_t i = 0; i < n; ++i) brute.bristles()[i].delta = start.delta[i];
      std::mt19937_64 random(11);
      std::uniform_real_distribution<double> flat(-0.6, 0.9);
      // Tolerance in float: rounding may decide whether a bristle near its length snaps in this step or the
      // next. Until it has snapped in both patches it adds an error of a few lengths.
      const double ties = precision == Precision::single ? 2.0 : 0.0;
      const double rounding = (precision == Precision::single ? 1e-5 : 1e-11) * n * dbar + ties * 3.0 * dbar;
      for (int step = 0; step < 200; ++step) {
        const double dx = flat(random) * dbar;
        const double dy = axes == 2 ? flat(random) * dbar : 0.0;
        const Response r = patch.step(dx, dy, n);
        const BruteStep b = brute.literal_step(dx, dy);
        expect_near(-r.elastic[0], b.end_x * n, rounding, "end force x");
        expect_near(-r.elastic[1], b.end_y * n, rounding, "end force y");
        expect_near(r.mean[0], r.end[0], 0.0, "mean force, the end force");
        expect_near(static_cast<double>(r.snaps), b.snaps * n, 0.1 + ties, "snaps");
        expect_near(r.dissipated, b.dissipated * n, 1e-6 * r.dissipated + ties * 4.0 * dbar * dbar,
                    "energy lost");
      }
    }
  }
}

TEST_CASE("The literal rule has no friction left when a step exceeds every snap length", "[step]") {
  OnePatch patch(plain_material(SnapLength::uniform(0.5 * dbar, 1.5 * dbar), SnapRule::redraw),
                 literal_options(500, 2, Precision::single));
  patch.step(0.0, 0.0, 500.0);
  for (int k = 0; k < 20; ++k) {
    const Response r = patch.step(1.2 * dbar, 1.0 * dbar, 500.0);
    CHECK(r.end[0] == 0.0);
    CHECK(r.end[1] == 0.0);
    CHECK(r.snaps == 500);
  }
}

TEST_CASE("A step of the literal rule beyond every length is one along either axis", "[step]") {
  // By the paper's rule a long step snaps every bristle and leaves it straight, so the next step bends it
  // along its own direction.
  const std::uint32_t n = 50;
  for (const double length : {1e4, 1e6, 3e6, 1e9, 1e290}) {
    for (const Precision precision : precisions()) {
      const PatchOptions options = with_literal_rule(plain_options(n, 2, precision, Outputs::all));
      OnePatch along_x(plain_material(uniform, SnapRule::keep), options);
      OnePatch along_y(plain_material(uniform, SnapRule::keep), options);
      Response x, y;
      const auto both = [&](double along, double across) {
        x = along_x.step(along * dbar, across * dbar, n);
        y = along_y.step(across * dbar, along * dbar, n);
        for (int axis = 0; axis < 2; ++axis) {
          CHECK(x.end[axis] == Approx(y.end[1 - axis]).margin(1e-9 * n * dbar));
          CHECK(x.mean[axis] == Approx(y.mean[1 - axis]).margin(1e-9 * n * dbar));
        }
        CHECK(x.dissipated == Approx(y.dissipated).epsilon(1e-9));
        CHECK(x.snaps == y.snaps);
      };
      both(0.2, 0.1);
      both(1e-3, -length);
      CHECK(x.snaps == n);
      CHECK(x.end[0] == 0.0);
      CHECK(x.end[1] == 0.0);
      both(0.1, 0.3);
      CHECK(x.end[0] == Approx(-0.1 * n * dbar));
      CHECK(x.end[1] == Approx(-0.3 * n * dbar));
    }
  }
}

}  // namespace bristle_test::test_literal_rule
