// The panels around the picture of the room: settings on the left, buttons above, plots below. They take
// plain data and return plain data, and know nothing of the loops.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "tools/products/virtual_room/gui_style.hpp"
#include "tools/products/virtual_room/history.hpp"
#include "tools/products/virtual_room/plots.hpp"
#include "tools/products/virtual_room/renderer.hpp"
#include "tools/products/virtual_room/room_state.hpp"

namespace room {

/// Places of the room's picture and of the panels in the window, in pixels.
struct Layout {
  Picture picture;
  Area settings, bar, plots;  ///< places of settings, buttons and plots; width 0: not shown
  float scale = 1;
};
/// Returns the scale of type and panels for which a window of this size (pixels) has room, at most `wanted`:
/// in steps of a quarter, with at least 640 x 480 pixels for each unit of scale, and at least 0.75.
float fitting_scale(float wanted, int width, int height);
/// Computes the layout. `glass_left` puts the magnifying glass at the room's left instead of its right.
Layout make_layout(int width, int height, float scale, bool panels, bool glass, bool glass_left = false);

/// Requests that the user made in the panels while the last picture was shown.
struct Wishes {
  bool settings = false;    ///< whether the user changed settings
  int key = 0;              ///< key (GLFW's number) that does what the pressed button does; 0: none
  bool full_speed = false;  ///< whether slow motion ends
  bool list_files = false;  ///< whether the user pressed Load
  std::optional<Comparison> scene;
  std::string load;  ///< name of a file to load; empty: none
};

/// Stack of earlier settings, to undo changes. A whole drag of a slider counts as one change.
class SettingsUndo {
 public:
  /// Records, for a picture, the settings `before` it, whether the user `changed` them in it, and whether a
  /// control is still held down (`active`).
  void note(const Settings& before, bool changed, bool active);
  /// Restores the settings from before the last change; returns false if there was none.
  bool undo(Settings& settings);
  bool empty() const { return before_.empty(); }

 private:
  static constexpr std::size_t most = 100;
  std::deque<Settings> before_;
  bool changing_ = false;
};

/// For each control of the panel, whether moving it has an effect under the present settings. Others are
/// grey.
struct Effective {
  explicit Effective(const Settings& s);
  bool peak, bristles, damping, stribeck, ageing_time, pad;
};

/// Returns the index of the preset whose settings are equal to these, or -1.
int preset_of(const Settings& settings);

struct GuiState {
  Settings settings, beginning;  ///< `beginning`: what the button Defaults restores
  SettingsUndo undo;
  PlotRanges ranges;
  float plot_seconds = 8;
  std::vector<std::string> files;  ///< files to offer for loading, as found when Load was pressed
  FirstBending first_bending;
  double share = 1.0;                 ///< simulated over real time, relative to the chosen speed
  double pictures = 0.0;              ///< number of pictures per second
  float back_s = 0, back_most_s = 0;  ///< how far a pause looks back, and its limit, s
};

/// Returns a line that warns if more than one tick in a hundred exceeds the deadline on this machine. It is
/// empty if none do, without a real clock, and during the first second of ticks.
std::string deadline_warning(const TimeHistogram& times, const LoopStatistics& loop);

void draw_settings(const Layout& layout, const Fonts& fonts, const Snapshot& room, const TimeHistogram& times,
                   GuiState& state, Wishes& wishes);
/// Draws the slider by which the user, in a pause, looks back through the last minute.
void draw_scrubber(const Layout& layout, GuiState& state);
/// Draws the help on keys and mouse over the picture of the room.
void draw_help(const Layout& layout, const Fonts& fonts);
void draw_bar(const Layout& layout, const Fonts& fonts, const Snapshot& room, const GuiState& state,
              Wishes& wishes);
void draw_plots(const Layout& layout, const Fonts& fonts, const Snapshot& room, const History& history,
                const TimeHistogram& times, GuiState& state, float elapsed);

}  // namespace room
