// Representatives that can be rubbed: residual and shared renewal (core/patches/RUBBING.md) against tables
// made by an independent solver (tests/data/rubbing_*.csv), and properties of every patch.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "brute_pieces.hpp"
#include "brute_rubbing.hpp"
#include "expect.hpp"
#include "reference_table.hpp"
#include "scenes.hpp"

namespace bristle_test::test_rubbing_representatives {

namespace {

Material rubbed(const SnapLength& law, SnapRule rule, double residual_over_dbar, double renewal) {
  return plain_material(law, rule)
      .with_residual_length(residual_over_dbar * dbar)
      .with_shared_renewal(renewal);
}

/// The rows of a table for one law, snap rule, shared renewal (kappa) and residual length.
struct TableCase {
  std::string name;
  SnapLength law;
  SnapRule rule = SnapRule::redraw;
  double renewal = 0.0;
  double residual = 0.0;  ///< residual length over dbar
  std::vector<Row> rows;
};

std::vector<TableCase> read_cases(const std::string& file) {
  std::vector<TableCase> cases;
  for (const Row& row : read_table(file)) {
    const std::string name = row.at("dist") + ", " + row.at("variant") + ", kappa " + row.at("kappa") +
                             ", residual " + row.at("residual_over_dbar");
    if (cases.empty() || cases.back().name != name) {
      TableCase c;
      c.name = name;
      for (const NamedLaw& law : reference_laws())
        if (row.at("dist") == law.name) c.law = law.law;
      c.rule = row.at("variant") == table_name(SnapRule::keep) ? SnapRule::keep : SnapRule::redraw;
      c.renewal = number(row, "kappa");
      c.residual = number(row, "residual_over_dbar");
      cases.push_back(c);
    }
    cases.back().rows.push_back(row);
  }
  return cases;
}

/// A patch of a table case's material. It returns mean deflections over dbar, which with plain_material are
/// minus the force.
struct Rub {
  std::uint32_t n;
  OnePatch patch;

  Rub(const TableCase& c, std::uint32_t bristles, int axes, std::uint32_t seed = 1)
      : n(bristles),
        patch(rubbed(c.law, c.rule, c.residual, c.renewal), plain_options(bristles, axes).with_seed(seed)) {}

  Response move(double dx, double dy = 0.0) { return patch.step(dx * dbar, dy * dbar, n); }
  double bend(const Response& r, int axis = 0) const { return -r.end[axis] / n / dbar; }
  double mean_bend(const Response& r) const { return -r.mean[0] / n / dbar; }
};

/// Returns a bound on the standard error of the mean deflection over dbar of n bristles. The exponential law
/// reaches it.
double sampling_error(std::uint32_t n) { return 1.0 / std::sqrt(static_cast<double>(n)); }

/// Returns after how many steps of length `step` a path x ends, or 0 if x is inside a step.
int steps_to(double x, double step) {
  const double k = x / step;
  return std::abs(k - std::round(k)) < 1e-6 ? static_cast<int>(std::round(k)) : 0;
}

/// Directions of a path's steps: each turns by `turn` rad, or by a random angle with this deviation.
struct Bends {
  double turn;
  bool at_random;
  double heading = 0.0;
  std::mt19937 random{5};

  void next() { heading += turn * (at_random ? std::normal_distribution<double>()(random) : 1.0); }
};

/// Results of a step, or of its parts together: forces along and across the motion, energy dissipated and
/// snaps.
struct BentStep {
  double end_along = 0.0, end_across = 0.0, mean_along = 0.0, mean_across = 0.0, dissipated = 0.0,
         snaps = 0.0;
};

/// Takes a step in `parts` equal parts. Forces in newtons, lengths in metres.
BentStep step_in_parts(OnePatch& patch, double length, double heading, int parts, double load = 1.0) {
  const double e[2] = {std::cos(heading), std::sin(heading)};
  BentStep sum;
  for (int k = 0; k < parts; ++k) {
    const Response r = patch.step(length / parts * e[0], length / parts * e[1], load);
    sum.end_along = -(r.elastic[0] * e[0] + r.elastic[1] * e[1]);
    sum.end_across = -(r.elastic[1] * e[0] - r.elastic[0] * e[1]);
    sum.mean_along -= (r.mean[0] * e[0] + r.mean[1] * e[1]) / parts;
    sum.mean_across -= (r.mean[1] * e[0] - r.mean[0] * e[1]) / parts;
    sum.dissipated += r.dissipated / length;
    sum.snaps += static_cast<double>(r.snaps);
  }
  return sum;
}

/// Returns the load of step k as a share of the maximum. It varies by 10 % in a period of 20 steps.
double rippling_load(int k) { return (1.0 + 0.1 * std::sin(0.1 * 3.141592653589793 * k)) / 1.1; }

/// Slides the patch by `path` to steady sliding, in steps of `step`; lengths over dbar.
void slide(Rub& rub, double path, double step) {
  for (double distance = 0.0; distance < path - 1e-9; distance += step) rub.move(step);
}

}  // namespace

TEST_CASE("Rubbed bristles follow the virgin curve of the tables in steps of any length", "[rubbing]") {
  const std::uint32_t n = test_size(100000);
  for (const TableCase& c : read_cases("rubbing_virgin.csv")) {
    for (const double step : {0.01, 0.1, 1.0}) {
      INFO(c.name << ", step " << step);
      Rub rub(c, n, 1);
      int done = 0;
      for (const Row& row : c.rows) {
        const double x = number(row, "x_over_dbar");
        const int steps = steps_to(x, step);
        if (steps == 0 || x > 8.0) continue;
        Response r;
        for (; done < steps; ++done) r = rub.move(step);
        // Tolerance: cutting a step's path into pieces of a quarter length has an error of 0.004 at most.
        expect_near(rub.bend(r), number(row, "f"), 4.0 * sampling_error(n) + (step > 0.1 ? 0.004 : 0.001),
                    "mean deflection");
      }
    }
  }
}

TEST_CASE("Bristles that are renewed and snap again within a step renew others too", "[rubbing][virgin]") {
  // Exponential lengths have no memory: whatever came before, a bristle restarts at a rate of 1 + kappa per
  // mean length.
  constexpr std::uint32_t n = 6000;  // highest number of bristles whose path is not cut into pieces
  const std::uint32_t patches = test_size(33);
  for (double kappa : {1.0, 3.0}) {
    const double rate = 1.0 + kappa;
    TableCase c;
    c.law = SnapLength::exponential(dbar);
    c.renewal = kappa;
    const double piece = 0.25 * std::min(1.0, 2.0 / kappa);  // longest path that a step leaves in one piece
    const double bend = (1.0 - std::exp(-rate * piece)) / rate;
    const double squares =
        2.0 / (rate * rate) * (1.0 - std::exp(-rate * piece) * (1.0 + rate * piece)) - bend * bend;
    INFO("kappa " << kappa);
    double mean = 0.0;
    for (std::uint32_t seed = 1; seed <= patches; ++seed) {
      Rub rub(c, n, 1, seed);
      mean += rub.bend(rub.move(piece)) / patches;
    }
    expect_near(mean, bend, 5.0 * std::sqrt(squares / n / patches) + 0.002 * bend, "mean deflection");
  }
}

TEST_CASE("Kinetic friction and snaps of rubbed bristles are those of the tables at any step", "[rubbing]") {
  const std::uint32_t n = test_size(20000);
  for (const TableCase& c : read_cases("rubbing_summary.csv")) {
    const double f = number(c.rows[0], "f_kinetic");
    const double rate = number(c.rows[0], "snap_rate");
    for (const double step : {0.1, 1.0, 10.0, 100.0, 1e4}) {
      INFO(c.name << ", step " << step);
      Rub rub(c, n, 1);
      slide(rub, 20.0, std::min(step, 1.0));
      double bend = 0.0;
      double snaps = 0.0;
      const int steps = static_cast<int>(std::max(20.0 / step, 6.0));
      for (int k = 0; k < steps; ++k) {
        const Response r = rub.move(step);
        bend += rub.mean_bend(r) / steps;
        snaps += static_cast<double>(r.snaps) / n / step / steps;
      }
      // Tolerance: averaging over 20 lengths reduces sampling errors to a third; cutting steps into pieces
      // may add 0.5 %.
      expect_near(bend, f, 0.005 * f + sampling_error(n), "kinetic friction");
      expect_near(snaps, rate, 0.01 * rate + sampling_error(n), "snaps per length");
    }
  }
}

namespace {
// Variance of the mean deflection times n, from bristles followed one by one with a draw for each snap.
constexpr double variance = 0.151;
}  // namespace

TEST_CASE("A long slide keeps its friction, its snaps and its spread in steps of any length", "[rubbing]") {
  // Mean deflection and snap rate for lognormal 0.3, redraw, kappa 1: closed form (core/MODEL.md, 26).
  constexpr double f = 0.457730;
  constexpr double rate = 0.714737;
  const std::uint32_t n = 1000;
  const int steps = static_cast<int>(test_size(20000));
  TableCase c;
  c.law = SnapLength::lognormal(dbar, 0.3);
  c.renewal = 1.0;
  for (const double step : {0.3, 1.0, 3.0, 10.0, 100.0}) {
    INFO("step " << step);
    Rub rub(c, n, 2);
    slide(rub, 40.0, 1.0);
    double end = 0.0, mean = 0.0, snaps = 0.0, squares = 0.0;
    for (int k = 0; k < steps; ++k) {
      const Response r = rub.move(step);
      end += rub.bend(r) / steps;
      mean += rub.mean_bend(r) / steps;
      squares += (rub.bend(r) - f) * (rub.bend(r) - f) / steps;
      snaps += static_cast<double>(r.snaps) / n / step / steps;
    }
    // Counts every sixth force at a step's end as independent: those less than three apart are correlated.
    const double error = 4.0 * std::sqrt(variance / n * 6.0 / steps);
    expect_near(end, f, 0.001 * f + error, "force at the end");
    expect_near(mean, f, 0.001 * f + error, "mean force");
    expect_near(snaps, rate, 0.002 * rate + error, "snaps per length");
    expect_near(squares * n, variance, variance * (0.05 + 4.0 * std::sqrt(12.0 / steps)), "variance");
  }
}
TEST_CASE("A load that rises brings bristles that are not steady: they are followed", "[rubbing][load]") {
  TableCase c;
  c.law = SnapLength::lognormal(dbar, 0.3);
  c.renewal = 1.0;
  const std::uint32_t n = test_size(100000);
  Rub rub(c, n, 1);
  for (int k = 0; k < 40; ++k) rub.patch.step(dbar, 0.0, 0.5 * n);
  const Response risen = rub.move(30.0);
  expect_near(rub.bend(risen), 0.457730, 0.004 + 4.0 * sampling_error(n), "after the load doubled");
  const Response lower = rub.patch.step(30.0 * dbar, 0.0, 0.25 * n);
  expect_near(4.0 * rub.bend(lower), 0.457730, 0.004 + 8.0 * sampling_error(n), "after it fell to a quarter");
}

TEST_CASE("Few bristles keep their friction in steps of any length", "[rubbing]") {
  TableCase c;
  c.law = SnapLength::lognormal(dbar, 0.3);
  c.renewal = 1.0;
  const int steps = static_cast<int>(test_size(20000));
  for (const std::uint32_t n : {3u, 20u}) {
    // A bristle does not renew itself by its own snap, so friction of few bristles is higher than of
    // many.
    Rub slow(c, n, 1);
    double expected = 0.0;
    for (int k = 0; k < 5 * steps; ++k) expected += slow.bend(slow.move(0.1)) / (5 * steps);
    for (const double step : {0.3, 0.5, 3.0}) {
      INFO(n << " bristles, step " << step);
      Rub rub(c, n, 1);
      double end = 0.0, mean = 0.0;
      for (int k = 0; k < steps; ++k) {
        const Response r = rub.move(step);
        end += rub.bend(r) / steps;
        mean += rub.mean_bend(r) / steps;
      }
      const double error = 4.0 * std::sqrt(2.0 * variance / n * 6.0 / steps);
      expect_near(end, expected, 0.005 + error, "force at the end");
      // Tolerance: the library computes long slides by their steady state, whose mean force is that of many
      // bristles. It differs by up to 0.1 / n.
      expect_near(mean, expected, 0.1 / n + error, "mean force");
    }
  }
}

TEST_CASE("A long slide that stops, turns back and goes on in long steps follows the tables", "[rubbing]") {
  const std::uint32_t n = test_size(100000);
  for (const double step : {3.0, 10.0, 100.0}) {
    for (const TableCase& c : read_cases("rubbing_reversal.csv")) {
      if (c.renewal == 0.0) continue;
      INFO(c.name << ", steps of " << step);
      const double f = number(c.rows[0], "f");
      Rub rub(c, n, 1);
      const double allowed = 4.0 * sampling_error(n) + 0.005;
      slide(rub, 20.0, 1.0);
      for (int k = 0; k < 5; ++k) expect_near(rub.bend(rub.move(step)), f, allowed, "on");
      for (int k = 0; k < 3; ++k) rub.move(0.0);
      int done = 0;
      for (const Row& row : c.rows) {
        const int steps = steps_to(number(row, "y_over_dbar"), 0.1);
        if (steps == 0) continue;
        Response r;
        for (; done < steps; ++done) r = rub.move(-0.1);
        expect_near(rub.bend(r), number(row, "f"), allowed, "back");
      }
      for (int k = 0; k < 3; ++k) rub.move(-step);
      for (int k = 0; k < 3; ++k) expect_near(rub.bend(rub.move(-step)), -f, allowed, "on the way back");
      for (int k = 0; k < 3; ++k) rub.move(step);
      expect_near(rub.bend(rub.move(step)), f, allowed, "there again");
    }
  }
}

TEST_CASE("Long steps back take bristles that keep a long residual as far as it is, twice", "[rubbing]") {
  // After a slide every bristle is bent by at least the residual length. On the way back none snaps until it
  // is bent by as much the other way, after twice the residual.
  TableCase c;
  c.law = uniform;
  c.renewal = 1.0;
  c.residual = 20.0;
  const std::uint32_t n = test_size(20000);
  for (const double step : {15.0, 50.0, 300.0}) {
    INFO("steps of " << step);
    Rub rub(c, n, 1);
    slide(rub, 60.0, 0.5);
    const double f = rub.bend(rub.move(0.5));
    REQUIRE(f > 20.0);
    const double allowed = 4.0 * sampling_error(n) + 0.005;
    for (double distance = 0.0; distance < 60.0; distance += step) {
      const double bend = rub.bend(rub.move(-step));
      // The sliding bristles are bent by at most 21.5 and snap at 20.5 or more in the other direction; until
      // then they stick.
      if (distance + step <= 40.0) expect_near(bend, f - distance - step, allowed, "before any snaps");
      if (distance + step >= 60.0) expect_near(bend, -f, allowed, "steady the other way");
    }
  }
}

TEST_CASE("Rubbed bristles follow the tables through a reversal and a turn", "[rubbing]") {
  const std::uint32_t n = test_size(100000);
  for (const double step : {0.02, 0.1, 0.5}) {
    for (const TableCase& c : read_cases("rubbing_reversal.csv")) {
      INFO(c.name << ", back, step " << step);
      Rub rub(c, n, 1);
      slide(rub, 12.0, 0.25);
      int done = 0;
      for (const Row& row : c.rows) {
        const int steps = steps_to(number(row, "y_over_dbar"), step);
        if (steps == 0) continue;
        Response r;
        for (; done < steps; ++done) r = rub.move(-step);
        expect_near(rub.bend(r), number(row, "f"), 4.0 * sampling_error(n) + 0.004, "mean deflection");
      }
    }
    for (const TableCase& c : read_cases("rubbing_turn.csv")) {
      INFO(c.name << ", turned, step " << step);
      Rub rub(c, n, 2);
      slide(rub, 12.0, 0.25);
      int done = 0;
      for (const Row& row : c.rows) {
        const int steps = steps_to(number(row, "y_over_dbar"), step);
        if (steps == 0) continue;
        Response r;
        for (; done < steps; ++done) r = rub.move(0.0, step);
        expect_near(rub.bend(r, 1), number(row, "f_parallel"), 4.0 * sampling_error(n) + 0.004,
                    "along the turned path");
        expect_near(rub.bend(r, 0), number(row, "f_perp"), 4.0 * sampling_error(n) + 0.004,
                    "along the first path");
      }
    }
  }
}

TEST_CASE("Strokes of rubbed bristles neither harden nor lose their work against the tables", "[rubbing]") {
  const std::uint32_t n = test_size(5000);
  for (const TableCase& c : read_cases("rubbing_stroke.csv")) {
    Rub* rub = nullptr;
    std::string width;
    int cycle = 0;
    const double step = 0.02;
    for (const Row& row : c.rows) {
      if (row.at("half_width_over_presliding") != width) {
        delete rub;
        rub = new Rub(c, n, 1, 7);
        width = row.at("half_width_over_presliding");
        cycle = 0;
      }
      const double half = number(row, "half_width_over_presliding") * (1.0 + c.residual);
      const int steps = static_cast<int>(std::ceil(half / step));
      const int wanted = static_cast<int>(number(row, "cycle"));
      double highest = 0.0;
      double work = 0.0;
      for (; cycle < wanted; ++cycle) {
        highest = work = 0.0;
        for (int k = 0; k < 4 * steps; ++k) {
          const double d = half / steps * (k < steps || k >= 3 * steps ? 1.0 : -1.0);
          const Response r = rub->move(d);
          highest = std::max(highest, std::abs(rub->bend(r)));
          work += rub->mean_bend(r) * d;
        }
      }
      INFO(c.name << ", half width " << width << ", cycle " << wanted);
      expect_near(highest, number(row, "highest_f"), 0.01 + 6.0 * sampling_error(n), "highest force");
      expect_near(work, number(row, "loop_work"),
                  0.01 * number(row, "loop_work") + 8.0 * sampling_error(n) * half, "work of a loop");
    }
    delete rub;
  }
}

TEST_CASE("Bristles that keep their lengths are rubbed as a brute force in pieces of 1/500 length",
          "[rubbing]") {
  const std::uint32_t n = test_size(20000);
  RubbedBristles brute(n, lognormal_quantile(1.0, 0.3), 0.25, 1.0, 3);
  brute.keep = true;
  TableCase c;
  c.law = SnapLength::lognormal(dbar, 0.3);
  c.rule = SnapRule::keep;
  c.residual = 0.25;
  c.renewal = 1.0;
  Rub rub(c, n, 1);
  // Moves out by 2 mean lengths, back by half a length, out again by 2, and far back.
  for (const double distance : {2.0, -0.5, 2.0, -1.0, -3.0}) {
    for (int k = 0; k < 10; ++k) {
      const double d = distance / 10.0;
      brute.step(d, 0.0, 1.0 / 500.0);
      const Response r = rub.move(d);
      expect_near(rub.bend(r), brute.x(), 4.0 * sampling_error(n) * std::sqrt(2.0) + 0.002,
                  "mean deflection");
    }
  }
}
TEST_CASE("Where nothing snaps nothing is renewed: presliding and rest leave no trace", "[rubbing]") {
  for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
    OnePatch patch(rubbed(uniform, rule, 0.4, 1.0), plain_options(3000, 1));
    for (int k = 0; k < 60; ++k) patch.step(0.1 * dbar, 0.0, 3000.0);
    patch.step(-0.5 * dbar, 0.0, 3000.0);
    const std::uint64_t before = patch.hash();
    std::uint64_t visited = 0;
    for (int k = 0; k < 10000; ++k) {
      patch.step((k % 2 ? -0.3 : 0.3) * dbar, 0.0, 3000.0);
      visited += patch.report.bristles_visited;
    }
    CHECK(patch.hash() == before);
    if (!is_scalar(patch.batch)) CHECK(visited < 10 * 3000);
  }
}
TEST_CASE("A material without residual lets bristles beyond its lengths slip along their own deflection",
          "[rubbing]") {
  OnePatch patch(rubbed(SnapLength::single(dbar), SnapRule::keep, 2.0, 0.0), plain_options(100, 2));
  // With a residual of 2 (lengths over dbar) a bristle snaps at 3; here it is bent by 2.
  patch.step(1.2 * dbar, 1.6 * dbar, 100.0);
  patch.batch.set_material(patch.id, rubbed(SnapLength::single(dbar), SnapRule::keep, 0.5, 0.0));
  const Response r = patch.step(0.0, 0.0, 100.0);
  CHECK(r.snaps == 100);
  CHECK(r.end[0] == Approx(-100.0 * 0.3 * dbar));
  CHECK(r.end[1] == Approx(-100.0 * 0.4 * dbar));
  CHECK(r.dissipated == Approx(0.5 * 100.0 * (4.0 - 0.25) * dbar * dbar));
}

TEST_CASE("read_bristles gives the deflections that add up to the force, and lengths without the residual",
          "[rubbing]") {
  OnePatch patch(rubbed(SnapLength::uniform(0.5 * dbar, 1.5 * dbar), SnapRule::redraw, 0.4, 1.0),
                 plain_options(260, 1));  // a block of 256 bristles, and four in a second, which seldom snap
  Bristles b;
  for (int k = 0; k < 400; ++k) {
    const Response r = patch.step(0.05 * dbar, 0.0, 260.0);
    b = read(patch, 260);
    const double sum = std::accumulate(b.zx.begin(), b.zx.end(), 0.0);
    expect_near(r.elastic[0], -sum, 1e-6 * sum, "force of a stiffness of 1 N/m");
  }
  for (std::size_t i = 0; i < b.delta.size(); ++i) {
    expect(b.delta[i] > 0.499 * dbar && b.delta[i] < 1.501 * dbar, "a snap length of the law");
    expect(b.zx[i] > 0.399 * dbar && b.zx[i] < (b.delta[i] + 0.401 * dbar), "bent by the residual at least");
  }
}

TEST_CASE("Bristles of one length are drawn for renewal by seed and key", "[rubbing]") {
  // With equal lengths and keep, seed and key of a patch only decide which bristles are renewed.
  const std::uint32_t n = 2000;
  const auto bristles_of = [&](std::uint32_t seed, std::uint64_t key) {
    OnePatch patch(rubbed(SnapLength::single(dbar), SnapRule::keep, 0.0, 1.0),
                   plain_options(n).with_seed(seed).with_key(key));
    patch.step(0.0, 0.0, n);
    for (int k = 0; k < 30; ++k) patch.step(0.11 * dbar, 0.0, n);
    return read(patch, n).zx;
  };
  const std::vector<double> first = bristles_of(1, 1);
  CHECK(bristles_of(1, 1) == first);
  for (const auto& [seed, key] : {std::pair{1u, 2u}, std::pair{2u, 1u}, std::pair{1u, 0u}}) {
    const std::vector<double> other = bristles_of(seed, key);
    std::size_t apart = 0;
    for (std::size_t i = 0; i < n; ++i) apart += std::abs(other[i] - first[i]) > 0.01 * dbar;
    INFO("seed " << seed << ", key " << key << ": " << apart << " of " << n << " bristles");
    CHECK(apart > n / 4);
  }
}

TEST_CASE("A slide on another line than the last begins anew, however long the last one was", "[rubbing]") {
  // Ends the motion with steps back and aside without a snap, so that bristles lean across the next slide
  // until it has forgotten them.
  const std::uint32_t n = 20000;
  const Material material = rubbed(uniform, SnapRule::redraw, 0.0, 1.0);
  for (const double length : {10.0, 30.0, 200.0}) {
    OnePatch patch(material, plain_options(n));
    for (int k = 0; k < 200; ++k) patch.step(0.1 * dbar, 0.0, n);
    const double steady = -patch.step(0.1 * dbar, 0.0, n).elastic[0] / n / dbar;
    CHECK(patch.step(-0.3 * dbar, 0.0, n).snaps == 0);
    const Response aside = patch.step(0.0, 0.35 * dbar, n);
    CHECK(aside.snaps == 0);
    CHECK(-aside.elastic[1] / n / dbar == Approx(0.35).epsilon(0.1));
    const Response on = patch.step(length * dbar, 0.0, n);
    INFO("a step of " << length);
    CHECK(-on.elastic[0] / n / dbar == Approx(steady).epsilon(0.03));
    CHECK(-on.elastic[1] / n / dbar == Approx(0.0).margin(0.01));
  }
}

TEST_CASE("A slide that bends in long steps has the forces and losses of one in short steps",
          "[rubbing][bends]") {
  const Material material = Material::from_coefficients({});
  const double mean = material.snap_length.mean();
  const std::uint32_t n = 20000;
  const auto options = PatchOptions{}.with_bristles(n).with_axes(2).with_outputs(Outputs::all);
  for (const double length : {0.3, 0.75, 1.2, 3.0, 10.0}) {
    for (const auto& [turn, at_random] : {std::pair{0.02, false}, {0.3, false}, {0.1, true}}) {
      INFO("steps of " << length << ", turn " << turn << (at_random ? " at random" : ""));
      OnePatch patch(material, PatchOptions(options).with_seed(1));
      OnePatch judge(material, PatchOptions(options).with_seed(2));
      Bends path{turn, at_random};
      BentStep a, b;
      double off_across = 0.0;
      const int steps = 100, settle = 20;
      for (int k = 0; k < steps; ++k) {
        path.next();
        const BentStep now = step_in_parts(patch, length * mean, path.heading, 1);
        const BentStep right =
            step_in_parts(judge, length * mean, path.heading, static_cast<int>(std::ceil(length / 0.1)));
        if (k < settle) continue;
        for (const auto field : {&BentStep::end_along, &BentStep::end_across, &BentStep::mean_along,
                                 &BentStep::mean_across, &BentStep::dissipated, &BentStep::snaps}) {
          a.*field += now.*field / (steps - settle);
          b.*field += right.*field / (steps - settle);
        }
        off_across += std::pow(now.mean_across - right.mean_across, 2) / (steps - settle);
      }
      const double noise = 0.4 / std::sqrt(static_cast<double>(n));  // noise of the force of a single step, N

      // Tolerance: the library computes long slides on turning paths by their steady state, to first order in
      // the angle per step. The error grows with the square of the angle and with the curvature.
      const double allowed = turn > 0.2 ? 0.008 : 0.004;
      CHECK(a.end_along == Approx(b.end_along).epsilon(allowed));
      CHECK(a.mean_along == Approx(b.mean_along).epsilon(allowed));
      CHECK(a.dissipated == Approx(b.dissipated).epsilon(allowed));
      CHECK(a.snaps == Approx(b.snaps).epsilon(allowed));
      CHECK(a.end_across == Approx(b.end_across).margin(allowed * 0.4));
      CHECK(a.mean_across == Approx(b.mean_across).margin(allowed * 0.4));
      CHECK(std::sqrt(off_across) < 0.002 + noise);
    }
  }
}

TEST_CASE("A slide under a load that ripples has the forces and losses of one in short steps",
          "[rubbing][ripple]") {
  const Material material = Material::from_coefficients({});
  const double mean = material.snap_length.mean();
  const std::uint32_t n = 20000;
  const auto options = PatchOptions{}.with_bristles(n).with_axes(2).with_outputs(Outputs::all);
  for (const double length : {0.4, 0.75, 1.2, 3.0, 12.0})
    for (const double turn : {0.0, 0.1}) {
      INFO("steps of " << length << ", turn " << turn);
      OnePatch patch(material, PatchOptions(options).with_seed(1));
      OnePatch judge(material, PatchOptions(options).with_seed(2));
      Bends path{turn, false};
      constexpr std::size_t period = 20, cycles = 6;
      // Collects sums for each phase of the load's period, without the first period.
      std::vector<BentStep> of_patch(period), of_judge(period);
      for (std::size_t k = 0; k < period * (cycles + 1); ++k) {
        path.next();
        const BentStep now =
            step_in_parts(patch, length * mean, path.heading, 1, rippling_load(static_cast<int>(k)));
        const BentStep right =
            step_in_parts(judge, length * mean, path.heading, static_cast<int>(std::ceil(length / 0.1)),
                          rippling_load(static_cast<int>(k)));
        for (const auto field : {&BentStep::end_along, &BentStep::end_across, &BentStep::mean_along,
                                 &BentStep::mean_across, &BentStep::dissipated, &BentStep::snaps}) {
          if (k < period) continue;
          of_patch[k % period].*field += now.*field / cycles;
          of_judge[k % period].*field += right.*field / cycles;
        }
      }
      // Noise of the mean over all phases. Single phases, which show the effect of the varying load, are
      // compared by their rms difference.
      const double noise = 0.6 / std::sqrt(static_cast<double>(n) * cycles);
      for (const auto field : {&BentStep::end_along, &BentStep::mean_along, &BentStep::dissipated,
                               &BentStep::snaps, &BentStep::end_across, &BentStep::mean_across}) {
        const bool across = field == &BentStep::end_across || field == &BentStep::mean_across;
        double patch_sum = 0.0, judge_sum = 0.0, off = 0.0;
        for (std::size_t k = 0; k < period; ++k) {
          patch_sum += of_patch[k].*field;
          judge_sum += of_judge[k].*field;
          off += std::pow(of_patch[k].*field - of_judge[k].*field, 2) / period;
        }
        const double scale = across ? 0.4 * period : judge_sum;
        CHECK(patch_sum == Approx(judge_sum).margin(0.003 * scale));
        CHECK(std::sqrt(off) < (0.004 + 3.0 * noise) * scale / period);
      }
    }
}

TEST_CASE("A load that rises in a slide costs a slide's steps twice at most", "[rubbing][ripple]") {
  const Material material = Material::from_coefficients({});
  const double mean = material.snap_length.mean();
  for (const double length : {0.1, 0.4, 1.2, 3.0, 12.0, 120.0}) {
    OnePatch still(material, PatchOptions{}.with_bristles(10000).with_axes(2));
    OnePatch ripples(material, PatchOptions{}.with_bristles(10000).with_axes(2));
    double visits = 0.0, of_ripples = 0.0;
    for (int k = 0; k < 80; ++k) {
      step_in_parts(still, length * mean, 0.0, 1, 1.0 / 1.1);
      step_in_parts(ripples, length * mean, 0.0, 1, rippling_load(k));
      if (k < 40) continue;
      visits += static_cast<double>(still.report.bristles_visited);
      of_ripples += static_cast<double>(ripples.report.bristles_visited);
    }
    INFO("steps of " << length << ": " << of_ripples / visits);
    CHECK(of_ripples <= 1.5 * visits);
  }
}
TEST_CASE("A step round a bend visits bristles twice as often as a straight one at most",
          "[rubbing][bends]") {
  const Material material = Material::from_coefficients({});
  const double mean = material.snap_length.mean();
  const std::uint32_t n = 4000;
  const auto visits = [&](double length, double turn) {
    OnePatch patch(material, PatchOptions{}.with_bristles(n).with_axes(2));
    Bends path{turn, false};
    for (int k = 0; k < 60; ++k) {
      path.next();
      step_in_parts(patch, length * mean, path.heading, 1);
    }
    return static_cast<double>(patch.report.bristles_visited);
  };
  for (const double length : {0.1, 0.4, 1.2, 3.0, 12.0, 120.0})
    for (const double turn : {0.001, 0.02, 0.1, 0.3}) {
      INFO("steps of " << length << ", turn " << turn);
      CHECK(visits(length, turn) <= 2.0 * visits(length, 0.0));
    }
}

TEST_CASE("A slide that bends keeps its energy", "[rubbing][bends][energy]") {
  for (const SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
    for (const Precision precision : precisions()) {
      const Material material = rubbed(SnapLength::lognormal(dbar, 0.3), rule, 0.2, 1.0);
      const std::uint32_t n = test_size(7000);
      OnePatch one(material, plain_options(n, 2, precision));
      int off = 0;
      Bends path{0.1, true};
      for (int k = 0; k < 40; ++k) {
        path.next();
        const double length = dbar * (k % 3 == 0 ? 0.7 : k % 3 == 1 ? 2.0 : 30.0);
        const double d[2] = {length * std::cos(path.heading), length * std::sin(path.heading)};
        const double before = one.energy();
        const Response r = one.step(d[0], d[1], n * (k % 8 == 7 ? 0.9003 : 0.8001));
        const double work = -(r.mean[0] - r.damper[0]) * d[0] - (r.mean[1] - r.damper[1]) * d[1];
        const double lost = work - (one.energy() - before) - r.dissipated - r.contact_loss;
        if (!(std::abs(lost) <= (precision == Precision::double_ ? 1e-11 : 2e-6) * work)) ++off;
      }
      CHECK(off == 0);
    }
  }
}

TEST_CASE("The error of renewal in long steps falls with the number of bristles", "[rubbing][physics]") {
  // Takes steps of 0.4 dbar in random directions. The reference solves for the mean of infinitely many
  // bristles in small pieces of the path, so it has no sampling noise.
  std::vector<double> quantiles, lengths;
  for (int i = 0; i <= 256; ++i) {
    lengths.push_back(SnapLength::lognormal(dbar, 0.3).quantile((i + 0.5) / 257.0));
    quantiles.push_back(lengths.back() / dbar);
  }
  const Material material = rubbed(SnapLength::table(lengths), SnapRule::redraw, 0.0, 1.0);
  const auto error_of = [&](std::uint32_t bristles) {
    OnePatch patch(material, plain_options(bristles).with_axes(2));
    SmallPieces truth(quantiles, 0.0, 1.0);
    std::mt19937_64 random(5);
    double errors = 0.0, forces = 0.0;
    for (int k = 0; k < 60; ++k) {
      const double angle = 6.2831853 * static_cast<double>(random() >> 11) * 0x1p-53;
      const double dx = 0.4 * std::cos(angle), dy = 0.4 * std::sin(angle);
      truth.step(dx, dy, 0.01);
      const Response r = patch.step(dx * dbar, dy * dbar, bristles);
      const double unit = bristles * dbar;
      errors += std::pow(r.elastic[0] / unit + truth.x(), 2) + std::pow(r.elastic[1] / unit + truth.y(), 2);
      forces += std::pow(truth.x(), 2) + std::pow(truth.y(), 2);
    }
    return std::sqrt(errors / forces);
  };
  CHECK(error_of(1000) < 0.035);
  CHECK(error_of(10000) < 0.014);
  if (test_size(10) < 10) return;
  CHECK(error_of(100000) < 0.0045);
  CHECK(error_of(400000) < 0.0028);
}

}  // namespace bristle_test::test_rubbing_representatives
