#include "bristle/version.hpp"

#define BRISTLE_TEXT(x) #x
#define BRISTLE_VERSION_TEXT(major, minor, patch) \
  BRISTLE_TEXT(major) "." BRISTLE_TEXT(minor) "." BRISTLE_TEXT(patch)

namespace bristle {

const char* library_version() noexcept {
  return BRISTLE_VERSION_TEXT(BRISTLE_VERSION_MAJOR, BRISTLE_VERSION_MINOR, BRISTLE_VERSION_PATCH);
}

}  // namespace bristle
