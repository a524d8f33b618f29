// Formats the text that --help prints, within 80 columns.
#pragma once

#include <CLI/CLI.hpp>

namespace cli {

/// First words of the line of examples below a command's options. The program's own --help prints that line,
/// too.
constexpr const char* example_line = "For example: ";

class HelpText : public CLI::Formatter {
 public:
  HelpText();
  std::string make_option(const CLI::Option* option, bool is_positional) const override;
  std::string make_option_opts(const CLI::Option* option) const override;
  std::string make_option_desc(const CLI::Option* option) const override;
  std::string make_subcommand(const CLI::App* command) const override;
  std::string make_usage(const CLI::App* app, std::string name) const override;
  std::string make_description(const CLI::App* app) const override;
  std::string make_footer(const CLI::App* app) const override;
};

}  // namespace cli
