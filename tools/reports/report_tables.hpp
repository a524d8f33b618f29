// The tables of the reports, each declared once over the rows of a JSON report.
// nlohmann::json::exception where a report lacks something.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "tools/reports/table.hpp"

namespace cli {

using Json = nlohmann::ordered_json;
using JsonColumn = Column<Json>;

std::string text_of(const Json& json, const char* key);
/// A column of texts as they are, and one of numbers with three digits.
JsonColumn text_column(std::string header, const char* key);
JsonColumn number_column(std::string header, const char* key, double scale = 1.0);

// bristle-capacity-1
Table targets_table(const Json& capacity);
Table capacities_table(const Json& capacity);
Table comparisons_table(const Json& capacity);
Table infinite_table(const Json& capacity);
Table contacts_table(const Json& capacity);
/// "> 1,234"; of a row that has none, why.
std::string bristles_that_fit(const Json& row);
/// Whether the row's p99 says more of the machine than of bristle: the median is far inside the deadline.
bool was_busy(const Json& row, double deadline_s);
/// The report in a sentence, and whether to believe it.
std::string capacity_answer(const Json& capacity);

// bristle-accuracy-1
Table settings_table(const Json& accuracy, bool front_only);
Table slopes_table(const Json& accuracy);
Table scene_features_table(const Json& accuracy);
std::string setting_bristles(const Json& setting);

// bristle-stability-1
Table maps_table(const Json& stability);
Table varied_table(const Json& stability);
/// One row per k and way, one column per scheme.
Table stops_table(const Json& stability);

}  // namespace cli
