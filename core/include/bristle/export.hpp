// Marks the exports of the shared library; everything else in it is hidden. Preprocessor only: C includes it
// too.
#pragma once

/// Marks what programs may link to. In a static library (target bristle::bristle defines BRISTLE_STATIC) it
/// has no effect, so that a plug-in that contains bristle does not export it to its host.
#if defined(BRISTLE_STATIC) || !defined(__GNUC__)
#define BRISTLE_API
#else
#define BRISTLE_API __attribute__((visibility("default")))
#endif
