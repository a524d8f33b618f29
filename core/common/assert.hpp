// BRISTLE_ASSERT(condition) aborts if the condition is false, which only a fault of the library itself can
// cause. (Bad input of a caller is refused with an error instead, in every build.) Assertions are on in debug
// and sanitizer builds (CMake option BRISTLE_ASSERTS); elsewhere the condition is compiled but not evaluated.
// Kernels may include this header: it defines no function, so no inline function is shared between objects of
// different instruction sets.
#pragma once

#if BRISTLE_ASSERTS

#include "core/include/bristle/export.hpp"

namespace bristle::detail {

/// Reports a failed assertion: prints condition, file and line on stderr, and aborts.
[[noreturn]] BRISTLE_API void report_failed_assert(const char* condition, const char* file,
                                                   int line) noexcept;

}  // namespace bristle::detail

#define BRISTLE_ASSERT(condition)     \
  ((condition) ? static_cast<void>(0) \
               : ::bristle::detail::report_failed_assert(#condition, __FILE__, __LINE__))

#else

#define BRISTLE_ASSERT(condition) static_cast<void>(sizeof((condition) ? 1 : 0))

#endif
