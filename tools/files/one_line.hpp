// Makes any text one short line that is safe for a terminal.
#pragma once

#include <string>
#include <string_view>

namespace cli {

/// Makes a text safe to quote, since a file may hold anything. Control characters and invalid UTF-8 become
/// '?', ends of lines become spaces; a long text loses its middle.
std::string one_line(std::string_view text);

}  // namespace cli
