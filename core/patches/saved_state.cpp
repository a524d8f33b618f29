#include "core/patches/saved_state.hpp"

#include <cmath>
#include <cstring>

#include "core/common/little_endian.hpp"
#include "core/common/saved_head.hpp"
#include "core/patches/contact_model.hpp"
#include "core/patches/fields.hpp"

namespace bristle::detail {
namespace {

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
/// (PatchRecord::Stuck). The displacement is at most 2^62 units.
template <class Time, class Stuck, class Visit>
void time_fields(Time& time, Stuck& stuck, Visit&& visit) noexcept {
  visit(time, FieldRule{"time", 0.0, 4.0 * longest_time * clock_units_per_second});
  visit(stuck.oldest, FieldRule{"time", 0.0});
  visit(stuck.since, FieldRule{"time", 0.0});
  for (auto& moved : stuck.moved) visit(moved, FieldRule{"time", -0x1p62, 0x1p62});
}
/// Writes a saved patch except its head, which has its length and signature.
void write_state(const Patch& p, ByteWriter& write) noexcept {
  const PatchRecord& r = *p.record;
  contact_fields(p, r.remainder, write);
  const Int128 time = r.clock == nullptr ? 0 : *r.clock - r.epoch;
  if (p.ages) time_fields(time, r.stuck, write);
  p.model->save(p, write);
}

}  // namespace

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
  const PatchRecord::Stuck& stuck = record.stuck;
  if (p.ages) time_fields(time, record.stuck, check);
  if (check.fault != nullptr) return check.fault;
  // Takes a relative tolerance, so that without load exactly 0 bristles are allowed; an absolute one would
  // allow a negative number.
  const double zeta = p.material().material.bristles_in_contact(contact.normal_load);
  if (!(std::abs(contact.zeta - zeta) <= 1e-9 * zeta)) return "zeta";
  record.clock = &time;
  if (stuck.since < stuck.oldest || stuck.since > latest_time_of(contact)) return "time";
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
  r.stuck = PatchRecord::Stuck{};
  if (p.ages) time_fields(time, r.stuck, read);
  if (p.ages && r.clock != nullptr) r.epoch = *r.clock - time;
  p.model->restore(p, head.seed, read);
}

}  // namespace bristle::detail
