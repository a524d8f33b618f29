// A shared object that contains the library, for test_contracts.cpp: unloading it unloads all code of
// bristle.
#include <cstdint>

#include <bristle/bristle.hpp>

extern "C" [[gnu::visibility("default")]] std::uint64_t bristle_contracts_exercise(int threads) {
  using namespace bristle;
  constexpr double length = 1e-5;
  constexpr std::uint32_t bristles = 300000;
  PatchBatch batch(BatchOptions{}.with_threads(threads));
  const Material material = Material{}
                                .with_snap_length(SnapLength::uniform(0.5 * length, 1.5 * length))
                                .with_snap_rule(SnapRule::keep);
  Motion motion;
  motion.id = batch.add(material, PatchOptions{}.with_bristles(bristles).with_max_normal_load(1.0));
  motion.normal_load = 1.0;
  motion.displacement[0] = 0.7 * length;
  Response response;
  for (int k = 0; k < 3; ++k) batch.step(1e-3, {&motion, 1}, {&response, 1});
  return batch.state_hash();
}
