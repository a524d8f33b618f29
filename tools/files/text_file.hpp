// Whole files in, with errors that name the file, and text to stdout.
#pragma once

#include <cstddef>
#include <string>

namespace cli {

/// Largest data file: tens of millions of rows.
constexpr std::size_t most_data_bytes = std::size_t{1} << 30;
/// A line longer than this is none of a text file.
constexpr std::size_t most_line_bytes = std::size_t{1} << 24;

/// Throws UserError when `path` cannot be read to its end, and as soon as it shows that it is no text (a zero
/// byte, no end of a line) or too much of it: neither a device that never ends nor a huge file costs memory.
/// Pictures are no text: `binary` reads them. A FIFO is waited for; after a second without a writer a line on
/// stderr says so.
std::string read_text_file(const std::string& path, std::size_t most_bytes = most_data_bytes,
                           bool binary = false);

/// Opens what a caller left closed of stdin, stdout and stderr: the next file that is opened would get its
/// number, and what is printed would go into it. A closed stdout still refuses what is written. Call first in
/// main().
void hold_standard_streams() noexcept;

/// Prints to stderr, for people; where that fails nobody can be told.
void print_note(const std::string& text) noexcept;

/// Prints to stdout all of it, and flushes. Throws UserError, on a full disk for instance.
void print_text(const std::string& text);

}  // namespace cli
