// An error that the user can correct. `bristle` prints it as one clear line on stderr and exits with code 2.
#pragma once

#include <stdexcept>

namespace cli {

class UserError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace cli
