// Step time against bristles, as a chart of the page.
#include <map>
#include <vector>

#include <fmt/format.h>

#include "tools/reports/charts.hpp"
#include "tools/reports/numbers.hpp"
#include "tools/reports/point_chart.hpp"

namespace cli {

std::string capacity_chart(const Json& capacity) {
  using Mark = PointSeries::Mark;
  // Three motions that bracket all others; more curves would hide each other.
  struct Shown {
    const char *motion, *kernel, *name, *colour;
    Mark mark;
  };
  static constexpr Shown shown[] = {
      {"presliding", "2 axes, keep, end, single", "presliding", "#56B4E9", Mark::dot},
      {"all snap", "2 axes, keep, end + mean, single", "all snap", "#0072B2", Mark::diamond},
      {"one snap", "default material", "default material, one snap", "#D55E00", Mark::square}};
  PointChart chart{"Time of a step, 99th of 100, one thread", "bristles", "step time, us", {}, {}};
  for (const Shown& s : shown) {
    PointSeries series{s.name, s.colour, s.mark, true, {}};
    double last = 0.0;
    for (const Json& row : capacity.at("capacities")) {
      if (text_of(row, "motion") != s.motion || !text_of(row, "kernel").starts_with(s.kernel) ||
          text_of(row, "layout") != "one patch" || row.at("threads").get<int>() != 1 ||
          !row.contains("curve"))
        continue;
      for (const Json& point : row.at("curve")) {
        const double bristles = point.at("bristles").get<double>(), p99 = point.at("p99_s").get<double>();
        if (!(bristles > 1.3 * last && bristles < 1e15)) continue;  // the search looks closely around its end
        last = bristles;
        series.points.push_back(
            {bristles, 1e6 * p99,
             fmt::format("{} bristles, {}: {} (p99)", count_text(static_cast<unsigned long long>(bristles)),
                         s.name, time_text(p99))});
      }
      break;
    }
    chart.series.push_back(std::move(series));
  }
  const double deadline = capacity.at("deadline_s").get<double>();
  chart.guides.push_back({false, 1e6 * deadline, "deadline " + time_text(deadline)});
  return point_chart_svg(chart);
}

}  // namespace cli
