// What may not change the bits of a patch of any variant: blocks that are skipped, outputs that are computed.
#include <catch2/catch.hpp>

#include <cstddef>
#include <vector>

#include "expect.hpp"
#include "scenes.hpp"
#include "variants.hpp"

namespace bristle_test::test_determinism {

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
