// The plain loops that the benchmarks compare with compute bristle's physics.
#include <catch2/catch.hpp>

#include <cmath>
#include <random>

#include "bench/plain_loops.hpp"
#include "expect.hpp"
#include "reference_table.hpp"

namespace bristle_test::test_plain_loops {

using bristle::plain::Force;
using bristle::plain::PlainLoop;
using bristle::plain::PlainOptions;
using bristle::plain::Rule;
using bristle::plain::Style;

namespace {

constexpr double dbar = 10e-6;  // m

PlainOptions plain(std::size_t bristles, int axes, Rule rule, bool mean, Style style) {
  PlainOptions options;
  options.bristles = bristles;
  options.mean_snap_length_m = dbar;
  options.axes = axes;
  options.rule = rule;
  options.mean = mean;
  options.style = style;
  return options;
}

double drawn_length(std::mt19937& generator) {
  return std::uniform_real_distribution<double>(0.01, 2.0)(generator) * dbar;
}

/// Returns the deflection over dbar, averaged over steps of `step` dbar after 40 dbar of sliding along (0.8,
/// 0.6).
double steady_force(PlainLoop& loop, double step, bool mean) {
  const double dx = 0.8 * step * dbar;
  const double dy = 0.6 * step * dbar;
  for (double path = 0.0; path < 40.0; path += step) loop.step(dx, dy);
  const int steps = 400;
  double sum = 0.0;
  for (int i = 0; i < steps; ++i) {
    const Force force = loop.step(dx, dy);
    const double* f = mean ? force.mean : force.end;
    sum -= 0.8 * f[0] + 0.6 * f[1];
  }
  return sum / (steps * static_cast<double>(loop.size()) * dbar);
}

}  // namespace

TEST_CASE("The plain keep loop ends one step where the table of exact vectors says", "[bench]") {
  const std::size_t count = 41;  // number of bristles: whole vectors and a remainder, whatever the width
  for (const Row& row : read_table("exact_step_vectors.csv")) {
    const bool straight = number(row, "zy0") == 0.0 && number(row, "dy") == 0.0;
    const double path = std::hypot(number(row, "dx"), number(row, "dy"));
    const double tolerance = 0x1p-21 * (path + 2.0 * number(row, "delta")) * dbar;
    for (int axes : {1, 2}) {
      if (axes == 1 && !straight) continue;
      for (Style style : {Style::one_loop, Style::chunked}) {
        PlainLoop loop(plain(count, axes, Rule::keep, true, style));
        for (std::size_t i = 0; i < count; ++i) {
          loop.set(i, {number(row, "zx0") * dbar, number(row, "zy0") * dbar, number(row, "delta") * dbar});
        }
        const Force force = loop.step(number(row, "dx") * dbar, number(row, "dy") * dbar);
        for (std::size_t i = 0; i < count; ++i) {
          expect_near(loop.get(i).zx, number(row, "zx1") * dbar, tolerance, "deflection x");
          expect_near(loop.get(i).zy, number(row, "zy1") * dbar, tolerance, "deflection y");
        }
        const double sum = static_cast<double>(count);
        expect_near(force.end[0], -sum * number(row, "zx1") * dbar, sum * tolerance, "end force x");
        expect_near(force.end[1], -sum * number(row, "zy1") * dbar, sum * tolerance, "end force y");
        expect_near(force.mean[0], -sum * number(row, "mean_zx_over_step") * dbar, sum * tolerance,
                    "mean force x");
        expect_near(force.mean[1], -sum * number(row, "mean_zy_over_step") * dbar, sum * tolerance,
                    "mean force y");
      }
    }
  }
}

TEST_CASE("Both styles of the plain loop take every bristle the same way", "[bench]") {
  for (Rule rule : {Rule::keep, Rule::redraw}) {
    for (int axes : {1, 2}) {
      const std::size_t count = 2500;  // number of bristles: two chunks and a part
      PlainLoop one(plain(count, axes, rule, true, Style::one_loop));
      PlainLoop chunked(plain(count, axes, rule, true, Style::chunked));
      std::mt19937 generator(7);
      std::uniform_real_distribution<double> direction(-1.0, 1.0);
      for (int step = 0; step < 60; ++step) {
        const double dx = direction(generator) * drawn_length(generator);
        const double dy = axes == 2 ? direction(generator) * drawn_length(generator) : 0.0;
        const Force a = one.step(dx, dy);
        const Force b = chunked.step(dx, dy);
        // Tolerance: rounding may decide whether one bristle snaps, which changes force by a few lengths.
        for (int axis = 0; axis < 2; ++axis) {
          expect_near(a.end[axis], b.end[axis], 3.0 * dbar, "end force");
          expect_near(a.mean[axis], b.mean[axis], 3.0 * dbar, "mean force");
        }
      }
      int apart = 0;
      for (std::size_t i = 0; i < count; ++i) {
        const auto a = one.get(i);
        const auto b = chunked.get(i);
        const double off = std::hypot(a.zx - b.zx, a.zy - b.zy) + std::abs(a.delta - b.delta);
        if (off > 1e-3 * dbar) ++apart;
        expect(std::hypot(a.zx, a.zy) <= a.delta * (1.0 + 1e-5), "no bristle is beyond its snap length");
        expect(a.delta >= 0.4999 * dbar && a.delta <= 1.5001 * dbar, "snap lengths stay in their range");
      }
      CHECK(apart <= 3);
    }
  }
}

TEST_CASE("The plain loops slide at the kinetic force of the model", "[bench]") {
  // Expected mean deflection over dbar for lengths uniform on 0.5 to 1.5 dbar, with moments m1 and m2: m1/2
  // for keep, m2/(2 m1) for redraw.
  const std::size_t count = 20000;
  for (Style style : {Style::one_loop, Style::chunked}) {
    for (double step : {0.01, 0.37, 1.0, 2.3}) {
      PlainLoop keep(plain(count, 2, Rule::keep, true, style));
      CHECK(steady_force(keep, step, true) == Approx(0.5).margin(2e-3));
      PlainLoop redraw(plain(count, 2, Rule::redraw, true, style));
      // A bristle's deflection has a standard deviation of 0.35 dbar, so the mean of 20000 has one of 0.0025
      // dbar. Four times that is allowed.
      CHECK(steady_force(redraw, step, true) == Approx(13.0 / 24.0).margin(1e-2));
      CHECK(steady_force(redraw, step, false) == Approx(13.0 / 24.0).margin(1e-2));
    }
  }
}

TEST_CASE("The streaming loop counts the bytes it reads and writes", "[bench]") {
  bristle::plain::StreamLoop stream(1000, 3, 2);
  CHECK(stream.bytes() == 1000 * 4 * (3 + 2));
  // The stream's first step turns two columns of 1000 zeros into ones, the second turns them back.
  CHECK(stream.step() == 2.0 * 1000.0);
  CHECK(stream.step() == 0.0);
}

}  // namespace bristle_test::test_plain_loops
