// Parses JSON of files from unknown sources.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace cli {

/// Parses JSON of at most 64 levels; deeper values would overflow the stack in the library's recursion.
/// Throws a UserError that begins with `what`.
nlohmann::json parse_json(const std::string& text, const std::string& what);

}  // namespace cli
