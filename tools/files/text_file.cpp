#include "tools/files/text_file.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string_view>

#include "tools/files/user_error.hpp"

namespace cli {
namespace {

[[noreturn]] void fail_read(const std::string& path, int error) {
  throw UserError(path + ": cannot be read: " + std::strerror(error));
}

/// Waits until a FIFO has data or its writer has closed it; says so after a second.
void wait_for_writer(int file, const std::string& path) {
  constexpr int patience_ms = 1000;  // time to wait before a message says so, ms
  struct pollfd wanted = {file, POLLIN, 0};
  int ready = ::poll(&wanted, 1, patience_ms);
  if (ready == 0) {
    std::fprintf(stderr, "bristle: %s: a FIFO that nobody writes to yet; waiting (Ctrl-C ends it)\n",
                 path.c_str());
    ready = ::poll(&wanted, 1, -1);
  }
  if (ready < 0) fail_read(path, errno);
}

using FilePointer = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

FilePointer open_for_reading(const std::string& path) {
  // Opens a file without blocking: opening a FIFO without a writer would hang and give no message.
  const int file = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  if (file < 0) fail_read(path, errno);
  FilePointer stream(::fdopen(file, "rb"), &std::fclose);
  if (!stream) fail_read(path, errno);
  struct stat status;
  if (::fstat(file, &status) != 0) fail_read(path, errno);
  if (S_ISFIFO(status.st_mode)) wait_for_writer(file, path);
  if (::fcntl(file, F_SETFL, O_RDONLY) != 0) fail_read(path, errno);
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

void hold_standard_streams() noexcept {
  for (const int number : {0, 1, 2})
    if (::fcntl(number, F_GETFD) < 0 && errno == EBADF)
      static_cast<void>(::open("/dev/null", number == 2 ? O_WRONLY : O_RDONLY));
}

void print_note(const std::string& text) noexcept { std::fputs(text.c_str(), stderr); }

void print_text(const std::string& text) {
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0)
    throw UserError(std::string("standard output: cannot be written: ") + std::strerror(errno));
}

}  // namespace cli
