// The infinite brush in hard cases: endless creep, load noise and load jumps, tremor of every amplitude,
// steps of every length, equal histories.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <random>

#include "expect.hpp"
#include "infinite_brush.hpp"
#include "scenes.hpp"

namespace bristle_test::test_cohort_extremes {

namespace {

OnePatch make_brush(const SnapLength& law, const PatchOptions& options = infinite_options()) {
  return OnePatch(plain_material(law, SnapRule::redraw), options);
}

double deflection(const Response& r, double load) { return -r.elastic[0] / (load * dbar); }

}  // namespace

TEST_CASE("Three million steps of 1e-12 m end where hundred of 3e-8 m do", "[cohorts][extreme][creep]") {
  // Moves both patches along the same path from straight bristles, one in slow steps. Under the exponential
  // law the weakest bristles snap from the start.
  for (const SnapLength& law : {lognormal, SnapLength::exponential(dbar)}) {
    OnePatch slow = make_brush(law, infinite_options(16.0, 1));
    OnePatch fast = make_brush(law, infinite_options(16.0, 1));
    const int steps = static_cast<int>(test_size(3000000));
    Response a, b;
    for (int i = 0; i < steps; ++i) a = slow.step(1e-12, 0.0, load_n);
    for (int i = 0; i < 100; ++i) b = fast.step(steps * 1e-14, 0.0, load_n);
    INFO(to_string(law.law()) << ": " << deflection(a, load_n) << " and " << deflection(b, load_n));
    CHECK(deflection(b, load_n) > 0.5 * steps * 1e-12 / dbar);
    expect_near(deflection(a, load_n), deflection(b, load_n), 1e-3 * kinetic(law), "mean deflection");
  }
}

TEST_CASE("A million steps of load noise at rest cost what the lowest load costs, once",
          "[cohorts][extreme][load]") {
  OnePatch patch = make_brush(lognormal);
  for (int i = 0; i < 300; ++i) patch.step(0.03 * dbar, 0.01 * dbar, 0.5 * load_n);
  const double sliding = patch.step(0.0, 0.0, 0.5 * load_n).elastic[0];
  patch.step(0.0, 0.0, 0.495 * load_n);
  const double force = patch.step(0.0, 0.0, 0.5 * load_n).elastic[0];
  CHECK(force == Approx(sliding).epsilon(0.011));
  // The force differs, so bristles that entered last have left.
  CHECK(std::abs(force / sliding - 1.0) > 0.001);
  std::mt19937 generator(2);
  std::uniform_real_distribution<double> flat(0.99, 1.01);
  const int steps = static_cast<int>(test_size(1000000));
  double farthest = 0.0;
  for (int i = 0; i < steps; ++i) {
    const Response r = patch.step(0.0, 0.0, 0.5 * load_n * flat(generator));
    farthest = std::max(farthest, std::abs(r.elastic[0] / force - 1.0));
  }
  INFO("farthest " << farthest);
  CHECK(farthest < 1e-9);
}

TEST_CASE("Loads that jump by a factor of a million keep force, energy and friction right",
          "[cohorts][extreme][load]") {
  for (const SnapLength& law :
       {lognormal, SnapLength::exponential(dbar), SnapLength::uniform(0.5 * dbar, 1.5 * dbar)}) {
    OnePatch patch = make_brush(law);
    double worst = 0.0;
    for (int round = 0; round < 50; ++round) {
      const double load = round % 2 == 0 ? load_n : 1e-6 * load_n;
      Response r;
      for (int i = 0; i < 160; ++i) {
        const double before = patch.energy();
        r = patch.step(0.1 * dbar, 0.0, load);
        const double work = -r.mean[0] * 0.1 * dbar;
        const double after = patch.energy();
        const double error = work - (after - before) - r.dissipated - r.contact_loss;
        worst = std::max(worst, std::abs(error) / (std::abs(work) + before + after));
      }
      INFO(to_string(law.law()) << ", load " << load);
      REQUIRE(deflection(r, load) == Approx(kinetic(law)).epsilon(5e-3));
    }
    CHECK(worst < 1e-12);
  }
}

TEST_CASE("Tremor of every amplitude keeps its error over hundreds of cycles", "[cohorts][extreme]") {
  const double unit = kinetic(lognormal);
  for (double amplitude : {1e-6, 1e-4, 1e-2, 0.1, 0.5, 1.0, 3.0}) {
    OnePatch brush = make_brush(lognormal), fine = make_brush(lognormal, infinite_options(32.0));
    for (OnePatch* p : {&brush, &fine})
      for (int i = 0; i < 100; ++i) p->step(0.1 * dbar, 0.02 * dbar, load_n);
    double squares = 0.0;
    const int steps = static_cast<int>(test_size(12000));
    for (int i = 0; i < steps; ++i) {
      const auto position = [](int k) { return std::sin(0.157 * k) + 0.3 * std::sin(0.0523 * k); };
      const double dx = amplitude * dbar * (position(i + 1) - position(i));
      const double dy = 0.4 * amplitude * dbar * (std::sin(0.21 * (i + 1)) - std::sin(0.21 * i));
      const Response a = brush.step(dx, dy, load_n), b = fine.step(dx, dy, load_n);
      squares += std::pow((a.elastic[0] - b.elastic[0]) / (load_n * dbar), 2) +
                 std::pow((a.elastic[1] - b.elastic[1]) / (load_n * dbar), 2);
    }
    const double percent = 100.0 * std::sqrt(squares / steps) / unit;
    INFO("amplitude " << amplitude << ": rms " << percent << " % of kinetic friction");
    CHECK(percent < (amplitude == 1.0 ? 0.8 : 0.15));
  }
}

TEST_CASE("Steps of 1e-3 to 1e200 lengths are the same slide for every law", "[cohorts][extreme]") {
  // Laws of increasing spread. One of spread 2 forgets its start only after hundreds of lengths, and its
  // longest bristles, one in a hundred thousand, carry 1 % of the force.
  for (const SnapLength& law : {SnapLength::uniform(0.5 * dbar, 1.5 * dbar), lognormal,
                                SnapLength::lognormal(dbar, 1.0), SnapLength::lognormal(dbar, 2.0),
                                SnapLength::exponential(dbar), SnapLength::normal(dbar, 0.1 * dbar)}) {
    for (double stroke : {1e-3, 1e-2, 0.1, 1.0, 10.0, 100.0, 1e3, 1e4, 1e5, 1e12, 1e200}) {
      OnePatch patch = make_brush(law);
      const double path = law.cv() > 1.5 && stroke > 5e-3 ? 4000.0 : 80.0;
      const int steps = std::max(1, static_cast<int>(path / stroke));
      Response r;
      for (int i = 0; i < steps; ++i) r = patch.step(stroke * dbar, 0.0, load_n);
      INFO(to_string(law.law()) << ", cv " << law.cv() << ", steps of " << stroke << ": "
                                << deflection(r, load_n) / kinetic(law));
      if (law.cv() > 1.5 && path < 1000.0)
        CHECK(deflection(r, load_n) > 0.5);
      else
        CHECK(deflection(r, load_n) == Approx(kinetic(law)).epsilon(0.003));
      if (stroke > 1e3) CHECK(r.mean[0] == Approx(r.end[0]).epsilon(0.01));
      CHECK(std::isfinite(r.dissipated));
    }
  }
}
TEST_CASE("Long strokes leave nothing behind: friction after 200 of them is that of the first", "[cohorts]") {
  // Cases with strokes so long that bristles which outlive them carry below 1e-6 of the force. (Strokes of 20
  // lengths at a spread of 0.6 do harden, by 1.3 %: the longest bristles outlive them.)
  struct Case {
    double spread, stroke;
  };
  for (const Case& c : {Case{0.3, 20.0}, Case{0.4, 20.0}, Case{0.6, 60.0}}) {
    INFO("spread " << c.spread << ", strokes of " << c.stroke);
    const SnapLength law = SnapLength::lognormal(dbar, c.spread);
    Brush brush(law, infinite_options());
    const int steps = static_cast<int>(c.stroke / 0.5);
    double force = 0.0;
    for (int stroke = 0; stroke < static_cast<int>(test_size(200)); ++stroke) {
      const double distance = stroke % 2 == 0 ? 0.5 : -0.5;
      for (int i = 0; i < steps; ++i) brush.step(distance);
      force = std::abs(brush.x());
    }
    CHECK(force == Approx(kinetic(law)).epsilon(2e-3));
  }
}

}  // namespace bristle_test::test_cohort_extremes
