// The services of systems with POSIX.
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <system_error>

#include "tools/libraries/files/one_line.hpp"
#include "tools/libraries/platform/platform.hpp"

namespace cli::platform {
namespace {

namespace fs = std::filesystem;

constexpr int ending[] = {SIGINT, SIGTERM, SIGHUP, SIGPIPE};

/// Closes a file without changing errno.
void close_after_failure(int file) noexcept {
  const int why = errno;
  ::close(file);
  errno = why;
}

/// Makes a stream from an open file descriptor. Closes the descriptor if that fails, so that it does not
/// leak.
std::FILE* stream_of(int file, const char* mode) noexcept {
  if (file < 0) return nullptr;
  std::FILE* const stream = ::fdopen(file, mode);
  if (stream == nullptr) close_after_failure(file);
  return stream;
}

/// Writes the whole text to a file descriptor. Returns false if that fails.
bool write_all(int file, std::string_view text) noexcept {
  while (!text.empty()) {
    const ssize_t wrote = ::write(file, text.data(), text.size());
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote < 0) return false;
    text.remove_prefix(static_cast<std::size_t>(wrote));
  }
  return true;
}

/// Returns whether a path contains a zero byte. The system would end the path there and take another file.
bool is_cut(const std::string& path) noexcept {
  if (path.find('\0') == std::string::npos) return false;
  errno = EINVAL;
  return true;
}

/// Waits until the FIFO has data, or its writer has closed it.
bool wait_for_writer(int file, const std::string& path) noexcept {
  constexpr int patience_ms = 1000;  // ms, wait for a writer before a message says so
  struct pollfd wanted = {file, POLLIN, 0};
  int ready = ::poll(&wanted, 1, patience_ms);
  if (ready == 0) {
    std::fprintf(stderr, "bristle: %s: a FIFO that nobody writes to yet; waiting (Ctrl-C ends it)\n",
                 one_line(path).c_str());
    ready = ::poll(&wanted, 1, -1);
  }
  return ready >= 0;
}

}  // namespace

void hold_standard_streams() noexcept {
  // Ignores the signal of a write beyond the limit of `ulimit -f`. The write then fails instead of ending the
  // program.
  std::signal(SIGXFSZ, SIG_IGN);
  for (const int number : {0, 1, 2})
    if (::fcntl(number, F_GETFD) < 0 && errno == EBADF)
      static_cast<void>(::open("/dev/null", number == 2 ? O_WRONLY : O_RDONLY));
}

bool is_terminal(std::FILE* stream) noexcept { return ::isatty(::fileno(stream)) != 0; }

bool shows_colours() noexcept {
  const char* const terminal = std::getenv("TERM");
  return is_terminal(stdout) && terminal != nullptr && std::string_view(terminal) != "dumb";
}

unsigned process_number() noexcept { return static_cast<unsigned>(::getpid()); }

void on_ending_signals(void (*handler)(int)) {
  for (const int number : ending) {
    struct sigaction now;
    if (::sigaction(number, nullptr, &now) == 0 && now.sa_handler == SIG_DFL) ::signal(number, handler);
  }
}

void on_stop_signals(void (*handler)(int)) noexcept {
  struct sigaction action {};
  action.sa_handler = handler;
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
}

HeldSignals::HeldSignals() {
  sigset_t held;
  sigemptyset(&held);  // called without ::, because it may be a macro, like sigaddset
  for (const int number : ending) sigaddset(&held, number);
  ::pthread_sigmask(SIG_BLOCK, &held, &before_);
}

HeldSignals::~HeldSignals() { ::pthread_sigmask(SIG_SETMASK, &before_, nullptr); }

std::FILE* open_to_read(const std::string& path) noexcept {
  if (is_cut(path)) return nullptr;
  // Opens without blocking, because opening a FIFO that has no writer would hang without a message.
  const int file = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  if (file < 0) return nullptr;
  struct stat status;
  if (::fstat(file, &status) != 0 || (S_ISFIFO(status.st_mode) && !wait_for_writer(file, path)) ||
      ::fcntl(file, F_SETFL, O_RDONLY) != 0) {
    close_after_failure(file);
    return nullptr;
  }
  return stream_of(file, "rb");
}

std::FILE* open_special(const std::string& path) noexcept {
  struct stat there;
  if (is_cut(path) || ::stat(path.c_str(), &there) != 0) return nullptr;
  // Refuses a socket, which cannot be opened. The system would report ENXIO for it, the error of a FIFO
  // without a reader.
  if (S_ISSOCK(there.st_mode)) {
    errno = ENOTSUP;
    return nullptr;
  }
  constexpr int pause_ms = 20, patience_ms = 1000;  // pause between trials, and time until a message says so
  int file = -1;
  // Tries again after ENXIO, which means that the FIFO has no reader yet.
  for (int waited = 0; waited < patience_ms; waited += pause_ms) {
    file = ::open(path.c_str(), O_WRONLY | O_NONBLOCK | O_CLOEXEC);
    if (file >= 0 || errno != ENXIO) break;
    ::poll(nullptr, 0, pause_ms);
  }
  if (file < 0 && errno == ENXIO) {
    std::fprintf(stderr, "bristle: %s: a FIFO that nobody reads yet; waiting (Ctrl-C ends it)\n",
                 one_line(path).c_str());
    file = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
  }
  if (file >= 0 && ::fcntl(file, F_SETFL, O_WRONLY) != 0) {
    close_after_failure(file);
    return nullptr;
  }
  return stream_of(file, "wb");
}

std::FILE* create_file(const std::string& path) noexcept {
  if (is_cut(path)) return nullptr;
  return stream_of(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666), "wb");
}

Kind kind_of(const std::string& path) noexcept {
  struct stat there;
  if (::stat(path.c_str(), &there) != 0) return Kind::nothing;
  return S_ISREG(there.st_mode) ? Kind::file : Kind::other;
}

bool is_writable(const std::string& path) noexcept { return ::access(path.c_str(), W_OK) == 0; }

bool is_same(const std::string& a, const std::string& b) {
  struct stat first, second;
  const bool there = ::stat(a.c_str(), &first) == 0;
  if (there != (::stat(b.c_str(), &second) == 0)) return false;
  if (there) return first.st_dev == second.st_dev && first.st_ino == second.st_ino && !S_ISCHR(first.st_mode);
  std::error_code error;
  return fs::weakly_canonical(a, error) == fs::weakly_canonical(b, error);
}

bool flush_to_disk(std::FILE* file) noexcept { return ::fsync(::fileno(file)) == 0; }

void remove_file(const char* path) noexcept { ::unlink(path); }

bool LockedFile::open(const std::string& path) noexcept {
  if (is_cut(path)) return false;
  file_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_APPEND | O_NOFOLLOW | O_CLOEXEC, 0666);
  return is_open();
}

bool LockedFile::lock() noexcept { return ::flock(file_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK; }

std::int64_t LockedFile::size() noexcept { return ::lseek(file_, 0, SEEK_END); }

bool LockedFile::cut(std::int64_t size) noexcept { return ::ftruncate(file_, size) == 0; }

bool LockedFile::append(std::string_view text) noexcept { return write_all(file_, text); }

void LockedFile::close() noexcept {
  if (file_ >= 0) ::close(file_);
  file_ = -1;
}

std::int64_t now_ns() noexcept {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * std::int64_t{1'000'000'000} + now.tv_nsec;
}

}  // namespace cli::platform
