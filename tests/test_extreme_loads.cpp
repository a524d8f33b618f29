// Extreme loads and numbers of bristles: zero, nearly zero, a million newton, jumps at every step.
#include <catch2/catch.hpp>

#include <cmath>
#include <limits>

#include "extreme_cases.hpp"

namespace bristle_test::test_extreme_loads {

TEST_CASE("Loads from nothing to a million newton give forces in proportion", "[extremes]") {
  for (const Kind& kind : kinds()) {
    for (double max_load : {1e-12, 1.0, 1e6}) {
      for (std::uint32_t n : {1u, 300u}) {
        INFO(kind.name() << ", maximum load " << max_load << " N, " << n << " bristles");
        OnePatch patch(plain_material(uniform, kind.rule),
                       plain_options(n, kind.axes, kind.precision).with_max_normal_load(max_load));
        patch.step(0.0, 0.0, max_load);
        Response r = step_along(patch, kind, 0.4 * dbar, max_load);
        expect_near(friction_along(r, kind), max_load * 0.4 * dbar, 1e-6 * max_load * dbar, "force");
        expect_near(r.stiffness, max_load, 1e-12 * max_load, "stiffness");
        check_finite(r);
        // Applies so small a share of the load that only a tiny fraction of the first bristle is in contact.
        r = patch.step(0.0, 0.0, 1e-12 * max_load);
        // Tolerance: sums of deflections are rounded to 2^-44 of a length near the mean, for one
        // representative.
        expect_near(friction_along(r, kind), 1e-12 * max_load * 0.4 * dbar,
                    0x1p-44 * 2.0 * 2.0 * dbar * max_load / n, "force under 1e-12 of the load");
        expect_near(r.stiffness, 1e-12 * max_load, 1e-24 * max_load, "stiffness");
        check_finite(r);
        // Applies a load far above the maximum: forces stay right, and the overload flag is set.
        r = patch.step(0.0, 0.0, 1e9 * max_load);
        check_finite(r);
        expect(r.status == Status::overload, "overload is reported");
        r = step_along(patch, kind, 0.1 * dbar, 1e9 * max_load);
        expect_near(friction_along(r, kind), 1e9 * max_load * 0.1 * dbar, 1e-5 * 1e9 * max_load * dbar,
                    "force under 1e9 of the load");
        r = patch.step(0.0, 0.0, 0.0);
        check_finite(r);
        expect(r.end[0] == 0.0 && r.end[1] == 0.0 && r.mean[0] == 0.0 && r.mean[1] == 0.0,
               "no load, no force");
        expect(r.stiffness == 0.0 && r.damping == 0.0 && r.force_limit == 0.0, "no load, no stiffness");
        expect(r.status == Status::ok, "no load is no error");
        r = step_along(patch, kind, 0.2 * dbar, std::numeric_limits<double>::denorm_min());
        check_finite(r);
        expect(r.end[0] == 0.0 && r.stiffness == 0.0, "a denormal load is none");
      }
    }
  }
}

TEST_CASE("Any number of bristles in contact, also a fraction of one, gives its share of the force",
          "[extremes]") {
  for (const Kind& kind : kinds()) {
    for (double zeta : {1e-12, 0.5, 1.0, 1.75, 899.37, 900.0, 1e6}) {
      INFO(kind.name() << ", zeta " << zeta);
      // Lets the library choose the number of representatives; plain_material has one bristle per newton.
      OnePatch patch(plain_material(uniform, kind.rule),
                     PatchOptions{}
                         .with_max_normal_load(zeta)
                         .with_axes(kind.axes)
                         .with_precision(kind.precision)
                         .with_population(bristle::Population::representatives)
                         .with_outputs(Outputs::all));
      patch.step(0.0, 0.0, zeta);
      const bristle::PatchInfo info = patch.batch.info(patch.id);
      CHECK(info.representatives == std::min(std::max(std::ceil(zeta), 1.0), 4096.0));
      CHECK(info.weight * info.active == Approx(zeta).epsilon(1e-14));
      Response r = step_along(patch, kind, 0.4 * dbar, zeta);
      expect_near(friction_along(r, kind), zeta * 0.4 * dbar, 1e-6 * zeta * dbar, "force in stick");
      expect_near(r.stiffness, zeta, 1e-12 * zeta, "stiffness");
      expect(r.snaps == 0, "nothing snaps below the shortest length");
      // Checks that under a part of the load the force of sliding falls in proportion.
      r = patch.step(0.0, 0.0, 0.37 * zeta);
      expect_near(friction_along(r, kind), 0.37 * zeta * 0.4 * dbar, 1e-6 * zeta * dbar,
                  "force under a third");
      for (int k = 0; k < 30; ++k) {
        r = step_along(patch, kind, 0.9 * dbar, zeta);
        check_finite(r);
        expect(friction_along(r, kind) >= 0.0 && friction_along(r, kind) <= zeta * 1.5 * dbar * (1.0 + 1e-6),
               "force of bent bristles");
      }
    }
  }
}

TEST_CASE("A million bristles, one by one, have the virgin curve's peak", "[extremes]") {
  const std::uint32_t n = test_size(1000000);
  for (const Kind& kind : kinds()) {
    INFO(kind.name());
    OnePatch patch(plain_material(uniform, kind.rule), plain_options(n, kind.axes, kind.precision));
    patch.step(0.0, 0.0, n);
    const Response r = step_along(patch, kind, dbar, n);
    // Stratified lengths have an error of order 1/n, here below the rounding of single precision. Up to a
    // path of 1.0 both rules give the deflection x - x^2/2 + 1/8.
    expect_near(friction_along(r, kind) / (n * dbar), 0.625, 30.0 / n + 1e-6, "peak");
    // Half the bristles are shorter than the path of a mean length, and none snaps twice.
    expect_near(static_cast<double>(r.snaps), 0.5 * n, 30.0, "snaps");
  }
}

TEST_CASE("Under a load that jumps in every step those who stay feel nothing and the others start straight",
          "[extremes]") {
  constexpr std::uint32_t n = 300;
  constexpr double low = 100.0, high = 300.0;
  const double h = 0.3 * dbar;
  for (const Kind& kind : kinds()) {
    INFO(kind.name());
    const Material material = plain_material(uniform, kind.rule);
    const PatchOptions options = plain_options(n, kind.axes, kind.precision);
    OnePatch patch(material, options);
    OnePatch steady(material, options);  // twin under the low load, with the same first hundred bristles

    // Tolerance: in float each change of load rounds deflections once more.
    const double tolerance = kind.is_double() ? 1e-11 : 1e-5;
    for (int k = 0; k < 200; ++k) {
      const bool up = k % 2 == 1;
      const Response r = step_along(patch, kind, h, up ? high : low);
      const Response s = step_along(steady, kind, h, low);
      // Bristles that just entered contact are bent by this step h alone, which is less than any snap length.
      const double newcomers = up ? (high - low) * h : 0.0;
      expect_near(friction_along(r, kind), friction_along(s, kind) + newcomers, tolerance * n * dbar,
                  "force at the end");
      expect_near(-(r.mean[0] * kind.ex() + r.mean[1] * kind.ey()),
                  -(s.mean[0] * kind.ex() + s.mean[1] * kind.ey()) + 0.5 * newcomers, tolerance * n * dbar,
                  "mean force");
      expect_near(r.contact_loss, k > 0 && !up ? 0.5 * (high - low) * h * h : 0.0,
                  tolerance * n * dbar * dbar, "energy that leaves");
      expect_near(r.dissipated, s.dissipated, tolerance * n * dbar * dbar, "energy of snaps");
      expect(r.snaps == s.snaps, "snaps");
      expect(r.stiffness == (up ? high : low), "stiffness follows the load at once");
    }
    // Bristles draw new snap lengths in sliding under the high load, but those that leave contact and return
    // have their first lengths again.
    OnePatch fresh(material, options);
    const Bristles first = read(fresh, n);
    for (int k = 0; k < 10; ++k) step_along(patch, kind, 1.7 * dbar, high);
    patch.step(0.0, 0.0, low);
    patch.step(0.0, 0.0, high);
    const Bristles again = read(patch, n);
    for (std::size_t i = 100; i < n; ++i)
      expect(again.delta[i] == first.delta[i] && again.zx[i] == 0.0 && again.zy[i] == 0.0,
             "a newcomer has its first snap length and is straight");
  }
}

TEST_CASE("Overload to 1e15 N and back, again and again, keeps force and energy in bounds", "[extremes]") {
  constexpr std::uint32_t n = 300;
  for (const Kind& kind : kinds()) {
    INFO(kind.name());
    OnePatch patch(plain_material(uniform, kind.rule), plain_options(n, kind.axes, kind.precision));
    for (int k = 0; k < 20; ++k) step_along(patch, kind, 0.41 * dbar, n);
    for (int round = 0; round < 40; ++round) {
      // Raises the load at rest, which changes no force; each overload divides deflections, finally to zero.
      double before = friction_along(patch.step(0.0, 0.0, n), kind);
      for (double load = n; load < 1e15; load *= 1000.0) {
        const double energy = patch.energy();
        const Response r = patch.step(0.0, 0.0, load);
        check_finite(r);
        expect_near(friction_along(r, kind), before, 1e-6 * before + load * 0x1p-44 * 2.0 * dbar, "force");
        expect(patch.energy() <= energy * (1.0 + 1e-6), "a rising load adds no energy");
        expect(r.contact_loss >= -1e-6 * energy, "contact loss is a loss");
        before = friction_along(r, kind);
      }
    }
    const Response r = step_along(patch, kind, 0.3 * dbar, n);
    expect_near(friction_along(r, kind), n * 0.3 * dbar, 1e-5 * n * dbar, "and it works as at first");
  }
}

}  // namespace bristle_test::test_extreme_loads
