// BRISTLE_ASSERT(condition): states what holds unless the library itself is wrong. It is not for input, which
// is refused in every build.
//
// On in debug builds and in the sanitizer presets (CMake option BRISTLE_ASSERTS). Off, the condition is
// compiled but not evaluated: no instruction. Kernels may include this: it defines no function, so no inline
// function is shared between objects of different instruction sets.
#pragma once

#if BRISTLE_ASSERTS

#include "core/include/bristle/export.hpp"

namespace bristle::detail {

/// Prints condition, file and line on stderr and aborts.
[[noreturn]] BRISTLE_API void report_failed_assert(const char* condition, const char* file,
                                                   int line) noexcept;

}  // namespace bristle::detail

#define BRISTLE_ASSERT(condition)     \
  ((condition) ? static_cast<void>(0) \
               : ::bristle::detail::report_failed_assert(#condition, __FILE__, __LINE__))

#else

#define BRISTLE_ASSERT(condition) static_cast<void>(sizeof((condition) ? 1 : 0))

#endif
