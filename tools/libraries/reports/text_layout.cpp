#include "tools/libraries/reports/text_layout.hpp"

#include <algorithm>
#include <cstdlib>

#include <fmt/color.h>

#include "tools/libraries/files/one_line.hpp"
#include "tools/libraries/files/text_file.hpp"
#include "tools/libraries/platform/platform.hpp"

namespace cli {
namespace {

bool begins_character(char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }

/// Returns the number of bytes of the first `characters` characters of a UTF-8 text.
std::size_t bytes_of(std::string_view text, std::size_t characters) {
  std::size_t at = 0;
  for (; at < text.size(); ++at)
    if (begins_character(text[at]) && characters-- == 0) break;
  return at;
}

/// Returns the column to which the continuations of a broken line are indented: that where its text begins,
/// after leading spaces or after a label and a gap.
std::size_t hang_of(std::string_view line) {
  const std::size_t first = std::min(line.find_first_not_of(' '), line.size());
  const std::size_t gap = line.find("  ", first);
  if (gap == std::string_view::npos || gap > first + 24) return first;
  const std::size_t text = line.find_first_not_of(' ', gap);
  return text == std::string_view::npos || text > 40 ? first : text;
}

}  // namespace

TextLayout& text_layout() {
  static TextLayout layout;
  return layout;
}

void set_text_layout(bool wide) {
  const char* no_colour = std::getenv("NO_COLOR");
  text_layout().columns = wide ? 0 : 80;
  text_layout().colour = platform::shows_colours() && (no_colour == nullptr || *no_colour == 0);
}

std::size_t width_of(std::string_view text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), begins_character));
}

std::vector<std::string> broken_lines(std::string_view text, std::size_t columns) {
  if (columns == 0 || width_of(text) <= columns) return {std::string(text)};
  std::vector<std::string> lines;
  while (width_of(text) > columns) {
    const std::size_t room = bytes_of(text, columns);
    // Allows the space at which a line breaks to be one character beyond the width, since it is not printed.
    std::size_t end = text.rfind(' ', room), next = end + 1;
    const std::size_t first = text.find_first_not_of(' ');
    if (end == std::string_view::npos || end <= first) end = next = room;
    std::string line(text.substr(0, end));
    line.erase(line.find_last_not_of(' ') + 1);
    lines.push_back(std::move(line));
    text.remove_prefix(next);
    text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
  }
  if (!text.empty()) lines.emplace_back(text);
  return lines;
}

std::string filled(std::string_view text) {
  const std::size_t columns = text_layout().columns;
  std::string out;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    // Leaves coloured lines unbroken. Only tables have them, and these fit the width already.
    if (columns == 0 || width_of(line) <= columns || line.find('\x1B') != std::string_view::npos) {
      out += line;
    } else {
      const std::size_t hang = hang_of(line);
      const std::size_t label = bytes_of(line, hang);
      out += line.substr(0, label);
      const std::vector<std::string> lines = broken_lines(line.substr(label), columns - hang);
      for (std::size_t i = 0; i < lines.size(); ++i)
        out += (i ? '\n' + std::string(hang, ' ') : std::string()) + lines[i];
    }
    if (end < text.size()) out += '\n';
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return out;
}

void print_report(const std::string& report) {
  const std::string text = masked(report, text_layout().colour);
  const std::size_t end = std::min(text.find("\n\n"), text.size());
  const std::string answer = filled(std::string_view(text).substr(0, end));
  print_text((text_layout().colour ? fmt::format(fmt::emphasis::bold, "{}", answer) : answer) +
             filled(std::string_view(text).substr(end)));
}

}  // namespace cli
