// Lays out reports as text: 80 columns without colour, unless the command line says otherwise.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace cli {

struct TextLayout {
  std::size_t columns = 80;  ///< columns of a line; 0: as long as needed (--wide)
  bool colour = false;
};

/// Returns the layout of this process, which the command line sets before other work.
TextLayout& text_layout();
/// Sets the layout. Colour is used only if stdout is a terminal, NO_COLOR is not set and TERM is not "dumb".
void set_text_layout(bool wide);

/// Returns the number of characters (not bytes) of a UTF-8 text.
std::size_t width_of(std::string_view text);
/// Breaks a text into lines of at most `columns` characters, between words (0: one line). Cuts a longer word.
/// Keeps leading spaces.
std::vector<std::string> broken_lines(std::string_view text, std::size_t columns);
/// Breaks every long line of prose in `text`. Further lines are indented to where the first one's text began:
/// after its spaces and, if it has one, its label ("deadline    1.00 ms: ...").
std::string filled(std::string_view text);

/// Prints a command's result to stdout, wrapped by filled(). The first paragraph is the answer in words, bold
/// on a terminal. Throws UserError if it cannot be written.
void print_report(const std::string& text);

}  // namespace cli
