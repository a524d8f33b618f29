// The services of the operating system that the tools need, besides threads and those of
// core/runtime/platform. posix.cpp has those of POSIX, linux.cpp the others. After a failure `errno` says
// why, unless the function returns a text.
#pragma once

#include <csignal>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>

namespace cli::platform {

// Functions for the program and its terminal.

/// Opens stdin, stdout and stderr if the caller left them closed. Otherwise the next file opened would get
/// such a number, and printed text would go into that file. A closed stdout still refuses output. Also makes
/// a write beyond the size limit of files fail instead of ending the program. Call it first in main().
void hold_standard_streams() noexcept;

bool is_terminal(std::FILE* stream) noexcept;
/// Returns whether stdout is a terminal that can show colours.
bool shows_colours() noexcept;

/// Returns the folder of the running program, beside which its data lie; empty if unknown.
std::filesystem::path program_folder();
/// Returns the number of this process, which no other living process has.
unsigned process_number() noexcept;

std::string cpu_model();
/// Returns the bytes of free memory, or what a limit of this process leaves if that is less; the largest
/// number if neither is known.
std::uint64_t free_memory();

// Functions for signals.

/// Calls `handler` at each signal that kills the program. Signals at which a command ends in order are not
/// among them.
void on_ending_signals(void (*handler)(int));
/// Calls `handler` at the signals that ask the program to stop, such as that of Ctrl-C.
void on_stop_signals(void (*handler)(int)) noexcept;

/// Holds back, while it lives, the signals of on_ending_signals() for this thread, so that none comes at a
/// bad moment.
class HeldSignals {
 public:
  HeldSignals();
  ~HeldSignals();
  HeldSignals(const HeldSignals&) = delete;
  HeldSignals& operator=(const HeldSignals&) = delete;

 private:
  sigset_t before_;
};

// Functions for files.

/// Opens a file to read. If it is a FIFO, waits for its writer; after a second a line on stderr says so.
std::FILE* open_to_read(const std::string& path) noexcept;
/// Opens a path that is not a regular file to write. If it is a FIFO, waits for its reader, as open_to_read()
/// does for its writer.
std::FILE* open_special(const std::string& path) noexcept;
/// Opens a new file to write. Fails with EEXIST if a file of that name exists.
std::FILE* create_file(const std::string& path) noexcept;

/// Kind of file that a path names. After the answer `nothing`, `errno` says why.
enum class Kind { nothing, file, other };
Kind kind_of(const std::string& path) noexcept;
/// Returns whether the system allows this process to write an existing file.
bool is_writable(const std::string& path) noexcept;
/// Returns whether two names mean the same file. Devices may be named twice, so they count as different.
bool is_same(const std::string& a, const std::string& b);

/// Writes the buffered bytes of a file and forces them onto the disk.
bool flush_to_disk(std::FILE* file) noexcept;
/// Deletes a file. Allocates nothing, so that a signal handler may call it.
void remove_file(const char* path) noexcept;

/// File that only one process at a time may write, at its end.
class LockedFile {
 public:
  LockedFile() = default;
  ~LockedFile() { close(); }
  LockedFile(const LockedFile&) = delete;
  LockedFile& operator=(const LockedFile&) = delete;

  bool is_open() const noexcept { return file_ >= 0; }
  /// Opens or makes the file.
  bool open(const std::string& path) noexcept;
  /// Locks the file against other processes until it is closed. Returns false if another process has locked
  /// it.
  bool lock() noexcept;
  std::int64_t size() noexcept;
  bool cut(std::int64_t size) noexcept;
  bool append(std::string_view text) noexcept;
  /// Forces the written bytes to the disk, so that a power failure does not lose them.
  void flush() noexcept;
  void close() noexcept;

 private:
  int file_ = -1;
};

// Functions for clocks and real time.

/// Returns the clock of DeadlineMonitor::wall_now, ns.
std::int64_t now_ns() noexcept;
/// Sleeps until a time of the clock now_ns(). Returns early when a signal comes and `stop` returns true.
void sleep_until(std::int64_t ns, bool (*stop)() noexcept) noexcept;

/// Returns the CPU time (s) that the hypervisor has stolen from all cores since the system started; 0 if the
/// system does not report it.
double stolen_now();

/// Reads how long this thread was ready to run while its core did something else, as Linux reports it: the
/// effect of a busy machine. Make and read it on one thread; a read is a system call of about a microsecond.
class QueueClock {
 public:
  QueueClock() noexcept;
  ~QueueClock();
  QueueClock(const QueueClock&) = delete;
  QueueClock& operator=(const QueueClock&) = delete;

  double now() const noexcept;  ///< s waited for a core since the thread was made; 0 if unknown

 private:
  int file_;
};

}  // namespace cli::platform
