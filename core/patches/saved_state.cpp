#include "core/patches/saved_state.hpp"

#include <cmath>
#include <cstring>
#include <string>

#include "bristle/error.hpp"
#include "core/common/little_endian.hpp"
#include "core/patches/contact_model.hpp"

namespace bristle::detail {
namespace {

constexpr char saved_magic[8] = {'b', 'r', 'i', 's', 't', 'l', 'e', 0};
constexpr std::uint32_t saved_version = 5;
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
template <class Io, class Contact>
void contact_fields(Io& io, Contact& c) noexcept {
  io(c.normal_load);
  io(c.zeta);
  io(c.overload);
  io(c.position[0]);
  io(c.position[1]);
  io(c.pending_dissipated);
  io(c.pending_loss);
  io(c.pending_snaps);
}

/// Lists the rounding remainders of short displacements, for reading and for writing.
template <class Io, class Remainder>
void remainder_fields(Io& io, Remainder& remainder) noexcept {
  io(remainder[0]);
  io(remainder[1]);
}

/// Times saved for an ageing patch: its own time, and the longest time for which a bristle can have held.
struct SavedTime {
  Int128 time = 0;
  PatchRecord::Hold hold;
};
void save_time(const Patch& p, ByteWriter& write) noexcept {
  if (!p.ages) return;
  const PatchRecord& r = *p.record;
  const Int128 time = r.clock == nullptr ? 0 : *r.clock - r.epoch;
  write(time);
  write(r.hold.oldest);
  write(r.hold.since);
  for (const std::int64_t x : r.hold.way) write(x);
}
SavedTime read_time(const Patch& p, ByteReader& read) noexcept {
  SavedTime saved;
  if (!p.ages) return saved;
  read(saved.time);
  read(saved.hold.oldest);
  read(saved.hold.since);
  for (std::int64_t& x : saved.hold.way) read(x);
  return saved;
}
/// Writes what follows the head of a saved patch.
void write_state(const Patch& p, ByteWriter& write) noexcept {
  contact_fields(write, p);
  remainder_fields(write, p.record->remainder);
  save_time(p, write);
  p.model->save(p, write);
}

constexpr std::int64_t farthest_way = std::int64_t{1} << 62;

/// Whether the saved times of a patch agree with each other. A step's end is the rounded sum of its start and
/// its length, while the clock counts the length in whole units, cut off: the two differ by at most a unit
/// and three roundings. The clock exceeds the longest time by at most a step, and no path from where the
/// patch began to hold is longer than farthest_way units.
bool is_good_time(const SavedTime& t) noexcept {
  if (t.time > static_cast<Int128>(4.0 * longest_time * clock_units_per_second)) return false;
  for (const std::int64_t way : t.hold.way)
    if (way > farthest_way || way < -farthest_way) return false;
  const double now = static_cast<double>(t.time) / clock_units_per_second;
  return t.time >= 0 && t.hold.oldest >= 0.0 && t.hold.since >= t.hold.oldest &&
         t.hold.since <= now * (1.0 + 0x1p-50) + 1.0 / clock_units_per_second;
}

std::uint64_t checksum(Span<const std::byte> state) noexcept {
  Hasher hasher;
  add_bytes(hasher, {state.data(), checksum_at});
  add_bytes(hasher, {state.data() + saved_batch_size, state.size() - saved_batch_size});
  return hasher.value();
}

bool is_good_remainder(const double (&remainder)[2]) noexcept {
  return std::abs(remainder[0]) <= 0.5 && std::abs(remainder[1]) <= 0.5;
}

const char* find_contact_fault(const Patch& p, const Patch& c) noexcept {
  constexpr double most = 1e302;
  if (!(c.normal_load >= 0.0 && c.normal_load <= highest_load)) return "normal_load";
  const double zeta = p.material().material.bristles_in_contact(c.normal_load);
  if (!(std::abs(c.zeta - zeta) <= 1e-9 * zeta + 1e-300)) return "zeta";
  if (!(c.pending_dissipated >= 0.0 && c.pending_dissipated <= most)) return "pending_dissipated";
  if (!(std::abs(c.pending_loss) <= most)) return "pending_loss";
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
  Patch contact;
  ByteReader read(from + saved_patch_size);
  contact_fields(read, contact);
  if (const char* fault = find_contact_fault(p, contact)) return fault;
  double remainder[2];
  remainder_fields(read, remainder);
  if (!is_good_remainder(remainder)) return "remainder";
  if (!is_good_time(read_time(p, read))) return "time";
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
  contact_fields(read, p);
  remainder_fields(read, p.record->remainder);
  const SavedTime saved = read_time(p, read);
  if (p.ages && p.record->clock != nullptr) p.record->epoch = *p.record->clock - saved.time;
  p.record->hold = saved.hold;
  p.model->restore(p, head.seed, read);
}

}  // namespace bristle::detail
