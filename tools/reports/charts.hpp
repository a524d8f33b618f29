// Charts of the page, each from one JSON report, as SVG that stands in it; empty where the report has no
// points. nlohmann::json::exception where it lacks something.
#pragma once

#include <string>

#include "tools/reports/report_tables.hpp"

namespace cli {

std::string accuracy_chart(const Json& accuracy);
std::string capacity_chart(const Json& capacity);
/// One for each coupling.
std::string stability_charts(const Json& stability);

}  // namespace cli
