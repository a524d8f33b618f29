#include <vector>

#include "steps.hpp"
#include "targets.hpp"

namespace fuzz {
namespace {

using bristle::Motion;
using bristle::PatchBatch;
using bristle::Response;

/// Makes a batch for each instruction set of this machine, and one that visits every bristle. The caller
/// keeps the batches for all inputs, so that materials are set up once, and adds and removes the patches.
std::vector<PatchBatch> make_batches() {
  std::vector<PatchBatch> batches;
  for (const bristle::IsaInfo& isa : bristle::instruction_sets())
    if (isa.usable) batches.emplace_back(bristle::BatchOptions{}.with_isa(isa.name));
  batches.emplace_back(stepped_eagerly());
  return batches;
}

}  // namespace

void kernels(Bytes bytes) {
  static std::vector<PatchBatch> batches = make_batches();
  Input input(bytes);
  std::vector<bristle::PatchId> ids;
  bristle::Material material;
  bristle::PatchOptions options;
  try {
    material = any_material(input);
    options = any_options(input, 600);
    for (PatchBatch& batch : batches) ids.push_back(batch.add(material, options));
  } catch (const bristle::Error&) {
    check(ids.empty(), "what one instruction set refuses they all refuse");
    return;
  }
  const double scale = material.snap_length.mean();
  for (int k = 0; k < 24 && !input.empty(); ++k) {
    const Motion motion = any_motion(input, ids[0], options.axes, scale);
    const double dt = input.choice(16) == 15 ? input.number(1e-3) : 1e-3;
    const bool trial = input.choice(8) == 7;
    Response first;
    for (std::size_t b = 0; b < batches.size(); ++b) {
      Motion own = motion;
      own.id = ids[b];
      Response response;
      if (trial)
        response = batches[b].find_force(dt, own);
      else
        batches[b].step(dt, {&own, 1}, {&response, 1});
      check_finite(response);
      response.id = ids[0];
      if (b == 0) first = response;
      check_same(first, response, "instruction sets answer alike");
    }
  }
  const std::uint64_t hash = batches[0].state_hash(ids[0]);
  for (std::size_t b = 0; b < batches.size(); ++b) {
    check(batches[b].state_hash(ids[b]) == hash, "instruction sets end in the same state");
    batches[b].remove(ids[b]);
    check(batches[b].patch_count() == 0, "a removed patch is gone");
  }
}

}  // namespace fuzz
