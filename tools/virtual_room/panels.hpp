// The panels around the room: settings on the left, what to do above, plots below. Plain data in, plain data
// out.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

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
/// `glass_left`: the glass is at the left of the room instead of the right.
Layout make_layout(int width, int height, float scale, bool panels, bool glass, bool glass_left = false);

/// Requests of the person in the last picture.
struct Wishes {
  bool settings = false;  ///< they changed
  Act act = Act::none;
  bool screenshot = false, toggle_glass = false, reset_view = false, toggle_help = false;
  bool export_plots = false, save_scene = false, full_speed = false;
  bool list_files = false;  ///< the button Load was pressed
  std::optional<Comparison> scene;
  bool tour = false;
  std::string load;  ///< a file to load
};

/// Settings of before each change. A slider that is dragged is one change.
class SettingsUndo {
 public:
  /// Once a picture: `before` it, and whether they `changed` in it, with a control still `active`.
  void note(const Settings& before, bool changed, bool active);
  /// Puts back what was before the last change; false if there is none.
  bool undo(Settings& settings);
  bool empty() const { return before_.empty(); }

 private:
  static constexpr std::size_t most = 100;
  std::deque<Settings> before_;
  bool changing_ = false;
};

/// Controls that have an effect under these settings.
struct Effective {
  explicit Effective(const Settings& s);
  bool peak, bristles, damping, stribeck, ageing_time, pad;
};

/// The preset that these settings are, or -1.
int preset_of(const Settings& settings);

struct GuiState {
  Settings settings, beginning;  ///< the latter: what "Defaults" goes back to
  SettingsUndo undo;
  PlotRanges ranges;
  float plot_seconds = 8;
  std::vector<std::string> files;  ///< that can be loaded, as they were when the list was opened
  FirstBending first_bending;
  double share = 1.0;                 ///< of real time at which the simulation runs, over its speed
  double pictures = 0.0;              ///< a second
  const char* drawn = "";             ///< what pictures leave out to keep pace, or ""
  float back_s = 0, back_most_s = 0;  ///< how long ago is what is shown, while it pauses
};

void draw_settings(const Layout& layout, const Fonts& fonts, const Snapshot& room, GuiState& state,
                   Wishes& wishes);
/// The slider through the last minute, while the room pauses.
void draw_scrubber(const Layout& layout, GuiState& state);
/// Keys and mouse, over the room.
void draw_help(const Layout& layout, const Fonts& fonts);
void draw_bar(const Layout& layout, const Fonts& fonts, const Snapshot& room, const GuiState& state,
              Wishes& wishes);
void draw_plots(const Layout& layout, const Fonts& fonts, const Snapshot& room, const History& history,
                const TimeHistogram& times, GuiState& state, float elapsed);

}  // namespace room
