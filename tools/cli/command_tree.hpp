// The commands and options that shell completion and the manual print, read from the definition of the
// command line.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace cli {

/// A command and the words that call it: {}, {"run"}, {"experiment", "drift"}.
struct Command {
  const CLI::App* app;
  std::vector<std::string> path;
  std::string call() const;  ///< "bristle experiment drift"
};

/// The program itself and all that is below it, each before its own.
std::vector<Command> commands_of(const CLI::App& program);

struct OptionWords {
  std::string name, also;            ///< "--help", "-h"; of a positional "SCENE" and nothing
  std::string value;                 ///< "FILE"; empty: it is a flag
  std::vector<std::string> choices;  ///< where it takes one of some words
  std::string description;
  bool takes_file = false, positional = false;
};
std::vector<OptionWords> options_of(const CLI::App& command);
std::vector<const CLI::App*> subcommands_of(const CLI::App& command);

/// Type names of options that complete to files.
constexpr const char* file_value = "FILE";

}  // namespace cli
