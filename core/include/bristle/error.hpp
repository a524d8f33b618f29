// The one exception type of the set-up calls. `PatchBatch::step` never throws.
#pragma once

#include <stdexcept>
#include <string>

namespace bristle {

/// Thrown by set-up calls. what() names the parameter, its value and the allowed range.
class Error : public std::runtime_error {
 public:
  explicit Error(const std::string& message) : std::runtime_error(message) {}
};

}  // namespace bristle
