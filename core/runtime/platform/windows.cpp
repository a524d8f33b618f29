// The system's services on Windows.
#define WIN32_LEAN_AND_MEAN
#define NOMINMAX
#include <windows.h>
// After windows.h, which it needs.
#include <x86intrin.h>

#include "core/runtime/platform/platform.hpp"

namespace bristle::detail {

double monotonic_seconds() noexcept {
  LARGE_INTEGER count, rate;
  QueryPerformanceFrequency(&rate);
  QueryPerformanceCounter(&count);
  return static_cast<double>(count.QuadPart) / static_cast<double>(rate.QuadPart);
}

/// Returns the CPU time of the calling thread, s. Windows counts it in processor cycles; the ratio of wall
/// clock to cycle counter since the first call converts them.
double thread_seconds() noexcept {
  struct Start {
    double time = monotonic_seconds();
    std::uint64_t count = __rdtsc();
  };
  static const Start start;
  ULONG64 cycles = 0;
  const double elapsed = monotonic_seconds() - start.time;
  if (QueryThreadCycleTime(GetCurrentThread(), &cycles) == 0 || cycles == 0 || elapsed <= 0.0)
    return monotonic_seconds();  // without a thread clock every late tick counts as caused by this program
  return static_cast<double>(cycles) * elapsed / static_cast<double>(__rdtsc() - start.count);
}

ThreadEvents thread_events() noexcept { return {}; }

}  // namespace bristle::detail
