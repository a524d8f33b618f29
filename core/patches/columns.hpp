// The columns (arrays) of a contact model's record, listed once: `Record::columns(record, visit)`
// calls `visit(pointer, rule)` for each. Allocation and copy loop over this list, for representatives also
// reset, save, restore and hash, so that a new column needs one line and none of them can forget it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>

#include "core/common/assert.hpp"
#include "core/patches/fields.hpp"
#include "core/patches/record_memory.hpp"

namespace bristle::detail {

/// Kind of a column of representatives: its value for a bristle out of contact, and what reset, save and
/// a change of material do to it. Other contact models fill and save their columns themselves.
enum class Filler : unsigned char {
  zero,  ///< state, saved: deflections, 0 for a bristle out of contact; a new material rescales them
  /// Ages, a saved state: in units of the ageing time, 0 for a bristle out of contact; converted to the
  /// ageing time of a new material.
  age,
  /// Snap lengths, a saved state: a bristle out of contact has its first one; kept under a new material of
  /// the same law.
  first_length,
  /// States of the bristles' random numbers, saved, kept while a bristle is out of contact; a reset computes
  /// them from the seed.
  random_state,
  /// Values that follow from seed and material, such as first snap lengths. No step changes them, so they are
  /// not saved.
  from_seed,
  block,  ///< numbers of whole blocks of bristles, which other functions reset and save
  cache   ///< values that these loops neither save nor hash: caches, or state saved elsewhere
};
constexpr bool is_saved(Filler filler) noexcept { return filler <= Filler::random_state; }

struct ColumnRule {
  const char* name;
  std::uint32_t count;  ///< number of entries of the column; 0 = this record has no such column
  Filler filler;
  bool hashed;
};

/// Lists the saved fields of a block of bristles, for writing and for reading.
template <class Io, class AnyBlock>
void block_fields(Io& io, AnyBlock& block) noexcept {
  for (int axis = 0; axis < 2; ++axis) io(block.position[axis]);
  for (int axis = 0; axis < 2; ++axis) io(block.stored[axis]);
}
constexpr std::size_t saved_block_size = 4 * 8;

template <class Record>
std::size_t column_bytes(const Record& record) noexcept {
  std::size_t bytes = 0;
  Record::columns(record, [&bytes](const auto* column, const ColumnRule& rule) {
    bytes += aligned(rule.count * sizeof *column);
  });
  return bytes;
}

/// Sets the pointers of a record's columns into memory of column_bytes(record) bytes, which it does not fill.
/// A column without entries gets a null pointer.
template <class Record>
void set_columns(Record& record, std::byte* memory) noexcept {
  BRISTLE_ASSERT(reinterpret_cast<std::uintptr_t>(memory) % column_alignment == 0);
  Record::columns(record, [&memory](auto*& column, const ColumnRule& rule) {
    column = rule.count > 0 ? reinterpret_cast<std::remove_reference_t<decltype(column)>>(memory) : nullptr;
    memory += aligned(rule.count * sizeof *column);
  });
}

/// Allocates a record like `made` and, behind it, its columns, filled with zeros. Throws std::bad_alloc.
template <class Record>
Record* make_record(std::shared_ptr<const CompiledMaterial> material, const Record& made) {
  static_assert(std::is_trivially_copyable_v<Record> && alignof(Record) <= column_alignment);
  const std::size_t columns = column_bytes(made);
  const std::size_t bytes = aligned(sizeof(Record)) + columns;
  void* memory = ::operator new (sizeof(RecordHead) + bytes, std::align_val_t{column_alignment});
  auto* head = new (memory) RecordHead{std::move(material)};
  auto* record = new (head + 1) Record(made);
  record->bytes = bytes;
  std::memset(column_memory(record), 0, columns);
  set_columns(*record, column_memory(record));
  return record;
}

/// Copies a patch to `to`, and its record to memory of at least PatchRecord::bytes.
template <class Record>
void copy_record(const Patch& from, Patch& to, std::byte* memory) noexcept {
  std::memcpy(memory, static_cast<const Record*>(from.record), from.record->bytes);
  auto& copy = *reinterpret_cast<Record*>(memory);
  set_columns(copy, column_memory(&copy));
  to = from;
  to.record = &copy;
}

}  // namespace bristle::detail
