// Seals the saved bytes of pools, matchers, outlines and joints with 16 bytes in front: a magic number and a
// checksum, by which foreign or damaged bytes are refused.
#pragma once

#include <cstdint>
#include <string>

#include "bristle/error.hpp"
#include "bristle/span.hpp"
#include "core/common/hashing.hpp"
#include "core/common/little_endian.hpp"
#include "core/patches/saved_state.hpp"

namespace bristle::detail {

constexpr std::size_t seal_size = 16;

inline std::uint64_t checksum_behind_seal(Span<const std::byte> bytes) noexcept {
  Hasher hasher;
  add_bytes(hasher, Span<const std::byte>(bytes.data() + seal_size, bytes.size() - seal_size));
  return hasher.value();
}

/// Writes magic number and checksum into the first 16 of `bytes`. The bytes behind them must already be
/// written.
inline void seal(Span<std::byte> bytes, std::uint64_t magic) noexcept {
  ByteWriter head(bytes.data());
  head(magic);
  head(checksum_behind_seal({bytes.data(), bytes.size()}));
}

[[noreturn]] inline void refuse_saved(const char* where, const char* why) {
  throw Error(std::string(where) + "::restore_state: the saved state " + why);
}

/// Checks magic number and checksum, and returns a reader of the bytes behind them. Throws Error for bytes
/// that seal() did not write.
inline ByteReader open_sealed(const char* where, Span<const std::byte> bytes, std::uint64_t magic) {
  if (bytes.size() < seal_size) refuse_saved(where, "is cut short");
  std::uint64_t its_magic = 0, checksum = 0;
  ByteReader read(bytes.data());
  read(its_magic);
  read(checksum);
  if (its_magic != magic) refuse_saved(where, "is of another kind");
  if (checksum_behind_seal(bytes) != checksum) refuse_saved(where, "is damaged or cut short");
  return read;
}

}  // namespace bristle::detail
