// Changes the material of a patch that slides. A change of the lubricant alone leaves deflections, snap
// lengths and later samples as they are. New snap lengths make bristles snap, and the next step reports their
// energy. Also tests the random position between two snaps that each bristle gets in a step too long for
// single snaps to be computed.
#include <catch2/catch.hpp>

#include <cmath>
#include <cstdint>
#include <vector>

#include "expect.hpp"
#include "infinite_brush.hpp"
#include "scenes.hpp"

namespace bristle_test::test_live_material {

namespace {

constexpr std::uint32_t n = 1500;

/// Deflections and snap lengths of a patch's bristles.
struct Columns {
  std::vector<double> x, y, length;

  Columns(const PatchBatch& batch, PatchId id) : x(n), y(n), length(n) {
    REQUIRE(batch.read_bristles(id, {x.data(), n}, {y.data(), n}, {length.data(), n}) == n);
  }
  bool operator==(const Columns&) const = default;
};

/// Two equal patches, of which one changes its material. The change is of the lubricant only, so the bristles
/// must behave alike.
struct ChangedAndNot {
  PatchBatch batch;
  PatchId changed, same;
  Material before, after;

  explicit ChangedAndNot(SnapRule rule)
      : before(plain_material(SnapLength::lognormal(dbar, 0.3), rule)), after(before) {
    after.viscous_friction = 0.25;
    changed = batch.add(before, plain_options(n));
    same = batch.add(before, plain_options(n));
    batch.warm_up();
  }
  /// Steps both patches and writes their responses.
  void step(double dx, double dy, double load, Response (&out)[2]) {
    const Motion motions[2] = {{changed, {dx, dy}, load}, {same, {dx, dy}, load}};
    batch.step(tick, {motions, 2}, {out, 2});
  }
  void check_columns() { CHECK(Columns(batch, changed) == Columns(batch, same)); }
};

}  // namespace

TEST_CASE("A live change of the lubricant leaves deflections, lengths and draws as they were", "[load]") {
  for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
    ChangedAndNot twins(rule);
    Response out[2];
    for (int k = 0; k < 40; ++k) {
      if (k == 20) {
        twins.batch.set_material(twins.changed, twins.after);
        twins.check_columns();
      }
      twins.step(1.7 * dbar, 0.4 * dbar, n, out);
      // From the change on forces agree to rounding only, because set_material() rewrites deflections.
      for (int axis = 0; axis < 2; ++axis)
        CHECK(out[0].elastic[axis] == Approx(out[1].elastic[axis]).epsilon(1e-5));
    }
    // Checks that both patches draw equal snap lengths to the bit, but for snaps that rounding moved.
    const Columns a(twins.batch, twins.changed), b(twins.batch, twins.same);
    int others = 0;
    for (std::uint32_t i = 0; i < n; ++i) others += a.length[i] != b.length[i];
    CHECK(others < 15);
  }
}

TEST_CASE("A live change of the lubricant keeps the overload", "[load]") {
  for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
    ChangedAndNot twins(rule);
    Response out[2];
    for (int k = 0; k < 12; ++k) {
      if (k == 6) twins.batch.set_material(twins.changed, twins.after);
      twins.step(0.2 * dbar, 0.0, 3.0 * n, out);
      CHECK(has(out[0].status, Status::overload));
      CHECK(out[0].elastic[0] == Approx(out[1].elastic[0]).epsilon(1e-5));
      if (k == 6)  // all bristles in contact: an overload triples each force
        CHECK(twins.batch.info(twins.changed).active == n);
    }
    // Bends both patches by equal paths. If the change of material forgot the overload, only a third of the
    // deflection would be left.
    const Columns a(twins.batch, twins.changed), b(twins.batch, twins.same);
    double sum_a = 0.0, sum_b = 0.0;
    for (std::uint32_t i = 0; i < n; ++i) {
      sum_a += a.x[i];
      sum_b += b.x[i];
    }
    CHECK(sum_a == Approx(sum_b).epsilon(1e-5));
    CHECK(-out[0].elastic[0] == Approx(3.0 * sum_a).epsilon(1e-5));
  }
}

TEST_CASE(
    "Bristles that a live change leaves beyond their snap length lose all that they had stored, on both axes",
    "[load][energy]") {
  for (Precision precision : precisions()) {
    INFO(name_of(precision));
    OnePatch patch(plain_material(SnapLength::single(dbar), SnapRule::keep), plain_options(n, 2, precision));
    patch.step(0.3 * dbar, 0.7 * dbar, n);
    patch.batch.set_material(patch.id, plain_material(SnapLength::single(0.5 * dbar), SnapRule::keep));
    const Response r = patch.step(0.0, 0.0, n);
    // Each bristle is a spring of 1 N/m bent by 0.76 of its old length. Its new length is half of the old
    // one, so it snaps and loses its energy.
    CHECK(r.dissipated == Approx(0.5 * n * (0.09 + 0.49) * dbar * dbar).epsilon(1e-5));
    CHECK(r.snaps == n);
    CHECK(std::abs(r.elastic[0]) + std::abs(r.elastic[1]) < 1e-9 * n * dbar);
  }
}

TEST_CASE("A law that changes by a thousandth moves the force by as little", "[load][cohorts]") {
  const Material before =
      plain_material(SnapLength::lognormal(dbar, 0.3), SnapRule::redraw).with_residual_length(0.1 * dbar);
  const auto scaled = [](double by) { return SnapLength::lognormal(by * dbar, 0.3); };
  struct Change {
    const char* what;
    Material after;
  };
  const Change changes[] = {
      {"longer residual", Material(before).with_residual_length(0.1001 * dbar)},
      {"shorter residual", Material(before).with_residual_length(0.0999 * dbar)},
      {"longer", Material(before).with_snap_length(scaled(1.001))},
      {"shorter", Material(before).with_snap_length(scaled(0.999))},
      {"wider", Material(before).with_snap_length(SnapLength::lognormal(dbar, 0.3003))},
      {"narrower", Material(before).with_snap_length(SnapLength::lognormal(dbar, 0.2997))},
  };
  for (const Change& change : changes)
    for (const char* kind : {"infinite", "redraw", "keep", "slide"}) {
      INFO(change.what << ", " << kind);
      const bool infinite = std::string(kind) == "infinite", slides = std::string(kind) == "slide";
      const SnapRule rule = std::string(kind) == "keep" ? SnapRule::keep
                            : slides                    ? SnapRule::slide
                                                        : SnapRule::redraw;
      const auto of_rule = [&](Material material) {
        if (slides) material.with_residual_length(0.0);
        return material.with_snap_rule(rule);
      };
      PatchOptions options = plain_options(slides ? 32 : 20000).with_max_normal_load(20000.0);
      if (infinite) options.with_bristles(0).with_population(bristle::Population::infinite);
      OnePatch patch(of_rule(before), options);
      Response out;
      for (int k = 0; k < 60; ++k) out = patch.step(0.11 * dbar, 0.0, 20000.0);
      const double force = out.elastic[0];
      patch.batch.set_material(patch.id, of_rule(change.after));
      CHECK(patch.step(0.0, 0.0, 20000.0).elastic[0] == Approx(force).epsilon(2.5e-3));
      // Slides on: the force stays that of steady sliding, within the ripple of 20,000 bristles.
      for (int k = 0; k < 20; ++k) {
        out = patch.step(0.05 * dbar, 0.0, 20000.0);
        CHECK(out.elastic[0] == Approx(force).epsilon(infinite ? 4e-3 : 0.02));
      }
    }
}

TEST_CASE(
    "Bristles take their quantile into another law, and those that snap draw anew, however many they are",
    "[load][cohorts]") {
  const Material before = plain_material(SnapLength::lognormal(dbar, 0.3), SnapRule::redraw);
  for (const SnapLength& law :
       {SnapLength::lognormal(0.5 * dbar, 0.3), SnapLength::lognormal(0.8 * dbar, 0.6),
        SnapLength::uniform(0.5 * dbar, 1.5 * dbar), SnapLength::exponential(0.7 * dbar)})
    for (const double slid : {0.8, 10.0}) {
      INFO(bristle::to_string(law.law()) << " after " << slid << " lengths");
      constexpr double load = 20000.0;
      OnePatch many(before, plain_options(20000));
      OnePatch infinite(before, plain_options(1).with_bristles(0).with_max_normal_load(load).with_population(
                                    bristle::Population::infinite));
      for (OnePatch* patch : {&many, &infinite}) {
        for (int k = 0; k < 20; ++k) patch->step(slid / 20.0 * dbar, 0.0, load);
        patch->batch.set_material(patch->id, Material(before).with_snap_length(law));
      }
      for (int k = 0; k < 30; ++k) {
        const double d = k == 0 ? 0.0 : 0.05 * dbar;
        const double expected = infinite.step(d, 0.0, load).elastic[0];
        CHECK(many.step(d, 0.0, load).elastic[0] == Approx(expected).margin(0.012 * load * dbar));
      }
    }
}

TEST_CASE("Materials that compare equal give the same bits, whichever of them a batch met first",
          "[determinism]") {
  const Material zeros = plain_material(SnapLength::uniform(0.5 * dbar, 1.5 * dbar), SnapRule::redraw)
                             .with_stribeck_velocity(0.0);
  Material negative = zeros;
  negative.with_stribeck_velocity(-0.0);
  negative.with_bristle_damping(-0.0).with_viscous_friction(-0.0);
  negative.with_residual_length(-0.0).with_shared_renewal(-0.0);
  REQUIRE(negative == zeros);
  std::uint64_t hashes[2];
  Response responses[2];
  for (int first : {0, 1}) {
    PatchBatch batch;
    if (first == 1) batch.add(negative, plain_options(10));
    const PatchId id = batch.add(zeros, plain_options(100));
    const Motion motion{id, {3.0 * dbar, -0.5 * dbar}, 70.0};
    batch.step(tick, {&motion, 1}, {&responses[first], 1});
    responses[first].id = PatchId{};
    hashes[first] = batch.state_hash(id);
  }
  CHECK(hashes[0] == hashes[1]);
  CHECK(first_difference(responses[0], responses[1]) == "");
}

TEST_CASE("The phase of a step too long to have one is another for another seed", "[extremes]") {
  for (Precision precision : precisions()) {
    const Material material = plain_material(SnapLength::lognormal(dbar, 0.3), SnapRule::keep);
    const PatchOptions options = plain_options(n).with_precision(precision);
    PatchBatch batch;
    const PatchId ids[3] = {batch.add(material, PatchOptions(options).with_seed(5)),
                            batch.add(material, PatchOptions(options).with_seed(6)),
                            batch.add(material, PatchOptions(options).with_seed(5))};
    // Moves so far that a double cannot tell the position within a snap length, so the library draws each
    // phase.
    const double path = dbar * 0x1p43;
    std::vector<Motion> motions;
    for (PatchId id : ids) motions.push_back({id, {path, 0.0}, static_cast<double>(n)});
    std::vector<Response> out(3);
    batch.step(tick, {motions.data(), 3}, {out.data(), 3});
    const Columns one(batch, ids[0]), other(batch, ids[1]), again(batch, ids[2]);
    CHECK(one == again);
    int alike = 0;
    double sum = 0.0;
    for (std::uint32_t i = 0; i < n; ++i) {
      const double phase = one.x[i] / one.length[i];
      alike += std::abs(phase - other.x[i] / other.length[i]) < 1e-3;
      sum += phase;
      CHECK(phase >= 0.0);
      CHECK(phase <= 1.0);
    }
    // Expects phases with the mean of a uniform law on 0 to 1, to 4 standard errors.
    CHECK(sum / n == Approx(0.5).margin(4.0 / std::sqrt(12.0 * n)));
    CHECK(alike < 25);  // phases alike in both patches, 3 of 1500 by chance
  }
}

TEST_CASE("What a new material snaps is booked by the next step, of a patch that was restored too",
          "[load][energy]") {
  const Material longer = plain_material(uniform, SnapRule::redraw);
  const Material shorter = plain_material(SnapLength::uniform(0.25 * dbar, 0.75 * dbar), SnapRule::redraw);
  OnePatch patch(longer, plain_options(n));
  patch.step(0.45 * dbar, 0.0, n);
  const double before = patch.energy();
  CHECK(before == Approx(0.5 * n * 0.45 * 0.45 * dbar * dbar));
  patch.batch.set_material(patch.id, shorter);
  const double after = patch.energy();
  const std::vector<std::byte> state = saved_state(patch.batch);
  // Checks that the loss by a change of material is reported by the next step, at once or after the state was
  // saved and restored, following steps without a snap.
  for (int times = 3; times >= 0; --times) {
    const Response r = patch.step(0.0, 0.0, n);
    // Two fifths of the new snap lengths are shorter than 0.45 mean lengths, by which the bristles were bent.
    CHECK(r.snaps > n / 5);
    CHECK(r.snaps < n / 5 * 3);
    CHECK(r.dissipated + r.contact_loss == Approx(before - after));
    CHECK(before - after > 0.1 * before);
    for (int k = 0; k < 3; ++k) {
      const Response held = patch.step(k == times ? 1e-4 * dbar : 0.0, 0.0, n);
      CHECK(held.snaps == 0);
      CHECK(held.dissipated == 0.0);
    }
    patch.batch.restore_state(state);
  }
}

namespace {

Material rubbed_uniform(double low, double high, double residual) {
  Material m = plain_material(SnapLength::uniform(low * dbar, high * dbar), SnapRule::redraw);
  m.residual_length = residual * dbar;
  return m;
}

}  // namespace

TEST_CASE("A live change to other lengths keeps the books of an infinite brush", "[load][energy][cohorts]") {
  // Changes to materials with other snap lengths, another fixed-point unit of length, at rest under a load
  // and under an overload. Some cases change again before the step that reports the first change.
  for (const double load : {0.8, 1.7})
    for (const double scale : {0.35, 0.7, 2.9})
      for (const bool twice : {false, true}) {
        INFO("load " << load << ", lengths times " << scale << (twice ? ", twice" : ""));
        Brush brush(rubbed_uniform(0.4, 1.6, 0.1), infinite_options());
        brush.load = load * load_n;
        for (int k = 0; k < 9; ++k) brush.step(k < 6 ? 0.9 : 0.13, 0.2);
        const double before = brush.patch.energy();
        brush.patch.batch.set_material(brush.patch.id, rubbed_uniform(0.4 * scale, 1.6 * scale, 0.1 * scale));
        double between = brush.patch.energy();
        if (scale < 1.0) CHECK(between < before);
        if (twice) {
          brush.patch.batch.set_material(brush.patch.id,
                                         rubbed_uniform(0.1 * scale, 0.4 * scale, 0.05 * scale));
          CHECK(brush.patch.energy() < between);
          between = brush.patch.energy();
        }
        const Response r = brush.patch.step(0.0, 0.0, brush.load);
        CHECK(r.dissipated + r.contact_loss == Approx(before - between).epsilon(1e-9).margin(1e-12 * before));
        CHECK(brush.patch.energy() == Approx(between).epsilon(1e-12));
      }
}

TEST_CASE("Fractions of bristles that live changes snap are counted on", "[load][cohorts]") {
  // Bends 10.3 bristles by 1. The first law has no length below 2, the second none above 0.6, so all of them
  // snap at each change.
  const double bristles = 10.3;
  OnePatch patch(rubbed_uniform(2.0, 4.0, 0.0), infinite_options().with_max_normal_load(bristles));
  std::uint64_t snaps = 0;
  for (int round = 1; round <= 20; ++round) {
    snaps += patch.step(dbar, 0.0, bristles).snaps;
    patch.batch.set_material(patch.id, rubbed_uniform(0.2, 0.6, 0.0));
    patch.batch.set_material(patch.id, rubbed_uniform(2.0, 4.0, 0.0));
    snaps += patch.step(0.0, 0.0, bristles).snaps;
    CHECK(static_cast<double>(snaps) == Approx(bristles * round).margin(1.0));
  }
}

TEST_CASE("Bristles with a lay that snap in a live change leave a force along that before",
          "[live_material]") {
  // All bristles snap to their residual along their deflection, which shortens the force and does not turn
  // it.
  const Material before = plain_material(SnapLength::uniform(0.9 * dbar, 1.1 * dbar), SnapRule::redraw)
                              .with_residual_length(0.3 * dbar);
  const Material after = Material(before).with_snap_length(SnapLength::uniform(0.09 * dbar, 0.11 * dbar));
  for (const auto population : {bristle::Population::infinite, bristle::Population::representatives}) {
    OnePatch patch(before, PatchOptions{}
                               .with_population(population)
                               .with_max_normal_load(1.0)
                               .with_lay(bristle::Lay{}.with_angle(0.5).with_limit_ratio(1.8)));
    const Response bent = patch.step(0.7 * dbar, -0.2 * dbar, 1.0);
    patch.batch.set_material(patch.id, after);
    const Response left = patch.step(0.0, 0.0, 1.0);
    CHECK(std::hypot(left.elastic[0], left.elastic[1]) < 0.6 * std::hypot(bent.elastic[0], bent.elastic[1]));
    CHECK(left.elastic[0] * bent.elastic[1] == Approx(left.elastic[1] * bent.elastic[0]).epsilon(1e-5));
  }
}

}  // namespace bristle_test::test_live_material
