// Makes the tables of a report of `bristle accuracy` from the report's JSON (schema bristle-accuracy-1).
#include "tools/libraries/reports/report_tables.hpp"

namespace cli {

Table settings_table(const Json& accuracy, bool front_only) {
  JsonColumn front = {"<front", [](const Json& s) { return Cell(s.at("pareto").get<bool>() ? "*" : ""); }};
  if (front_only) front = only_wide(front);
  // Columns of the table. They are made in each call, because their texts depend on the width of the
  // terminal.
  const std::vector<JsonColumn> columns = {
      {"<bristles", [](const Json& s) { return Cell(setting_bristles(s)); }},
      column("dt", "/dt_s", "time"),
      column("<rule", "/step_rule"),
      column("<precision", "/precision"),
      column("<force", "/force"),
      column("error rms %", "/error/rms", "percent"),
      only_wide(column("+-", "/error/rms_standard_error", "percent")),
      only_wide(column("max %", "/error/max", "percent")),
      only_wide(column("energy %", "/error/energy", "percent")),
      column("us a scene step", "/scene_step_s", "", 1e6),
      only_wide(column("us a step", "/step_s/median", "", 1e6)),
      only_wide(column("quartiles", "/step_s/quartiles", "range", 1e6)),
      only_wide(column("ns a bristle", "/ns_per_bristle")),
      front};
  Json rows = Json::array();
  for (const Json& setting : accuracy.at("settings")) {
    if (!front_only || setting.at("pareto").get<bool>()) rows.push_back(setting);
  }
  return tabulate(rows, columns);
}

Table slopes_table(const Json& accuracy) {
  static const std::vector<JsonColumn> columns = {
      column("<patch", "/patch"),           column("<error against", "/against"),
      column("slope", "/slope", "{:+.2f}"), column("+-", "/standard_error", "{:.2f}"),
      column("points", "/points"),          column("<theory", "/theory")};
  return tabulate(accuracy.at("slopes"), columns);
}

}  // namespace cli
