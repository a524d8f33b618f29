// Writes rows of a study as a data file.
#pragma once

#include <string>

#include "tools/sweep/journal.hpp"

namespace cli {

/// Checks that a table can be written to this path, and that its ending asks for CSV. Throws UserError.
void check_table_file(const std::string& path);

/// Writes the rows as CSV (RFC 4180): a header with units in brackets as in motion files, empty cells for
/// missing results. "-": stdout. Throws UserError.
void write_table_file(const SweepRows& rows, const std::string& path);

std::string table_csv(const SweepRows& rows);

}  // namespace cli
