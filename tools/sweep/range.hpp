// Parses `--vary KEY=RANGE`: a key of a scene, and the values that it takes in a study.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace cli {

/// Value of a varied key: a whole number, a number, or a text. A text that begins with [, { or a quote is
/// read as TOML.
using SweepValue = nlohmann::json;

struct VariedKey {
  std::string key;                 ///< path of the key in the scene, such as "scene.dt" (sweep/override.hpp)
  std::string range;               ///< range as the user wrote it
  std::vector<SweepValue> values;  ///< values of a list or of a range "a:b:n"; empty for a range "a:b"
  double from = 0.0, to = 0.0;     ///< ends of a range "a:b", from which values are sampled
  bool logarithmic = false;
  bool whole = false;  ///< whether values are rounded to whole numbers

  /// Returns the value at `share` in [0, 1): between the ends of the range, or at that share of the list.
  SweepValue at(double share) const;
};

/// Parses what varies: "KEY=a:b:n" (n values), "KEY=a:b" (for samples), each optionally followed by ":log"
/// and ":int"; or "KEY=v1,v2,...". Rounds values of a range to twelve digits, which are the same with every
/// machine's libm. Throws UserError.
VariedKey parse_varied(const std::string& text);

/// Parses a setting "KEY=VALUE". Throws UserError.
VariedKey parse_setting(const std::string& text, const std::string& option);

}  // namespace cli
