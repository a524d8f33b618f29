// Checks that JSON reports hold what a page needs: one check for all kinds.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace cli {

/// `schema`: bristle-capacity-1, bristle-accuracy-1 or bristle-stability-1. Throws UserError that names the
/// file, the place in it, what stands there and what belongs there.
void check_report(const nlohmann::ordered_json& report, const std::string& schema, const std::string& file);

}  // namespace cli
