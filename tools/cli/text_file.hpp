// Whole files in and out, with errors that name the file.
#pragma once

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>

#include "tools/cli/user_error.hpp"

namespace cli {

using FilePointer = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

/// Throws UserError when `path` cannot be read to its end.
inline std::string read_text_file(const std::string& path) {
  FilePointer file(std::fopen(path.c_str(), "rb"), &std::fclose);
  if (!file) throw UserError(path + ": cannot be read: " + std::strerror(errno));
  std::string text;
  char block[1 << 16];
  while (const std::size_t got = std::fread(block, 1, sizeof block, file.get())) text.append(block, got);
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
