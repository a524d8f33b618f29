#include "tools/libraries/reports/report_tables.hpp"

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

}  // namespace cli
