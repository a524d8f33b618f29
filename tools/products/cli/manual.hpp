// Writes the manual pages of `bristle` from the definition of its command line.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace cli {

struct ManualPage {
  std::string name;  ///< name of the page, such as "bristle-run"
  std::string roff;
};

/// Makes manual pages, section 1, of the program and of each command. `date` is the date of the build, such
/// as 2026-01-31.
std::vector<ManualPage> manual_pages(const CLI::App& program, const std::string& version,
                                     const std::string& date);
/// Returns today's date, or the date in SOURCE_DATE_EPOCH, which makes builds reproducible.
std::string manual_date();

/// Writes all manual pages into a folder as NAME.1 (made if missing). Without a folder, prints the page of
/// `command`; an empty name means the program's own. Throws UserError.
void manual_command(const CLI::App& program, const std::string& command, const std::string& folder);

}  // namespace cli
