// Finds the kernels of beds and joints of an instruction set.
#include "core/bed_table.hpp"

namespace bristle::detail {

#if BRISTLE_HAS_AVX512
extern const BedKernels bed_kernels_avx512;
#endif
#if BRISTLE_HAS_AVX2
extern const BedKernels bed_kernels_avx2;
#endif
#if BRISTLE_HAS_SSE2
extern const BedKernels bed_kernels_sse2;
#endif
#if BRISTLE_HAS_NEON64
extern const BedKernels bed_kernels_neon64;
#endif
extern const BedKernels bed_kernels_scalar;

namespace {

const BedKernels* const kernels[] = {
#if BRISTLE_HAS_AVX512
    &bed_kernels_avx512,
#endif
#if BRISTLE_HAS_AVX2
    &bed_kernels_avx2,
#endif
#if BRISTLE_HAS_SSE2
    &bed_kernels_sse2,
#endif
#if BRISTLE_HAS_NEON64
    &bed_kernels_neon64,
#endif
    &bed_kernels_scalar,
};

bool same_text(const char* a, const char* b) {
  while (*a != '\0' && *a == *b) {
    ++a;
    ++b;
  }
  return *a == *b;
}

}  // namespace

const BedKernels* find_bed_kernels(const char* name) noexcept {
  for (const BedKernels* k : kernels)
    if (same_text(k->name, name)) return k;
  return nullptr;
}

}  // namespace bristle::detail
