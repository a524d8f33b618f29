// Memory of a contact model's record and of its columns (arrays): one allocation, made and freed by the
// thread that adds patches.
#pragma once

#include <cstddef>
#include <memory>
#include <new>

#include "core/patches/patch.hpp"

namespace bristle::detail {

constexpr std::size_t column_alignment = 64;
constexpr std::size_t aligned(std::size_t bytes) noexcept {
  return (bytes + column_alignment - 1) / column_alignment * column_alignment;
}

/// Owner of what a record shares with others (its material). It stands in memory in front of the record, so
/// that the record itself is plain data that can be copied as bytes.
struct alignas(column_alignment) RecordHead {
  std::shared_ptr<const CompiledMaterial> material;
  std::shared_ptr<void> lease = nullptr;  ///< right to the lane of a contact in lanes (lanes/lane_block.hpp)
};
inline RecordHead& head_of(PatchRecord& record) noexcept {
  return *(reinterpret_cast<RecordHead*>(&record) - 1);
}

/// Returns the address just behind a record, where the memory of its columns begins.
template <class Record>
std::byte* column_memory(Record* record) noexcept {
  return reinterpret_cast<std::byte*>(record) + aligned(sizeof(Record));
}

/// Frees a contact model's record with its columns; does nothing for null.
inline void release(PatchRecord* record) noexcept {
  if (record == nullptr) return;
  RecordHead* head = &head_of(*record);
  head->~RecordHead();
  ::operator delete (head, std::align_val_t{column_alignment});
}

}  // namespace bristle::detail
