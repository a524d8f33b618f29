// The features of every build, including BRISTLE_MINIMAL: one axis, keep, end force, float.
#include <catch2/catch.hpp>

#include "scenes.hpp"

namespace bristle_test::test_minimal {

namespace {

const SnapLength law = SnapLength::uniform(0.5 * dbar, 1.5 * dbar);

PatchOptions small_options(std::uint32_t bristles) {
  return plain_options(bristles, 1, Precision::single, Outputs::end);
}

}  // namespace

TEST_CASE("a patch of one axis, keep, end and float follows the virgin curve in every build") {
  constexpr std::uint32_t n = 10000;
  OnePatch patch(plain_material(law, SnapRule::keep), small_options(n));
  for (int i = 1; i <= 10; ++i) {
    // Expected force over dbar after a path x (in dbar): x while nothing snaps, then x - x^2/2 + 1/8 up to x
    // = 1.
    const double x = 0.1 * i;
    const double f = i <= 5 ? x : x - x * x / 2.0 + 0.125;
    const Response response = patch.step(0.1 * dbar, 0.0, n);
    CAPTURE(x);
    REQUIRE(response.status == Status::ok);
    // With stratified lengths the number of snapped bristles has an error of a few, and each snap changes the
    // force by at most one length.
    REQUIRE(response.end[0] == Approx(-f * n * dbar).margin((10.0 + 1e-6 * n) * dbar));
    REQUIRE(response.end[1] == 0.0);
  }
}

#if BRISTLE_MINIMAL
TEST_CASE("a minimal build refuses what it leaves out and says how to get it") {
  const auto refused = Catch::Matchers::Contains("BRISTLE_MINIMAL=OFF");
  const Material keep = plain_material(law, SnapRule::keep);
  const Material redraw = plain_material(law, SnapRule::redraw);
  PatchBatch batch;
  REQUIRE_THROWS_WITH(batch.add(keep, small_options(100).with_axes(2)), refused);
  REQUIRE_THROWS_WITH(batch.add(keep, small_options(100).with_outputs(Outputs::mean)), refused);
  REQUIRE_THROWS_WITH(batch.add(keep, small_options(100).with_outputs(Outputs::energy)), refused);
  REQUIRE_THROWS_WITH(batch.add(keep, small_options(100).with_precision(Precision::double_)), refused);
  REQUIRE_THROWS_WITH(batch.add(keep, with_literal_rule(small_options(100))), refused);
  REQUIRE_THROWS_WITH(batch.add(redraw, small_options(100)), refused);
  REQUIRE_THROWS_WITH(batch.add(redraw, small_options(100).with_population(bristle::Population::infinite)),
                      refused);
  REQUIRE(batch.patch_count() == 0);
}
#endif

}  // namespace bristle_test::test_minimal
