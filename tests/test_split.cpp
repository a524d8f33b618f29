// Event-exact steps: cutting a straight step in two changes nothing.
#include <catch2/catch.hpp>

#include <cmath>
#include <random>

#include "expect.hpp"
#include "scenes.hpp"

namespace bristle_test::test_split {

namespace {

/// Compares a patch that moved by (dx, dy) in one step with one that moved there in two straight parts.
void check_split(const SnapLength& law, SnapRule rule, int axes, Precision precision, double longest_step) {
  const std::uint32_t n = 2000;
  const double stiffness_n = n;
  std::mt19937_64 random(17);
  std::uniform_real_distribution<double> flat(-1.0, 1.0);
  OnePatch whole(plain_material(law, rule), plain_options(n, axes, precision));
  OnePatch parts(plain_material(law, rule), plain_options(n, axes, precision));
  whole.step(0.0, 0.0, n);
  parts.step(0.0, 0.0, n);
  std::uint32_t ties = 0;
  const int steps = 40;
  for (int k = 0; k < steps; ++k) {
    const double angle = M_PI * flat(random);
    const double length = longest_step * (0.55 + 0.45 * flat(random));
    const double dx = axes == 2 ? length * std::cos(angle) : std::copysign(length, angle);
    const double dy = axes == 2 ? length * std::sin(angle) : 0.0;
    const double share = 0.5 + 0.45 * flat(random);

    // Gives both patches equal bits at each round's start, so that earlier rounding is not counted again.
    parts.batch.restore_state(saved_state(whole.batch));

    const Response once = whole.step(dx, dy, n);
    const Response first = parts.step(share * dx, share * dy, n);
    const Response second = parts.step(dx - share * dx, dy - share * dy, n);

    const Bristles a = read(whole, n);
    const Bristles b = read(parts, n);
    // Allowed error of a deflection: a share of the bristle's snap length, plus a share of the mean length
    // and of the path. Positions are fixed point with a unit of 2^-44 of a length near the mean, so a bristle
    // much shorter than the mean may have a larger relative error.
    const bool in_double = precision == Precision::double_;
    const double of_length = in_double ? 1e-12 : 1e-4;
    const double of_path = in_double ? 2e-13 : 0x1p-22;
    std::uint32_t apart = 0;
    for (std::uint32_t i = 0; i < n; ++i) {
      const bool same_z = std::hypot(a.zx[i] - b.zx[i], a.zy[i] - b.zy[i]) <=
                          of_length * a.delta[i] + of_path * (dbar + length);
      if (!same_z || a.delta[i] != b.delta[i]) ++apart;
    }
    ties += apart;
    if (apart > 0) continue;
    const double path = length / dbar + 1.0;
    const double rounding = (precision == Precision::double_ ? 1e-12 : 1e-6) * stiffness_n * dbar * path;
    expect_near(static_cast<double>(first.snaps + second.snaps), static_cast<double>(once.snaps), 0.0,
                "snaps of the parts");
    expect_near(first.dissipated + second.dissipated, once.dissipated, 0.5 * rounding * dbar,
                "energy lost by the parts");
    for (int axis = 0; axis < 2; ++axis) {
      expect_near(second.end[axis], once.end[axis], rounding, "end force");
      expect_near(share * first.mean[axis] + (1.0 - share) * second.mean[axis], once.mean[axis], rounding,
                  "mean force of the parts, weighted by their length");
    }
  }
  // A bristle may end a step in two parts elsewhere than the whole step only if, at the split or at the end,
  // its deflection is within rounding of its snap length delta. In double that is expected of no bristle. In
  // float its chance in each step is about 2^-22 (2 + path / dbar) dbar / delta, with the length `path` of
  // the step and the mean snap length dbar.
  const double shorter =
      // bound on the mean of dbar over the snap length
      law.law() == bristle::SnapLaw::exponential ? 12.0 : 2.0;
  const double chance =
      precision == Precision::double_ ? 0.0 : 0x1p-22 * (2.0 + longest_step / dbar) * shorter;
  const double expected = chance * n * steps;
  expect(ties <= expected + 5.0 * std::sqrt(expected), "bristles at a tie are few");
  UNSCOPED_INFO("bristles at a tie: " << ties << " of " << n * steps);
}

}  // namespace

TEST_CASE("Splitting a straight step in two gives the same end state with keep", "[step]") {
  for (Precision precision : precisions()) {
    for (const NamedLaw& law : reference_laws()) {
      for (int axes : {1, 2}) {
        for (double longest : {0.8, 4.0, 60.0}) {
          INFO(name_of(precision) << ", " << law.name << ", axes " << axes << ", steps to " << longest
                                  << " mean lengths");
          check_split(law.law, SnapRule::keep, axes, precision, longest * dbar);
        }
      }
    }
  }
}

TEST_CASE("Splitting a straight step in two gives the same end state with redraw while nothing jumps",
          "[step]") {
  // Keeps steps below 3.4 mean lengths (at cv 0.3), from which on a step jumps over many snaps at
  // once.
  for (Precision precision : precisions()) {
    for (const NamedLaw& law : reference_laws()) {
      if (law.law.law() == bristle::SnapLaw::exponential)
        continue;  // skips this law, for which steps of any length jump, exact in distribution only
      for (int axes : {1, 2}) {
        for (double longest : {0.8, 2.5}) {
          INFO(name_of(precision) << ", " << law.name << ", axes " << axes << ", steps to " << longest
                                  << " mean lengths");
          check_split(law.law, SnapRule::redraw, axes, precision, longest * dbar);
        }
      }
    }
  }
}

}  // namespace bristle_test::test_split
