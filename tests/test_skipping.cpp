// Skipping blocks that cannot snap is exact: it gives the bits of visiting every bristle, over long random
// motions with near-ties placed on purpose.
#include <catch2/catch.hpp>

#include <cmath>
#include <cstdint>
#include <random>
#include <utility>

#include "bristle/bristle.hpp"
#include "scenes.hpp"

namespace bristle_test::test_skipping {

namespace {

using namespace bristle;

/// Two batches whose results must never differ: one skips blocks, one visits every bristle in every step.
struct Twins {
  PatchBatch lazy{BatchOptions{}};
  PatchBatch eager{stepped_eagerly()};
  PatchId id;
  std::uint64_t visited_lazy = 0;
  std::uint64_t visited_eager = 0;

  Twins(const Material& material, const PatchOptions& options) {
    id = lazy.add(material, options);
    eager.add(material, options);
  }
  /// Steps both batches. Returns whether all numbers of their responses agree to the bit.
  bool step(double dx, double dy, double load) {
    const Motion motion{id, {dx, dy}, load};
    Response a;
    Response b;
    visited_lazy += lazy.step(1e-3, {&motion, 1}, {&a, 1}).bristles_visited;
    visited_eager += eager.step(1e-3, {&motion, 1}, {&b, 1}).bristles_visited;
    return a.end[0] == b.end[0] && a.end[1] == b.end[1] && a.mean[0] == b.mean[0] && a.mean[1] == b.mean[1] &&
           a.dissipated == b.dissipated && a.contact_loss == b.contact_loss && a.snaps == b.snaps;
  }
  bool same_state() const { return lazy.state_hash() == eager.state_hash(); }
};

constexpr double mean_length = 10e-6;

Material surface(SnapRule rule, int law) {
  const SnapLength lengths[] = {SnapLength::uniform(0.5 * mean_length, 1.5 * mean_length),
                                SnapLength::lognormal(mean_length, 0.3), SnapLength::exponential(mean_length),
                                SnapLength::single(mean_length)};
  return Material{}.with_snap_rule(rule).with_snap_length(lengths[law]);
}

}  // namespace

TEST_CASE("Skipping gives the same bits as visiting, over 1e5 random steps with near-ties", "[skipping]") {
  for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
    for (Precision precision : {Precision::single, Precision::double_}) {
      if (precision == Precision::double_ && !BRISTLE_WITH_DOUBLE) continue;
      Twins twins(surface(rule, 0),
                  plain_options(1500, 2, precision, Outputs::all).with_max_normal_load(2.0));
      std::mt19937 random(7);
      const auto unit = [&random] { return static_cast<double>(random()) / 4294967296.0; };
      double load = 1.5;
      double speed = 1e-8;
      double angle = 0.0;
      double back_x = 0.0;
      double back_y = 0.0;
      int wrong = 0;
      int hashes_wrong = 0;
      for (int k = 0; k < 30000; ++k) {
        if (k % 50 == 0) speed = mean_length * std::pow(10.0, -6.0 + 6.5 * unit());
        if (k % 37 == 0) angle = 6.283185307179586 * unit();
        if (k % 211 == 0) load = unit() < 0.15 ? 0.0 : 2.4 * unit();  // 0 (no contact) to above the maximum
        double dx = speed * std::cos(angle);
        double dy = speed * std::sin(angle);
        switch (k % 10) {
          case 3:  // the patch moves exactly back
            dx = -back_x;
            dy = -back_y;
            break;
          case 4:  // the patch stays at rest
            dx = dy = 0.0;
            break;
          case 5: {  // a snap length, or a bit less or more
            const double tie = mean_length * (0.5 + 0.25 * static_cast<double>(random() % 5));
            dx = (std::nextafter(tie, unit() < 0.5 ? 0.0 : 1.0)) * (unit() < 0.5 ? -1.0 : 1.0);
            dy = 0.0;
            break;
          }
          default:
            break;
        }
        if (!twins.step(dx, dy, load)) ++wrong;
        back_x = dx;
        back_y = dy;
        if (k % 97 == 0 && !twins.same_state()) ++hashes_wrong;
        if (k % 4999 == 4998) {
          const Material other = surface(rule, (k / 4999) % 4);
          twins.lazy.set_material(twins.id, other);
          twins.eager.set_material(twins.id, other);
        }
      }
      CHECK(wrong == 0);
      CHECK(hashes_wrong == 0);
      CHECK(twins.same_state());
      if (!is_scalar(twins.lazy)) CHECK(twins.visited_lazy < twins.visited_eager);
    }
  }
}

TEST_CASE("A path that ends beside the next snap gives the same bits as visiting, up to the last bit",
          "[skipping]") {
  for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
    for (Precision precision : {Precision::single, Precision::double_}) {
      if (precision == Precision::double_ && !BRISTLE_WITH_DOUBLE) continue;
      for (int axes : {1, 2}) {
        INFO((rule == SnapRule::keep ? "keep, axes " : "redraw, axes ") << axes);
        Twins twins(surface(rule, 0), plain_options(1500, axes, precision).with_max_normal_load(2.0));
        std::mt19937 random(11);
        const auto unit = [&random] { return static_cast<double>(random()) / 4294967296.0; };
        const auto snaps_in = [&twins](double path) {
          return twins.eager.find_force(1e-3, Motion{twins.id, {path, 0.0}, 2.0}).snaps > 0;
        };
        int wrong = 0;
        for (int round = 0; round < 40; ++round) {
          const double forward = unit() < 0.5 ? 1.0 : -1.0;
          wrong += !twins.step(forward * mean_length * (0.3 + 2.0 * unit()), 0.0, 2.0);
          // Takes small steps, after which the lazy batch (which skips blocks) knows the path to the next
          // snap of every block of bristles.
          for (int k = 0; k < 3; ++k) wrong += !twins.step(-forward * 1e-6 * mean_length, 0.0, 2.0);
          // Finds by bisection the smallest displacement, forward or back, that makes a bristle snap.
          // Bristles are bent along x.
          double holds[2] = {0.0, 0.0}, snaps[2] = {-2.0 * mean_length, 2.0 * mean_length};
          for (int side = 0; side < 2; ++side) {
            for (int k = 0; k < 60; ++k) {
              const double middle = 0.5 * (holds[side] + snaps[side]);
              (snaps_in(middle) ? snaps : holds)[side] = middle;
            }
          }
          const int side = std::fabs(snaps[0]) < std::fabs(snaps[1]) ? 0 : 1;
          // Moves by the largest displacement without a snap, by the smallest with one, or by up to a
          // thousandth more.
          const double path = round % 4 == 0   ? holds[side]
                              : round % 4 == 1 ? snaps[side]
                                               : snaps[side] * (1.0 + std::pow(10.0, -3.0 - 4.0 * unit()));
          wrong += !twins.step(path, 0.0, 2.0);
          wrong += !twins.same_state();
        }
        CHECK(wrong == 0);
      }
    }
  }
}

namespace {

/// Slides to scatter the deflections, then takes small steps along `angle` and back, and turns by `turn` rad
/// after each. Returns the number of steps whose results differ.
int move_about(Twins& twins, double angle, double turn, int steps) {
  std::mt19937 random(3);
  const auto unit = [&random] { return static_cast<double>(random()) / 4294967296.0; };
  double there = 0.0;
  int wrong = 0;
  for (int k = 0; k < steps; ++k) {
    if (k % 100 == 0) {
      const double slide = 2.7 * mean_length;
      wrong += !twins.step(slide * std::cos(angle + 1.0), slide * std::sin(angle + 1.0), 2.0);
      there = 0.0;
    }
    const double path =
        mean_length * std::pow(10.0, -6.0 + 4.0 * unit()) * (there > 0.0 && unit() < 0.3 ? -1.0 : 1.0);
    there += path;
    wrong += !twins.step(path * std::cos(angle), path * std::sin(angle), 2.0);
    angle += turn;
  }
  return wrong;
}

}  // namespace

TEST_CASE("Several groups of blocks are skipped with the same bits, whatever the direction", "[skipping]") {
  // 50,000 bristles are 196 blocks in 4 groups, which were last visited at different positions.
  constexpr double half_turn = 3.141592653589793;
  for (SnapRule rule : {SnapRule::keep, SnapRule::redraw})
    for (const auto& [angle, turn] : {std::pair{0.0, 0.0},
                                      {0.5 * half_turn, 0.0},
                                      {half_turn, 0.0},
                                      {-0.5 * half_turn, 0.0},
                                      {0.8, 0.0},
                                      {0.0, 0.05}}) {
      INFO((rule == SnapRule::keep ? "keep" : "redraw") << ", along " << angle << ", turning by " << turn);
      Twins twins(surface(rule, 1),
                  plain_options(50000).with_outputs(Outputs::energy).with_max_normal_load(2.0));
      CHECK(move_about(twins, angle, turn, turn == 0.0 ? 800 : 2000) == 0);
      CHECK(twins.same_state());
      if (!is_scalar(twins.lazy)) CHECK(twins.visited_lazy < twins.visited_eager / 2);
    }
}

TEST_CASE("Tremor after sliding visits under a hundredth of the bristles once it has settled", "[skipping]") {
  Twins twins(surface(SnapRule::keep, 0),
              PatchOptions{}.with_max_normal_load(2.0).with_bristles(20000).with_axes(1));
  for (int k = 0; k < 300; ++k) twins.step(1.1 * mean_length, 0.0, 2.0);
  double at = 0.0;
  const auto tremor = [&](int k) {
    const double to = 0.05 * mean_length * std::sin(0.0628 * k);  // a tremor of 10 Hz, sampled at 1 kHz
    twins.step(to - at, 0.0, 2.0);
    at = to;
  };
  for (int k = 0; k < 500; ++k) tremor(k);
  twins.visited_lazy = twins.visited_eager = 0;
  for (int k = 500; k < 3500; ++k) tremor(k);
  CHECK(twins.same_state());
  CHECK(twins.visited_eager == 3000u * 20000u);
  if (!is_scalar(twins.lazy)) CHECK(twins.visited_lazy * 100 < twins.visited_eager);
}

TEST_CASE("A stuck patch is not looked at, and many bristles that enter at once are not written",
          "[skipping]") {
  PatchBatch batch;
  if (is_scalar(batch)) return;
  const PatchId id = batch.add(surface(SnapRule::keep, 0),
                               PatchOptions{}.with_max_normal_load(2.0).with_bristles(100000).with_axes(1));
  const auto visited = [&](double dx, double load) {
    const Motion motion{id, {dx, 0.0}, load};
    Response response;
    return batch.step(1e-3, {&motion, 1}, {&response, 1}).bristles_visited;
  };
  CHECK(visited(0.0, 2.0) == 0);
  // Straight bristles do not snap within the shortest length, 0.5 of the mean, so none is visited.
  for (int k = 0; k < 40; ++k) CHECK(visited(0.01 * mean_length, 2.0) == 0);
  CHECK(visited(0.2 * mean_length, 2.0) > 0);
  // Loses contact and regains it. All bristles re-enter straight, so none is visited until the path reaches
  // the shortest length.
  CHECK(visited(0.0, 0.0) == 0);
  CHECK(visited(0.3 * mean_length, 2.0) == 0);
}

}  // namespace bristle_test::test_skipping
