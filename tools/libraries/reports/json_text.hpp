// Parses JSON from files that may hold anything.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace cli {

/// Parses JSON nested at most 64 levels deep; on deeper values the recursion of the JSON library would
/// overflow the stack. Throws a UserError that begins with `what`.
nlohmann::json parse_json(const std::string& text, const std::string& what);

}  // namespace cli
