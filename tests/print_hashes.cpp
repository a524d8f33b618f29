// Prints one hash for each kernel variant, instruction set and number of threads, which
// tools/upkeep/hash_table compares between builds. Lines of variant, instruction set, threads, most threads
// seen in a step, hash, separated by tabs. A hash covers every response of a scripted run and the state at
// its end.
#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include "core/common/hashing.hpp"
#include "scenes.hpp"
#include "variants.hpp"

using namespace bristle_test;

namespace {

constexpr int script_steps = 40;

void add_response(bristle::detail::Hasher& hasher, const Response& r, Outputs outputs) {
  for (int axis = 0; axis < 2; ++axis) {
    hasher.add(r.end[axis]);
    if (has(outputs, Outputs::mean)) hasher.add(r.mean[axis]);
  }
  if (has(outputs, Outputs::energy)) {
    for (double value : {r.dissipated, r.contact_loss, r.damper_work}) hasher.add(value);
    hasher.add(static_cast<std::uint64_t>(r.snaps));
  }
  for (double value : {r.stiffness, r.damping, r.force_limit}) hasher.add(value);
  hasher.add(static_cast<std::uint64_t>(r.status));
}

/// Returns the name of a patch's kernel from its PatchInfo, with a mark if threads share the patch's step.
std::string variant_of(const PatchCase& c, const PatchBatch& batch, PatchId id) {
  return std::string(c.name.rfind("large", 0) == 0 ? "large: " : "") + batch.info(id).kernel;
}

void print_all(const std::vector<PatchCase>& cases, const char* isa, int threads) {
  PatchBatch batch(BatchOptions{}.with_isa(isa).with_threads(threads));
  std::vector<Motion> motions(cases.size());
  std::vector<Response> responses(cases.size());
  std::vector<bristle::detail::Hasher> hashers(cases.size());
  std::vector<PatchId> ids;
  for (const PatchCase& c : cases) ids.push_back(batch.add(c.material, c.options));
  batch.warm_up();
  std::uint32_t most_threads = 0;
  for (int k = 0; k < script_steps; ++k) {
    for (std::size_t i = 0; i < cases.size(); ++i) {
      if (k == script_steps / 2) batch.set_material(ids[i], cases[i].later);
      motions[i] = scripted_motion(i, k, cases[i].options.axes);
      motions[i].id = ids[i];
    }
    most_threads = std::max(most_threads, batch.step(tick, motions, responses).threads);
    for (std::size_t i = 0; i < cases.size(); ++i)
      add_response(hashers[i], responses[i], cases[i].options.outputs);
  }
  std::map<std::string, bristle::detail::Hasher> variants;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    hashers[i].add(batch.state_hash(ids[i]));
    variants[variant_of(cases[i], batch, ids[i])].add(hashers[i].value());
  }
  for (const auto& [name, hasher] : variants)
    std::printf("%s\t%s\t%d\t%u\t%016" PRIx64 "\n", name.c_str(), isa, threads, most_threads, hasher.value());
}

}  // namespace

int main(int count, char** arguments) {
  std::vector<int> threads;
  for (int i = 1; i < count; ++i) threads.push_back(std::atoi(arguments[i]));
  if (threads.empty()) threads = BRISTLE_WITH_TBB ? std::vector<int>{1, 2, 3, 8} : std::vector<int>{1};
  const std::vector<PatchCase> cases = every_variant(300);
  for (const bristle::IsaInfo& isa : bristle::instruction_sets()) {
    if (!isa.usable) {
      std::fprintf(stderr, "skipped: this machine does not run %s\n", isa.name);
      continue;
    }
    for (int n : threads) print_all(cases, isa.name, n);
  }
}
