// Names of the tables of functions of an instruction set: BRISTLE_TABLE(kernels_) is kernels_avx2, for
// example, or kernels_scalar.
#pragma once

#define BRISTLE_JOIN2(a, b) a##b
#define BRISTLE_JOIN(a, b) BRISTLE_JOIN2(a, b)
#if defined(BRISTLE_KERNEL_ISA)
#define BRISTLE_TABLE(kind) BRISTLE_JOIN(kind, BRISTLE_KERNEL_ISA)
#else
#define BRISTLE_TABLE(kind) BRISTLE_JOIN(kind, scalar)
#endif
