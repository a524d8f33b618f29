// Lists commands and options from the definition of the command line, for shell completion and the manual.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace cli {

/// Command and the words that call it: {} for the program itself, {"run"}, {"experiment", "drift"}.
struct Command {
  const CLI::App* app;
  std::vector<std::string> path;
  std::string call() const;  ///< returns a text such as "bristle experiment drift"
};

/// Lists the program and all its commands, each before its subcommands.
std::vector<Command> commands_of(const CLI::App& program);

struct OptionWords {
  /// Names of an option, such as "--help" and "-h". For a positional argument: "SCENE" and an empty text.
  std::string name, also;
  std::string value;                 ///< kind of value, such as "FILE"; empty: the option is a flag
  std::vector<std::string> choices;  ///< words allowed as value; empty: any
  std::string description;
  bool takes_file = false, positional = false;
};
std::vector<OptionWords> options_of(const CLI::App& command);
std::vector<const CLI::App*> subcommands_of(const CLI::App& command);

/// Type name of options whose value is a file; shell completion then offers file names.
constexpr const char* file_value = "FILE";

}  // namespace cli
