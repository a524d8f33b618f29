// The number type of a loop over many equal items: vectors of an instruction set, or plain numbers in the
// scalar reference. One source serves both: Engine<T>::V is either.
#pragma once

#if defined(BRISTLE_KERNEL_ISA)
#include "lanes.hpp"
#else
#include "scalar_lanes.hpp"
#endif

namespace bristle::detail {
namespace {

#if defined(BRISTLE_KERNEL_ISA)
template <class T>
struct Engine {
  using V = Lanes<T>;
  static constexpr std::uint32_t size = V::size;
  static V get(const T* from) { return load<T>(from); }
  static void put(T* to, V x) { x.store_aligned(to); }
  struct Sum {
    Row<T> row;
    void add(std::uint32_t part, V x) { row.part[part] = row.part[part] + x; }
    double total() const { return tree_sum<T>(row); }
  };
};
#else
template <class T>
struct Engine {
  using V = T;
  static constexpr std::uint32_t size = 1;
  static V get(const T* from) { return *from; }
  static void put(T* to, V x) { *to = x; }
  struct Sum {
    T lane[lane_count] = {};
    void add(std::uint32_t part, V x) { lane[part] += x; }
    double total() const {
      T copy[lane_count];
      std::memcpy(copy, lane, sizeof copy);
      return static_cast<double>(tree_sum<T>(copy));
    }
  };
};
#endif

}  // namespace
}  // namespace bristle::detail
