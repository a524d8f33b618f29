// Draws pictures by the program gnuplot.
#pragma once

#include <string>
#include <string_view>

namespace cli {

/// Returns a text as a string of gnuplot's language that stands for it, whatever bytes it holds.
std::string gnuplot_string(std::string_view text);

/// Returns a file's name as such a string. Makes the path absolute, because gnuplot takes names that begin
/// with '|' or '<' for commands.
std::string gnuplot_file(const std::string& path);

/// Runs gnuplot on a script. Throws a UserError that begins with `option` if gnuplot is not installed or
/// fails.
void run_gnuplot(std::string_view script, const char* option);

}  // namespace cli
