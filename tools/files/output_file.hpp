// Writes all files that a command leaves behind.
#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include "tools/files/text_file.hpp"

namespace cli {

/// File that is written whole or not at all. Its bytes go into a temporary file beside it, which gets its
/// name once it is complete and on the disk. Until then, and after an error or a signal, an existing file of
/// that name is unchanged. "-" is stdout; FIFOs and devices are written directly. An empty path is no file.
class OutputFile {
 public:
  OutputFile() = default;
  /// Opens the file before the work whose result it takes, so that an unwritable path does not cost the
  /// result. Waits for the reader of a FIFO, and says so on stderr after a second. Throws UserError.
  explicit OutputFile(const std::string& path);
  OutputFile(OutputFile&& other) noexcept { swap(other); }
  OutputFile& operator=(OutputFile&& other) noexcept {
    swap(other);
    return *this;
  }
  ~OutputFile();

  explicit operator bool() const noexcept { return file_ != nullptr; }
  /// Appends text to the file. Throws UserError, for instance on a full disk.
  void append(const std::string& text);
  /// Flushes, so that readers of the path place() see what was appended. Throws UserError.
  void flush();
  /// Completes the file and gives it its final name. Throws UserError.
  void finish();
  void write(const std::string& text) {
    append(text);
    finish();
  }
  /// Returns the path of the unfinished file, for another program or a library that writes to a path.
  const std::string& place() const noexcept { return beside_.empty() ? path_ : beside_; }

 private:
  void swap(OutputFile& other) noexcept;
  void open_beside();
  [[noreturn]] void fail() const;  ///< throws UserError for the present errno

  std::string path_, beside_;
  std::FILE* file_ = nullptr;
};

struct FileOption {
  std::string option, path;
};

/// Returns whether a picture with this file name is drawn as vectors.
bool is_vector_picture(const std::string& path);
/// Refuses a picture name for gnuplot unless it ends in .png or .svg and is no device. An empty name means no
/// picture.
void check_picture_name(const char* option, const std::string& path);

/// Refuses, before any work, an output that is also an input or another output, under any name. Ignores empty
/// paths. Returns whether an output goes to stdout, where the table for people would mix with it. Throws
/// UserError.
bool check_files(const std::vector<FileOption>& inputs, const std::vector<FileOption>& outputs);

}  // namespace cli
