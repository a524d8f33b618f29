// Energy, hash, saved bytes and reading of a patch of representatives. core/patches/SAVED_STATE.md has the
// format.
#include <algorithm>

#include "core/common/hashing.hpp"
#include "core/patches/representatives/population.hpp"
#include "core/patches/representatives/representatives.hpp"

namespace bristle::detail {
namespace {

/// Lists the saved counts of bristles in contact, for writing and for reading.
template <class Count, class Visit>
void count_fields(Count& c, Visit&& visit) noexcept {
  visit(c.active);
  visit(c.fraction);
  visit(c.whole);
}

/// Offsets of a bristle's numbers in the saved columns, in bytes from the first column to the column of each
/// number. A column that the record does not have has the offset `none`.
struct SavedOffsets {
  static constexpr std::size_t none = ~std::size_t{0};
  std::size_t deflection[2] = {none, none}, length = none, age = none;
};
template <class T>
SavedOffsets saved_offsets(const Representatives<T>& r) noexcept {
  SavedOffsets offsets;
  std::size_t at = 0;
  Representatives<T>::columns(r, [&](const auto* column, const ColumnRule& rule) {
    if (rule.count == 0 || !is_saved(rule.filler)) return;
    if (rule.filler == Filler::zero)
      offsets.deflection[offsets.deflection[0] == SavedOffsets::none ? 0 : 1] = at;
    if (rule.filler == Filler::first_length) offsets.length = at;
    if (rule.filler == Filler::age) offsets.age = at;
    at += std::size_t{r.bristles} * sizeof *column;
  });
  return offsets;
}

/// Largest number of snaps of a bristle in a piece of path. It limits a saved number: the renewals that
/// earlier snaps have caused and that are still to be made.
constexpr double most_snaps_of_piece = 64.0;

// Lists the saved scalars of shared renewal. The hash leaves out those of young bristles if none is young,
// and those of the slide if there is none, because they have no effect then.

template <class T, class State, class Visit>
void renewal_fields(State& s, const Representatives<T>& r, Visit&& visit) noexcept {
  const double most = most_snaps_of_piece * largest_renewal * r.bristles;
  const Hashed young = s.young_from == RenewalState::none_young ? Hashed::apart : Hashed::value;
  visit(s.due, FieldRule{"renewals due", -most, most});
  visit(s.selections);
  visit(s.run);
  visit(s.young_run, FieldRule{.hashed = young});
  visit(s.young_from, FieldRule{.hashed = young});
}
template <class State, class Visit>
void course_fields(State& s, Visit&& visit) noexcept {
  for (int axis = 0; axis < 2; ++axis) {
    visit(s.direction[axis], FieldRule{"direction", -1.0, 1.0});
    visit(s.slid_to[axis], positioned(axis));
  }
}
template <class State, class Visit>
void slide_age_fields(State& s, Visit&& visit) noexcept {
  visit(s.run_ageing, FieldRule{"run_ageing", 0.0, oldest_bristle});
  visit(s.run_until, FieldRule{"run_until", 0.0, 1e18, Hashed::time});
}
template <class T, class State, class Visit>
void all_renewal_fields(State& s, const Representatives<T>& r, Visit&& visit) noexcept {
  renewal_fields(s, r, visit);
  course_fields(s, visit);
  if (r.ages()) slide_age_fields(s, visit);
}

/// Returns the number of bytes saved for a block; with ageing they include the time of its last rewrite.
template <class T>
std::size_t block_size_of(const Representatives<T>& r) noexcept {
  return saved_block_size + (r.ages() ? 8 : 0);
}

/// Bristles of one block, for saving: the number of the first, how many they are, and how many of them are in
/// contact, not straight. Only these have their columns saved; the others have the filler value.
struct Part {
  std::uint32_t first, size, bent;
};
template <class T>
Part part_of(const Representatives<T>& r, std::uint32_t b) noexcept {
  const std::uint32_t first = b * block_size;
  const std::uint32_t contact = r.in_contact();
  const std::uint32_t size = std::min(block_size, r.bristles - first);
  const std::uint32_t touching = contact > first ? std::min(size, contact - first) : 0;
  return {first, size, r.blocks[b].zero ? 0 : touching};
}

/// Adds the value of bristle i in a column to a hash. For a bristle that is out of contact or straight that
/// is the filler value of the column, whatever is stored.
template <class T>
struct Reading {
  const Representatives<T>& r;
  bool straight;

  void add(Hasher& hasher, const T* column, const ColumnRule& rule, std::uint32_t i) const noexcept {
    const T filler =
        rule.filler == Filler::first_length || rule.filler == Filler::from_seed ? r.first[i] : T(0);
    hasher.add(straight ? filler : column[i]);
  }
  void add(Hasher& hasher, const std::uint32_t* column, const ColumnRule&, std::uint32_t i) const noexcept {
    hasher.add(std::uint64_t{column[i]});
  }
  template <class Other>
  void add(Hasher&, const Other*, const ColumnRule&, std::uint32_t) const noexcept {}
};

/// Checks a saved block and names its first fault; null if there is none. A deflection is the stored value
/// plus the displacement of the patch since the block was rewritten. A renewed bristle stores its deflection
/// less that displacement, which may be larger than any deflection. So `farthest` bounds stored values, and
/// `longest` deflections.
const char* find_block_fault(const Block& block, const double (&moved)[2], double longest,
                             double farthest) noexcept {
  const double most = block_size * farthest * fixed_per_length;
  for (int axis = 0; axis < 2; ++axis) {
    if (!within(moved[axis], -2.0 * longest, 2.0 * longest)) return "a block's displacement";
    if (!within(static_cast<double>(block.stored[axis]), -most, most)) return "a block's sum";
  }
  return nullptr;
}

/// Refuses saved counts of bristles in contact that contradict the load: they would give a force without
/// load, or an infinite one.
template <class T>
const char* find_count_fault(const Representatives<T>& r, const Patch& contact,
                             const RepresentativeCount& c) noexcept {
  const ContactCount count = count_contacts(contact.zeta, r.full_weight, r.bristles);
  if (contact.overload != count.overload) return "overload";
  if (c.active != count.active) return "active";
  if (c.whole != count.whole) return "whole";
  if (c.fraction != count.fraction) return "fraction";
  return nullptr;
}

/// Recomputes the sums over blocks after count, position and columns of a patch were restored. Blocks in
/// contact are taken as saved, the others as straight.
template <class T>
void find_block_sums(Patch& p) noexcept {
  const Representatives<T>& r = representatives<T>(p);
  p.sum[0] = p.sum[1] = 0;
  for (std::uint32_t b = 0; b < r.block_count; ++b) {
    if (b >= r.active_blocks()) enter_block<T>(p, b);
    if (b < r.active_blocks()) r.blocks[b].zero = 0;
    if (b < r.full_blocks()) book_block<T>(p, b, +1);
  }
}

}  // namespace

template <class T>
double find_stored_energy(const Patch& p) noexcept {
  return joules_per_square<T>(p) * all_squares<T>(p);
}

template <class T>
void read_bristles(const Patch& p, std::size_t count, Span<double> zx, Span<double> zy,
                   Span<double> delta) noexcept {
  const Representatives<T>& r = representatives<T>(p);
  const double metres = p.material().metres_per_length;
  const auto residual = static_cast<double>(static_cast<T>(p.material().residual));
  const std::uint32_t contact = r.in_contact();
  const T* const columns[2] = {r.zx, r.zy};
  const Span<double> wanted[2] = {zx, zy};
  for (std::size_t i = 0; i < count; ++i) {
    const Block& block = r.blocks[i / block_size];
    const bool in = i < contact;
    for (int axis = 0; axis < 2; ++axis) {
      if (wanted[axis].empty()) continue;
      const T* z = columns[axis];
      const double stored = z == nullptr || block.zero ? 0.0 : static_cast<double>(z[i]);
      wanted[axis][i] = in ? (stored + moved_since(p, block, axis)) * metres : 0.0;
    }
    if (!delta.empty())
      delta[i] = (static_cast<double>((in && !block.zero ? r.delta : r.first)[i]) - residual) * metres;
  }
}

template <class T>
std::uint64_t hash_patch(const Patch& p) noexcept {
  const Representatives<T>& r = representatives<T>(p);
  Hasher hasher;
  hasher.add(p.material().hash);
  hasher.add(r.full_weight);
  hasher.add(r.active);
  hasher.add(p.overload);
  if (r.renews()) {
    const RenewalState& slide = *r.shared;
    FieldHash hash{hasher, p};
    renewal_fields(slide, r, hash);
    if (r.ages() && slide.run > 0.0) slide_age_fields(slide, hash);
    if (slide.run > 0.0) course_fields(slide, hash);
  }
  const std::uint32_t contact = r.in_contact();
  for (std::uint32_t i = 0; i < r.bristles; ++i) {
    const Block& block = r.blocks[i / block_size];
    if (i % block_size == 0 && i < contact)
      for (int axis = 0; axis < 2; ++axis)
        hasher.add(static_cast<std::uint64_t>(difference(p.position[axis], block.position[axis])));
    if (i % block_size == 0 && i < contact && r.ages()) hasher.add(time_of(p) - r.since[i / block_size]);
    const Reading<T> reading{r, i >= contact || block.zero};
    Representatives<T>::columns(r, [&](const auto* column, const ColumnRule& rule) {
      if (rule.hashed && rule.count > 0) reading.add(hasher, column, rule, i);
    });
  }
  return hasher.value();
}

template <class T>
std::uint64_t signature(const Patch& p) noexcept {
  const Representatives<T>& r = representatives<T>(p);
  Hasher hasher;
  hasher.add(p.material().hash);
  hasher.add(r.full_weight);
  hasher.add(r.options.max_normal_load);
  hasher.add(std::uint64_t{r.bristles} << 32 | r.first_seed);
  hasher.add(static_cast<std::uint64_t>(r.variant) << 8 | static_cast<std::uint64_t>(p.outputs) << 4);
  return hasher.value();
}

template <class T>
void save(const Patch& p, ByteWriter& write) noexcept {
  const Representatives<T>& r = representatives<T>(p);
  count_fields(r, write);
  if (r.renews()) all_renewal_fields(*r.shared, r, write);
  constexpr Block away{};
  for (std::uint32_t b = 0; b < r.block_count; ++b) {
    const bool active = b < r.active_blocks();
    block_fields(write, active ? r.blocks[b] : away);
    if (r.ages()) write(active ? r.since[b] : 0.0);
  }
  Representatives<T>::columns(r, [&](const auto* column, const ColumnRule& rule) {
    using Entry = std::remove_cv_t<std::remove_pointer_t<decltype(column)>>;
    if (rule.count == 0 || !is_saved(rule.filler)) return;
    if (rule.filler == Filler::random_state) {
      write.column(column, r.bristles);
      return;
    }
    for (std::uint32_t b = 0; b < r.block_count; ++b) {
      const Part part = part_of(r, b);
      write.column(column + part.first, part.bent);
      if (rule.filler == Filler::zero || rule.filler == Filler::age)
        write.zeros<Entry>(part.size - part.bent);
      else
        write.column(r.first + part.first + part.bent, part.size - part.bent);
    }
  });
}

template <class T>
const char* find_fault(const Patch& p, const Patch& contact, ByteReader read) noexcept {
  const Representatives<T>& r = representatives<T>(p);
  RepresentativeCount count;
  count_fields(count, read);
  if (const char* fault = find_count_fault(r, contact, count)) return fault;
  if (r.renews()) {
    RenewalState renewal;
    FieldCheck check{read};
    all_renewal_fields(renewal, r, check);
    if (check.fault != nullptr) return check.fault;
    const double growth = r.ages() ? largest_ageing_factor(p.material().material) : 1.0;
    if (!within(renewal.run, 0.0, r.shared->forget * growth)) return "run";
    if (!within(renewal.young_run, 0.0, renewal.run)) return "run of young bristles";
    // Bristles that age are never counted as young (note_young()).
    if (r.ages() && renewal.young_from != RenewalState::none_young)
      return "number of the first young bristle";
  }

  // Allows twice the longest length under an exponential law: a bristle at the end of a long slide may
  // combine two samples, the lengths before and after that snap.
  const bool memoryless = p.material().material.snap_length.law() == SnapLaw::exponential;
  // Allows a deflection to exceed the snap length slightly, by rounding.
  const double longest = longest_bend(r) * (r.redraws() && memoryless ? 2.0 : 1.0) * (1.0 + 1e-3);
  const double farthest = r.renews() ? 3.0 * longest : longest;
  const double shortest = (p.material().residual + p.material().shortest) * (1.0 - 1e-3);
  const std::uint32_t touching = count.whole + (count.fraction > 0.0 ? 1u : 0u);
  const std::uint32_t seed = contact.record->options.seed;
  const bool same_seed = seed == r.options.seed;
  const SavedOffsets offsets = saved_offsets(r);
  const Material& m = p.material().material;
  const double residual = p.material().residual;
  const double now = time_of(contact);
  ByteReader blocks = read;
  ByteReader columns = read;
  columns.skip(r.block_count * block_size_of(r));
  for (std::uint32_t b = 0; b * block_size < touching; ++b) {
    Block block{};
    block_fields(blocks, block);
    double since = 0.0;
    if (r.ages()) blocks(since);
    if (!within(since, 0.0, 1e18)) return "a block's time";
    double moved[2];
    for (int axis = 0; axis < 2; ++axis)
      moved[axis] = to_lengths(difference(contact.position[axis], block.position[axis]));
    if (const char* fault = find_block_fault(block, moved, longest, farthest)) return fault;

    const std::uint32_t end = std::min((b + 1) * block_size, touching);
    for (std::uint32_t i = b * block_size; i < end; ++i) {
      const auto number_at = [&](std::size_t column) {
        ByteReader entry = columns;
        entry.skip(column + i * sizeof(T));
        T number;
        entry(number);
        return static_cast<double>(number);
      };
      double length = 0.0;
      if (offsets.length != SavedOffsets::none)
        length = number_at(offsets.length);
      else
        length = static_cast<double>(same_seed ? r.first[i] : first_length<T>(p.material(), seed, i));
      if (!within(length, shortest, longest)) return "a snap length";
      double grown = 1.0;
      if (offsets.age != SavedOffsets::none) {
        // Allows a negative age: a bristle renewed in mid-step stores one, which offsets the time before its
        // renewal.
        const double age = number_at(offsets.age);
        if (!within(age, -oldest_bristle, oldest_bristle)) return "an age";
        const double stuck_for = std::max(age + std::max(now - since, 0.0) / m.ageing_time, 0.0);
        grown = m.ageing_factor(stuck_for * m.ageing_time);
      }
      double squared = 0.0;
      for (int axis = 0; axis < p.axes; ++axis) {
        const double stored = number_at(offsets.deflection[axis]);
        if (!within(stored, -farthest, farthest)) return "a deflection";
        squared += (stored + moved[axis]) * (stored + moved[axis]);
      }
      const double limit = (residual + (length - residual) * grown) * (1.0 + 1e-3);
      if (!within(squared, 0.0, limit * limit)) return "a deflection";
    }
  }
  return nullptr;
}

template <class T>
void restore(Patch& p, std::uint32_t seed, ByteReader read) noexcept {
  Representatives<T>& r = representatives<T>(p);
  if (seed != r.options.seed) {
    change_seed(r, seed);
    fill_columns(r);  // the rows behind the last bristle, which no state holds, follow from the seed too
  }
  count_fields(r, read);
  if (r.renews()) all_renewal_fields(*r.shared, r, read);
  for (std::uint32_t b = 0; b < r.block_count; ++b) {
    block_fields(read, r.blocks[b]);
    if (r.ages()) read(r.since[b]);
  }
  Representatives<T>::columns(r, [&](auto* column, const ColumnRule& rule) {
    using Entry = std::remove_pointer_t<decltype(column)>;
    if (rule.count == 0 || !is_saved(rule.filler)) return;
    read.column(column, r.bristles);
    // Gives bristles out of contact the filler value of each column, whatever the bytes say.
    if constexpr (std::is_same_v<Entry, T>)
      for (std::uint32_t i = r.in_contact(); i < r.bristles; ++i)
        column[i] = rule.filler == Filler::first_length ? r.first[i] : T(0);
  });
  find_block_sums<T>(p);
  for (std::uint32_t b = 0; b < r.block_count; ++b) r.blocks[b].reach = 0.0f;
  forget_upper_bounds<T>(p);
  note_count<T>(p);
}

BRISTLE_INSTANTIATE(find_stored_energy, read_bristles, hash_patch, signature, save, find_fault, restore)

}  // namespace bristle::detail
