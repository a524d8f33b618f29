// Compares the state hash after a scripted run with the recorded one, which holds on every machine and in
// every optimised build.
//
// A changed hash means changed bits. If that is intended, record it again and announce it in CHANGELOG.md:
// BRISTLE_RECORD_GOLDEN=1 bristle_tests "*on record"
#include <catch2/catch.hpp>

#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "expect.hpp"
#include "golden_script.hpp"
#include "reference_table.hpp"

namespace bristle_test::test_golden_hash {

TEST_CASE("The state hashes of a scripted run are those on record", "[determinism]") {
  if (std::getenv("BRISTLE_RECORD_GOLDEN")) {
    std::ofstream out(data_folder() + "/golden_hash.csv");
    out << "patch,state_hash\n";
    for (const Golden& golden : run_golden_script(BatchOptions{}.with_isa("scalar")))
      out << golden.name << ',' << golden.hash << '\n';
    REQUIRE(out.flush());
    std::printf("recorded tests/data/golden_hash.csv\n");
  }
  const std::vector<Row> record = read_table("golden_hash.csv");
  for (const bristle::IsaInfo& isa : bristle::instruction_sets()) {
    if (!isa.usable) continue;
    int wrong = 0;
    for (const Golden& golden : run_golden_script(BatchOptions{}.with_isa(isa.name))) {
      const std::string expected = find_row(record, {{"patch", golden.name}}).at("state_hash");
      if (golden.hash == expected) continue;
      if (++wrong <= 5)
        FAIL_CHECK(isa.name << ", " << golden.name << ": " << golden.hash << ", on record " << expected);
    }
    CHECK(wrong == 0);
  }
}

}  // namespace bristle_test::test_golden_hash
