// Steps a block of sixteen infinite brushes, vector by vector (lane_brush.hpp); a trial steps a copy.
#pragma once

#include <cstddef>
#include <cstring>

#include "lane_brush.hpp"

namespace bristle::detail {
namespace {

template <class E, class T>
bool is_zero(const LaneColumn<T>& column) {
  using V = typename E::V;
  for (std::uint32_t i = 0; i < lane_count; i += E::size)
    if (any_lane(E::get(column.lane + i) > V(T(0)))) return false;
  return true;
}

/// Steps those contacts of a block that the step names, from motions to forces and state.
template <class T, int axes, bool books>
void step_brushes(const BrushLaw<T>& law, const BrushColumns<T>& columns, const LaneInput& in,
                  const LaneOutput& out) {
  using E = Engine<T>;
  const BrushMotion<T, axes> motion(law, columns, in);
  BrushSums<T, axes> sums;
  if (in.named != (1u << lane_count) - 1) sums = {};
  std::uint32_t used = *columns.used;
  for (std::uint32_t first = 0; first < lane_count; first += E::size) {
    if ((in.named >> first & ((1u << E::size) - 1)) == 0) continue;
    const std::uint32_t its = BrushStepper<E, T, axes, books>(law, columns, in, motion, first).run(sums);
    used = its > used ? its : used;
  }
  while (used > 0 && is_zero<E>(columns.fresh[used - 1])) --used;
  *columns.used = used;
  finish_brushes<T, axes, books>(law, columns, in, out, motion, sums);
}

/// Copies columns to memory that lasts for one trial, which then steps the copy.
template <class T>
class BrushTrial {
 public:
  /// Returns the size of the memory that the copy needs, on a boundary of 64 bytes.
  static std::size_t bytes(const BrushLaw<T>& law) {
    const std::size_t n = law.cohorts;
    return (7 * n + 16) * sizeof(LaneColumn<T>) + n * sizeof(LaneColumn<double>);
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

/// Steps a copy of the columns, so that a trial leaves the state as it is.
template <class T, int axes, bool books>
[[gnu::noinline]] void try_brushes(const BrushLaw<T>& law, const BrushColumns<T>& columns,
                                   const LaneInput& in, const LaneOutput& out) {
  auto* const memory = static_cast<std::byte*>(__builtin_alloca_with_align(BrushTrial<T>::bytes(law), 512));
  BrushTrial<T> trial(law, columns, memory);
  step_brushes<T, axes, books>(law, trial.columns, in, out);
}
template <class T, int axes, bool books>
void brush_lanes(const BrushLaw<T>& law, const BrushColumns<T>& columns, const LaneInput& in,
                 const LaneOutput& out) {
  (in.stores ? step_brushes<T, axes, books> : try_brushes<T, axes, books>)(law, columns, in, out);
}

}  // namespace
}  // namespace bristle::detail
