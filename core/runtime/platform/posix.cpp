// The system's services on Linux and other systems with POSIX.
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <ctime>

#include "core/runtime/platform/platform.hpp"

namespace bristle::detail {

namespace {

double read_clock(clockid_t clock) noexcept {
  timespec time{};
  clock_gettime(clock, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

std::string folder_of(const std::string& path) {
  const auto slash = path.rfind('/');
  return slash == std::string::npos ? "." : slash == 0 ? "/" : path.substr(0, slash);
}

}  // namespace

double monotonic_seconds() noexcept { return read_clock(CLOCK_MONOTONIC); }

double thread_seconds() noexcept { return read_clock(CLOCK_THREAD_CPUTIME_ID); }

ThreadEvents thread_events() noexcept {
  ThreadEvents events;
#if defined(RUSAGE_THREAD)
  rusage thread{}, process{};
  getrusage(RUSAGE_THREAD, &thread);
  getrusage(RUSAGE_SELF, &process);
  events.involuntary_switches = static_cast<std::uint64_t>(thread.ru_nivcsw);
  events.other_switches = static_cast<std::uint64_t>(process.ru_nivcsw - thread.ru_nivcsw);
  events.minor_faults = static_cast<std::uint64_t>(thread.ru_minflt);
  events.major_faults = static_cast<std::uint64_t>(thread.ru_majflt);
#endif
  return events;
}

unsigned process_number() noexcept { return static_cast<unsigned>(::getpid()); }

File File::create(const std::string& path) noexcept {
  return File(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
}

File File::open_to_read(const std::string& path) noexcept {
  return File(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
}

bool File::close() noexcept {
  const bool closed = number_ < 0 || ::close(number_) == 0;
  number_ = -1;
  return closed;
}

bool File::write(Span<const std::byte> bytes) noexcept {
  std::size_t at = 0;
  while (at < bytes.size()) {
    const ssize_t written = ::write(number_, bytes.data() + at, bytes.size() - at);
    if (written < 0 && errno != EINTR) return false;
    if (written > 0) at += static_cast<std::size_t>(written);
  }
  return true;
}

bool File::read(std::byte* to, std::size_t size, std::size_t& got) noexcept {
  got = 0;
  while (got < size) {
    const ssize_t read = ::read(number_, to + got, size - got);
    if (read == 0) return true;
    if (read < 0 && errno != EINTR) return false;
    if (read > 0) got += static_cast<std::size_t>(read);
  }
  return true;
}

bool File::flush() noexcept { return ::fsync(number_) == 0; }

File::Kind File::kind() const noexcept {
  struct stat status;
  if (::fstat(number_, &status) != 0) return {false, false, 0};
  return {true, S_ISREG(status.st_mode), static_cast<std::uint64_t>(status.st_size)};
}

bool is_occupied(const std::string& path) noexcept {
  struct stat there;
  return ::stat(path.c_str(), &there) == 0 && !S_ISREG(there.st_mode);
}

bool replace_file(const std::string& from, const std::string& to) noexcept {
  return std::rename(from.c_str(), to.c_str()) == 0;
}

bool flush_folder_of(const std::string& path) noexcept {
  const int folder = ::open(folder_of(path).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) return true;
  // Some file systems have no fsync of a folder, and say so by EINVAL.
  const bool flushed = ::fsync(folder) == 0 || errno == EINVAL;
  const int why = errno;
  ::close(folder);
  errno = why;
  return flushed;
}

void remove_file(const std::string& path) noexcept { ::unlink(path.c_str()); }

}  // namespace bristle::detail
