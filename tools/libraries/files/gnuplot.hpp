// Draws pictures by the program gnuplot.
#pragma once

#include <string>
#include <string_view>

namespace cli {

/// Writes a text as a string of gnuplot's language, whatever bytes the text has, so that no file name can
/// become a command.
std::string gnuplot_string(std::string_view text);

/// Writes the name of a file as a string of gnuplot's language. Makes the path absolute, because gnuplot
/// takes names that begin with '|' or '<' for commands.
std::string gnuplot_file(const std::string& path);

/// Runs gnuplot on a script. Throws a UserError that begins with `option` if gnuplot is not installed or
/// fails.
void run_gnuplot(std::string_view script, const char* option);

/// Returns the path of a script of tools/plots, as installed beside the program or in its sources. Throws a
/// UserError if gnuplot or the script is not there.
std::string find_plot_script(const std::string& file, const char* option);

/// Draws the CSV file `csv` by a script of find_plot_script() into the file `picture` (vectors or PNG).
/// `settings` are lines of gnuplot that are executed before the script.
void draw_csv(const std::string& script, const std::string& csv, const std::string& picture, bool vectors,
              const std::string& settings, const char* option);

/// Returns a path for a temporary CSV file in the folder of TMPDIR. Its name has the number of this process,
/// so that two processes do not share the file. `option` is named in the error if there is no such folder.
std::string temporary_csv(const char* option);

}  // namespace cli
