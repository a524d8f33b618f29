// The files that a command writes at its end.
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>

#include "tools/files/text_file.hpp"
#include "tools/files/user_error.hpp"

namespace cli {

/// Opened before a run: a path that cannot be written must not cost the result. No path, no file.
class OutputFile {
 public:
  /// Throws UserError.
  explicit OutputFile(const std::string& path)
      : path_(path), file_(path.empty() ? FilePointer(nullptr, &std::fclose) : open_for_writing(path)) {}
  explicit operator bool() const { return file_ != nullptr; }
  /// Throws UserError.
  void write(const std::string& text) const { write_text(file_.get(), text, path_); }

 private:
  std::string path_;
  FilePointer file_;
};

struct FileOption {
  std::string_view option;
  const std::string& path;
};

/// Whether one of these goes to stdout, "-"; a table for people must not then. Throws UserError where two do.
inline bool takes_stdout(std::initializer_list<FileOption> files) {
  std::string given;
  int count = 0;
  for (const FileOption& file : files) {
    if (file.path != "-") continue;
    given += (count++ ? ", " : "") + std::string(file.option) + " -";
  }
  if (count > 1) throw UserError(given + ": only one can have stdout");
  return count == 1;
}

}  // namespace cli
