#include "tools/products/cli/help_text.hpp"

#include "tools/libraries/reports/text_layout.hpp"
#include "tools/products/cli/command_tree.hpp"

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
  const OptionWords words = words_of(*option);
  std::string name = is_positional ? make_option_name(option, true) : words.name;
  if (!is_positional && !words.also.empty())
    name = words.also.starts_with("--") ? name + ',' + words.also : words.also + ',' + name;
  return entry(name + make_option_opts(option), make_option_desc(option));
}

/// Returns the words behind the name of an option in --help: its value, the value's default, and what the
/// option needs.
std::string HelpText::make_option_opts(const CLI::Option* option) const {
  const OptionWords words = words_of(*option);
  std::string text = option->get_option_text().empty() ? words.value : option->get_option_text();
  if (!option->get_default_str().empty()) text += '=' + option->get_default_str();
  if (option->get_required()) text += " REQUIRED";
  for (const CLI::Option* other : option->get_needs()) text += " Needs: " + other->get_name();
  for (const CLI::Option* other : option->get_excludes()) text += " Excludes: " + other->get_name();
  return text.empty() || text.front() == ' ' ? text : ' ' + text;
}

std::string HelpText::make_option_desc(const CLI::Option* option) const {
  const std::string range = words_of(*option).range;
  return option->get_description() + (range.empty() ? "" : " (" + range + ")");
}

std::string HelpText::make_subcommand(const CLI::App* command) const {
  const std::string footer = command->get_footer();
  const std::size_t from = std::string_view(example_line).size();
  std::string text = entry(command->get_name(), command->get_description());
  if (!footer.starts_with(example_line)) return text;
  std::string indent = "    ";
  for (const std::string& line : broken_lines(footer.substr(from, footer.find('\n') - from), 74)) {
    text += indent + line + '\n';
    indent = "      ";
  }
  return text;
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
