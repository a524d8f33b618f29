// Panels around the room: settings on the left, commands above, plots below. Take plain data and return plain
// data.
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

/// Places of the panels and the room, in pixels.
struct Layout {
  Picture picture;
  Area settings, bar, plots;  ///< areas of settings, buttons and plots; width 0: not shown
  float scale = 1;
};
/// Computes the layout. `glass_left` puts the glass at the left of the room instead of the right.
Layout make_layout(int width, int height, float scale, bool panels, bool glass, bool glass_left = false);

/// Requests that the person made in the last picture.
struct Wishes {
  bool settings = false;  ///< whether the person changed settings
  Act act = Act::none;
  bool screenshot = false, film = false, toggle_sound = false, toggle_glass = false, reset_view = false,
       toggle_help = false;
  bool export_plots = false, save_scene = false, full_speed = false;
  bool list_files = false;  ///< whether the button Load was pressed
  std::optional<Comparison> scene;
  bool tour = false;
  std::string load;  ///< name of a file to load
};

/// Undo stack of settings. A whole drag of a slider counts as one change.
class SettingsUndo {
 public:
  /// Notes a picture: the settings `before` it, whether they `changed` in it, and whether a control is still
  /// `active`.
  void note(const Settings& before, bool changed, bool active);
  /// Restores the settings before the last change; returns false if there is none.
  bool undo(Settings& settings);
  bool empty() const { return before_.empty(); }

 private:
  static constexpr std::size_t most = 100;
  std::deque<Settings> before_;
  bool changing_ = false;
};

/// Controls that have an effect under the present settings.
struct Effective {
  explicit Effective(const Settings& s);
  bool peak, bristles, damping, stribeck, ageing_time, pad;
};

/// Returns the index of the preset equal to these settings, or -1.
int preset_of(const Settings& settings);

struct GuiState {
  Settings settings, beginning;  ///< `beginning`: the settings that "Defaults" restores
  SettingsUndo undo;
  PlotRanges ranges;
  float plot_seconds = 8;
  std::vector<std::string> files;  ///< files that can be loaded, as found when the list was opened
  FirstBending first_bending;
  double share = 1.0;                 ///< simulated time over real time, as a share of the chosen speed
  double pictures = 0.0;              ///< pictures per second
  const char* drawn = "";             ///< text on what pictures leave out to keep pace, or ""
  bool sound = false;                 ///< whether snaps are heard
  float back_s = 0, back_most_s = 0;  ///< s, how long ago the moment shown during a pause was, and its limit
};

void draw_settings(const Layout& layout, const Fonts& fonts, const Snapshot& room, GuiState& state,
                   Wishes& wishes);
/// Draws the slider through the last minute, while the room pauses.
void draw_scrubber(const Layout& layout, GuiState& state);
/// Draws the help on keys and mouse, over the room.
void draw_help(const Layout& layout, const Fonts& fonts);
void draw_bar(const Layout& layout, const Fonts& fonts, const Snapshot& room, const GuiState& state,
              Wishes& wishes);
void draw_plots(const Layout& layout, const Fonts& fonts, const Snapshot& room, const History& history,
                const TimeHistogram& times, GuiState& state, float elapsed);

}  // namespace room
