// Lists commands and options, for shell completion and the manual, from the definition of the command line.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace cli {

/// Command and the words that call it: {}, {"run"}, {"experiment", "drift"}.
struct Command {
  const CLI::App* app;
  std::vector<std::string> path;
  std::string call() const;  ///< returns a text such as "bristle experiment drift"
};

/// Lists the program and all commands below it, each before its subcommands.
std::vector<Command> commands_of(const CLI::App& program);

struct OptionWords {
  /// Names such as "--help" and "-h"; for a positional "SCENE" and nothing.
  std::string name, also;
  std::string value;                 ///< kind of value, such as "FILE"; empty: it is a flag
  std::vector<std::string> choices;  ///< words that it may take; empty: any
  std::string description;
  bool takes_file = false, positional = false;
};
std::vector<OptionWords> options_of(const CLI::App& command);
std::vector<const CLI::App*> subcommands_of(const CLI::App& command);

/// Type names of options that complete to files.
constexpr const char* file_value = "FILE";

}  // namespace cli
