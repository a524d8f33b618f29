// Makes the tables of the commands' reports from their JSON, so that text and JSON cannot differ. Functions
// throw nlohmann::json::exception if the JSON lacks a value.
#pragma once

#include <span>
#include <string>

#include <nlohmann/json.hpp>

#include "tools/libraries/reports/table.hpp"

namespace cli {

using Json = nlohmann::ordered_json;
using JsonColumn = Column<Json>;

std::string text_of(const Json& json, const char* key);
/// Makes a column of a table from the value at a JSON pointer ("/error/rms") in each row of a report. Texts
/// stay as they are, null becomes "-". `form`: how a number is written: "" with three digits, "count" with
/// commas, "time" (s) with a unit, "percent" of a share, "range" of a pair, or a format of fmt ("{:.2f}").
JsonColumn column(std::string header, const char* pointer, const char* form = "", double scale = 1.0);
/// Returns a column that is shown only with --wide, when lines may have any length.
JsonColumn only_wide(JsonColumn column);

/// Returns a report as the text of its file. Bytes that are no UTF-8, which names of files may have, are
/// replaced.
std::string json_text(const Json& report);

/// Column of a CSV file of a report's rows: its header, the JSON pointer to its value ("/error/rms"), and a
/// factor.
struct CsvColumn {
  const char* header;
  const char* pointer;
  double scale = 1.0;
};
/// Returns rows as CSV: numbers with six digits, truth as 1 and 0, and nothing for null or a missing value.
std::string csv_text(const Json& rows, std::span<const CsvColumn> columns);

// Make the tables of `bristle capacity` from its JSON (schema bristle-capacity-1).
Table targets_table(const Json& capacity);
Table capacities_table(const Json& capacity);
Table comparisons_table(const Json& capacity);
Table infinite_table(const Json& capacity);
Table snapshots_table(const Json& capacity);
Table contacts_table(const Json& capacity);
/// Returns the largest number of bristles that meets the deadline, as text ("> 1,234"), or why there is none.
std::string bristles_that_fit(const Json& row);
/// Returns whether other programs spoilt a row: its 99th percentile misses although its median is far inside
/// the deadline.
bool was_busy(const Json& row, double deadline_s);
/// Returns the result of a capacity report in a sentence that also says whether to trust it.
std::string capacity_answer(const Json& capacity);

// Make the tables of `bristle accuracy` from its JSON (schema bristle-accuracy-1).
Table settings_table(const Json& accuracy, bool front_only);
Table slopes_table(const Json& accuracy);
std::string setting_bristles(const Json& setting);

// Make the tables of `bristle stability` from its JSON (schema bristle-stability-1).
Table maps_table(const Json& stability);
Table varied_table(const Json& stability);
/// Returns the table of stopping distances: a row for each dimensionless stiffness k and true distance, a
/// column for each integration scheme.
Table stops_table(const Json& stability);

}  // namespace cli
