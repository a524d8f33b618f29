#include "bristle/state_file.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <exception>
#include <limits>

#include "bristle/error.hpp"
#include "core/common/hashing.hpp"
#include "core/common/little_endian.hpp"
#include "core/patches/saved_state.hpp"
#include "core/runtime/platform/platform.hpp"

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

std::uint64_t checksum(const Head& head, Span<const std::byte> extra) noexcept {
  Hasher hasher;
  add_bytes(hasher, {head, checksum_at});
  add_bytes(hasher, extra);
  return hasher.value();
}

/// A new file beside `path` under a name that no other thread or process uses. The destructor removes it
/// unless it was renamed.
class Temporary {
 public:
  explicit Temporary(const std::string& path) : file_(open_beside(path)) {
    if (!file_.is_open()) fail_system(path, "cannot be written");
  }
  ~Temporary() {
    file_.close();  // closed first, because Windows does not remove an open file
    if (!name_.empty()) remove_file(name_);
  }
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;
  File& file() noexcept { return file_; }
  bool rename_to(const std::string& path) noexcept {
    if (!replace_file(name_, path)) return false;
    name_.clear();
    return true;
  }

 private:
  /// Tries names until one is new: a killed process may have left a file, and process numbers repeat.
  File open_beside(const std::string& path) {
    static std::atomic<unsigned> count{0};
    while (true) {
      std::string name =
          path + ".tmp." + std::to_string(process_number()) + "." + std::to_string(count.fetch_add(1));
      File file = File::create(name);
      if (file.is_open()) name_ = std::move(name);
      if (file.is_open() || errno != EEXIST) return file;
    }
  }

  std::string name_;  // declared before file_, because making file_ sets it
  File file_;
};

}  // namespace

void write_state_file(const std::string& path, Span<const std::byte> state, Span<const std::byte> extra) {
  // Refuses a device or a pipe, because renaming a file to its name would replace it.
  if (is_occupied(path)) fail(path, "is not a file: a state file cannot take its place");

  Head head;
  ByteWriter write(head);
  for (const char c : file_magic) write(c);
  write(file_version);
  write(std::uint32_t{0});
  write(std::uint64_t{state.size()});
  write(std::uint64_t{extra.size()});
  write(checksum(head, extra));

  Temporary temporary(path);
  File& file = temporary.file();
  const bool written =
      file.write({head, head_size}) && file.write(state) && file.write(extra) && file.flush();
  if (!written || !file.close() || !temporary.rename_to(path)) fail_system(path, "cannot be written");
  // Flushes the folder: without this a power cut could undo the renaming.
  if (!flush_folder_of(path)) fail_system(path, "was written, but its folder could not be flushed");
}

StateFile read_state_file(const std::string& path, std::size_t most_bytes) {
  if (is_occupied(path)) fail(path, "is not a file");
  File file = File::open_to_read(path);
  if (!file.is_open()) fail_system(path, "cannot be read");
  const File::Kind kind = file.kind();
  if (!kind.known) fail_system(path, "cannot be read");
  if (!kind.regular) fail(path, "is not a file");
  const std::uint64_t size = kind.size;

  Head head;
  std::size_t got = 0;
  if (!file.read(head, head_size, got)) fail_system(path, "cannot be read");
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
    } catch (const std::exception&) {  // bad_alloc or length_error: a file may be larger than memory
      fail(path, "holds " + std::to_string(wanted) + " bytes: more than there is memory for");
    }
    if (!file.read(bytes->data(), bytes->size(), got)) fail_system(path, "cannot be read");
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
