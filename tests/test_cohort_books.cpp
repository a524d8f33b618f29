// Invariants of the infinite brush's cohorts under any motion: shares of the load, first moment, order of
// coming into contact, energy. Reads a contact's columns.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "core/patches/lanes/brush_block.hpp"
#include "core/runtime/batch_access.hpp"
#include "core/runtime/batch_impl.hpp"
#include "expect.hpp"
#include "infinite_brush.hpp"
#include "scenes.hpp"

namespace bristle_test::test_cohort_books {

using namespace bristle::detail;

namespace {

/// A patch in a batch, with access to the columns of its cohorts.
struct OpenBrush {
  OpenBrush(const Material& material, const PatchOptions& options) : id(batch.add(material, options)) {}
  Response step(double dx, double dy, double load) {
    return step_one(batch, Motion{id, {dx * dbar, dy * dbar}, load});
  }
  const BrushBlock<float>& block() {
    const Patch& p = *BatchAccess::inside(batch).pool.find(id);
    return static_cast<const BrushBlock<float>&>(*lane_of(p).block);
  }
  double read(const LaneColumn<float>* column, std::uint32_t cohort = 0) { return column[cohort].lane[0]; }

  PatchBatch batch;
  PatchId id;
};

PatchOptions single(const PatchOptions& options) {
  return PatchOptions(options).with_precision(Precision::single);
}

/// Sums over the cohorts of a contact, one by one.
struct Books {
  double share = 0.0, moment[2] = {0.0, 0.0};
  std::uint32_t used = 0;
};
Books read_books(OpenBrush& brush) {
  const BrushColumns<float>& c = brush.block().columns;
  Books b;
  for (std::uint32_t i = 0; i < brush.block().law.cohorts; ++i) {
    if (brush.read(c.fresh, i) == 0.0) continue;
    const double share = brush.read(c.fresh, i) * brush.read(c.left, i);
    expect(share > 0.0 && share < 1.0 + 1e-5, "a share");
    expect(brush.read(c.left, i) > 0.0 && brush.read(c.left, i) <= 1.0, "a survival");
    b.share += share;
    b.moment[0] += share * brush.read(c.x, i);
    b.moment[1] += share * brush.read(c.y, i);
    ++b.used;
  }
  return b;
}

/// A random walk under random loads. Three of four steps are short. The load is kept, varied by 1 %, set at
/// random, 0, or above the highest.
struct WildPath {
  double dx = 0.0, dy = 0.0, load = load_n;
  std::mt19937_64 generator{77};
  std::uniform_real_distribution<double> flat{-1.0, 1.0};

  void next() {
    const double stroke = std::pow(10.0, 2.0 * flat(generator) - 1.0) * (flat(generator) > 0.99 ? 20.0 : 1.0);
    dx = stroke * flat(generator);
    dy = stroke * flat(generator);
    const double kind = flat(generator);
    if (kind > 0.98)
      load = 0.0;
    else if (kind > 0.9)
      load = load_n * std::pow(10.0, -3.0 + 3.5 * std::abs(flat(generator)));
    else if (kind > 0.5)
      load = std::max(0.3 * load_n, load) * (1.0 + 0.01 * flat(generator));
  }
};

}  // namespace

TEST_CASE("After every step the cohorts hold the load, and the moment is theirs", "[cohorts][mass]") {
  const int steps = bristle_test::test_size(20000);
  for (const SnapLength& law : {SnapLength::lognormal(dbar, 0.3), SnapLength::exponential(dbar)})
    for (const double resolution : {2.0, 8.0}) {
      INFO(to_string(law.law()) << ", resolution " << resolution);
      OpenBrush brush(plain_material(law, SnapRule::redraw), single(infinite_options(resolution)));
      WildPath path;
      int full = 0;
      double worst_share = 0.0, worst_moment = 0.0;
      for (int i = 0; i < steps; ++i) {
        path.next();
        brush.step(path.dx, path.dy, path.load);
        const Books b = read_books(brush);
        worst_share = std::max(worst_share, std::abs(b.share - (path.load > 0.0 ? 1.0 : 0.0)));
        for (int axis = 0; axis < 2; ++axis)
          worst_moment = std::max(worst_moment,
                                  std::abs(b.moment[axis] - brush.read(brush.block().columns.moment[axis])));
        if (b.used == brush.block().law.cohorts) ++full;
      }
      CHECK(worst_share < 2e-5);
      CHECK(worst_moment < 5e-5);
      if (resolution == 2.0)
        CHECK(full > steps / 1000);  // else no cohorts were merged, and nothing was tested
    }
}

TEST_CASE("Bristles that came into contact last leave an infinite brush first", "[cohorts][mass][load]") {
  OpenBrush brush(plain_material(SnapLength::lognormal(dbar, 0.3), SnapRule::redraw),
                  single(infinite_options()));
  // Shares of the load: 0.6 is bent by 0.2 mean lengths, 0.3 by 0.1, and 0.1 is straight; force is their sum.
  // A share of 5e-8 of the law is shorter than 0.2.
  const auto force = [](const Response& r) { return -r.elastic[0] / (load_n * dbar); };
  brush.step(0.0, 0.0, 0.6 * load_n);
  brush.step(0.1, 0.0, 0.6 * load_n);
  brush.step(0.0, 0.0, 0.9 * load_n);
  brush.step(0.1, 0.0, 0.9 * load_n);
  CHECK(force(brush.step(0.0, 0.0, 1.0 * load_n)) == Approx(0.6 * 0.2 + 0.3 * 0.1).epsilon(1e-6));
  CHECK(force(brush.step(0.0, 0.0, 0.9 * load_n)) == Approx(0.6 * 0.2 + 0.3 * 0.1).epsilon(1e-6));
  CHECK(force(brush.step(0.0, 0.0, 0.7 * load_n)) == Approx(0.6 * 0.2 + 0.1 * 0.1).epsilon(1e-6));
  CHECK(force(brush.step(0.0, 0.0, 0.4 * load_n)) == Approx(0.4 * 0.2).epsilon(1e-6));
  CHECK(force(brush.step(0.0, 0.0, 0.0)) == 0.0);
}

TEST_CASE(
    "What a rise of the load at rest brought in leaves with the fall, after any slide and any fall before",
    "[cohorts][mass][load]") {
  // Load changes at rest keep the force: bristles that enter are straight, and are the first to leave again.
  for (const double fallen : {1.0, 0.6})
    for (const double distance : {0.3, 0.9, 2.3, 40.0}) {
      INFO("slides of " << distance << ", a fall to " << fallen);
      Brush brush(SnapLength::lognormal(dbar, 0.3), infinite_options(4.0));
      brush.load = 0.5 * load_n;
      for (int k = 0; k < 7; ++k) brush.step(k % 3 == 2 ? -distance : distance, 0.1 * k * distance);
      brush.load *= fallen;
      brush.step(0.0);
      brush.step(0.4 * distance, 0.2);
      const double before[2] = {brush.response.elastic[0], brush.response.elastic[1]};
      const double least = brush.load;
      for (const double more : {1.3, 1.9}) {
        brush.load = more * least;
        brush.step(0.0);
        for (int axis = 0; axis < 2; ++axis) CHECK(brush.response.elastic[axis] == Approx(before[axis]));
      }
      brush.load = least;
      brush.step(0.0);
      for (int axis = 0; axis < 2; ++axis)
        CHECK(brush.response.elastic[axis] == Approx(before[axis]).margin(1e-6 * load_n * dbar));
    }
}

TEST_CASE("A restored state does not hold by the bound of the state before", "[cohorts][state]") {
  // Brings both patches to one position, one bent by 0.45 mean lengths, the other set down there, so that 0.3
  // more makes no bristle of the uniform law snap in the latter.
  const SnapLength law = SnapLength::uniform(0.5 * dbar, 1.5 * dbar);
  Brush brush(law), other(law);
  for (Brush* b : {&brush, &other}) {
    b->step(0.0);
    b->step(0.45);
  }
  const std::vector<std::byte> state = saved_state(brush.patch.batch);
  brush.load = 0.0;
  brush.step(0.0);
  brush.load = load_n;
  brush.step(0.0);
  brush.step(0.01);
  brush.step(-0.01);
  brush.patch.batch.restore_state(state);
  brush.step(0.3);
  other.step(0.3);
  CHECK(brush.response.snaps > 0);
  CHECK(brush.response.snaps == other.response.snaps);
  CHECK(brush.x() == other.x());
}

}  // namespace bristle_test::test_cohort_books
