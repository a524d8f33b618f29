// Corrects the head of a saved state whose bytes a test has changed.
#pragma once

#include <cstdint>

#include "core/common/little_endian.hpp"
#include "core/common/saved_head.hpp"

namespace bristle_test {

/// Writes length and checksum of a changed saved state, and leaves its kind and count as they stand.
inline void reseal(bristle::Span<std::byte> state) {
  if (state.size() < bristle::detail::saved_head_size) return;
  std::uint32_t kind = 0;
  std::uint64_t bytes = 0, count = 0;
  bristle::detail::ByteReader read(state.data() + 12);
  read(kind);
  read(bytes);
  read(count);
  bristle::detail::seal(static_cast<bristle::detail::SavedKind>(kind), count, state);
}

}  // namespace bristle_test
