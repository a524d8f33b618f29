// Saved states of patches: forged and foreign ones are refused by what is wrong in them.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cfenv>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "bristle/keyed_patches.hpp"
#include "expect.hpp"
#include "scenes.hpp"

namespace bristle_test::test_saved_state {

using bristle::Population;

namespace {

/// Adds two small patches with bent bristles to a batch.
PatchBatch small_batch() {
  PatchBatch batch;
  const Material material = plain_material(SnapLength::exponential(dbar), SnapRule::redraw);
  std::vector<Motion> in(2);
  std::vector<Response> out(2);
  in[0].id = batch.add(material, plain_options(3));
  in[1].id = batch.add(Material(material).with_snap_rule(SnapRule::keep), plain_options(2, 1));
  for (Motion& m : in) {
    m.displacement[0] = 0.7 * dbar;
    m.normal_load = 1.6;
  }
  batch.step(tick, in, out);
  return batch;
}

/// Finds the byte at which a given number is stored in a saved state, after its head.
std::size_t find_number(const std::vector<std::byte>& state, double value) {
  for (std::size_t at = 40; at + 8 <= state.size(); ++at)
    if (std::memcmp(state.data() + at, &value, 8) == 0) return at;
  FAIL("the state does not hold the number " << value);
  return 0;
}

void put(std::vector<std::byte>& state, std::size_t at, const void* what, std::size_t size) {
  std::memcpy(state.data() + at, what, size);
}

/// Rewrites the checksum (core/patches/SAVED_STATE.md) of a changed state, by an independent implementation.
void reseal(std::vector<std::byte>& state) {
  std::uint64_t hash = 0x6A09E667F3BCC909u;
  const auto add = [&hash](std::uint64_t word) {
    hash = (hash ^ word) * 0x9FB21C651E98DF25u;
    hash ^= hash >> 29;
  };
  const auto add_range = [&](std::size_t from, std::size_t to) {
    for (; from + 8 <= to; from += 8) {
      std::uint64_t word = 0;
      for (std::size_t k = 8; k-- > 0;) word = word << 8 | static_cast<std::uint64_t>(state[from + k]);
      add(word);
    }
    for (; from < to; ++from) add(static_cast<std::uint64_t>(state[from]));
  };
  add_range(0, 32);
  add_range(40, state.size());
  for (std::size_t k = 0; k < 8; ++k) state[32 + k] = static_cast<std::byte>(hash >> (8 * k));
}

}  // namespace

TEST_CASE("A saved state comes back to the bit in any floating-point mode of the caller", "[state]") {
  // Restores a patch over one with another seed, so that its first snap lengths are computed
  // again.
  for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
    const Material material = plain_material(SnapLength::lognormal(dbar, 0.3), rule);
    OnePatch saved(material, plain_options(1000)), other(material, plain_options(1000));
    REQUIRE(saved.batch.reset(saved.id, 7, 0));
    saved.step(0.9 * dbar, 0.3 * dbar, 700.0);
    for (const int mode : {FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO}) {
      REQUIRE(std::fesetround(mode) == 0);
      other.batch.restore_state(saved_state(saved.batch));
      std::fesetround(FE_TONEAREST);
      OnePatch twin(material, plain_options(1000));
      twin.batch.restore_state(saved_state(saved.batch));
      CHECK(other.hash() == saved.hash());
      CHECK(twin.hash() == saved.hash());
      for (OnePatch* patch : {&other, &twin}) patch->step(0.9 * dbar, -0.2 * dbar, 1000.0);
      CHECK(other.hash() == twin.hash());
    }
  }
}

TEST_CASE("A saved state that is cut short, or of another format or batch, is refused by that name",
          "[state]") {
  PatchBatch batch = small_batch();
  const std::vector<std::byte> bytes = saved_state(batch);
  const auto refusal = [&](const std::vector<std::byte>& bad) {
    return message_of([&] { batch.restore_state(bad); });
  };
  for (const std::size_t size : {std::size_t{0}, std::size_t{39}, bytes.size() - 1})
    CHECK(names(refusal({bytes.begin(), bytes.begin() + static_cast<long>(size)}), {"cut short"}));
  std::vector<std::byte> bad = bytes;
  bad[8] = std::byte{9};
  CHECK(names(refusal(bad), {"format 9", "reads format"}));
  PatchBatch other;
  CHECK(names(message_of([&] { other.restore_state(bytes); }), {"has 2 patches", "has 0"}));
}

TEST_CASE("A saved state of another kind, or with bytes behind it, is refused as such, even an empty one",
          "[state]") {
  const bristle::ContactMatcher matcher{bristle::MatcherOptions{}};
  PatchBatch batch;
  const std::vector<std::byte> points = saved_state(matcher);
  CHECK(names(message_of([&] { batch.restore_state(points); }), {"points of a matcher", "not patches"}));
  std::vector<std::byte> longer = saved_state(batch);
  batch.restore_state(longer);
  longer.push_back(std::byte{0});
  CHECK(names(message_of([&] { batch.restore_state(longer); }), {"1 bytes behind it"}));
}

TEST_CASE("A saved state that states its bytes behind its patches is refused", "[state]") {
  PatchBatch batch = small_batch();
  std::vector<std::byte> state = saved_state(batch);
  state.resize(state.size() + 8);
  const std::uint64_t size = state.size();
  put(state, 16, &size, sizeof size);
  reseal(state);
  CHECK_THROWS_WITH(batch.restore_state(state), Catch::Contains("more than its patches"));
}

TEST_CASE("A state with a true checksum and values that no patch can have is refused by the value",
          "[state]") {
  const PatchBatch saved = small_batch();
  const std::vector<std::byte> good = saved_state(saved);
  PatchBatch batch = small_batch();
  {
    std::vector<std::byte> same = good;
    reseal(same);
    REQUIRE(same == good);  // the test's checksum equals the library's
  }
  const std::uint64_t before = batch.state_hash();
  const auto refusal = [&](std::size_t at, const void* what, std::size_t size) {
    std::vector<std::byte> bad = good;
    put(bad, at, what, size);
    reseal(bad);
    const std::string message = message_of([&] { batch.restore_state(bad); });
    CHECK(batch.state_hash() == before);
    return message;
  };
  // Offset of the first patch's contact (core/patches/SAVED_STATE.md): head of 40 bytes, then patch head of
  // 36.
  constexpr std::size_t contact = 40 + 36;
  CHECK(find_number(good, 1.6) == contact);  // offset of the load, the first field of the contact
  const double nan = std::nan(""), infinite = INFINITY, minus = -1.0, huge = 1e6, half = 0.5;
  const std::uint32_t many = 1u << 30;
  const std::int64_t far = std::int64_t{1} << 62;
  for (const double* bad : {&nan, &infinite, &minus}) {
    CHECK(names(refusal(contact, bad, 8), {"patch 1", "normal_load"}));
    CHECK(names(refusal(contact + 8, bad, 8), {"zeta"}));
    CHECK(names(refusal(contact + 80, bad, 8), {"active"}));
    CHECK(names(refusal(contact + 16, bad, 8), {"overload"}));
    CHECK(names(refusal(contact + 88, bad, 8), {"fraction"}));
    CHECK(names(refusal(contact + 40, bad, 8), {"pending_dissipated"}));
    for (std::size_t axis : {0u, 1u}) CHECK(names(refusal(contact + 64 + 8 * axis, bad, 8), {"remainder"}));
  }
  CHECK(names(refusal(contact + 80, &huge, 8), {"active"}));
  CHECK(names(refusal(contact + 16, &half, 8), {"overload"}));
  CHECK(names(refusal(contact + 16, &huge, 8), {"overload"}));
  CHECK(names(refusal(contact + 8, &huge, 8), {"zeta"}));
  CHECK(names(refusal(contact + 48, &nan, 8), {"pending_loss"}));
  const std::uint32_t none = 0;
  CHECK(names(refusal(contact + 96, &many, 4), {"whole"}));
  {
    // Forges a state that is under load but has no bristle in contact.
    std::vector<std::byte> bad = good;
    const double nothing = 0.0;
    for (std::size_t field : {80u, 88u}) put(bad, contact + field, &nothing, 8);
    put(bad, contact + 96, &none, 4);
    reseal(bad);
    CHECK(names(message_of([&] { batch.restore_state(bad); }), {"active"}));
  }
  const double faint = 1e-31;
  CHECK(names(refusal(contact + 88, &faint, 8), {"fraction"}));
  constexpr std::size_t block = contact + 100;
  CHECK(names(refusal(block, &far, 8), {"displacement"}));
  CHECK(names(refusal(block + 16, &far, 8), {"sum"}));
  constexpr std::size_t zx = block + 32, zy = zx + 12, delta = zy + 12;
  const float nan_float = std::nanf(""), long_float = 1e6f, zero_float = 0.0f;
  CHECK(names(refusal(zx, &nan_float, 4), {"deflection"}));
  CHECK(names(refusal(zy + 4, &long_float, 4), {"deflection"}));
  CHECK(names(refusal(delta, &nan_float, 4), {"snap length"}));
  CHECK(names(refusal(delta + 4, &zero_float, 4), {"snap length"}));
  CHECK(names(refusal(40, &many, 4), {"patch 1", "another material or other options"}));
  CHECK(names(refusal(24, &far, 8), {"patches"}));
  // At a load of 1.6 N the third bristle is out of contact, so its forged values are ignored.
  std::vector<std::byte> ignored = good;
  put(ignored, zx + 8, &nan_float, 4);
  put(ignored, delta + 8, &nan_float, 4);
  reseal(ignored);
  batch.restore_state(ignored);
  CHECK(batch.state_hash() == saved.state_hash());
  CHECK(saved_state(batch) == good);
  Motion pressed{{1ull << 32 | 1}, {0.1 * dbar, 0.0}, 3.0};
  Response out;
  PatchBatch twin = small_batch();
  for (PatchBatch* each : {&batch, &twin}) each->step(tick, {&pressed, 1}, {&out, 1});
  CHECK(out.status == Status::ok);
  CHECK(batch.state_hash() == twin.state_hash());
}

TEST_CASE("A saved bristle bent beyond its own snap length is refused, whatever the longest one is",
          "[state][hostile]") {
  for (const SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
    const Material material = plain_material(SnapLength::uniform(0.5 * dbar, 1.5 * dbar), rule);
    OnePatch patch(material, plain_options(20)), other(material, plain_options(20));
    REQUIRE(patch.batch.reset(patch.id, 7, 0));  // another seed than the patch that restores has
    patch.step(0.4 * dbar, 0.0, 1000.0);
    double zx[20], delta[20];
    REQUIRE(patch.batch.read_bristles(patch.id, zx, {}, delta) == 20);
    const std::size_t weak = static_cast<std::size_t>(std::min_element(delta, delta + 20) - delta);
    const std::vector<std::byte> good = saved_state(patch.batch);
    const std::size_t columns = 40 + 36 + 64 + 16 + 20 + 32;  // core/patches/SAVED_STATE.md
    float stored = 0.0f;
    std::memcpy(&stored, good.data() + columns + 4 * weak, 4);
    std::int64_t position = 0;
    std::memcpy(&position, good.data() + 40 + 36 + 24, 8);
    const double per_metre = static_cast<double>(position) * 0x1p-44 / (0.4 * dbar);
    const auto restored = [&](double bent) {
      std::vector<std::byte> forged = good;
      const auto x = static_cast<float>(static_cast<double>(stored) + (bent - zx[weak]) * per_metre);
      put(forged, columns + 4 * weak, &x, 4);
      reseal(forged);
      return message_of([&] { other.batch.restore_state(forged); });
    };
    CHECK(restored(0.99 * delta[weak]) == "(no error)");
    CHECK(names(restored(1.01 * delta[weak]), {"a deflection"}));
    CHECK(1.01 * delta[weak] < 1.5 * dbar);
  }
}

TEST_CASE("A contact without load that a saved state gives bristles is refused", "[state][hostile]") {
  // A negative number of bristles, however small, let sliding bristles keep any stiffness and force at rest.
  const Material material = plain_material(SnapLength::uniform(0.5 * dbar, 1.5 * dbar), SnapRule::slide);
  OnePatch patch(material, plain_options(8));
  patch.step(0.2 * dbar, 0.0, 0.0);
  std::vector<std::byte> forged = saved_state(patch.batch);
  const double less = -1e-301, stiff = 1e9;
  put(forged, 40 + 36 + 8, &less, 8);
  put(forged, 40 + 36 + 64 + 16 + 24, &stiff, 8);
  reseal(forged);
  CHECK(names(message_of([&] { patch.batch.restore_state(forged); }), {"zeta"}));
}

TEST_CASE("A saved state is refused where any parameter of the material is another", "[state]") {
  const auto make = [](double residual, double renewal, const bristle::Ageing& ageing, double strengthening,
                       double speed) {
    return plain_material(SnapLength::uniform(0.5 * dbar, 1.5 * dbar), SnapRule::redraw)
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

TEST_CASE("Every number that restoring checks is refused by its name, in every kind of patch",
          "[state][hostile]") {
  const std::vector<std::string> of_all{"normal_load", "zeta", "overload", "remainder"},
      of_lanes{"the force", "rest", "stiffness", "phase"},
      of_infinite{"the position",
                  "an open cohort",
                  "owed",
                  "owed_path",
                  "slack",
                  "spread",
                  "pair",
                  "ranked",
                  "a cohort's share",
                  "a cohort's ranks",
                  "the shares",
                  "a cohort's reach",
                  "an empty cohort",
                  "the moment",
                  "a cohort's survival",
                  "a cohort's position"},
      of_slide{"the sum", "a deflection"};
  const auto check = [&](SnapRule rule, Population population, Precision precision, bool ages) {
    CAPTURE(static_cast<int>(rule), static_cast<int>(population), static_cast<int>(precision), ages);
    Material material = plain_material(SnapLength::uniform(0.5 * dbar, 1.5 * dbar), rule);
    if (ages) material.with_ageing({bristle::AgeingForm::logarithmic, 0.1, 1.0});
    OnePatch patch(material, plain_options(8).with_population(population).with_precision(precision));
    for (const double dx : {0.7, 1.4, -0.3}) patch.step(dx * dbar, 0.1 * dbar, 1000.0);
    const std::vector<std::byte> good = saved_state(patch.batch);
    std::string refusals;
    const auto forge = [&](std::size_t at, auto number) {
      if (at + sizeof number > good.size()) return;
      std::vector<std::byte> forged = good;
      put(forged, at, &number, sizeof number);
      reseal(forged);
      refusals += message_of([&] { patch.batch.restore_state(forged); });
    };
    for (std::size_t at = 40 + 36; at < good.size(); at += 4) {
      for (const double number : {std::nan(""), -2.0, 0.5, 1.5, 1e40}) {
        forge(at, number);
        forge(at, static_cast<float>(number));
      }
    }
    std::vector<std::string> expected = of_all;
    const auto expect_too = [&](const std::vector<std::string>& more) {
      expected.insert(expected.end(), more.begin(), more.end());
    };
    if (population == Population::infinite || rule == SnapRule::slide) expect_too(of_lanes);
    expect_too(population == Population::infinite ? of_infinite
               : rule == SnapRule::slide          ? of_slide
                                                  : std::vector<std::string>{"active", "fraction", "whole"});
    if (ages) expect_too({"time"});
    if (ages && rule == SnapRule::slide) expect_too({"a time"});
    if (ages && population == Population::infinite) expect_too({"a time", "a cohort's birth"});
    for (const std::string& name : expected) {
      CAPTURE(name);
      CHECK(refusals.find("(" + name + ")") != std::string::npos);
    }
  };
  for (const bool ages : {false, true}) {
    check(SnapRule::redraw, Population::representatives, Precision::single, ages);
    for (const Precision precision : precisions()) {
      check(SnapRule::slide, Population::representatives, precision, ages);
      check(SnapRule::redraw, Population::infinite, precision, ages);
    }
  }
}

}  // namespace bristle_test::test_saved_state
