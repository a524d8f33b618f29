// The helper behind setters of options.
#pragma once

namespace bristle {
namespace detail {

/// Sets a field of `options` and returns them, so that setters can be chained.
template <class Options, class Field>
constexpr Options& set(Options& options, Field& field, const Field& value) {
  field = value;
  return options;
}

}  // namespace detail
}  // namespace bristle
