// Skipping in patches of several groups of blocks (more than 16,384 bristles), where the patch's bound comes
// from groups that were last visited at different places: it gives the bits of visiting every bristle.
#include <catch2/catch.hpp>

#include <cmath>
#include <cstdint>
#include <random>

#include "scenes.hpp"

namespace bristle_test::test_skipping_groups {

namespace {

constexpr std::uint32_t many = 50000;  // 50000 bristles: 196 blocks, 4 groups

/// Two batches whose results must never differ: one skips blocks, one visits every bristle in every step.
struct Twins {
  PatchBatch lazy;
  PatchBatch eager{stepped_eagerly()};
  PatchId id;
  std::uint64_t visited_lazy = 0, visited_eager = 0;
  int wrong = 0;

  Twins(const SnapLength& law, SnapRule rule) {
    const PatchOptions options = plain_options(many).with_outputs(Outputs::energy);
    id = lazy.add(plain_material(law, rule), options);
    eager.add(plain_material(law, rule), options);
  }
  void step(double dx, double dy) {
    const Motion motion{id, {dx, dy}, static_cast<double>(many)};
    Response a, b;
    visited_lazy += lazy.step(tick, {&motion, 1}, {&a, 1}).bristles_visited;
    visited_eager += eager.step(tick, {&motion, 1}, {&b, 1}).bristles_visited;
    wrong +=
        a.end[0] != b.end[0] || a.end[1] != b.end[1] || a.snaps != b.snaps || a.dissipated != b.dissipated;
  }
  void check() {
    CHECK(wrong == 0);
    CHECK(lazy.state_hash() == eager.state_hash());
    // Checks that the lazy batch (which skips blocks) skipped at least half of the visits.
    if (!is_scalar(lazy)) CHECK(visited_lazy < visited_eager / 2);
  }
};

/// Slides to scatter the deflections, then takes small steps along `angle` and back, and turns by `turn` rad
/// after each.
void move_about(Twins& twins, double angle, double turn, int steps) {
  std::mt19937 random(3);
  const auto unit = [&random] { return static_cast<double>(random()) / 4294967296.0; };
  double there = 0.0;
  for (int k = 0; k < steps; ++k) {
    if (k % 100 == 0) {  // scatters the deflections by a slide again
      twins.step(2.7 * dbar * std::cos(angle + 1.0), 2.7 * dbar * std::sin(angle + 1.0));
      there = 0.0;
    }
    const double way =
        dbar * std::pow(10.0, -6.0 + 4.0 * unit()) * (there > 0.0 && unit() < 0.3 ? -1.0 : 1.0);
    there += way;
    twins.step(way * std::cos(angle), way * std::sin(angle));
    angle += turn;
  }
}

}  // namespace

TEST_CASE("Several groups of blocks are skipped with the same bits, whatever the direction", "[skipping]") {
  constexpr double half_turn = 3.141592653589793;
  for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
    for (double angle : {0.0, 0.5 * half_turn, half_turn, -0.5 * half_turn, 0.8}) {
      INFO((rule == SnapRule::keep ? "keep" : "redraw") << ", along " << angle);
      Twins twins(SnapLength::lognormal(dbar, 0.3), rule);
      move_about(twins, angle, 0.0, 800);
      twins.check();
    }
    INFO((rule == SnapRule::keep ? "keep" : "redraw") << ", turning");
    Twins turning(SnapLength::lognormal(dbar, 0.3), rule);
    move_about(turning, 0.0, 0.05, 2000);
    turning.check();
  }
}

}  // namespace bristle_test::test_skipping_groups
