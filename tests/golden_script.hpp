// Patches of bristles with scripted motions, whose state hashes are equal on every machine and in every
// optimised build. Shared by the test of the record (data/golden_hash.csv) and the page that runs in a
// browser.
#pragma once

#include <cinttypes>
#include <cstdio>
#include <string>
#include <vector>

#include "scenes.hpp"
#include "variants.hpp"

namespace bristle_test {

struct Golden {
  std::string name;
  std::string hash;  ///< sixteen hexadecimal digits
};

/// Runs a scripted patch for each precision, snap rule and law. Returns their state hashes, which
/// do not depend on how the library was built.
inline std::vector<Golden> run_golden_script(const BatchOptions& options = {}) {
  std::vector<Golden> golden;
  std::uint32_t seed = 1;
  for (Precision precision : {Precision::single, Precision::double_}) {
    for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
      for (const SnapLength& law : all_laws()) {
        ++seed;
        if (precision == Precision::double_ && !BRISTLE_WITH_DOUBLE) continue;
        OnePatch patch(plain_material(law, rule).with_bristle_damping(0.01),
                       plain_options(700, 2, precision).with_seed(seed), options);
        for (int k = 0; k < 60; ++k) {
          Motion motion = scripted_motion(seed, k, 2);
          motion.id = patch.id;
          motion.normal_load *= 350.0;  // scales loads of up to 2 N to this patch
          patch.step(motion);
        }
        char hash[20];
        std::snprintf(hash, sizeof hash, "%016" PRIx64, patch.hash());
        golden.push_back({std::string(name_of(precision)) + " " + table_name(rule) + " exact " +
                              to_string(law.law()) + " " + std::to_string(seed),
                          hash});
      }
      seed += static_cast<std::uint32_t>(all_laws().size());  // seeds that the records skip
    }
  }
  return golden;
}

}  // namespace bristle_test
