// Pages of the manual, written from the definition of the command line.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace cli {

struct ManualPage {
  std::string name;  ///< "bristle-run"
  std::string roff;
};

/// Of the program and of each of its commands, in section 1. `date`: of the build, such as 2026-01-31.
std::vector<ManualPage> manual_pages(const CLI::App& program, const std::string& version,
                                     const std::string& date);
/// Today, or what SOURCE_DATE_EPOCH says, so that a build can be repeated.
std::string manual_date();

/// Writes all pages into a folder as NAME.1 (made if it is not there), or one to stdout: of `command`, which
/// is empty for the program's own. Throws UserError.
void manual_command(const CLI::App& program, const std::string& command, const std::string& folder);

}  // namespace cli
