// A patch restores any state that it saved, even where numbers reach their limits: a load of a few units of
// mass, times at which the clock hardly advances or stands still, one bristle that others renew. Forged
// states are refused.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "bristle/bed.hpp"
#include "core/bed_table.hpp"
#include "core/patches/saved_state.hpp"
#include "expect.hpp"
#include "reseal.hpp"
#include "scenes.hpp"

namespace bristle_test::test_taken_back {

using bristle::Ageing;

namespace {

/// Load so small that the numbers of single precision are short of digits beside usual loads.
constexpr double tiny_load = 0x1p-46;

Material redrawn(const SnapLength& law = SnapLength::lognormal(dbar, 0.3)) {
  return plain_material(law, SnapRule::redraw);
}
PatchOptions infinite_options() {
  return PatchOptions{}.with_population(bristle::Population::infinite).with_max_normal_load(1.0);
}

/// Checks that saving, restoring and saving a patch's state again gives equal bytes.
void expect_taken_back(OnePatch& patch) {
  const std::vector<std::byte> state = saved_state(patch.batch);
  REQUIRE_NOTHROW(patch.batch.restore_state(state));
  CHECK(saved_state(patch.batch) == state);
}

}  // namespace

TEST_CASE("An infinite brush under a tiny load is taken back after a long slide", "[state][cohorts]") {
  for (const double units : {1.0, 2.0, 3.0, 10.0, 100.0}) {
    for (const Material& material : {redrawn(), redrawn(SnapLength::uniform(0.5 * dbar, 1.5 * dbar)),
                                     redrawn().with_ageing(Ageing::logarithmic(0.05, 1e-3))}) {
      OnePatch patch(material, infinite_options());
      const double load = units * tiny_load;
      const Response far = patch.step(1.0, 0.0, load);
      expect_taken_back(patch);
      // When all bristles slide, the force must be above 0 and below that of the longest bristles.
      CHECK(far.elastic[0] < 0.0);
      CHECK(far.elastic[0] > -100.0 * dbar * load);
      CHECK(patch.step(0.0, 0.0, 0.0).elastic[0] == 0.0);
      expect_taken_back(patch);
    }
  }
}

TEST_CASE("An infinite brush is the same everywhere when its load falls to next to nothing",
          "[state][cohorts][determinism]") {
  for (const double cv : {0.15, 0.3}) {
    std::vector<OnePatch> patches;
    for (const bristle::IsaInfo& isa : bristle::instruction_sets())
      if (isa.usable)
        patches.emplace_back(redrawn(SnapLength::lognormal(dbar, cv)), infinite_options(),
                             BatchOptions{}.with_isa(isa.name));
    for (int units = 1; units < 40; ++units) {
      const double load = units * tiny_load;
      std::vector<Response> first;
      for (OnePatch& patch : patches) {
        patch.step(-64.0 * dbar, 0.0, 0.9);
        patch.step(0.8 * dbar, 0.0, 0.7);
        const std::vector<Response> after{patch.step(0.0, 0.0, load), patch.step(-1.5 * dbar, 0.0, load)};
        expect_taken_back(patch);
        if (first.empty()) first = after;
        INFO(units << " units, " << patch.batch.isa());
        for (std::size_t k = 0; k < 2; ++k) {
          CHECK(first_difference(first[k], after[k]) == "");
          CHECK(std::abs(after[k].elastic[0]) < 3.0 * dbar * load);
        }
      }
    }
  }
}

TEST_CASE("An infinite brush of any lengths is taken back after its lengths became shorter",
          "[state][cohorts]") {
  // Bends bristles beyond the longest new length. The share of lengths above that is 0 only up to
  // rounding.
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  for (int k = 0; k < 40; ++k) {
    const double shortest = (0.2 + share(random)) * dbar, longest = shortest * (1.5 + 2.0 * share(random));
    OnePatch patch(redrawn(SnapLength::uniform(shortest, longest)), infinite_options());
    patch.step(0.9 * shortest, 0.0, 1.0);
    patch.batch.set_material(patch.id, redrawn(SnapLength::uniform(0.2 * shortest, 0.2 * longest)));
    patch.step(0.0, 0.0, 1.0);
    expect_taken_back(patch);
  }
}

TEST_CASE("Bristles shorter than a residual can tell are none too short to divide by", "[load][state]") {
  constexpr std::uint32_t many = 1u << 20;
  const Material plain = redrawn(SnapLength::exponential(dbar));
  for (Precision precision : precisions()) {
    OnePatch patch(plain, plain_options(many, 1, precision));
    const auto shortest = [&] {
      const std::vector<double> length = read(patch, many).delta;
      REQUIRE(length.size() == many);
      return *std::min_element(length.begin(), length.end());
    };
    patch.step(0.0, 0.0, many);
    const double residual = 8.0 * dbar;
    for (const double left : {residual, 0.0}) {
      patch.batch.set_material(patch.id, Material(plain).with_residual_length(left));
      patch.step(0.0, 0.0, many);
      CHECK(shortest() > 0.0);  // snap lengths stay positive with either residual
      expect_taken_back(patch);
    }
  }
}

TEST_CASE("A patch that ages is taken back after a life of any length", "[state][ageing]") {
  const Material ages = redrawn().with_ageing(Ageing::logarithmic(0.05, 1e-6));
  for (const PatchOptions& options : {plain_options(40), infinite_options()}) {
    for (const double dt :
         {1e-300, 0x1p-65, 0x1p-64, 7e-20, 1e-12, 3.3e-9, 5e-8, 1e-3, 1e9, 1e14, 1e17, 1e300}) {
      OnePatch patch(ages, options);
      for (int k = 0; k < 12; ++k) {
        patch.step((k % 3 - 0.4) * dbar, 0.1 * dbar, options.max_normal_load, k % 4 == 3 ? 1e-3 : dt);
        expect_taken_back(patch);
      }
    }
  }
}

TEST_CASE("A patch that ages is taken back after steps below its time's rounding", "[state][ageing]") {
  const Material ages = redrawn(uniform).with_ageing(Ageing::logarithmic(0.05, 1e-6));
  std::mt19937_64 random(11);
  for (const PatchOptions& options : {plain_options(40), infinite_options()}) {
    OnePatch patch(ages, options);
    const double load = options.max_normal_load;
    for (int k = 0; k < 60; ++k) {
      // Holds for a time whose end the clock rounds, then moves on in almost no time.
      patch.step(0.1 * dbar, 0.0, load, 1e3 * (1.0 + static_cast<double>(random() >> 11) * 0x1p-53));
      for (int n = 0; n < 2; ++n) {
        patch.step(3.0 * dbar, 0.0, load, 1e-15);
        expect_taken_back(patch);
      }
      patch.batch.set_material(patch.id, Material(ages).with_bristle_stiffness(k % 2 == 0 ? 2.0 : 3.0));
      expect_taken_back(patch);
    }
  }
}

TEST_CASE("A patch that ages and is rubbed is taken back after a slide in no time and a rest",
          "[state][ageing]") {
  for (const Ageing& ageing : {Ageing::logarithmic(0.5, 1.0), Ageing::saturating(0.5, 1.0)})
    for (const double dt : {1e-300, 1e-12, 1.0}) {
      OnePatch patch(redrawn().with_ageing(ageing).with_shared_renewal(0.3), plain_options(40));
      const double load = plain_options(40).max_normal_load;
      // Moves at a speed that may overflow, then rests, then moves at a usual speed.
      patch.step(1e300, 0.0, load, dt);
      expect_taken_back(patch);
      patch.step(0.0, 0.0, load, 1e9);
      patch.step(3.0 * dbar, 0.0, load, 1e-3);
      expect_taken_back(patch);
      CHECK(patch.step(3.0 * dbar, 0.0, load, 1e-3).elastic[0] < 0.0);
      expect_taken_back(patch);
    }
}

TEST_CASE("A patch that has held longer than it has lived is refused", "[state][ageing]") {
  OnePatch patch(redrawn().with_ageing(Ageing::logarithmic(0.05, 1e-6)), plain_options(40));
  patch.step(0.1 * dbar, 0.0, 40.0, 2.0);
  const std::vector<std::byte> good = saved_state(patch.batch);
  // Byte offset, in a saved state, of the longest hold (time at rest; core/patches/SAVED_STATE.md). It
  // follows both heads, the contact, the remainders and the two numbers of the patch's time.
  constexpr std::size_t oldest =
      bristle::detail::saved_head_size + bristle::detail::saved_patch_size + 64 + 16 + 16;
  double since = 0.0;
  std::memcpy(&since, good.data() + oldest + 8, 8);
  REQUIRE(since == 2.0);
  for (const double forged : {2.0 + 1e-12, 3.0, 1e30, -1.0, std::nan("")}) {
    for (const std::size_t at : {oldest, oldest + 8}) {
      std::vector<std::byte> bad = good;
      std::memcpy(bad.data() + at, &forged, 8);
      reseal(bad);
      CHECK_THROWS_WITH(patch.batch.restore_state(bad), Catch::Contains("(time)"));
    }
  }
}

TEST_CASE("Exponential bristles longer than any one draw are taken back", "[state][jumps]") {
  constexpr std::uint32_t many = 1u << 20;
  const SnapLength law = SnapLength::exponential(dbar);
  for (Precision precision : precisions()) {
    // Jumps over a long slide. A bristle's length after it combines two draws, the path since its snap and
    // the rest of its length, and one of a million exceeds the longest single draw.
    OnePatch patch(redrawn(law), plain_options(many, 1, precision));
    double longest = 0.0;
    for (int k = 0; k < 8; ++k) {
      patch.step(1e3 * dbar, 0.0, many);
      const std::vector<double> length = read(patch, many).delta;
      REQUIRE(length.size() == many);
      longest = std::max(longest, *std::max_element(length.begin(), length.end()));
      expect_taken_back(patch);
    }
    CHECK(longest > 1.01 * law.longest());
    CHECK(longest < 2.0 * law.longest());
  }
}

TEST_CASE("Few rubbed bristles are taken back however far they slid, bent no farther than they can",
          "[state][rubbing]") {
  for (const double kappa : {0.3, 1.0, 8.0}) {
    for (const double load : {0.01, 1.0, 2.5}) {
      for (const SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
        const Material material =
            plain_material(uniform, rule).with_residual_length(0.1 * dbar).with_shared_renewal(kappa);
        OnePatch patch(material, plain_options(40));
        for (int k = 0; k < 60; ++k) {
          const Response r = patch.step(0.2 * dbar * (1 << k % 6), 0.03 * dbar, load);
          CHECK(-r.elastic[0] <= 1.6 * dbar * load * (1.0 + 1e-3));
          CHECK(-r.elastic[0] >= -1e-3 * dbar);
          if (k % 5 == 0) expect_taken_back(patch);
        }
      }
    }
  }
}

TEST_CASE(
    "Where the clock of a batch is coarser than bristles age, patches have the same bits lazy and eager",
    "[determinism][ageing]") {
  // At a time of 1e15 s the clock resolves an eighth of a second, so an age may be less when computed
  // again.
  for (const double clock : {1e6, 1e12, 1e15})
    for (const double renewal : {0.0, 0.3, 8.0})
      for (const bool infinite : {false, true}) {
        const SnapLength law = infinite ? SnapLength::lognormal(dbar, 0.15) : SnapLength::single(dbar);
        const Material material = redrawn(law)
                                      .with_residual_length(dbar / 9.0)
                                      .with_shared_renewal(renewal)
                                      .with_ageing(Ageing::logarithmic(0.3, 1e-14 * clock));
        const PatchOptions options = infinite ? infinite_options() : plain_options(300);
        OnePatch lazy(material, options), eager(material, options, stepped_eagerly());
        const double full = options.max_normal_load;
        for (OnePatch* patch : {&lazy, &eager}) patch->step(0.0, 0.0, full, clock);
        std::mt19937_64 random(5);
        const auto share = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
        for (int k = 0; k < 400; ++k) {
          const double dt = 1e-16 * clock * std::pow(10.0, 5.0 * share() - 2.0);
          const double path = (k % 3 == 0 ? -0.2 : 1.0) * dbar * std::pow(10.0, 2.0 * share() - 1.0);
          const double load = k % 7 == 6 ? 0.6 * full : full;
          for (OnePatch* patch : {&lazy, &eager}) patch->step(path, 0.2 * path, load, dt);
          CAPTURE(clock, renewal, infinite, k);
          REQUIRE(lazy.hash() == eager.hash());
        }
      }
}

TEST_CASE(
    "An infinite brush restored at any moment of a random life goes on with the bits of the one that was "
    "saved",
    "[state][cohorts]") {
  std::mt19937 random(31);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const Material rubbed = Material::from_coefficients(bristle::Coefficients{});
  for (const Material& material :
       {redrawn(), rubbed, Material(rubbed).with_ageing(Ageing::logarithmic(0.05, 1e-3))})
    for (int life = 0; life < 300; ++life) {
      OnePatch saved(material, infinite_options().with_outputs(Outputs::all));
      OnePatch restored(material, infinite_options().with_outputs(Outputs::all));
      const double length = material.snap_length.mean();
      // Far from the base of positions, to which the first contact is not close, positions lose digits.
      const double far = life % 3 == 0 ? 1e-4 : life % 3 == 1 ? 12e-3 : 0.7;
      saved.step(far * uniform(random), far, 0.0);
      double heading = uniform(random);
      for (int k = 0; k < life % 11; ++k) {
        if (k % 4 == 0) heading = 3.0 * uniform(random);
        const double path = length * (life % 2 == 0 ? 0.1 : 1.5);
        saved.step(path * std::cos(heading), path * std::sin(heading), k % 5 == 4 ? 0.6 : 0.9);
      }
      restored.batch.restore_state(saved_state(saved.batch));
      for (int k = 0; k < 6; ++k) {
        const double x = length * 0.4 * uniform(random), y = length * 0.4 * uniform(random);
        const std::string field = first_difference(saved.step(x, y, 0.9), restored.step(x, y, 0.9));
        if (!field.empty() && field != "id") FAIL_CHECK("life " << life << ", step " << k << ": " << field);
      }
      expect(saved.hash() == restored.hash(), "the state");
    }
}

TEST_CASE("An infinite brush that is lifted, carried away and set down slides as one that begins there",
          "[cohorts][extreme]") {
  // Slides an infinite brush over many distances, under a usual and a wide law. Under the wide one a step may
  // be longer than the deflection of any other bristle.
  for (const double cv : {0.3, 3.0}) {
    for (const bristle::IsaInfo& isa : bristle::instruction_sets()) {
      if (!isa.usable) continue;
      const Material material = redrawn(SnapLength::lognormal(dbar, cv));
      for (const double carried : {1e2, 1e4, 3e4, 1e7}) {
        OnePatch patch(material, infinite_options(), BatchOptions{}.with_isa(isa.name));
        OnePatch fresh(material, infinite_options(), BatchOptions{}.with_isa(isa.name));
        for (int k = 0; k < 30; ++k) patch.step(0.3 * dbar, 0.1 * dbar * (k % 7), 0.7);
        patch.step(0.0, 0.0, 0.0);
        for (int k = 0; k < 10; ++k) patch.step(0.1 * carried * dbar, 0.07 * carried * dbar, 0.0);
        for (int k = 0; k < 30; ++k) {
          const double dx = dbar * (k % 20 == 19 ? 3000.0 : 0.4), dy = 0.2 * dbar * (k % 5 - 2);
          const Response a = patch.step(dx, dy, 0.7), b = fresh.step(dx, dy, 0.7);
          for (int axis = 0; axis < 2; ++axis) {
            REQUIRE(a.elastic[axis] == Approx(b.elastic[axis]).margin(1e-9 * dbar));
            REQUIRE(a.mean[axis] == Approx(b.mean[axis]).margin(1e-9 * dbar));
          }
        }
        expect_taken_back(patch);
      }
    }
  }
}

namespace {

/// The words of the saved state of a batch with one bed.
struct SavedBed {
  // Byte offsets in the saved state: the head is the batch's seal and count. `numbers`
  // follows the bed's slot and count.
  static constexpr std::size_t head = 40, rolled_last = head + 8, numbers = rolled_last + 8,
                               columns = numbers + 17 * 8;
  enum Number {
    root = 0,
    size = 4,
    load,
    pressure_sum,
    limit,
    rolled,
    along = 10,
    force = 12,
    torque = 14,
    energy
  };

  std::vector<std::byte> bytes;

  double get(int number) const {
    double x;
    std::memcpy(&x, bytes.data() + numbers + 8 * static_cast<std::size_t>(number), 8);
    return x;
  }
  void set(int number, double x) {
    std::memcpy(bytes.data() + numbers + 8 * static_cast<std::size_t>(number), &x, 8);
  }
  static std::size_t offset(bristle::detail::BedColumn c, std::size_t i) {
    constexpr std::size_t lanes = bristle::detail::lane_count;
    return columns + 4 * ((i / lanes * bristle::detail::bed_state_columns + c) * lanes + i % lanes);
  }
  float at(bristle::detail::BedColumn c, std::size_t i) const {
    float x;
    std::memcpy(&x, bytes.data() + offset(c, i), 4);
    return x;
  }
  void put(bristle::detail::BedColumn c, std::size_t i, double value) {
    const float x = static_cast<float>(value);
    std::memcpy(bytes.data() + offset(c, i), &x, 4);
  }
};

}  // namespace

TEST_CASE("Each bound of a saved bed refuses a state that no other bound does", "[state][hostile]") {
  using namespace bristle::detail;
  using bristle::BedMaterial, bristle::BedShape, bristle::BedPressure;
  using S = SavedBed;
  constexpr std::size_t bristles = 24, padded = 32;  // 24 bristles, padded to 32 without stiffness
  const BedMaterial plain = BedMaterial(0.6).with_presliding(1e-4),
                    drops = BedMaterial(0.9, 0.6).with_presliding(1e-4);
  enum Kind { ball, wheel, disc, any };
  const BedShape shapes[] = {BedShape::disc(1e-3, BedPressure::parabolic).rolling(8, 3),
                             BedShape::wheel_row(1e-3, BedPressure::parabolic, 24),
                             BedShape::disc(2e-3, BedPressure::uniform, 3, 8)};
  struct Forged {
    const char* bound;
    Kind kind;
    /// Forges a state. `in`: index of a bristle that is in contact with little load; `out`: of one that is
    /// out of contact.
    void (*forge)(S&, std::size_t in, std::size_t out);
  };
  const Forged table[] = {
      {"load", disc,
       [](S& s, auto, auto) {
         s.set(S::limit, s.get(S::limit) * (1e16 / s.get(S::load))), s.set(S::load, 1e16);
       }},
      {"size", any, [](S& s, auto, auto) { s.set(S::size, 1.1); }},
      {"limit", any, [](S& s, auto, auto) { s.set(S::limit, s.get(S::limit) * (1.0 + 1e-6)); }},
      {"rolled_last of a bed that does not roll", disc,
       [](S& s, auto, auto) { s.bytes[S::rolled_last] = std::byte{1}; }},
      {"rolled_last", ball, [](S& s, auto, auto) { s.bytes[S::rolled_last] = std::byte{2}; }},
      {"torque", any, [](S& s, auto, auto) { s.set(S::torque, 1e46); }},
      {"length of along", ball,
       [](S& s, auto, auto) {
         s.set(S::along, 1.1 * s.get(S::along)), s.set(S::along + 1, 1.1 * s.get(S::along + 1));
       }},
      {"along of rows that do not turn", wheel,
       [](S& s, auto, auto) { s.set(S::along, 0.0), s.set(S::along + 1, 1.0); }},
      {"rolled", ball, [](S& s, auto, auto) { s.set(S::rolled, 1e-6); }},
      {"rolled of a bed that does not roll", disc, [](S& s, auto, auto) { s.set(S::rolled, 1e-12); }},
      {"rolled across", wheel, [](S& s, auto, auto) { s.set(S::rolled + 1, 1e-12); }},
      {"force", any, [](S& s, auto, auto) { s.set(S::force, 1e46); }},
      {"force across", any, [](S& s, auto, auto) { s.set(S::force + 1, -1e46); }},
      {"energy below 0", any, [](S& s, auto, auto) { s.set(S::energy, -1.0); }},
      {"energy", any, [](S& s, auto, auto) { s.set(S::energy + 1, 1e46); }},
      {"root", wheel,
       [](S& s, auto, auto) {  // moves tips and root, so that only the root's position is wrong
         const double far = 1e12 + s.get(S::root);
         s.set(S::root, far);
         for (std::size_t i = 0; i < bristles; ++i) s.put(bed_tip_x, i, far);
       }},
      {"stiffness below 0", ball, [](S& s, auto, std::size_t out) { s.put(bed_stiffness, out, -1e-3); }},
      {"stiffness", ball,
       [](S& s, std::size_t in, auto) {
         s.put(bed_stiffness, in, 1e6 * static_cast<double>(s.at(bed_stiffness, in))),
             s.put(bed_pressure, in, 1e-6 * static_cast<double>(s.at(bed_pressure, in)));
       }},
      {"pressure below 0", ball, [](S& s, auto, std::size_t out) { s.put(bed_pressure, out, -1.0); }},
      {"pressure", ball,
       [](S& s, std::size_t in, auto) {
         s.put(bed_stiffness, in, 1e-9), s.put(bed_pressure, in, 1.01), s.put(bed_over_pressure2, in, 0.9);
       }},
      {"pressure without stiffness", ball, [](S& s, std::size_t in, auto) { s.put(bed_pressure, in, 0.0); }},
      {"inverse pressure below 0", ball,
       [](S& s, std::size_t in, auto) { s.put(bed_over_pressure2, in, -1.0); }},
      {"inverse pressure", ball,
       [](S& s, std::size_t in, auto) {
         s.put(bed_over_pressure2, in, 1.1 * static_cast<double>(s.at(bed_over_pressure2, in)));
       }},
      {"inverse pressure of a bristle without limit", ball,
       [](S& s, std::size_t in, auto) { s.put(bed_over_pressure2, in, 0.0); }},
      {"inverse pressure out of contact", ball,
       [](S& s, auto, std::size_t out) { s.put(bed_over_pressure2, out, 1.0); }},
      {"x", wheel, [](S& s, std::size_t in, auto) { s.put(bed_x, in, 5.0); }},
      {"y", wheel, [](S& s, std::size_t in, auto) { s.put(bed_y, in, -5.0); }},
      {"along of a bristle", wheel, [](S& s, std::size_t in, auto) { s.put(bed_along, in, 3.0); }},
      {"slid of a bed without drop", disc, [](S& s, std::size_t in, auto) { s.put(bed_slid, in, 1.0); }},
      {"slid", wheel, [](S& s, std::size_t in, auto) { s.put(bed_slid, in, 0.5); }},
      {"kept", any, [](S& s, std::size_t in, auto) { s.put(bed_kept, in, 1.1); }},
      {"moved", any, [](S& s, std::size_t in, auto) { s.put(bed_moved, in, -0.1); }},
      {"tip", any, [](S& s, std::size_t in, auto) { s.put(bed_tip_x, in, s.get(S::root) + 1e12); }},
      {"tip across", any,
       [](S& s, std::size_t in, auto) { s.put(bed_tip_y, in, s.get(S::root + 1) - 1e12); }},
      {"tip beyond the limits", any,
       [](S& s, std::size_t in, auto) { s.put(bed_tip_x, in, s.get(S::root) - 10.0); }},
      {"tip out of contact", ball, [](S& s, auto, std::size_t out) { s.put(bed_tip_x, out, 1e35); }},
      {"pressure_sum", any, [](S& s, auto, auto) {
         s.set(S::pressure_sum, 1.05 * s.get(S::pressure_sum)), s.set(S::limit, s.get(S::limit) / 1.05);
       }}};
  for (const Kind kind : {ball, wheel, disc}) {
    bristle::BedBatch batch;
    bristle::BedOptions options;
    options.max_normal_load = 20.0;
    bristle::BedMotion motion;
    motion.id = batch.add(kind == wheel ? drops : plain, shapes[kind], options);
    bristle::BedResponse out;
    for (int k = 0; k < 6; ++k) {
      motion.displacement[0] = 1e-5;
      motion.rolled[0] = kind == disc ? 0.0 : 3e-4;
      motion.normal_load = 10.0;
      batch.step({&motion, 1}, {&out, 1});
    }
    SavedBed good{std::vector<std::byte>(batch.state_size(), std::byte{0x55})};
    REQUIRE(batch.save_state({good.bytes.data(), good.bytes.size()}) == good.bytes.size());
    std::size_t weak = padded, without = padded - 1;
    const auto borne = [&](std::size_t i) { return good.at(bed_stiffness, i) * good.at(bed_pressure, i); };
    for (std::size_t i = 0; i < padded; ++i) {
      if (borne(i) == 0.0f) without = i;
      if (borne(i) > 0.0f && (weak == padded || borne(i) < borne(weak))) weak = i;
    }
    REQUIRE(weak < padded);
    const auto restore = [&](SavedBed& state) {
      reseal(state.bytes);
      batch.restore_state({state.bytes.data(), state.bytes.size()});
    };
    REQUIRE_NOTHROW(restore(good));
    for (const Forged& forged : table) {
      if (forged.kind != kind && forged.kind != any) continue;
      INFO(forged.bound << ", bed " << kind);
      SavedBed bad = good;
      forged.forge(bad, weak, without);
      CHECK_THROWS_AS(restore(bad), bristle::Error);
    }
  }
}

TEST_CASE("A brush whose longest bristles are bent to residual and length is taken back",
          "[state][cohorts]") {
  OnePatch patch(redrawn(SnapLength::uniform(0.5 * dbar, 1.5 * dbar)).with_residual_length(0.2 * dbar),
                 infinite_options());
  patch.step(1.65 * dbar, 0.0, 1.0);
  expect_taken_back(patch);
}

TEST_CASE("A state of an infinite brush with other options is refused", "[state][cohorts]") {
  const PatchOptions options =
      infinite_options().with_axes(2).with_outputs(bristle::Outputs::all).with_resolution(8);
  OnePatch patch(redrawn(), options);
  patch.step(0.3 * dbar, 0.0, 0.8);
  const std::vector<std::byte> state = saved_state(patch.batch);
  PatchOptions others[] = {options, options, options, options};
  others[0].with_resolution(8.1);
  others[1].with_outputs(bristle::Outputs::end);
  others[2].with_axes(1);
  others[3].with_max_normal_load(2.0);
  for (const PatchOptions& other : others)
    CHECK_THROWS_AS(OnePatch(redrawn(), other).batch.restore_state(state), bristle::Error);
}

namespace {

/// State of an infinite brush of 24 cohorts, and its part of the saved state. `size`: bytes of that part.
struct ForgedBrush {
  ForgedBrush(const Material& material, std::size_t size)
      : patch(material, infinite_options().with_axes(2).with_resolution(2)),
        part(patch.batch.state_size() - size) {
    patch.step(1.3 * dbar, 0.2 * dbar, 0.6);
    patch.step(-0.4 * dbar, 0.1 * dbar, 0.75);
  }
  /// Restores the saved state with 4 or 8 bytes forged, `at` bytes after the brush's part begins.
  template <class Number>
  void forge(int at, Number number, std::vector<std::byte> state) {
    std::memcpy(state.data() + static_cast<std::ptrdiff_t>(part) + at, &number, sizeof number);
    reseal(state);
    patch.batch.restore_state(state);
  }

  OnePatch patch;
  std::size_t part;
};

// Saved are three numbers of the response at rest, two of the contact, for each axis a double and five
// floats, six floats, and for each cohort seven floats and, if it ages, its birth; then, if it ages, a time.
constexpr int saved_contact = 24, saved_axes = saved_contact + 16, saved_cohorts = saved_axes + 2 * 28 + 24;
constexpr std::size_t plain_part = saved_cohorts + 24 * 28, aged_part = saved_cohorts + 24 * 36 + 16;
Material aged_material() { return redrawn().with_ageing(Ageing::logarithmic(0.05, 1e-3)); }

}  // namespace

TEST_CASE("Each bound of a saved infinite brush refuses what it is for", "[state][hostile]") {
  ForgedBrush plain(redrawn(), plain_part), lifted(redrawn(), plain_part), aged(aged_material(), aged_part);
  lifted.patch.step(0.0, 0.0, 0.0);
  // Finds a cohort that is not empty.
  const std::vector<std::byte> state = saved_state(plain.patch.batch);
  int cohort = saved_cohorts;
  for (float fresh = 0.0f; fresh == 0.0f; cohort += 28)
    std::memcpy(&fresh, state.data() + plain.part + cohort + 12, sizeof fresh);
  cohort -= 28;
  const auto refuses = [](ForgedBrush& brush, const std::string& bound, int at, auto number) {
    INFO(bound << " at " << at);
    CHECK_THROWS_WITH(brush.forge(at, number, saved_state(brush.patch.batch)),
                      Catch::Contains("(" + bound + ")"));
  };
  const struct {
    const char* bound;
    int at;
    double number;
  } numbers[] = {{"overload", -64, 2.0},
                 {"the force", 0, 1e3},
                 {"rest", 16, 0.5},
                 {"stiffness", saved_contact, 1e-3},
                 {"phase", saved_contact + 8, 1.5},
                 {"the position", saved_axes, 1e3},
                 {"a cohort's position", saved_axes, 2.5},  // all cohorts beyond their reach
                 {"the shares", saved_contact, 0.0}};
  for (const auto& forged : numbers) refuses(plain, forged.bound, forged.at, forged.number);
  const struct {
    const char* bound;
    int at;
    float number;
  } floats[] = {{"the position", saved_axes + 8, 1e3f},
                {"the moment", saved_axes + 8, 0.5f},
                {"an open cohort", saved_axes + 12, std::nanf("")},
                {"owed", saved_axes + 56, -1.0f},
                {"slack", saved_axes + 64, std::nanf("")},
                {"slack", saved_axes + 64, 10.0f},
                {"spread", saved_axes + 68, 1e3f},
                {"pair", saved_axes + 72, -1.0f},
                {"a cohort's position", cohort, 1e3f},
                {"a cohort's reach", cohort + 8, -1.0f},
                {"a cohort's share", cohort + 12, -1.0f},
                {"a cohort's survival", cohort + 16, 0.0f},
                {"an empty cohort", cohort + 12, 0.0f},
                {"the shares", cohort + 12, 1e-9f},
                {"a cohort's survival", cohort + 16, std::nanf("")},
                {"a cohort's ranks", cohort + 20, -1.0f},
                {"a cohort's ranks", cohort + 24, 1.5f}};
  for (const auto& forged : floats) refuses(plain, forged.bound, forged.at, forged.number);
  refuses(lifted, "a cohort's survival", saved_cohorts + 12, 1.0f);
  refuses(lifted, "an empty cohort", saved_cohorts, 1.0f);
  refuses(aged, "a cohort's birth", saved_cohorts + 20, 1e19);
  refuses(aged, "a cohort's birth", saved_cohorts + 20, std::nan(""));
  refuses(aged, "a time", saved_cohorts + 24 * 36 + 8, std::int64_t{-1});
}

TEST_CASE("The hash of an infinite brush sees when its bristles were born", "[state][cohorts]") {
  ForgedBrush aged(aged_material(), aged_part);
  const std::uint64_t before = aged.patch.hash();
  REQUIRE_NOTHROW(aged.forge(saved_cohorts + 20, 1.25e-3, saved_state(aged.patch.batch)));
  CHECK(aged.patch.hash() != before);
}

TEST_CASE("An infinite brush that is lifted stores nothing", "[cohorts][energy]") {
  OnePatch patch(redrawn(), infinite_options().with_resolution(1).with_outputs(bristle::Outputs::all));
  for (int k = 0; k < 300; ++k) patch.step(0.03 * dbar, 0.004 * dbar * (k % 9), 0.7);
  const double stored = patch.energy();
  CHECK(patch.step(0.0, 0.0, 0.0).contact_loss == Approx(stored).epsilon(1e-6));
  CHECK(patch.energy() == 0.0);
}

}  // namespace bristle_test::test_taken_back
