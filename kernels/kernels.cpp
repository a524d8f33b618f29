// The kernel table of one instruction set ("scalar" is one of them). This file is compiled once for each set
// (CMakeLists.txt). Everything but the table has internal linkage, so that the linker cannot use code of one
// instruction set in another.
#include "renew.hpp"
#include "step.hpp"

namespace bristle::detail {
namespace {

/// Samples snap lengths, each from the random state of a bristle.
template <class T>
struct FreshLengths {
  static constexpr bool by_columns = Lanes<float>::size == lane_count;
  static void fill(const KernelLaw& law, const std::uint32_t* states, std::uint32_t count, T* lengths) {
    alignas(64) T shares[selections_at_once] = {};
    for (std::uint32_t k = 0; k < selections_at_once; ++k)
      shares[k] = k < count ? share_of<T>(mix(states[k])) : T(0.5);
    for (std::uint32_t k = 0; k < count; k += Lanes<T>::size)
      length_at<T>(law, load(shares + k)).store_aligned(lengths + k);
  }
};

}  // namespace
}  // namespace bristle::detail

#include "variants.hpp"
