// The system's services on Windows, by the C runtime's files, opened by wide names so that paths are UTF-8.
#define WIN32_LEAN_AND_MEAN
#define NOMINMAX
#include <windows.h>
// Headers that must come after windows.h.
#include <fcntl.h>
#include <io.h>
#include <share.h>
#include <sys/stat.h>
#include <x86intrin.h>

#include <algorithm>
#include <cerrno>

#include "core/runtime/platform/platform.hpp"

namespace bristle::detail {

namespace {

std::wstring wide(const std::string& text) {
  const int size = static_cast<int>(text.size());
  std::wstring name(static_cast<std::size_t>(MultiByteToWideChar(CP_UTF8, 0, text.data(), size, nullptr, 0)),
                    L'\0');
  MultiByteToWideChar(CP_UTF8, 0, text.data(), size, name.data(), static_cast<int>(name.size()));
  return name;
}

/// Limits a size, because the C runtime takes counts as `int`; larger blocks are read and written in pieces.
unsigned piece(std::size_t size) noexcept {
  return static_cast<unsigned>(std::min<std::size_t>(size, 1u << 30));
}

}  // namespace

double monotonic_seconds() noexcept {
  LARGE_INTEGER count, rate;
  QueryPerformanceFrequency(&rate);
  QueryPerformanceCounter(&count);
  return static_cast<double>(count.QuadPart) / static_cast<double>(rate.QuadPart);
}

/// Returns the CPU time of the calling thread, s: Windows counts its processor cycles, which the clock and
/// the cycle counter since the first call convert to seconds.
double thread_seconds() noexcept {
  struct Start {
    double time = monotonic_seconds();
    std::uint64_t count = __rdtsc();
  };
  static const Start start;
  ULONG64 cycles = 0;
  const double elapsed = monotonic_seconds() - start.time;
  if (QueryThreadCycleTime(GetCurrentThread(), &cycles) == 0 || cycles == 0 || elapsed <= 0.0)
    return monotonic_seconds();  // without a thread clock every late tick counts as caused by this program
  return static_cast<double>(cycles) * elapsed / static_cast<double>(__rdtsc() - start.count);
}

ThreadEvents thread_events() noexcept { return {}; }

unsigned process_number() noexcept { return GetCurrentProcessId(); }

File File::create(const std::string& path) noexcept {
  return File(_wopen(wide(path).c_str(), _O_WRONLY | _O_CREAT | _O_EXCL | _O_BINARY | _O_NOINHERIT,
                     _S_IREAD | _S_IWRITE));
}

File File::open_to_read(const std::string& path) noexcept {
  return File(_wopen(wide(path).c_str(), _O_RDONLY | _O_BINARY | _O_NOINHERIT));
}

bool File::close() noexcept {
  const bool closed = number_ < 0 || _close(number_) == 0;
  number_ = -1;
  return closed;
}

bool File::write(Span<const std::byte> bytes) noexcept {
  std::size_t at = 0;
  while (at < bytes.size()) {
    const int written = _write(number_, bytes.data() + at, piece(bytes.size() - at));
    if (written < 0) return false;
    at += static_cast<std::size_t>(written);
  }
  return true;
}

bool File::read(std::byte* to, std::size_t size, std::size_t& got) noexcept {
  got = 0;
  while (got < size) {
    const int read = _read(number_, to + got, piece(size - got));
    if (read <= 0) return read == 0;
    got += static_cast<std::size_t>(read);
  }
  return true;
}

bool File::flush() noexcept { return _commit(number_) == 0; }

File::Kind File::kind() const noexcept {
  struct _stat64 status;
  if (_fstat64(number_, &status) != 0) return {false, false, 0};
  return {true, (status.st_mode & _S_IFMT) == _S_IFREG, static_cast<std::uint64_t>(status.st_size)};
}

bool is_occupied(const std::string& path) noexcept {
  struct _stat64 there;
  return _wstat64(wide(path).c_str(), &there) == 0 && (there.st_mode & _S_IFMT) != _S_IFREG;
}

bool replace_file(const std::string& from, const std::string& to) noexcept {
  if (MoveFileExW(wide(from).c_str(), wide(to).c_str(), MOVEFILE_REPLACE_EXISTING | MOVEFILE_WRITE_THROUGH) !=
      0)
    return true;
  errno = GetLastError() == ERROR_PATH_NOT_FOUND ? ENOENT : EACCES;
  return false;
}

// Does nothing: replace_file() has flushed the folder by MOVEFILE_WRITE_THROUGH.
bool flush_folder_of(const std::string&) noexcept { return true; }

void remove_file(const std::string& path) noexcept { _wunlink(wide(path).c_str()); }

}  // namespace bristle::detail
