// Hash and saved bytes of a patch of bristles that slide at their limit. The format of the bytes:
// core/patches/SAVED_STATE.md.
#include "core/common/hashing.hpp"
#include "core/patches/sliders/sliders.hpp"

namespace bristle::detail {
namespace {

/// Lists the saved scalars. `p`: shared part of the patch, which has the rounded sums of deflections.
template <class Record, class Shared, class Visit>
void slider_fields(Record& r, Shared& p, Visit&& visit) noexcept {
  visit(r.stiff_zeta);
  for (auto& sum : p.part_sum) visit(sum);
  for (auto& position : p.part_position) visit(position);
}

bool within(double value, double most) noexcept { return detail::within(value, -most, most); }

}  // namespace

template <class T>
std::uint64_t hash_sliders(const Patch& p) noexcept {
  const Sliders<T>& r = sliders<T>(p);
  Hasher hasher;
  hasher.add(p.material().hash);
  hasher.add(p.zeta);
  hasher.add(r.stiff_zeta);
  hasher.add(std::uint64_t{r.bristles});
  if (!(p.zeta > 0.0)) return hasher.value();
  for (std::uint32_t i = 0; i < r.bristles; ++i) {
    if (i % block_size == 0)
      for (int axis = 0; axis < 2; ++axis)
        hasher.add(static_cast<std::uint64_t>(
            difference(p.position[axis], r.blocks[i / block_size].position[axis])));
    hasher.add(r.zx[i]);
    if (r.zy != nullptr) hasher.add(r.zy[i]);
    if (r.since != nullptr) hasher.add(time_of(p) - r.since[i]);
  }
  return hasher.value();
}

template <class T>
void save_sliders(const Patch& p, ByteWriter& write) noexcept {
  const Sliders<T>& r = sliders<T>(p);
  slider_fields(r, p, write);
  constexpr SlideBlock away{};
  for (std::uint32_t b = 0; b < r.block_count; ++b)
    block_fields(write, b < r.active_blocks() ? r.blocks[b] : away);
  const auto column = [&](const auto* from) {
    if (from != nullptr) write.column(from, r.bristles);
  };
  column(r.zx);
  column(r.zy);
  column(r.since);
}

template <class T>
const char* find_slider_fault(const Patch& p, const Patch& contact, ByteReader read) noexcept {
  const Sliders<T>& r = sliders<T>(p);
  const Material& m = p.material().material;
  Sliders<T> saved;
  Patch sums;
  slider_fields(saved, sums, read);
  // Refuses a stiffness above that of the highest load a motion may have.
  const double most = m.bristles_in_contact(highest_load);
  if (!(saved.stiff_zeta >= contact.zeta && saved.stiff_zeta <= most * (1.0 + 1e-9))) return "stiffness";
  if (contact.zeta == 0.0 && saved.stiff_zeta != 0.0) return "stiffness";
  const double excess = contact.zeta / (r.full_weight * r.bristles);
  if (contact.overload != (excess < 1.0 + 1e-14 ? 1.0 : excess)) return "overload";
  const double growth = r.since != nullptr ? m.ageing_factor(longest_time) : 1.0;
  const double longest = p.material().longest * growth * (1.0 + 1e-3);
  const double longest_units = longest * fixed_per_length;
  ByteReader blocks = read;
  read.skip(r.block_count * saved_block_size);
  for (int axis = 0; axis < p.axes; ++axis) {
    double moved = 0.0;
    ByteReader at = blocks;
    for (std::uint32_t i = 0; i < r.bristles; ++i) {
      T z;
      read(z);
      if (i % block_size == 0) {
        SlideBlock block{};
        block_fields(at, block);
        moved = to_lengths(difference(contact.position[axis], block.position[axis]));
        if (!within(static_cast<double>(block.stored[axis]), 3.0 * longest_units)) return "a block's sum";
      }
      const double bent = static_cast<double>(z) + moved;
      if (!within(moved, 3.0 * longest) || !within(bent, longest)) return "a deflection";
    }
    const double carried = to_lengths(difference(contact.position[axis], sums.part_position[axis]));
    if (!within(carried, 3.0 * longest)) return "the sum's position";
    if (!within(static_cast<double>(sums.part_sum[axis]) * length_per_fixed + carried, longest))
      return "the sum";
  }
  if (r.since != nullptr)
    for (std::uint32_t i = 0; i < r.bristles; ++i) {
      double since;
      read(since);
      if (!(since >= -1.0 && since <= 1e18)) return "a time";
    }
  return nullptr;
}

template <class T>
void restore_sliders(Patch& p, std::uint32_t seed, ByteReader read) noexcept {
  Sliders<T>& r = sliders<T>(p);
  r.options.seed = seed;
  Patch sums;
  slider_fields(r, sums, read);
  ByteReader blocks = read;
  read.skip(r.block_count * saved_block_size);
  const auto column = [&](auto* to) {
    if (to == nullptr) return;
    read.column(to, r.bristles);
    for (std::uint32_t i = r.bristles; i < r.rows(); ++i) to[i] = to[r.bristles - 1];
  };
  column(r.zx);
  column(r.zy);
  column(r.since);
  // Recomputes the sums of deflections, then replaces them by the saved ones, whose rounding errors differ.
  note_sliders<T>(p);
  for (std::uint32_t b = 0; b < r.block_count; ++b) block_fields(blocks, r.blocks[b]);
  for (int axis = 0; axis < 2; ++axis) {
    p.part_sum[axis] = sums.part_sum[axis];
    p.part_position[axis] = sums.part_position[axis];
  }
}

BRISTLE_INSTANTIATE(hash_sliders, save_sliders, find_slider_fault, restore_sliders)

}  // namespace bristle::detail
