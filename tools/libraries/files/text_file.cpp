#include "tools/libraries/files/text_file.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string_view>

#include "tools/libraries/files/one_line.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/platform/platform.hpp"

namespace cli {
namespace {

[[noreturn]] void fail_read(const std::string& path, int error) {
  throw UserError(path + ": cannot be read: " + std::strerror(error));
}

using FilePointer = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

FilePointer open_for_reading(const std::string& path) {
  FilePointer stream(platform::open_to_read(path), &std::fclose);
  if (!stream) fail_read(path, errno);
  return stream;
}

}  // namespace

std::string read_text_file(const std::string& path, std::size_t most_bytes, bool binary) {
  const FilePointer file = open_for_reading(path);
  std::string text;
  std::size_t line = 1, line_bytes = 0;
  const auto where = [&] { return path + ":" + std::to_string(line) + ": "; };
  char block[1 << 16];
  while (const std::size_t got = std::fread(block, 1, sizeof block, file.get())) {
    if (got > most_bytes - text.size())
      throw UserError(path + ": is too large: at most " + std::to_string(most_bytes >> 20) + " MiB are read");
    for (const char c : std::string_view(block, binary ? 0 : got)) {
      if (c == 0) {
        const std::string_view start = text.empty() ? std::string_view(block, got) : std::string_view(text);
        const bool wide = start.starts_with("\xFF\xFE") || start.starts_with("\xFE\xFF");
        throw UserError(wide ? path + ": is UTF-16; save it as UTF-8 (spreadsheets: 'CSV UTF-8')"
                             : where() + "a zero byte: not a text file");
      }
      if (c != '\n' && ++line_bytes <= most_line_bytes) continue;
      if (c != '\n') throw UserError(where() + "the line does not end within 16 MiB: not a text file");
      ++line;
      line_bytes = 0;
    }
    text.append(block, got);
  }
  if (std::ferror(file.get())) fail_read(path, errno);
  return text;
}

void print_note(const std::string& text) { std::fputs(masked(text).c_str(), stderr); }

void print_text(const std::string& text) {
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0)
    throw UserError(std::string("standard output: cannot be written: ") + std::strerror(errno));
}

}  // namespace cli
