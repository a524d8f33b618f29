// Change of detail: a patch continues with fewer or more representatives under an unchanged force.
// LoadShedder decides when, to keep steps within a time budget.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "expect.hpp"
#include "scenes.hpp"
#include "variants.hpp"

namespace bristle_test::test_overload {

using bristle::LoadShedder;
using bristle::LoadShedderOptions;
using bristle::ShedReport;
using bristle::StepReport;

namespace {

/// Returns the largest excess of a bristle's deflection |z| over its snap length delta, in mean snap lengths.
double farthest_beyond(const OnePatch& patch, std::size_t count) {
  const Bristles b = read(patch, count);
  double most = -1e9;
  for (std::size_t i = 0; i < b.zx.size(); ++i)
    most = std::max(most, std::hypot(b.zx[i], b.zy[i]) - b.delta[i]);
  return most / dbar;
}

}  // namespace

TEST_CASE("A change of detail changes no force and snaps nothing, at rest and in sliding", "[overload]") {
  constexpr std::uint32_t n = 1100;  // number of bristles: four blocks of 256 and a tail
  for (Precision precision : precisions()) {
    for (const NamedLaw& law : reference_laws()) {
      for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
        for (int axes : {1, 2}) {
          INFO(name_of(precision) << ", " << law.name << ", " << table_name(rule) << ", axes " << axes);
          OnePatch patch(plain_material(law.law, rule), plain_options(n, axes, precision));
          std::mt19937_64 random(7);
          std::uniform_real_distribution<double> flat(0.0, 1.0);
          const double digits = precision == Precision::double_ ? 1e-12 : 2e-6;
          for (int k = 0; k < 60; ++k) {
            // Steps of slides, turns and reversals, under loads that give whole and fractional numbers of
            // bristles, up to overload.
            const double angle = axes == 1 ? (k / 7 % 2 ? M_PI : 0.0) : 0.3 * k;
            const double load = k % 5 == 0 ? n : k % 7 == 0 ? 1.6 * n : n * (0.3 + 0.69 * flat(random));
            const double way = dbar * (k % 3 == 0 ? 3.7 : 0.2) * flat(random);
            Response before;
            for (int j = 0; j < 3; ++j)
              before = patch.step(way * std::cos(angle), axes == 1 ? 0.0 : way * std::sin(angle), load);
            const double stored = patch.energy();
            const auto detail = static_cast<std::uint32_t>(n * std::pow(16.0, -flat(random)));
            REQUIRE(patch.batch.set_detail(patch.id, detail) == Status::ok);
            const double stored_then = patch.energy();
            const Response after = patch.step(0.0, 0.0, load);
            for (int axis = 0; axis < 2; ++axis) {
              expect_near(after.elastic[axis], before.elastic[axis], digits * load * dbar, "the force");
              expect_near(after.mean[axis], before.elastic[axis], digits * load * dbar, "the mean force");
            }
            expect(after.snaps == 0 && after.dissipated == 0.0, "nothing snaps");
            expect_near(after.stiffness, before.stiffness, 0.0, "the stiffness");
            expect_near(stored - stored_then, after.contact_loss, 1e-13 * stored, "the energy booked");
            expect(farthest_beyond(patch, detail) <= 0.0, "every bristle is within its snap length");
            const bristle::PatchInfo info = patch.batch.info(patch.id);
            expect(info.detail == detail && info.representatives == n, "the numbers reported");
            expect_near(info.weight * detail, n, 1e-9, "the bristles that representatives stand for");
            expect_near(info.active, std::min(load, double(n)) / n * detail, 1e-9, "the active count");
          }
        }
      }
    }
  }
}

TEST_CASE("The force is that of the bristles that stay, by an independent sum", "[overload]") {
  for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
    OnePatch patch(plain_material(SnapLength::lognormal(dbar, 0.3), rule), plain_options(700));
    for (int k = 0; k < 9; ++k) patch.step(0.7 * dbar, 0.1 * dbar, 600.0);
    for (std::uint32_t detail : {300u, 90u, 640u, 700u, 256u, 512u}) {
      patch.batch.set_detail(patch.id, detail);
      const Response r = patch.step(0.05 * dbar, 0.0, 600.0);
      const Bristles b = read(patch, 700);
      const double active = 600.0 / 700.0 * detail, whole = std::floor(active);
      double sum = 0.0;
      for (std::size_t i = 0; i < 700; ++i)
        sum += b.zx[i] * std::clamp(active - static_cast<double>(i), 0.0, 1.0);
      INFO(detail << " representatives, " << whole << " whole");
      CHECK(r.elastic[0] == Approx(-sum * 700.0 / detail).epsilon(2e-6));
    }
  }
}

TEST_CASE("The energy balance closes across changes of detail", "[overload][energy]") {
  for (Precision precision : precisions()) {
    for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
      OnePatch patch(plain_material(SnapLength::uniform(0.5 * dbar, 1.5 * dbar), rule),
                     plain_options(530, 2, precision));
      std::mt19937_64 random(3);
      for (int k = 0; k < 300; ++k) {
        const double before = patch.energy();
        patch.batch.set_detail(patch.id, 30 + static_cast<std::uint32_t>(random() % 501));
        const double dx = dbar * 0.3 * (k % 40 < 25 ? 1.0 : -1.0), dy = dbar * 0.1 * std::sin(0.1 * k);
        const Response r = patch.step(dx, dy, k % 9 ? 480.0 : 510.0);
        const double work = -r.mean[0] * dx - r.mean[1] * dy;
        const double after = patch.energy();
        const double involved = before + after + r.dissipated + std::abs(r.contact_loss) + std::abs(work);
        expect_near(work - (after - before) - r.dissipated - r.contact_loss, 0.0,
                    (precision == Precision::double_ ? 1e-11 : 2e-6) * involved, "the balance");
      }
    }
  }
}

TEST_CASE(
    "After a change of detail in sliding the force stays at its kinetic mean and fluctuates as it should",
    "[overload]") {
  const auto patches = static_cast<int>(test_size(400));
  constexpr std::uint32_t n = 400, few = 100;
  for (const NamedLaw& law : reference_laws()) {
    if (law.law.cv() == 0.0) continue;  // skips equal lengths, which stay in phase for ever
    for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
      const Material material = plain_material(law.law, rule);
      const double m1 = law.law.moment(1), m2 = law.law.moment(2);
      const double kinetic = n * (rule == SnapRule::keep ? m1 / 2.0 : m2 / (2.0 * m1));
      for (bool back : {false, true}) {
        INFO(law.name << ", " << table_name(rule) << (back ? ", taken back" : ", shed"));
        PatchBatch batch;
        const std::vector<PatchId> ids =
            add_patches(batch, patches, material, plain_options(n, 1, Precision::single, Outputs::end));
        std::vector<Response> responses(ids.size());
        const auto detail = [&](std::uint32_t bristles) {
          for (PatchId id : ids) batch.set_detail(id, bristles);
        };
        if (back) detail(few);
        // Slides long enough for bristles of SnapRule::keep to get out of phase. The last step differs
        // between patches, so their forces are independent.
        std::vector<Motion> motions = same_motion(ids, 0.0, 0.0, n);
        for (int k = 0; k < 40; ++k) {
          for (std::size_t i = 0; i < ids.size(); ++i)
            motions[i].displacement[0] =
                dbar * (0.9 + (k == 39 ? static_cast<double>(i) / static_cast<double>(ids.size()) : 0.0));
          batch.step(tick, motions, responses);
        }
        detail(back ? n : few);
        double squares = 0.0;
        const double noise = bristle::sliding_noise(material, few);
        for (int k = 1; k <= 30; ++k) {
          batch.step(tick, same_motion(ids, 0.1 * dbar, 0.0, n), responses);
          double sum = 0.0;
          for (const Response& r : responses) {
            const double off = -r.elastic[0] / kinetic - 1.0;
            sum += off;
            if (k > 24) squares += off * off;
          }
          // Tolerance: five standard deviations of the mean force over all patches.
          expect_near(sum / patches, 0.0, 5.0 * noise / std::sqrt(patches),
                      "the mean force over the kinetic");
        }
        const double seen = std::sqrt(squares / (6.0 * patches));
        // With keep the force fluctuates less than of independent bristles, as lengths are stratified.
        CHECK(seen < 1.25 * noise);
        if (rule == SnapRule::redraw && !back) CHECK(seen > 0.8 * noise);
        if (rule == SnapRule::redraw && back && law.law.cv() < 0.5)
          CHECK(seen < 0.65 * noise);  // half the noise, as all n bristles are in use again
      }
    }
  }
}

TEST_CASE("Copies go ways of their own once they have snapped", "[overload]") {
  constexpr std::uint32_t n = 4000;
  for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
    OnePatch patch(plain_material(SnapLength::lognormal(dbar, 0.3), rule), plain_options(n, 1));
    for (int k = 0; k < 30; ++k) patch.step(0.9 * dbar, 0.0, n);
    patch.batch.set_detail(patch.id, n / 2);
    patch.batch.set_detail(patch.id, n);
    // When all bristles are in use again, half of them are copies of others. Returns the correlation of
    // bristles with those half of the population away, or one less.
    const auto correlation_at = [&](std::size_t apart) {
      const Bristles b = read(patch, n);
      double xy = 0.0, xx = 0.0, mean = 0.0;
      for (double z : b.zx) mean += z / n;
      for (std::size_t i = 1; i < n / 2; ++i) xy += (b.zx[i] - mean) * (b.zx[i + apart] - mean);
      for (double z : b.zx) xx += 0.5 * (z - mean) * (z - mean);
      return xy / xx;
    };
    const auto correlation = [&] { return std::max(correlation_at(n / 2), correlation_at(n / 2 - 1)); };
    INFO(table_name(rule));
    CHECK(correlation() > 0.5);  // just after the restoration bristles equal their copies

    // Slides on: with SnapRule::keep a bristle and its copy separate because their snap lengths differ.
    for (int k = 0; k < (rule == SnapRule::keep ? 200 : 40); ++k) patch.step(0.5 * dbar, 0.0, n);
    CHECK(std::abs(correlation()) < 0.1);
  }
}

TEST_CASE("Changes of detail give the same bits everywhere", "[overload][determinism]") {
  // The cases include infinite brushes with few pieces and cohorts, which have no bristles to
  // shed.
  const std::vector<PatchCase> cases = every_variant_and_few_infinite(test_size(400), 7);
  struct Outcome {
    std::vector<Response> responses;
    std::vector<std::uint64_t> hashes;
  };
  const auto run = [&](const BatchOptions& options) {
    PatchBatch batch(options);
    std::vector<PatchId> ids;
    for (const PatchCase& c : cases) ids.push_back(batch.add(c.material, c.options));
    batch.warm_up();
    Outcome outcome;
    std::vector<Motion> motions(cases.size());
    std::vector<Response> responses(cases.size());
    for (int k = 0; k < 40; ++k) {
      for (std::size_t i = 0; i < cases.size(); ++i) {
        if (k == 25) batch.set_material(ids[i], cases[i].later);
        motions[i] = scripted_motion(i, k, cases[i].options.axes);
        motions[i].id = ids[i];
        const std::uint32_t n = batch.info(ids[i]).representatives;
        if ((static_cast<std::size_t>(k) + i) % 3 == 0)
          batch.set_detail(ids[i], 1 + static_cast<std::uint32_t>(
                                           (static_cast<std::uint64_t>(k) * 7919 + i * 104729) % n));
      }
      batch.step(tick, motions, responses);
      outcome.responses.insert(outcome.responses.end(), responses.begin(), responses.end());
    }
    for (PatchId id : ids) outcome.hashes.push_back(batch.state_hash(id));
    return outcome;
  };
  const auto compare = [&](const Outcome& a, const Outcome& b, const char* what) {
    int wrong = 0;
    for (std::size_t i = 0; i < a.responses.size() && wrong < 3; ++i) {
      const std::string field = first_difference(a.responses[i], b.responses[i]);
      if (field.empty()) continue;
      ++wrong;
      FAIL_CHECK(what << ": " << cases[i % cases.size()].name << ": " << field << " differs in step "
                      << i / cases.size());
    }
    INFO(what);
    CHECK(a.hashes == b.hashes);
  };
  const Outcome expected = run(BatchOptions{}.with_isa("scalar"));
  bool eager = true;
  for (const bristle::IsaInfo& isa : bristle::instruction_sets())
    if (isa.usable && (std::string(isa.name) != "scalar" || is_scalar(PatchBatch()))) {
      compare(expected,
              run(stepped_eagerly(BatchOptions{}.with_isa(isa.name).with_threads(eager ? 3 : 1), eager)),
              isa.name);
      eager = !eager;
    }
}

TEST_CASE("Saving, restoring and new materials keep the detail", "[overload]") {
  const Material material = plain_material(SnapLength::lognormal(dbar, 0.3), SnapRule::redraw);
  OnePatch a(material, plain_options(900));
  OnePatch b(material, plain_options(900));
  const std::uint64_t fresh = a.hash();
  for (int k = 0; k < 5; ++k) a.step(0.6 * dbar, 0.2 * dbar, 800.0);
  a.batch.set_detail(a.id, 170);
  b.batch.restore_state(saved_state(a.batch));
  CHECK(b.batch.info(b.id).detail == 170);
  CHECK(b.hash() == a.hash());
  for (int k = 0; k < 5; ++k) {
    if (k == 2)
      for (OnePatch* p : {&a, &b})
        p->batch.set_material(p->id, Material(material).with_bristle_stiffness(2.0));
    if (k == 3)
      for (OnePatch* p : {&a, &b}) p->batch.set_detail(p->id, 500);
    CHECK(first_difference(a.step(0.4 * dbar, 0.0, 850.0), b.step(0.4 * dbar, 0.0, 850.0)).empty());
    CHECK(a.batch.info(a.id).detail == (k < 3 ? 170u : 500u));
  }
  CHECK(a.hash() == b.hash());
  // Checks that find_force() and step() compute alike from the reduced patch.
  Motion motion;
  motion.id = a.id;
  motion.normal_load = 300.0;
  const Response trial = a.batch.find_force(tick, motion);
  const Response real = a.step(motion);
  CHECK(trial.elastic[0] == real.elastic[0]);
  // With all n bristles restored the weight of each is the original one to the bit.
  a.batch.set_detail(a.id, 900);
  CHECK(a.batch.info(a.id).weight == 1.0);
  CHECK(fresh != a.hash());
}

TEST_CASE("A detail that cannot be is refused and changes nothing", "[overload]") {
  OnePatch patch(plain_material(SnapLength::lognormal(dbar, 0.3), SnapRule::keep), plain_options(300));
  patch.step(0.3 * dbar, 0.0, 250.0);
  const std::uint64_t hash = patch.hash();
  CHECK(patch.batch.set_detail(patch.id, 0) == Status::bad_input);
  CHECK(patch.batch.set_detail(patch.id, 301) == Status::bad_input);
  CHECK(patch.batch.set_detail(PatchId{}, 10) == Status::unknown_id);
  CHECK(patch.batch.set_detail(patch.id, 300) == Status::ok);  // setting the present number changes nothing
  CHECK(patch.hash() == hash);
}

TEST_CASE("A patch that hardly touches changes its detail too", "[overload]") {
  OnePatch patch(plain_material(SnapLength::lognormal(dbar, 0.3), SnapRule::redraw), plain_options(600));
  // Puts the patch under a load below one bristle, so that fewer and heavier bristles leave none in contact.
  patch.step(0.1 * dbar, 0.0, 1e-28);
  for (std::uint32_t detail : {1u, 600u, 2u}) {
    REQUIRE(patch.batch.set_detail(patch.id, detail) == Status::ok);
    CHECK(std::abs(patch.step(0.1 * dbar, 0.0, 1e-28).elastic[0]) < 1e-30);
  }
  patch.batch.set_detail(patch.id, 600);
  CHECK(patch.step(0.1 * dbar, 0.0, 600.0).elastic[0] == Approx(-60.0 * dbar));
}

TEST_CASE("Too few bristles to hold the force hold what they can", "[overload]") {
  // Loads the patch for the first time, by a mean length. The few bristles that take over the force may be
  // too short to hold it.
  const Material material = plain_material(SnapLength::exponential(dbar), SnapRule::keep);
  OnePatch patch(material, plain_options(500));
  for (int k = 0; k < 10; ++k) patch.step(0.1 * dbar, 0.0, 500.0);
  const double before = patch.step(0.0, 0.0, 500.0).elastic[0];
  for (std::uint32_t detail : {1u, 2u, 3u, 7u}) {
    patch.batch.set_detail(patch.id, detail);
    const Response r = patch.step(0.0, 0.0, 500.0);
    CHECK(r.snaps == 0);
    CHECK(farthest_beyond(patch, detail) <= 0.0);
    CHECK(r.elastic[0] <= 0.0);
    CHECK(r.elastic[0] >= before * (1.0 + 1e-6));
  }
}

namespace {

/// Patches that slide, a shedder, and a simulated clock for the time of each step.
class Loop {
 public:
  Loop(const std::vector<std::uint32_t>& bristles, const std::vector<int>& priorities,
       const LoadShedderOptions& options, std::uint32_t least = 50, const BatchOptions& batch_options = {})
      : batch(batch_options), shedder(options) {
    const Material material = plain_material(SnapLength::lognormal(dbar, 0.3), SnapRule::keep);
    for (std::size_t i = 0; i < bristles.size(); ++i) {
      ids.push_back(batch.add(material, plain_options(bristles[i], 1, Precision::single, Outputs::end)));
      shedder.add(ids.back(), priorities[i], least);
    }
    for (PatchId id : ids)
      motions.push_back(same_motion({id}, 0.3 * dbar, 0.0, batch.info(id).representatives)[0]);
    responses.resize(ids.size());
    batch.warm_up();
  }

  /// Takes a tick. `time_of` is a function from the number of bristles in contact, in patches that move, to
  /// the simulated time of the step, s. Returns that time.
  template <class Time>
  double tick_once(const Time& time_of) {
    if (foresees) changes += shedder.before_step(batch, motions);
    const StepReport report = batch.step(tick, motions, responses);
    double bristles = 0.0;
    for (std::size_t i = 0; i < ids.size(); ++i)
      if (motions[i].displacement[0] != 0.0) bristles += batch.info(ids[i]).active;
    const double time = time_of(bristles);
    changes += shedder.after_step(batch, motions, time, report);
    return time;
  }
  std::uint32_t detail(std::size_t i) const { return batch.info(ids[i]).detail; }

  PatchBatch batch;
  LoadShedder shedder;
  std::vector<PatchId> ids;
  std::vector<Motion> motions;
  std::vector<Response> responses;
  bool foresees = false;
  int changes = 0;
};

const auto one_nanosecond_each = [](double bristles) { return 1e-7 + 1e-9 * bristles; };

}  // namespace

TEST_CASE("Work of four times the budget is shed within three steps, and never missed again",
          "[overload][shedder]") {
  // 4000 bristles take 4.1 us at 1 ns each, but the shedder's budget is 1 us, so it has to shed bristles.
  Loop loop({1000, 1000, 1000, 1000}, {0, 1, 1, 2}, LoadShedderOptions{}.with_budget(1e-6));
  int misses = 0, last_miss = -1;
  for (int k = 0; k < 5000; ++k)
    if (loop.tick_once(one_nanosecond_each) > 1e-6) ++misses, last_miss = k;
  CHECK(misses >= 1);  // late first step: the time per bristle is unknown
  CHECK(last_miss <= 2);
  // The shedder reduces the patch of lowest priority first, down to its least number. Patches of equal
  // priority are reduced equally, the one of highest priority as little as possible.
  CHECK(loop.detail(0) == 50);
  CHECK(loop.detail(1) == loop.detail(2));
  CHECK(loop.detail(1) == 50);
  CHECK(loop.detail(3) > 400);
  const ShedReport report = loop.shedder.report(loop.batch);
  CHECK(report.patches == 4);
  CHECK(report.bristles == 4000 - 50 - 50 - 50 - loop.detail(3));
  CHECK(report.least_share == Approx(0.05));
  CHECK(report.noise_growth == Approx(std::sqrt(20.0)));
  CHECK(report.late_steps == static_cast<std::uint64_t>(misses));
  CHECK(report.decisions == static_cast<std::uint64_t>(loop.changes));
}

TEST_CASE("What was shed comes back when there is room, highest priority first, and then all is quiet",
          "[overload][shedder]") {
  Loop loop({1000, 1000}, {5, 1}, LoadShedderOptions{}.with_budget(3.2e-6).with_wait_steps(20));
  double scale = 2.0;  // factor of the simulated time of a step
  const auto time = [&](double bristles) { return scale * one_nanosecond_each(bristles); };
  for (int k = 0; k < 3000; ++k) loop.tick_once(time);
  CHECK(loop.detail(0) == 1000);
  CHECK(loop.detail(1) < 400);
  const int before = loop.changes;
  for (int k = 0; k < 3000; ++k) loop.tick_once(time);
  CHECK(loop.changes == before);  // no more changes of detail under a constant load
  scale = 1.0;
  int misses = 0;
  std::uint32_t last = loop.detail(1);
  for (int k = 0; k < 6000; ++k) {
    misses += loop.tick_once(time) > 3.2e-6;
    expect(loop.detail(1) >= last, "it only grows");
    last = loop.detail(1);
  }
  CHECK(misses == 0);
  CHECK(loop.detail(1) == 1000);
  const int quiet = loop.changes;
  for (int k = 0; k < 1000; ++k) loop.tick_once(time);
  CHECK(loop.changes == quiet);
  CHECK(loop.shedder.report(loop.batch).patches == 0);
}

TEST_CASE("No swinging where bristles cost more than they seemed to", "[overload][shedder]") {
  // Simulates a cache of 1500 bristles: beyond that number each takes three times as long.
  Loop loop({4000}, {0}, LoadShedderOptions{}.with_budget(2e-6).with_wait_steps(10));
  const auto cliff = [](double bristles) { return 1e-9 * (bristles < 1500.0 ? 0.5 : 1.5) * bristles; };
  std::vector<int> misses(5, 0);
  for (int k = 0; k < 20000; ++k) misses[static_cast<std::size_t>(k / 4000)] += loop.tick_once(cliff) > 2e-6;
  // Checks that a restoration that makes steps late doubles the wait before the next one.
  CHECK(misses[1] <= 10);
  CHECK(misses[4] <= 6);
  CHECK(loop.detail(0) >= 700);
}

TEST_CASE("A step that was disturbed once sheds half at most, or nothing if the caller has patience",
          "[overload][shedder]") {
  for (int disturbed : {0, 50}) {
    for (int patience : {1, 2}) {
      Loop loop({20000}, {0}, LoadShedderOptions{}.with_budget(40e-6).with_late_steps(patience));
      loop.foresees = true;
      for (int k = 0; k < 200; ++k)
        loop.tick_once([&](double b) { return (k == disturbed ? 40.0 : 1.0) * one_nanosecond_each(b); });
      INFO("step " << disturbed << ", patience " << patience);
      CHECK(loop.detail(0) >= (patience == 1 ? 9800u : 20000u));
      for (int k = 0; k < 2000; ++k) loop.tick_once(one_nanosecond_each);
      CHECK(loop.detail(0) == 20000);
    }
  }
}

TEST_CASE("A mistaken gift doubles the wait once, and sixteen waits without one halve it",
          "[overload][shedder]") {
  Loop loop({100000}, {0}, LoadShedderOptions{}.with_budget(40e-6).with_wait_steps(20));
  double scale = 1.0;
  const auto time = [&](double b) { return scale * one_nanosecond_each(b); };
  /// Returns the number of steps between the last two decisions, of which the last gives bristles back.
  const auto wait_for_gift = [&] {
    const std::uint32_t before = loop.detail(0);
    for (int k = 0; k < 1000 && loop.detail(0) == before; ++k) loop.tick_once(time);
    const auto decisions = loop.shedder.decisions();
    REQUIRE(loop.detail(0) > before);
    REQUIRE(decisions.size() >= 2);
    return decisions[decisions.size() - 1].step - decisions[decisions.size() - 2].step;
  };
  for (int k = 0; k < 50; ++k) loop.tick_once(time);  // the shedder leaves as many bristles as fit
  scale = 0.25;
  CHECK(wait_for_gift() <= 50);
  // Makes three steps late, each followed by a fast one so that the shedder's time per bristle does not rise.
  for (int k = 0; k < 3; ++k) {
    scale = 4.0;
    loop.tick_once(time);
    scale = 0.25;
    loop.tick_once(time);
  }
  for (int gift = 0; gift < 15; ++gift) CHECK(wait_for_gift() == 40);
  for (int gift = 0; gift < 4; ++gift) wait_for_gift();
  CHECK(wait_for_gift() == 20);
}

TEST_CASE("A new material is foreseen by the load on its own bristles", "[overload][shedder]") {
  Loop loop({3000, 1000}, {0, 1}, LoadShedderOptions{}.with_budget(2e-6));
  loop.foresees = true;
  // With this material, a tenth as stiff normally, a tenth of the load brings all bristles into contact.
  const Material usual = plain_material(SnapLength::lognormal(dbar, 0.3), SnapRule::keep);
  const double load = loop.motions[0].normal_load;
  CHECK(loop.batch.info(loop.ids[0]).max_normal_load == Approx(load));
  loop.batch.set_material(loop.ids[0], Material(usual).with_normal_stiffness(0.1 * usual.normal_stiffness));
  CHECK(loop.batch.info(loop.ids[0]).max_normal_load == Approx(0.1 * load));
  loop.motions[0].normal_load = 0.0;
  int misses = 0;
  for (int k = 0; k < 400; ++k) {
    if (k == 200) loop.motions[0].normal_load = 0.1 * load;
    misses += loop.tick_once(one_nanosecond_each) > 2e-6;
  }
  CHECK(loop.batch.info(loop.ids[0]).active == Approx(loop.detail(0)));
  CHECK(misses == 0);
  CHECK(loop.detail(0) < 1000);
}

TEST_CASE("With a known time per bristle the first step that would be late is foreseen",
          "[overload][shedder]") {
  Loop loop({3000, 1000}, {0, 1}, LoadShedderOptions{}.with_budget(2e-6));
  loop.foresees = true;
  const double load = loop.motions[0].normal_load;
  loop.motions[0].normal_load = 0.0;
  int misses = 0;
  for (int k = 0; k < 600; ++k) {
    if (k == 200) loop.motions[0].normal_load = load;  // brings the heavy patch into contact
    misses += loop.tick_once(one_nanosecond_each) > 2e-6;
  }
  CHECK(misses == 0);
  CHECK(loop.detail(0) < 1000);
  CHECK(loop.detail(1) == 1000);
}

TEST_CASE("Patches at rest are not shed for those that slide", "[overload][shedder]") {
  Loop loop({1000, 1000}, {0, 1}, LoadShedderOptions{}.with_budget(0.6e-6));
  loop.tick_once([](double) { return 1e-8; });
  loop.motions[0].displacement[0] = 0.0;
  for (int k = 0; k < 50; ++k) loop.tick_once(one_nanosecond_each);
  CHECK(loop.detail(0) == 1000);
  CHECK(loop.detail(1) < 600);
}

TEST_CASE("A replay of the decisions gives the same bits, whatever the clock says", "[overload][shedder]") {
  std::mt19937_64 random(11);
  Loop loop({1000, 700, 3000}, {0, 1, 0}, LoadShedderOptions{}.with_budget(2e-6).with_wait_steps(5));
  loop.foresees = true;
  const auto script = [](std::vector<Motion>& motions, int k) {
    for (std::size_t i = 0; i < motions.size(); ++i) {
      motions[i].displacement[0] = dbar * ((k / 100 + static_cast<int>(i)) % 3 - 0.7) * 0.3;
      motions[i].normal_load = 300.0 + 300.0 * ((k / 70 + static_cast<int>(i)) % 2);
    }
  };
  std::uniform_real_distribution<double> flat(0.5, 2.0);
  for (int k = 0; k < 1000; ++k) {
    script(loop.motions, k);
    loop.tick_once([&](double b) { return flat(random) * one_nanosecond_each(b); });
  }
  const auto decisions = loop.shedder.decisions();
  REQUIRE(decisions.size() > 20);
  REQUIRE(decisions.size() == loop.shedder.report(loop.batch).decisions);
  for (const BatchOptions& options :
       {BatchOptions{}, BatchOptions{}.with_isa("scalar"), BatchOptions{}.with_threads(2)}) {
    Loop replay({1000, 700, 3000}, {0, 1, 0}, LoadShedderOptions{}, 50, options);
    std::size_t next = 0;
    for (int k = 0; k < 1000; ++k) {
      script(replay.motions, k);
      next += bristle::apply_decisions(replay.batch, {decisions.data() + next, decisions.size() - next},
                                       static_cast<std::uint64_t>(k));
      replay.batch.step(tick, replay.motions, replay.responses);
    }
    // Applies the recorded decisions of a load shedder that follow the last step.
    next += bristle::apply_decisions(replay.batch, {decisions.data() + next, decisions.size() - next}, 1000);
    CHECK(next == decisions.size());
    CHECK(replay.batch.state_hash() == loop.batch.state_hash());
  }
}

namespace {

/// A loop of an infinite brush that moves and a shedder, which is told that each step takes `time_s`.
struct InfiniteLoop {
  InfiniteLoop(double resolution, std::uint32_t least, double time)
      : time_s(time), shedder(LoadShedderOptions{}.with_budget(1e-3).with_wait_steps(2)) {
    PatchOptions options = plain_options(0, 1);
    options.population = bristle::Population::infinite;
    options.resolution = resolution;
    options.max_normal_load = 1.0;
    id = batch.add(plain_material(SnapLength::lognormal(dbar, 0.3), SnapRule::redraw), options);
    shedder.add(id, 0, least);
    motion = same_motion({id}, 0.3 * dbar, 0.0, 0.5)[0];
  }
  int tick_once() {
    Response response;
    if (++steps % 3 == 0)
      // Reverses in each step, because an infinite brush that slides steadily would visit no pieces.
      motion.displacement[0] = -motion.displacement[0];
    const StepReport report = batch.step(tick, {&motion, 1}, {&response, 1});
    return shedder.after_step(batch, {&motion, 1}, time_s, report);
  }
  std::uint32_t pieces() const { return batch.info(id).detail; }
  ShedReport report() const { return shedder.report(batch); }

  double time_s;
  int steps = 0;
  PatchBatch batch;
  LoadShedder shedder;
  PatchId id;
  Motion motion;
};

}  // namespace

TEST_CASE("Infinite brushes shed pieces: no noise, but an error that is told", "[overload][shedder]") {
  struct Case {
    double resolution;
    std::uint32_t least, pieces, kept;
  };
  // The shedder leaves an infinite brush `least` pieces, but never fewer than 4. The default `least` of 64
  // exceeds the number of pieces, and then half of them is kept.
  for (const Case& c : {Case{0.0, 64, 8, 4}, Case{0.0, 6, 8, 4}, Case{0.0, 1, 8, 4}, Case{64.0, 64, 64, 32},
                        Case{64.0, 10, 64, 10}, Case{64.0, 1, 64, 4}, Case{7.0, 64, 7, 4},
                        Case{9.0, 64, 9, 5}, Case{4.0, 1, 4, 4}, Case{2.0, 64, 2, 2}}) {
    INFO("resolution " << c.resolution << ", least " << c.least);
    InfiniteLoop loop(c.resolution, c.least, 4e-3);
    REQUIRE(loop.pieces() == c.pieces);
    CHECK(loop.report().at_least == (c.pieces == c.kept ? 1 : 0));
    for (int k = 0; k < 20; ++k) loop.tick_once();
    CHECK(loop.pieces() == c.kept);
    const double growth = static_cast<double>(c.pieces) / c.kept;
    ShedReport report = loop.report();
    CHECK(report.at_least == 1);
    CHECK(report.patches == (c.pieces == c.kept ? 0 : 1));
    CHECK(report.least_share == Approx(1.0 / growth));
    CHECK(report.noise_growth == 1.0);
    CHECK(report.error_growth == Approx(growth * growth));
    // Checks that the shedder restores all pieces when there is enough time.
    loop.time_s = 1e-7;
    for (int k = 0; k < 20000; ++k) loop.tick_once();
    CHECK(loop.pieces() == c.pieces);
    CHECK(loop.report().error_growth == 1.0);
  }
}

TEST_CASE("An infinite brush that glides visits nothing, so its pieces are not shed", "[overload][shedder]") {
  InfiniteLoop loop(0.0, 64, 4e-3);
  Response response;
  const auto tick_with = [&](double time, double displacement, bool foresees) {
    loop.motion.displacement[0] = displacement;
    const int before = foresees ? loop.shedder.before_step(loop.batch, {&loop.motion, 1}) : 0;
    const StepReport report = loop.batch.step(tick, {&loop.motion, 1}, {&response, 1});
    return before + loop.shedder.after_step(loop.batch, {&loop.motion, 1}, time, report);
  };
  // Steps stay within the budget until the patch glides (slides in a steady state that visits no pieces). By
  // then the shedder knows the time per piece.
  for (int k = 0; k < 200; ++k) CHECK(tick_with(2e-4, 0.3 * dbar, true) == 0);
  REQUIRE(loop.report().rate_s > 0.0);
  // In a glide there is nothing to shed, so late steps must change nothing, with prediction or without.
  for (const bool foresees : {false, true})
    for (int k = 0; k < 20; ++k) CHECK(tick_with(4e-3, 0.3 * dbar, foresees) == 0);
  CHECK(loop.pieces() == 8);
  // Moves the infinite brush to and fro, so that it visits its pieces, some of which are then shed.
  for (int k = 0; k < 20; ++k) tick_with(4e-3, (k % 2 == 0 ? -0.9 : 0.9) * dbar, false);
  CHECK(loop.pieces() == 4);
}

namespace {

/// Infinite brushes of 128 pieces, and a shedder that has learnt the time of a visit to a piece, 1 ns.
/// `visits` and the fixed cost of each brush, which the shedder counts as 280 visits, take 90 % of its
/// budget: it neither sheds more nor restores.
struct FineBrushes {
  FineBrushes(int count, double visits)
      : shedder(LoadShedderOptions{}.with_budget(1e-9 * (280.0 * count + visits) / 0.9).with_rate(1e-9)) {
    PatchOptions options = plain_options(0, 1);
    options.with_population(bristle::Population::infinite).with_resolution(128.0).with_max_normal_load(1.0);
    for (int i = 0; i < count; ++i) {
      ids.push_back(batch.add(plain_material(SnapLength::lognormal(dbar, 0.3), SnapRule::redraw), options));
      shedder.add(ids.back(), 0, 1);
    }
    motions = same_motion(ids, 3.0 * dbar, 0.0, 1.0);
    responses.resize(ids.size());
    // Slides until all brushes glide (slide steadily without visiting their pieces).
    for (int k = 0; k < 20; ++k) report = batch.step(tick, motions, responses);
    REQUIRE(report.bristles_visited == 0);
  }
  /// Takes a step after asking the shedder, within the budget. Returns the number of changes of detail.
  int step() {
    const int changes = shedder.before_step(batch, motions);
    report = batch.step(tick, motions, responses);
    shedder.after_step(batch, motions, 1e-9 * 280.0 * static_cast<double>(ids.size()), report);
    return changes;
  }

  PatchBatch batch;
  LoadShedder shedder;
  std::vector<PatchId> ids;
  std::vector<Motion> motions;
  std::vector<Response> responses;
  StepReport report{};
};

}  // namespace

TEST_CASE("A glide that was restored visits nothing, so its pieces are not shed", "[overload][shedder]") {
  FineBrushes brushes(1, 100.0);
  std::vector<std::byte> state(brushes.batch.state_size());
  REQUIRE(brushes.batch.save_state(state) == state.size());
  brushes.batch.restore_state(state);
  CHECK(brushes.step() == 0);
  CHECK(brushes.report.bristles_visited == 0);
  // Turns back, which ends the glide (steady slide): the brush visits more pieces than the budget allows.
  brushes.motions[0].displacement[0] *= -0.01;
  brushes.step();
  CHECK(brushes.report.bristles_visited > 100);
  CHECK(brushes.step() == 1);
}

TEST_CASE("Visits of a glide that ends are not held against brushes that stick", "[overload][shedder]") {
  // The first brush ends its glide (steady slide without visits) and visits its cohorts, at most 256; the
  // second one trembles in place and visits none. Two that visited as many would exceed the budget.
  FineBrushes brushes(2, 270.0);
  brushes.motions[1].displacement[0] = 0.0;
  for (int k = 0; k < 7; ++k) {
    CAPTURE(k);
    const bool slides_back = k >= 4;
    brushes.motions[0].displacement[0] = (slides_back ? -2.0 : 3.0) * dbar;
    CHECK(brushes.step() == 0);
    brushes.motions[1].displacement[0] = (k % 2 == 0 ? -1e-6 : 1e-6) * dbar;
    if (k != 1)
      CHECK((brushes.report.bristles_visited > 135) == slides_back);  // the second brush's glide ends
  }
}

TEST_CASE("Whatever a glide costs, the budget is kept and bristles get what it leaves",
          "[overload][shedder]") {
  // 50 brushes that glide (slide without visiting their pieces) take half the budget, and one patch of
  // bristles at 1 ns each would take three times the other half. The shedder assumes that a glide costs as
  // much as 280 bristles. Here it costs as much as 4 to 2000.
  constexpr int brushes = 50, steps = 4000;
  for (const bool foresees : {false, true})
    for (const double glide : {4e-9, 40e-9, 400e-9, 2e-6}) {
      INFO("a glide of " << 1e9 * glide << " ns, " << (foresees ? "foreseen" : "not foreseen"));
      const double budget = 2.0 * brushes * glide;
      const auto bristles = static_cast<std::uint32_t>(1.5 * budget / 1e-9);
      PatchBatch batch;
      LoadShedder shedder(LoadShedderOptions{}.with_budget(budget).with_wait_steps(10));
      std::vector<PatchId> ids;
      ids.push_back(batch.add(plain_material(SnapLength::lognormal(dbar, 0.3), SnapRule::keep),
                              plain_options(bristles, 1, Precision::single, Outputs::end)));
      PatchOptions infinite = plain_options(0, 1);
      infinite.with_population(bristle::Population::infinite).with_max_normal_load(1.0);
      for (int i = 0; i < brushes; ++i)
        ids.push_back(
            batch.add(plain_material(SnapLength::lognormal(dbar, 0.3), SnapRule::redraw), infinite));
      for (const PatchId id : ids) shedder.add(id, 0, 1);
      std::vector<Motion> motions = same_motion(ids, 5.0 * dbar, 0.0, 1.0);
      motions[0].normal_load = bristles;
      std::vector<Response> responses(ids.size());
      for (int k = 0; k < 20; ++k) batch.step(tick, motions, responses);  // steps until all brushes glide
      int late = 0, late_at_last = 0;
      for (int k = 0; k < steps; ++k) {
        if (foresees) shedder.before_step(batch, motions);
        const StepReport report = batch.step(tick, motions, responses);
        const double time = brushes * glide + 1e-9 * static_cast<double>(report.bristles_visited);
        if (time > budget) (k < steps / 2 ? late : late_at_last) += 1;
        shedder.after_step(batch, motions, time, report);
      }
      CHECK(late <= 3);
      CHECK(late_at_last == 0);
      // Checks that the bristles' patch gets between half and all of the time that the glides leave.
      const double left = budget - brushes * glide;
      const double taken = 1e-9 * static_cast<double>(batch.info(ids[0]).active) / left;
      CHECK(taken > 0.5);
      CHECK(taken < 1.0);
      // Checks that the shedder takes no pieces of gliding brushes, because that would save no time.
      for (std::size_t i = 1; i < ids.size(); ++i) REQUIRE(batch.info(ids[i]).detail == 8);
    }
}

TEST_CASE("A full record counts the decisions that it lost", "[overload][shedder]") {
  Loop loop({1000, 1000, 1000}, {0, 1, 2}, LoadShedderOptions{}.with_budget(1e-6).with_record(2));
  for (int k = 0; k < 20; ++k) loop.tick_once(one_nanosecond_each);
  const ShedReport report = loop.shedder.report(loop.batch);
  CHECK(loop.shedder.decisions().size() == 2);
  CHECK(report.decisions == 2 + report.decisions_lost);
  CHECK(report.decisions_lost > 0);
  loop.shedder.clear_decisions();
  CHECK(loop.shedder.decisions().empty());
}

TEST_CASE("A LoadShedder names what it cannot take", "[overload][shedder]") {
  CHECK(names(message_of([] { LoadShedder(LoadShedderOptions{}.with_budget(0.0)); }), {"budget_s", "0"}));
  CHECK(names(message_of([] { LoadShedder(LoadShedderOptions{}.with_late_steps(0)); }), {"late_steps"}));
  LoadShedder shedder;
  CHECK(names(message_of([&] { shedder.add(PatchId{}); }), {"patch"}));
  CHECK(names(message_of([&] { shedder.add(PatchId{1}, 0, 0); }), {"least_bristles", "0"}));
  // Checks that the shedder bears a removed patch, and times that are not positive numbers.
  Loop loop({1000, 1000}, {0, 1}, LoadShedderOptions{}.with_budget(1e-6));
  loop.batch.remove(loop.ids[0]);
  for (double time : {0.0, -1.0, std::nan(""), double(INFINITY)})
    CHECK(loop.shedder.after_step(loop.batch, loop.motions, time, StepReport{}) == 0);
  for (int k = 0; k < 20; ++k) loop.tick_once(one_nanosecond_each);
  CHECK(loop.detail(1) < 1000);
  // Checks that the shedder treats a new patch in the slot of a removed one as a different patch.
  const PatchId heir =
      loop.batch.add(plain_material(SnapLength::single(dbar), SnapRule::keep), plain_options(90));
  REQUIRE(static_cast<std::uint32_t>(heir.value) == static_cast<std::uint32_t>(loop.ids[0].value));
  loop.shedder.add(heir);
  loop.shedder.remove(loop.ids[0]);
  loop.batch.set_detail(heir, 70);
  CHECK(loop.shedder.report(loop.batch).patches == 2);
  loop.shedder.remove(heir);
  loop.shedder.remove(loop.ids[1]);
  CHECK(loop.shedder.report(loop.batch).patches == 0);
}

TEST_CASE("With the real clock, work of four times the budget comes below it", "[overload][shedder]") {
  using bristle::DeadlineMonitor;
  const Material material = plain_material(SnapLength::uniform(0.5 * dbar, 1.5 * dbar), SnapRule::redraw);
  const std::uint32_t n = test_size(200000);
  bool met = false;
  double share = 0.0;
  const double began = DeadlineMonitor::wall_now();
  while (!met && DeadlineMonitor::wall_now() - began < 20.0) {
    OnePatch patch(material, plain_options(n));
    const Motion motion = same_motion({patch.id}, 0.8 * dbar, 0.0, n)[0];
    Response response;
    const auto timed_step = [&] {
      const double start = DeadlineMonitor::cpu_now();
      patch.report = patch.batch.step(tick, {&motion, 1}, {&response, 1});
      return DeadlineMonitor::cpu_now() - start;
    };
    std::vector<double> times;
    for (int k = 0; k < 40; ++k) times.push_back(timed_step());
    std::nth_element(times.begin(), times.begin() + 20, times.end());
    const double budget = times[20] / 4.0;
    LoadShedder shedder(LoadShedderOptions{}.with_budget(budget));
    shedder.add(patch.id);
    times.clear();
    for (int k = 0; k < 600; ++k) {
      const double time = timed_step();
      shedder.after_step(patch.batch, {&motion, 1}, time, patch.report);
      if (k >= 100) times.push_back(time);
    }
    std::sort(times.begin(), times.end());
    share = times[times.size() * 99 / 100] / budget;
    met = share <= 1.0 && patch.batch.info(patch.id).detail < n / 3;
  }
  INFO("p99 over budget in the last attempt " << share);
  CHECK(met);
}

TEST_CASE("A load shedder takes any id and no more record than it can keep", "[overload]") {
  bristle::LoadShedder shedder;
  // Any 64 bits may be passed as an id. So the shedder's memory must follow the number of patches, not the
  // slot numbers in their ids.
  for (std::uint64_t k = 1; k <= 1000; ++k)
    shedder.add(bristle::PatchId{k << 32 | (0xFFFFFFFFu - 7 * k)}, static_cast<int>(k % 3), 1);
  for (std::uint64_t k = 1; k <= 1000; k += 2)
    shedder.remove(bristle::PatchId{k << 32 | (0xFFFFFFFFu - 7 * k)});
  bristle::PatchBatch batch;
  CHECK(shedder.report(batch).patches == 0);
  CHECK_THROWS_WITH(bristle::LoadShedder(bristle::LoadShedderOptions{}.with_record(~std::size_t{0})),
                    Catch::Contains("record"));
}

TEST_CASE("Quick steps lower the time per bristle by a 256th of the difference, slow ones raise it at once",
          "[overload][shedder]") {
  LoadShedder shedder(LoadShedderOptions{}.with_budget(1e-3).with_rate(1e-6));
  PatchBatch batch;
  StepReport report;
  report.bristles_visited = 1000;  // names no patch: each would add its fixed time
  const auto step = [&](double per_bristle) {
    shedder.after_step(batch, {}, per_bristle * 1000.0, report);
    return shedder.report(batch).rate_s;
  };
  double rate = 1e-6;
  CHECK(step(1e-6) == Approx(rate));
  for (int k = 0; k < 600; ++k) {
    rate += (0.5e-6 - rate) / 256.0;
    CHECK(step(0.5e-6) == Approx(rate).epsilon(1e-12));
  }
  // Checks that a single slow step does not raise the shedder's estimate of the time per bristle.
  CHECK(step(0.9e-6) == Approx(rate).epsilon(0.01));
  CHECK(step(0.8e-6) == Approx(0.8e-6));  // two slow steps raise the time per bristle to the smaller
}

}  // namespace bristle_test::test_overload
