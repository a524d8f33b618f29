// The page of `bristle fit`, made of its JSON report (bristle-fit-1) alone.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace cli {

std::string fit_report_page(const nlohmann::ordered_json& report, const std::string& record);

}  // namespace cli
