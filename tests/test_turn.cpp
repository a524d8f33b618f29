// A turn of the motion by 90 and 180 degrees from steady sliding, in two dimensions (tests/data/turn_2d.csv).
#include <catch2/catch.hpp>

#include <cmath>

#include "expect.hpp"
#include "reference_table.hpp"
#include "steady_brush.hpp"

namespace bristle_test::test_turn {

TEST_CASE("After a turn the force along and across the new direction follow the tables", "[physics]") {
  const std::vector<Row> rows = read_table("turn_2d.csv");
  const std::uint32_t n = test_size(100000);
  // Direction of steady sliding before the turn, rad; oblique, so that no axis is special.
  const double start = 0.4;
  int points = 0;
  for (Precision precision : precisions()) {
    for (const char* turn : {"90", "180"}) {
      const double angle = start + std::stod(turn) * M_PI / 180.0;
      for (const NamedLaw& law : reference_laws()) {
        for (SnapRule rule : {SnapRule::keep, SnapRule::redraw}) {
          INFO(name_of(precision) << ", " << law.name << ", " << table_name(rule) << ", turn by " << turn);
          SteadyBrush brush(law.law, rule, n, 2, precision, true);
          brush.slide_to_steady(std::cos(start), std::sin(start));
          const double ex = std::cos(angle);
          const double ey = std::sin(angle);
          double y = 0.0;
          for (const Row& row : rows) {
            if (row.at("dist") != law.name || row.at("variant") != table_name(rule) ||
                row.at("turn_deg") != turn)
              continue;
            const double to = number(row, "y_over_dbar_after_turn");
            const Deflection f = brush.step((to - y) * ex, (to - y) * ey);
            y = to;
            INFO("y = " << y << " mean snap lengths after the turn");
            const double tolerance = brush.single() ? 1.5 / SteadyBrush::phases
                                                    : sampling_tolerance(number(row, "mc_se"), n, precision);
            // The deflection across the motion is what remains of the old one. After a turn to the left it
            // points right.
            expect_near(f.x * ex + f.y * ey, number(row, "f_parallel_ref"), tolerance, "deflection along");
            expect_near(f.x * ey - f.y * ex, number(row, "f_perp_ref"), tolerance, "deflection across");
            ++points;
          }
        }
      }
    }
  }
  CHECK(points == static_cast<int>(precisions().size()) * 180);
}

}  // namespace bristle_test::test_turn
