// Refuses values out of range by throwing bristle::Error. Its text has parameter, value and allowed range,
// with numbers in the shortest form that reads back to the same double.
#pragma once

#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

#include "bristle/error.hpp"

namespace bristle::detail {

inline std::string number_text(double value) {
  char text[32];
#if defined(__cpp_lib_to_chars) || defined(__GLIBCXX__)
  const auto result = std::to_chars(text, text + sizeof text, value);
  return std::string(text, result.ptr);
#else  // libc++ before 14, as in Debian's emscripten, has no std::to_chars for floating numbers
  for (int digits = 6; digits <= 17; ++digits) {
    std::snprintf(text, sizeof text, "%.*g", digits, value);
    if (std::strtod(text, nullptr) == value) break;
  }
  return text;
#endif
}

/// Throws Error with the text "<where>: <parameter> = <value>; allowed is <range>".
[[noreturn]] inline void refuse(std::string_view where, std::string_view parameter, double value,
                                std::string_view range) {
  std::string text(where);
  text.append(": ").append(parameter).append(" = ").append(number_text(value));
  text.append("; allowed is ").append(range);
  throw Error(text);
}

/// Throws Error unless low <= value <= high. Refuses NaN as well, which no comparison finds within a range.
inline void require_within(std::string_view where, std::string_view parameter, double value, double low,
                           double high, std::string_view unit = {}) {
  if (value >= low && value <= high) return;
  std::string range = number_text(low) + " to " + number_text(high);
  if (!unit.empty()) range.append(" ").append(unit);
  refuse(where, parameter, value, range);
}

}  // namespace bristle::detail
