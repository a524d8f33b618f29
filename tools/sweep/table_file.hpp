// Rows of a study as a file of data.
#pragma once

#include <string>

#include "tools/sweep/journal.hpp"

namespace cli {

/// Whether the ending asks for NetCDF: .nc, .nc4, .h5, .hdf5 (NetCDF-4 is HDF5).
bool is_netcdf(const std::string& path);

/// Throws UserError where a file with this ending cannot be written by this build, or not at this
/// place.
void check_table_file(const std::string& path);

/// CSV (RFC 4180, a head with units in brackets as motion files have, empty cells where a row has no such
/// result), or NetCDF-4 with units as attributes. "-": CSV to stdout. Throws UserError.
void write_table_file(const SweepRows& rows, const std::string& path);

std::string table_csv(const SweepRows& rows);

}  // namespace cli
