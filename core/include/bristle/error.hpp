// The one exception type of the set-up calls. `PatchBatch::step` never throws.
#pragma once

#include <stdexcept>
#include <string>

#include "bristle/export.hpp"

namespace bristle {

/// Thrown by set-up calls. what() names the parameter, its value and the allowed range.
class BRISTLE_API Error : public std::runtime_error {
 public:
  explicit Error(const std::string& message) : std::runtime_error(message) {}
  Error(const Error&) = default;
  Error& operator=(const Error&) = default;
  ~Error() override;  // defined in the library, beside the single type information that handlers compare
};

}  // namespace bristle
