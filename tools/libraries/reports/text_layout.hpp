// Lays out reports as text: by default 80 columns without colour, which the command line may change.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace cli {

struct TextLayout {
  std::size_t columns = 80;  ///< width of a line; 0: as long as needed (--wide)
  bool colour = false;
};

/// Returns the text layout of this process, which the command line sets before any output.
TextLayout& text_layout();
/// Sets the layout of this process. Colours are used only if stdout is a terminal, NO_COLOR is not set and
/// TERM is not "dumb".
void set_text_layout(bool wide);

/// Returns the number of characters (not bytes) of a UTF-8 text.
std::size_t width_of(std::string_view text);
/// Breaks a text into lines of at most `columns` characters, between words (0: a single line). Cuts longer
/// words. Keeps leading spaces.
std::vector<std::string> broken_lines(std::string_view text, std::size_t columns);
/// Breaks the long lines of a report's prose. Continuations are indented to where the line's text begins:
/// after leading spaces and, if there is one, a label ("deadline 1.00 ms: ...").
std::string filled(std::string_view text);

/// Prints a command's report to stdout, broken into lines by filled(). Its first paragraph, the answer in
/// words, is bold on a terminal. Control characters, which names of files may contain, are masked. Throws
/// UserError if printing fails.
void print_report(const std::string& report);

}  // namespace cli
