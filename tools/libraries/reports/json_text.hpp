// Parses JSON from files that may contain anything, within a limit of depth.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace cli {

/// Parses JSON nested at most 64 levels deep. On deeper values the JSON library would recurse until the stack
/// overflows. Throws a UserError that begins with `what`.
nlohmann::json parse_json(const std::string& text, const std::string& what);

}  // namespace cli
