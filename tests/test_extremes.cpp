// Extreme loads, times, displacements, materials: finite outputs, and the right limits.
#include <catch2/catch.hpp>

#include <cmath>
#include <limits>

#include "expect.hpp"
#include "scenes.hpp"

using namespace bristle_test;

namespace {

const SnapLength uniform = SnapLength::uniform(0.5 * dbar, 1.5 * dbar);

void check_finite(const Response& r) {
  for (int axis = 0; axis < 2; ++axis) {
    expect(std::isfinite(r.end[axis]), "end is finite");
    expect(std::isfinite(r.elastic[axis]), "elastic is finite");
    expect(std::isfinite(r.damper[axis]), "damper is finite");
    expect(std::isfinite(r.mean[axis]), "mean is finite");
  }
  expect(std::isfinite(r.stiffness) && r.stiffness >= 0.0, "stiffness is finite and not negative");
  expect(std::isfinite(r.damping) && r.damping >= 0.0, "damping is finite and not negative");
  expect(std::isfinite(r.force_limit) && r.force_limit >= 0.0, "force limit is finite and not negative");
  expect(std::isfinite(r.dissipated) && r.dissipated >= 0.0, "dissipated is finite and not negative");
  expect(std::isfinite(r.contact_loss), "contact loss is finite");
  expect(std::isfinite(r.damper_work), "damper work is finite");
}

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
        // And it still works: friction opposes the motion.
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

TEST_CASE("Slow creep is not lost to rounding", "[extremes]") {
  // A float deflection of a third of a snap length would stall at steps below 2^-26 of it.
  for (Precision precision : precisions()) {
    INFO(name_of(precision));
    OnePatch patch(plain_material(uniform, SnapRule::keep), plain_options(600, 1, precision));
    patch.step(0.0, 0.0, 600.0);
    patch.step(0.3 * dbar, 0.0, 600.0);
    const double d = 1e-9 * dbar;
    double force = 0.0;
    for (int k = 0; k < 100000; ++k) force = -patch.step(d, 0.0, 600.0).elastic[0];
    // Each step is rounded to 2^-44 scaled lengths (5.7e-14): 1e5 steps to 6e-9 at the most.
    expect_near(force, 600.0 * (0.3 * dbar + 1e5 * d),
                600.0 * dbar * (precision == Precision::single ? 1e-7 : 1.2e-8), "force");
  }
}

TEST_CASE("Encoder chatter of one count at rest leaves no drift", "[extremes]") {
  const int steps = static_cast<int>(test_size(100000));
  for (Precision precision : precisions()) {
    for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
      for (double count : {0.3e-6, 2.7e-6, 30e-6}) {  // below, near and above the mean snap length
        INFO(name_of(precision) << ", " << table_name(rule) << ", count of " << count << " m");
        const double length = count > dbar ? 10.0 * dbar : dbar;
        OnePatch patch(plain_material(SnapLength::uniform(0.5 * length, 1.5 * length), rule),
                       plain_options(600, 2, precision));
        for (int k = 0; k < 12; ++k) patch.step(0.43 * length, 0.1 * length, 600.0);
        // A few bristles near their length snap in the first counts; then all hold.
        for (int k = 0; k < 20; ++k) {
          patch.step(count, 0.0, 600.0);
          patch.step(-count, 0.0, 600.0);
        }
        const std::uint64_t hash = patch.hash();
        const Response low = patch.step(0.0, 0.0, 600.0);
        const Response high = patch.step(count, 0.0, 600.0);
        patch.step(-count, 0.0, 600.0);
        int wrong = 0;
        for (int k = 0; k < steps / 2; ++k) {
          const Response up = patch.step(count, 0.0, 600.0);
          const Response down = patch.step(-count, 0.0, 600.0);
          wrong += up.elastic[0] != high.elastic[0] || down.elastic[0] != low.elastic[0] ||
                   up.snaps + down.snaps != 0;
        }
        CHECK(wrong == 0);
        CHECK(patch.hash() == hash);
      }
    }
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
    // Off the tie there is one answer.
    for (double off : {1e-3, 1e-5}) {
      for (double factor : {1.0, 2.0, 1000.0}) {
        if (precision == Precision::single && off < factor * 0x1p-22)
          continue;  // float rounds the snap length itself
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
    // So far that no phase is left: any phase will do, within the snap length, and the count is right.
    OnePatch far(plain_material(uniform, SnapRule::keep), plain_options(1000, 2, precision));
    far.step(0.0, 0.0, 1000.0);
    const Response r = far.step(0x1p53 * dbar, 0.0, 1000.0);
    check_finite(r);
    CHECK(r.dissipated == Approx(1000.0 * 0x1p53 * dbar * 0.5 * dbar).epsilon(0.01));
    // Phases spread evenly: mean deflection delta / 2, deviation sqrt(m2 / 12) = 0.3.
    CHECK(std::abs(-r.elastic[0] / (1000.0 * dbar) - 0.5) < 5.0 * std::sqrt(0.1112 / 1000.0));
  }
}

TEST_CASE("Loads from nothing to a million newton give forces in proportion", "[extremes]") {
  for (Precision precision : precisions()) {
    for (double max_load : {1e-12, 1.0, 1e6}) {
      for (std::uint32_t n : {1u, 300u}) {
        INFO(name_of(precision) << ", maximum load " << max_load << " N, " << n << " bristles");
        OnePatch patch(plain_material(uniform, SnapRule::keep), PatchOptions{}
                                                                    .with_max_normal_load(max_load)
                                                                    .with_bristles(n)
                                                                    .with_precision(precision)
                                                                    .with_outputs(Outputs::all));
        patch.step(0.0, 0.0, max_load);
        Response r = patch.step(0.4 * dbar, 0.0, max_load);
        expect_near(-r.elastic[0], max_load * 0.4 * dbar, 1e-6 * max_load * dbar, "force");
        check_finite(r);
        // Far below the maximum: a sliver of the first bristle.
        r = patch.step(0.0, 0.0, 1e-12 * max_load);
        // Sums of deflections are fixed point: 2^-44 of a length near the mean, of one representative.
        expect_near(-r.elastic[0], 1e-12 * max_load * 0.4 * dbar, 0x1p-44 * 2.0 * dbar * max_load / n,
                    "force under 1e-12 of the load");
        check_finite(r);
        // Far above: one status flag, no surprise.
        r = patch.step(0.0, 0.0, 1e9 * max_load);
        check_finite(r);
        expect(has(r.status, Status::overload), "overload is reported");
        r = patch.step(0.1 * dbar, 0.0, 1e9 * max_load);
        expect_near(-r.elastic[0], 1e9 * max_load * 0.1 * dbar, 1e-5 * 1e9 * max_load * dbar,
                    "force under 1e9 of the load");
        r = patch.step(0.0, 0.0, 0.0);
        check_finite(r);
        expect(r.end[0] == 0.0, "no load, no force");
        r = patch.step(0.2 * dbar, 0.0, std::numeric_limits<double>::denorm_min());
        check_finite(r);
        expect(std::abs(r.end[0]) < 1e-300, "next to no load, next to no force");
      }
    }
  }
}

TEST_CASE("Without stiffness there is no elastic force, and with a huge one it is finite", "[extremes]") {
  for (Precision precision : precisions()) {
    OnePatch soft(plain_material(uniform, SnapRule::redraw).with_bristle_stiffness(0.0),
                  plain_options(300, 2, precision));
    OnePatch hard(plain_material(uniform, SnapRule::redraw).with_bristle_stiffness(1e12),
                  plain_options(300, 2, precision));
    OnePatch plain(plain_material(uniform, SnapRule::redraw), plain_options(300, 2, precision));
    for (int k = 0; k < 30; ++k) {
      const Response s = soft.step(0.7 * dbar, 0.2 * dbar, 300.0);
      const Response h = hard.step(0.7 * dbar, 0.2 * dbar, 300.0);
      const Response p = plain.step(0.7 * dbar, 0.2 * dbar, 300.0);
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

TEST_CASE("Any time step gives the same elastic force, and the damper its limits", "[extremes]") {
  const Material material =
      plain_material(uniform, SnapRule::keep).with_bristle_damping(0.01).with_viscous_friction(0.5);
  for (double dt : {1e-30, 1e-12, 1e-3, 1.0, 1e30}) {
    INFO("dt = " << dt << " s");
    OnePatch patch(material, plain_options(300));
    patch.step(0.0, 0.0, 300.0, dt);
    const Response r = patch.step(0.4 * dbar, 0.0, 300.0, dt);
    check_finite(r);
    expect_near(-r.elastic[0], 300.0 * 0.4 * dbar, 1e-6 * 300.0 * dbar, "elastic force");
    const double v = 0.4 * dbar / dt;
    const double damping = 300.0 * 0.01 * std::exp(-v / 1e-3) + 0.5;
    expect_near(r.damping, damping, 1e-9 * damping, "damping");
    expect_near(-r.damper[0], damping * v, 1e-9 * damping * v, "damper force");
  }
}

TEST_CASE("Snap lengths from picometres to hundreds of metres behave alike", "[extremes]") {
  for (Precision precision : precisions()) {
    for (double mean : {1e-11, 1e-9, 1e-3, 1.0, 600.0}) {
      INFO(name_of(precision) << ", mean snap length " << mean << " m");
      OnePatch patch(plain_material(SnapLength::uniform(0.5 * mean, 1.5 * mean), SnapRule::keep),
                     plain_options(2000, 2, precision));
      patch.step(0.0, 0.0, 2000.0);
      const Response stick = patch.step(0.3 * mean, 0.0, 2000.0);
      expect_near(-stick.elastic[0] / (2000.0 * mean), 0.3, 1e-6, "force in stick");
      const Response peak = patch.step(0.7 * mean, 0.0, 2000.0);
      expect_near(-peak.elastic[0] / (2000.0 * mean), 0.625, 0.01, "force at the peak");
      const Response far = patch.step(1000.37 * mean, 0.0, 2000.0);
      expect_near(-far.elastic[0] / (2000.0 * mean), 0.5, 0.05, "force far on");
      expect_near(far.dissipated / (2000.0 * mean * mean), 500.0, 5.0, "energy lost");
    }
  }
}

TEST_CASE("A long run never loses its way", "[extremes]") {
  // A million ticks of sliding to and fro by an amount no binary fraction holds: positions are fixed point,
  // the net displacement of a period is exactly zero and the force comes back.
  OnePatch patch(plain_material(uniform, SnapRule::keep), plain_options(100, 1));
  patch.step(0.0, 0.0, 100.0);
  for (int k = 0; k < 20; ++k) patch.step(0.9 * dbar, 0.0, 100.0);
  double first = 0.0;
  const int periods = static_cast<int>(test_size(100000));
  for (int k = 0; k < periods; ++k) {
    for (double d : {0.013, 0.0171, -0.013, -0.0171}) patch.step(d * dbar, 0.0, 100.0);
    const double force = patch.step(0.0, 0.0, 100.0).elastic[0];
    if (k == 3) first = force;
    if (k > 3) expect(force == first, "the force comes back");
  }
}
