#include "tools/cli/completion.hpp"

#include <iterator>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "tools/cli/command_tree.hpp"
#include "tools/files/user_error.hpp"

namespace cli {
namespace {

/// In single quotes, as all three shells read them but for one thing: fish knows \' inside.
std::string quoted(const std::string& text, bool fish = false) {
  std::string out = "'";
  for (const char c : text) {
    if (c == '\'')
      out += fish ? "\\'" : "'\\''";
    else if (c == '\\' && fish)
      out += "\\\\";
    else
      out += c;
  }
  return out + "'";
}

/// " experiment drift": what the scripts of bash and zsh call the place in the command line.
std::string place(const Command& command) {
  std::string text;
  for (const std::string& word : command.path) text += ' ' + word;
  return text;
}

std::vector<std::string> names_of(const OptionWords& option) {
  if (option.also.empty()) return {option.name};
  return {option.name, option.also};
}

/// The part of bash and zsh that finds the command in the words before the cursor.
std::string find_place(const std::vector<Command>& commands, const char* words, const char* last) {
  std::vector<std::string> places;
  for (const Command& command : commands)
    if (!command.path.empty()) places.push_back(quoted(place(command)));
  return fmt::format(
      "  for ((i = {}; i < {}; ++i)); do\n"
      "    case \"$place ${{{}[i]}}\" in\n      {}) place+=\" ${{{}[i]}}\" ;;\n    esac\n  done\n",
      std::string(words) == "words" ? 2 : 1, last, words, fmt::join(places, " | "), words);
}

std::string bash_script(const CLI::App& program) {
  const std::vector<Command> commands = commands_of(program);
  std::string values, words;
  for (const Command& command : commands) {
    std::vector<std::string> all;
    bool files = false;
    for (const CLI::App* sub : subcommands_of(*command.app)) all.push_back(sub->get_name());
    for (const OptionWords& option : options_of(*command.app)) {
      if (option.positional) {
        files = files || option.takes_file;
        all.insert(all.end(), option.choices.begin(), option.choices.end());
        continue;
      }
      for (const std::string& name : names_of(option)) {
        all.push_back(name);
        if (option.value.empty()) continue;
        const std::string what = option.takes_file ? "files=yes"
                                 : option.choices.empty()
                                     ? "words="
                                     : fmt::format("words='{}'", fmt::join(option.choices, " "));
        values += fmt::format("    {}) value=yes {} ;;\n", quoted(place(command) + ' ' + name), what);
      }
    }
    words += fmt::format("      {}) words='{}'{} ;;\n", quoted(place(command)), fmt::join(all, " "),
                         files ? " files=yes" : "");
  }
  return "# Completion of bristle for bash; written by `bristle completion bash`.\n"
         "_bristle() {\n"
         "  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]}\n"
         "  local place='' words='' files='' value='' i\n" +
         find_place(commands, "COMP_WORDS", "COMP_CWORD") + "  case \"$place $before\" in\n" + values +
         "  esac\n"
         "  if [[ -z $value ]]; then\n"
         "    case \"$place\" in\n" +
         words +
         "    esac\n"
         "  fi\n"
         "  mapfile -t COMPREPLY < <(compgen -W \"$words\" -- \"$word\")\n"
         "  if [[ -n $files && $word != -* ]]; then\n"
         "    compopt -o filenames 2>/dev/null\n"
         "    mapfile -t -O \"${#COMPREPLY[@]}\" COMPREPLY < <(compgen -f -- \"$word\")\n"
         "  fi\n"
         "}\n"
         "complete -F _bristle bristle\n";
}

/// An entry of _describe: a colon ends the word.
std::string described(const std::string& word, const std::string& description) {
  return quoted(word + ':' + description);
}

std::string zsh_script(const CLI::App& program) {
  const std::vector<Command> commands = commands_of(program);
  std::string values, words;
  for (const Command& command : commands) {
    std::vector<std::string> subs, options;
    bool files = false;
    for (const CLI::App* sub : subcommands_of(*command.app))
      subs.push_back(described(sub->get_name(), sub->get_description()));
    for (const OptionWords& option : options_of(*command.app)) {
      if (option.positional) {
        files = files || option.takes_file;
        for (const std::string& choice : option.choices)
          subs.push_back(described(choice, option.description));
        continue;
      }
      for (const std::string& name : names_of(option)) {
        options.push_back(described(name, option.description));
        if (option.value.empty()) continue;
        values += fmt::format("    {}) {} return ;;\n", quoted(place(command) + ' ' + name),
                              option.takes_file ? "_files;"
                              : option.choices.empty()
                                  ? "_message 'a value';"
                                  : fmt::format("compadd {};", fmt::join(option.choices, " ")));
      }
    }
    words +=
        fmt::format("    {})\n      commands=({})\n      options=({})\n{}      ;;\n", quoted(place(command)),
                    fmt::join(subs, " "), fmt::join(options, "\n        "), files ? "      files=yes\n" : "");
  }
  return "#compdef bristle\n"
         "# Completion of bristle for zsh; written by `bristle completion zsh`.\n"
         "_bristle() {\n"
         "  local place='' files='' i\n"
         "  local -a commands options\n" +
         find_place(commands, "words", "CURRENT") + "  case \"$place ${words[CURRENT-1]}\" in\n" + values +
         "  esac\n"
         "  case \"$place\" in\n" +
         words +
         "  esac\n"
         "  (( ${#commands} )) && _describe -t commands command commands\n"
         "  [[ -n $files && ${words[CURRENT]} != -* ]] && _files\n"
         "  _describe -t options option options\n"
         "}\n"
         "if [[ ${funcstack[1]} == _bristle ]]; then _bristle \"$@\"; else compdef _bristle bristle; fi\n";
}

std::string fish_script(const CLI::App& program) {
  std::string text =
      "# Completion of bristle for fish; written by `bristle completion fish`.\n"
      "complete -c bristle -f\n";
  for (const Command& command : commands_of(program)) {
    // All words of its path are there, and none of what is below it.
    std::string condition;
    for (const std::string& word : command.path)
      condition += (condition.empty() ? "" : "; and ") + ("__fish_seen_subcommand_from " + word);
    std::vector<std::string> below;
    for (const CLI::App* sub : subcommands_of(*command.app)) below.push_back(sub->get_name());
    if (!below.empty())
      condition += fmt::format("{}not __fish_seen_subcommand_from {}", condition.empty() ? "" : "; and ",
                               fmt::join(below, " "));
    const std::string head = "complete -c bristle -n " + quoted(condition, true);
    for (const CLI::App* sub : subcommands_of(*command.app))
      text += fmt::format("{} -a {} -d {}\n", head, sub->get_name(), quoted(sub->get_description(), true));
    for (const OptionWords& option : options_of(*command.app)) {
      const std::string description = quoted(option.description, true);
      if (option.positional) {
        text += option.choices.empty()
                    ? head + " -F\n"
                    : fmt::format("{} -a '{}' -d {}\n", head, fmt::join(option.choices, " "), description);
        continue;
      }
      text +=
          fmt::format("{} -l {}{}{} -d {}\n", head, option.name.substr(2),
                      option.also.empty() ? "" : " -s " + option.also.substr(1),
                      option.value.empty()      ? std::string()
                      : option.takes_file       ? std::string(" -r -F")
                      : !option.choices.empty() ? fmt::format(" -x -a '{}'", fmt::join(option.choices, " "))
                                                : std::string(" -x"),
                      description);
    }
  }
  return text;
}

}  // namespace

std::string completion_script(const CLI::App& program, const std::string& shell) {
  if (shell == "bash") return bash_script(program);
  if (shell == "zsh") return zsh_script(program);
  if (shell == "fish") return fish_script(program);
  throw UserError(fmt::format("completion: '{}' is no shell that is known; allowed: bash, zsh, fish", shell));
}

}  // namespace cli
