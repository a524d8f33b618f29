// The experiments on contacts with an extent (limit surface, wheels, balls): their numbers against tables and
// closed forms.
#include <catch2/catch.hpp>

#include <cmath>
#include <string>

#include "expect.hpp"
#include "experiment_runs.hpp"
#include "reference_table.hpp"

namespace bristle_test::test_experiments_spin {

TEST_CASE("Wheels creep as closed forms and the table of the tyre say", "[experiment][beds]") {
  const cli::ExperimentResult result =
      run("creep-curve", {}, {"lugre_tyre", "slip_formula", "fastsim", "bed"});
  int found = 0;
  for (const Row& row : read_table("tyre_steady.csv")) {
    if (row.at("direction_deg") != "90") continue;
    const auto there = at(rows_of(result, "curve", "bed"), number(row, "slip_times_2a_over_l0") / 4.0, 1e-9);
    if (there == std::nullopt) continue;
    ++found;
    CHECK(there->values[1] == Approx(number(row, "Fy_over_muN")).margin(1e-3));
    CHECK(there->values[2] == Approx(-2.0 * number(row, "Mz_over_muN2a")).margin(1e-3));
  }
  CHECK(found >= 3);
  // All wheel models have the same stiffness at small creepage; the LuGre tyre follows d / (1 + 6/7 x 3 s).
  for (const char* model : {"slip_formula", "lugre_tyre"}) {
    const auto first = at(rows_of(result, "curve", model), 0.02, 1e-9);
    const double closed = model == std::string("lugre_tyre") ? 0.06 / 1.06 : 0.06;
    CHECK(first->values[1] == Approx(closed).epsilon(2e-3));
  }
  CHECK(finding(result, "relaxation_length", "bed") == Approx(2.0 - 2.0 * std::exp(-0.5)).margin(2e-3));
  CHECK(finding(result, "relaxation_length", "lugre_tyre") == Approx(12.0 / 7.0 / 1.03).epsilon(0.01));
  // FASTSIM's error is of first order, so that four times the cells leave a quarter of it.
  const double coarse = finding(result, "creep_force", "fastsim");
  CHECK(finding(run("creep-curve", {"cells=64"}, {"fastsim"}), "creep_force", "fastsim") ==
        Approx(0.5 * coarse).epsilon(0.05));
}

TEST_CASE("A ball rolls as Galileo's, and lags by Carter's share of its path", "[experiment][beds]") {
  const cli::ExperimentResult result = run("rolling-ball", {"time=1"}, {"coulomb", "bed"});
  // The centre of a ball gains as much speed as its surface loses: ratio 1 / (1 + 2/5 (1 - creepage)).
  const double creepage = rows_of(result, "slope", "bed").back().values[3];
  CHECK(creepage > 3e-3);
  CHECK(finding(result, "rolls_down", "bed") == Approx(1.0 + 2.0 / 7.0 * creepage).margin(1e-4));
  CHECK(finding(result, "thrown_rolls", "bed") == Approx(5.0 / 7.0).margin(1e-3));
  // A regularised Coulomb contact slips at a speed that its force sets, so when a ball moves twice as fast it
  // creeps half as much per distance.
  CHECK(finding(result, "creeps_by_distance", "coulomb") == Approx(0.5).margin(0.01));
}

}  // namespace bristle_test::test_experiments_spin
