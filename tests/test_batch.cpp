// The batch: ids, adding and removing while it runs, changes of material, patches that are not named, the
// wrappers.
#include <catch2/catch.hpp>

#include <cfenv>
#include <cstring>
#include <set>

#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

#include "expect.hpp"
#include "scenes.hpp"

namespace bristle_test::test_batch {

TEST_CASE("A removed id never names a later patch", "[batch]") {
  PatchBatch batch;
  std::set<std::uint64_t> seen;
  std::vector<PatchId> live;
  std::vector<PatchId> dead;
  for (int k = 0; k < 300; ++k) {
    const PatchId id = batch.add(Material{}, PatchOptions{}.with_bristles(10));
    REQUIRE(id.value != 0);
    REQUIRE(seen.insert(id.value).second);
    live.push_back(id);
    if (k % 3 != 0) {  // removes two of three patches: slots are reused often
      const std::size_t at = static_cast<std::size_t>(k * 7) % live.size();
      batch.remove(live[at]);
      dead.push_back(live[at]);
      live.erase(live.begin() + static_cast<std::ptrdiff_t>(at));
    }
    if (k % 5 == 0) {
      const std::vector<Motion> motions = same_motion(live, 1e-6, 0.0, 0.5);
      std::vector<Response> responses(live.size());
      CHECK(batch.step(tick, motions, responses).status == Status::ok);
    }
  }
  batch.warm_up();
  CHECK(batch.patch_count() == live.size());
  for (PatchId id : dead) {
    Motion motion;
    motion.id = id;
    motion.normal_load = 0.5;
    REQUIRE(batch.find_force(tick, motion).status == Status::unknown_id);
    REQUIRE_THROWS_AS(batch.remove(id), bristle::Error);
  }
}

TEST_CASE("A patch added in a used slot starts like new", "[batch]") {
  const PatchOptions options = PatchOptions{}.with_bristles(500).with_outputs(Outputs::all);
  PatchBatch used;
  const PatchId old =
      used.add(Material{}.with_bristle_damping(0.1), PatchOptions{}.with_bristles(900).with_seed(9));
  step_one(used, Motion{old, {3e-5, 1e-5}, 1.0});
  used.remove(old);
  PatchBatch fresh;
  const PatchId a = used.add(Material{}, options);
  const PatchId b = fresh.add(Material{}, options);
  for (int k = 0; k < 20; ++k) {
    Motion motion = same_motion({a}, 4e-6, -2e-6, 0.77)[0];
    Response ra, rb;
    used.step(tick, {&motion, 1}, {&ra, 1});
    motion.id = b;
    fresh.step(tick, {&motion, 1}, {&rb, 1});
    ra.id = rb.id = PatchId{};
    REQUIRE(first_difference(ra, rb) == "");
  }
  CHECK(used.state_hash(a) == fresh.state_hash(b));
}

TEST_CASE("A new patch is out of contact until a motion gives it a load", "[batch]") {
  PatchBatch batch;
  const PatchId id = batch.add(Material{}, PatchOptions{}.with_bristles(500));
  const PatchId other = batch.add(Material{}, PatchOptions{}.with_bristles(500));
  step_one(batch, Motion{other, {1e-6, 0.0}, 1.0});
  CHECK(batch.info(id).active == 0.0);
  CHECK(batch.info(id).normal_load == 0.0);
  CHECK(batch.stored_energy(id) == 0.0);
}

TEST_CASE("A patch that is not named rests under its last load", "[batch]") {
  const PatchOptions options = PatchOptions{}.with_bristles(500).with_outputs(Outputs::all);
  PatchBatch batch;
  const std::vector<PatchId> ids = add_patches(batch, 2, Material{}, options);
  const std::vector<Motion> motions = same_motion(ids, 6e-6, 2e-6, 0.8);
  std::vector<Response> before(2), after(2);
  for (int k = 0; k < 10; ++k) batch.step(tick, motions, before);
  const std::uint64_t hash = batch.state_hash(ids[1]);
  for (int k = 0; k < 10; ++k) {
    const bristle::StepReport report = batch.step(tick, {motions.data(), 1}, {after.data(), 1});
    REQUIRE(report.patches_stepped == 1);
  }
  CHECK(batch.state_hash(ids[1]) == hash);
  CHECK(batch.info(ids[1]).normal_load == 0.8);
  const std::vector<Motion> rest = same_motion({ids[1]}, 0.0, 0.0, 0.8);
  batch.step(tick, rest, {after.data(), 1});
  CHECK(after[0].elastic[0] == before[1].elastic[0]);
  CHECK(after[0].elastic[1] == before[1].elastic[1]);
}

TEST_CASE("A material changed live keeps the deflections, and may have another rule", "[batch]") {
  for (Precision precision : precisions()) {
    INFO(name_of(precision));
    constexpr std::uint32_t n = 1000;
    const Material longer = plain_material(SnapLength::uniform(0.9 * dbar, 1.1 * dbar), SnapRule::keep);
    const double rounding = precision == Precision::single ? 1e-6 : 1e-12;

    // Gives the patch a material that differs in stiffness only: deflections and weight stay, forces follow.
    OnePatch other(longer, plain_options(n, 2, precision));
    other.step(0.0, 0.0, n);
    other.step(0.5 * dbar, 0.2 * dbar, n);
    other.batch.set_material(other.id, Material(longer).with_bristle_stiffness(3.0));
    const Response s = other.step(0.0, 0.0, n);
    expect_near(-s.elastic[0], 3.0 * n * 0.5 * dbar, 3.0 * rounding * n * dbar,
                "force at three times the stiffness");
    CHECK(s.snaps == 0);
    CHECK(s.stiffness == Approx(3.0 * n));
    CHECK(other.batch.info(other.id).weight == 1.0);

    // Changes the snap rule of a live patch from keep to redraw and back.
    other.batch.set_material(other.id, plain_material(SnapLength::lognormal(dbar, 0.3), SnapRule::redraw));
    for (int k = 0; k < 30; ++k) REQUIRE(other.step(0.7 * dbar, 0.0, n).status == Status::ok);
    CHECK(-other.step(0.0, 0.0, n).elastic[0] / (n * dbar) == Approx(0.545).epsilon(0.15));
    other.batch.set_material(other.id, longer);
    for (int k = 0; k < 30; ++k) REQUIRE(other.step(7.7 * dbar, 0.0, n).status == Status::ok);
    CHECK(-other.step(0.0, 0.0, n).elastic[0] / (n * dbar) == Approx(0.5).epsilon(0.25));
  }
}

TEST_CASE("A patch that names no number of bristles is the infinite brush where its law allows one",
          "[batch]") {
  using bristle::Population;
  using bristle::SnapLength;
  const Material smooth;
  const Material one_length = Material{}.with_snap_length(SnapLength::single(1e-5));
  const Material too_wide = Material{}.with_snap_length(SnapLength::lognormal(1e-5, 1.3));
  const Material keeping = Material{}.with_snap_rule(bristle::SnapRule::keep);
  const struct {
    Material material;
    PatchOptions options;
    Population chosen;
  } cases[] = {
      {smooth, PatchOptions{}, Population::infinite},
      {too_wide, PatchOptions{}, Population::infinite},
      {smooth, PatchOptions{}.with_precision(bristle::Precision::double_), Population::infinite},
      {smooth, PatchOptions{}.with_bristles(100), Population::representatives},
      {one_length, PatchOptions{}, Population::representatives},
      {keeping, PatchOptions{}, Population::representatives},
      {smooth, PatchOptions{}.with_population(Population::representatives), Population::representatives},
      {smooth, PatchOptions{}.with_bristles(100).with_population(Population::infinite), Population::infinite},
  };
  PatchBatch batch;
  for (const auto& c : cases) {
    CHECK(bristle::choose_population(c.material, c.options) == c.chosen);
    const std::string kernel = batch.info(batch.add(c.material, c.options)).kernel;
    CHECK((kernel.find("infinite") != std::string::npos) == (c.chosen == Population::infinite));
  }
}

TEST_CASE("info tells what a patch is and uses", "[batch]") {
  PatchBatch batch;
  const Material material = Material{}.with_normal_stiffness(1000.0).with_asperity_height_deviation(1e-6);
  const PatchId one = batch.add(
      material, PatchOptions{}.with_max_normal_load(2.0).with_bristles(500).with_key(0x123456789abcdefu));
  const PatchId natural = batch.add(material, PatchOptions{}.with_max_normal_load(2.0).with_population(
                                                  bristle::Population::representatives));
  const PatchId capped = batch.add(material, PatchOptions{}.with_max_normal_load(200.0).with_population(
                                                 bristle::Population::representatives));
  const PatchId small =
      batch.add(material, PatchOptions{}.with_max_normal_load(2.0).with_bristles(500).with_axes(1));
  batch.warm_up();
  step_one(batch, Motion{one, {0.0, 0.0}, 0.5});
  bristle::PatchInfo info = batch.info(one);
  CHECK(info.key == 0x123456789abcdefu);
  CHECK(info.representatives == 500);
  CHECK(info.weight == Approx(4.0).epsilon(1e-12));    // zeta_max, 2 N / (1000 N/m x 1e-6 m), over 500
  CHECK(info.active == Approx(125.0).epsilon(1e-12));  // 500 physical bristles, at 4 per representative
  CHECK(info.normal_load == 0.5);
  CHECK(info.memory_bytes >= 500u * info.bytes_per_representative);
  CHECK(info.bytes_per_representative >= 8);
  CHECK(std::strlen(info.kernel) > 0);
  CHECK(batch.info(natural).representatives == 2000);
  CHECK(batch.info(natural).weight == Approx(1.0).epsilon(1e-12));
  CHECK(batch.info(capped).representatives == 4096);
  CHECK(batch.info(small).bytes_per_representative < info.bytes_per_representative);
  CHECK(batch.patch_count() == 4);
}

TEST_CASE("The batch tells its threads and its instruction set", "[batch]") {
  bool listed = false;
  PatchBatch batch(BatchOptions{}.with_threads(2));
  CHECK(batch.threads() >= 1);
  CHECK(batch.threads() <= 2);
  for (const bristle::IsaInfo& isa : bristle::instruction_sets()) {
    if (std::strcmp(isa.name, batch.isa()) == 0) listed = isa.usable;
    if (!isa.usable) continue;
    PatchBatch forced(BatchOptions{}.with_isa(isa.name));
    CHECK(std::strcmp(forced.isa(), isa.name) == 0);
  }
  CHECK(listed);
}

TEST_CASE("A batch that was moved keeps its patches", "[batch]") {
  PatchBatch first;
  const PatchId id = first.add(Material{}, PatchOptions{}.with_bristles(300));
  step_one(first, Motion{id, {3e-6, 0.0}, 0.6});
  const std::uint64_t hash = first.state_hash(id);
  PatchBatch second(std::move(first));
  CHECK(second.state_hash(id) == hash);
  PatchBatch third;
  third = std::move(second);
  CHECK(third.state_hash(id) == hash);
  CHECK(step_one(third, Motion{id, {3e-6, 0.0}, 0.6}).status == Status::ok);
}

TEST_CASE("A batch may be destroyed with changes still waiting", "[batch]") {
  PatchBatch batch;
  const PatchId id = batch.add(Material{}, PatchOptions{}.with_bristles(5000));
  batch.add(Material{}, PatchOptions{}.with_bristles(5000));
  batch.set_material(id, Material{}.with_bristle_stiffness(10.0));
  batch.remove(id);
  SUCCEED("the sanitizers see what leaks");
}

/// Makes inexact results of the calling thread raise a signal, or not.
void trap_inexact(bool traps) {
#if defined(__SSE2__)
  const unsigned others = _MM_GET_EXCEPTION_MASK() & ~static_cast<unsigned>(_MM_MASK_INEXACT);
  _MM_SET_EXCEPTION_MASK(traps ? others : others | static_cast<unsigned>(_MM_MASK_INEXACT));
#else
  traps ? ::feenableexcept(FE_INEXACT) : ::fedisableexcept(FE_INEXACT);
#endif
}

TEST_CASE("What a patch is can be asked where the caller's inexact results trap", "[batch]") {
  PatchBatch batch;
  const PatchId id = batch.add(Material{}, PatchOptions{}.with_max_normal_load(0.3).with_bristles(7));
  step_one(batch, Motion{id, {1e-6, 0.0}, 0.1});
  std::feclearexcept(FE_ALL_EXCEPT);
  trap_inexact(true);
  const bristle::PatchInfo info = batch.info(id);
  trap_inexact(false);
  CHECK(info.representatives == 7);
}

TEST_CASE("A step reports the overload of a patch that threads share, and a refusal beside it",
          "[batch][threads]") {
  constexpr std::uint32_t many = 400000;
  const Material material = plain_material(uniform, SnapRule::redraw);
  PatchBatch batch(BatchOptions{}.with_threads(2));
  const PatchId id = batch.add(material, plain_options(many));
  batch.warm_up();
  bool shared = false;
  // Takes many steps, because after one that found the workers busy, the batch does not share some steps.
  for (int k = 0; k < (BRISTLE_WITH_TBB ? 20000 : 1) && !shared; ++k) {
    const Motion motion{id, {0.3 * dbar, 0.0}, 2.0 * many};
    Response response;
    const auto report = batch.step(tick, {&motion, 1}, {&response, 1});
    CHECK(response.status == Status::overload);
    CHECK(report.status == Status::overload);
    CHECK(report.patches_stepped == 1);
    shared = report.tasks > 1;
  }
  CHECK(shared == (BRISTLE_WITH_TBB != 0));
}

}  // namespace bristle_test::test_batch
