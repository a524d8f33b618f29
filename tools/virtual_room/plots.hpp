// The plots under the room, drawn by ImDrawList.
#pragma once

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

/// What the plots remember from picture to picture.
struct PlotRanges {
  FollowingRange force, displacement, loop_force;
};

/// Friction is drawn as it resists a motion along x: with the sign of what is applied against it. `level` is
/// the kinetic friction, N, drawn as a dashed line; `seconds` those looked back on.
void plot_force_over_time(ImDrawList& draw, const Fonts& fonts, const Area& area, const History& history,
                          float seconds, double level, PlotRanges& ranges, float elapsed);
void plot_hysteresis(ImDrawList& draw, const Fonts& fonts, const Area& area, const History& history,
                     float seconds, double presliding_length, PlotRanges& ranges, float elapsed);
void plot_deadline(ImDrawList& draw, const Fonts& fonts, const Area& area, const TimeHistogram& times,
                   const LoopStatistics& loop);

}  // namespace room
