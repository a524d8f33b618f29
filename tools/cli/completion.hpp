// Shell completion, written from the definition of the command line.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace cli {

/// The script for bash, zsh or fish. Throws UserError on another shell.
std::string completion_script(const CLI::App& program, const std::string& shell);

}  // namespace cli
