#include "core/common/saved_head.hpp"

#include <cstring>
#include <iterator>

#include "bristle/error.hpp"
#include "core/common/little_endian.hpp"

namespace bristle::detail {
namespace {

constexpr char magic[8] = {'b', 'r', 'i', 's', 't', 'l', 'e', 0};
constexpr std::uint32_t format = 7;
constexpr std::size_t checksum_at = 32;
constexpr const char* names[] = {"patches",  "keys of a pool", "points of a matcher",
                                 "outlines", "beds",           "joints"};

std::uint64_t checksum(Span<const std::byte> state) noexcept {
  Hasher hasher;
  add_bytes(hasher, {state.data(), checksum_at});
  add_bytes(hasher, {state.data() + saved_head_size, state.size() - saved_head_size});
  return hasher.value();
}

}  // namespace

void add_bytes(Hasher& hasher, Span<const std::byte> bytes) noexcept {
  ByteReader read(bytes.data());
  std::size_t left = bytes.size();
  for (; left >= 8; left -= 8) {
    std::uint64_t word = 0;
    read(word);
    hasher.add(word);
  }
  for (; left > 0; --left) {
    std::byte last{};
    read(last);
    hasher.add(static_cast<std::uint64_t>(last));
  }
}

void seal(SavedKind kind, std::uint64_t count, Span<std::byte> state) noexcept {
  ByteWriter write(state.data());
  for (const char c : magic) write(c);
  write(format);
  write(static_cast<std::uint32_t>(kind));
  write(std::uint64_t{state.size()});
  write(count);
  write(checksum({state.data(), state.size()}));
}

std::uint64_t open_sealed(const char* where, SavedKind kind, Span<const std::byte> state) {
  if (state.size() < saved_head_size) refuse_saved(where, "is cut short");
  ByteReader read(state.data());
  char its_magic[sizeof magic];
  for (char& c : its_magic) read(c);
  if (std::memcmp(its_magic, magic, sizeof magic) != 0) refuse_saved(where, "is not one of bristle");
  std::uint32_t its_format = 0, its_kind = 0;
  read(its_format);
  read(its_kind);
  if (its_format != format)
    refuse_saved(where, "has format " + std::to_string(its_format) +
                            "; this version of bristle reads format " + std::to_string(format));
  if (its_kind != static_cast<std::uint32_t>(kind))
    refuse_saved(where, std::string("has ") +
                            (its_kind < std::size(names) ? names[its_kind] : "something unknown") + ", not " +
                            names[static_cast<std::uint32_t>(kind)]);
  std::uint64_t bytes = 0, count = 0, sum = 0;
  read(bytes);
  read(count);
  read(sum);
  if (bytes > state.size()) refuse_saved(where, "is cut short");
  if (bytes < state.size())
    refuse_saved(where, "has " + std::to_string(state.size() - bytes) +
                            " bytes behind it: give exactly those that save_state wrote");
  if (checksum(state) != sum) refuse_saved(where, "is damaged (its checksum does not agree)");
  return count;
}

void refuse_saved(const char* where, const std::string& why) {
  throw Error(std::string(where) + "::restore_state: the saved state " + why);
}

}  // namespace bristle::detail
