// Extreme materials: lengths, stiffnesses and dampers from zero to far beyond use, and no spread at all.
#include <catch2/catch.hpp>

#include <cmath>

#include "extreme_cases.hpp"
#include "statistics.hpp"

namespace bristle_test::test_extreme_materials {

TEST_CASE("Snap lengths from picometres to hundreds of metres behave alike", "[extremes]") {
  for (const Kind& kind : kinds()) {
    for (double mean : {1e-11, 1e-9, 1e-3, 1.0, 600.0, 666.0}) {
      INFO(kind.name() << ", mean snap length " << mean << " m");
      OnePatch patch(plain_material(SnapLength::uniform(0.5 * mean, 1.5 * mean), kind.rule),
                     plain_options(2000, kind.axes, kind.precision));
      patch.step(0.0, 0.0, 2000.0);
      const Response stick = patch.step(0.3 * mean, 0.0, 2000.0);
      expect_near(-stick.elastic[0] / (2000.0 * mean), 0.3, 1e-6, "force in stick");
      const Response peak = patch.step(0.7 * mean, 0.0, 2000.0);
      expect_near(-peak.elastic[0] / (2000.0 * mean), 0.625, 0.01, "force at the peak");
      const Response far = patch.step(1000.37 * mean, 0.0, 2000.0);
      const double bend = kind.rule == SnapRule::keep ? 0.5 : (1.0 + 1.0 / 12.0) / 2.0;
      expect_near(-far.elastic[0] / (2000.0 * mean), bend, 0.05, "force far on");
      expect_near(far.dissipated / (2000.0 * mean * mean), 1000.0 * bend, 5.0, "energy lost");
    }
    // Tests the longest snap length that a material may have, 1 km.
    INFO(kind.name() << ", a single snap length of 1e3 m");
    OnePatch patch(plain_material(SnapLength::single(1e3), kind.rule),
                   plain_options(300, kind.axes, kind.precision));
    patch.step(0.0, 0.0, 300.0);
    expect_near(friction_along(step_along(patch, kind, 999.0, 300.0), kind), 300.0 * 999.0, 1.0, "stick");
    expect_near(friction_along(step_along(patch, kind, 2.0, 300.0), kind), 300.0, 1.0, "after the snap");
    // A displacement of a millimetre, small beside a snap length of 1 km, still changes the force.
    expect_near(friction_along(step_along(patch, kind, 1e-3, 300.0), kind), 300.3, 0.05, "a millimetre on");
  }
}

TEST_CASE("Without stiffness there is no elastic force, and with a huge one it is finite", "[extremes]") {
  for (const Kind& kind : kinds()) {
    const PatchOptions options = plain_options(300, kind.axes, kind.precision);
    const Material material = plain_material(uniform, kind.rule);
    OnePatch soft(Material(material).with_bristle_stiffness(0.0), options);
    OnePatch hard(Material(material).with_bristle_stiffness(1e12), options);
    OnePatch plain(material, options);
    for (int k = 0; k < 30; ++k) {
      const Response s = step_along(soft, kind, 0.7 * dbar, 300.0);
      const Response h = step_along(hard, kind, 0.7 * dbar, 300.0);
      const Response p = step_along(plain, kind, 0.7 * dbar, 300.0);
      expect(
          s.end[0] == 0.0 && s.end[1] == 0.0 && s.mean[0] == 0.0 && s.dissipated == 0.0 && s.stiffness == 0.0,
          "no stiffness, no force");
      expect(s.snaps == p.snaps, "the motion of the bristles is the same");
      check_finite(h);
      expect_near(h.elastic[0], 1e12 * p.elastic[0], 1e-9 * std::abs(h.elastic[0]), "force in proportion");
      expect_near(h.dissipated, 1e12 * p.dissipated, 1e-9 * h.dissipated, "dissipation in proportion");
    }
  }
}

TEST_CASE("A law without spread is a single length, and one of next to no spread nearly one", "[extremes]") {
  for (const Kind& kind : kinds()) {
    const PatchOptions options = plain_options(300, kind.axes, kind.precision);
    OnePatch plain(plain_material(SnapLength::single(dbar), kind.rule), options);
    // Law with so small a spread that a freshly drawn length hardly differs from the old one.
    OnePatch nearly(plain_material(SnapLength::lognormal(dbar, 1e-9), kind.rule), options);
    INFO(kind.name());
    for (const OnePatch* patch : {&plain, &nearly})
      CHECK_THAT(patch->batch.info(patch->id).kernel, Catch::Contains("keep"));
    plain.step(0.0, 0.0, 300.0);
    double x = 0.0;
    for (int k = 0; k < 200; ++k) {
      const double d = (k % 7 == 0 ? 3.31 : 0.17) * dbar;
      x += d;
      const Response r = step_along(plain, kind, d, 300.0);
      // With equal snap lengths all bristles snap together for ever: the force is a saw-tooth of the path.
      const double phase = x / dbar - std::floor(x / dbar);
      const double tolerance = kind.is_double() ? 1e-11 : 1e-4;
      if (phase > tolerance && phase < 1.0 - tolerance)
        expect_near(friction_along(r, kind), 300.0 * phase * dbar, 300.0 * tolerance * dbar, "saw-tooth");
      const Response near = step_along(nearly, kind, d, 300.0);
      if (phase > 1e-3 && phase < 1.0 - 1e-3)
        expect_near(near.elastic[0], r.elastic[0], 1e-3 * 300.0 * dbar, "nearly the same force");
    }
  }
}

TEST_CASE("Bristles that snap at next to nothing are stepped in bounded time and balance", "[extremes]") {
  // Laws with lengths of 1e-8 of the mean and below: 2^-24 of the exponential law, 0 of the uniform one, and
  // half the bristles near 1e-12 m.
  const double edge[] = {0.0, 1e-12, 2.0 * dbar, 2.0 * dbar};
  const std::vector<SnapLength> short_laws = {SnapLength::exponential(dbar),
                                              SnapLength::uniform(0.0, 2.0 * dbar), SnapLength::table(edge)};
  const std::uint32_t n = 20000;
  for (const Kind& kind : kinds()) {
    for (const SnapLength& law : short_laws) {
      INFO(kind.name() << ", " << to_string(law.law()));
      OnePatch patch(plain_material(law, kind.rule), plain_options(n, kind.axes, kind.precision));
      patch.step(0.0, 0.0, n);
      const double bend = kind.rule == SnapRule::keep ? 0.5 * law.mean() : 0.5 * law.moment(2) / law.mean();
      for (double lengths : {1e-3, 0.1, 1.0, 10.0, 300.0, 1e5}) {
        const double before = patch.energy();
        const Response r = step_along(patch, kind, lengths * dbar, n);
        check_finite(r);
        const double work = -(r.mean[0] * kind.ex() + r.mean[1] * kind.ey()) * lengths * dbar;
        const double involved = before + patch.energy() + r.dissipated + work;
        // Tolerance: positions are rounded to 2^-44 of a length near the mean, and the force of each block by
        // as much.
        const double grain = 4.0 * 0x1p-44 * 2.0 * dbar * (n * dbar + lengths * dbar * n / 256.0);
        expect_near(work, patch.energy() - before + r.dissipated,
                    (kind.is_double() ? 1e-12 : 1e-6) * involved + grain, "work");
        if (lengths >= 300.0) expect_near(work / (n * bend * lengths * dbar), 1.0, 0.02, "friction");
      }
      const Bristles b = read(patch, n);
      for (std::uint32_t i = 0; i < n; ++i)
        expect(b.delta[i] > 0.0 && std::hypot(b.zx[i], b.zy[i]) <= b.delta[i] * (1.0 + 1e-6),
               "|z| is within delta, and delta above 0");
    }
  }
}

TEST_CASE("Without bristle damping, or with a Stribeck velocity of 0, there is no damper", "[extremes]") {
  for (const Kind& kind : kinds()) {
    INFO(kind.name());
    const PatchOptions options = plain_options(300, kind.axes, kind.precision);
    const Material plain = plain_material(uniform, kind.rule);
    OnePatch none(plain, options);
    OnePatch no_sigma1(Material(plain).with_bristle_damping(0.0).with_stribeck_velocity(1e-3), options);
    OnePatch no_vs(Material(plain).with_bristle_damping(1e12).with_stribeck_velocity(0.0), options);
    OnePatch viscous(
        Material(plain).with_bristle_damping(1e12).with_stribeck_velocity(0.0).with_viscous_friction(0.7),
        options);
    for (int k = 0; k < 50; ++k) {
      const double d = (k % 5 - 1) * 0.7 * dbar;
      const Response r = step_along(none, kind, d, 300.0);
      expect(r.damping == 0.0 && r.damper[0] == 0.0 && r.damper[1] == 0.0 && r.damper_work == 0.0,
             "no damper");
      for (OnePatch* other : {&no_sigma1, &no_vs}) {
        const Response same = step_along(*other, kind, d, 300.0);
        expect(first_difference(same, r).empty(), "the same in every output");
      }
      const Response wet = step_along(viscous, kind, d, 300.0);
      expect_near(wet.damping, 0.7, 0.0, "the lubricant is left");
      expect_near(wet.damper_work, 0.7 * d * d / tick, 1e-12 * d * d / tick, "and its work");
      expect(wet.elastic[0] == r.elastic[0], "elastic force the same");
    }
  }
}

}  // namespace bristle_test::test_extreme_materials
