// Lists commands and options of the program from the definition of its command line, for help, completion and
// messages.
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
  /// Names of an option, such as "--help" and "-h", or "--csv" and "--out". For a positional argument:
  /// "SCENE" and an empty text.
  std::string name, also;
  std::string value;                 ///< kind of value, such as "FILE"; empty: the option is a flag
  std::string range;                 ///< numbers allowed, such as "0 to 1"; empty: none stated
  std::vector<std::string> choices;  ///< words allowed as value; empty: any
  bool positional = false;
};
OptionWords words_of(const CLI::Option& option);
std::vector<OptionWords> options_of(const CLI::App& command);
std::vector<const CLI::App*> subcommands_of(const CLI::App& command);

/// Returns the message for a command line that CLI11 refused, in which CLI11's own words for values are
/// replaced.
std::string complaint_of(const CLI::App& command, const CLI::ParseError& error);

/// Returns a script by which bash completes commands, options, and values that are words or files.
std::string completion_script(const CLI::App& program);

/// Type name of options whose value is a file; shell completion then offers file names.
constexpr const char* file_value = "FILE";

}  // namespace cli
