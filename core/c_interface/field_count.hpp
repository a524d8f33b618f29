// Counts the fields of a plain struct at compile time, so that the compiler refuses a field list that is too
// short.
#pragma once

#include <cstddef>
#include <utility>

namespace bristle::detail {

/// Converts to any type. As many of these as a struct has fields initialise it, whatever the types of the
/// fields, which is how they are counted.
struct Anything {
  template <class T>
  operator T() const;  // never called
};

template <class Struct, std::size_t... i>
constexpr bool takes(std::index_sequence<i...>) {
  return requires { Struct{(static_cast<void>(i), Anything{})...}; };
}

/// Returns the number of fields of an aggregate that has no arrays and no base classes.
template <class Struct, std::size_t count = 0>
constexpr std::size_t count_fields() {
  if constexpr (takes<Struct>(std::make_index_sequence<count + 1>{}))
    return count_fields<Struct, count + 1>();
  else
    return count;
}
template <class Struct>
constexpr std::size_t field_count = count_fields<Struct>();

}  // namespace bristle::detail
