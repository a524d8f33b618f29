// Reads numbers from text. All tools use it, so that they agree on what a number is.
#pragma once

#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>
#include <system_error>
#include <type_traits>

namespace cli {

/// Reads a number at the beginning of a text and removes it from the text. Returns nothing, and leaves the
/// text as it is, if there is no number or one that `T` cannot hold: not finite, too large, with a fraction
/// where `T` is whole. A sign + is allowed.
template <class T>
std::optional<T> take_number(std::string_view& text) {
  std::string_view digits = text;
  if (digits.size() > 1 && digits[0] == '+' && digits[1] != '-') digits.remove_prefix(1);
  T value{};
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc()) return std::nullopt;
  if constexpr (std::is_floating_point_v<T>)
    if (!std::isfinite(value)) return std::nullopt;
  text = digits.substr(static_cast<std::size_t>(end - digits.data()));
  return value;
}

/// Reads a text that consists of one number and nothing else.
template <class T>
std::optional<T> number_in(std::string_view text) {
  const std::optional<T> value = take_number<T>(text);
  return text.empty() ? value : std::nullopt;
}

/// Largest whole number up to which double precision represents every whole number.
constexpr long long most_whole_double = 1LL << 53;

}  // namespace cli
