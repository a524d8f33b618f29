#include "tools/libraries/sweep/range.hpp"

#include <cmath>
#include <cstdlib>
#include <optional>
#include <string_view>

#include <fmt/format.h>

#include "tools/libraries/files/csv_columns.hpp"
#include "tools/libraries/files/number_text.hpp"
#include "tools/libraries/files/user_error.hpp"

namespace cli {
namespace {

constexpr std::uint64_t most_values = 10'000'000;

SweepValue value_of(std::string_view text) {
  if (const auto whole = number_in<std::int64_t>(text)) return *whole;
  if (const auto number = number_in<double>(text)) return *number;
  return std::string(text);
}

/// Splits a list of values at its commas. Commas within brackets, braces or quotes do not count.
std::vector<std::string_view> split_list(std::string_view text) {
  std::vector<std::string_view> items;
  std::size_t begin = 0;
  int depth = 0;
  char quote = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (quote != 0) {
      if (c == quote) quote = 0;
    } else if (c == '"' || c == '\'') {
      quote = c;
    } else if (c == '[' || c == '{') {
      ++depth;
    } else if (c == ']' || c == '}') {
      --depth;
    } else if (c == ',' && depth == 0) {
      items.push_back(trim(text.substr(begin, i - begin)));
      begin = i + 1;
    }
  }
  items.push_back(trim(text.substr(begin)));
  return items;
}

std::vector<std::string_view> split_range(std::string_view text) {
  std::vector<std::string_view> parts;
  for (std::size_t colon; (colon = text.find(':')) != std::string_view::npos; text.remove_prefix(colon + 1))
    parts.push_back(trim(text.substr(0, colon)));
  parts.push_back(trim(text));
  return parts;
}

/// Rounds a value to twelve digits, so that it is equal on all machines. Takes long double, because glibc's
/// pow of that type does not depend on the CPU.
double rounded(long double value) {
  return std::strtod(fmt::format("{:.12g}", static_cast<double>(value)).c_str(), nullptr);
}

double between(double first, double last, bool logarithmic, long double share) {
  const long double from = first, to = last;
  if (share == 0.0L) return first;
  if (share == 1.0L) return last;
  return rounded(logarithmic ? from * std::pow(to / from, share) : from + share * (to - from));
}

[[noreturn]] void refuse(const std::string& text, const std::string& why) {
  throw UserError(fmt::format("--vary {}: {}", text, why));
}

constexpr const char* forms =
    "allowed: KEY=FROM:TO:NUMBER, with :log and :int behind it, or KEY=VALUE,VALUE,...";

VariedKey parse_range(VariedKey varied, const std::vector<std::string_view>& parts, const std::string& text) {
  const double from = *number_in<double>(parts[0]), to = *number_in<double>(parts[1]);
  bool logarithmic = false, rounded_to_whole = false;
  std::optional<std::uint64_t> count;
  for (std::size_t i = 2; i < parts.size(); ++i) {
    if (parts[i] == "log") {
      logarithmic = true;
    } else if (parts[i] == "int") {
      rounded_to_whole = true;
    } else if (i == 2 && number_in<std::uint64_t>(parts[i])) {
      count = *number_in<std::uint64_t>(parts[i]);
    } else {
      refuse(text, fmt::format("'{}' is none of a number of values, log, int; {}", parts[i], forms));
    }
  }
  if (logarithmic && !(from > 0.0 && to > 0.0)) refuse(text, "a logarithmic range needs both ends above 0");
  if (rounded_to_whole && !(std::abs(from) <= 9e15 && std::abs(to) <= 9e15))
    refuse(text, "whole numbers go from -9e15 to 9e15");
  if (!count) refuse(text, fmt::format("has no number of values; {}", forms));
  if (*count < 1 || *count > most_values)
    refuse(text, fmt::format("the number of values is {}; allowed: 1 to {}", *count, most_values));
  // Stores the values as integers, which keys for integers need, if both ends are written as integers and all
  // values between are whole; with `:int` rounds them to integers.
  const bool whole_ends = number_in<std::int64_t>(parts[0]) && number_in<std::int64_t>(parts[1]);
  bool whole = whole_ends;
  for (std::uint64_t i = 0; i < *count; ++i) {
    const long double share =
        *count == 1 ? 0.0L : static_cast<long double>(i) / static_cast<long double>(*count - 1);
    const double value = between(from, to, logarithmic, share);
    varied.values.push_back(value);
    whole = whole && std::rint(value) == value;
  }
  if (whole || rounded_to_whole)
    for (SweepValue& value : varied.values)
      value = static_cast<std::int64_t>(std::llround(value.get<double>()));
  return varied;
}

}  // namespace

VariedKey parse_varied(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || trim(std::string_view(text).substr(0, equals)).empty() ||
      trim(std::string_view(text).substr(equals + 1)).empty())
    refuse(text, forms);
  VariedKey varied;
  varied.key = std::string(trim(std::string_view(text).substr(0, equals)));
  const std::string_view range = trim(std::string_view(text).substr(equals + 1));
  varied.range = std::string(range);
  const std::vector<std::string_view> parts = split_range(range);
  if (parts.size() >= 2 && number_in<double>(parts[0]) && number_in<double>(parts[1]))
    return parse_range(std::move(varied), parts, text);
  const std::size_t dots = range.find("..");
  if (dots != std::string_view::npos && number_in<double>(range.substr(0, dots)))
    refuse(text, fmt::format("'..' makes no range; {}", forms));
  for (const std::string_view item : split_list(range)) {
    if (item.empty()) refuse(text, "has an empty value in its list");
    varied.values.push_back(value_of(item));
  }
  return varied;
}

VariedKey parse_setting(const std::string& text, const std::string& option) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || trim(std::string_view(text).substr(0, equals)).empty() ||
      equals + 1 == text.size())
    throw UserError(fmt::format("{} {}: allowed: KEY=VALUE", option, text));
  VariedKey setting;
  setting.key = std::string(trim(std::string_view(text).substr(0, equals)));
  setting.range = std::string(trim(std::string_view(text).substr(equals + 1)));
  setting.values.push_back(value_of(setting.range));
  return setting;
}

}  // namespace cli
