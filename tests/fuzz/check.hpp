// Assertion of a fuzz target, which stops the program in every build, with or without NDEBUG.
#pragma once

#include <cstdio>
#include <cstdlib>

namespace fuzz {

inline void check(bool right, const char* what) {
  if (right) return;
  std::fprintf(stderr, "not so: %s\n", what);
  std::abort();
}

}  // namespace fuzz
