// Contacts in lanes and in groups: how they come and go, slow and steady sliding, falls of the load, and the
// energy of random laws, paths and loads.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <random>

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

/// A contact of each model whose contacts are in lanes.
struct Kind {
  Material material;
  PatchOptions options;
};
std::vector<Kind> kinds() {
  const PatchOptions options = plain_options(9).with_max_normal_load(1.0);
  return {{materials()[0], options},
          {plain_material(SnapLength::lognormal(dbar, 0.4), SnapRule::redraw),
           PatchOptions(options).with_population(bristle::Population::infinite)}};
}

}  // namespace

TEST_CASE("a contact of a group is a patch of its key, which is stepped, read and reset by its id",
          "[lanes][group]") {
  const Kind kind = kinds()[GENERATE(0u, 1u)];
  PatchBatch groups, patches;
  const Material& material = kind.material;
  const PatchOptions options = PatchOptions(kind.options).with_seed(4).with_key(50);
  const bristle::PatchGroup group = groups.add_group(material, options, 37);
  const PatchId in_group = group[20];
  const PatchId alone = patches.add(material, PatchOptions(options).with_seed(24).with_key(70));
  Walk path(11);
  for (int k = 0; k < 60; ++k) {
    Motion motion = path.next(in_group);
    const Response got = step_one(groups, motion);
    motion.id = alone;
    const Response expected = step_one(patches, motion);
    expect(got.end[0] == expected.end[0] && got.dissipated == expected.dissipated, "the same step");
    expect(groups.state_hash(in_group) == patches.state_hash(alone), "the same state");
    expect(groups.stored_energy(in_group) == patches.stored_energy(alone), "the same energy");
    expect(groups.info(in_group).normal_load == patches.info(alone).normal_load, "the same load");
    if (k % 11 != 5) continue;
    groups.reset(in_group);
    patches.reset(alone);
  }
  CHECK(groups.info(in_group).key == 70);
}

TEST_CASE("groups are refused as a whole, and one contact of a group cannot be removed or changed",
          "[lanes][group][bad-input]") {
  PatchBatch batch;
  const Material material = materials()[0];
  const PatchOptions options = plain_options(4).with_max_normal_load(1.0);
  const PatchId alone = batch.add(material, options);
  const bristle::PatchGroup group = batch.add_group(material, options, 20);
  std::vector<double> x(20, 0.1 * dbar), load(20, 0.5), force(20), short_one(19);
  std::vector<Status> status(20);
  bristle::GroupStep good;
  good.group = group;
  good.displacement[0] = good.displacement[1] = x;
  good.normal_load = load;
  good.end[0] = force;
  good.status = status;
  CHECK(batch.step(tick, good).patches_stepped == 20);
  const std::uint64_t hash = batch.state_hash();
  const auto refused = [&](const bristle::GroupStep& step, Status why) {
    std::fill(status.begin(), status.end(), Status::ok);
    const bristle::StepReport report = batch.step(tick, step);
    CHECK(report.status == why);
    CHECK(report.patches_stepped == 0);
    CHECK(status[7] == why);
    CHECK(batch.find_force(tick, step).status == why);
    CHECK(batch.state_hash() == hash);
  };
  using Step = bristle::GroupStep;
  const auto refused_with = [&](const auto& shorten) {
    Step step = good;
    shorten(step);
    refused(step, Status::bad_input);
  };
  for (const int axis : {0, 1}) {
    refused_with([&](Step& s) { s.displacement[axis] = short_one; });
    refused_with([&](Step& s) { s.velocity[1 - axis] = x, s.velocity[axis] = short_one; });
    for (const auto column : {&Step::end, &Step::elastic, &Step::damper, &Step::mean})
      refused_with([&](Step& s) { (s.*column)[axis] = short_one; });
  }
  for (const auto column : {&Step::stiffness, &Step::damping, &Step::force_limit, &Step::dissipated,
                            &Step::contact_loss, &Step::damper_work})
    refused_with([&](Step& s) { s.*column = short_one; });
  std::vector<std::uint64_t> short_snaps(19);
  refused_with([&](Step& s) { s.normal_load = short_one; });
  refused_with([&](Step& s) { s.snaps = short_snaps; });
  Step step = good;
  step.displacement[1] = {};
  refused(step, Status::bad_input);
  step = good;
  step.velocity[0] = x;
  refused(step, Status::bad_input);
  step = good;
  const std::uint32_t beyond[] = {3, 20};
  step.which = beyond;
  refused(step, Status::bad_input);
  step = good;
  step.group.count = 21;
  refused(step, Status::unknown_id);
  step.group = {alone, 20};
  refused(step, Status::unknown_id);
  step.group = {group[1], 20};
  refused(step, Status::unknown_id);
  step.group = {};
  refused(step, Status::unknown_id);

  const std::uint32_t twice[] = {3, 5, 3};
  step = good;
  step.which = twice;
  const bristle::StepReport report = batch.step(tick, step);
  CHECK(report.status == Status::repeated_id);
  CHECK(report.patches_stepped == 2);

  CHECK_THROWS_AS(batch.remove(group[2]), bristle::Error);
  CHECK_THROWS_AS(batch.set_material(group[2], material), bristle::Error);
  for (const auto& part : {bristle::PatchGroup(group.first, 19), bristle::PatchGroup(group[1], 19),
                           bristle::PatchGroup(alone, 1)}) {
    CHECK_THROWS_AS(batch.remove(part), bristle::Error);
    CHECK_THROWS_AS(batch.set_material(part, material), bristle::Error);
  }
  CHECK_THROWS_AS(batch.add_group(material, options, 0), bristle::Error);
  CHECK_THROWS_AS(
      batch.set_material(group, plain_material(SnapLength::lognormal(dbar, 0.3), SnapRule::redraw)),
      bristle::Error);
  batch.remove(group);
  CHECK_THROWS_AS(batch.remove(group), bristle::Error);
  CHECK_THROWS_AS(batch.set_material(group, material), bristle::Error);
  CHECK(batch.patch_count() == 1);
  CHECK(batch.step(tick, good).status == Status::unknown_id);
}

TEST_CASE("a contact that moves along one axis alone is no resting one among those that rest",
          "[lanes][group]") {
  for (const int axis : {0, 1}) {
    PatchBatch batch;
    std::vector<double> moved[2] = {std::vector<double>(20, 0.0), std::vector<double>(20, 0.0)};
    std::vector<double> load(20, 0.5), force[2] = {std::vector<double>(20), std::vector<double>(20)};
    bristle::GroupStep step;
    step.group = batch.add_group(materials()[0], plain_options(4).with_max_normal_load(1.0), 20);
    step.normal_load = load;
    for (const int k : {0, 1}) step.displacement[k] = moved[k], step.end[k] = force[k];
    batch.step(tick, step);
    batch.step(tick, step);
    moved[axis][7] = 0.1 * dbar;
    batch.step(tick, step);
    CHECK(force[axis][7] < 0.0);
    CHECK(force[axis][8] == 0.0);
  }
}

TEST_CASE("slots of removed groups serve groups that come later, under ids of their own", "[lanes][group]") {
  PatchBatch batch;
  const Material material = materials()[0];
  const PatchOptions options = plain_options(4).with_max_normal_load(1.0);
  std::vector<bristle::PatchGroup> groups;
  std::vector<PatchId> gone;
  std::mt19937 random(5);
  std::uint64_t last_slot = 0;
  for (int k = 0; k < 400; ++k) {
    if (groups.size() < 4) {
      groups.push_back(batch.add_group(material, options, 1 + random() % 40));
      for (std::size_t i = 0; i < groups.back().size(); ++i)
        expect(std::find(gone.begin(), gone.end(), groups.back()[i]) == gone.end(), "no id is given twice");
      last_slot = std::max(last_slot, groups.back()[groups.back().size() - 1].value & 0xFFFFFFFFu);
    } else {
      const std::size_t at = random() % groups.size();
      for (std::size_t i = 0; i < groups[at].size(); ++i) gone.push_back(groups[at][i]);
      batch.remove(groups[at]);
      groups.erase(groups.begin() + static_cast<std::ptrdiff_t>(at));
    }
    std::size_t count = 0;
    for (const bristle::PatchGroup& group : groups) count += group.size();
    expect(batch.patch_count() == count, "the batch has the groups' patches");
  }
  CHECK(last_slot < 320);  // four groups of at most 40, with gaps between them
}

TEST_CASE("a contact keeps its bending under a new material", "[slide][lanes]") {
  const Kind kind = kinds()[GENERATE(0u, 1u)];
  PatchBatch batch;
  const PatchId id = batch.add(kind.material, kind.options);
  const double force = step_one(batch, Motion{id, {0.2 * dbar, 0.0}, 0.5}).end[0];
  CHECK(force == Approx(-0.1 * dbar).epsilon(1e-3));  // next to no bristle is shorter
  batch.set_material(id, Material(kind.material).with_bristle_stiffness(2.0));
  CHECK(step_one(batch, Motion{id, {0.0, 0.0}, 0.5}).end[0] == Approx(2.0 * force));
}

TEST_CASE("a lane that a removed contact leaves begins anew", "[slide][lanes]") {
  const Kind kind = kinds()[GENERATE(0u, 1u)];
  PatchBatch batch;
  const Material& material = kind.material;
  const PatchOptions& options = kind.options;
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

TEST_CASE("random laws, paths and loads balance their energy, and no force exceeds its limit",
          "[slide][lanes][energy]") {
  std::mt19937 random(8);
  for (int trial = 0; trial < 1500; ++trial) {
    const double cv = 0.05 + 0.01 * static_cast<double>(random() % 120);
    const SnapLength law = trial % 3 == 0   ? SnapLength::exponential(dbar)
                           : trial % 3 == 1 ? SnapLength::lognormal(dbar, cv)
                                            : SnapLength::uniform(0.1 * dbar, (1.0 + cv) * dbar);
    Material material = sliding(law);
    if (random() % 3 == 0) material.with_drop(trial % 2 == 0 ? 0.3 : 0.9);
    if (random() % 4 == 0)
      material.with_ageing(trial % 2 == 0 ? bristle::Ageing::saturating(0.4, 5.0 * tick)
                                          : bristle::Ageing::logarithmic(1.0, tick));
    const Precision precision = precisions()[random() % precisions().size()];
    PatchOptions options =
        plain_options(4 + static_cast<unsigned>(random() % 20), 2, precision).with_max_normal_load(1.0);
    if (random() % 4 == 0) {
      bristle::Lay lay;
      lay.angle = 0.4;
      lay.limit_ratio = 0.5;
      if (material.drop == 0.0 && material.ageing_strength == 0.0) lay.to_over_fro = 2.0;
      options.lay = lay;
    }
    OnePatch patch(material, options);
    Walk path(static_cast<unsigned>(random()));
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

TEST_CASE("roundings do not add up in steady sliding: a force in single precision stays within 1.5e-6",
          "[slide][lanes]") {
  if (!BRISTLE_WITH_DOUBLE) return;
  for (const Material& material : {sliding(SnapLength::single(dbar)), sliding(uniform),
                                   sliding(SnapLength::exponential(dbar)).with_drop(0.2)})
    for (const double h : {1e-4, 0.0123, 0.2, 1.1})
      for (const unsigned n : {8u, 300u}) {
        OnePatch patch(material, plain_options(n, 2, Precision::single));
        // The force of steady sliding: every spring at its limit, along the motion.
        OnePatch far(material, plain_options(n, 2, Precision::double_));
        const Response expected = far.step(950.0 * dbar, 300.0 * dbar, 1.0);
        Response r = patch.step(950.0 * dbar, 300.0 * dbar, 1.0);
        CAPTURE(to_string(material.snap_length.law()), h, n);
        for (int k = 0; k < 1000; ++k) {
          r = patch.step(0.95 * h * dbar, 0.3 * h * dbar, 1.0);
          for (int axis = 0; axis < 2; ++axis)
            expect_near(r.end[axis], expected.end[axis], 1.5e-6 * std::abs(expected.end[0]), "force");
        }
      }
}

TEST_CASE("a load that falls by 1e13 at once leaves what it can hold, at rest and in motion",
          "[slide][lanes][load]") {
  for (const Precision precision : precisions())
    for (const double distance : {0.0, 0.5}) {
      const double load = 1e3, less = 1e-10;
      OnePatch patch(sliding(SnapLength::lognormal(dbar, 0.3)),
                     plain_options(16, 2, precision).with_max_normal_load(load));
      patch.step(8.0 * dbar, 6.0 * dbar, load);
      const double stored = patch.energy();
      const Response fallen = patch.step(0.8 * distance * dbar, 0.6 * distance * dbar, less);
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
