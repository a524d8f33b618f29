// An error that the person at the command line can put right: one clear line on stderr, exit code 2.
#pragma once

#include <stdexcept>

namespace cli {

class UserError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace cli
