// Marks the exports of the shared library; everything else in it is hidden. Preprocessor only: C includes it
// too.
#pragma once

/// Marks classes and functions that programs may link to. In a static library (target bristle::bristle
/// defines BRISTLE_STATIC) the mark is empty; otherwise a plug-in that contains bristle would export it to
/// its host.
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

/// Hides a class that is declared inside an exported class, which would be exported with it.
#if defined(__GNUC__) && !defined(_WIN32)
#define BRISTLE_PRIVATE __attribute__((visibility("hidden")))
#else
#define BRISTLE_PRIVATE
#endif
