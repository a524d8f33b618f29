#include "core/patches/saved_state.hpp"

#include <cmath>
#include <cstring>
#include <string>

#include "bristle/error.hpp"
#include "core/common/little_endian.hpp"
#include "core/patches/contact_model.hpp"
#include "core/patches/fields.hpp"

namespace bristle::detail {
namespace {

constexpr char saved_magic[8] = {'b', 'r', 'i', 's', 't', 'l', 'e', 0};
constexpr std::uint32_t saved_version = 6;
constexpr std::size_t checksum_at = 32;

/// Lists the fields of a saved patch's head in order, so that writing and reading use the same list.
template <class Io, class Head>
void head_fields(Io& io, Head& head) noexcept {
  io(head.slot);
  io(head.generation);
  io(head.signature);
  io(head.bytes);
  io(head.key);
  io(head.seed);
}
/// Lists the numbers that every patch saves, whatever its contact model. `remainder`: PatchRecord::remainder.
template <class Contact, class Remainder, class Visit>
void contact_fields(Contact& c, Remainder& remainder, Visit&& visit) noexcept {
  visit(c.normal_load, FieldRule{"normal_load", 0.0, highest_load});
  visit(c.zeta);
  visit(c.overload);
  for (auto& position : c.position) visit(position);
  visit(c.pending_dissipated, FieldRule{"pending_dissipated", 0.0, 1e302});
  visit(c.pending_loss, FieldRule{"pending_loss", -1e302, 1e302});
  visit(c.pending_snaps, FieldRule{"pending_snaps", 0.0, 1e18});
  for (auto& part : remainder) visit(part, FieldRule{"remainder", -0.5, 0.5});
}
/// Lists the times that an ageing patch saves: its own time, which exceeds the longest time by at most a
/// step, and the times and the displacement that bound how long a bristle can have been stuck
/// (PatchRecord::Hold). The displacement is at most 2^62 units.
template <class Time, class Hold, class Visit>
void time_fields(Time& time, Hold& hold, Visit&& visit) noexcept {
  visit(time, FieldRule{"time", 0.0, 4.0 * longest_time * clock_units_per_second});
  visit(hold.oldest, FieldRule{"time", 0.0});
  visit(hold.since, FieldRule{"time", 0.0});
  for (auto& way : hold.way) visit(way, FieldRule{"time", -0x1p62, 0x1p62});
}
/// Writes a saved patch except its head, which has its length and signature.
void write_state(const Patch& p, ByteWriter& write) noexcept {
  const PatchRecord& r = *p.record;
  contact_fields(p, r.remainder, write);
  const Int128 time = r.clock == nullptr ? 0 : *r.clock - r.epoch;
  if (p.ages) time_fields(time, r.hold, write);
  p.model->save(p, write);
}

std::uint64_t checksum(Span<const std::byte> state) noexcept {
  Hasher hasher;
  add_bytes(hasher, {state.data(), checksum_at});
  add_bytes(hasher, {state.data() + saved_batch_size, state.size() - saved_batch_size});
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
  if (head.bytes < state.size())
    throw Error("restore_state: " + std::to_string(state.size() - head.bytes) +
                " bytes stand behind the saved state: give exactly those that save_state wrote");
  if (head.bytes < saved_batch_size || checksum({state.data(), static_cast<std::size_t>(head.bytes)}) != sum)
    throw Error("restore_state: the saved state is damaged (its checksum does not agree)");
  return head;
}

std::uint64_t hash_of(const Patch& p) noexcept {
  const std::uint64_t hash = p.model->hash(p);
  const double(&remainder)[2] = p.record->remainder;
  const bool creeps = remainder[0] != 0.0 || remainder[1] != 0.0;
  if (!creeps && !p.laid) return hash;
  Hasher hasher;
  hasher.add(hash);
  if (creeps)
    for (const double x : remainder) hasher.add(x);
  if (p.laid) p.record->lay.add_to(hasher);
  return hasher.value();
}

std::uint64_t signature_of(const Patch& p) noexcept {
  Hasher hasher;
  hasher.add(p.model->signature(p));
  add_bytes(hasher, {reinterpret_cast<const std::byte*>(p.model->name), std::strlen(p.model->name)});
  if (p.laid) p.record->lay.add_to(hasher);
  return hasher.value();
}

std::size_t saved_size_of(const Patch& p) noexcept {
  ByteWriter count(nullptr);
  write_state(p, count);
  return saved_patch_size + count.bytes();
}

void save_patch(const Patch& p, std::uint32_t slot, std::byte* to) noexcept {
  ByteWriter write(to);
  const PatchOptions& options = p.record->options;
  const SavedPatch head{slot, p.generation, signature_of(p), saved_size_of(p), options.key, options.seed};
  head_fields(write, head);
  write_state(p, write);
}

SavedPatch read_saved_patch(const std::byte* from) noexcept {
  SavedPatch head;
  ByteReader read(from);
  head_fields(read, head);
  return head;
}

const char* find_fault_of(const Patch& p, const std::byte* from) noexcept {
  PatchRecord record;
  record.options.seed = read_saved_patch(from).seed;
  Patch contact;
  contact.record = &record;
  ByteReader read(from + saved_patch_size);
  FieldCheck check{read};
  contact_fields(contact, record.remainder, check);
  Int128 time = 0;
  const PatchRecord::Hold& hold = record.hold;
  if (p.ages) time_fields(time, record.hold, check);
  if (check.fault != nullptr) return check.fault;
  // Takes a relative tolerance, so that without load exactly 0 bristles are allowed; an absolute one would
  // allow a negative number.
  const double zeta = p.material().material.bristles_in_contact(contact.normal_load);
  if (!(std::abs(contact.zeta - zeta) <= 1e-9 * zeta)) return "zeta";
  record.clock = &time;
  if (hold.since < hold.oldest || hold.since > latest_time_of(contact)) return "time";
  return p.model->find_fault(p, contact, read);
}

const char* find_present_fault(const Patch& p, std::byte* room) noexcept {
  save_patch(p, 0, room);
  return find_fault_of(p, room);
}

void restore_patch(Patch& p, const std::byte* from) noexcept {
  const SavedPatch head = read_saved_patch(from);
  p.record->options.key = head.key;
  ByteReader read(from + saved_patch_size);
  PatchRecord& r = *p.record;
  contact_fields(p, r.remainder, read);
  Int128 time = 0;
  r.hold = PatchRecord::Hold{};
  if (p.ages) time_fields(time, r.hold, read);
  if (p.ages && r.clock != nullptr) r.epoch = *r.clock - time;
  p.model->restore(p, head.seed, read);
}

}  // namespace bristle::detail
