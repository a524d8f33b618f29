// The normal load: bristles that enter and leave contact, the bristle that counts by a fraction, and
// overload.
#include <catch2/catch.hpp>

#include <cmath>

#include "expect.hpp"
#include "reference_table.hpp"
#include "scenes.hpp"
#include "statistics.hpp"

namespace bristle_test::test_load {

namespace {

// In these tests representatives have weight 1 and stiffness 1 N/m, so the load in newtons is the number of
// bristles in contact, and the elastic force is minus the weighted sum of their deflections.
constexpr double longest = 1.5 * dbar;

/// Returns the force's rounding error when a bristle counts by another fraction, which rewrites it once.
double rounding(Precision precision) { return (precision == Precision::single ? 0x1p-23 : 1e-12) * longest; }

/// Returns the sum of the deflections z of `active` bristles, where the last one counts by a fraction.
double weighted_sum(const std::vector<double>& z, double active) {
  double sum = 0.0;
  for (std::size_t i = 0; i < z.size(); ++i) {
    sum += z[i] * std::min(std::max(active - static_cast<double>(i), 0.0), 1.0);
  }
  return sum;
}

/// Slides so that most bristles are bent by different lengths.
void bend(OnePatch& patch, double load) {
  for (int k = 0; k < 12; ++k) patch.step(0.43 * dbar, 0.11 * dbar, load);
}

}  // namespace

TEST_CASE("A load jump in steady sliding follows the tables", "[physics][load]") {
  const std::vector<Row> rows = read_table("load_jump.csv");
  const std::vector<Row> summary = read_table("summary.csv");
  const std::vector<Row> virgin = read_table("virgin_curve.csv");
  const std::uint32_t n = test_size(200000);
  int points = 0;
  for (Precision precision : precisions()) {
    for (const NamedLaw& law : reference_laws()) {
      for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
        for (const char* jump : {"zeta x2", "zeta x0.5"}) {
          INFO(name_of(precision) << ", " << law.name << ", " << table_name(rule) << ", " << jump);
          bool in_table = false;
          for (const Row& row : rows) {
            in_table = in_table || (row.at("dist") == law.name && row.at("variant") == table_name(rule));
          }
          if (!in_table) continue;
          const Row key{{"dist", law.name}, {"variant", table_name(rule)}};
          const double kinetic = number(find_row(summary, key), "f_kinetic");
          const double steady_variance = number(find_row(summary, key), "var_z_steady_per_bristle");
          // Largest variance of deflections on the first loading, a bound for bristles that just entered.
          double virgin_variance = 0.0;
          for (const Row& row : virgin) {
            if (row.at("dist") == law.name && row.at("variant") == table_name(rule))
              virgin_variance = std::max(virgin_variance, 2e6 * std::pow(number(row, "mc_se"), 2));
          }
          const bool doubled = std::string(jump) == "zeta x2";
          const double load1 = doubled ? n / 2 : n;
          const double load2 = doubled ? n : n / 2;

          OnePatch patch(plain_material(law.law, rule), plain_options(n, 1, precision));
          patch.step(0.0, 0.0, load1);
          if (rule == SnapRule::keep) patch.step(1000.37 * dbar, 0.0, load1);
          for (int k = 0; k < 60; ++k) patch.step(0.83 * dbar, 0.0, load1);
          const double unit = load1 * kinetic * dbar;  // kinetic friction at load1, unit of the tables' force
          const double before = -patch.step(0.0, 0.0, load1).elastic[0];
          double x = 0.0;
          for (const Row& row : rows) {
            if (row.at("dist") != law.name || row.at("variant") != table_name(rule) || row.at("jump") != jump)
              continue;
            const double to = number(row, "x_over_dbar_after_jump");
            const Response r = patch.step((to - x) * dbar, 0.0, load2);
            x = to;
            INFO("x = " << x << " mean snap lengths after the jump");
            const double tolerance =
                sigmas * std::sqrt(load1 * steady_variance + std::max(load2 - load1, 0.0) * virgin_variance) /
                (load1 * kinetic);
            expect_near(-r.elastic[0] / unit, number(row, "F_over_Fk1_ref"), tolerance + 1e-5,
                        "force over kinetic force");
            if (x == 0.0 && doubled) {
              // Just after the change the force must be continuous to rounding: only the fractional bristle
              // may have been rewritten.
              expect_near(-r.elastic[0], before, 4.0 * rounding(precision),
                          "force just after the load doubled");
            }
            ++points;
          }
        }
      }
    }
  }
  CHECK(points == static_cast<int>(precisions().size()) * 76);
}

TEST_CASE("A load that ramps up at rest changes no force", "[load]") {
  constexpr std::uint32_t n = 2000;
  for (Precision precision : precisions()) {
    for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
      for (double step_n : {0.013, 0.37, 3.7, 301.3}) {
        INFO(name_of(precision) << ", " << table_name(rule) << ", load steps of " << step_n << " N");
        OnePatch patch(plain_material(uniform, rule), plain_options(n, 2, precision));
        double load = 612.4;
        bend(patch, load);
        const Response start = patch.step(0.0, 0.0, load);
        int changes = 0;
        while (load + step_n < n && changes < 1500) {
          load += step_n;
          ++changes;
          const Response r = patch.step(0.0, 0.0, load);
          for (int axis = 0; axis < 2; ++axis) {
            expect_near(r.elastic[axis], start.elastic[axis], changes * rounding(precision), "force");
            expect_near(r.mean[axis], r.elastic[axis], 0.0, "mean force at rest, the end force");
          }
          expect(r.snaps == 0 && r.dissipated == 0.0, "nothing snaps");
          expect_near(r.stiffness, load, 1e-9 * load, "stiffness");
        }
        REQUIRE(changes >= 4);
      }
    }
  }
}

TEST_CASE("A falling load sheds the bristles that came into contact last", "[load]") {
  constexpr std::uint32_t n = 1000;
  for (Precision precision : precisions()) {
    for (double to : {999.5, 999.0, 700.25, 512.0, 256.0, 255.75, 16.5, 1.5, 1.0, 0.5, 0.001}) {
      INFO(name_of(precision) << ", load falls to " << to << " N");
      OnePatch patch(plain_material(uniform, SnapRule::redraw), plain_options(n, 2, precision));
      bend(patch, n);
      const Bristles before = read(patch, n);
      const double energy = patch.energy();
      const Response r = patch.step(0.0, 0.0, to);
      const double tolerance = n * rounding(precision);
      expect_near(-r.elastic[0], weighted_sum(before.zx, to), tolerance, "force x");
      expect_near(-r.elastic[1], weighted_sum(before.zy, to), tolerance, "force y");
      expect_near(r.contact_loss, energy - patch.energy(),
                  (precision == Precision::single ? 1e-6 : 1e-12) * energy, "energy that left");
      const Bristles after = read(patch, n);
      for (std::uint32_t i = 0; i < n; ++i) {
        // Bristles in contact keep their deflections, also the fractional one; out of contact they read 0.
        const bool in_contact = i < to;
        expect_near(after.zx[i], in_contact ? before.zx[i] : 0.0, rounding(precision), "deflection x");
        expect_near(after.zy[i], in_contact ? before.zy[i] : 0.0, rounding(precision), "deflection y");
      }
      // Checks that the force does not return with the load, because bristles that left re-enter straight.
      expect_near(patch.step(0.0, 0.0, n).elastic[0], r.elastic[0], 4.0 * rounding(precision),
                  "force after the load came back");
    }
  }
}

TEST_CASE("Half a bristle pulls half, and one and a half bristles share what half a bristle held", "[load]") {
  for (Precision precision : precisions()) {
    INFO(name_of(precision));
    const double ulp = 4.0 * rounding(precision);
    const SnapLength law = SnapLength::single(dbar);
    OnePatch patch(plain_material(law, SnapRule::keep), plain_options(4, 2, precision));
    patch.step(0.0, 0.0, 0.5);
    Response r = patch.step(0.6 * dbar, 0.2 * dbar, 0.5);
    expect_near(-r.elastic[0], 0.5 * 0.6 * dbar, ulp, "force of half a bristle, x");
    expect_near(-r.elastic[1], 0.5 * 0.2 * dbar, ulp, "force of half a bristle, y");
    expect_near(-r.mean[0], 0.5 * 0.3 * dbar, ulp, "mean force of half a bristle");
    expect_near(r.stiffness, 0.5, 1e-12, "stiffness of half a bristle");

    // Load raised at rest from 0.5 to 1.5 bristles: the force stays, and the first bristle now counts whole
    // at half the deflection.
    r = patch.step(0.0, 0.0, 1.5);
    expect_near(-r.elastic[0], 0.3 * dbar, ulp, "force after the load rose");
    Bristles b = read(patch, 2);
    expect_near(b.zx[0], 0.3 * dbar, ulp, "deflection of the bristle that became whole");
    expect_near(b.zx[1], 0.0, 0.0, "deflection of the bristle that entered");

    r = patch.step(0.4 * dbar, 0.0, 1.5);
    expect_near(-r.elastic[0], (0.7 + 0.5 * 0.4) * dbar, ulp, "force of one and a half bristles");
    expect_near(-r.elastic[1], 0.1 * dbar, ulp, "force across");

    // Load lowered to 1.25 bristles: the fractional bristle keeps its deflection. Raised to 1.75: its
    // deflection shrinks by the factor (1.25 - 1) / (1.75 - 1), so that the force stays.
    r = patch.step(0.0, 0.0, 1.25);
    expect_near(-r.elastic[0], (0.7 + 0.25 * 0.4) * dbar, ulp, "force at 1.25 bristles");
    r = patch.step(0.0, 0.0, 1.75);
    expect_near(-r.elastic[0], (0.7 + 0.25 * 0.4) * dbar, ulp, "force at 1.75 bristles");
    b = read(patch, 2);
    expect_near(b.zx[1], 0.4 / 3.0 * dbar, ulp,
                "deflection of the fractional bristle after its fraction tripled");

    // Checks that a fractional bristle snaps as a whole one does, and loses its fraction of the energy.
    OnePatch other(plain_material(law, SnapRule::keep), plain_options(4, 1, precision));
    other.step(0.0, 0.0, 1.5);
    r = other.step(1.25 * dbar, 0.0, 1.5);
    expect_near(-r.elastic[0], 1.5 * 0.25 * dbar, ulp, "force after both snapped");
    expect_near(r.dissipated, 1.5 * 0.5 * dbar * dbar, 1e-6 * dbar * dbar, "energy lost by both");
    CHECK(r.snaps == 2);
  }
}

TEST_CASE("The force is that of the bristles in contact where the load ends with a block or beside one",
          "[load]") {
  constexpr std::uint32_t n = 768;  // 768 bristles: three blocks of 256
  for (Precision precision : precisions()) {
    for (double load : {255.0, 255.5, 256.0, 256.5, 511.7, 512.0, 512.3, 767.0, 768.0}) {
      INFO(name_of(precision) << ", load " << load);
      OnePatch patch(plain_material(uniform, SnapRule::keep), plain_options(n, 1, precision));
      for (int k = 0; k < 12; ++k) {
        const Response r = patch.step(0.43 * dbar, 0.0, load);
        expect_near(-r.elastic[0], weighted_sum(read(patch, n).zx, load), load * rounding(precision),
                    "force after a step that snaps");
      }
    }
  }
}

TEST_CASE("The force is continuous in the load", "[load]") {
  constexpr std::uint32_t n = 600;
  for (Precision precision : precisions()) {
    INFO(name_of(precision));
    OnePatch patch(plain_material(uniform, SnapRule::redraw), plain_options(n, 1, precision));
    bend(patch, n);
    double load = n;
    double force = patch.step(0.0, 0.0, load).elastic[0];
    // Lowers the load in tiny steps, past whole numbers of bristles and past block boundaries.
    for (int k = 0; k < 20000; ++k) {
      const double lower = load - 0.021;
      const double now = patch.step(0.0, 0.0, lower).elastic[0];
      expect_near(now, force, (load - lower) * longest + 2.0 * rounding(precision),
                  "force after a tiny fall of the load");
      load = lower;
      force = now;
    }
    // Checks that in sliding small changes of the load change the force by little.
    for (int k = 0; k < 100; ++k) {
      const double wobble = 300.0 + 1e-4 * (k % 3);
      const double a = patch.step(0.0, 0.0, wobble).elastic[0];
      const double b = patch.step(0.0, 0.0, wobble + 1e-4).elastic[0];
      expect_near(b, a, 1e-4 * longest + 2.0 * rounding(precision), "force after a tiny wobble of the load");
    }
  }
}

TEST_CASE("Contact lost forgets the deflections, and contact found again starts like new", "[load]") {
  constexpr std::uint32_t n = 700;
  for (Precision precision : precisions()) {
    INFO(name_of(precision));
    // With SnapRule::keep a patch that lost contact and regained it behaves as one that never moved.
    const Material material = plain_material(uniform, SnapRule::keep);
    OnePatch patch(material, plain_options(n, 2, precision));
    OnePatch fresh(material, plain_options(n, 2, precision));
    bend(patch, 500.5);
    const double energy = patch.energy();
    REQUIRE(energy > 0.0);
    Response r = patch.step(3.3 * dbar, -2.0 * dbar, 0.0);
    CHECK(r.elastic[0] == 0.0);
    CHECK(r.elastic[1] == 0.0);
    CHECK(r.end[0] == 0.0);
    CHECK(r.mean[0] == 0.0);
    CHECK(r.stiffness == 0.0);
    CHECK(r.snaps == 0);
    CHECK(r.contact_loss == Approx(energy).epsilon(1e-6));
    CHECK(patch.energy() == 0.0);
    for (double z : read(patch, n).zx) REQUIRE(z == 0.0);

    patch.step(0.0, 0.0, 500.5);
    fresh.step(0.0, 0.0, 500.5);
    for (int k = 0; k < 30; ++k) {
      const Response a = patch.step(0.37 * dbar, 0.2 * dbar, 500.5);
      const Response b = fresh.step(0.37 * dbar, 0.2 * dbar, 500.5);
      const double tolerance = (k + 1.0) * n * rounding(precision);
      expect_near(a.elastic[0], b.elastic[0], tolerance, "force x");
      expect_near(a.elastic[1], b.elastic[1], tolerance, "force y");
    }

    // With SnapRule::redraw a patch back in contact has its first snap lengths again; later draws are new.
    const Material fading = plain_material(uniform, SnapRule::redraw);
    OnePatch redrawn(fading, plain_options(n, 1, precision));
    const Bristles start = (redrawn.step(0.0, 0.0, n), read(redrawn, n));
    bend(redrawn, n);
    for (int k = 0; k < 20; ++k) redrawn.step(0.8 * dbar, 0.0, n);
    redrawn.step(0.0, 0.0, 0.0);
    redrawn.step(0.0, 0.0, n);
    CHECK(read(redrawn, n).delta == start.delta);
    OnePatch twin(fading, plain_options(n, 1, precision));
    twin.step(0.0, 0.0, n);
    for (int k = 0; k < 5; ++k) {
      redrawn.step(0.7 * dbar, 0.0, n);
      twin.step(0.7 * dbar, 0.0, n);
    }
    CHECK(read(redrawn, n).delta != read(twin, n).delta);
  }
}

TEST_CASE("A load above the maximum scales the forces of all bristles and is reported", "[load]") {
  constexpr std::uint32_t n = 300;
  for (Precision precision : precisions()) {
    INFO(name_of(precision));
    const double ulp = n * rounding(precision);
    OnePatch patch(plain_material(uniform, SnapRule::keep), plain_options(n, 2, precision));
    patch.step(0.0, 0.0, n);
    Response r = patch.step(0.4 * dbar, 0.1 * dbar, n);
    CHECK(r.status == Status::ok);
    const double force = 0.4 * dbar * n;
    expect_near(-r.elastic[0], force, ulp, "force at the maximum");

    // Doubles the load at rest: the force stays, each bristle holds it at half the deflection.
    r = patch.step(0.0, 0.0, 2.0 * n);
    CHECK(has(r.status, Status::overload));
    CHECK(has(patch.report.status, Status::overload));
    expect_near(-r.elastic[0], force, ulp, "force at twice the maximum, at rest");
    expect_near(r.stiffness, 2.0 * n, 1e-9 * n, "stiffness at twice the maximum");
    expect_near(read(patch, 1).zx[0], 0.2 * dbar, 2.0 * rounding(precision), "deflection");

    // Checks that in motion the doubled load has twice the stiffness.
    r = patch.step(0.1 * dbar, 0.0, 2.0 * n);
    expect_near(-r.elastic[0], force + 2.0 * n * 0.1 * dbar, 2.0 * ulp,
                "force after a motion at twice the maximum");
    expect_near(-r.mean[0], force + 2.0 * n * 0.05 * dbar, 2.0 * ulp, "mean force");
    const double energy = patch.energy();
    expect_near(energy, 2.0 * n * 0.5 * (0.09 + 0.0025) * dbar * dbar, 1e-6 * energy, "stored energy");

    // Halves the load: the deflections stay, the force falls with the load.
    r = patch.step(0.0, 0.0, n);
    CHECK(r.status == Status::ok);
    expect_near(-r.elastic[0], n * 0.3 * dbar, ulp, "force back at the maximum");
    expect_near(r.contact_loss, 0.5 * energy, 1e-6 * energy, "energy that left");

    // Goes from a part of the load directly into overload and back: forces are continuous, and the last
    // bristles to enter are the first to leave.
    OnePatch other(plain_material(uniform, SnapRule::keep), plain_options(n, 2, precision));
    other.step(0.0, 0.0, 100.5);
    other.step(0.3 * dbar, 0.0, 100.5);
    r = other.step(0.0, 0.0, 3.0 * n);
    expect_near(-r.elastic[0], 100.5 * 0.3 * dbar, 3.0 * ulp, "force after the load rose into overload");
    const Bristles b = read(other, n);
    expect_near(b.zx[0], 0.1 * dbar, 2.0 * rounding(precision),
                "deflection of a whole bristle at three times the maximum");
    expect_near(b.zx[200], 0.0, 0.0, "deflection of a bristle that entered");
    r = other.step(0.0, 0.0, 50.0);
    expect_near(-r.elastic[0], 50.0 * 0.1 * dbar, ulp, "force after the load fell to 50 bristles");
  }
}

TEST_CASE("Load noise at rest takes whole bristles once, and in overload a share with every swing",
          "[load]") {
  constexpr std::uint32_t n = 100;
  for (const bristle::Population population :
       {bristle::Population::representatives, bristle::Population::infinite}) {
    const Material material = plain_material(uniform, SnapRule::redraw);
    const auto after_swings = [&](std::uint32_t bristles, double low, double high, int swings) {
      OnePatch patch(material, plain_options(bristles).with_population(population));
      patch.step(0.3 * dbar, 0.0, high);
      Response r;
      for (int k = 0; k < swings; ++k) {
        patch.step(0.0, 0.0, low);
        r = patch.step(0.0, 0.0, high);
      }
      return -r.elastic[0] / (0.3 * dbar * high);
    };
    INFO((population == bristle::Population::infinite ? "infinite" : "representatives"));
    for (int swings : {1, 2, 40}) {
      CHECK(after_swings(n, 50.0, 60.0, swings) == Approx(50.0 / 60.0).epsilon(1e-5));
      // Representatives cannot leave in overload. An infinite brush has no overload: bristles leave, once.
      const double kept = population == bristle::Population::infinite ? 0.99 : std::pow(0.99, swings);
      CHECK(after_swings(n, 198.0, 200.0, swings) == Approx(kept).epsilon(1e-4));
    }
  }
  // Swings the load, which rewrites a bristle that counts by a fraction: each swing multiplies its force by
  // 0.5/0.6.
  OnePatch one(plain_material(uniform, SnapRule::keep), plain_options(1));
  one.step(0.3 * dbar, 0.0, 0.6);
  for (int k = 0; k < 5; ++k) {
    one.step(0.0, 0.0, 0.5);
    const Response r = one.step(0.0, 0.0, 0.6);
    CHECK(-r.elastic[0] == Approx(0.18 * dbar * std::pow(5.0 / 6.0, k + 1)).epsilon(1e-5));
  }
}

TEST_CASE("A displacement of a part of a unit of the fixed point counts where it is repeated", "[load]") {
  // Unit of stored positions: 2^-44 of 2^-17 m, a power of two near the mean length of 10 um.
  const double unit = 0x1p-61;
  for (const double step : {0.49, 0.51, 7.3}) {
    OnePatch patch(plain_material(uniform, SnapRule::keep), plain_options(1, 1, Precision::single));
    patch.step(0.0, 0.0, 1.0);
    Response r;
    for (int k = 0; k < 4096; ++k) r = patch.step(step * unit, 0.0, 1.0);
    CHECK(-r.elastic[0] == Approx(4096.0 * step * unit).epsilon(0).margin(0.501 * unit));
  }
}

TEST_CASE("Every change of the load at rest closes the energy balance by contact_loss", "[load][energy]") {
  constexpr std::uint32_t n = 520;
  for (Precision precision : precisions()) {
    INFO(name_of(precision));
    OnePatch patch(plain_material(uniform, SnapRule::redraw), plain_options(n, 2, precision));
    bend(patch, n);
    for (double load : {519.5, 400.25, 400.75, 300.0, 300.5, 600.0, 1200.0, 700.0, 520.0, 37.5, 0.5, 0.25,
                        0.75, 0.0, 12.0}) {
      INFO("load " << load << " N");
      const double before = patch.energy();
      const Response r = patch.step(0.0, 0.0, load);
      // A bristle that counts by a fraction loses energy even if its force stays: raising the fraction from
      // f0 to f1 reduces its energy, f z^2 / 2, to f0/f1 of it.
      expect_near(r.contact_loss, before - patch.energy(),
                  (precision == Precision::single ? 1e-6 : 1e-11) * before, "contact loss");
      expect(r.contact_loss >= -1e-6 * before, "a change of load at rest loses energy or keeps it");
      if (load > 100.0) patch.step(0.21 * dbar, 0.05 * dbar, load);
    }
  }
}

TEST_CASE("A patch of each kind bears the load of its options, and reports an overload above it", "[load]") {
  const Material material = Material{}.with_normal_stiffness(1000.0).with_asperity_height_deviation(1e-6);
  const Material sliding = Material(material).with_snap_rule(SnapRule::slide);
  const struct {
    const char* name;
    const Material& material;
    PatchOptions options;
  } kinds[] = {{"infinite", material, PatchOptions{}},
               {"representatives", material, PatchOptions{}.with_bristles(500)},
               {"slide", sliding, PatchOptions{}.with_bristles(8)}};
  for (const auto& kind : kinds) {
    INFO(kind.name);
    OnePatch patch(kind.material, PatchOptions(kind.options).with_max_normal_load(3.0));
    CHECK(patch.batch.info(patch.id).max_normal_load == Approx(3.0).epsilon(1e-12));
    CHECK(patch.step(0.0, 0.0, 2.999).status == Status::ok);
    CHECK(patch.step(0.0, 0.0, 3.001).status == Status::overload);
  }
}

}  // namespace bristle_test::test_load
