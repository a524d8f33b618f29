// Any text as one short line that a terminal takes as text.
#pragma once

#include <string>
#include <string_view>

namespace cli {

/// Messages quote what a file holds, and a file may hold anything. Control characters become '?', ends of
/// lines spaces, what is no UTF-8 '?'; of a long text the middle is left out.
std::string one_line(std::string_view text);

}  // namespace cli
