// Shell completion, answered by the definition of the command line.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace cli {

/// The script for bash, zsh or fish. Throws UserError on another shell.
std::string completion_script(const std::string& shell);

/// What `bristle --complete WORDS...` prints: candidates for the last of the words that follow the program's
/// name, a line each, with a tab and a description behind it; the line "*" stands for files.
std::string completions(const CLI::App& program, const std::vector<std::string>& words);

}  // namespace cli
