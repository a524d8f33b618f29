// Whole files in and out, with errors that name the file.
#pragma once

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>

#include "tools/files/user_error.hpp"

namespace cli {

using FilePointer = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

/// What a file of data may hold: tens of millions of rows.
constexpr std::size_t most_data_bytes = std::size_t{1} << 30;
/// A line longer than this is none of a text file.
constexpr std::size_t most_line_bytes = std::size_t{1} << 24;

/// Throws UserError when `path` cannot be read to its end, and as soon as it shows that it is no text (a zero
/// byte, no end of a line) or too much of it: neither a device that never ends nor a huge file costs memory.
/// Pictures are no text: `binary` reads them.
inline std::string read_text_file(const std::string& path, std::size_t most_bytes = most_data_bytes,
                                  bool binary = false) {
  FilePointer file(std::fopen(path.c_str(), "rb"), &std::fclose);
  if (!file) throw UserError(path + ": cannot be read: " + std::strerror(errno));
  std::string text;
  std::size_t line = 1, line_bytes = 0;
  const auto where = [&] { return path + ":" + std::to_string(line) + ": "; };
  char block[1 << 16];
  while (const std::size_t got = std::fread(block, 1, sizeof block, file.get())) {
    if (got > most_bytes - text.size())
      throw UserError(path + ": is too large: at most " + std::to_string(most_bytes >> 20) + " MiB are read");
    for (const char c : std::string_view(block, binary ? 0 : got)) {
      if (c == 0) throw UserError(where() + "a zero byte: not a text file");
      if (c != '\n' && ++line_bytes <= most_line_bytes) continue;
      if (c != '\n') throw UserError(where() + "the line does not end within 16 MiB: not a text file");
      ++line;
      line_bytes = 0;
    }
    text.append(block, got);
  }
  if (std::ferror(file.get())) throw UserError(path + ": cannot be read: " + std::strerror(errno));
  return text;
}

/// Opens for writing, "-" being stdout. Throws UserError.
inline FilePointer open_for_writing(const std::string& path) {
  if (path == "-") return FilePointer(stdout, [](std::FILE*) { return 0; });
  FilePointer file(std::fopen(path.c_str(), "wb"), &std::fclose);
  if (!file) throw UserError(path + ": cannot be written: " + std::strerror(errno));
  return file;
}

/// Writes all of it and flushes. Throws UserError, on a full disk for instance.
inline void write_text(std::FILE* file, const std::string& text, const std::string& path) {
  if (std::fwrite(text.data(), 1, text.size(), file) != text.size() || std::fflush(file) != 0) {
    throw UserError(path + ": cannot be written: " + std::strerror(errno));
  }
}

}  // namespace cli
