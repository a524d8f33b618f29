// Tests written to catch planted faults: motions and states that must be refused, keys that must differ.
#include <catch2/catch.hpp>

#include <vector>

#include "core/patches/saved_state.hpp"
#include "expect.hpp"
#include "reseal.hpp"
#include "scenes.hpp"

namespace bristle_test::test_reported_once {

namespace {

const Material surface = plain_material(SnapLength::uniform(0.5 * dbar, 1.5 * dbar), SnapRule::redraw);

}  // namespace

TEST_CASE("A saved state with bytes behind its patches is refused", "[state]") {
  OnePatch patch(surface, plain_options(20));
  patch.step(0.3 * dbar, 0.0, 20.0);
  std::vector<std::byte> state = saved_state(patch.batch);
  state.resize(state.size() + 8);
  reseal(state);  // corrects the checksum of the forged state
  CHECK_THROWS_WITH(patch.batch.restore_state(state), Catch::Contains("more than its patches"));
}

TEST_CASE("A saved state is refused where any parameter of the material is another", "[state]") {
  const auto make = [](double residual, double renewal, const bristle::Ageing& ageing, double strengthening,
                       double speed) {
    return Material(surface)
        .with_residual_length(residual)
        .with_shared_renewal(renewal)
        .with_ageing(ageing)
        .with_speed_strengthening(strengthening, speed);
  };
  const auto ages = bristle::Ageing::logarithmic(0.05, 1e-3);
  const PatchOptions options = plain_options(20);
  OnePatch patch(make(0.1 * dbar, 1.0, ages, 0.01, 1e-6), options);
  patch.step(0.3 * dbar, 0.0, 20.0);
  const std::vector<std::byte> state = saved_state(patch.batch);
  OnePatch same(make(0.1 * dbar, 1.0, ages, 0.01, 1e-6), options);
  same.batch.restore_state(state);
  CHECK(same.batch.state_hash() == patch.batch.state_hash());
  for (const Material& other :
       {make(0.2 * dbar, 1.0, ages, 0.01, 1e-6), make(0.1 * dbar, 2.0, ages, 0.01, 1e-6),
        make(0.1 * dbar, 1.0, bristle::Ageing::logarithmic(0.06, 1e-3), 0.01, 1e-6),
        make(0.1 * dbar, 1.0, bristle::Ageing::logarithmic(0.05, 2e-3), 0.01, 1e-6),
        make(0.1 * dbar, 1.0, bristle::Ageing::saturating(0.05, 1e-3), 0.01, 1e-6),
        make(0.1 * dbar, 1.0, ages, 0.02, 1e-6), make(0.1 * dbar, 1.0, ages, 0.01, 1e-7)}) {
    OnePatch refuses(other, options);
    CHECK_THROWS_AS(refuses.batch.restore_state(state), bristle::Error);
  }
}

TEST_CASE("Neighbouring keys of pools with neighbouring seeds have bristles of their own", "[keys]") {
  PatchBatch batch;
  const auto pool = [&](std::uint32_t seed) {
    return bristle::KeyedPatches(batch, surface, plain_options(1).with_seed(seed),
                                 bristle::KeyedOptions{}.with_capacity(1));
  };
  const bristle::KeyedPatches five = pool(5), six = pool(6);
  for (const std::uint64_t key : {1u, 10u, 1000u}) CHECK(five.seed_of(key + 1) != six.seed_of(key));
}

TEST_CASE("Contacts are matched by their distance in space, up to the reach itself", "[keys]") {
  constexpr double reach = 0.5;
  bristle::ContactMatcher matcher(bristle::MatcherOptions{}.with_capacity(4).with_reach(reach));
  using Points = std::vector<bristle::ContactPoint>;
  const auto keys_of = [&](const Points& points) {
    std::vector<std::uint64_t> keys(points.size());
    matcher.match(points, keys);
    return keys;
  };
  for (int axis = 0; axis < 3; ++axis) {
    INFO("axis " << axis);
    matcher.clear();
    const auto at = [axis](double x) {
      bristle::ContactPoint point{7, {0.0, 0.0, 0.0}};
      point.point[axis] = x;
      return point;
    };
    const std::vector<std::uint64_t> first = keys_of({at(0.0), at(1.0)});
    // Lists the contact points in the other order, moved by the matcher's reach at most: keys stay.
    const std::vector<std::uint64_t> then = keys_of({at(1.0 + reach), at(0.125)});
    CHECK(then[0] == first[1]);
    CHECK(then[1] == first[0]);
    // Checks that a point that moved farther than the matcher's reach gets a new key.
    CHECK(keys_of({at(0.125 + 1.01 * reach)})[0] != first[0]);
  }
}

}  // namespace bristle_test::test_reported_once
