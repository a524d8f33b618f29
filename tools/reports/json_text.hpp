// JSON of files that anybody may have written.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace cli {

/// Parses JSON of at most 64 levels: deeper values would end the library's recursion in a crash. `what` opens the
/// message of the UserError that anything else throws.
nlohmann::json parse_json(const std::string& text, const std::string& what);

}  // namespace cli
