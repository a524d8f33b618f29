// Writes every file that a command produces, whole or not at all.
#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include "tools/libraries/files/text_file.hpp"

namespace cli {

/// Output file that is written whole or not at all. Bytes go into a temporary file beside it, which gets the
/// final name once it is complete and on the disk. Until then, and after an error or signal, an existing file
/// of that name stays. "-" is stdout; FIFOs and devices are written directly. An empty path is no file.
class OutputFile {
 public:
  OutputFile() = default;
  /// Opens the output. Call it before the work that produces the contents, so that an unwritable path is
  /// found in time. Waits for the reader of a FIFO, and says so on stderr after a second. Throws UserError.
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
  /// Flushes the file, so that a program that reads the file at written_path() sees all appended
  /// text. Throws
  /// UserError.
  void flush();
  /// Completes the file and renames it to its final name. Throws UserError.
  void finish();
  void write(const std::string& text) {
    append(text);
    finish();
  }
  /// Returns the path at which the file is now being written, for a program or library that writes to a path
  /// itself.
  const std::string& written_path() const noexcept { return beside_.empty() ? path_ : beside_; }

 private:
  void swap(OutputFile& other) noexcept;
  void open_beside();
  [[noreturn]] void fail() const;  ///< throws a UserError that explains the present errno

  std::string path_, beside_;
  std::FILE* file_ = nullptr;
};

struct FileOption {
  std::string option, path;
};

/// Returns whether a picture file of this name (.svg) is drawn as vectors.
bool is_vector_picture(const std::string& path);
/// Checks the name of a picture that gnuplot is to write, and refuses one that does not end in .png or .svg,
/// or is a device. An empty name means no picture.
void check_picture_name(const char* option, const std::string& path);

/// Checks, before any work, that no output file is also an input or another output, even under another name.
/// Empty paths are ignored. Returns whether an output goes to stdout, where it would mix with the table for
/// people. Throws UserError.
bool check_files(const std::vector<FileOption>& inputs, const std::vector<FileOption>& outputs);

}  // namespace cli
