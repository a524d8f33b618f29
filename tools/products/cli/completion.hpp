// Answers the requests of shell completion, from the definition of the command line.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace cli {

/// Returns the completion script for bash, zsh or fish. Throws UserError on another shell.
std::string completion_script(const std::string& shell);

/// Returns the output of `bristle --complete WORDS...`: candidates for the last word, one per line, followed
/// by a tab and a description; the line "*" means files.
std::string completions(const CLI::App& program, const std::vector<std::string>& words);

}  // namespace cli
