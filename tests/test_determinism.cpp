// Equal inputs give equal bits: on every instruction set, with any number of threads, whatever patches share
// the batch.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "expect.hpp"
#include "scenes.hpp"
#include "variants.hpp"

namespace bristle_test::test_determinism {

namespace {

struct Outcome {
  std::vector<std::vector<Response>> responses;  ///< response of each [patch][step], with the id cleared
  std::vector<std::uint64_t> hashes;             ///< state hash of each [patch] at the end
  std::vector<std::byte> saved;                  ///< saved state of the batch at the end
  std::uint32_t most_tasks = 0;
};

/// Runs the cases named by `chosen` (indices into `cases`) in one batch; `shuffle` decides the order of the
/// motions of a step.
Outcome run(const std::vector<PatchCase>& cases, const std::vector<std::size_t>& chosen, int steps,
            PatchBatch batch, unsigned shuffle = 0) {
  std::vector<PatchId> ids;
  for (std::size_t c : chosen) ids.push_back(batch.add(cases[c].material, cases[c].options));
  batch.warm_up();
  Outcome outcome;
  outcome.responses.resize(chosen.size());
  std::vector<std::size_t> order(chosen.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::mt19937_64 random(shuffle);
  for (int k = 0; k < steps; ++k) {
    if (k == steps / 2) {
      for (std::size_t i = 0; i < chosen.size(); ++i) batch.set_material(ids[i], cases[chosen[i]].later);
    }
    if (shuffle) std::shuffle(order.begin(), order.end(), random);
    std::vector<Motion> motions(chosen.size());
    std::vector<Response> responses(chosen.size());
    for (std::size_t at = 0; at < order.size(); ++at) {
      const std::size_t i = order[at];
      motions[at] = scripted_motion(chosen[i], k, cases[chosen[i]].options.axes);
      motions[at].id = ids[i];
    }
    const bristle::StepReport report = batch.step(tick, motions, responses);
    outcome.most_tasks = std::max(outcome.most_tasks, report.tasks);
    for (std::size_t at = 0; at < order.size(); ++at) {
      responses[at].id = PatchId{};
      outcome.responses[order[at]].push_back(responses[at]);
    }
  }
  for (PatchId id : ids) outcome.hashes.push_back(batch.state_hash(id));
  outcome.saved = saved_state(batch);
  return outcome;
}

void check_same(const std::vector<PatchCase>& cases, const std::vector<std::size_t>& chosen,
                const Outcome& expected, const Outcome& got, const char* what) {
  int shown = 0;
  for (std::size_t i = 0; i < chosen.size() && shown < 5; ++i) {
    const std::size_t c = chosen[i];
    for (std::size_t k = 0; k < got.responses[i].size(); ++k) {
      const std::string field = first_difference(expected.responses[c][k], got.responses[i][k]);
      if (!field.empty()) {
        FAIL_CHECK(what << ": " << cases[c].name << ": " << field << " differs in step " << k);
        ++shown;
        break;
      }
    }
    if (expected.hashes[c] != got.hashes[i]) {
      FAIL_CHECK(what << ": " << cases[c].name << ": the state hash differs");
      ++shown;
    }
  }
}

std::vector<std::size_t> all_of(const std::vector<PatchCase>& cases) {
  std::vector<std::size_t> all(cases.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  return all;
}

constexpr int script_steps = 40;

/// Calls `run` with the stack pointer lowered by `shift` times 16 bytes, the alignment that every system
/// guarantees.
[[gnu::noinline]] Outcome run_shifted(int shift, const std::vector<PatchCase>& cases,
                                      const std::vector<std::size_t>& chosen, const BatchOptions& options) {
  volatile auto* room =
      static_cast<volatile char*>(__builtin_alloca(static_cast<std::size_t>(16 * shift + 16)));
  *room = 1;
  return run(cases, chosen, 8, PatchBatch(options));
}

}  // namespace

TEST_CASE("Every instruction set, thread count and order of motions gives the bits of the scalar reference",
          "[determinism][state]") {
  const std::vector<PatchCase> cases = every_variant(test_size(1500));
  const std::vector<std::size_t> all = all_of(cases);
  // Expects of every way of running the bits of the scalar kernels, which visit every bristle.
  const Outcome expected =
      run(cases, all, script_steps, PatchBatch(BatchOptions{}.with_isa("scalar").with_threads(1)));
  CHECK(expected.most_tasks == 1);

  std::vector<std::string> usable;
  for (const bristle::IsaInfo& isa : bristle::instruction_sets()) {
    if (!isa.usable)
      std::printf("skipped: this machine does not run %s\n", isa.name);
    else if (std::string(isa.name) != "scalar")
      usable.push_back(isa.name);
  }
  if (!is_scalar(PatchBatch())) CHECK(usable.size() >= 1);
  if (usable.empty()) usable.push_back("scalar");
  // A way of running the cases: threads, instruction set, order. Each difference from the expected run occurs
  // at least once, several in one run; patch and step of a mismatch tell which one failed.
  struct Manner {
    int threads;
    bool eager;
    unsigned shuffle;
  };
  const Manner manners[] = {{2, true, 0}, {3, false, 77}, {8, false, 78}};
  for (std::size_t k = 0; k < std::max(usable.size(), std::size(manners)); ++k) {
    const std::string& isa = usable[k % usable.size()];
    const Manner& manner = manners[k % std::size(manners)];
    const std::string what = isa + ", " + std::to_string(manner.threads) + " threads" +
                             (manner.eager ? ", eager" : "") + (manner.shuffle ? ", shuffled motions" : "");
    const Outcome got =
        run(cases, all, script_steps,
            stepped_eagerly(BatchOptions{}.with_isa(isa.c_str()).with_threads(manner.threads), manner.eager),
            manner.shuffle);
    check_same(cases, all, expected, got, what.c_str());
    INFO(what);
    CHECK((got.saved == expected.saved));  // in parentheses, so that a failure prints no megabytes
#if BRISTLE_WITH_TBB
    CHECK(got.most_tasks > 1);
#endif
  }

  std::vector<std::size_t> some;
  for (std::size_t c = 0; c < cases.size(); c += 5) some.push_back(cases.size() - 1 - c);
  check_same(cases, some, expected, run(cases, some, script_steps, PatchBatch()),
             "a fifth of the patches, added in reverse");
  for (std::size_t c = 0; c < cases.size(); c += 31) {
    const std::vector<std::size_t> alone{c};
    check_same(cases, alone, expected, run(cases, alone, script_steps, PatchBatch()), "alone");
  }
}

TEST_CASE("Every kernel steps wherever its thread's stack begins", "[determinism]") {
  const std::vector<PatchCase> cases = every_variant(60);
  const std::vector<std::size_t> all = all_of(cases);
  const Outcome expected = run(cases, all, 8, PatchBatch(BatchOptions{}.with_threads(1)));
  for (const bristle::IsaInfo& isa : bristle::instruction_sets()) {
    if (!isa.usable) continue;
    const BatchOptions options = BatchOptions{}.with_isa(isa.name).with_threads(1);
    for (std::size_t shift = 1; shift < 4; ++shift) {
      std::vector<std::size_t> third;
      for (std::size_t c = shift - 1; c < cases.size(); c += 3) third.push_back(c);
      check_same(cases, third, expected, run_shifted(static_cast<int>(shift), cases, third, options),
                 isa.name);
    }
  }
}

TEST_CASE("Skipping blocks that cannot snap gives the bits of visiting every bristle", "[determinism]") {
  // Cases whose blocks can be skipped: an infinite brush has no blocks, and a contact in a lane is always
  // visited.
  std::vector<PatchCase> cases;
  for (PatchCase& c : every_variant(test_size(1500)))
    if (c.options.population != bristle::Population::infinite && c.material.snap_rule != SnapRule::slide)
      cases.push_back(std::move(c));
  // After sliding: tremor, creep and wandering, in which most blocks come close to a snap but do not snap in
  // most steps.
  std::uint64_t visited[2] = {0, 0};
  std::vector<std::uint64_t> hashes[2];
  std::vector<Response> last[2];
  for (int lazy : {0, 1}) {
    PatchBatch batch(stepped_eagerly({}, lazy == 0));
    std::vector<PatchId> ids;
    for (const PatchCase& c : cases) ids.push_back(batch.add(c.material, c.options));
    batch.warm_up();
    std::vector<Response> responses(cases.size());
    for (int k = 0; k < 300; ++k) {
      std::vector<Motion> motions(cases.size());
      for (std::size_t i = 0; i < cases.size(); ++i) {
        Motion& m = motions[i];
        m.id = ids[i];
        m.normal_load = k % 50 == 49 ? 1.9 : 1.7;
        const double length = dbar * (k < 12 ? 0.6 : k % 97 == 0 ? 1.5 : 0.03);
        const double angle = k < 12 ? 0.4 : 0.7 * k + 0.001 * static_cast<double>(i) * (k % 13);
        m.displacement[0] = length * std::cos(angle) + 1e-3 * dbar;
        m.displacement[1] = cases[i].options.axes == 1 ? 0.0 : length * std::sin(angle);
      }
      visited[lazy] += batch.step(tick, motions, responses).bristles_visited;
      for (Response r : responses) {
        r.id = PatchId{};
        last[lazy].push_back(r);
      }
    }
    for (PatchId id : ids) hashes[lazy].push_back(batch.state_hash(id));
  }
  int wrong = 0;
  for (std::size_t i = 0; i < last[0].size() && wrong < 5; ++i) {
    const std::string field = first_difference(last[0][i], last[1][i]);
    if (field.empty()) continue;
    ++wrong;
    FAIL_CHECK(cases[i % cases.size()].name << ": " << field << " differs in step " << i / cases.size());
  }
  CHECK(hashes[0] == hashes[1]);
  // Checks that blocks were skipped, since otherwise nothing was tested.
  if (!is_scalar(PatchBatch())) CHECK(visited[1] < visited[0] / 2);
}

TEST_CASE("Outputs that a patch does not compute are left untouched and change no state", "[determinism]") {
  const std::vector<PatchCase> cases = every_variant(300);
  PatchBatch batch;
  std::vector<PatchId> ids, twins;  // a twin patch differs only in its outputs
  for (const PatchCase& c : cases) {
    ids.push_back(batch.add(c.material, c.options));
    twins.push_back(batch.add(c.material, PatchOptions(c.options).with_outputs(Outputs::end)));
  }
  for (int k = 0; k < 20; ++k) {
    std::vector<Motion> motions(2 * cases.size());
    std::vector<Response> responses(2 * cases.size());
    for (std::size_t i = 0; i < motions.size(); ++i) {
      const std::size_t c = i / 2;
      motions[i] = scripted_motion(c, k, cases[c].options.axes);
      motions[i].id = i % 2 == 0 ? ids[c] : twins[c];
      responses[i].mean[0] = responses[i].mean[1] = 123.0;
      responses[i].dissipated = responses[i].contact_loss = responses[i].damper_work = 456.0;
      responses[i].snaps = 789;
    }
    batch.step(tick, motions, responses);
    for (std::size_t i = 0; i < responses.size(); ++i) {
      const Outputs outputs = i % 2 == 0 ? cases[i / 2].options.outputs : Outputs::end;
      const bool mean = has(outputs, Outputs::mean), energy = has(outputs, Outputs::energy);
      expect((responses[i].mean[0] == 123.0) == !mean, "mean is touched where computed");
      expect((responses[i].dissipated == 456.0) == !energy, "dissipated is touched where computed");
      expect((responses[i].contact_loss == 456.0) == !energy, "contact_loss is touched where computed");
      expect((responses[i].damper_work == 456.0) == !energy, "damper_work is touched where computed");
      expect((responses[i].snaps == 789) == !energy, "snaps is touched where computed");
    }
  }
  for (std::size_t i = 0; i < cases.size(); ++i) {
    if (cases[i].options.population == bristle::Population::infinite)
      continue;  // skips the infinite brush, which stores some sums only for outputs that need them
    INFO(cases[i].name);
    expect(batch.state_hash(ids[i]) == batch.state_hash(twins[i]), "the same state whatever the outputs");
  }
}

TEST_CASE("Save and restore half-way continue with the same bits, on any instruction set and thread count",
          "[determinism]") {
  const std::vector<PatchCase> cases = every_variant(test_size(300));
  constexpr int settled = 40, end = 55;
  const auto fill = [&](PatchBatch& batch) {
    std::vector<PatchId> ids;
    for (const PatchCase& c : cases) ids.push_back(batch.add(c.material, c.options));
    batch.warm_up();
    return ids;
  };
  const auto advance = [&](PatchBatch& batch, const std::vector<PatchId>& ids, int from, int to) {
    std::vector<Response> all;
    for (int k = from; k < to; ++k) {
      std::vector<Motion> motions(cases.size());
      std::vector<Response> responses(cases.size());
      for (std::size_t i = 0; i < cases.size(); ++i) {
        motions[i] = scripted_motion(i, k, cases[i].options.axes);
        // Slides these patches steadily, so that some carry the slide without stepping their bristles.
        if (k < settled && i % 2 == 0) {
          motions[i].displacement[0] = dbar;
          motions[i].displacement[1] = 0.0;
          motions[i].normal_load = k + 1 < settled ? 1.7 : 1.8;
        }
        motions[i].id = ids[i];
      }
      batch.step(tick, motions, responses);
      all.insert(all.end(), responses.begin(), responses.end());
    }
    return all;
  };
  PatchBatch original(BatchOptions{}.with_threads(2));
  const std::vector<PatchId> ids = fill(original);
  advance(original, ids, 0, settled);
  const std::vector<std::byte> state = saved_state(original);
  const std::uint64_t hash_then = original.state_hash();
  const std::vector<Response> expected = advance(original, ids, settled, end);
  const std::uint64_t hash_end = original.state_hash();
  REQUIRE(hash_end != hash_then);

  // Checks that restoring an earlier state in the same batch repeats the steps.
  original.restore_state(state);
  CHECK(original.state_hash() == hash_then);
  std::vector<Response> again = advance(original, ids, settled, end);
  CHECK(original.state_hash() == hash_end);
  int wrong = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) wrong += !first_difference(expected[i], again[i]).empty();
  CHECK(wrong == 0);

  // Restores the state into a batch with other options and another history.
  for (const BatchOptions& options : {BatchOptions{}.with_isa("scalar"), BatchOptions{}.with_threads(1)}) {
    PatchBatch other(options);
    const std::vector<PatchId> other_ids = fill(other);
    advance(other, other_ids, 60, 64);
    other.restore_state(state);
    CHECK(other.state_hash() == hash_then);
    again = advance(other, other_ids, settled, end);
    CHECK(other.state_hash() == hash_end);
    wrong = 0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
      again[i].id = expected[i].id;
      wrong += !first_difference(expected[i], again[i]).empty();
    }
    CHECK(wrong == 0);
  }
}

TEST_CASE("The hash sees every part of the state", "[determinism]") {
  const auto hash_after = [](double dx, double load, const Material& material, std::uint32_t seed,
                             double again = 0.0) {
    OnePatch patch(material, PatchOptions{}.with_bristles(300).with_seed(seed));
    patch.step(dx, 0.0, load);
    if (again != 0.0) patch.step(again, 0.0, load);
    return patch.hash();
  };
  const Material material;
  const std::uint64_t base = hash_after(3e-6, 0.5, material, 1);
  CHECK(hash_after(3e-6, 0.5, material, 1) == base);
  // Checks that another displacement of a block gives another hash.
  CHECK(hash_after(3.0001e-6, 0.5, material, 1) != base);
  // Checks that another number of bristles in contact gives another hash.
  CHECK(hash_after(3e-6, 0.4, material, 1) != base);
  // Checks that another material gives another hash.
  CHECK(hash_after(3e-6, 0.5, Material(material).with_bristle_stiffness(90.0), 1) != base);
  CHECK(hash_after(3e-6, 0.5, material, 2) != base);  // different snap lengths must give another hash
  CHECK(hash_after(3e-6, 0.5, material, 1, 20e-6) != base);
  CHECK(hash_after(3e-6, 0.5, material, 1, -3e-6) != base);
}

}  // namespace bristle_test::test_determinism
