// Error that the user can correct: one clear line on stderr, exit code 2.
#pragma once

#include <stdexcept>

namespace cli {

class UserError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace cli
