#include "tools/libraries/reports/report_tables.hpp"

#include <string_view>

#include <fmt/format.h>

#include "tools/libraries/reports/numbers.hpp"

namespace cli {

std::string text_of(const Json& json, const char* key) { return json.at(key).get<std::string>(); }

JsonColumn column(std::string header, const char* pointer, const char* form, double scale) {
  return {std::move(header),
          [at = Json::json_pointer(pointer), form = std::string_view(form), scale](const Json& row) -> Cell {
            const Json& value = row.at(at);
            if (value.is_string()) return value.get<std::string>();
            if (value.is_null() || form.empty()) return number_text(value, scale);
            if (form == "range") return range_text(value, scale);
            if (form == "count") return count_text(value.get<unsigned long long>());
            const double number = scale * value.get<double>();
            if (form == "time") return time_text(number);
            if (form == "percent") return percent_text(number);
            return fmt::format(fmt::runtime(form), number);
          }};
}

JsonColumn only_wide(JsonColumn column) {
  column.where = JsonColumn::wide_only;
  return column;
}

std::string json_text(const Json& report) {
  return report.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
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
