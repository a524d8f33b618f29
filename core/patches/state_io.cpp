#include "core/patches/state_io.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "bristle/error.hpp"
#include "core/common/hashing.hpp"
#include "core/common/little_endian.hpp"

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
        hasher.add(static_cast<std::uint64_t>(difference(p.position[axis], block.position[axis])));
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
  hasher.add(p.full_weight);
  hasher.add(p.options.max_normal_load);
  hasher.add(std::uint64_t{p.bristles} << 32 | p.first_seed);
  hasher.add(static_cast<std::uint64_t>(p.variant) << 8 | static_cast<std::uint64_t>(p.options.outputs) << 4 |
             (p.options.sampling == Sampling::random ? 2u : 0u) | (p.is_double() ? 1u : 0u));
  return hasher.value();
}

// --------------------------------------------------------------------------------------------- bytes

namespace {

constexpr char saved_magic[8] = {'b', 'r', 'i', 's', 't', 'l', 'e', 0};
constexpr std::uint32_t saved_version = 2;
constexpr std::size_t checksum_at = 32;

/// What a patch's head, contact and blocks hold, in this order: the one list for writing and for reading.
/// Sums over blocks are not among them: they follow from the blocks.
template <class Io, class Head>
void head_fields(Io& io, Head& head) noexcept {
  io(head.slot);
  io(head.generation);
  io(head.signature);
  io(head.bytes);
  io(head.key);
  io(head.seed);
}
template <class Io, class Contact>
void contact_fields(Io& io, Contact& c) noexcept {
  io(c.normal_load);
  io(c.zeta);
  io(c.active);
  io(c.overload);
  io(c.fraction);
  io(c.position[0]);
  io(c.position[1]);
  io(c.pending_dissipated);
  io(c.pending_loss);
  io(c.pending_snaps);
  io(c.weight);
  io(c.detail);
  io(c.whole);
}
constexpr std::size_t contact_size = 11 * 8 + 2 * 4;

template <class Io, class AnyBlock>
void block_fields(Io& io, AnyBlock& block) noexcept {
  for (int axis = 0; axis < 2; ++axis) io(block.position[axis]);
  for (int axis = 0; axis < 2; ++axis) io(block.stored[axis]);
}
constexpr std::size_t block_fields_size = 4 * 8;

/// Bristles of block b that are in contact, and of these the ones whose columns are written down.
struct Part {
  std::uint32_t first, size, bent;
};
Part part_of(const PatchState& p, std::uint32_t b) noexcept {
  const std::uint32_t first = b * block_size;
  const std::uint32_t contact = p.in_contact();
  const std::uint32_t size = std::min(block_size, p.bristles - first);
  const std::uint32_t touching = contact > first ? std::min(size, contact - first) : 0;
  return {first, size, p.blocks[b].zero ? 0 : touching};
}

/// A column of deflections: straight bristles read 0, whatever was left in memory.
template <class T>
void write_deflections(const PatchState& p, const void* column, ByteWriter& write) noexcept {
  for (std::uint32_t b = 0; b < p.block_count; ++b) {
    const Part part = part_of(p, b);
    write.column(static_cast<const T*>(column) + part.first, part.bent);
    write.zeros<T>(part.size - part.bent);
  }
}

template <class T>
void write_columns(const PatchState& p, ByteWriter& write) noexcept {
  write_deflections<T>(p, p.zx, write);
  if (p.zy != nullptr) write_deflections<T>(p, p.zy, write);
  if (p.draw == nullptr) return;
  for (std::uint32_t b = 0; b < p.block_count; ++b) {
    const Part part = part_of(p, b);
    write.column(static_cast<const T*>(p.delta) + part.first, part.bent);
    write.column(static_cast<const T*>(p.first) + part.first + part.bent, part.size - part.bent);
  }
  write.column(p.draw, p.bristles);
}

template <class T>
void read_columns(PatchState& p, ByteReader& read) noexcept {
  read.column(static_cast<T*>(p.zx), p.bristles);
  if (p.zy != nullptr) read.column(static_cast<T*>(p.zy), p.bristles);
  if (p.draw == nullptr) return;
  read.column(static_cast<T*>(p.delta), p.bristles);
  read.column(p.draw, p.bristles);
}

/// Bristles out of contact are straight and have their first snap length, whatever the bytes said.
template <class T>
void straighten_others(PatchState& p) noexcept {
  for (std::uint32_t i = p.in_contact(); i < p.bristles; ++i) {
    static_cast<T*>(p.zx)[i] = T(0);
    if (p.zy != nullptr) static_cast<T*>(p.zy)[i] = T(0);
    if (p.draw != nullptr) static_cast<T*>(p.delta)[i] = static_cast<const T*>(p.first)[i];
  }
}

std::uint64_t checksum(Span<const std::byte> state) noexcept {
  Hasher hasher;
  add_bytes(hasher, {state.data(), checksum_at});
  add_bytes(hasher, {state.data() + saved_batch_size, state.size() - saved_batch_size});
  return hasher.value();
}

bool within(double value, double low, double high) noexcept { return value >= low && value <= high; }

/// Deflections and snap lengths of the bristles in contact.
template <class T>
const char* find_column_fault(const PatchState& p, const PatchContact& contact,
                              const std::byte* blocks) noexcept {
  // Rounding may carry a bristle a little over its length.
  const double longest = p.material->longest * (1.0 + 1e-3);
  const double shortest = p.material->shortest * (1.0 - 1e-3);
  const std::uint32_t touching = contact.whole + (contact.fraction > 0.0 ? 1u : 0u);
  const std::size_t column = std::size_t{p.bristles} * sizeof(T);
  const std::byte* const columns = blocks + p.block_count * block_fields_size;
  const auto number = [columns](std::size_t at) {
    T value;
    ByteReader read(columns + at);
    read(value);
    return static_cast<double>(value);
  };
  ByteReader read(blocks);
  for (std::uint32_t b = 0; b * block_size < touching; ++b) {
    Block block{};
    block_fields(read, block);
    double moved[2];
    for (int axis = 0; axis < 2; ++axis) {
      moved[axis] =
          length_per_fixed * static_cast<double>(difference(contact.position[axis], block.position[axis]));
      if (!within(moved[axis], -2.0 * longest, 2.0 * longest)) return "a block's displacement";
      const double most = block_size * longest * fixed_per_length;
      if (!within(static_cast<double>(block.stored[axis]), -most, most)) return "a block's sum";
    }
    const std::uint32_t end = std::min((b + 1) * block_size, touching);
    for (std::uint32_t i = b * block_size; i < end; ++i) {
      for (int axis = 0; axis < p.options.axes; ++axis) {
        const double z = number(static_cast<std::size_t>(axis) * column + i * sizeof(T));
        if (!within(z, -longest, longest) || !within(z + moved[axis], -longest, longest))
          return "a deflection";
      }
      if (p.draw == nullptr) continue;
      const double delta = number(static_cast<std::size_t>(p.options.axes) * column + i * sizeof(T));
      if (!within(delta, shortest, longest)) return "a snap length";
    }
  }
  return nullptr;
}

const char* find_contact_fault(const PatchState& p, const PatchContact& c) noexcept {
  constexpr double most = 1e302;
  if (!within(c.normal_load, 0.0, highest_load)) return "normal_load";
  const double zeta = p.material->material.bristles_in_contact(c.normal_load);
  if (!(std::abs(c.zeta - zeta) <= 1e-9 * zeta + 1e-300)) return "zeta";
  if (c.detail < 1 || c.detail > p.bristles) return "detail";
  const double all = p.full_weight * p.bristles;
  if (!(std::abs(c.weight * c.detail - all) <= 1e-9 * all)) return "weight";
  // Contact that the load does not explain would be forces without it, or forces and energies beyond all
  // numbers.
  const ContactCount count = count_contacts(c.zeta, c.weight, c.detail);
  if (c.overload != count.overload) return "overload";
  if (c.active != count.active) return "active";
  if (c.whole != count.whole) return "whole";
  if (c.fraction != count.fraction) return "fraction";
  if (!within(c.pending_dissipated, 0.0, most)) return "pending_dissipated";
  if (!within(c.pending_loss, -most, most)) return "pending_loss";
  return nullptr;
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

void seal_batch(const SavedBatch& head, Span<std::byte> state) noexcept {
  ByteWriter write(state.data());
  for (const char c : saved_magic) write(c);
  write(saved_version);
  write(std::uint32_t{0});
  write(head.bytes);
  write(head.patches);
  write(checksum(state));
}

SavedBatch open_batch(Span<const std::byte> state) {
  if (state.size() < saved_batch_size) throw Error("restore_state: the saved state is cut short");
  ByteReader read(state.data());
  char magic[sizeof saved_magic];
  for (char& c : magic) read(c);
  if (std::memcmp(magic, saved_magic, sizeof magic) != 0)
    throw Error("restore_state: this is not a state saved by bristle");
  std::uint32_t version = 0;
  read(version);
  if (version != saved_version)
    throw Error("restore_state: the saved state has format " + std::to_string(version) +
                "; this version of bristle reads format " + std::to_string(saved_version));
  std::uint32_t reserved = 0;
  read(reserved);
  SavedBatch head;
  read(head.bytes);
  read(head.patches);
  std::uint64_t sum = 0;
  read(sum);
  if (head.bytes > state.size()) throw Error("restore_state: the saved state is cut short");
  if (head.bytes < saved_batch_size || checksum({state.data(), static_cast<std::size_t>(head.bytes)}) != sum)
    throw Error("restore_state: the saved state is damaged (its checksum does not agree)");
  return head;
}

std::size_t saved_size(const PatchState& p) noexcept {
  const std::size_t number = p.is_double() ? sizeof(double) : sizeof(float);
  const std::size_t redraw = p.draw != nullptr ? 1 : 0;
  const std::size_t bristle =
      (static_cast<std::size_t>(p.options.axes) + redraw) * number + redraw * sizeof(std::uint32_t);
  return saved_patch_size + contact_size + p.block_count * block_fields_size + p.bristles * bristle;
}

void save_patch(const PatchState& p, std::uint32_t slot, std::uint32_t generation, std::byte* to) noexcept {
  ByteWriter write(to);
  const SavedPatch head{slot, generation, signature(p), saved_size(p), p.options.key, p.options.seed};
  head_fields(write, head);
  contact_fields(write, static_cast<const PatchContact&>(p));
  constexpr Block away{};
  for (std::uint32_t b = 0; b < p.block_count; ++b)
    block_fields(write, b < p.active_blocks() ? p.blocks[b] : away);
  if (p.is_double())
    write_columns<double>(p, write);
  else
    write_columns<float>(p, write);
}

SavedPatch read_saved_patch(const std::byte* from) noexcept {
  SavedPatch head;
  ByteReader read(from);
  head_fields(read, head);
  return head;
}

const char* find_fault(const PatchState& p, const std::byte* from) noexcept {
  PatchContact contact;
  ByteReader read(from + saved_patch_size);
  contact_fields(read, contact);
  if (const char* fault = find_contact_fault(p, contact)) return fault;
  const std::byte* const blocks = from + saved_patch_size + contact_size;
  return p.is_double() ? find_column_fault<double>(p, contact, blocks)
                       : find_column_fault<float>(p, contact, blocks);
}

void restore_patch(PatchState& p, const std::byte* from) noexcept {
  const SavedPatch head = read_saved_patch(from);
  p.options.key = head.key;
  change_seed(p, head.seed);
  ByteReader read(from + saved_patch_size);
  contact_fields(read, static_cast<PatchContact&>(p));
  for (std::uint32_t b = 0; b < p.block_count; ++b) block_fields(read, p.blocks[b]);
  if (p.is_double()) {
    read_columns<double>(p, read);
    straighten_others<double>(p);
  } else {
    read_columns<float>(p, read);
    straighten_others<float>(p);
  }
  find_block_sums(p);
  p.forget_bounds();
}

}  // namespace bristle::detail
