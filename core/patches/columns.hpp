// Declares the columns of a record once. A record's `columns(record, visit)` calls `visit(pointer, rule)` for
// each column; allocation, reset, copy, change of material, save, restore and hash are loops over that list.
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "core/common/assert.hpp"
#include "core/patches/record_memory.hpp"

namespace bristle::detail {

/// Kind of a column of a patch's record: the value for a bristle out of contact, and the effect of reset,
/// save and a change of material.
enum class Filler : unsigned char {
  zero,          ///< 0 for a bristle out of contact. State, saved; a length in the units of the material
  age,           ///< 0 for a bristle out of contact. State, saved; a time in units of the material's ageing
                 ///< time
  first_length,  ///< first snap length for a bristle out of contact. State, saved; kept under a new material
                 ///< of the same law
  draw_state,    ///< value that stays when the bristle is out of contact. State, saved; its first value is
                 ///< computed from the seed
  from_seed,     ///< values computed from seed and material (first snap lengths), which no step changes; not
                 ///< saved
  block,         ///< bookkeeping of blocks, which other functions reset and save
  cache          ///< values on which the state does not depend
};
constexpr bool is_saved(Filler filler) noexcept { return filler <= Filler::draw_state; }

struct ColumnRule {
  const char* name;
  std::uint32_t count;  ///< number of entries; 0 = this record has no such column
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

/// Whether a saved number is in its range; NaN never is.
inline bool within(double value, double low, double high) noexcept { return value >= low && value <= high; }

template <class Record>
std::size_t column_bytes(Record& record) noexcept {
  std::size_t bytes = 0;
  Record::columns(record, [&bytes](auto*& column, const ColumnRule& rule) {
    bytes += aligned(rule.count * sizeof *column);
  });
  return bytes;
}

/// Places the columns in memory of column_bytes(record). Does not fill them; columns without entries are
/// null.
template <class Record>
void place_columns(Record& record, std::byte* memory) noexcept {
  BRISTLE_ASSERT(reinterpret_cast<std::uintptr_t>(memory) % column_alignment == 0);
  Record::columns(record, [&memory](auto*& column, const ColumnRule& rule) {
    column = rule.count > 0 ? reinterpret_cast<std::remove_reference_t<decltype(column)>>(memory) : nullptr;
    memory += aligned(rule.count * sizeof *column);
  });
}

}  // namespace bristle::detail
