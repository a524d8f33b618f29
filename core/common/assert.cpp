#include "core/common/assert.hpp"

#include <cstdio>
#include <cstdlib>

#if BRISTLE_ASSERTS

namespace bristle::detail {

void report_failed_assert(const char* condition, const char* file, int line) noexcept {
  std::fprintf(stderr, "bristle: %s:%d: assert failed: %s\n", file, line, condition);
  std::fflush(stderr);
  std::abort();
}

}  // namespace bristle::detail

#endif
