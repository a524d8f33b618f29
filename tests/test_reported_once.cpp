// Tests written to catch planted faults: losses reported once, trials that must leave
// no trace, motions and states that must be refused.
#include <catch2/catch.hpp>

#include <cfloat>
#include <cmath>
#include <vector>

#include "core/patches/saved_state.hpp"
#include "expect.hpp"
#include "reseal.hpp"
#include "scenes.hpp"
#include "variants.hpp"

namespace bristle_test::test_reported_once {

namespace {

const Material surface = plain_material(SnapLength::uniform(0.5 * dbar, 1.5 * dbar), SnapRule::redraw);

struct Lone {
  PatchBatch batch;
  Motion motion;

  explicit Lone(const Material& material, const PatchOptions& options) {
    motion.id = batch.add(material, options);
  }
  Motion& move(double x, double load) {
    motion.displacement[0] = x;
    motion.normal_load = load;
    return motion;
  }
  Response step(double x, double load) {
    Response response;
    batch.step(tick, {&move(x, load), 1}, {&response, 1});
    return response;
  }
  Response find(double x, double load) { return batch.find_force(tick, move(x, load)); }
};

}  // namespace

TEST_CASE("What a live change of material dissipates is reported once, in the next step", "[batch]") {
  Lone patch(surface, plain_options(200).with_outputs(Outputs::all));
  patch.step(0.9 * dbar, 200.0);
  const double before = patch.batch.stored_energy(patch.motion.id);
  // Gives the patch lengths of a tenth, so that bristles bent beyond their new length snap.
  patch.batch.set_material(patch.motion.id,
                           Material(surface).with_snap_length(SnapLength::uniform(0.05 * dbar, 0.15 * dbar)));
  const double after = patch.batch.stored_energy(patch.motion.id);
  REQUIRE(after < 0.5 * before);
  const Response first = patch.step(0.0, 200.0);
  CHECK(first.dissipated == Approx(before - after).epsilon(1e-5));
  CHECK(first.snaps > 0);
  // Moves a little, because a step at rest would repeat the stored response, with its loss.
  const Response second = patch.step(1e-4 * dbar, 200.0);
  CHECK(second.dissipated == 0.0);
  CHECK(second.snaps == 0);
}

TEST_CASE("What waits to be reported is saved with a patch", "[batch][state]") {
  const Material shorter = Material(surface).with_snap_length(SnapLength::uniform(0.05 * dbar, 0.15 * dbar));
  Lone patch(surface, plain_options(200).with_outputs(Outputs::all));
  Lone other(shorter, plain_options(200).with_outputs(Outputs::all));
  patch.step(0.4 * dbar, 200.0);
  // Gives the patch such short lengths that all bristles are bent beyond them and snap once.
  patch.batch.set_material(patch.motion.id, shorter);
  const std::vector<std::byte> state = saved_state(patch.batch);
  other.batch.restore_state(state);
  CHECK(other.step(0.0, 200.0).snaps == 200);
  CHECK(other.step(0.0, 200.0).snaps == 0);
}

TEST_CASE("A load below zero is refused however small it is", "[bad_input]") {
  Lone patch(surface, plain_options(20));
  for (const double load : {-1e-301, -DBL_MIN, -1e-9, -1.0}) {
    INFO(load);
    CHECK(patch.step(0.0, load).status == Status::bad_input);
  }
  CHECK(patch.step(0.0, -0.0).status == Status::ok);
}

TEST_CASE("A patch of one axis takes a velocity along it and refuses one aside", "[bad_input]") {
  Lone patch(Material(surface).with_bristle_damping(0.1), plain_options(20, 1));
  patch.motion.has_velocity = true;
  patch.motion.velocity[0] = 1e-3;
  CHECK(patch.step(0.0, 20.0).status == Status::ok);
  patch.motion.velocity[1] = 1e-3;
  CHECK(patch.step(0.0, 20.0).status == Status::bad_input);
}

TEST_CASE("A trial under another load knows what was stepped and changed since the last one",
          "[batch][load]") {
  const PatchOptions options = plain_options(200).with_outputs(Outputs::all);
  Lone asks(surface, options), other(surface, options);
  for (Lone* patch : {&asks, &other}) patch->step(0.3 * dbar, 200.0);
  asks.find(0.1 * dbar, 120.0);
  for (Lone* patch : {&asks, &other}) patch->step(0.4 * dbar, 200.0);
  CHECK(first_difference(asks.find(0.1 * dbar, 120.0), other.find(0.1 * dbar, 120.0)).empty());
  const Material stiffer = Material(surface).with_bristle_stiffness(2.0);
  const Response before = asks.find(0.1 * dbar, 120.0);
  for (Lone* patch : {&asks, &other}) patch->batch.set_material(patch->motion.id, stiffer);
  const Response after = asks.find(0.1 * dbar, 120.0);
  CHECK(after.elastic[0] == Approx(2.0 * before.elastic[0]).epsilon(1e-6));
}

TEST_CASE("A patch that ages and is reset is as young as a new one", "[ageing][keys]") {
  const Material skin = Material(surface).with_ageing(bristle::Ageing::logarithmic(0.05, 1e-3));
  Lone patch(skin, plain_options(200).with_seed(3));
  patch.step(0.0, 200.0);
  Response response;
  patch.batch.step(1e6, {&patch.move(0.0, 200.0), 1}, {&response, 1});
  const double old = response.force_limit;
  REQUIRE(patch.batch.reset(patch.motion.id));
  Lone fresh(skin, plain_options(200).with_seed(3));
  const Response first = fresh.step(0.1 * dbar, 200.0), again = patch.step(0.1 * dbar, 200.0);
  CHECK(again.force_limit == first.force_limit);
  CHECK(again.end[0] == first.end[0]);
  CHECK(again.force_limit < 0.7 * old);
}

TEST_CASE("A saved state with bytes behind its patches is refused", "[state]") {
  Lone patch(surface, plain_options(20));
  patch.step(0.3 * dbar, 20.0);
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
  Lone patch(make(0.1 * dbar, 1.0, ages, 0.01, 1e-6), options);
  patch.step(0.3 * dbar, 20.0);
  const std::vector<std::byte> state = saved_state(patch.batch);
  Lone same(make(0.1 * dbar, 1.0, ages, 0.01, 1e-6), options);
  same.batch.restore_state(state);
  CHECK(same.batch.state_hash() == patch.batch.state_hash());
  for (const Material& other :
       {make(0.2 * dbar, 1.0, ages, 0.01, 1e-6), make(0.1 * dbar, 2.0, ages, 0.01, 1e-6),
        make(0.1 * dbar, 1.0, bristle::Ageing::logarithmic(0.06, 1e-3), 0.01, 1e-6),
        make(0.1 * dbar, 1.0, bristle::Ageing::logarithmic(0.05, 2e-3), 0.01, 1e-6),
        make(0.1 * dbar, 1.0, bristle::Ageing::saturating(0.05, 1e-3), 0.01, 1e-6),
        make(0.1 * dbar, 1.0, ages, 0.02, 1e-6), make(0.1 * dbar, 1.0, ages, 0.01, 1e-7)}) {
    Lone refuses(other, options);
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
