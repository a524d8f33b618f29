// Reads whole files, with error messages that name the file, and writes text to stdout and stderr.
#pragma once

#include <cstddef>
#include <string>

namespace cli {

/// Size limit of a data file, in bytes; enough for tens of millions of rows.
constexpr std::size_t most_data_bytes = std::size_t{1} << 30;
/// Length limit of a line in a text file, in bytes; a file with a longer line counts as binary.
constexpr std::size_t most_line_bytes = std::size_t{1} << 24;

/// Reads a text file to its end. Throws UserError if that fails, and as soon as the file is too large or
/// turns out not to be text (a zero byte, an overlong line), so that an endless device or a huge file does
/// not fill the memory. `binary` allows any bytes, as in pictures. Waits for the writer of a FIFO, and says
/// so on stderr after a second.
std::string read_text_file(const std::string& path, std::size_t most_bytes = most_data_bytes,
                           bool binary = false);

/// Prints a text for people to stderr, with control characters masked. Ignores failure, which could not be
/// reported anyway.
void print_note(const std::string& text);

/// Prints a text to stdout in full and flushes. Throws UserError, for instance on a full disk.
void print_text(const std::string& text);

}  // namespace cli
