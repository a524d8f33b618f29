// Version of the headers. `library_version()` gives that of the linked library. C includes the macros.
#pragma once

#include "bristle/export.hpp"

#define BRISTLE_VERSION_MAJOR 0
#define BRISTLE_VERSION_MINOR 1
#define BRISTLE_VERSION_PATCH 0

/// Version as one increasing number: 10000 major + 100 minor + patch.
#define BRISTLE_VERSION_NUMBER \
  (BRISTLE_VERSION_MAJOR * 10000 + BRISTLE_VERSION_MINOR * 100 + BRISTLE_VERSION_PATCH)

#ifdef __cplusplus
namespace bristle {

/// Returns "major.minor.patch" of the library that is linked. Thread-safe; the text lives for ever.
BRISTLE_API const char* library_version() noexcept;

}  // namespace bristle
#endif
