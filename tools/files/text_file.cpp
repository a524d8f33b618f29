#include "tools/files/text_file.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string_view>

#include "tools/files/user_error.hpp"

namespace cli {
namespace {

constexpr int patience_ms = 1000;  // before we say that we wait

[[noreturn]] void fail_read(const std::string& path, int error) {
  throw UserError(path + ": cannot be read: " + std::strerror(error));
}
[[noreturn]] void fail_write(const std::string& path, int error) {
  throw UserError(path + ": cannot be written: " + std::strerror(error));
}

void say_waiting(const std::string& path, const char* whom) {
  std::fprintf(stderr, "bristle: %s: a FIFO that nobody %s yet; waiting (Ctrl-C ends it)\n", path.c_str(),
               whom);
}

bool is_fifo(const struct stat& status) noexcept { return S_ISFIFO(status.st_mode); }

/// A FIFO has something to read, or its writer has gone.
void wait_for_writer(int file, const std::string& path) {
  struct pollfd wanted = {file, POLLIN, 0};
  int ready = ::poll(&wanted, 1, patience_ms);
  if (ready == 0) {
    say_waiting(path, "writes to");
    ready = ::poll(&wanted, 1, -1);
  }
  if (ready < 0) fail_read(path, errno);
}

FilePointer open_for_reading(const std::string& path) {
  // Not blocking: the open of a FIFO that nobody writes to would hang and say nothing.
  const int file = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  if (file < 0) fail_read(path, errno);
  FilePointer stream(::fdopen(file, "rb"), &std::fclose);
  if (!stream) fail_read(path, errno);
  struct stat status;
  if (::fstat(file, &status) != 0) fail_read(path, errno);
  if (is_fifo(status)) wait_for_writer(file, path);
  if (::fcntl(file, F_SETFL, O_RDONLY) != 0) fail_read(path, errno);
  return stream;
}

/// ENXIO: a FIFO without a reader.
int open_descriptor_for_writing(const std::string& path) {
  constexpr int flags = O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC;
  constexpr int pause_ms = 20;
  int file = ::open(path.c_str(), flags | O_NONBLOCK, 0666);
  struct stat status;
  if (file >= 0 || errno != ENXIO || ::stat(path.c_str(), &status) != 0 || !is_fifo(status)) return file;
  for (int waited = 0; waited < patience_ms && file < 0 && errno == ENXIO; waited += pause_ms) {
    ::poll(nullptr, 0, pause_ms);
    file = ::open(path.c_str(), flags | O_NONBLOCK, 0666);
  }
  if (file >= 0 || errno != ENXIO) return file;
  say_waiting(path, "reads");
  return ::open(path.c_str(), flags, 0666);
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

FilePointer open_for_writing(const std::string& path) {
  if (path == "-") return FilePointer(stdout, [](std::FILE*) { return 0; });
  const int file = open_descriptor_for_writing(path);
  if (file < 0 || ::fcntl(file, F_SETFL, O_WRONLY) != 0) fail_write(path, errno);
  FilePointer stream(::fdopen(file, "wb"), &std::fclose);
  if (!stream) fail_write(path, errno);
  return stream;
}

void write_text(std::FILE* file, const std::string& text, const std::string& path) {
  if (std::fwrite(text.data(), 1, text.size(), file) != text.size() || std::fflush(file) != 0)
    fail_write(path, errno);
}

}  // namespace cli
