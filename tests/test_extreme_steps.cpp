// Extreme steps: very long, very fast, of long duration, and ending very close to a snap.
#include <catch2/catch.hpp>

#include <cmath>
#include <limits>

#include "extreme_cases.hpp"
#include "statistics.hpp"

namespace bristle_test::test_extreme_steps {

namespace {

std::vector<SnapLength> laws() {
  return {SnapLength::single(dbar),
          uniform,
          SnapLength::normal(dbar, 0.05 * dbar),
          SnapLength::lognormal(dbar, 0.3),
          SnapLength::lognormal(dbar, 1.0),
          SnapLength::exponential(dbar)};
}

}  // namespace

TEST_CASE("Any displacement from 1e-310 m to 1e300 m gives finite forces within the force of bent bristles",
          "[extremes]") {
  constexpr std::uint32_t n = 400;
  for (Precision precision : precisions()) {
    for (const SnapLength& law : laws()) {
      for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
        INFO(name_of(precision) << ", " << to_string(law.law()) << ", " << table_name(rule));
        OnePatch patch(plain_material(law, rule), plain_options(n, 2, precision));
        patch.step(0.3 * dbar, 0.0, n);
        for (double d : {0.0, -0.0, 1e-310, 5e-324, 1e-200, 1e-20, 1e-9, 1e-5, 1.0, 1e3, 1e9, 1e20, 1e100,
                         1e155, 1e200, 1e300}) {
          for (double sign : {1.0, -1.0}) {
            INFO("displacement " << sign * d << " m");
            const Response r = patch.step(sign * d, 0.37 * d, n, d > 1.0 ? d : 1.0);
            expect(r.status == Status::ok, "the status is ok");
            check_finite(r);
            expect(std::hypot(r.elastic[0], r.elastic[1]) <= n * law.longest(),
                   "the force is within that of bent bristles");
            expect(std::hypot(r.mean[0], r.mean[1]) <= n * law.longest(),
                   "the mean force is within that of bent bristles");
            const Bristles b = read(patch, n);
            for (std::uint32_t i = 0; i < n; ++i) {
              expect(std::hypot(b.zx[i], b.zy[i]) <= b.delta[i] * (1.0 + 1e-6), "|z| is within delta");
            }
          }
        }
        // Checks that an ordinary step after the extreme one gives friction that opposes the motion.
        for (int k = 0; k < 20; ++k) patch.step(0.9 * dbar, 0.0, n);
        const Response r = patch.step(0.1 * dbar, 0.0, n);
        expect(r.elastic[0] < 0.0, "the force opposes the motion");
      }
    }
  }
}

TEST_CASE("A displacement too small to matter changes no force, however often it is repeated back and forth",
          "[extremes]") {
  for (Precision precision : precisions()) {
    OnePatch patch(plain_material(uniform, SnapRule::redraw), plain_options(600, 2, precision));
    for (int k = 0; k < 12; ++k) patch.step(0.43 * dbar, 0.1 * dbar, 600.0);
    const Response start = patch.step(0.0, 0.0, 600.0);
    for (double d : {0.0, -0.0, 1e-310, 1e-30, 1e-25}) {
      const Response r = patch.step(d, -d, 600.0);
      expect_near(r.elastic[0], start.elastic[0], 1e-12 * 600.0 * dbar, "force");
    }
    CHECK(patch.step(-0.0, -0.0, 600.0).elastic[0] == Approx(start.elastic[0]).epsilon(1e-9));
  }
}

TEST_CASE("Steps near multiples of the snap length land on one side of the tie or the other", "[extremes]") {
  for (Precision precision : precisions()) {
    INFO(name_of(precision));
    const double ulp = std::numeric_limits<double>::epsilon();
    const double near_tie = precision == Precision::double_ ? 1e-12 : 1e-6;
    for (double factor :
         {1.0 - ulp, 1.0 + ulp, 1.0, 2.0 - 2.0 * ulp, 2.0, 3.0 + 4.0 * ulp, 1e3 - 1e-13, 1e3, 1e3 + 1e-13}) {
      OnePatch patch(plain_material(SnapLength::single(dbar), SnapRule::keep),
                     plain_options(10, 1, precision));
      patch.step(0.0, 0.0, 10.0);
      const Response r = patch.step(factor * dbar, 0.0, 10.0);
      check_finite(r);
      const double z = read(patch, 1).zx[0] / dbar;
      INFO("step of " << factor << " snap lengths, z = " << z);
      const bool before = std::abs(z - 1.0) <= near_tie * factor;
      const bool after = std::abs(z) <= near_tie * factor;
      expect(before || after, "z is 0 or delta");
      const double snaps = static_cast<double>(r.snaps) / 10.0;
      expect(snaps == std::round(factor) - (before ? 1.0 : 0.0), "and the snaps tell which");
    }
    // Ends steps just before and after a snap. Beyond the reach of rounding the number of snaps is unique.
    for (double off : {1e-3, 1e-5}) {
      for (double factor : {1.0, 2.0, 1000.0}) {
        if (precision == Precision::single && off < factor * 0x1p-22)
          continue;  // a float's rounding of the snap length is larger
        OnePatch below(plain_material(SnapLength::single(dbar), SnapRule::keep),
                       plain_options(1, 1, precision));
        below.step(0.0, 0.0, 1.0);
        expect_near(static_cast<double>(below.step((factor - off) * dbar, 0.0, 1.0).snaps), factor - 1.0, 0.0,
                    "snaps just below");
        OnePatch above(plain_material(SnapLength::single(dbar), SnapRule::keep),
                       plain_options(1, 1, precision));
        above.step(0.0, 0.0, 1.0);
        expect_near(static_cast<double>(above.step((factor + off) * dbar, 0.0, 1.0).snaps), factor, 0.0,
                    "snaps just above");
      }
    }
  }
}

TEST_CASE("Any time step gives finite forces", "[extremes]") {
  const Material material =
      plain_material(uniform, SnapRule::keep).with_bristle_damping(0.01).with_viscous_friction(0.5);
  for (double dt :
       {std::numeric_limits<double>::min(), 1e-30, 1e30, 1e300, std::numeric_limits<double>::max()}) {
    OnePatch patch(material, plain_options(300));
    const Response r = patch.step(0.4 * dbar, 0.0, 300.0, dt);
    expect(r.status == Status::ok, "the status is ok");
    check_finite(r);
  }
}

TEST_CASE("Any speed gives the damper its closed form and the bristles their friction", "[extremes]") {
  constexpr std::uint32_t n = 2000;
  constexpr double sigma1 = 0.01, sigma2 = 0.5, vs = 1e-3;
  for (const Kind& kind : kinds()) {
    const Material material =
        plain_material(uniform, kind.rule).with_bristle_damping(sigma1).with_viscous_friction(sigma2);
    const double kinetic = n * dbar * (kind.rule == SnapRule::keep ? 0.5 : (1.0 + 1.0 / 12.0) / 2.0);
    for (double dt : {1e-9, 1e-3, 1.0}) {
      for (double v : {0.0, -0.0, 1e-310, 0.5, -0.5, 1e3, 1e300}) {
        INFO(kind.name() << ", dt " << dt << " s, speed " << v << " m/s");
        OnePatch patch(material, plain_options(n, kind.axes, kind.precision));
        patch.step(0.0, 0.0, n, dt);
        const Response r = step_along(patch, kind, v * dt, n, dt);
        check_finite(r);
        expect(r.status == Status::ok, "the status is ok");
        const double speed = std::abs(v);
        const double damping = n * sigma1 * std::exp(-speed / vs) + sigma2;
        expect_near(r.damping, damping, 1e-9 * damping, "damping");
        const double damper = -(r.damper[0] * kind.ex() + r.damper[1] * kind.ey());
        // Speeds above 1e150 m/s count as 1e150, so that squares and products stay finite. Denormal ones
        // count as zero.
        if (speed < 1e150) expect_near(damper, damping * v, 1e-9 * damping * speed + 1e-305, "damper force");
        const double path = speed * dt;
        if (path < 0.5 * dbar) {
          expect_near(friction_along(r, kind), n * v * dt, 1e-6 * n * path + n * 0x1p-44 * 2.0 * dbar,
                      "stick");
        } else if (path > 40.0 * dbar) {
          // The mean force over a path is kinetic friction, apart from the first and last snap length of each
          // bristle, and from sampling.
          const double mean = -(r.elastic[0] * kind.ex() + r.elastic[1] * kind.ey());
          expect(mean * v >= 0.0, "the force opposes the motion");
          if (speed < 1e150) {
            const double average =
                -((r.mean[0] - r.damper[0]) * kind.ex() + (r.mean[1] - r.damper[1]) * kind.ey()) *
                (v < 0.0 ? -1.0 : 1.0);
            const double sampling = sigmas * 0.254 / std::sqrt(n * path / dbar);
            // Tolerance for the digits lost where the damper's share is taken out of the mean force.
            const double digits = 1e-12 * damping * speed / kinetic;
            expect_near(average / kinetic, 1.0, 1.5 * dbar / path + 1e-3 + sampling + digits, "friction");
          }
        }
      }
    }
  }
}

TEST_CASE("Energies that no double holds read as 1e300 J", "[extremes]") {
  for (const Kind& kind : kinds()) {
    INFO(kind.name());
    OnePatch patch(plain_material(uniform, kind.rule).with_bristle_stiffness(1e15).with_viscous_friction(1.0),
                   plain_options(600, kind.axes, kind.precision).with_max_normal_load(1e15));
    Response r = step_along(patch, kind, 1e300, 1e15);
    check_finite(r);
    CHECK(r.dissipated >= 0.99e300);
    CHECK(r.damper_work >= 1e300);
    // Moves 1e300 m in 1e-9 s, a speed beyond every double.
    check_finite(step_along(patch, kind, 1e300, 1e15, 1e-9));
    // Gives a velocity against the motion along one axis, which must not lead to a difference of infinities.
    Motion motion;
    motion.id = patch.id;
    motion.normal_load = 1e15;
    motion.has_velocity = true;
    motion.displacement[0] = 1e300;
    motion.velocity[0] = 1e20;
    motion.displacement[1] = kind.axes == 2 ? 1e300 : 0.0;
    motion.velocity[1] = kind.axes == 2 ? -1e20 : 0.0;
    r = patch.step(motion);
    check_finite(r);
    if (kind.axes == 2) CHECK(r.damper_work == 0.0);
  }
}

TEST_CASE("A step of one snap length less an ulp holds, and of one more snaps, bristle by bristle",
          "[extremes]") {
  const double ulp = std::numeric_limits<double>::epsilon();
  for (const Kind& kind : kinds()) {
    // Resolution of the kernel's arithmetic and of positions, relative to a snap length.
    const double bit = kind.is_double() ? 0x1p-40 : 0x1p-22;
    for (const SnapLength& law : laws()) {
      PatchBatch batch;
      for (std::uint32_t seed : {1u, 2u, 3u, 4u, 5u}) {
        for (double off : {-bit, -ulp, 0.0, ulp, bit}) {
          INFO(kind.name() << ", " << to_string(law.law()) << ", seed " << seed << ", off by " << off);
          const PatchId id = batch.add(plain_material(law, kind.rule),
                                       plain_options(1, kind.axes, kind.precision).with_seed(seed));
          const double delta = read(batch, id, 1).delta[0];
          const Motion motion{id, {delta * (1.0 + off) * kind.ex(), delta * (1.0 + off) * kind.ey()}, 1.0};
          Response r;
          batch.step(tick, {&motion, 1}, {&r, 1});
          // A step of an ulp of a double is below the resolution of positions, so the bristle may snap or
          // not, but force and energy must agree.
          if (std::abs(off) == bit) expect(r.snaps == (off < 0.0 ? 0u : 1u), "the snap is on the right side");
          expect(r.snaps <= 1, "one snap at most");
          expect_near(friction_along(r, kind), r.snaps == 0 ? delta : 0.0, 2.0 * bit * delta, "force");
          // Tolerance: sums of delta^2 have a unit of at most 3 x 2^-50 of the longest length's square.
          expect_near(r.dissipated, r.snaps == 0 ? 0.0 : 0.5 * delta * delta,
                      2.0 * bit * delta * delta + 0x1p-50 * 3.0 * law.longest() * law.longest(), "energy");
        }
      }
    }
  }
}

TEST_CASE("A thousand and 2^53 snap lengths in a step leave the right force and energy", "[extremes]") {
  constexpr std::uint32_t n = 1000;
  for (const Kind& kind : kinds()) {
    for (double lengths : {1e3, 0x1p53}) {
      INFO(kind.name() << ", " << lengths << " mean lengths");
      OnePatch patch(plain_material(uniform, kind.rule), plain_options(n, kind.axes, kind.precision));
      patch.step(0.0, 0.0, n);
      const Response r = step_along(patch, kind, lengths * dbar, n);
      check_finite(r);
      // After a far step bristles are at random positions between snaps: mean deflection m1/2 (keep) or m2/(2
      // m1) (redraw), deviations sqrt(m2/3 - m1^2/4) and sqrt(m3/(3 m1) - (m2/(2 m1))^2).
      const bool keep = kind.rule == SnapRule::keep;
      const double m2 = 13.0 / 12.0, m3 = 1.25;
      const double bend = keep ? 0.5 : 0.5 * m2;
      const double spread = std::sqrt(keep ? m2 / 3.0 - 0.25 : m3 / 3.0 - 0.25 * m2 * m2);
      expect_near(friction_along(r, kind) / (n * dbar), bend, sigmas * spread / std::sqrt(n), "force");
      // Expects kinetic friction as energy lost per distance; the mean length of these n bristles has an
      // error of 1/n.
      expect_near(r.dissipated / (n * dbar * dbar * lengths * bend), 1.0,
                  3e-3 + sigmas * 0.254 / std::sqrt(n * lengths), "energy");
    }
  }
}

TEST_CASE("A motion to and fro inside a step is not seen: the force is that of the net displacement",
          "[extremes]") {
  constexpr std::uint32_t n = 4000;
  for (const Kind& kind : kinds()) {
    INFO(kind.name());
    const Material material = plain_material(uniform, kind.rule);
    const PatchOptions options = plain_options(n, kind.axes, kind.precision);
    const auto slide = [&kind](OnePatch& patch) {
      patch.step(0.0, 0.0, n);
      for (int k = 0; k < 60; ++k) step_along(patch, kind, 0.83 * dbar, n);
      return friction_along(patch.step(0.0, 0.0, n), kind);
    };
    // Moves out by `reach` and back within one tick, cut into m equal times: x = reach (1 - (2 t - 1)^2).
    constexpr double reach = 0.4;
    const auto out_and_back = [&](int parts) {
      OnePatch patch(material, options);
      slide(patch);
      double last = 0.0, force = 0.0;
      for (int k = 1; k <= parts; ++k) {
        const double u = 2.0 * k / parts - 1.0;
        const double x = reach * dbar * (1.0 - u * u);
        force = friction_along(step_along(patch, kind, x - last, n), kind);
        last = x;
      }
      return force;
    };
    OnePatch patch(material, options);
    const double steady = slide(patch);
    // Taken as one step, the motion out and back has no net displacement, so nothing changes.
    expect_near(out_and_back(1), steady, 1e-6 * n * dbar, "in one step");
    // In two steps, split at the turn, the motion is exact: steady friction going out, then all bristles
    // straighten by `reach`, which is less than any snap length. Bristles that snapped on the way are a
    // sample of n.
    const double exact = out_and_back(2);
    const double sampling = sigmas * 1.5 * std::sqrt(n * reach);
    expect_near(exact / dbar, steady / dbar - n * reach, sampling, "in two steps");
    // If the motion out and back is cut into an odd number m of steps, the turn falls within a step, which
    // leaves out a path of reach / m^2. On average n reach / m^2 bristles should have snapped there; each
    // stays bent by up to a snap length too much.
    for (int parts : {3, 5, 9, 33}) {
      const double hidden = n * reach / (parts * parts);
      const double off = (out_and_back(parts) - exact) / dbar;
      INFO(parts << " parts: off by " << off << ", hidden " << hidden);
      expect(off >= -1e-5 * n && off <= 1.5 * (hidden + sigmas * std::sqrt(hidden) + 1.0),
             "the error is that of the path hidden");
    }
  }
}

}  // namespace bristle_test::test_extreme_steps
