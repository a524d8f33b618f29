// Makes the tables of a report of `bristle stability` from the report's JSON (schema bristle-stability-1).
#include <algorithm>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "tools/libraries/reports/numbers.hpp"
#include "tools/libraries/reports/report_tables.hpp"

namespace cli {
namespace {

// Makes a column that counts the cells of a stability map whose field `key` has the given value.
JsonColumn cells_column(const char* header, const char* key, Json value) {
  return {header, [key, value](const Json& map) {
            const Json& cells = map.at("cells");
            return Cell(std::to_string(std::count_if(
                cells.begin(), cells.end(), [&](const Json& cell) { return cell.at(key) == value; })));
          }};
}

// Makes a column "part of group" that counts the cells of a group in a stability map, and how many of them
// behave as expected.
JsonColumn share_column(const char* header, const char* group, const char* part) {
  return {header, [part, at = Json::json_pointer(group)](const Json& row) {
            const Json& of = row.at(at);
            return Cell(number_text(of.at(part)) + " of " + number_text(of.at("cells")));
          }};
}

}  // namespace

Table maps_table(const Json& stability) {
  static const std::vector<JsonColumn> columns = {
      column("<scheme", "/scheme"),
      column("<linear theory: stable", "/linear_condition"),
      cells_column("stable", "linear_stable", true),
      cells_column("settle", "verdict", "settles"),
      cells_column("ring", "verdict", "rings"),
      cells_column("grow", "verdict", "grows"),
      column("agree %", "/fraction_agreeing", "{:.1f}", 100.0),
      only_wide(cells_column("without bound", "unbounded", true))};
  return tabulate(stability.at("maps"), columns, 0, [](Table& table, const Json& map) {
    for (const auto& [why, count] : map.at("why_not").items())
      table.add_note(fmt::format("    {} not: {}", number_text(count), why));
  });
}

Table varied_table(const Json& stability) {
  static const std::vector<JsonColumn> columns = {
      column("<scheme", "/scheme"), share_column("turned: as theory says", "/turned", "agreeing"),
      share_column("settle: stable at all loads", "/swinging_load/stable_at_all_loads", "settle"),
      share_column("stable at some", "/swinging_load/stable_at_some", "settle"),
      share_column("stable at none", "/swinging_load/stable_at_none", "settle")};
  return tabulate(stability.at("varied"), columns);
}

Table stops_table(const Json& stability) {
  std::vector<std::string> schemes, headers = {"k", "path / mean snap length"};
  std::vector<std::pair<std::string, std::string>> order;
  std::map<std::pair<std::string, std::string>, std::map<std::string, std::string>> ratios;
  for (const Json& row : stability.at("stopping_distances")) {
    const std::pair key{number_text(row.at("k")), number_text(row.at("path_over_mean_snap_length"))};
    const std::string scheme = text_of(row, "scheme");
    if (std::find(schemes.begin(), schemes.end(), scheme) == schemes.end()) schemes.push_back(scheme);
    if (!ratios.contains(key)) order.push_back(key);
    const Json& ratio = row.at("ratio");
    ratios[key][scheme] = !ratio.is_null() && ratio.get<double>() <= 1e3
                              ? fmt::format("{:.3f}", ratio.get<double>())
                              : "runs away";
  }
  headers.insert(headers.end(), schemes.begin(), schemes.end());
  Table table(headers);
  for (const auto& key : order) {
    std::vector<Cell> cells = {key.first, key.second};
    for (const std::string& scheme : schemes) {
      const auto found = ratios[key].find(scheme);
      cells.push_back(found == ratios[key].end() ? "-" : found->second);
    }
    table.add(std::move(cells));
  }
  return table;
}

}  // namespace cli
