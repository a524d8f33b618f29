// Layout of a report as text: 80 columns without colour, unless the command line says otherwise.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace cli {

struct TextLayout {
  std::size_t columns = 80;  ///< width; 0: lines as long as needed (--wide)
  bool colour = false;
};

/// Returns the process's layout; the command line sets it before it starts anything.
TextLayout& text_layout();
/// Sets the layout. Colour is used if stdout is a terminal, NO_COLOR is not set and TERM is not "dumb".
void set_text_layout(bool wide);

/// Returns the number of characters, not bytes.
std::size_t width_of(std::string_view text);
/// Breaks words over lines of at most `columns` characters (0: one line); a longer word is cut. Leading
/// spaces stay.
std::vector<std::string> broken_lines(std::string_view text, std::size_t columns);
/// Breaks every long line of prose over several, indented to where the text of the first began: after its
/// spaces and, if it has one, its label ("deadline    1.00 ms: ...").
std::string filled(std::string_view text);

/// Prints a command's result to stdout: the answer in words, which is the first paragraph of `text` (bold on
/// a terminal), then the rest, both wrapped by filled(). Throws UserError if it cannot be written.
void print_report(const std::string& text);

}  // namespace cli
