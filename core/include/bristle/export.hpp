// Marks the exports of the shared library; everything else in it is hidden. Preprocessor only: C includes it
// too.
#pragma once

/// Marks what programs may link to. In a static library (target bristle::bristle defines BRISTLE_STATIC) it
/// has no effect, so that a plug-in that contains bristle does not export it to its host.
#if defined(BRISTLE_STATIC)
#define BRISTLE_API
#elif defined(_WIN32) && defined(bristle_EXPORTS) /* by CMake, while the DLL is built */
#define BRISTLE_API __declspec(dllexport)
#elif defined(_WIN32)
#define BRISTLE_API __declspec(dllimport)
#elif defined(__GNUC__)
#define BRISTLE_API __attribute__((visibility("default")))
#else
#define BRISTLE_API
#endif

/// Keeps a class inside an exported class from being exported with it.
#if defined(__GNUC__) && !defined(_WIN32)
#define BRISTLE_PRIVATE __attribute__((visibility("hidden")))
#else
#define BRISTLE_PRIVATE
#endif
