// The scalars of a saved state, listed once. A function `..._fields(state, visit)` calls
// `visit(value, rule)` for each, in the order of the saved bytes. Save, restore, the check of foreign bytes
// and the hash are visitors of these lists, so they cannot disagree. Caches are in no list; reset and copy
// treat the struct as a whole.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "core/common/hashing.hpp"
#include "core/common/little_endian.hpp"
#include "core/patches/patch.hpp"

namespace bristle::detail {

/// Part of a saved value that enters the hash of a state.
enum class Hashed : unsigned char {
  value,      ///< the value itself
  high_half,  ///< the value as the upper half of a word, whose lower half is the next value
  position,   ///< the patch's position less the value, so that equal states at two positions have one hash
  time,       ///< the patch's time less the value
  apart       ///< nothing: the value follows from others, or the model's hash function adds it itself
};

struct FieldRule {
  const char* name = nullptr;                               ///< name of the value in an error
  double least = -std::numeric_limits<double>::infinity();  ///< least value that a patch can have
  double most = std::numeric_limits<double>::infinity();    ///< largest value that a patch can have
  Hashed hashed = Hashed::value;
  int axis = 0;        ///< axis of a position
  bool whole = false;  ///< whether only whole numbers are allowed, though the value is floating
};
constexpr FieldRule positioned(int axis) noexcept { return {.hashed = Hashed::position, .axis = axis}; }

/// Returns whether a saved number is in its range; NaN never is.
inline bool within(double value, double low, double high) noexcept { return value >= low && value <= high; }

/// Returns whether a saved value is in the range that its rule names. Compares whole numbers exactly, without
/// rounding to double; a rule with a name has finite limits for them.
template <class Number>
bool is_allowed(const Number& value, const FieldRule& rule) noexcept {
  if constexpr (std::is_floating_point_v<Number>)
    return within(static_cast<double>(value), rule.least, rule.most) &&
           (!rule.whole || value == std::floor(value));
  else
    return value >= static_cast<Int128>(rule.least) && value <= static_cast<Int128>(rule.most);
}

/// Visitor that reads saved values and notes the name of the first one out of its range.
struct FieldCheck {
  ByteReader& read;
  const char* fault = nullptr;

  template <class Number>
  void operator()(Number& value, const FieldRule& rule = {}) noexcept {
    read(value);
    if (fault == nullptr && rule.name != nullptr && !is_allowed(value, rule)) fault = rule.name;
  }
};

/// Returns the latest time, s, that a value of a saved patch can have; a later one means damaged bytes. A
/// step's end is the rounded sum of its start and its length, while the clock counts the length in whole
/// units, cut off, so the two differ by at most a unit and three roundings.
inline double latest_time_of(const Patch& contact) noexcept {
  return time_of(contact) * (1.0 + 0x1p-50) + 1.0 / clock_units_per_second;
}

/// Visitor that adds saved values of a patch to a hash.
struct FieldHash {
  Hasher& hasher;
  const Patch& patch;
  std::uint64_t high = 0;

  template <class Number>
  void operator()(const Number& value, const FieldRule& rule = {}) noexcept {
    if (rule.hashed == Hashed::apart) return;
    if constexpr (std::is_same_v<Number, double>) {
      hasher.add(rule.hashed == Hashed::time ? time_of(patch) - value : value);
    } else if constexpr (std::is_same_v<Number, std::int64_t>) {
      hasher.add(static_cast<std::uint64_t>(difference(patch.position[rule.axis], value)));
    } else if constexpr (std::is_unsigned_v<Number>) {
      const bool half = rule.hashed == Hashed::high_half;
      if (!half) hasher.add(high | value);
      high = half ? std::uint64_t{value} << 32 : 0;
    }
  }
};

}  // namespace bristle::detail
