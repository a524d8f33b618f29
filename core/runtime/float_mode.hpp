// Sets the floating-point mode of the kernels for the length of a call: round to nearest, denormals flushed
// to zero. The caller's mode returns at the end of the call. So a program's mode does not change the
// library's results, nor the library's mode the program's.
#pragma once

#include <cstdint>

#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

namespace bristle::detail {

class FloatModeScope {
 public:
#if defined(__SSE2__)
  FloatModeScope() noexcept : before_(_mm_getcsr()) {
    if (before_ != kernel_mode) _mm_setcsr(kernel_mode);
  }
  // Restores the caller's control word and status flags. Exceptions raised in the call leave no flag.
  ~FloatModeScope() { _mm_setcsr(before_); }
#elif defined(__aarch64__)
  FloatModeScope() noexcept {
    asm volatile("mrs %0, fpcr" : "=r"(before_));
    asm volatile("msr fpcr, %0" : : "r"(std::uint64_t{1} << 24));
  }
  ~FloatModeScope() { asm volatile("msr fpcr, %0" : : "r"(before_)); }
#else
  FloatModeScope() noexcept = default;
  ~FloatModeScope() = default;
#endif
  FloatModeScope(const FloatModeScope&) = delete;
  FloatModeScope& operator=(const FloatModeScope&) = delete;

 private:
#if defined(__SSE2__)
  // Control word of SSE during a call: all exceptions masked, round to nearest, flush to zero, denormals are
  // zero.
  static constexpr unsigned kernel_mode = 0x1F80u | 0x8000u | 0x0040u;
  unsigned before_;
#elif defined(__aarch64__)
  std::uint64_t before_;
#endif
};

}  // namespace bristle::detail
