// Checks and compares structs of parameters by the list of their fields (bristle/fields.hpp).
#pragma once

#include <string>
#include <type_traits>

#include "bristle/fields.hpp"
#include "core/common/range_check.hpp"

namespace bristle::detail {

/// Checks each field of `values` against its own range, and throws Error for the first one outside. `prefix`:
/// text in front of the field's name in the error, for a struct within another.
template <class Owner>
void require_fields(const char* where, const Owner& values, const char* prefix = "") {
  for_each_field<Owner>([&](const auto& field) {
    const auto& value = values.*field.member;
    using Value = std::decay_t<decltype(value)>;
    const AboutField& about = field.about;
    if constexpr (std::is_enum_v<Value> || std::is_arithmetic_v<Value>) {
      const double number = static_cast<double>(value);
      if (number >= about.least && number <= about.most) return;
      const std::string name = std::string(prefix) + field.name;
      if (about.names == nullptr) require_within(where, name, number, about.least, about.most, about.unit);
      std::string all;
      for (unsigned i = 0; i < about.name_count; ++i)
        all += (i == 0 ? "" : ", ") + std::string(about.names[i]) + " (" + std::to_string(i) + ")";
      refuse(where, name, number, all);
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
