// Makes any text safe to print on a terminal, whatever file it comes from.
#pragma once

#include <string>
#include <string_view>

namespace cli {

/// Makes a text safe to quote in a message, since a file may hold anything: control characters and invalid
/// UTF-8 become '?', ends of lines become spaces, and the middle of a long text is left out.
std::string one_line(std::string_view text);

/// Makes a text of several lines safe to print: control characters other than line ends, and invalid UTF-8,
/// become '?'. With `colours`, escape sequences that only set colours stay.
std::string masked(std::string_view text, bool colours = false);

}  // namespace cli
