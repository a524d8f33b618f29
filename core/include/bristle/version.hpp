// Version of the headers. `library_version()` gives that of the linked library.
#pragma once

#define BRISTLE_VERSION_MAJOR 0
#define BRISTLE_VERSION_MINOR 1
#define BRISTLE_VERSION_PATCH 0

namespace bristle {

/// "major.minor.patch" of the library that is linked. Thread-safe; the text lives for ever.
const char* library_version() noexcept;

}  // namespace bristle
