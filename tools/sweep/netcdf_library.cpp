#include "tools/sweep/netcdf_library.hpp"

#include <dlfcn.h>

#include <fmt/format.h>

#include "tools/files/user_error.hpp"

namespace cli {

NetcdfLibrary::NetcdfLibrary() : library_(dlopen(BRISTLE_NETCDF_LIBRARY, RTLD_NOW | RTLD_LOCAL)) {
  if (library_ == nullptr)
    throw UserError(fmt::format(
        "a NetCDF table needs a library that cannot be loaded ({}): install it, or write .csv", dlerror()));
}

const NetcdfLibrary& NetcdfLibrary::get() {
  static const NetcdfLibrary library;
  return library;
}

void* NetcdfLibrary::address(const char* name) const {
  void* const found = dlsym(library_, name);
  if (found == nullptr)
    throw UserError(fmt::format("{} has no {}: it is not the NetCDF that this program was built for",
                                BRISTLE_NETCDF_LIBRARY, name));
  return found;
}

}  // namespace cli
