// Layout of a report as text: 80 columns and no colour, unless the command line says otherwise.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace cli {

struct TextLayout {
  std::size_t columns = 80;  ///< 0: lines as long as they get (--wide)
  bool colour = false;
};

/// Of the process; the command line sets it before it starts anything.
TextLayout& text_layout();
/// `wide` as given; colour where stdout is a terminal, and neither NO_COLOR is set nor TERM=dumb.
void set_text_layout(bool wide);

/// Characters, not bytes.
std::size_t width_of(std::string_view text);
/// Words over lines of at most `columns` characters (0: one line); a word that is longer is cut. Leading
/// spaces stay.
std::vector<std::string> broken_lines(std::string_view text, std::size_t columns);
/// Every line of prose that is too long, over several: they begin where the text of the first began after its
/// spaces and, if it has one, its label ("deadline    1.00 ms: ...").
std::string filled(std::string_view text);

/// Prints to stdout what a command found: the answer in words, which is the first paragraph of `text` (bold
/// on a terminal), then everything else, both filled. Throws UserError where it cannot be written.
void print_report(const std::string& text);

}  // namespace cli
