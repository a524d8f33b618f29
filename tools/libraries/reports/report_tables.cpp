#include "tools/libraries/reports/report_tables.hpp"

#include <fmt/format.h>

#include "tools/libraries/reports/numbers.hpp"

namespace cli {

std::string text_of(const Json& json, const char* key) { return json.at(key).get<std::string>(); }

JsonColumn text_column(std::string header, const char* key) {
  return {std::move(header), [key](const Json& row) { return Cell(text_of(row, key)); }};
}

JsonColumn number_column(std::string header, const char* key, double scale) {
  return {std::move(header), [key, scale](const Json& row) { return Cell(number_text(row.at(key), scale)); }};
}

JsonColumn only_wide(JsonColumn column) {
  column.where = JsonColumn::wide_only;
  return column;
}

std::string csv_text(const Json& rows, std::span<const CsvColumn> columns) {
  std::vector<JsonColumn> cells;
  for (const CsvColumn& column : columns) {
    cells.push_back({column.header,
                     [pointer = Json::json_pointer(column.pointer), scale = column.scale](const Json& row) {
                       const Json value = row.contains(pointer) ? row.at(pointer) : Json(nullptr);
                       if (value.is_null()) return Cell("");
                       if (value.is_boolean()) return Cell(value.get<bool>() ? "1" : "0");
                       if (value.is_string()) return Cell(value.get<std::string>());
                       if (value.is_number_integer()) return Cell(value.dump());
                       return Cell(fmt::format("{:.6g}", scale * value.get<double>()));
                     }});
  }
  return tabulate(rows, cells).csv();
}

}  // namespace cli
