// A copy of the cohorts of infinite brushes, which a trial step changes in their stead.
#pragma once

#include <cstddef>
#include <cstring>

#include "core/lane_table.hpp"

namespace bristle::detail {
namespace {

/// Copies columns to memory that lasts for one trial, which then steps the copy.
template <class T>
class BrushTrial {
 public:
  /// Number of columns of T and of double of a block.
  static std::size_t bytes(const BrushLaw<T>& law) {
    const std::size_t n = law.cohorts;
    return 64 + (7 * n + 16) * sizeof(LaneColumn<T>) + n * sizeof(LaneColumn<double>);
  }
  BrushTrial(const BrushLaw<T>& law, const BrushColumns<T>& from, std::byte* memory)
      : columns(from), at_(memory) {
    const std::uint32_t n = law.cohorts;
    columns.used = &used_;
    used_ = *from.used;
    LaneColumn<T>** const of_cohorts[] = {&columns.x,    &columns.y,   &columns.reach, &columns.fresh,
                                          &columns.left, &columns.low, &columns.high};
    for (LaneColumn<T>** const c : of_cohorts) copy(*c, n);
    copy(columns.birth, n);
    for (int k = 0; k < 2; ++k) {
      for (int axis = 0; axis < 2; ++axis) {
        copy(columns.begin[k][axis], 1);
        copy(columns.residue[k][axis], 1);
      }
      copy(columns.moment[k], 1);
    }
    LaneColumn<T>** const of_contact[] = {&columns.owed,   &columns.owed_path, &columns.slack,
                                          &columns.spread, &columns.pair,      &columns.ranked};
    for (LaneColumn<T>** const c : of_contact) copy(*c, 1);
  }
  BrushColumns<T> columns;

 private:
  template <class C>
  void copy(C*& c, std::uint32_t count) {
    if (c == nullptr) return;
    std::memcpy(at_, static_cast<const void*>(c), count * sizeof(C));
    c = reinterpret_cast<C*>(at_);
    at_ += count * sizeof(C);
  }
  std::byte* at_;
  std::uint32_t used_;
};

}  // namespace
}  // namespace bristle::detail
