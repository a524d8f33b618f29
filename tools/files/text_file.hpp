// Reads whole files, with errors that name the file, and writes text to stdout.
#pragma once

#include <cstddef>
#include <string>

namespace cli {

/// Bytes of the largest data file that is read, which may have tens of millions of rows.
constexpr std::size_t most_data_bytes = std::size_t{1} << 30;
/// Bytes of the longest line that a text file may have; beyond, the file counts as not text.
constexpr std::size_t most_line_bytes = std::size_t{1} << 24;

/// Reads a text file. Throws UserError when `path` cannot be read to its end, and as soon as it proves not to
/// be text (a zero byte, no end of a line) or too large, so that neither an endless device nor a huge file
/// costs memory. `binary` reads pictures. Waits for the writer of a FIFO; after a second a line on stderr
/// says so.
std::string read_text_file(const std::string& path, std::size_t most_bytes = most_data_bytes,
                           bool binary = false);

/// Prints to stderr, for people. Ignores failure, which could not be reported anyway.
void print_note(const std::string& text) noexcept;

/// Prints the whole text to stdout and flushes. Throws UserError, for instance on a full disk.
void print_text(const std::string& text);

}  // namespace cli
