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
    columns.used = &used_;
    used_ = *from.used;
    const auto copy = [this]<class C>(C*& column, std::uint32_t count) {
      std::memcpy(at_, static_cast<const void*>(column), count * sizeof(C));
      column = reinterpret_cast<C*>(at_);
      at_ += count * sizeof(C);
    };
    columns.list(law.cohorts, from.y != nullptr, from.birth != nullptr, copy);
  }
  BrushColumns<T> columns;

 private:
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
