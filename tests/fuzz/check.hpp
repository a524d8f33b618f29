// Asserts of a fuzz target, active in every build.
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
