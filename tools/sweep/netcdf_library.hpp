#pragma once

namespace cli {

/// NetCDF, loaded where a table of it is asked for: it brings forty libraries, and starting `bristle` with
/// all of them takes twice as long. Loaded once, and kept to the end of the program. Any thread.
class NetcdfLibrary {
 public:
  /// \throws UserError if this machine does not have the NetCDF that this build was made for
  static const NetcdfLibrary& get();

  /// One of its functions, by the name that netcdf.h has for it. \throws UserError if it has none
  template <class Function>
  Function* function(const char* name) const {
    return reinterpret_cast<Function*>(address(name));
  }

 private:
  NetcdfLibrary();
  void* address(const char* name) const;
  void* library_;
};

/// The function of netcdf.h that has this name, to be called: `BRISTLE_NETCDF(nc_close)(file)`.
#define BRISTLE_NETCDF(name) (::cli::NetcdfLibrary::get().function<decltype(name)>(#name))

}  // namespace cli
