#include "tools/products/cli/manual.hpp"

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>

#include <fmt/format.h>

#include <bristle/version.hpp>

#include "tools/libraries/files/output_file.hpp"
#include "tools/libraries/files/text_file.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/platform/platform.hpp"
#include "tools/products/cli/command_tree.hpp"

namespace cli {
namespace {

/// Escapes characters and beginnings of lines that are commands in roff, the markup of manual pages.
std::string roff(const std::string& text) {
  std::string out;
  bool at_start = true;
  for (const char c : text) {
    if (at_start && (c == '.' || c == '\'')) out += "\\&";
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else
      out += c;
    at_start = c == '\n';
  }
  return out;
}

std::string page_name(const Command& command) {
  std::string name = "bristle";
  for (const std::string& word : command.path) name += '-' + word;
  return name;
}

std::string upper(std::string text) {
  for (char& c : text) c = static_cast<char>(c >= 'a' && c <= 'z' ? c - 'a' + 'A' : c);
  return text;
}

std::string synopsis(const Command& command) {
  std::string text = fmt::format(".B {}\n", roff(command.call()));
  std::string rest = "[\\fIOPTIONS\\fR]";
  for (const OptionWords& option : options_of(*command.app))
    if (option.positional) rest += fmt::format(" \\fI{}\\fR", roff(option.name));
  if (!subcommands_of(*command.app).empty()) rest += " \\fICOMMAND\\fR ...";
  return text + rest + '\n';
}

bool is_long(const OptionWords& option) { return option.value.size() > 60; }

std::string options_text(const Command& command) {
  std::string text;
  for (const OptionWords& option : options_of(*command.app)) {
    text += ".TP\n";
    if (option.positional) {
      text += fmt::format("\\fI{}\\fR\n", roff(option.name));
    } else {
      text += option.also.empty() ? "" : fmt::format("\\fB{}\\fR, ", roff(option.also));
      text += fmt::format("\\fB{}\\fR", roff(option.name));
      // Prints NAME for an option with a long list of allowed words and puts the list into the text, as groff
      // does not break the line of an option.
      if (is_long(option))
        text += " \\fINAME\\fR";
      else if (!option.value.empty())
        text += fmt::format(" \\fI{}\\fR", roff(option.value));
      text += '\n';
    }
    text += roff(option.description) + '\n';
    if (is_long(option)) {
      std::string names = option.value;
      for (std::size_t at = 0; (at = names.find('|', at)) != std::string::npos;) names.replace(at, 1, ", ");
      text += fmt::format(".br\nNAME is one of {}.\n", roff(names));
    }
  }
  return text;
}

/// Formats the text that --help shows below the options as roff. Lines of tables stay separate lines.
std::string footer_text(const CLI::App& app) {
  const std::string& footer = app.get_footer();
  if (footer.empty()) return "";
  if (footer.find("\n") == std::string::npos) return ".PP\n" + roff(footer) + '\n';
  std::string text = ".PP\n.nf\n" + roff(footer);
  if (text.back() != '\n') text += '\n';
  return text + ".fi\n";
}

std::string page_text(const Command& command, const std::string& version, const std::string& date) {
  const std::string name = page_name(command);
  std::string text = fmt::format(
      ".TH {} 1 {} \"bristle {}\" \"bristle manual\"\n.SH NAME\n{} \\- {}\n.SH SYNOPSIS\n{}.SH "
      "DESCRIPTION\n{}\n",
      roff(upper(name)), date, version, roff(name), roff(command.app->get_description()), synopsis(command),
      roff(command.app->get_description() + (command.app->get_description().ends_with('.') ? "" : ".")));
  const std::vector<const CLI::App*> subs = subcommands_of(*command.app);
  text += ".SH OPTIONS\n" + options_text(command);
  if (command.path.empty()) {
    text += ".SH COMMANDS\nEach has a page of its own.\n";
    for (const CLI::App* sub : subs)
      text +=
          fmt::format(".TP\n.BR bristle\\-{} (1)\n{}\n", roff(sub->get_name()), roff(sub->get_description()));
  } else if (!subs.empty()) {
    text += ".SH COMMANDS\n";
    for (const CLI::App* sub : subs) {
      Command below{sub, command.path};
      below.path.push_back(sub->get_name());
      text += fmt::format(".SS {}\n{}.\n{}{}", roff(below.call()), roff(sub->get_description()),
                          options_text(below), footer_text(*sub));
    }
  }
  text += footer_text(*command.app);
  text +=
      ".SH EXIT STATUS\n0 when done, 1 on an internal failure, 2 on bad input (one line on stderr says what "
      "was\n"
      "given, what is allowed, and what to do).\n"
      ".SH ENVIRONMENT\n"
      ".TP\n.B BRISTLE_ISA\nInstruction set, such as avx2; \\fBbristle \\-\\-version\\fR lists them.\n"
      ".TP\n.B NO_COLOR\nNo colour on a terminal either.\n"
      ".TP\n.B BRISTLE_PLOTS\nFolder of the scripts that draw for \\fBbristle experiment \\-\\-plot\\fR.\n"
      ".SH SEE ALSO\n";
  text += command.path.empty() ? "The guides and examples of the library, in its sources.\n"
                               : ".BR bristle (1)\n";
  return text;
}

}  // namespace

std::vector<ManualPage> manual_pages(const CLI::App& program, const std::string& version,
                                     const std::string& date) {
  std::vector<ManualPage> pages;
  for (const Command& command : commands_of(program))
    if (command.path.size() <= 1) pages.push_back({page_name(command), page_text(command, version, date)});
  return pages;
}

std::string manual_date() {
  std::time_t now = std::time(nullptr);
  if (const char* epoch = std::getenv("SOURCE_DATE_EPOCH")) {
    char* end = nullptr;
    const long long seconds = std::strtoll(epoch, &end, 10);
    if (*epoch != 0 && *end == 0) now = static_cast<std::time_t>(seconds);
  }
  const std::tm utc = platform::utc(now);
  char text[16];
  std::strftime(text, sizeof text, "%Y-%m-%d", &utc);
  return text;
}

void manual_command(const CLI::App& program, const std::string& command, const std::string& folder) {
  const std::vector<ManualPage> pages = manual_pages(program, bristle::library_version(), manual_date());
  if (!folder.empty()) {
    if (!command.empty()) throw UserError("manual: --out writes all pages; leave out COMMAND");
    std::error_code failure;
    std::filesystem::create_directories(platform::path_of(folder), failure);
    for (const ManualPage& page : pages) OutputFile(folder + '/' + page.name + ".1").write(page.roff);
    return;
  }
  const std::string name = command.empty() ? "bristle" : "bristle-" + command;
  for (const ManualPage& page : pages)
    if (page.name == name) return print_text(page.roff);
  throw UserError(fmt::format("manual: '{}' is no command; bristle --help lists them", command));
}

}  // namespace cli
