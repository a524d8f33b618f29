// Makes the tables in reports of `bristle stability` from their JSON (schema bristle-stability-1).
#include <algorithm>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "tools/libraries/reports/numbers.hpp"
#include "tools/libraries/reports/report_tables.hpp"

namespace cli {
namespace {

std::string share_text(double part, double whole) {
  return whole > 0.0 ? fmt::format("{:.1f} %", 100.0 * part / whole) : "-";
}

std::string share_text(const Json& of, const char* part) {
  return share_text(of.at(part).get<double>(), of.at("cells").get<double>());
}

// Makes a column that counts the cells of a stability map whose field `key` has the given value.
JsonColumn cells_column(const char* header, const char* key, Json value) {
  return {header, [key, value](const Json& map) {
            const Json& cells = map.at("cells");
            return Cell(std::to_string(std::count_if(
                cells.begin(), cells.end(), [&](const Json& cell) { return cell.at(key) == value; })));
          }};
}

const std::vector<JsonColumn>& map_columns() {
  static const std::vector<JsonColumn> columns = {
      text_column("<scheme", "scheme"),
      text_column("<linear theory: stable", "linear_condition"),
      {"cells", [](const Json& map) { return Cell(std::to_string(map.at("cells").size())); }},
      cells_column("stable", "linear_stable", true),
      cells_column("settle", "verdict", "settles"),
      cells_column("ring", "verdict", "rings"),
      cells_column("grow", "verdict", "grows"),
      cells_column("without bound", "unbounded", true),
      {"agree", [](const Json& map) {
         return Cell(
             share_text(map.at("agreeing").get<double>(), static_cast<double>(map.at("cells").size())));
       }}};
  return columns;
}

// Adds two columns on a group of cells (`key`) of the stability map with swinging load: the number of cells,
// and how many of them come to rest.
void add_load_columns(std::vector<JsonColumn>& columns, const char* header, const char* key) {
  const auto of = [key](const Json& row) -> const Json& { return row.at("swinging_load").at(key); };
  columns.push_back({header, [of](const Json& row) { return Cell(number_text(of(row).at("cells"))); }});
  columns.push_back({"settle", [of](const Json& row) { return Cell(share_text(of(row), "settle")); }});
}

std::vector<JsonColumn> varied_columns() {
  std::vector<JsonColumn> columns = {
      text_column("<scheme", "scheme"),
      {"turned: cells", [](const Json& row) { return Cell(number_text(row.at("turned").at("cells"))); }},
      {"agree", [](const Json& row) { return Cell(share_text(row.at("turned"), "agreeing")); }}};
  add_load_columns(columns, "load 1/4 to 1: stable at all", "stable_at_all_loads");
  add_load_columns(columns, "at some", "stable_at_some");
  add_load_columns(columns, "at none", "stable_at_none");
  return columns;
}

}  // namespace

Table maps_table(const Json& stability) {
  return tabulate(stability.at("maps"), map_columns(), 0, [](Table& table, const Json& map) {
    for (const auto& [why, count] : map.at("why_not").items())
      table.add_note(fmt::format("    {} not: {}", number_text(count), why));
  });
}

Table varied_table(const Json& stability) {
  static const std::vector<JsonColumn> columns = varied_columns();
  return tabulate(stability.at("varied"), columns);
}

Table stops_table(const Json& stability) {
  std::vector<std::string> schemes, headers = {"k", "way / mean snap length"};
  std::vector<std::pair<std::string, std::string>> order;
  std::map<std::pair<std::string, std::string>, std::map<std::string, std::string>> ratios;
  for (const Json& row : stability.at("stopping_distances")) {
    const std::pair key{number_text(row.at("k")), number_text(row.at("way_over_mean_snap_length"))};
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
