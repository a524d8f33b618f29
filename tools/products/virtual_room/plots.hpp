// Draws the plots below the picture of the room, by means of ImGui's ImDrawList.
#pragma once

#include <string>
#include <vector>

#include "tools/products/virtual_room/camera.hpp"
#include "tools/products/virtual_room/compared.hpp"
#include "tools/products/virtual_room/gui_style.hpp"
#include "tools/products/virtual_room/history.hpp"

namespace room {

/// Range of a plot's axis that follows its data. It grows at once and shrinks slowly, so that the picture is
/// calm.
struct FollowingRange {
  double low = 0, high = 0;
  bool set = false;

  void follow(double data_low, double data_high, double least_span, float elapsed);
};

/// Range of values without their highest and lowest half per cent, unless these are within `sure`, so that an
/// impact of some milliseconds does not flatten the rest of a curve. The function reorders the values.
struct ValueRange {
  double low = 0, high = 0;
};
ValueRange range_of_most(std::vector<float>& values, double sure);

/// Labelling of an axis: the number n on it means the value offset + n * scale.
struct AxisText {
  double scale = 1, offset = 0;
  std::string unit;  ///< unit with the offset, if any: "µm from 249 mm"
};
/// Returns the labelling of an axis of lengths (m): a unit that suits its range, and an offset if numbers
/// would be long.
AxisText length_axis(double low, double high);

/// Levels of friction that a plot draws as lines (N): in sliding, and at the peak of first loading.
struct FrictionLevels {
  double kinetic = 0, peak = 0;
};

/// Compared blocks whose curves are drawn beside that of the first block, if a carriage moves all blocks.
/// Then there is no hand force to draw.
struct ShownBeside {
  const ComparedScene& scene;
  std::size_t count = 0;

  std::size_t curves() const { return scene.driven ? count : 0; }
};

/// Ranges of the axes of all plots, kept between pictures because they change slowly.
struct PlotRanges {
  FollowingRange force, displacement, loop_force;
};

/// Plots friction along the motion over time, with the sign of the applied force. Dashed lines are the
/// levels, a ring marks the highest friction in the `seconds` shown, bars in a strip below the curves are
/// snaps per millisecond. Without a peak level it draws the bristles' friction limit as a curve over time.
void plot_force_over_time(const Pen& pen, const Area& area, const History& history, float seconds,
                          FrictionLevels levels, const ShownBeside& beside, PlotRanges& ranges,
                          float elapsed);
/// Plots friction over displacement along the motion; in a corner without curves, if there is one, an inset
/// shows the first bending since the reset.
void plot_hysteresis(const Pen& pen, const Area& area, const History& history,
                     const FirstBending& first_bending, float seconds, double presliding_length,
                     FrictionLevels levels, const ShownBeside& beside, PlotRanges& ranges, float elapsed);
/// Plots the histogram of computing times, with marks at the deadline (s) and at the time within which 99 %
/// of the ticks are computed.
void plot_deadline(const Pen& pen, const Area& area, const TimeHistogram& times, double deadline_s);

}  // namespace room
