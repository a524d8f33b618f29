// Whole files in and out, with errors that name the file.
#pragma once

#include <cstddef>
#include <cstdio>
#include <memory>
#include <string>

namespace cli {

using FilePointer = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

/// What a file of data may hold: tens of millions of rows.
constexpr std::size_t most_data_bytes = std::size_t{1} << 30;
/// A line longer than this is none of a text file.
constexpr std::size_t most_line_bytes = std::size_t{1} << 24;

/// Throws UserError when `path` cannot be read to its end, and as soon as it shows that it is no text (a zero
/// byte, no end of a line) or too much of it: neither a device that never ends nor a huge file costs memory.
/// Pictures are no text: `binary` reads them. A FIFO is waited for; after a second without a writer a line on
/// stderr says so.
std::string read_text_file(const std::string& path, std::size_t most_bytes = most_data_bytes,
                           bool binary = false);

/// Opens for writing, "-" being stdout. A FIFO is waited for as above. Throws UserError.
FilePointer open_for_writing(const std::string& path);

/// Writes all of it and flushes. Throws UserError, on a full disk for instance.
void write_text(std::FILE* file, const std::string& text, const std::string& path);

}  // namespace cli
