// Makes the completion script of bash from the definition of the command line.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "tools/products/cli/command_tree.hpp"

namespace cli {
namespace {

// Completes words from a table. The user's text is only a key of the table and is never evaluated; bash
// itself completes file names.
constexpr const char* function = R"(
_bristle() {
  local path=bristle i word=${COMP_WORDS[COMP_CWORD]} words
  for ((i = 1; i < COMP_CWORD; ++i)); do
    words="$path ${COMP_WORDS[i]}"
    [[ ${COMP_WORDS[i]} != -* && -n ${_bristle_words[$words]+x} ]] && path=$words
  done
  words="$path ${COMP_WORDS[COMP_CWORD - 1]}"
  [[ -n ${_bristle_words[$words]+x} ]] || words=$path
  words=${_bristle_words[$words]}
  COMPREPLY=()
  if [[ $words == FILE* && $word != -* ]]; then
    compopt -o default
    return
  fi
  mapfile -t COMPREPLY < <(compgen -P "${word%"${word##*,}"}" -W "${words#FILE}" -- "${word##*,}")
}
complete -F _bristle bristle
)";

}  // namespace

std::string completion_script(const CLI::App& program) {
  std::string script =
      "# Completion of bristle for bash; written by `bristle completion`.\n"
      "# Words that may follow a command or option; FILE means file names.\n"
      "declare -gA _bristle_words=(\n";
  const auto add = [&](const std::string& key, const std::string& words) {
    script += fmt::format("  ['{}']='{}'\n", key, words);
  };
  for (const Command& command : commands_of(program)) {
    std::vector<std::string> words;
    for (const CLI::App* sub : subcommands_of(*command.app)) words.push_back(sub->get_name());
    for (const OptionWords& option : options_of(*command.app)) {
      const bool file = option.value == file_value;
      if (option.positional) {
        if (file) words.insert(words.begin(), file_value);
        continue;
      }
      words.push_back(option.name);
      if (!option.also.empty()) words.push_back(option.also);
      for (const std::string& name : {option.name, option.also})
        if (!option.value.empty() && !name.empty())
          add(command.call() + ' ' + name,
              file ? file_value : fmt::format("{}", fmt::join(option.choices, " ")));
    }
    add(command.call(), fmt::format("{}", fmt::join(words, " ")));
  }
  return script + ')' + function;
}

}  // namespace cli
