// One event-exact step, bristle by bristle: against the table of test vectors and against the brute-force
// patch.
#include <catch2/catch.hpp>

#include <cmath>
#include <random>

#include "brute_force.hpp"
#include "expect.hpp"
#include "reference_table.hpp"
#include "scenes.hpp"

namespace bristle_test::test_step_vectors {

namespace {

/// Returns one bristle of weight 1 and stiffness 1 with the snap length `delta` (m), brought to (zx, zy) from
/// rest by a straight motion that does not snap it.
OnePatch bent_bristle(double zx, double zy, double delta, int axes, Precision precision, SnapRule rule) {
  OnePatch patch(plain_material(SnapLength::single(delta), rule), plain_options(1, axes, precision));
  patch.step(0.0, 0.0, 1.0);
  if (zx != 0.0 || zy != 0.0) patch.step(zx, zy, 1.0);
  return patch;
}

/// Checks a row of the table of exact steps, with lengths in units of `unit` metres. `turn` swaps the axes.
void check_row(const Row& row, double unit, int axes, Precision precision, SnapRule rule, bool turn) {
  const auto length = [&](const char* column) { return unit * number(row, column); };
  double z0[2] = {length("zx0"), length("zy0")};
  double d[2] = {length("dx"), length("dy")};
  double z1[2] = {length("zx1"), length("zy1")};
  double mean[2] = {length("mean_zx_over_step"), length("mean_zy_over_step")};
  if (turn) {
    std::swap(z0[0], z0[1]);
    std::swap(d[0], d[1]);
    std::swap(z1[0], z1[1]);
    std::swap(mean[0], mean[1]);
  }
  const double delta = length("delta");
  const double snaps = number(row, "snaps");
  const double lost = number(row, "energy_lost_over_sigma0") * unit * unit;
  // Tolerance: in double 1e-12 of a length, as the table has 12 digits; in float four rounding errors of the
  // path and of the snap length.
  const double path = std::hypot(d[0], d[1]);
  const double tolerance = precision == Precision::double_ ? 1e-12 * unit : 0x1p-22 * (path + 2.0 * delta);

  OnePatch patch = bent_bristle(z0[0], z0[1], delta, axes, precision, rule);
  const Bristles before = read(patch, 1);
  expect_near(before.zx[0], z0[0], tolerance, "deflection x before the step");
  if (axes == 2) expect_near(before.zy[0], z0[1], tolerance, "deflection y before the step");

  const Response r = patch.step(d[0], d[1], 1.0);
  const Bristles after = read(patch, 1);
  expect(r.status == Status::ok, "the status is ok");
  expect_near(after.zx[0], z1[0], tolerance, "deflection x after the step");
  expect_near(r.end[0], -z1[0], tolerance, "end force x");
  expect_near(r.elastic[0], -z1[0], tolerance, "elastic force x");
  expect_near(r.mean[0], -mean[0], tolerance, "mean force x");
  if (axes == 2) {
    expect_near(after.zy[0], z1[1], tolerance, "deflection y after the step");
    expect_near(r.end[1], -z1[1], tolerance, "end force y");
    expect_near(r.mean[1], -mean[1], tolerance, "mean force y");
  }
  expect_near(after.delta[0], delta, precision == Precision::double_ ? 0.0 : 0x1p-24 * delta, "snap length");
  expect_near(static_cast<double>(r.snaps), snaps, 0.0, "snaps");
  expect_near(r.dissipated, lost,
              (precision == Precision::double_ ? 1e-12 : 0x1p-22) * (lost + unit * unit * 1e-3),
              "energy lost");
  expect_near(r.contact_loss, 0.0, 0.0, "contact loss");
}

}  // namespace

TEST_CASE("One step of one bristle ends where the table of exact vectors says", "[step]") {
  const std::vector<Row> rows = read_table("exact_step_vectors.csv");
  REQUIRE(rows.size() == 27);
  for (Precision precision : precisions()) {
    for (double unit : {1e-6, 10e-6, 1e-3, 1.0}) {
      for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
        for (std::size_t k = 0; k < rows.size(); ++k) {
          INFO(name_of(precision) << " " << table_name(rule) << ", unit " << unit << " m, row " << k + 2);
          const bool straight = number(rows[k], "zy0") == 0.0 && number(rows[k], "dy") == 0.0;
          check_row(rows[k], unit, 2, precision, rule, false);
          check_row(rows[k], unit, 2, precision, rule, true);
          if (straight) check_row(rows[k], unit, 1, precision, rule, false);
        }
      }
    }
  }
}

#if BRISTLE_WITH_DOUBLE
TEST_CASE("Random steps follow the brute-force patch bristle by bristle with keep", "[step]") {
  constexpr std::uint32_t n = 600;  // number of bristles: two blocks of 256 and a part of one
  for (int axes : {1, 2}) {
    for (const NamedLaw& law : reference_laws()) {
      INFO(law.name << ", axes " << axes);
      OnePatch patch(plain_material(law.law, SnapRule::keep), plain_options(n, axes, Precision::double_));
      patch.step(0.0, 0.0, n);
      // Copies the patch's snap lengths to the reference. SnapRule::keep never changes them.
      BruteForcePatch brute(n, single_quantile(1.0), false, 1);
      const Bristles start = read(patch, n);
      REQUIRE(start.delta.size() == n);
      for (std::uint32_t i = 0; i < n; ++i) brute.bristles()[i].delta = start.delta[i];

      std::mt19937_64 random(7);
      std::uniform_real_distribution<double> flat(-1.0, 1.0);
      double travelled = 0.0;
      for (int step = 0; step < 300; ++step) {
        // Draws the largest displacement of this step along an axis: 0.01 to 10 mean snap lengths.
        const double scale = dbar * std::pow(10.0, 1.5 * flat(random) - 0.5);
        const double dx = scale * flat(random);
        const double dy = axes == 2 ? scale * flat(random) : 0.0;
        travelled += std::hypot(dx, dy);
        const Response r = patch.step(dx, dy, n);
        const BruteStep expected = brute.step(dx, dy);
        const Bristles now = read(patch, n);
        // Counts bristles that differ: rounding may decide whether a bristle near its snap length snaps,
        // after which it is one snap length off. None is expected in 300 steps of a continuous law.
        const double tolerance = 1e-12 * (dbar + travelled);
        int apart = 0;
        for (std::uint32_t i = 0; i < n; ++i) {
          const BruteBristle& b = brute.bristles()[i];
          if (!(std::hypot(now.zx[i] - b.zx, now.zy[i] - b.zy) <= tolerance)) ++apart;
        }
        expect_near(apart, 0, 0, "bristles that differ");
        expect_near(r.elastic[0], -expected.end_x * n, tolerance * n, "end force x");
        expect_near(r.elastic[1], -expected.end_y * n, tolerance * n, "end force y");
        expect_near(r.mean[0], -expected.mean_x * n, tolerance * n, "mean force x");
        expect_near(r.mean[1], -expected.mean_y * n, tolerance * n, "mean force y");
        expect_near(static_cast<double>(r.snaps), expected.snaps * n, 1e-6, "snaps");
        expect_near(r.dissipated, expected.dissipated * n, 1e-11 * (r.dissipated + dbar * dbar),
                    "energy lost");
        if (apart > 0) return;
      }
    }
  }
}

TEST_CASE("A bristle that snaps once with redraw is carried by the remainder and has a new snap length",
          "[step]") {
  constexpr std::uint32_t n = 20000;
  for (const NamedLaw& law : reference_laws()) {
    if (law.law.law() == bristle::SnapLaw::single) continue;
    INFO(law.name);
    OnePatch patch(plain_material(law.law, SnapRule::redraw), plain_options(n, 2, Precision::double_));
    patch.step(0.0, 0.0, n);
    const double dx = 0.24 * dbar;
    const double dy = 0.18 * dbar;  // path of 0.3 mean lengths in all, along (0.8, 0.6)
    for (int step = 0; step < 20; ++step) {
      const Bristles before = read(patch, n);
      const Response r = patch.step(dx, dy, n);
      const Bristles after = read(patch, n);
      std::uint64_t snapped = 0;
      int kept_length = 0;
      for (std::uint32_t i = 0; i < n; ++i) {
        const double free_x = before.zx[i] + dx;
        const double free_y = before.zy[i] + dy;
        if (std::hypot(free_x, free_y) <= before.delta[i]) {
          expect_near(after.zx[i], free_x, 1e-12 * dbar, "deflection of a bristle that did not snap");
          expect_near(after.zy[i], free_y, 1e-12 * dbar, "deflection of a bristle that did not snap");
          expect(after.delta[i] == before.delta[i], "a bristle that did not snap keeps its length");
          continue;
        }
        ++snapped;
        if (after.delta[i] == before.delta[i]) ++kept_length;
        const double along = 0.8 * before.zx[i] + 0.6 * before.zy[i];
        const double aside = 0.6 * before.zx[i] - 0.8 * before.zy[i];
        const double to_snap = std::sqrt(before.delta[i] * before.delta[i] - aside * aside) - along;
        const double rest = 0.3 * dbar - to_snap;
        const double z = 0.8 * after.zx[i] + 0.6 * after.zy[i];
        expect_near(0.6 * after.zx[i] - 0.8 * after.zy[i], 0.0, 1e-12 * dbar, "deflection across the motion");
        // A bristle is bent by the path since its first snap in the step, or by less if it snapped again.
        expect(z <= rest + 1e-12 * dbar && z >= -1e-12 * dbar, "the deflection is within the remainder");
        expect(z <= after.delta[i] * (1.0 + 1e-12), "the deflection is within the new snap length");
        if (law.law.quantile(1e-9) > 0.3 * dbar) {  // no length is so short that bristles snap twice
          expect_near(z, rest, 1e-12 * dbar, "deflection after one snap");
        }
      }
      expect(r.snaps >= snapped, "every bristle beyond its length snapped");
      expect(kept_length <= 1, "snapped bristles have fresh lengths");
    }
  }
}
#endif

TEST_CASE("With keep a bristle has the same snap length for ever", "[step]") {
  constexpr std::uint32_t n = 1000;
  for (Precision precision : precisions()) {
    OnePatch patch(plain_material(SnapLength::lognormal(dbar, 0.3), SnapRule::keep),
                   plain_options(n, 2, precision));
    patch.step(0.0, 0.0, n);
    const Bristles before = read(patch, n);
    for (int step = 0; step < 50; ++step) patch.step(0.7 * dbar, 0.4 * dbar * step, n);
    const Bristles after = read(patch, n);
    REQUIRE(before.delta == after.delta);
  }
}

TEST_CASE("A one-axis patch and a two-axis patch moving along x agree", "[step]") {
  constexpr std::uint32_t n = 700;
  for (Precision precision : precisions()) {
    for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
      INFO(name_of(precision) << " " << table_name(rule));
      const Material material = plain_material(SnapLength::uniform(0.5 * dbar, 1.5 * dbar), rule);
      OnePatch one(material, plain_options(n, 1, precision));
      OnePatch two(material, plain_options(n, 2, precision));
      const double rounding = precision == Precision::single ? 1e-5 : 1e-11;
      std::mt19937_64 random(3);
      std::uniform_real_distribution<double> flat(-1.0, 1.5);
      for (int step = 0; step < 100; ++step) {
        const double dx = 0.8 * dbar * flat(random);
        const Response a = one.step(dx, 0.0, n);
        const Response b = two.step(dx, 0.0, n);
        // Tolerance in float: rounding may decide whether a bristle near its length snaps, which changes a
        // force by up to two mean lengths.
        const double tie = precision == Precision::single ? 2.0 * dbar : 0.0;
        expect_near(a.elastic[0], b.elastic[0], rounding * n * dbar + tie, "end force");
        expect_near(a.mean[0], b.mean[0], rounding * n * dbar + tie, "mean force");
        expect_near(b.elastic[1], 0.0, rounding * n * dbar, "force across the motion");
      }
    }
  }
}

}  // namespace bristle_test::test_step_vectors
