// Each kind of bad input (core/MODEL.md, section 14): flagged, zero force, state kept, neighbours untouched;
// errors at set-up.
#include <catch2/catch.hpp>

#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "expect.hpp"
#include "scenes.hpp"

#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

namespace bristle_test::test_bad_input {

using Catch::Matchers::Contains;

namespace {

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();
constexpr double infinite = std::numeric_limits<double>::infinity();

Material damped() { return Material{}.with_bristle_damping(0.02).with_viscous_friction(0.5); }

/// Three patches that have moved for a while, of which the middle one gets bad input.
struct Trio {
  Trio() {
    const PatchOptions options = PatchOptions{}.with_bristles(600).with_outputs(Outputs::all);
    ids = add_patches(batch, 3, damped(), options);
    batch.warm_up();
    for (int k = 0; k < 12; ++k) step(tick, good());
  }
  std::vector<Motion> good() const { return same_motion(ids, 4.1e-6, 1.2e-6, 0.8); }
  std::vector<Response> step(double dt, const std::vector<Motion>& motions) {
    std::vector<Response> responses(motions.size());
    report = batch.step(dt, motions, responses);
    return responses;
  }
  PatchBatch batch;
  std::vector<PatchId> ids;
  bristle::StepReport report;
};

void check_no_force(const Response& r) {
  for (int axis = 0; axis < 2; ++axis) {
    CHECK(r.end[axis] == 0.0);
    CHECK(r.elastic[axis] == 0.0);
    CHECK(r.damper[axis] == 0.0);
    CHECK(r.mean[axis] == 0.0);
  }
  CHECK(r.dissipated == 0.0);
  CHECK(r.contact_loss == 0.0);
  CHECK(r.damper_work == 0.0);
  CHECK(r.snaps == 0);
}

}  // namespace

TEST_CASE("A velocity that is not used may hold anything, and a load of minus zero is no load",
          "[bad-input]") {
  Trio trio;
  std::vector<Motion> motions = trio.good();
  motions[1].velocity[0] = nan_value;
  motions[1].velocity[1] = infinite;
  motions[2].normal_load = -0.0;
  const std::vector<Response> got = trio.step(tick, motions);
  CHECK(got[1].status == Status::ok);
  CHECK(std::isfinite(got[1].end[0]));
  CHECK(got[2].status == Status::ok);
  CHECK(got[2].end[0] == 0.0);
  OnePatch one_axis(Material{}, PatchOptions{}.with_bristles(200).with_axes(1));
  CHECK(one_axis.step(Motion{one_axis.id, {1e-6, -0.0}, 0.5, true, {1e-3, 0.0}}).status == Status::ok);
}

TEST_CASE("An id that was removed is flagged as unknown and changes nothing", "[bad-input]") {
  Trio bad;
  Trio twin;
  const PatchId removed = bad.batch.add(damped(), PatchOptions{}.with_bristles(50));
  bad.batch.warm_up();
  bad.batch.remove(removed);
  bad.batch.warm_up();
  std::vector<Motion> motions = bad.good();
  Motion strange = motions[0];
  strange.id = removed;
  motions.insert(motions.begin() + 1, strange);
  const std::vector<Response> got = bad.step(tick, motions);
  const std::vector<Response> expected = twin.step(tick, twin.good());
  CHECK(got[1].status == Status::unknown_id);
  CHECK(got[1].id == removed);
  CHECK(has(bad.report.status, Status::unknown_id));
  CHECK(bad.report.patches_stepped == 3);
  for (const std::size_t i : {0, 1, 2}) CHECK(first_difference(got[i == 0 ? 0 : i + 1], expected[i]) == "");
  CHECK(bad.batch.state_hash() == twin.batch.state_hash());

  CHECK(bad.batch.find_force(tick, strange).status == Status::unknown_id);
  CHECK(bad.batch.stored_energy(removed) == 0.0);
  double z[3];
  CHECK(bad.batch.read_bristles(removed, z, {}, {}) == 0);
  CHECK(bad.batch.info(removed).representatives == 0);
  CHECK_THROWS_AS(bad.batch.remove(removed), bristle::Error);
  CHECK_THROWS_AS(bad.batch.remove(PatchId{}), bristle::Error);
  CHECK_THROWS_AS(bad.batch.set_material(removed, Material{}), bristle::Error);
}

#if defined(__SSE2__)
TEST_CASE("The caller's floating-point mode is as it was after a step, and does not change the result",
          "[bad-input]") {
  const unsigned original = _mm_getcsr();
  std::uint64_t hashes[3];
  int at = 0;
  for (unsigned mode :
       // Floating-point modes in which denormal results count as 0, then also denormal inputs.
       {original & ~0x8040u, original | 0x8000u, original | 0x8040u}) {
    PatchBatch batch(BatchOptions{}.with_threads(2));
    const std::vector<PatchId> ids =
        add_patches(batch, 40, Material{}, PatchOptions{}.with_bristles(4000).with_outputs(Outputs::all));
    batch.warm_up();
    _mm_setcsr(mode);
    std::vector<Response> responses(ids.size());
    for (int k = 0; k < 5; ++k) {
      const std::vector<Motion> motions = same_motion(ids, 6e-6, 1e-310, 0.9);
      batch.step(tick, motions, responses);
      batch.find_force(tick, motions[0]);
      batch.stored_energy(ids[0]);
    }
    hashes[at++] = batch.state_hash();
    const unsigned after = _mm_getcsr();
    _mm_setcsr(original);
    // Compares the floating-point mode's control bits; any arithmetic may raise the low six (sticky) flags.
    CHECK((after & ~0x3fu) == (mode & ~0x3fu));
  }
  CHECK(hashes[0] == hashes[1]);
  CHECK(hashes[0] == hashes[2]);
}
#endif

namespace {

void check_error(const std::string& message, const std::string& parameter, const std::string& value) {
  INFO("message: " << message);
  CHECK_THAT(message, Contains(parameter));
  CHECK_THAT(message, Contains(value));
  // Checks that the message has more than name and value: it must tell a range or a rule too.
  CHECK(message.size() > parameter.size() + value.size() + 8);
}

}  // namespace

TEST_CASE("Set-up errors of every call name the parameter, its value and the allowed range", "[bad-input]") {
  PatchBatch batch;
  check_error(message_of([&] { batch.add(Material{}.with_bristle_stiffness(-1.5), {}); }),
              "bristle_stiffness", "-1.5");
  CHECK(batch.patch_count() == 0);
  const PatchId id = batch.add(Material{}, PatchOptions{}.with_bristles(10));
  check_error(message_of([&] { batch.set_material(id, Material{}.with_bristle_stiffness(-1.5)); }),
              "bristle_stiffness", "-1.5");

  const std::string message = message_of([] { PatchBatch bad(BatchOptions{}.with_isa("sse9")); });
  check_error(message, "isa", "sse9");
  CHECK_THAT(message, Contains("scalar"));  // the message names the instruction sets that exist
  for (const bristle::IsaInfo& isa : bristle::instruction_sets()) {
    if (isa.usable) continue;
    CHECK_THAT(message_of([&] { PatchBatch bad(BatchOptions{}.with_isa(isa.name)); }), Contains(isa.name));
  }
}

TEST_CASE("Redraw with a law too wide to jump is refused by name, keep takes it", "[bad-input]") {
  PatchBatch batch;
  const Material wide = Material{}.with_snap_length(SnapLength::lognormal(1e-5, 1.3));
  const PatchOptions bristles = PatchOptions{}.with_bristles(100);
  CHECK_THROWS_WITH(batch.add(wide, bristles),
                    Catch::Contains("snap_length.cv") && Catch::Contains("1.3") && Catch::Contains("1.25"));
  CHECK_NOTHROW(batch.add(Material(wide).with_snap_rule(SnapRule::keep), bristles));
  // Checks that validate_for_representatives() throws the same error as add(), without naming a patch.
  CHECK_THROWS_WITH(wide.validate_for_representatives(),
                    "Material: snap_length.cv = 1.3; allowed is 0 to 1.25 with snap_rule redraw and "
                    "representatives; snap_rule keep takes every law");
  CHECK_NOTHROW(Material(wide).with_snap_rule(SnapRule::keep).validate_for_representatives());
  CHECK_NOTHROW(wide.validate());  // the material itself is valid; only representatives refuse it
  const Material widest = Material{}.with_snap_length(SnapLength::lognormal(1e-5, bristle::widest_redraw_cv));
  CHECK_NOTHROW(batch.add(widest, bristles));
  CHECK_THROWS_WITH(Material(wide).with_stribeck_velocity(-1.0).validate_for_representatives(),
                    Catch::Contains("stribeck_velocity"));
}

TEST_CASE("A refusal clears what a response held from an earlier step", "[bad-input]") {
  // Checks that a refused step sets energies and mean force of the response to 0 if the patch computes them,
  // or if no patch has this id; otherwise it leaves these two as they are.
  Trio trio;
  Response used;
  used.mean[0] = used.mean[1] = used.end[0] = used.elastic[1] = used.damper[0] = 7.0;
  used.stiffness = used.damping = used.force_limit = 7.0;
  used.dissipated = used.contact_loss = used.damper_work = 7.0;
  used.snaps = 7;
  const auto refused = [&](const std::function<void(Motion&)>& spoil, double dt, Status status) {
    Motion motion = trio.good()[1];
    spoil(motion);
    Response r = used;
    trio.batch.step(dt, {&motion, 1}, {&r, 1});
    CHECK(r.status == status);
    check_no_force(r);
    CHECK(r.stiffness == 0.0);
    CHECK(r.damping == 0.0);
    CHECK(r.force_limit == 0.0);
  };
  refused([](Motion& m) { m.displacement[0] = nan_value; }, tick, Status::bad_input);
  refused([](Motion& m) { m.id = PatchId{}; }, tick, Status::unknown_id);
  refused([](Motion&) {}, 0.0, Status::bad_input);
  const std::vector<Motion> twice{trio.good()[1], trio.good()[1]};
  std::vector<Response> two{used, used};
  trio.batch.step(tick, twice, two);
  CHECK(two[1].status == Status::repeated_id);
  check_no_force(two[1]);
}

}  // namespace bristle_test::test_bad_input
