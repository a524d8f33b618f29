#include "bristle/error.hpp"

namespace bristle {

Error::~Error() = default;

}  // namespace bristle
