// All services of the operating system that core needs besides threads: clocks, counters of a thread, and
// files. One source for each family of systems: posix.cpp, windows.cpp. Paths are UTF-8 everywhere.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "bristle/deadline_monitor.hpp"
#include "bristle/span.hpp"

namespace bristle::detail {

/// Returns the seconds of a clock that never goes back.
double monotonic_seconds() noexcept;

/// Returns the seconds for which the calling thread has had a core.
double thread_seconds() noexcept;

/// Returns the counters of the calling thread and its process so far; zeros for those that the system lacks.
ThreadEvents thread_events() noexcept;

/// Returns a number that no other living process has.
unsigned process_number() noexcept;

/// An open file, closed by the destructor. After a failure `errno` says why.
class File {
 public:
  /// Opens a new file to write. Fails with EEXIST if a file of that name exists.
  static File create(const std::string& path) noexcept;
  /// Opens a file to read. Does not wait for the other end of a pipe.
  static File open_to_read(const std::string& path) noexcept;

  ~File() { close(); }
  File(File&& other) noexcept : number_(other.number_) { other.number_ = -1; }
  File& operator=(File&&) = delete;

  bool is_open() const noexcept { return number_ >= 0; }
  bool close() noexcept;
  bool write(Span<const std::byte> bytes) noexcept;
  /// Reads `size` bytes. Returns false on an error; at an early end `to` is filled in part, and `got` is the
  /// number of bytes.
  bool read(std::byte* to, std::size_t size, std::size_t& got) noexcept;
  /// Flushes the file to the disk.
  bool flush() noexcept;

  struct Kind {
    bool known, regular;
    std::uint64_t size;
  };
  Kind kind() const noexcept;

 private:
  explicit File(int number) noexcept : number_(number) {}
  int number_;
};

/// Whether `path` names something other than a regular file: a device, a pipe, a folder.
bool is_occupied(const std::string& path) noexcept;

/// Renames the file `from` to `to`; at every moment `to` is wholly the old file or the new one.
bool replace_file(const std::string& from, const std::string& to) noexcept;

/// Flushes the folder of `path`, so that a replaced file in it survives a power cut. Returns true also if the
/// system cannot do that.
bool flush_folder_of(const std::string& path) noexcept;

void remove_file(const std::string& path) noexcept;

}  // namespace bristle::detail
