#include "tools/products/cli/completion.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "tools/libraries/files/nearest_name.hpp"
#include "tools/libraries/files/text_file.hpp"
#include "tools/libraries/files/toml_text.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/sweep/override.hpp"
#include "tools/products/cli/command_tree.hpp"

namespace cli {
namespace {

// Completion scripts for the shells. A script passes the words up to the cursor to `bristle --complete`,
// which prints candidates and descriptions.
constexpr const char* bash_script = R"(# Completion of bristle for bash; written by `bristle completion bash`.
_bristle() {
  local word file
  COMPREPLY=()
  while IFS=$'\t' read -r word _; do
    if [[ $word != '*' ]]; then COMPREPLY+=("$word"); continue; fi
    compopt -o filenames 2>/dev/null
    while read -r file; do COMPREPLY+=("$file"); done < <(compgen -f -- "${COMP_WORDS[COMP_CWORD]}")
  done < <("${COMP_WORDS[0]}" --complete "${COMP_WORDS[@]:1:COMP_CWORD}" 2>/dev/null)
}
complete -F _bristle bristle
)";
constexpr const char* zsh_script = R"(#compdef bristle
# Completion of bristle for zsh; written by `bristle completion zsh`.
_bristle() {
  local line
  local -a found
  for line in "${(@f)$("${words[1]}" --complete "${(@)words[2,CURRENT]}" 2>/dev/null)}"; do
    if [[ $line == '*' ]]; then _files
    elif [[ -n $line ]]; then found+=("${${line%%$'\t'*}//:/\\:}:${line#*$'\t'}"); fi
  done
  (( ${#found} )) && _describe bristle found
}
if [[ ${funcstack[1]} == _bristle ]]; then _bristle "$@"; else compdef _bristle bristle; fi
)";
constexpr const char* fish_script = R"(# Completion of bristle for fish; written by `bristle completion fish`.
function __bristle_complete
  set -l words (commandline -opc) (commandline -ct)
  for line in ($words[1] --complete $words[2..-1] 2>/dev/null)
    if test "$line" = '*'
      __fish_complete_path (commandline -ct)
    else
      echo $line
    end
  end
end
complete -c bristle -f -a '(__bristle_complete)'
)";

}  // namespace

std::string completion_script(const std::string& shell) {
  if (shell == "bash") return bash_script;
  if (shell == "zsh") return zsh_script;
  if (shell == "fish") return fish_script;
  throw UserError(fmt::format("completion: '{}' is no shell that is known; allowed: bash, zsh, fish", shell));
}

/// Returns the keys of the scene file that is among the words, each followed by "=".
static NameList keys_of_scene(const std::vector<std::string>& words) {
  for (const std::string& word : words) {
    if (!word.ends_with(".toml")) continue;
    try {
      NameList keys = keys_to_vary(parse_toml(read_text_file(word), word));
      for (std::string& key : keys) key += '=';
      return keys;
    } catch (const UserError&) {
    }
  }
  return {};
}

std::string completions(const CLI::App& program, const std::vector<std::string>& words) {
  const CLI::App* command = &program;
  const std::string word = words.empty() ? "" : words.back();
  for (std::size_t i = 0; i + 1 < words.size(); ++i)
    for (const CLI::App* sub : subcommands_of(*command))
      if (sub->get_name() == words[i]) command = sub;
  std::string text;
  const auto offer = [&](const std::string& candidate, const std::string& description) {
    if (candidate.starts_with(word)) text += candidate + '\t' + description + '\n';
  };
  const auto offer_values = [&](const OptionWords& option) {
    // Part of a comma-separated list that stands before its last word, the one being completed.
    const std::string before = word.substr(0, word.rfind(',') + 1);
    for (const std::string& choice : option.choices) offer(before + choice, option.description);
    if (option.value.starts_with("KEY=") && command->get_name() == "sweep")
      for (const std::string& key : keys_of_scene(words)) offer(key, "a key of the scene");
    if (option.takes_file && !word.starts_with('-') && !text.ends_with("*\n")) text += "*\n";
  };
  const std::vector<OptionWords> options = options_of(*command);
  const std::string before = words.size() > 1 ? words[words.size() - 2] : "";
  for (const OptionWords& option : options) {
    if (option.positional || option.value.empty() || (before != option.name && before != option.also))
      continue;
    offer_values(option);
    return text;
  }
  for (const CLI::App* sub : subcommands_of(*command)) offer(sub->get_name(), sub->get_description());
  for (const OptionWords& option : options) {
    if (option.positional) {
      offer_values(option);
      continue;
    }
    offer(option.name, option.description);
    if (!option.also.empty()) offer(option.also, option.description);
  }
  return text;
}

}  // namespace cli
