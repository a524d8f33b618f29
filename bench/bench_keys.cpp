// Measures ten thousand contacts per step that are found by key, some of them new in every step, and the
// matching of points that makes such keys.
#include "measured_scene.hpp"
#include "suites.hpp"

namespace bristle_bench {

namespace {

using bristle::ContactPoint;

constexpr std::uint32_t contact_count = 10000;

/// Pool of contacts, and the keys asked for in a step. Every step has `fresh` new keys and leaves out as many
/// old ones.
struct KeyedScene {
  KeyedScene(std::uint32_t fresh_keys, bool seeded)
      : patches(batch, plain_material(SnapLength::lognormal(dbar, 0.3), SnapRule::keep),
                plain_options(100, 1, Precision::single, Outputs::end),
                bristle::KeyedOptions{}.with_capacity(2 * contact_count).with_seed_from_key(seeded)),
        fresh(fresh_keys) {
    batch.warm_up();
    for (std::uint32_t i = 0; i < contact_count; ++i) keys.push_back(next++);
    step();
  }
  std::uint64_t step() {
    for (std::uint32_t i = 0; i < fresh; ++i) keys[position++ % contact_count] = next++;
    std::uint64_t sum = 0;
    for (const std::uint64_t key : keys) sum += patches.find_or_add(key).value;
    return sum + patches.end_step();
  }
  PatchBatch batch;
  bristle::KeyedPatches patches;
  std::uint32_t fresh;
  std::vector<std::uint64_t> keys;
  std::uint64_t next = 1, position = 0;
};

void add_find_benchmark(std::uint32_t fresh, bool seeded) {
  const std::string name = "keys/find_or_add/" + std::to_string(fresh) + "new" + (seeded ? "" : "/one_seed");
  add_benchmark(name, [=](benchmark::State& state) {
    auto& scene =
        keep_while_named<KeyedScene>(name, [&] { return std::make_shared<KeyedScene>(fresh, seeded); });
    for (auto _ : state) benchmark::DoNotOptimize(scene.step());
    state.SetLabel("10,000 contacts of 100 bristles, expiry included");
  });
}

void add_match_benchmark(std::uint32_t per_pair) {
  add_benchmark("keys/match/" + std::to_string(per_pair) + "per_pair", [=](benchmark::State& state) {
    bristle::ContactMatcher matcher(bristle::MatcherOptions{}.with_capacity(contact_count));
    std::vector<ContactPoint> points(contact_count);
    for (std::uint32_t i = 0; i < contact_count; ++i) points[i] = {i / per_pair, {0.01 * i, 0.0, 0.0}};
    std::vector<std::uint64_t> keys(contact_count);
    matcher.match(points, keys);
    for (auto _ : state) {
      for (ContactPoint& p : points) p.point[1] += 1e-4;
      if (matcher.match(points, keys) != contact_count) state.SkipWithError("contacts were lost");
    }
    state.SetLabel("10,000 contacts, all found again");
  });
}

}  // namespace

void register_keys() {
  for (std::uint32_t fresh : {0u, 100u, 1000u}) add_find_benchmark(fresh, true);
  add_find_benchmark(100, false);
  for (std::uint32_t per_pair : {1u, 4u, 16u}) add_match_benchmark(per_pair);
}

}  // namespace bristle_bench
