// Draws the plots under the room with ImDrawList.
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

/// Range without the highest and lowest half per cent of the values, unless these stay within `sure`: an
/// impact of some milliseconds does not flatten the rest of the curve. Reorders the values.
struct ValueRange {
  double low = 0, high = 0;
};
ValueRange range_of_most(std::vector<float>& values, double sure);

/// Labels of an axis, from which a value follows as offset + number * scale.
struct AxisText {
  double scale = 1, offset = 0;
  std::string unit;  ///< unit, with the offset if there is one: "µm from 249 mm"
};
/// Returns labels for an axis of lengths: a unit that suits its width, and an offset where the numbers would
/// be long.
AxisText length_axis(double low, double high);

/// Friction levels to draw (N): in sliding, and at the peak of first loading.
struct FrictionLevels {
  double kinetic = 0, peak = 0;
};

/// Compared blocks, whose curves are drawn beside the first block's. `driven`: a carriage moves them all, and
/// no hand force is applied.
struct ShownBeside {
  std::size_t count = 0;
  bool driven = false;
  const char* names[1 + most_compared] = {};
};

/// Ranges of the plots' axes, kept from picture to picture.
struct PlotRanges {
  FollowingRange force, displacement, loop_force;
};

/// Plots friction over time as it resists a motion along x: with the sign of the applied force. Dashed lines:
/// the levels; ring: the highest friction of the `seconds` shown; bars at the bottom: snaps per millisecond.
/// Without a peak level it draws the curve of the bristles' friction limit over time.
void plot_force_over_time(ImDrawList& draw, const Fonts& fonts, const Area& area, const History& history,
                          float seconds, FrictionLevels levels, const ShownBeside& beside, PlotRanges& ranges,
                          float elapsed);
/// Plots friction over displacement, with the first bending since the reset as an inset where there is room.
void plot_hysteresis(ImDrawList& draw, const Fonts& fonts, const Area& area, const History& history,
                     const FirstBending& first_bending, float seconds, double presliding_length,
                     FrictionLevels levels, const ShownBeside& beside, PlotRanges& ranges, float elapsed);
void plot_deadline(ImDrawList& draw, const Fonts& fonts, const Area& area, const TimeHistogram& times,
                   const LoopStatistics& loop);

}  // namespace room
