// Error against run time, as a chart of the page.
#include <algorithm>
#include <limits>
#include <vector>

#include <fmt/format.h>

#include "tools/reports/answers.hpp"
#include "tools/reports/charts.hpp"
#include "tools/reports/numbers.hpp"
#include "tools/reports/point_chart.hpp"

namespace cli {
namespace {

double figure(const Json& value, double scale) {
  return value.is_number() ? scale * value.get<double>() : std::numeric_limits<double>::quiet_NaN();
}

ChartPoint point_of(const Json& setting, const Json& run) {
  const Json& error = run.at("error").at("rms");
  return {figure(run.at("scene_step_s"), 1e6), figure(error, 100.0),
          fmt::format("{} %, {} us: {}", percent_text(error), number_text(run.at("scene_step_s"), 1e6),
                      setting_in_words(setting))};
}

}  // namespace

std::string accuracy_chart(const Json& accuracy) {
  using Mark = PointSeries::Mark;
  PointSeries front{"nothing faster is better", "#0072B2", Mark::dot, true, {}},
      others{"others", "#999999", Mark::dot, false, {}}, own{"as it is", "#000000", Mark::square, false, {}},
      best{"recommended", "#D55E00", Mark::ring, false, {}};
  for (const Json& setting : accuracy.at("settings")) {
    const ChartPoint point = point_of(setting, setting);
    if (setting.at("as_scene").get<bool>()) own.points.push_back(point);
    (setting.at("pareto").get<bool>() ? front : others).points.push_back(point);
  }
  std::sort(front.points.begin(), front.points.end(),
            [](const ChartPoint& a, const ChartPoint& b) { return a.x < b.x; });
  // The front is of settings that the scene could take; one of the others may lie below it.
  const auto beats = [&](const ChartPoint& other) {
    return std::any_of(front.points.begin(), front.points.end(),
                       [&](const ChartPoint& p) { return other.x < p.x && other.y < p.y; });
  };
  if (std::any_of(others.points.begin(), others.points.end(), beats)) front.name = "best for this scene";
  const Json& recommendation = accuracy.at("recommendation");
  if (recommendation.at("found").get<bool>())
    best.points.push_back(point_of(recommendation.at("setting"), recommendation.at("confirmed")));
  return point_chart_svg({"Error against time: down and left is better",
                          "CPU time of a scene step, us",
                          "error of force, % rms",
                          {others, front, own, best},
                          {{false, 7.0, "people notice from 7 % up"}}});
}

}  // namespace cli
