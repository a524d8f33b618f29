// Writes the pages of the manual from the definition of the command line.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace cli {

struct ManualPage {
  std::string name;  ///< name such as "bristle-run"
  std::string roff;
};

/// Makes pages of the program and each of its commands, in section 1. `date` is that of the build, such as
/// 2026-01-31.
std::vector<ManualPage> manual_pages(const CLI::App& program, const std::string& version,
                                     const std::string& date);
/// Returns today's date, or that of SOURCE_DATE_EPOCH, for reproducible builds.
std::string manual_date();

/// Writes all pages into a folder as NAME.1 (made if missing); or one page to stdout, that of `command`,
/// which is empty for the program's own. Throws UserError.
void manual_command(const CLI::App& program, const std::string& command, const std::string& folder);

}  // namespace cli
