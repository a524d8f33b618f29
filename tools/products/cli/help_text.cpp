#include "tools/products/cli/help_text.hpp"

#include "tools/libraries/reports/text_layout.hpp"

namespace cli {
namespace {

constexpr std::size_t names = 26;  // width of the column of option names, in characters

std::string entry(const std::string& name, const std::string& description) {
  std::string text = "  " + name;
  if (description.empty()) return text + '\n';
  bool beside = text.size() + 2 <= names;
  for (const std::string& line : broken_lines(description, 80 - names)) {
    text += beside ? std::string(names - std::min(names, text.size()), ' ') : '\n' + std::string(names, ' ');
    text += line;
    beside = false;
  }
  return text + '\n';
}

}  // namespace

HelpText::HelpText() { column_width(names); }

std::string HelpText::make_option(const CLI::Option* option, bool is_positional) const {
  return entry(make_option_name(option, is_positional) + make_option_opts(option), make_option_desc(option));
}

std::string HelpText::make_subcommand(const CLI::App* command) const {
  const std::string footer = command->get_footer();
  const std::size_t from = std::string_view(example_line).size();
  return entry(command->get_name(), command->get_description()) +
         (footer.starts_with(example_line) ? "    " + footer.substr(from, footer.find('\n') - from) + '\n'
                                           : "");
}

std::string HelpText::make_usage(const CLI::App* app, std::string name) const {
  return filled(CLI::Formatter::make_usage(app, std::move(name)));
}

std::string HelpText::make_description(const CLI::App* app) const {
  return filled(CLI::Formatter::make_description(app));
}

std::string HelpText::make_footer(const CLI::App* app) const {
  return filled(CLI::Formatter::make_footer(app));
}

}  // namespace cli
