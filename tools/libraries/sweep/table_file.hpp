// Writes the rows of a parameter study as a CSV file.
#pragma once

#include <string>

#include "tools/libraries/sweep/journal.hpp"

namespace cli {

/// Checks that a table can be written to this path and is not asked for as NetCDF. Throws UserError.
void check_table_file(const std::string& path);

/// Writes the rows as CSV (RFC 4180): a header with units in brackets, as motion files have, and empty cells
/// for missing results. "-" means stdout. Throws UserError.
void write_table_file(const SweepRows& rows, const std::string& path);

std::string table_csv(const SweepRows& rows);

}  // namespace cli
