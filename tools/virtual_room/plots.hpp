// The plots under the room, drawn by ImDrawList.
#pragma once

#include <string>
#include <vector>

#include "tools/virtual_room/camera.hpp"
#include "tools/virtual_room/gui_style.hpp"
#include "tools/virtual_room/history.hpp"

namespace room {

/// Range of an axis that follows its data: grows at once, shrinks slowly.
struct FollowingRange {
  double low = 0, high = 0;
  bool set = false;

  void follow(double data_low, double data_high, double least_span, float elapsed);
};

/// Range of most values: without the half per cent of highest and lowest, unless these stay within `sure`.
/// An impact lasts some milliseconds; it does not flatten what is drawn beside it. Reorders the values.
struct ValueRange {
  double low = 0, high = 0;
};
ValueRange range_of_most(std::vector<float>& values, double sure);

/// Labels of an axis: value = offset + number * scale.
struct AxisText {
  double scale = 1, offset = 0;
  std::string unit;  ///< with the offset, if there is one: "µm from 249 mm"
};
/// Lengths of a range: a unit for its width, and an offset where the numbers would be long.
AxisText length_axis(double low, double high);

/// Of friction, N: in sliding, and at first loading.
struct FrictionLevels {
  double kinetic = 0, peak = 0;
};

/// Blocks that are compared: their curves beside the block's own. `driven`: a carriage moves them all, and
/// nothing is applied by hand.
struct ShownBeside {
  std::size_t count = 0;
  bool driven = false;
  const char* names[1 + most_compared] = {};
};

/// Ranges that the plots keep from picture to picture.
struct PlotRanges {
  FollowingRange force, displacement, loop_force;
};

/// Friction is drawn as it resists a motion along x: with the sign of what is applied against it. Dashed: the
/// levels; a ring: the highest friction of the `seconds` looked back on. Bars at the bottom: snaps per
/// millisecond. Without a level for the peak, the curve of what the bristles hold at each time.
void plot_force_over_time(ImDrawList& draw, const Fonts& fonts, const Area& area, const History& history,
                          float seconds, FrictionLevels levels, const ShownBeside& beside, PlotRanges& ranges,
                          float elapsed);
/// With the first bending since the beginning as an inset, where there is room.
void plot_hysteresis(ImDrawList& draw, const Fonts& fonts, const Area& area, const History& history,
                     const FirstBending& first_bending, float seconds, double presliding_length,
                     FrictionLevels levels, const ShownBeside& beside, PlotRanges& ranges, float elapsed);
void plot_deadline(ImDrawList& draw, const Fonts& fonts, const Area& area, const TimeHistogram& times,
                   const LoopStatistics& loop);

}  // namespace room
