// Meaning of `--vary KEY=RANGE`: a key of a scene, and the values it takes.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace cli {

/// A value of a varied key: a whole number, a number, or a text. A text that begins with [, { or a quote is
/// TOML.
using SweepValue = nlohmann::json;

struct VariedKey {
  std::string key;                 ///< dotted path into the scene: sweep/override.hpp
  std::string range;               ///< as it was given
  std::vector<SweepValue> values;  ///< of a list, or of a range with a number of values; else empty
  double from = 0.0, to = 0.0;     ///< of a range without one: any value between these
  bool logarithmic = false;
  bool whole = false;  ///< rounded to whole numbers

  /// At `share` of the way, in [0, 1): a value between the ends, or the list's value at that share of it.
  SweepValue at(double share) const;
};

/// "KEY=a:b:n", "KEY=a:b" (for samples), each with ":log" and ":int" behind it; "KEY=v1,v2,...". Values of a
/// range are rounded to twelve digits, so that they are the same whatever the machine's libm. Throws
/// UserError.
VariedKey parse_varied(const std::string& text);

/// "KEY=VALUE". Throws UserError.
VariedKey parse_setting(const std::string& text, const std::string& option);

}  // namespace cli
