// The floating-point mode of the kernels: round to nearest, denormals flushed to zero. A call of the library
// sets it and restores the caller's mode at its end, so that neither mode changes the results of the other's
// code.
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
  // Restores control word and status flags, which drops flags raised since.
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
  // Control word of SSE in kernels: all exceptions masked, round to nearest, flush to zero, denormals are
  // zero.
  static constexpr unsigned kernel_mode = 0x1F80u | 0x8000u | 0x0040u;
  unsigned before_;
#elif defined(__aarch64__)
  std::uint64_t before_;
#endif
};

}  // namespace bristle::detail
