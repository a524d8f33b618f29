// Contacts in lanes: what sixteen contacts of a block may not know of each other, slow and steady sliding,
// falls of the load, and the energy of random laws, paths and loads.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <optional>
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

namespace {

/// Arrays of a group, stepped beside patches that get the same motions one by one.
struct Pair {
  Pair(const Material& material, const PatchOptions& the_options, std::size_t n)
      : options(the_options), count(n), group(groups.add_group(material, options, n)) {
    for (std::size_t i = 0; i < n; ++i)
      ids.push_back(patches.add(material, PatchOptions(options)
                                              .with_seed(options.seed + static_cast<std::uint32_t>(i))
                                              .with_key(options.key + i)));
    for (std::vector<double>& column : columns) column.resize(n);
    snaps.resize(n);
    status.resize(n);
  }

  /// Steps contacts `which`, or all. Every number must be the same to the bit.
  void step(Walk& path, const std::optional<std::vector<std::uint32_t>>& which, bool trial,
            bool has_velocity) {
    std::vector<std::uint32_t> named = which.value_or(std::vector<std::uint32_t>{});
    for (std::uint32_t i = 0; !which && i < count; ++i) named.push_back(i);
    bristle::GroupStep step;
    step.group = group;
    if (which) step.which = *which;
    std::vector<Motion> motions;
    for (const std::uint32_t i : named) {
      Motion motion = path.next(ids[i], options.axes, 1.3);
      if (path.random() % 4 == 0)
        motion = {ids[i], {0.0, 0.0}, columns[2][i]};
      else if (path.random() % 50 == 0)
        motion.displacement[options.axes - 1] = std::numeric_limits<double>::quiet_NaN();
      else if (path.random() % 50 == 0)
        motion.displacement[1] = 0.1 * dbar;  // bad input with one axis
      motion.has_velocity = has_velocity;
      for (std::size_t axis = 0; axis < 2 && has_velocity; ++axis)
        motion.velocity[axis] = 900.0 * motion.displacement[axis];
      for (std::size_t axis = 0; axis < 2; ++axis) {
        columns[axis][i] = motion.displacement[axis];
        columns[3 + axis][i] = motion.velocity[axis];
      }
      columns[2][i] = motion.normal_load;
      motions.push_back(motion);
    }
    for (std::size_t axis = 0; axis < 2; ++axis) {
      step.displacement[axis] = columns[axis];
      if (has_velocity) step.velocity[axis] = columns[3 + axis];
      step.end[axis] = columns[5 + axis];
      step.elastic[axis] = columns[7 + axis];
      step.damper[axis] = columns[9 + axis];
      step.mean[axis] = columns[11 + axis];
    }
    step.normal_load = columns[2];
    step.stiffness = columns[13];
    step.damping = columns[14];
    step.force_limit = columns[15];
    step.dissipated = columns[16];
    step.contact_loss = columns[17];
    step.damper_work = columns[18];
    step.snaps = snaps;
    step.status = status;
    std::vector<Response> responses(motions.size());
    bristle::StepReport one, other;
    if (trial) {
      groups.find_force(tick, step);
      for (std::size_t k = 0; k < motions.size(); ++k) responses[k] = patches.find_force(tick, motions[k]);
    } else {
      one = groups.step(tick, step);
      other = patches.step(tick, motions, responses);
    }
    bool same = one.status == other.status && one.patches_stepped == other.patches_stepped &&
                one.bristles_visited == other.bristles_visited;
    for (std::size_t k = 0; k < named.size(); ++k) {
      const std::size_t i = named[k];
      const Response& r = responses[k];
      same = same && status[i] == r.status && columns[13][i] == r.stiffness && columns[14][i] == r.damping &&
             columns[15][i] == r.force_limit;
      for (std::size_t axis = 0; axis < 2; ++axis)
        same = same && columns[5 + axis][i] == r.end[axis] && columns[7 + axis][i] == r.elastic[axis] &&
               columns[9 + axis][i] == r.damper[axis] &&
               (options.outputs == Outputs::end || columns[11 + axis][i] == r.mean[axis]);
      if (options.outputs == Outputs::end) continue;
      same = same && columns[16][i] == r.dissipated && columns[17][i] == r.contact_loss &&
             columns[18][i] == r.damper_work && snaps[i] == r.snaps;
    }
    expect(same, "a group answers as its patches do");
  }
  void check_states() {
    for (std::size_t i = 0; i < count; ++i) {
      expect(groups.state_hash(group[i]) == patches.state_hash(ids[i]), "states are equal");
      expect(groups.stored_energy(group[i]) == patches.stored_energy(ids[i]), "energies are equal");
      expect(groups.info(group[i]).normal_load == patches.info(ids[i]).normal_load, "loads are equal");
      expect(groups.info(group[i]).key == patches.info(ids[i]).key, "keys are equal");
    }
  }

  PatchOptions options;
  std::size_t count;
  PatchBatch groups, patches;
  bristle::PatchGroup group;
  std::vector<PatchId> ids;
  std::vector<double> columns[19];
  std::vector<std::uint64_t> snaps;
  std::vector<Status> status;
};

}  // namespace

TEST_CASE("a group has, to the bit, the answers and states of patches added one by one", "[lanes][group]") {
  const Material damped = sliding(SnapLength::lognormal(dbar, 0.3))
                              .with_bristle_damping(0.01)
                              .with_viscous_friction(0.2)
                              .with_speed_strengthening(0.02, 1e-4);
  std::vector<Material> all = materials();
  all.push_back(damped);
  all.push_back(plain_material(SnapLength::lognormal(dbar, 0.3), SnapRule::redraw));
  for (const Material& material : all)
    for (const Outputs outputs : {Outputs::end, Outputs::all})
      for (const int axes : {1, 2}) {
        CAPTURE(static_cast<int>(material.snap_rule), material.drop, material.ageing_strength, axes);
        PatchOptions options = plain_options(9, axes, Precision::single, outputs).with_max_normal_load(1.0);
        if (axes == 2 && material == damped) options.lay.limit_ratio = 0.5;
        Pair pair(material, options, 37);
        Walk path(11);
        for (int k = 0; k < 60; ++k) {
          std::optional<std::vector<std::uint32_t>> which;
          if (k % 3 == 1) which.emplace();
          for (std::uint32_t i = 0; which && k > 1 && i < 37; ++i)
            if (path.random() % 3 == 0) which->push_back(36 - i);
          pair.step(path, which, k % 7 == 3, k % 5 == 2);
          if (k % 11 == 5) {
            pair.groups.reset(pair.group[3]);
            pair.patches.reset(pair.ids[3]);
          }
          if (k % 9 == 4) {  // moves single contacts of the group by Motion, too
            Motion motion = path.next(pair.group[20], axes);
            const Response one = step_one(pair.groups, motion);
            motion.id = pair.ids[20];
            expect(one.end[0] == step_one(pair.patches, motion).end[0], "a contact is a patch");
          }
          if (k == 30) {
            const Material next = Material(material).with_bristle_stiffness(0.7 * material.bristle_stiffness);
            pair.groups.set_material(pair.group, next);
            for (const PatchId id : pair.ids) pair.patches.set_material(id, next);
          }
          if (k == 45) {
            const std::vector<std::byte> saved = saved_state(pair.groups);
            pair.step(path, std::nullopt, false, false);
            pair.groups.restore_state(saved);
            for (std::size_t i = 0; i < pair.count; ++i) pair.patches.reset(pair.ids[i]);
            for (std::size_t i = 0; i < pair.count; ++i) pair.groups.reset(pair.group[i]);
          }
          if (k % 6 == 0) pair.check_states();
        }
        pair.check_states();
      }
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
  bristle::GroupStep step = good;
  step.normal_load = short_one;
  refused(step, Status::bad_input);
  step = good;
  step.end[1] = short_one;
  refused(step, Status::bad_input);
  step = good;
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
  CHECK_THROWS_AS(batch.remove(bristle::PatchGroup(group.first, 19)), bristle::Error);
  CHECK_THROWS_AS(batch.remove(bristle::PatchGroup(group[1], 19)), bristle::Error);
  CHECK_THROWS_AS(batch.remove(bristle::PatchGroup(alone, 1)), bristle::Error);
  CHECK_THROWS_AS(batch.add_group(material, options, 0), bristle::Error);
  CHECK_THROWS_AS(
      batch.set_material(group, plain_material(SnapLength::lognormal(dbar, 0.3), SnapRule::redraw)),
      bristle::Error);
  batch.remove(group);
  CHECK_THROWS_AS(batch.remove(group), bristle::Error);
  CHECK(batch.patch_count() == 1);
  CHECK(batch.step(tick, good).status == Status::unknown_id);
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

TEST_CASE("a contact keeps its force under a new material, and leaves none to the next in its lane",
          "[slide][lanes]") {
  PatchBatch batch;
  const PatchOptions options = plain_options(8).with_max_normal_load(1.0);
  PatchId id = batch.add(materials()[0], options);
  const double force = step_one(batch, Motion{id, {0.2 * dbar, 0.0}, 0.5}).end[0];
  CHECK(force == Approx(-0.1 * dbar));
  batch.set_material(id, Material(materials()[0]).with_bristle_stiffness(2.0));
  CHECK(step_one(batch, Motion{id, {0.0, 0.0}, 0.5}).end[0] == Approx(2.0 * force));
  batch.remove(id);
  CHECK(step_one(batch, Motion{id, {0.0, 0.0}, 0.5}).status == Status::unknown_id);
  id = batch.add(materials()[0], options);
  CHECK(step_one(batch, Motion{id, {0.0, 0.0}, 0.5}).end[0] == 0.0);
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
