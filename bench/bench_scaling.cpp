// Measures the step of one patch with a hundred to four million bristles, on one thread and on two.
#include "measured_scene.hpp"
#include "suites.hpp"

namespace bristle_bench {

void register_scaling() {
  for (SnapRule rule : rules()) {
    for (const Regime& regime : {presliding, all_snap}) {
      for (int threads : {1, 2}) {
        for (std::uint32_t n :
             {100u, 1000u, 10000u, 50000u, 100000u, 200000u, 500000u, 1000000u, 2000000u, 4000000u}) {
          OnePatchCase what;
          what.regime = regime;
          what.rule = rule;
          what.bristles = n;
          what.batch.threads = threads;
          add_one_patch_benchmark(std::string("scaling/") + name_of(rule) + '/' + regime.name + '/' +
                                      std::to_string(threads) + "threads/" + std::to_string(n),
                                  what);
        }
      }
    }
  }
}

}  // namespace bristle_bench
