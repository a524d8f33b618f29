// Parses the option `--vary KEY=RANGE`: a key of a scene, and the values that it takes in a study.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace cli {

/// Value that a varied key takes: a whole number, a number or a text. A text that begins with [, { or a quote
/// is read as a TOML value.
using SweepValue = nlohmann::json;

struct VariedKey {
  std::string key;                 ///< path of the key in the scene, such as "scene.dt" (override.hpp)
  std::string range;               ///< range as written by the user
  std::vector<SweepValue> values;  ///< values of a list or of "a:b:n", at least one
};

/// Parses an argument of --vary: "KEY=a:b:n" (n values), optionally followed by ":log" and ":int", or
/// "KEY=v1,v2,...". Rounds the values of a range to twelve digits, which are the same with every machine's
/// libm. Throws UserError.
VariedKey parse_varied(const std::string& text);

/// Parses a fixed setting "KEY=VALUE". Throws a UserError that names `option`.
VariedKey parse_setting(const std::string& text, const std::string& option);

}  // namespace cli
