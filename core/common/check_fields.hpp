// Checks and compares structs of parameters by the list of their fields (bristle/fields.hpp).
#pragma once

#include <string>
#include <type_traits>

#include "bristle/fields.hpp"
#include "core/common/range_check.hpp"

namespace bristle::detail {

/// Checks a number or an enumeration against its range.
template <class Value>
void require_field(const char* where, const std::string& name, const Value& value, const AboutField& about) {
  const double number = static_cast<double>(value);
  if ((number >= about.least && number <= about.most) || (about.or_zero && number == 0.0)) return;
  if (about.names == nullptr)
    require_within(where, name, number, about.least, about.most,
                   std::string(about.unit) + (about.or_zero ? ", or 0" : ""));
  std::string all;
  for (unsigned i = 0; i < about.name_count; ++i)
    all += (i == 0 ? "" : ", ") + std::string(about.names[i]) + " (" + std::to_string(i) + ")";
  refuse(where, name, number, all);
}

/// Checks each field of `values` against its own range, and throws Error for the first one outside. `prefix`:
/// text in front of the field's name in the error, for a struct within another.
template <class Owner>
void require_fields(const char* where, const Owner& values, const std::string& prefix = "") {
  for_each_field<Owner>([&](const auto& field) {
    const auto& value = values.*field.member;
    using Value = std::decay_t<decltype(value)>;
    using Member = std::remove_cvref_t<decltype(value)>;
    const auto name = [&] { return prefix + field.name; };
    if constexpr (std::is_array_v<Member>) {
      for (std::size_t i = 0; i < std::extent_v<Member>; ++i)
        require_field(where, name() + "[" + std::to_string(i) + "]", value[i], field.about);
    } else if constexpr (std::is_enum_v<Value> || std::is_arithmetic_v<Value>) {
      require_field(where, name(), value, field.about);
    } else if constexpr (requires { Fields<Value>::all; }) {
      require_fields(where, value, name() + ".");
    }
  });
}

template <class Owner>
bool same_fields(const Owner& x, const Owner& y) noexcept {
  bool same = true;
  for_each_field<Owner>([&](const auto& field) { same = same && x.*field.member == y.*field.member; });
  return same;
}

}  // namespace bristle::detail
