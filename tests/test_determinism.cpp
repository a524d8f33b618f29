// What may not change the bits of a patch of any variant: blocks that are skipped, outputs that are computed.
#include <catch2/catch.hpp>

#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "expect.hpp"
#include "scenes.hpp"
#include "variants.hpp"

namespace bristle_test::test_determinism {

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
