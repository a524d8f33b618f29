// The panels around the room: settings on the left, what to do above, plots below. Plain data in, plain data
// out.
#pragma once

#include <string>

#include "tools/virtual_room/gui_style.hpp"
#include "tools/virtual_room/history.hpp"
#include "tools/virtual_room/plots.hpp"
#include "tools/virtual_room/renderer.hpp"
#include "tools/virtual_room/room_state.hpp"

namespace room {

/// Where panels and room are, in pixels.
struct Layout {
  Picture picture;
  Area settings, bar, plots;  ///< width 0: hidden
  float scale = 1;
};
Layout make_layout(int width, int height, float scale, bool panels, bool glass);

/// What the person asked for in the last picture.
struct Wishes {
  bool settings = false;  ///< they changed
  Act act = Act::none;
  bool screenshot = false, toggle_glass = false, reset_view = false;
};

struct GuiState {
  Settings settings;
  PlotRanges ranges;
  float plot_seconds = 8;
};

void draw_settings(const Layout& layout, const Fonts& fonts, const Snapshot& room, GuiState& state,
                   Wishes& wishes);
void draw_bar(const Layout& layout, const Fonts& fonts, const Snapshot& room, Wishes& wishes);
void draw_plots(const Layout& layout, const Fonts& fonts, const Snapshot& room, const History& history,
                const TimeHistogram& times, GuiState& state, float elapsed);

}  // namespace room
