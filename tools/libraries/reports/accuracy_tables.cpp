// Makes the tables of a report of `bristle accuracy` from the report's JSON (schema bristle-accuracy-1).
#include <fmt/format.h>

#include "tools/libraries/reports/numbers.hpp"
#include "tools/libraries/reports/report_tables.hpp"

namespace cli {
namespace {

JsonColumn error_column(const char* header, const char* key,
                        JsonColumn::Where where = JsonColumn::everywhere) {
  return {header, [key](const Json& row) { return Cell(percent_text(row.at("error").at(key))); }, where};
}

std::string two_places(const Json& value, const char* sign) {
  return value.is_null() ? "-"
                         : fmt::format(fmt::runtime(std::string("{:") + sign + ".2f}"), value.get<double>());
}

}  // namespace

Table settings_table(const Json& accuracy, bool front_only) {
  constexpr auto wide = JsonColumn::wide_only;
  // Columns of the table. They are made in each call, because their texts depend on the width of the
  // terminal.
  const std::vector<JsonColumn> columns = {
      {"<bristles", [](const Json& s) { return Cell(setting_bristles(s)); }},
      {"dt", [](const Json& s) { return Cell(time_text(s.at("dt_s").get<double>())); }},
      text_column("<rule", "step_rule"),
      text_column("<precision", "precision"),
      text_column("<force", "force"),
      error_column("error rms %", "rms"),
      error_column("+-", "rms_standard_error", wide),
      error_column("max %", "max", wide),
      error_column("energy %", "energy", wide),
      number_column("us a scene step", "scene_step_s", 1e6),
      {"us a step", [](const Json& s) { return Cell(number_text(s.at("step_s").at("median"), 1e6)); }, wide},
      {"quartiles", [](const Json& s) { return Cell(range_text(s.at("step_s").at("quartiles"), 1e6)); },
       wide},
      {"ns a bristle", [](const Json& s) { return Cell(number_text(s.at("ns_per_bristle"))); }, wide},
      {"<front", [](const Json& s) { return Cell(s.at("pareto").get<bool>() ? "*" : ""); },
       front_only ? wide : JsonColumn::everywhere}};
  Json rows = Json::array();
  for (const Json& setting : accuracy.at("settings")) {
    if (!front_only || setting.at("pareto").get<bool>()) rows.push_back(setting);
  }
  return tabulate(rows, columns);
}

Table slopes_table(const Json& accuracy) {
  static const std::vector<JsonColumn> columns = {
      text_column("<patch", "patch"),
      text_column("<error against", "against"),
      {"slope", [](const Json& row) { return Cell(two_places(row.at("slope"), "+")); }},
      {"+-", [](const Json& row) { return Cell(two_places(row.at("standard_error"), "")); }},
      number_column("points", "points"),
      text_column("<theory", "theory")};
  return tabulate(accuracy.at("slopes"), columns);
}

}  // namespace cli
