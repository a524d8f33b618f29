#include "state_io.hpp"

#include <cstring>

#include "hashing.hpp"

namespace bristle::detail {
namespace {

template <class T>
void hash_columns(const PatchState& p, Hasher& hasher) noexcept {
  const auto* zx = static_cast<const T*>(p.zx);
  const auto* zy = static_cast<const T*>(p.zy);
  const auto* delta = static_cast<const T*>(p.delta);
  const auto* first = static_cast<const T*>(p.first);
  const std::uint32_t contact = p.in_contact();
  for (std::uint32_t i = 0; i < p.bristles; ++i) {
    const Block& block = p.blocks[i / block_size];
    // A block that entered together is written down when first visited: it reads as if it were.
    const bool straight = i >= contact || block.zero;
    if (i % block_size == 0 && i < contact)
      for (int axis = 0; axis < 2; ++axis)
        hasher.add(static_cast<std::uint64_t>(p.position[axis]) -
                   static_cast<std::uint64_t>(block.position[axis]));
    hasher.add(straight ? T(0) : zx[i]);
    if (zy != nullptr) hasher.add(straight ? T(0) : zy[i]);
    hasher.add(straight ? first[i] : delta[i]);
    if (p.draw != nullptr) hasher.add(std::uint64_t{p.draw[i]});
  }
}

}  // namespace

std::uint64_t hash_patch(const PatchState& p) noexcept {
  Hasher hasher;
  hasher.add(p.material->hash);
  hasher.add(p.weight);
  hasher.add(p.active);
  hasher.add(p.overload);
  if (p.is_double())
    hash_columns<double>(p, hasher);
  else
    hash_columns<float>(p, hasher);
  return hasher.value();
}

std::uint64_t signature(const PatchState& p) noexcept {
  Hasher hasher;
  hasher.add(p.material->hash);
  hasher.add(p.weight);
  hasher.add(p.options.max_normal_load);
  hasher.add(std::uint64_t{p.bristles});
  hasher.add(static_cast<std::uint64_t>(p.variant) << 8 | static_cast<std::uint64_t>(p.options.outputs) << 4 |
             (p.options.sampling == Sampling::random ? 2u : 0u) | (p.is_double() ? 1u : 0u));
  return hasher.value();
}

std::size_t saved_size(const PatchState& p) noexcept { return sizeof(SavedPatch) + p.storage_bytes; }

void save_patch(const PatchState& p, std::uint32_t slot, std::uint32_t generation, std::byte* to) noexcept {
  SavedPatch head;
  std::memset(static_cast<void*>(&head), 0, sizeof head);
  head.slot = slot;
  head.generation = generation;
  head.signature = signature(p);
  head.storage_bytes = p.storage_bytes;
  head.key = p.options.key;
  head.seed = p.options.seed;
  head.contact = p;
  std::memcpy(to, &head, sizeof head);
  std::memcpy(to + sizeof head, p.storage.get(), p.storage_bytes);
}

void restore_patch(PatchState& p, const std::byte* from) noexcept {
  SavedPatch head;
  std::memcpy(&head, from, sizeof head);
  p.options.key = head.key;
  p.options.seed = head.seed;
  static_cast<PatchContact&>(p) = head.contact;
  std::memcpy(p.storage.get(), from + sizeof head, p.storage_bytes);
  p.forget_bounds();
}

}  // namespace bristle::detail
