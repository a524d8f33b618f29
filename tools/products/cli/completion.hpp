// Makes the completion script of bash from the definition of the command line.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace cli {

/// Returns a script that completes commands, options, and values that are words or files.
std::string completion_script(const CLI::App& program);

}  // namespace cli
