// Patches by key, contacts matched by nearest point, and patches reset for new keys.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <unordered_map>
#include <vector>

#include "core/contacts/key_table.hpp"
#include "expect.hpp"
#include "reseal.hpp"
#include "scenes.hpp"
#include "variants.hpp"

namespace bristle_test::test_keyed_patches {

using bristle::ContactMatcher;
using bristle::ContactPoint;
using bristle::KeyedOptions;
using bristle::KeyedPatches;
using bristle::MatcherOptions;
using bristle::no_contact_key;
using bristle::detail::KeyTable;

namespace {

const Material surface = plain_material(SnapLength::lognormal(dbar, 0.3), SnapRule::redraw);

std::vector<ContactPoint> grid_points(std::uint64_t pair, int count, double spacing) {
  std::vector<ContactPoint> points;
  for (int i = 0; i < count; ++i) points.push_back({pair, {spacing * i, 0.5 * spacing * i, 0.0}});
  return points;
}

}  // namespace

TEST_CASE("The table of keys agrees with std::unordered_map over random insertions and erasures", "[keys]") {
  for (std::size_t room : {1u, 8u, 100u}) {
    KeyTable table(room);
    std::unordered_map<std::uint64_t, std::uint32_t> model;
    std::mt19937_64 random(room);
    // Draws keys from a range of three times the capacity, so that they repeat. Half of them are shifted by
    // 40 bits, which collide in poor hash functions.
    const auto any_key = [&] {
      const std::uint64_t k = random() % (3 * room);
      return random() % 2 ? k : k << 40;
    };
    for (int i = 0; i < 60000; ++i) {
      const std::uint64_t key = any_key();
      if (random() % 2 && model.size() < room && !model.count(key)) {
        const auto value = static_cast<std::uint32_t>(random() % 1000);
        table.insert(key, value);
        model[key] = value;
      } else if (random() % 3) {
        table.erase(key);
        model.erase(key);
      }
      const std::uint64_t asked = any_key();
      const auto found = model.find(asked);
      expect(table.find(asked) == (found == model.end() ? KeyTable::none : found->second), "found the same");
      if (i % 997 == 0)
        for (const auto& [k, v] : model) expect(table.find(k) == v, "all are there");
    }
  }
}

TEST_CASE("Reset keeps to patches that exist", "[keys]") {
  PatchBatch batch;
  CHECK_FALSE(batch.reset(PatchId{}));
  CHECK_FALSE(batch.reset(PatchId{12345}, 1, 2));
  const PatchId a = batch.add(surface, plain_options(50).with_seed(3).with_key(9));
  const PatchId b = batch.add(surface, plain_options(50).with_seed(4));
  const std::uint64_t fresh = batch.state_hash(a);
  for (const PatchId id : {a, b}) step_one(batch, Motion{id, {0.3 * dbar, 0.0}, 40.0});
  const std::uint64_t other = batch.state_hash(b);
  REQUIRE(batch.reset(a));
  CHECK(batch.state_hash(a) == fresh);
  CHECK(batch.state_hash(b) == other);
  CHECK(batch.info(a).key == 9);
  CHECK(batch.info(a).normal_load == 0.0);
  CHECK(batch.stored_energy(a) == 0.0);
  REQUIRE(batch.reset(a, 3, 77));  // the seed that it has
  CHECK(batch.state_hash(a) == fresh);
  const std::vector<std::byte> saved = saved_state(batch);
  batch.reset(a, 5, 6);
  CHECK(batch.info(a).key == 6);
  batch.restore_state(saved);
  CHECK(batch.info(a).key == 77);
  batch.remove(a);
  CHECK_FALSE(batch.reset(a));
}

TEST_CASE("A key keeps its patch while it is asked for and loses it after keep_steps", "[keys]") {
  for (std::uint32_t keep : {0u, 1u, 3u}) {
    PatchBatch batch;
    KeyedPatches patches(batch, surface, plain_options(20),
                         KeyedOptions{}.with_capacity(4).with_keep_steps(keep));
    CHECK(batch.patch_count() == 4);
    const PatchId first = patches.find_or_add(100);
    REQUIRE(first);
    CHECK(patches.find_or_add(100) == first);
    CHECK(patches.find_or_add(7) != first);
    CHECK(patches.size() == 2);
    CHECK(patches.end_step() == 0);
    for (std::uint32_t k = 0; k < keep; ++k) {
      CHECK(patches.find_or_add(100) == first);
      CHECK(patches.end_step() == 0);
      CHECK(patches.find(7));
    }
    CHECK(patches.find_or_add(100) == first);
    CHECK(patches.end_step() == 1);
    CHECK_FALSE(patches.find(7));
    CHECK(patches.find(100) == first);
    CHECK(patches.size() == 1);
    // Checks that a key that is used again in the last step before it would be forgotten stays for another
    // `keep` steps.
    patches.find_or_add(8);
    for (std::uint32_t k = 0; k <= keep; ++k) patches.end_step();
    CHECK(patches.find_or_add(8));
    for (std::uint32_t k = 0; k <= keep; ++k) {
      patches.end_step();
      CHECK(patches.find(8));
    }
    CHECK(patches.end_step() == 1);
    CHECK_FALSE(patches.find(8));
    CHECK(patches.size() == 0);
  }
}

TEST_CASE("When the patches are all taken a new key gets none, and it is counted", "[keys]") {
  PatchBatch batch;
  KeyedPatches patches(batch, surface, plain_options(20), KeyedOptions{}.with_capacity(3));
  for (std::uint64_t key : {1u, 2u, 3u}) CHECK(patches.find_or_add(key));
  CHECK_FALSE(patches.find_or_add(4));
  CHECK(patches.find_or_add(5) == PatchId::no_capacity());
  CHECK(patches.refused() == 2);
  CHECK(patches.find_or_add(2));
  CHECK(patches.remove(2));
  CHECK_FALSE(patches.remove(2));
  CHECK(patches.find_or_add(4));
  CHECK(patches.refused() == 2);
  const PatchId left_out = patches.find_or_add(no_contact_key);
  CHECK(left_out == PatchId::no_capacity());
  CHECK(patches.find(no_contact_key) == PatchId{});
  CHECK(patches.refused() == 3);
  // Checks that a motion without a patch is refused with the reason, and that other motions are stepped.
  Motion motions[3] = {
      {PatchId{}, {dbar, 0.0}, 5.0}, {patches.find(1), {0.1 * dbar, 0.0}, 5.0}, {left_out, {dbar, 0.0}, 5.0}};
  Response responses[3];
  const bristle::StepReport report = batch.step(tick, motions, responses);
  CHECK(responses[0].status == Status::unknown_id);
  CHECK(responses[0].end[0] == 0.0);
  CHECK(responses[1].end[0] < 0.0);
  CHECK(responses[2].status == Status::no_capacity);
  CHECK(responses[2].id == left_out);
  CHECK(responses[2].end[0] == 0.0);
  CHECK(has(report.status, Status::no_capacity));
  CHECK(report.patches_stepped == 1);
  CHECK(batch.find_force(tick, motions[2]).status == Status::no_capacity);
  CHECK(batch.stored_energy(left_out) == 0.0);
  patches.clear();
  CHECK(patches.size() == 0);
  CHECK(patches.refused() == 0);
  CHECK(patches.find_or_add(0));  // 0 is a valid key too
}

TEST_CASE("Forces of a contact depend on its key and motion, not on who had its patch before", "[keys]") {
  // Uses five contacts alone in one pool, and among others that come and go in a second pool, requested in
  // different orders. Their forces must be equal.
  const std::uint64_t keys[5] = {11, 0, 0xFFFFFFFF00000000u, 5000, 77};
  for (bool seeded : {true, false}) {
    PatchBatch quiet, busy;
    const KeyedOptions options = KeyedOptions{}.with_keep_steps(1).with_seed_from_key(seeded);
    KeyedPatches few(quiet, surface, plain_options(60).with_seed(8), KeyedOptions(options).with_capacity(5));
    KeyedPatches many(busy, surface, plain_options(60).with_seed(8),
                      KeyedOptions(options).with_capacity(128));
    std::mt19937_64 random(6);
    int compared = 0;
    std::set<std::uint64_t> slots;
    for (int k = 0; k < 400; ++k) {
      std::vector<Motion> motions;
      std::vector<std::uint64_t> others;
      for (int j = 0; j < 40; ++j) others.push_back(1000000 + random() % 90);
      std::sort(others.begin(), others.end());
      others.erase(std::unique(others.begin(), others.end()), others.end());
      for (const std::uint64_t key : others) {
        motions.push_back(scripted_motion(key, k, 2));
        motions.back().id = many.find_or_add(key);
      }
      for (int j = 4; j >= 0; --j) {
        if ((k / (7 + j)) % 3 == 0) continue;  // contact j is missing in some of the steps
        const std::size_t c = static_cast<std::size_t>(j);
        Motion motion = scripted_motion(c, k, 2);
        motion.id = few.find_or_add(keys[j]);
        REQUIRE(motion.id);
        const Response alone = step_one(quiet, motion);
        motion.id = many.find_or_add(keys[j]);
        REQUIRE(motion.id);
        slots.insert(motion.id.value);
        const Response among = step_one(busy, motion);
        expect(among.end[0] == alone.end[0] && among.end[1] == alone.end[1] &&
                   among.dissipated == alone.dissipated,
               "forces to the bit");
        expect(busy.state_hash(motion.id) == quiet.state_hash(few.find(keys[j])), "state to the bit");
        ++compared;
      }
      std::vector<Response> responses(motions.size());
      busy.step(tick, motions, responses);
      few.end_step();
      many.end_step();
    }
    CHECK(compared > 1000);
    CHECK(slots.size() > 20);  // slots of the pool that the contacts used in turn
    CHECK(many.refused() == 0);
  }
}

TEST_CASE("Seeds come from keys: contacts differ, a pool of one seed has them alike", "[keys]") {
  PatchBatch batch;
  KeyedPatches seeded(batch, surface, plain_options(30), KeyedOptions{}.with_capacity(100));
  KeyedPatches alike(batch, surface, plain_options(30).with_seed(5),
                     KeyedOptions{}.with_capacity(2).with_seed_from_key(false));
  std::set<std::uint64_t> hashes;
  for (std::uint64_t key = 0; key < 100; ++key) {
    const PatchId id = seeded.find_or_add(key);
    hashes.insert(batch.state_hash(id));
    const PatchId added = batch.add(surface, plain_options(30).with_seed(seeded.seed_of(key)));
    expect(batch.state_hash(added) == batch.state_hash(id), "as added with the seed of the key");
  }
  CHECK(hashes.size() == 100);
  CHECK(batch.state_hash(alike.find_or_add(1)) == batch.state_hash(alike.find_or_add(2)));
  CHECK(alike.seed_of(1) == 5);
}

TEST_CASE("Entries are listed in the order in which they were last asked for", "[keys]") {
  PatchBatch batch;
  KeyedPatches patches(batch, surface, plain_options(20), KeyedOptions{}.with_capacity(8).with_keep_steps(1));
  for (std::uint64_t key : {5u, 3u, 9u, 1u}) patches.find_or_add(key);
  patches.remove(9);
  patches.end_step();
  for (std::uint64_t key : {1u, 5u}) patches.find_or_add(key);
  KeyedPatches::Entry entries[8];
  REQUIRE(patches.read_entries(entries) == 3);
  CHECK(entries[0].key == 3);
  CHECK(entries[1].key == 1);
  CHECK(entries[2].key == 5);
  CHECK(entries[2].id == patches.find(5));
  KeyedPatches::Entry one[1];
  CHECK(patches.read_entries(one) == 3);
  CHECK(one[0].key == 3);
}

TEST_CASE("A pool removes its patches when it ends, and refuses bad options by name", "[keys]") {
  PatchBatch batch;
  {
    KeyedPatches patches(batch, surface, plain_options(20), KeyedOptions{}.with_capacity(10));
    CHECK(batch.patch_count() == 10);
    KeyedPatches moved(std::move(patches));
    CHECK(moved.find_or_add(1));
  }
  CHECK(batch.patch_count() == 0);
  CHECK(message_of([&] { KeyedPatches(batch, surface, plain_options(20).with_axes(3)); }).find("axes = 3") !=
        std::string::npos);
  CHECK(batch.patch_count() == 0);
}

TEST_CASE("Matches are made shortest first, as by trying all pairs in order of distance", "[keys]") {
  std::mt19937_64 random(10);
  const auto flat = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  const double reach = 0.3;
  for (int trial = 0; trial < 400; ++trial) {
    ContactMatcher matcher(MatcherOptions{}.with_capacity(40).with_reach(reach));
    std::vector<ContactPoint> before, now;
    // In half of the trials points are on a coarse grid, so that some distances are equal.
    const auto add = [&](std::vector<ContactPoint>& list, std::size_t count) {
      for (std::size_t i = 0; i < count; ++i) {
        ContactPoint p{1 + random() % 2, {flat(), flat(), 0.0}};
        if (trial % 2)
          for (double& x : p.point) x = std::round(8.0 * x) / 8.0;
        list.push_back(p);
      }
    };
    add(before, 1 + random() % 12);
    add(now, 1 + random() % 12);
    std::vector<std::uint64_t> old_keys(before.size()), keys(now.size());
    matcher.match(before, old_keys);
    const std::size_t matched = matcher.match(now, keys);

    struct Edge {
      double squared;
      std::size_t i, j;
    };
    std::vector<Edge> edges;
    for (std::size_t i = 0; i < before.size(); ++i)
      for (std::size_t j = 0; j < now.size(); ++j) {
        const double dx = now[j].point[0] - before[i].point[0], dy = now[j].point[1] - before[i].point[1];
        if (before[i].pair == now[j].pair && dx * dx + dy * dy <= reach * reach)
          edges.push_back({dx * dx + dy * dy, i, j});
      }
    std::stable_sort(edges.begin(), edges.end(),
                     [](const Edge& a, const Edge& b) { return a.squared < b.squared; });
    std::vector<double> lengths, expected_lengths;
    std::vector<bool> old_taken(before.size()), taken(now.size());
    std::map<std::size_t, std::size_t> expected;
    for (const Edge& e : edges) {
      if (old_taken[e.i] || taken[e.j]) continue;
      old_taken[e.i] = taken[e.j] = true;
      expected[e.j] = e.i;
    }
    // With equal distances several matchings are right, so only the number of matches is compared.
    const bool ties = trial % 2 != 0;
    if (!ties) expect(matched == expected.size(), "as many matches");
    std::size_t found = 0;
    for (std::size_t j = 0; j < now.size(); ++j) {
      const auto old = std::find(old_keys.begin(), old_keys.end(), keys[j]);
      if (old != old_keys.end()) {
        const auto i = static_cast<std::size_t>(old - old_keys.begin());
        expect(before[i].pair == now[j].pair, "within its pair");
        ++found;
      }
      if (!ties) {
        const auto want = expected.find(j);
        expect((old != old_keys.end()) == (want != expected.end()), "matched where it should be");
        if (old != old_keys.end() && want != expected.end())
          expect(static_cast<std::size_t>(old - old_keys.begin()) == want->second, "with the right one");
      }
    }
    expect(found == matched, "the count says how many");
    expect(std::set<std::uint64_t>(keys.begin(), keys.end()).size() == keys.size(), "no key twice");
  }
}

TEST_CASE("A new contact never gets the key of one that has just gone", "[keys]") {
  for (std::uint32_t keep : {0u, 2u}) {
    ContactMatcher matcher(MatcherOptions{}.with_capacity(8).with_reach(1e-3).with_keep_steps(keep));
    const ContactPoint here{5, {0.0, 0.0, 0.0}}, there{5, {0.1, 0.0, 0.0}};
    std::uint64_t first, key;
    CHECK(matcher.match({&here, 1}, {&first, 1}) == 0);
    for (std::uint32_t k = 0; k <= keep; ++k) {
      CHECK(matcher.match({&there, 1}, {&key, 1}) == (k == 0 ? 0 : 1));
      CHECK(key != first);
    }
    // Checks that a point that is missing for keep_steps steps is recognised, and forgotten after one more.
    ContactPoint both[2] = {there, here};
    std::uint64_t keys[2];
    CHECK(matcher.match(both, keys) == 1);
    CHECK(keys[0] == key);
    matcher.clear();
    matcher.match({&here, 1}, {&first, 1});
    for (std::uint32_t k = 0; k < keep; ++k) matcher.match({}, {});
    CHECK(matcher.match({&here, 1}, {&key, 1}) == 1);
    CHECK(key == first);
    for (std::uint32_t k = 0; k <= keep; ++k) matcher.match({}, {});
    CHECK(matcher.match({&here, 1}, {&key, 1}) == 0);
  }
}

namespace {

/// Two pools and a matcher over one batch, used as by an engine: contacts that appear, move, change places
/// and end; outlines and points.
struct Engine {
  PatchBatch batch;
  bristle::ExtendedPatches pads{batch};
  KeyedPatches points{batch, surface, PatchOptions{}.with_bristles(100).with_axes(2),
                      KeyedOptions{}.with_capacity(5).with_keep_steps(1)};
  KeyedPatches outlines{pads, surface, PatchOptions{}.with_bristles(400).with_axes(2),
                        bristle::Outline::disc(1e-3, bristle::Pressure::uniform),
                        KeyedOptions{}.with_capacity(3)};
  ContactMatcher matcher{MatcherOptions{}.with_reach(2e-4).with_capacity(8).with_keep_steps(1)};

  void step(int k, std::vector<std::uint64_t>& bits) {
    std::vector<ContactPoint> contacts;
    for (int c = 0; c < 7; ++c) {
      if ((k + 3 * c) % 11 < 3) continue;  // contact c is missing in this step
      contacts.push_back({std::uint64_t(c % 3), {1e-3 * c, 1e-4 * k, 0.0}});
    }
    std::rotate(contacts.begin(), contacts.begin() + k % 3, contacts.end());
    std::vector<std::uint64_t> keys(contacts.size());
    bits.push_back(matcher.match(contacts, keys));
    for (std::size_t c = 0; c < contacts.size(); ++c) {
      const double load = 1.0 + 0.1 * static_cast<double>(contacts[c].pair) + 0.05 * (k % 4);
      const Response r = step_one(batch, Motion{points.find_or_add(keys[c]), {3e-6, 1e-6 * (k % 5)}, load});
      const bristle::ExtendedResponse wrench =
          step_one(pads, bristle::ExtendedMotion{outlines.find_or_add(keys[c]), {2e-6, 0.0, 1e-3}, load});
      for (const double x : {r.end[0], r.end[1], wrench.end[0], wrench.end[1], wrench.end[2]}) {
        std::uint64_t word;
        std::memcpy(&word, &x, 8);
        bits.push_back(word);
      }
    }
    for (const auto& ended : {points.end_step(), outlines.end_step()}) bits.push_back(ended);
    bits.push_back(points.refused());
    bits.push_back(pads.state_hash() ^ batch.state_hash());
  }
};

}  // namespace

TEST_CASE("An engine's contacts are restored in mid-slide and go on to the same bits", "[keys]") {
  Engine first;
  std::vector<std::uint64_t> bits, again;
  for (int k = 0; k < 25; ++k) first.step(k, bits);
  REQUIRE(first.points.refused() > 0);
  const auto patches = saved_state(first.pads), points = saved_state(first.points),
             outlines = saved_state(first.outlines), matcher = saved_state(first.matcher);
  bits.clear();
  for (int k = 25; k < 50; ++k) first.step(k, bits);

  Engine second;
  for (int k = 0; k < 7; ++k)
    second.step(3 * k, again);  // steps that must have no effect after the engine is restored
  second.pads.restore_state(patches);
  second.points.restore_state(points);
  second.outlines.restore_state(outlines);
  second.matcher.restore_state(matcher);
  REQUIRE(saved_state(second.points) == points);
  again.clear();
  for (int k = 25; k < 50; ++k) second.step(k, again);
  REQUIRE(bits == again);
}

TEST_CASE("Saved keys of another pool, of other patches or damaged are refused and change nothing",
          "[keys]") {
  Engine engine;
  std::vector<std::uint64_t> bits;
  for (int k = 0; k < 9; ++k) engine.step(k, bits);
  const auto batch = saved_state(engine.pads);
  const auto points = saved_state(engine.points), matcher = saved_state(engine.matcher);
  REQUIRE(engine.points.size() > 1);
  for (std::size_t at = 0; at < points.size(); ++at) {
    std::vector<std::byte> damaged = points;
    damaged[at] ^= std::byte{4};
    REQUIRE_THROWS_AS(engine.points.restore_state(damaged), bristle::Error);
  }
  for (std::size_t at = 0; at < matcher.size(); ++at) {
    std::vector<std::byte> damaged = matcher;
    damaged[at] ^= std::byte{4};
    REQUIRE_THROWS_AS(engine.matcher.restore_state(damaged), bristle::Error);
    damaged.resize(at);
    REQUIRE_THROWS_AS(engine.matcher.restore_state(damaged), bristle::Error);
  }
  {
    // Two contacts of one pair and number would get one key, and so one patch.
    std::vector<std::byte> doubled = matcher;
    constexpr std::size_t head = bristle::detail::saved_head_size, point = 68;
    REQUIRE(doubled.size() >= head + 2 * point);
    std::memcpy(doubled.data() + head + point, doubled.data() + head, point);
    reseal(doubled);
    REQUIRE_THROWS_WITH(engine.matcher.restore_state(doubled), Catch::Contains("two contacts of one key"));
  }
  REQUIRE_THROWS_AS(engine.outlines.restore_state(points), bristle::Error);
  REQUIRE_THROWS_AS(engine.matcher.restore_state(points), bristle::Error);
  REQUIRE_THROWS_AS(ContactMatcher(MatcherOptions{}.with_capacity(1)).restore_state(matcher), bristle::Error);
  REQUIRE(saved_state(engine.points) == points);
  REQUIRE(saved_state(engine.matcher) == matcher);
  std::vector<std::byte> small(points.size() - 1);
  REQUIRE(engine.points.save_state(small) == 0);

  // Checks that a pool refuses the saved keys of another pool with equal options, which had other patches.
  KeyedPatches twin(engine.batch, surface, PatchOptions{}.with_bristles(100).with_axes(2),
                    KeyedOptions{}.with_capacity(5).with_keep_steps(1));
  REQUIRE_THROWS_AS(twin.restore_state(points), bristle::Error);
  // Checks that keys cannot be restored without the state of their patches.
  Engine fresh;
  REQUIRE_THROWS_WITH(fresh.points.restore_state(points), Catch::Contains("restore theirs first"));
  REQUIRE(fresh.points.size() == 0);
  fresh.pads.restore_state(batch);
  fresh.points.restore_state(points);
  REQUIRE(fresh.points.size() == engine.points.size());
}

TEST_CASE("Points that are not finite or beyond the capacity get no key", "[keys]") {
  ContactMatcher matcher(MatcherOptions{}.with_capacity(3));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::vector<ContactPoint> points = grid_points(1, 6, 1.0);
  points[1].point[2] = nan;
  std::vector<std::uint64_t> keys(6);
  CHECK(matcher.match(points, keys) == 0);
  CHECK(keys[1] == no_contact_key);
  CHECK(keys[3] != no_contact_key);
  CHECK(keys[4] == no_contact_key);
  CHECK(keys[5] == no_contact_key);
  CHECK(matcher.match(points, keys) == 3);
}

TEST_CASE("A pool's patches are groups, in which a contact lies at its index", "[keys][group]") {
  constexpr std::uint32_t first = 5, later = 40;
  for (const SnapRule rule : {SnapRule::redraw, SnapRule::slide}) {
    PatchBatch batch;
    KeyedPatches patches(batch, plain_material(SnapLength::uniform(0.5 * dbar, 1.5 * dbar), rule),
                         plain_options(20), KeyedOptions{}.with_capacity(first));
    for (int k = 0; k < 60; ++k) {
      if (k == 30) patches.reserve(later);
      std::vector<PatchId> at(later);
      for (const bristle::PatchGroup& group : patches.groups())
        for (std::uint32_t i = 0; i < group.size(); ++i)
          at[i + (&group == &patches.groups()[0] ? 0 : first)] = group[i];
      REQUIRE(patches.groups().size() == (k < 30 ? 1 : 2));
      for (std::uint64_t key = 0; key < (k < 30 ? 5u : 30u); ++key) {
        if ((key + static_cast<std::uint64_t>(k) / 7) % 4 == 0) continue;  // contacts begin and end
        const bristle::KeyedContact contact = patches.find_or_add_contact(key);
        expect(contact.id == at[contact.index], "the patch at the contact's index");
        expect(contact.id == patches.find(key), "the patch of its key");
      }
      patches.end_step();
    }
  }
}

TEST_CASE("A pool and a matcher that grow keep their contacts, and have room for a thousand", "[keys]") {
  PatchBatch batch;
  KeyedPatches patches(batch, surface, plain_options(4), KeyedOptions{}.with_capacity(3));
  ContactMatcher matcher(MatcherOptions{}.with_capacity(3));
  std::vector<ContactPoint> points = grid_points(1, 1000, 1.0);
  std::vector<std::uint64_t> few(3), keys(1000);
  matcher.match({points.data(), 3}, few);
  std::vector<PatchId> ids;
  for (const std::uint64_t key : few) ids.push_back(patches.find_or_add(key));
  CHECK(step_one(batch, Motion{ids[1], {0.3 * dbar, 0.0}, 5.0}).end[0] < 0.0);
  const std::uint64_t bent = batch.state_hash(ids[1]);
  CHECK_FALSE(patches.find_or_add(99));
  patches.reserve(2);
  CHECK(patches.capacity() == 3);
  CHECK_THROWS_AS(patches.reserve(1u << 25), bristle::Error);
  CHECK_THROWS_AS(matcher.reserve(1u << 25), bristle::Error);
  patches.reserve(1000);
  matcher.reserve(1000);
  CHECK((patches.capacity() == 1000 && matcher.capacity() == 1000 && patches.size() == 3));
  CHECK(batch.state_hash(ids[1]) == bent);
  CHECK(matcher.match(points, keys) == 3);
  for (std::size_t i = 0; i < 1000; ++i) {
    const PatchId id = patches.find_or_add(keys[i]);
    CHECK(id);
    if (i < 3) CHECK(id == ids[i]);
  }
  CHECK(patches.refused() == 1);
  PatchBatch twin;
  KeyedPatches same(twin, surface, plain_options(4), KeyedOptions{}.with_capacity(3));
  same.reserve(1000);
  twin.restore_state(saved_state(batch));
  same.restore_state(saved_state(patches));
  CHECK(same.size() == 1000);
}

TEST_CASE("Friction of a pair stays with its contacts while the engine lists other points", "[keys]") {
  ContactMatcher matcher(MatcherOptions{}.with_reach(1e-3));
  matcher.set_hold(3);
  const auto match = [&](const std::vector<ContactPoint>& points, const std::vector<double>& normals = {}) {
    std::vector<std::uint64_t> keys(points.size());
    matcher.match(points, keys, normals);
    return keys;
  };
  const auto at = [](double x, double y, std::uint64_t pair = 7) { return ContactPoint{pair, {x, y, 0.0}}; };
  const auto first = match({at(0, 0), at(1, 0), at(0, 1)});
  CHECK(matcher.held().size() == 0);
  // Lists two other points: all three contacts are held, and each point joins the nearest.
  auto keys = match({at(0.9, 0.9), at(0.1, 0.2)});
  CHECK((keys[0] == first[1] || keys[0] == first[2]));
  CHECK(keys[1] == first[0]);
  CHECK((matcher.has_joined(0) && matcher.has_joined(1)));
  REQUIRE(matcher.held().size() == 3);
  CHECK(matcher.held()[1].key == first[1]);
  CHECK(matcher.held()[1].contact.point[0] == 1.0);
  // Lists the first ones again: they are found, after a restore of the state too.
  const auto saved = saved_state(matcher);
  CHECK(match({at(0, 0), at(1, 0), at(0, 1)}) == first);
  CHECK((matcher.held().size() == 0 && !matcher.has_joined(0)));
  matcher.restore_state(saved);
  CHECK(match({at(0, 0), at(1, 0)}) == std::vector<std::uint64_t>{first[0], first[1]});
  REQUIRE(matcher.held().size() == 1);
  // A released contact is not found again, and a new point takes its room.
  CHECK_FALSE(matcher.release(first[0]));
  CHECK(matcher.release(first[2]));
  CHECK(matcher.held().size() == 1);
  keys = match({at(0, 0), at(1, 0), at(5, 5)});
  CHECK((!matcher.has_joined(2) && matcher.held().size() == 0));
  // Of two held contacts one is released, and the other is found again.
  match({at(0, 0)});
  CHECK(matcher.held().size() == 2);
  CHECK(matcher.release(first[1]));
  CHECK(match({at(0, 0), at(5, 5)}) == std::vector<std::uint64_t>{first[0], keys[2]});
  CHECK(matcher.held().size() == 0);
  // Nothing is held for another pair, nor once the pair parts.
  match({at(0, 0, 8)});
  CHECK(matcher.held().size() == 0);
  match({at(0, 0)});
  CHECK(!matcher.has_joined(0));

  // A face with another normal is another surface: its point neither joins nor holds.
  ContactMatcher faces;
  faces.set_hold(1);
  std::vector<std::uint64_t> one(1), other(1);
  const ContactPoint here[1] = {at(0, 0)};
  const double up[3] = {0.0, 0.0, 1.0}, down[3] = {0.0, 0.0, -1.0}, tilted[3] = {0.0, 0.6, 0.8};
  faces.match(here, one, up);
  CHECK(faces.match(here, other, tilted) == 1);
  CHECK(other == one);
  CHECK(faces.match(here, other, down) == 0);
  CHECK((!faces.has_joined(0) && faces.held().size() == 0));
}

TEST_CASE("Contacts listed again at their places keep keys, count as seen, and leave other pairs alone",
          "[keys]") {
  ContactMatcher matcher(MatcherOptions{}.with_reach(1e-3).with_keep_steps(2));
  const auto match = [&](const std::vector<ContactPoint>& points) {
    std::vector<std::uint64_t> keys(points.size());
    const std::size_t found = matcher.match(points, keys);
    return std::make_pair(found, keys);
  };
  const auto at = [](double x, std::uint64_t pair = 7) { return ContactPoint{pair, {x, 0.0, 0.0}}; };
  const auto first = match({at(0.0), at(1.0)}).second;
  CHECK(match({at(0.0), at(1.0)}) == std::make_pair(std::size_t{2}, first));
  CHECK(match({at(1.0), at(0.0)}).second == std::vector<std::uint64_t>{first[1], first[0]});
  // A contact that was missing may be missing for keep_steps again once it was listed.
  match({}), match({at(1.0), at(0.0)}), match({}), match({});
  CHECK(match({at(1.0), at(0.0)}).first == 2);
  // Another pair at the same positions is new.
  CHECK(match({at(1.0, 8), at(0.0, 8)}).first == 0);
  // A held contact is where the caller listed it last, however little it moved.
  matcher.clear();
  matcher.set_hold(1);
  match({at(0.0)}), match({at(5e-8)}), match({at(1.0)});
  REQUIRE(matcher.held().size() == 1);
  CHECK(matcher.held()[0].contact.point[0] == 5e-8);
}

TEST_CASE("Neighbouring keys of pools with neighbouring seeds have bristles of their own", "[keys]") {
  PatchBatch batch;
  const auto pool = [&](std::uint32_t seed) {
    return KeyedPatches(batch, surface, plain_options(1).with_seed(seed), KeyedOptions{}.with_capacity(1));
  };
  const KeyedPatches five = pool(5), six = pool(6);
  for (const std::uint64_t key : {1u, 10u, 1000u}) CHECK(five.seed_of(key + 1) != six.seed_of(key));
}

TEST_CASE("Contacts are matched by their distance in space, up to the reach itself", "[keys]") {
  constexpr double reach = 0.5;
  ContactMatcher matcher(MatcherOptions{}.with_capacity(4).with_reach(reach));
  using Points = std::vector<ContactPoint>;
  const auto keys_of = [&](const Points& points) {
    std::vector<std::uint64_t> keys(points.size());
    matcher.match(points, keys);
    return keys;
  };
  for (int axis = 0; axis < 3; ++axis) {
    INFO("axis " << axis);
    matcher.clear();
    const auto at = [axis](double x) {
      ContactPoint point{7, {0.0, 0.0, 0.0}};
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

}  // namespace bristle_test::test_keyed_patches
