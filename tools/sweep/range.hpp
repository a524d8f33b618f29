// Parses `--vary KEY=RANGE`: a key of a scene, and the values it takes.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace cli {

/// Value of a varied key: a whole number, a number, or a text. A text that begins with [, { or a quote is
/// TOML.
using SweepValue = nlohmann::json;

struct VariedKey {
  std::string key;                 ///< dotted path into the scene: sweep/override.hpp
  std::string range;               ///< range as the user wrote it
  std::vector<SweepValue> values;  ///< values of a list, or of a range with a number of values; else empty
  double from = 0.0, to = 0.0;     ///< ends of a range without a number of values
  bool logarithmic = false;
  bool whole = false;  ///< whether values are rounded to whole numbers

  /// Returns the value at `share` in [0, 1) of the range: between the ends, or that share along the list.
  SweepValue at(double share) const;
};

/// Parses "KEY=a:b:n", "KEY=a:b" (for samples), each optionally followed by ":log" and ":int"; or
/// "KEY=v1,v2,...". Values of a range are rounded to twelve digits, so that they are the same with every
/// machine's libm. Throws UserError.
VariedKey parse_varied(const std::string& text);

/// Parses "KEY=VALUE". Throws UserError.
VariedKey parse_setting(const std::string& text, const std::string& option);

}  // namespace cli
