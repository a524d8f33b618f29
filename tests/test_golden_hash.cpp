// Compares the state hash after a scripted run with the recorded one, which holds on every machine and in
// every optimised build.
//
// A changed hash means changed bits. If that is intended, record it again and announce it in CHANGELOG.md:
// BRISTLE_RECORD_GOLDEN=1 bristle_tests "*on record"
#include <catch2/catch.hpp>

#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "expect.hpp"
#include "reference_table.hpp"
#include "scenes.hpp"
#include "variants.hpp"

namespace bristle_test::test_golden_hash {

namespace {

struct Golden {
  std::string name;
  std::string hash;
};

/// Runs a scripted patch for each precision, snap rule and law. Returns their state hashes, which
/// do not depend on how the library was built.
std::vector<Golden> run_script(const BatchOptions& options) {
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

}  // namespace

TEST_CASE("The state hashes of a scripted run are those on record", "[determinism]") {
  if (std::getenv("BRISTLE_RECORD_GOLDEN")) {
    std::ofstream out(data_folder() + "/golden_hash.csv");
    out << "patch,state_hash\n";
    for (const Golden& golden : run_script(BatchOptions{}.with_isa("scalar")))
      out << golden.name << ',' << golden.hash << '\n';
    REQUIRE(out.flush());
    std::printf("recorded tests/data/golden_hash.csv\n");
  }
  const std::vector<Row> record = read_table("golden_hash.csv");
  for (const bristle::IsaInfo& isa : bristle::instruction_sets()) {
    if (!isa.usable) continue;
    int wrong = 0;
    for (const Golden& golden : run_script(BatchOptions{}.with_isa(isa.name))) {
      const std::string expected = find_row(record, {{"patch", golden.name}}).at("state_hash");
      if (golden.hash == expected) continue;
      if (++wrong <= 5)
        FAIL_CHECK(isa.name << ", " << golden.name << ": " << golden.hash << ", on record " << expected);
    }
    CHECK(wrong == 0);
  }
}

}  // namespace bristle_test::test_golden_hash
