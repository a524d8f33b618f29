// Contacts in lanes: what sixteen contacts of a block may not know of each other, slow sliding, falls of the
// load, and the energy of random laws, paths and loads.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/materials/strata.hpp"
#include "expect.hpp"
#include "scenes.hpp"

namespace bristle_test::test_lanes {

namespace {

Material sliding(const SnapLength& law) { return plain_material(law, SnapRule::slide); }

/// Random motions of a contact: a winding path with steps of 0 to 2 mean lengths, and a load that wavers.
struct Walk {
  explicit Walk(unsigned seed) : random(seed) {}
  std::mt19937 random;
  double angle = 0.0;

  double share() { return static_cast<double>(random() % 100000) / 100000.0; }
  Motion next(PatchId id, int axes = 2, double most_load = 1.0) {
    angle += random() % 10 == 0 ? 3.0 * share() : 0.3 * (share() - 0.5);
    const double h = random() % 7 == 0 ? 0.0 : 2.0 * dbar * share() * share();
    Motion motion;
    motion.id = id;
    motion.displacement[0] = h * std::cos(angle);
    motion.displacement[1] = axes == 2 ? h * std::sin(angle) : 0.0;
    motion.normal_load = random() % 30 == 0 ? 0.0 : most_load * (0.2 + 0.8 * share());
    return motion;
  }
};

std::vector<Material> materials() {
  return {sliding(SnapLength::lognormal(dbar, 0.4)), sliding(SnapLength::exponential(dbar)).with_drop(0.2),
          sliding(SnapLength::uniform(0.3 * dbar, 1.7 * dbar))
              .with_ageing(bristle::Ageing::logarithmic(0.1, 3.0 * tick))};
}

/// Hash and forces of a contact after a walk, alone or with `others` contacts of its kind and of other kinds.
struct Outcome {
  std::uint64_t hash = 0;
  std::vector<double> forces;
  bool operator==(const Outcome& o) const { return hash == o.hash && forces == o.forces; }
};
Outcome walk(const BatchOptions& where, const Material& material, const PatchOptions& options, int others,
             int before) {
  PatchBatch batch(where);
  std::vector<PatchId> company;
  const auto join = [&](int count) {
    for (int k = 0; k < count; ++k)
      company.push_back(batch.add(materials()[static_cast<std::size_t>(k) % 3], options));
  };
  join(before);
  const PatchId id = batch.add(material, options);
  join(others - before);
  Walk mine(1), theirs(2);
  Outcome outcome;
  std::vector<Motion> motions;
  std::vector<Response> responses;
  for (int k = 0; k < 120; ++k) {
    motions.assign(1, mine.next(id, options.axes));
    for (const PatchId other : company)
      if (theirs.random() % 3 != 0) motions.push_back(theirs.next(other, options.axes));
    std::shuffle(motions.begin(), motions.end(), theirs.random);
    responses.assign(motions.size(), Response{});
    batch.step(tick, motions, responses);
    for (std::size_t i = 0; i < motions.size(); ++i)
      if (motions[i].id == id)
        outcome.forces.insert(outcome.forces.end(), {responses[i].end[0], responses[i].end[1]});
  }
  outcome.hash = batch.state_hash(id);
  return outcome;
}

}  // namespace

TEST_CASE(
    "a contact has the bits of one alone, whatever the company, the order, the instruction set and the "
    "threads",
    "[slide][lanes][determinism]") {
  setenv("BRISTLE_SHARING", "0,64,100", 1);
  for (const Material& material : materials())
    for (const Precision precision : precisions())
      for (const int axes : {1, 2})
        for (const Outputs outputs : {Outputs::end, Outputs::all}) {
          const PatchOptions options = plain_options(9, axes, precision, outputs).with_max_normal_load(1.0);
          const Outcome alone = walk(BatchOptions{}.with_isa("scalar"), material, options, 0, 0);
          for (const bristle::IsaInfo& isa : bristle::instruction_sets()) {
            if (!isa.usable) continue;
            CAPTURE(isa.name, axes, name_of(precision));
            const BatchOptions here = BatchOptions{}.with_isa(isa.name);
            CHECK(walk(here, material, options, 0, 0) == alone);
            CHECK(walk(here, material, options, 40, 0) == alone);
            CHECK(walk(BatchOptions(here).with_threads(2), material, options, 150, 50) == alone);
          }
        }
  unsetenv("BRISTLE_SHARING");
}

TEST_CASE("a lane that a removed contact leaves begins anew", "[slide][lanes]") {
  PatchBatch batch;
  const Material material = materials()[0];
  const PatchOptions options = plain_options(8).with_max_normal_load(1.0);
  std::vector<PatchId> ids = add_patches(batch, 40, material, options);
  Walk path(4);
  std::vector<Response> responses(1);
  for (int round = 0; round < 60; ++round) {
    for (PatchId& id : ids) {
      if (path.random() % 4 == 0) {
        batch.remove(id);
        id = batch.add(material, options);
        CHECK(step_one(batch, Motion{id, {0.1 * dbar, 0.0}, 0.5}).end[0] == Approx(-0.05 * dbar));
      }
      step_one(batch, path.next(id));
    }
  }
  CHECK(batch.patch_count() == 40);
  for (const PatchId id : ids) batch.remove(id);
  CHECK(batch.patch_count() == 0);
}

TEST_CASE("a trial in a lane is the step that would follow, and changes nothing", "[slide][lanes]") {
  for (const Material& material : materials()) {
    PatchBatch batch;
    const std::vector<PatchId> ids =
        add_patches(batch, 20, material, plain_options(8).with_max_normal_load(1.0));
    Walk path(6);
    for (int k = 0; k < 300; ++k) {
      const Motion motion = path.next(ids[path.random() % ids.size()]);
      const std::uint64_t before = batch.state_hash();
      const Response trial = batch.find_force(tick, motion);
      REQUIRE(batch.state_hash() == before);
      CHECK(first_difference(step_one(batch, motion), trial) == "");
    }
  }
}

TEST_CASE("random laws, paths and loads balance their energy, and no force exceeds its limit",
          "[slide][lanes][energy]") {
  std::mt19937 random(8);
  for (int trial = 0; trial < 1500; ++trial) {
    const double cv = 0.05 + 0.01 * (random() % 120);
    const SnapLength law = trial % 3 == 0   ? SnapLength::exponential(dbar)
                           : trial % 3 == 1 ? SnapLength::lognormal(dbar, cv)
                                            : SnapLength::uniform(0.1 * dbar, (1.0 + cv) * dbar);
    Material material = sliding(law);
    if (random() % 3 == 0) material.with_drop(trial % 2 == 0 ? 0.3 : 0.9);
    if (random() % 4 == 0)
      material.with_ageing(trial % 2 == 0 ? bristle::Ageing::saturating(0.4, 5.0 * tick)
                                          : bristle::Ageing::logarithmic(1.0, tick));
    const Precision precision = precisions()[random() % precisions().size()];
    PatchOptions options = plain_options(4 + random() % 20, 2, precision).with_max_normal_load(1.0);
    if (random() % 4 == 0) {
      bristle::Lay lay;
      lay.angle = 0.4;
      lay.limit_ratio = 0.5;
      if (material.drop == 0.0 && material.ageing_strength == 0.0) lay.to_over_fro = 2.0;
      options.lay = lay;
    }
    OnePatch patch(material, options);
    Walk path(random());
    double work = 0.0, spent = 0.0, moved = 0.0;
    for (int k = 0; k < 60; ++k) {
      const Motion motion = path.next(patch.id);
      const double stored = patch.energy();
      const Response out = patch.step(motion);
      const double step_work = -(out.mean[0] * motion.displacement[0] + out.mean[1] * motion.displacement[1]);
      work += step_work;
      moved += std::abs(step_work);
      spent += out.dissipated + out.contact_loss + patch.energy() - stored;
      expect(out.dissipated >= 0.0, "friction takes energy");
      const double end_work = -(out.end[0] * motion.displacement[0] + out.end[1] * motion.displacement[1]);
      const double rounding = precision == Precision::single ? 1e-5 : 1e-10;
      expect(end_work - (patch.energy() - stored + out.contact_loss) >=
                 -rounding * (std::abs(end_work) + std::abs(step_work) + stored),
             "the force at the end makes no energy");
      expect(std::hypot(out.elastic[0], out.elastic[1]) <= out.force_limit * (1.0 + 1e-12),
             "within the limit");
    }
    CAPTURE(trial, name_of(precision), material.drop, material.ageing_strength);
    CHECK(std::abs(work - spent) <= (precision == Precision::single ? 1e-5 : 1e-10) * moved);
  }
}

TEST_CASE("a million steps of 1e-7 limits turn, work and dissipate as one step of a tenth does",
          "[slide][lanes][creep]") {
  const double limits = 0.1, slip = 1e-7;
  for (const double degrees : {0.0, 30.0, 90.0, 150.0}) {
    OnePatch slow(sliding(SnapLength::lognormal(dbar, 0.3)), plain_options(8, 2).with_max_normal_load(1.0));
    OnePatch fast(sliding(SnapLength::lognormal(dbar, 0.3)), plain_options(8, 2).with_max_normal_load(1.0));
    for (OnePatch* patch : {&slow, &fast}) patch->step(10.0 * dbar, 0.0, 1.0);
    const double x = std::cos(degrees * M_PI / 180.0), y = std::sin(degrees * M_PI / 180.0);
    double work = 0.0, lost = 0.0;
    Response end;
    const int steps = static_cast<int>(limits / slip);
    for (int k = 0; k < steps; ++k) {
      end = slow.step(slip * dbar * x, slip * dbar * y, 1.0);
      work -= slip * dbar * (end.mean[0] * x + end.mean[1] * y);
      lost += end.dissipated;
    }
    const Response truth = fast.step(limits * dbar * x, limits * dbar * y, 1.0);
    CAPTURE(degrees);
    for (int axis = 0; axis < 2; ++axis) CHECK(end.end[axis] == Approx(truth.end[axis]).margin(1e-3 * dbar));
    CHECK(
        work ==
        Approx(-limits * dbar * (truth.mean[0] * x + truth.mean[1] * y)).margin(1e-3 * limits * dbar * dbar));
    CHECK(lost == Approx(truth.dissipated).margin(1e-3 * limits * dbar * dbar));
  }
}

TEST_CASE("a load that falls by 1e13 at once leaves what it can hold, at rest and in motion",
          "[slide][lanes][load]") {
  for (const Precision precision : precisions())
    for (const double way : {0.0, 0.5}) {
      const double load = 1e3, less = 1e-10;
      OnePatch patch(sliding(SnapLength::lognormal(dbar, 0.3)),
                     plain_options(16, 2, precision).with_max_normal_load(load));
      patch.step(8.0 * dbar, 6.0 * dbar, load);
      const double stored = patch.energy();
      const Response fallen = patch.step(0.8 * way * dbar, 0.6 * way * dbar, less);
      CHECK(std::hypot(fallen.end[0], fallen.end[1]) == Approx(less * dbar).epsilon(2e-5));
      CHECK(fallen.end[0] / fallen.end[1] == Approx(8.0 / 6.0).epsilon(1e-4));
      CHECK(fallen.contact_loss == Approx(stored).epsilon(1e-5));
      CHECK(fallen.end[0] * fallen.end[0] + fallen.end[1] * fallen.end[1] <=
            fallen.force_limit * fallen.force_limit * (1.0 + 1e-12));
      // The contact turns and rises again as one that never carried more.
      OnePatch young(sliding(SnapLength::lognormal(dbar, 0.3)),
                     plain_options(16, 2, precision).with_max_normal_load(load));
      young.step(8.0 * dbar, 6.0 * dbar, less);
      for (OnePatch* each : {&patch, &young}) each->step(0.0, 30.0 * dbar, less);
      const Response old = patch.step(0.0, 0.0, load), fresh = young.step(0.0, 0.0, load);
      CHECK(old.end[1] == Approx(fresh.end[1]).epsilon(1e-3));
    }
}

TEST_CASE("springs without stiffness hold nothing", "[slide][lanes]") {
  OnePatch patch(sliding(uniform).with_bristle_stiffness(0.0), plain_options(8).with_max_normal_load(1.0));
  for (const double load : {1.0, 0.0, 0.5}) {
    const Response out = patch.step(0.3 * dbar, 0.1 * dbar, load);
    CHECK(out.end[0] == 0.0);
    CHECK(out.mean[1] == 0.0);
    CHECK(out.dissipated == 0.0);
    CHECK(out.stiffness == 0.0);
  }
}

TEST_CASE("springs that stick or slide at a load that rises at rest change no force",
          "[slide][lanes][load]") {
  OnePatch patch(sliding(uniform), plain_options(8).with_max_normal_load(1e6));
  patch.step(0.9 * dbar, 0.2 * dbar, 1e-6);
  const Response held = patch.step(0.0, 0.0, 1e-6);
  for (const double load : {1e-3, 1.0, 1e6}) {
    const Response out = patch.step(0.0, 0.0, load);
    CHECK(out.end[0] == Approx(held.end[0]).epsilon(1e-6));
    CHECK(out.end[1] == Approx(held.end[1]).epsilon(1e-6));
    CHECK(out.stiffness == Approx(load));
  }
}

}  // namespace bristle_test::test_lanes
