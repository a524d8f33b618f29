#include "tools/products/cli/command_tree.hpp"

#include <algorithm>

namespace cli {
namespace {

std::vector<std::string> split(const std::string& text, char at) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(at, begin), text.size());
    parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

void add(std::vector<Command>& all, const CLI::App& app, const std::vector<std::string>& path) {
  all.push_back({&app, path});
  for (const CLI::App* command : subcommands_of(app)) {
    std::vector<std::string> longer = path;
    longer.push_back(command->get_name());
    add(all, *command, longer);
  }
}

}  // namespace

std::string Command::call() const {
  std::string text = "bristle";
  for (const std::string& word : path) text += ' ' + word;
  return text;
}

std::vector<Command> commands_of(const CLI::App& program) {
  std::vector<Command> all;
  add(all, program, {});
  return all;
}

OptionWords words_of(const CLI::Option& option) {
  OptionWords words;
  words.positional = option.get_positional();
  words.name = words.positional ? option.get_name(true) : "--" + option.get_lnames().front();
  if (!words.positional && !option.get_snames().empty()) words.also = "-" + option.get_snames().front();
  if (option.get_lnames().size() > 1) words.also = "--" + option.get_lnames()[1];
  if (option.get_items_expected_max() == 0 || option.get_type_size_max() == 0) return words;
  // Splits the text in which CLI11 joins the type and the checks of an option, such as "FLOAT:NUMBER in [0 to
  // 1]".
  const std::string kind = option.get_type_name();
  words.value = kind.substr(0, kind.find(':'));
  if (words.value == "FLOAT" || words.value == "INT" || words.value == "UINT") words.value = "NUMBER";
  const std::size_t from = kind.find('['), until = kind.find(']');
  if (from != std::string::npos && until != std::string::npos)
    words.range = kind.substr(from + 1, until - from - 1);
  if (words.value.find('|') != std::string::npos) words.choices = split(words.value, '|');
  return words;
}

std::string complaint_of(const CLI::App& command, const CLI::ParseError& error) {
  const std::string text = error.what();
  if (dynamic_cast<const CLI::ArgumentMismatch*>(&error) == nullptr) return text;
  for (const OptionWords& option : options_of(command))
    if (!option.value.empty() && text.starts_with(option.name + ": ") && text.ends_with(" missing"))
      return option.name + " needs " + option.value + (option.range.empty() ? "" : ", " + option.range);
  return text;
}

std::vector<OptionWords> options_of(const CLI::App& command) {
  std::vector<OptionWords> all;
  for (const CLI::Option* option : command.get_options([](const CLI::Option*) { return true; }))
    all.push_back(words_of(*option));
  return all;
}

std::vector<const CLI::App*> subcommands_of(const CLI::App& command) {
  return command.get_subcommands([](const CLI::App*) { return true; });
}

}  // namespace cli
