// Finds the infinite brush's kernels of an instruction set.
#include "core/cohort_table.hpp"

namespace bristle::detail {

#if BRISTLE_HAS_AVX512
extern const CohortKernels cohort_kernels_avx512;
#endif
#if BRISTLE_HAS_AVX2
extern const CohortKernels cohort_kernels_avx2;
#endif
#if BRISTLE_HAS_SSE2
extern const CohortKernels cohort_kernels_sse2;
#endif
#if BRISTLE_HAS_NEON64
extern const CohortKernels cohort_kernels_neon64;
#endif
extern const CohortKernels cohort_kernels_scalar;

namespace {

const CohortKernels* const kernels[] = {
#if BRISTLE_HAS_AVX512
    &cohort_kernels_avx512,
#endif
#if BRISTLE_HAS_AVX2
    &cohort_kernels_avx2,
#endif
#if BRISTLE_HAS_SSE2
    &cohort_kernels_sse2,
#endif
#if BRISTLE_HAS_NEON64
    &cohort_kernels_neon64,
#endif
    &cohort_kernels_scalar,
};

bool same_text(const char* a, const char* b) {
  while (*a != '\0' && *a == *b) {
    ++a;
    ++b;
  }
  return *a == *b;
}

}  // namespace

const CohortKernels* find_cohort_kernels(const char* name) noexcept {
  for (const CohortKernels* k : kernels)
    if (same_text(k->name, name)) return k;
  return nullptr;
}

}  // namespace bristle::detail
