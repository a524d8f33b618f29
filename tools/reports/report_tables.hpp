// Makes the tables of the reports, each declared once over the rows of a JSON report. Throws
// nlohmann::json::exception if a report lacks something.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "tools/reports/table.hpp"

namespace cli {

using Json = nlohmann::ordered_json;
using JsonColumn = Column<Json>;

std::string text_of(const Json& json, const char* key);
/// Make a column of unchanged texts, and one of numbers with three digits.
JsonColumn text_column(std::string header, const char* key);
JsonColumn number_column(std::string header, const char* key, double scale = 1.0);

// Tables of a bristle-capacity-1 report.
Table targets_table(const Json& capacity);
Table capacities_table(const Json& capacity);
Table comparisons_table(const Json& capacity);
Table infinite_table(const Json& capacity);
Table contacts_table(const Json& capacity);
/// Returns a text such as "> 1,234"; if nothing fits, the reason.
std::string bristles_that_fit(const Json& row);
/// Returns whether other work of the machine dominates the row's p99, since the median is far inside the
/// deadline.
bool was_busy(const Json& row, double deadline_s);
/// Returns the report in a sentence, and whether to believe it.
std::string capacity_answer(const Json& capacity);

// Tables of a bristle-accuracy-1 report.
Table settings_table(const Json& accuracy, bool front_only);
Table slopes_table(const Json& accuracy);
Table scene_features_table(const Json& accuracy);
std::string setting_bristles(const Json& setting);

// Tables of a bristle-stability-1 report.
Table maps_table(const Json& stability);
Table varied_table(const Json& stability);
/// Returns a table with a row per k and distance, and a column per scheme.
Table stops_table(const Json& stability);

}  // namespace cli
