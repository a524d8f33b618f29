// The kernels of contacts in lanes for one instruction set. Everything but the table has internal linkage, so
// that the linker cannot use code of one instruction set in another.
#include "lane_brush_step.hpp"
#include "lane_slide.hpp"
#include "tables.hpp"

namespace bristle::detail {
namespace {

template <class T>
constexpr LaneKernels<T> make_lane_kernels() {
  return {
      {{&slide_lanes<T, 1, false, false>, &slide_lanes<T, 1, true, false>, &slide_lanes<T, 1, true, true>},
       {&slide_lanes<T, 2, false, false>, &slide_lanes<T, 2, true, false>, &slide_lanes<T, 2, true, true>}},
      {{&brush_lanes<T, 1, false>, &brush_lanes<T, 1, true>},
       {&brush_lanes<T, 2, false>, &brush_lanes<T, 2, true>}}};
}

}  // namespace

extern const LaneTable BRISTLE_TABLE(lane_kernels_);
constinit const LaneTable BRISTLE_TABLE(lane_kernels_) = {
    &check_lanes,
    make_lane_kernels<float>(),
#if BRISTLE_WITH_DOUBLE
    make_lane_kernels<double>(),
#else
    {},
#endif
};

}  // namespace bristle::detail
