// Rows of a study as a file of data.
#pragma once

#include <string>

#include "tools/sweep/journal.hpp"

namespace cli {

/// Throws UserError where no table can be written at this place, or its ending asks for another format.
void check_table_file(const std::string& path);

/// CSV (RFC 4180, a head with units in brackets as motion files have, empty cells where a row has no such
/// result). "-": to stdout. Throws UserError.
void write_table_file(const SweepRows& rows, const std::string& path);

std::string table_csv(const SweepRows& rows);

}  // namespace cli
