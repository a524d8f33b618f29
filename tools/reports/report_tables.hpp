// Makes the tables of the reports, each declared once over the rows of a JSON report. Functions throw
// nlohmann::json::exception if the report lacks something.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "tools/reports/table.hpp"

namespace cli {

using Json = nlohmann::ordered_json;
using JsonColumn = Column<Json>;

std::string text_of(const Json& json, const char* key);
/// Make a column of texts from the report, and one of numbers with three digits.
JsonColumn text_column(std::string header, const char* key);
JsonColumn number_column(std::string header, const char* key, double scale = 1.0);

// Tables of `bristle capacity` (schema bristle-capacity-1).
Table targets_table(const Json& capacity);
Table capacities_table(const Json& capacity);
Table comparisons_table(const Json& capacity);
Table infinite_table(const Json& capacity);
Table contacts_table(const Json& capacity);
/// Returns the number of bristles that meet the deadline, such as "> 1,234"; the reason, if none does.
std::string bristles_that_fit(const Json& row);
/// Returns whether other work of the machine caused the row's 99th percentile, as the median is far inside
/// the deadline.
bool was_busy(const Json& row, double deadline_s);
/// Returns the report's result in a sentence that also says whether to trust it.
std::string capacity_answer(const Json& capacity);

// Tables of `bristle accuracy` (schema bristle-accuracy-1).
Table settings_table(const Json& accuracy, bool front_only);
Table slopes_table(const Json& accuracy);
Table scene_features_table(const Json& accuracy);
std::string setting_bristles(const Json& setting);

// Tables of `bristle stability` (schema bristle-stability-1).
Table maps_table(const Json& stability);
Table varied_table(const Json& stability);
/// Returns the table of stopping distances: a row for each stiffness k and distance, a column for each
/// scheme.
Table stops_table(const Json& stability);

}  // namespace cli
