// The one writer of files: every file that a command leaves is written here.
#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include "tools/files/text_file.hpp"

namespace cli {

/// A file that is there whole or not at all. Its bytes go into a file beside it, which takes its name when
/// they are complete and on the disk: until then, and after an error or a signal, a file of that name is as
/// it was.
/// "-" is stdout; FIFOs and devices are written directly. An empty path is no file.
class OutputFile {
 public:
  OutputFile() = default;
  /// Opens before the work whose result it takes: a path that cannot be written must not cost the result.
  /// Waits for the reader of a FIFO, and says so on stderr after a second. Throws UserError.
  explicit OutputFile(const std::string& path);
  OutputFile(OutputFile&& other) noexcept { swap(other); }
  OutputFile& operator=(OutputFile&& other) noexcept {
    swap(other);
    return *this;
  }
  ~OutputFile();

  explicit operator bool() const noexcept { return file_ != nullptr; }
  /// Throws UserError, on a full disk for instance.
  void append(const std::string& text);
  /// Lets readers of place() see what was appended. Throws UserError.
  void flush();
  /// Flushes and gives the file its name. Throws UserError.
  void finish();
  void write(const std::string& text) {
    append(text);
    finish();
  }
  /// Name under which another program, or a library that wants a name, writes before finish().
  const std::string& place() const noexcept { return beside_.empty() ? path_ : beside_; }

 private:
  void swap(OutputFile& other) noexcept;
  void open_beside();
  [[noreturn]] void fail() const;  ///< by errno

  std::string path_, beside_;
  std::FILE* file_ = nullptr;
};

struct FileOption {
  std::string option, path;
};

/// Whether a picture of this name is drawn as vectors.
bool is_vector_picture(const std::string& path);
/// Refuses the name of a picture that gnuplot is to draw unless it ends in .png or .svg and is no device. Empty
/// is no picture.
void check_picture_name(const char* option, const std::string& path);

/// Refuses an output that is one of the inputs, or another output, under whatever name: before any work.
/// Empty paths are left out. Returns whether an output goes to stdout, where a table for people must not go
/// then. Throws UserError.
bool check_files(const std::vector<FileOption>& inputs, const std::vector<FileOption>& outputs);

}  // namespace cli
