#include "bristle/state_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <exception>
#include <limits>

#include "bristle/error.hpp"
#include "core/common/hashing.hpp"
#include "core/common/little_endian.hpp"
#include "core/patches/saved_state.hpp"

namespace bristle {

using namespace detail;

namespace {

constexpr char file_magic[8] = {'b', 'r', 'i', 's', 't', 'l', 'e', 'F'};
constexpr std::uint32_t file_version = 1;
constexpr std::size_t head_size = 40;
constexpr std::size_t checksum_at = 32;

using Head = std::byte[head_size];

[[noreturn]] void fail(const std::string& path, const std::string& why) { throw Error(path + ": " + why); }
[[noreturn]] void fail_system(const std::string& path, const char* what) {
  fail(path, std::string(what) + ": " + std::strerror(errno));
}

/// An open file, closed whatever happens.
class Descriptor {
 public:
  explicit Descriptor(int number) noexcept : number_(number) {}
  ~Descriptor() { close(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  bool is_open() const noexcept { return number_ >= 0; }
  int number() const noexcept { return number_; }
  bool close() noexcept {
    const bool closed = number_ < 0 || ::close(number_) == 0;
    number_ = -1;
    return closed;
  }

 private:
  int number_;
};

bool write_all(int file, Span<const std::byte> bytes) noexcept {
  std::size_t at = 0;
  while (at < bytes.size()) {
    const ssize_t written = ::write(file, bytes.data() + at, bytes.size() - at);
    if (written < 0 && errno != EINTR) return false;
    if (written > 0) at += static_cast<std::size_t>(written);
  }
  return true;
}

/// False on an error; at an early end `bytes` is filled in part, and `got` says how far.
bool read_all(int file, std::byte* to, std::size_t size, std::size_t& got) noexcept {
  got = 0;
  while (got < size) {
    const ssize_t read = ::read(file, to + got, size - got);
    if (read == 0) return true;
    if (read < 0 && errno != EINTR) return false;
    if (read > 0) got += static_cast<std::size_t>(read);
  }
  return true;
}

std::uint64_t checksum(const Head& head, Span<const std::byte> extra) noexcept {
  Hasher hasher;
  add_bytes(hasher, {head, checksum_at});
  add_bytes(hasher, extra);
  return hasher.value();
}

std::string folder_of(const std::string& path) {
  const auto slash = path.rfind('/');
  return slash == std::string::npos ? "." : slash == 0 ? "/" : path.substr(0, slash);
}

/// A new file beside `path` under a name that no other thread or process uses, removed unless it was renamed.
class Temporary {
 public:
  explicit Temporary(const std::string& path) : file_(open_beside(path)) {
    if (!file_.is_open()) fail_system(path, "cannot be written");
  }
  ~Temporary() {
    if (!name_.empty()) ::unlink(name_.c_str());
  }
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;
  Descriptor& file() noexcept { return file_; }
  bool rename_to(const std::string& path) noexcept {
    if (std::rename(name_.c_str(), path.c_str()) != 0) return false;
    name_.clear();
    return true;
  }

 private:
  /// A process that was killed may have left a file behind, and the next one may have its number.
  int open_beside(const std::string& path) {
    static std::atomic<unsigned> count{0};
    int file = -1;
    do {
      std::string name =
          path + ".tmp." + std::to_string(::getpid()) + "." + std::to_string(count.fetch_add(1));
      file = ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
      if (file >= 0) name_ = std::move(name);
    } while (file < 0 && errno == EEXIST);
    return file;
  }

  std::string name_;  // before file_, which sets it
  Descriptor file_;
};

}  // namespace

void write_state_file(const std::string& path, Span<const std::byte> state, Span<const std::byte> extra) {
  // A rename would put a file in the place of a device or a pipe.
  struct stat there;
  if (::stat(path.c_str(), &there) == 0 && !S_ISREG(there.st_mode))
    fail(path, "is not a file: a state file cannot take its place");

  Head head;
  ByteWriter write(head);
  for (const char c : file_magic) write(c);
  write(file_version);
  write(std::uint32_t{0});
  write(std::uint64_t{state.size()});
  write(std::uint64_t{extra.size()});
  write(checksum(head, extra));

  Temporary temporary(path);
  const int file = temporary.file().number();
  const bool written = write_all(file, {head, head_size}) && write_all(file, state) &&
                       write_all(file, extra) && ::fsync(file) == 0;
  if (!written || !temporary.file().close() || !temporary.rename_to(path))
    fail_system(path, "cannot be written");

  // Else a power cut could bring the old name back.
  Descriptor folder(::open(folder_of(path).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  // Some file systems have no fsync of a folder, and say so by EINVAL.
  if (folder.is_open() && ::fsync(folder.number()) != 0 && errno != EINVAL)
    fail_system(path, "was written, but its folder could not be flushed");
}

StateFile read_state_file(const std::string& path, std::size_t most_bytes) {
  // Not blocking: a pipe must not hold us up before we see that it is one.
  Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  struct stat status;
  if (!file.is_open() || ::fstat(file.number(), &status) != 0) fail_system(path, "cannot be read");
  if (!S_ISREG(status.st_mode)) fail(path, "is not a file");
  const auto size = static_cast<std::uint64_t>(status.st_size);

  Head head;
  std::size_t got = 0;
  if (!read_all(file.number(), head, head_size, got)) fail_system(path, "cannot be read");
  ByteReader read(head);
  char magic[sizeof file_magic];
  for (char& c : magic) read(c);
  if (std::memcmp(magic, file_magic, std::min(got, sizeof magic)) != 0 || got == 0)
    fail(path, "is not a state file of bristle");
  if (got < head_size) fail(path, "is cut short");
  std::uint32_t version = 0, reserved = 0;
  read(version);
  read(reserved);
  if (version != file_version)
    fail(path, "is a state file of format " + std::to_string(version) +
                   "; this version of bristle reads format " + std::to_string(file_version));
  std::uint64_t state_size = 0, extra_size = 0, sum = 0;
  read(state_size);
  read(extra_size);
  read(sum);
  const std::uint64_t rest = size > head_size ? size - head_size : 0;
  if (state_size > rest || extra_size > rest - state_size) fail(path, "is cut short");
  if (state_size + extra_size < rest) fail(path, "is longer than a state file of its kind");
  if (size > most_bytes)
    fail(path,
         "holds " + std::to_string(size) + " bytes; here at most " + std::to_string(most_bytes) + " belong");

  StateFile contents;
  for (auto [bytes, wanted] :
       {std::pair(&contents.state, state_size), std::pair(&contents.extra, extra_size)}) {
    try {
      bytes->resize(static_cast<std::size_t>(wanted));
    } catch (const std::exception&) {  // bad_alloc, length_error: a file may say anything
      fail(path, "holds " + std::to_string(wanted) + " bytes: more than there is memory for");
    }
    if (!read_all(file.number(), bytes->data(), bytes->size(), got)) fail_system(path, "cannot be read");
    if (got < bytes->size()) fail(path, "is cut short");
  }
  bool sound = checksum(head, contents.extra) == sum;
  if (!sound) fail(path, "is damaged (its checksum does not agree)");
  try {
    sound = open_batch(contents.state).bytes == contents.state.size();
  } catch (const Error& error) {
    fail(path, error.what());
  }
  if (!sound) fail(path, "is damaged");
  return contents;
}

void save_state_file(const std::string& path, const PatchBatch& batch, Span<const std::byte> extra) {
  std::vector<std::byte> state(batch.state_size());
  batch.save_state(state);
  write_state_file(path, state, extra);
}

std::vector<std::byte> restore_state_file(const std::string& path, PatchBatch& batch,
                                          std::size_t most_extra_bytes) {
  constexpr std::size_t most = std::numeric_limits<std::size_t>::max();
  const std::size_t ours = head_size + batch.state_size();
  StateFile contents = read_state_file(path, most_extra_bytes > most - ours ? most : ours + most_extra_bytes);
  try {
    batch.restore_state(contents.state);
  } catch (const Error& error) {
    fail(path, error.what());
  }
  return std::move(contents.extra);
}

}  // namespace bristle
