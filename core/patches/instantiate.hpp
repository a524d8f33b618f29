// BRISTLE_INSTANTIATE(f, g, ...): instantiates function templates for each number type of the build (float,
// double).
#pragma once

#include "bristle/config.hpp"

#if BRISTLE_WITH_DOUBLE
#define BRISTLE_INSTANTIATE_ONE(f)      \
  template decltype(f<float>) f<float>; \
  template decltype(f<double>) f<double>;
#else
#define BRISTLE_INSTANTIATE_ONE(f) template decltype(f<float>) f<float>;
#endif

// Defers the expansion of the next name in a list to another scan of the preprocessor, because a macro does
// not expand itself.
#define BRISTLE_NONE
#define BRISTLE_NEXT() BRISTLE_EACH
#define BRISTLE_EACH(f, ...) BRISTLE_INSTANTIATE_ONE(f) __VA_OPT__(BRISTLE_NEXT BRISTLE_NONE()(__VA_ARGS__))
#define BRISTLE_SCAN(...) BRISTLE_SCAN2(BRISTLE_SCAN2(BRISTLE_SCAN2(__VA_ARGS__)))
#define BRISTLE_SCAN2(...) BRISTLE_SCAN3(BRISTLE_SCAN3(BRISTLE_SCAN3(__VA_ARGS__)))
#define BRISTLE_SCAN3(...) __VA_ARGS__
#define BRISTLE_INSTANTIATE(...) BRISTLE_SCAN(BRISTLE_EACH(__VA_ARGS__))
