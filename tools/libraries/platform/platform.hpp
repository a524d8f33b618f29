// All services of the operating system that the tools need besides threads and those of
// core/runtime/platform: posix.cpp has those of POSIX, linux.cpp the others. After a failure `errno` says
// why, unless a text does.
#pragma once

#include <cstdint>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace cli::platform {

// ------------------------------------------------------------------------------------------ program and
// terminal

/// Opens stdin, stdout and stderr if the caller left them closed: otherwise the next opened file would get
/// such a number, and printed text would go into that file. A closed stdout still refuses output. Also makes
/// a write beyond the size limit of files fail instead of ending the program. Call it first in main().
void hold_standard_streams() noexcept;

bool is_terminal(std::FILE* stream) noexcept;
/// Returns whether stdout is a terminal that shows colours.
bool shows_colours() noexcept;

/// Returns the folder of the running program; empty if unknown.
std::filesystem::path program_folder();
/// Returns a number that no other living process has.
unsigned process_number() noexcept;
std::tm utc(std::time_t time) noexcept;

std::string cpu_model();
/// Returns the bytes of free memory, or what a limit of this process leaves if that is less; the largest
/// number if neither is known.
std::uint64_t free_memory();

/// Runs a program found by PATH, without a shell and without arguments, and writes `input` to its stdin.
/// Returns its exit code, 127 if it is not installed; empty if it could not be started or was killed.
std::optional<int> feed_program(const char* name, std::string_view input);

// -------------------------------------------------------------------------------------------------------
// signals

/// Calls `handler` at each signal that ends a program, except for those by which a command ends in order.
void on_ending_signals(void (*handler)(int));
/// Calls `handler` at the signals that ask a program to stop.
void on_stop_signals(void (*handler)(int)) noexcept;

/// Holds back, while it lives, the signals of on_ending_signals() for this thread.
class HeldSignals {
 public:
  HeldSignals();
  ~HeldSignals();
  HeldSignals(const HeldSignals&) = delete;
  HeldSignals& operator=(const HeldSignals&) = delete;

 private:
  struct Mask;
  std::unique_ptr<Mask> before_;
};

// ---------------------------------------------------------------------------------------------------------
// files

/// Opens a file to read. Waits for the writer of a FIFO; after a second a line on stderr says so.
std::FILE* open_to_read(const std::string& path) noexcept;
/// Opens a path that is not a regular file to write. Waits for the reader of a FIFO, as open_to_read() does.
std::FILE* open_special(const std::string& path) noexcept;
/// Opens a new file to write. Fails with EEXIST if a file of that name exists.
std::FILE* create_file(const std::string& path) noexcept;

/// Kind of file that a path names. After `nothing`, `errno` says why.
enum class Kind { nothing, file, other };
Kind kind_of(const std::string& path) noexcept;
/// Returns whether this process may write an existing file.
bool is_writable(const std::string& path) noexcept;
/// Returns whether two names mean the same file. Devices may be named twice, so they count as different.
bool is_same(const std::string& a, const std::string& b);

void copy_permissions(const std::string& from, std::FILE* to) noexcept;
/// Forces what was written to a file onto the disk.
bool flush_to_disk(std::FILE* file) noexcept;
/// Replaces the file `to` by the file `from`: at every moment `to` is wholly the old file or the new one.
bool replace_file(const std::string& from, const std::string& to) noexcept;
/// Deletes a file. A signal handler may call it.
void remove_file(const char* path) noexcept;

/// File that one process at a time writes, at its end.
class LockedFile {
 public:
  LockedFile() = default;
  ~LockedFile() { close(); }
  LockedFile(const LockedFile&) = delete;
  LockedFile& operator=(const LockedFile&) = delete;

  bool is_open() const noexcept { return file_ >= 0; }
  /// Opens or makes the file.
  bool open(const std::string& path) noexcept;
  /// Locks the file until it is closed. Returns false if another process has locked it.
  bool lock() noexcept;
  std::int64_t size() noexcept;
  bool cut(std::int64_t size) noexcept;
  bool append(std::string_view text) noexcept;
  /// Forces the file's bytes to the disk.
  void flush() noexcept;
  void close() noexcept;

 private:
  int file_ = -1;
};

// ------------------------------------------------------------------------------------------- clock and real
// time

/// Returns the clock of DeadlineMonitor::wall_now, ns.
std::int64_t now_ns() noexcept;
/// Sleeps until a time of now_ns(). Returns early when a signal comes and `stop` returns true.
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

/// Makes the timers of the calling thread exact. Returns what use_timers() takes to undo it.
int use_exact_timers() noexcept;
void use_timers(int before) noexcept;

/// Binds the calling thread to a core and sets `before` to the cores on which it might run. Returns why the
/// system refuses; empty if it does not.
std::string bind_thread(int core, std::vector<int>& before);
void use_cores(const std::vector<int>& cores) noexcept;

/// Gives the calling thread the priority SCHED_FIFO, 1 to 99. Returns why the system refuses and what is used
/// instead; empty if it does not.
std::string take_fifo(int priority);
void use_usual_scheduling() noexcept;

/// Keeps pages in use in memory. Returns why the system refuses; empty if it does not.
std::string lock_memory();
void unlock_memory() noexcept;

}  // namespace cli::platform
