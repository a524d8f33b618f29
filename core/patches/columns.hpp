// Columns of a record, declared once. A record's `columns(record, visit)` calls `visit(pointer, rule)` for
// each; allocation, reset, copy, take-over, save, restore and hash are loops over that list.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "core/common/assert.hpp"
#include "core/patches/record_memory.hpp"

namespace bristle::detail {

/// Kind of a column's entries: their value for a bristle out of contact, and the effect of reset, save and a
/// change of material on them.
enum class Filler : unsigned char {
  zero,          ///< 0. State: saved; a length in the units of the material
  age,           ///< 0. State: saved; a time in the units of the material's ageing
  first_length,  ///< the bristle's first snap length. State: saved; kept by a material of the same law
  draw_state,    ///< goes on even out of contact. State: saved; filled from the seed
  from_seed,     ///< first snap lengths: a function of seed and material, never changed by a step
  block,         ///< bookkeeping of blocks, handled by functions of its own
  cache          ///< nothing that the state depends on
};
constexpr bool is_saved(Filler filler) noexcept { return filler <= Filler::draw_state; }

struct ColumnRule {
  const char* name;
  std::uint32_t count;  ///< number of entries; 0 = this variant has no such column
  Filler filler;
  bool hashed;
};

template <class Record>
std::size_t column_bytes(Record& record) noexcept {
  std::size_t bytes = 0;
  Record::columns(record, [&bytes](auto*& column, const ColumnRule& rule) {
    bytes += aligned(rule.count * sizeof *column);
  });
  return bytes;
}

/// Lays the columns out in memory of column_bytes(record). Does not fill them; columns without entries are
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
