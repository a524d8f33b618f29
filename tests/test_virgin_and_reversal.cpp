// First loading from rest, and reversal and turns from steady sliding, against quadrature (tests/data).
#include <catch2/catch.hpp>

#include <cmath>

#include "brute_force.hpp"
#include "expect.hpp"
#include "reference_table.hpp"
#include "steady_brush.hpp"

namespace bristle_test::test_virgin_and_reversal {

namespace {

struct Direction {
  int axes;
  double x, y;
};
// Direction of motion: along x with one axis, oblique with two.
const Direction directions[] = {{1, 1.0, 0.0}, {2, std::cos(2.2), std::sin(2.2)}};

/// Returns the quantile function of a reference law, in mean snap lengths, apart from the library's code.
Quantile quantile_of(const std::string& name) {
  if (name == "uniform_0.5_1.5") return uniform_quantile(0.5, 1.5);
  if (name == "lognormal_cv0.3") return lognormal_quantile(1.0, 0.3);
  if (name == "exponential") return exponential_quantile(1.0);
  return single_quantile(1.0);
}

/// Returns a bound on the error of the virgin curve at x with SnapRule::keep, for snap lengths Q(u_i) whose
/// u_i have the given discrepancy (Koksma's inequality). It is the variation of x mod Q(u) over u > u0 times
/// the discrepancy, plus the contribution of bristles below Q(u0). x mod delta is a saw tooth in delta, with
/// a tooth of height x/k for every whole k between x/longest and x/Q(u0).
double stratified_bound(const Quantile& quantile, double x, double discrepancy) {
  double best = INFINITY;
  for (double u0 : {1e-9, 1e-4, 1e-3, 1e-2, 1e-1}) {
    const double shortest = quantile(u0);
    const double longest = quantile(1.0 - 1e-9);
    double variation = shortest + std::min(longest, x);
    const double last = std::floor(x / shortest);
    if (last > 1e6) continue;
    for (double k = std::ceil(x / longest); k <= last; ++k) variation += 2.0 * x / k;
    best = std::min(best, variation * discrepancy + 2.0 * shortest * (u0 + discrepancy));
  }
  return best;
}

}  // namespace

TEST_CASE("First loading from rest follows the virgin curve of every law and rule", "[physics]") {
  const std::vector<Row> rows = read_table("virgin_curve.csv");
  const std::uint32_t n = test_size(100000);
  const double discrepancy = golden_discrepancy(n);
  int points = 0;
  for (Precision precision : precisions()) {
    for (const Direction& e : directions) {
      for (const NamedLaw& law : reference_laws()) {
        for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
          INFO(name_of(precision) << ", " << e.axes << " axes, " << law.name << ", " << table_name(rule));
          const Quantile quantile = quantile_of(law.name);
          SteadyBrush brush(law.law, rule, n, e.axes, precision, false);
          double x = 0.0;
          for (const Row& row : rows) {
            if (row.at("dist") != law.name || row.at("variant") != table_name(rule)) continue;
            const double to = number(row, "x_over_dbar");
            const Deflection f = brush.step((to - x) * e.x, (to - x) * e.y);
            x = to;
            // Skips rows marked in the table, at which rounding decides whether bristles snap.
            if (!row.at("note").empty()) continue;
            INFO("x = " << x << " mean snap lengths");
            double tolerance = sampling_tolerance(number(row, "mc_se"), n, precision);
            if (rule == SnapRule::keep && !brush.single()) {
              const double rounding = sampling_tolerance(0.0, n, precision);
              tolerance = std::min(tolerance, stratified_bound(quantile, x, discrepancy) + rounding);
            }
            // For the lognormal law, bristles shorter than 0.2 are so rare that the reference's Monte Carlo
            // run may have missed them. The tolerance allows one such bristle.
            if (law.law.law() == bristle::SnapLaw::lognormal) tolerance += std::min(x, 1.0) / n;
            expect_near(f.x * e.x + f.y * e.y, number(row, "f_reference"), tolerance, "mean deflection");
            expect_near(f.x * e.y - f.y * e.x, 0.0, 1e-5, "deflection across the motion");
            ++points;
          }
        }
      }
    }
  }
  CHECK(points == static_cast<int>(precisions().size()) * 2 * (308 - 10));
}

TEST_CASE("Reversal out of steady sliding follows the reversal curve of every law and rule", "[physics]") {
  const std::vector<Row> rows = read_table("reversal_curve.csv");
  const std::uint32_t n = test_size(100000);
  int points = 0;
  for (Precision precision : precisions()) {
    for (const Direction& e : directions) {
      for (const NamedLaw& law : reference_laws()) {
        for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
          INFO(name_of(precision) << ", " << e.axes << " axes, " << law.name << ", " << table_name(rule));
          SteadyBrush brush(law.law, rule, n, e.axes, precision, true);
          brush.slide_to_steady(e.x, e.y);
          double y = 0.0;
          for (const Row& row : rows) {
            if (row.at("dist") != law.name || row.at("variant") != table_name(rule)) continue;
            const double to = number(row, "y_over_dbar_after_reversal");
            const Deflection f = brush.step((y - to) * e.x, (y - to) * e.y);
            y = to;
            INFO("y = " << y << " mean snap lengths after the reversal");
            // Tolerance for equal lengths, uniform in phase: rounding may move one bristle across its snap.
            const double tolerance = brush.single() ? 1.5 / SteadyBrush::phases
                                                    : sampling_tolerance(number(row, "mc_se"), n, precision);
            expect_near(f.x * e.x + f.y * e.y, number(row, "f_reference"), tolerance, "mean deflection");
            ++points;
          }
        }
      }
    }
  }
  CHECK(points == static_cast<int>(precisions().size()) * 2 * 238);
}

TEST_CASE("After a turn the force along and across the new direction follow the tables", "[physics]") {
  const std::vector<Row> rows = read_table("turn_2d.csv");
  const std::uint32_t n = test_size(100000);
  // Direction of steady sliding before the turn, rad; oblique, so that no axis is special.
  const double start = 0.4;
  int points = 0;
  for (Precision precision : precisions()) {
    for (const char* turn : {"90", "180"}) {
      const double angle = start + std::stod(turn) * M_PI / 180.0;
      for (const NamedLaw& law : reference_laws()) {
        for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
          INFO(name_of(precision) << ", " << law.name << ", " << table_name(rule) << ", turn by " << turn);
          SteadyBrush brush(law.law, rule, n, 2, precision, true);
          brush.slide_to_steady(std::cos(start), std::sin(start));
          const double ex = std::cos(angle);
          const double ey = std::sin(angle);
          double y = 0.0;
          for (const Row& row : rows) {
            if (row.at("dist") != law.name || row.at("variant") != table_name(rule) ||
                row.at("turn_deg") != turn)
              continue;
            const double to = number(row, "y_over_dbar_after_turn");
            const Deflection f = brush.step((to - y) * ex, (to - y) * ey);
            y = to;
            INFO("y = " << y << " mean snap lengths after the turn");
            const double tolerance = brush.single() ? 1.5 / SteadyBrush::phases
                                                    : sampling_tolerance(number(row, "mc_se"), n, precision);
            // The deflection across the motion is what remains of the old one. After a turn to the left it
            // points right.
            expect_near(f.x * ex + f.y * ey, number(row, "f_parallel_ref"), tolerance, "deflection along");
            expect_near(f.x * ey - f.y * ex, number(row, "f_perp_ref"), tolerance, "deflection across");
            ++points;
          }
        }
      }
    }
  }
  CHECK(points == static_cast<int>(precisions().size()) * 180);
}

TEST_CASE("The virgin peak of the reference table is the force limit of the patch", "[physics]") {
  const std::vector<Row> rows = read_table("summary.csv");
  for (const NamedLaw& law : reference_laws()) {
    for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
      INFO(law.name << ", " << table_name(rule));
      const double peak =
          number(find_row(rows, {{"dist", law.name}, {"variant", table_name(rule)}}), "f_peak");
      const double load = 640.0;
      OnePatch patch(plain_material(law.law, rule), plain_options(1000, 1));
      const Response r = patch.step(0.0, 0.0, load);
      expect_near(r.force_limit / (load * dbar), peak, 2e-5, "force limit over zeta sigma0 dbar");
      expect_near(r.stiffness, load, 1e-9 * load, "stiffness zeta sigma0");
    }
  }
}

}  // namespace bristle_test::test_virgin_and_reversal
