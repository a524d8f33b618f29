// Number type of a loop over many equal items: Lanes<T> is a vector of the instruction set or, in "scalar",
// one number.
#pragma once

#include "lanes.hpp"

namespace bristle::detail {
namespace {

template <class T>
struct Engine {
  using V = Lanes<T>;
  static constexpr std::uint32_t size = V::size;
  static V get(const T* from) { return load<T>(from); }
  static void put(T* to, V x) { x.store_aligned(to); }
  static V get_any(const T* from) { return V::load_unaligned(from); }
  static void put_any(T* to, V x) { x.store_unaligned(to); }
  struct Sum {
    Row<T> row;
    void add(std::uint32_t part, V x) { row.part[part] = row.part[part] + x; }
    double total() const { return tree_sum<T>(row); }
  };
};

}  // namespace
}  // namespace bristle::detail
