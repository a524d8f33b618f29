// Lists the instruction sets for which this build has kernels, best first, and says which of them this
// machine supports.
#include "core/kernel_table.hpp"

namespace bristle::detail {

// Declares the kernel tables of this build. Each kernel object exports its table and nothing else.
#if BRISTLE_HAS_AVX512
extern const KernelTable kernels_avx512;
#endif
#if BRISTLE_HAS_AVX2
extern const KernelTable kernels_avx2;
#endif
#if BRISTLE_HAS_SSE2
extern const KernelTable kernels_sse2;
#endif
#if BRISTLE_HAS_NEON64
extern const KernelTable kernels_neon64;
#endif
extern const KernelTable kernels_scalar;

namespace {

[[maybe_unused]] bool always() { return true; }

// Asks the compiler's CPU test, which also checks that the operating system saves the wide registers.
#if BRISTLE_HAS_AVX512
bool has_avx512() {
  return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512cd") &&
         __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw");
}
#endif
#if BRISTLE_HAS_AVX2
bool has_avx2() { return __builtin_cpu_supports("avx2"); }
#endif

const KernelEntry entries[] = {
#if BRISTLE_HAS_AVX512
    {&kernels_avx512, &has_avx512},
#endif
#if BRISTLE_HAS_AVX2
    {&kernels_avx2, &has_avx2},
#endif
#if BRISTLE_HAS_SSE2
    {&kernels_sse2, &always},
#endif
#if BRISTLE_HAS_NEON64
    {&kernels_neon64, &always},
#endif
    {&kernels_scalar, &always},
};

}  // namespace

const KernelEntry* kernel_entries(int* count) noexcept {
  *count = static_cast<int>(sizeof entries / sizeof entries[0]);
  return entries;
}

}  // namespace bristle::detail
