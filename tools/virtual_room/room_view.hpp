// The whole picture, room and panels, into any frame buffer: the window's or one without a window.
#pragma once

#include <optional>
#include <string>

#include "tools/virtual_room/bristle_glass.hpp"
#include "tools/virtual_room/overlay.hpp"
#include "tools/virtual_room/panels.hpp"
#include "tools/virtual_room/renderer.hpp"
#include "tools/virtual_room/trails.hpp"

namespace room {

/// Owns the ImGui context and its OpenGL side. Needs a current context, always on one thread.
class RoomView {
 public:
  RoomView(const RoomMeasures& measures, int samples, float scale);
  RoomView(const RoomView&) = delete;
  RoomView& operator=(const RoomView&) = delete;
  ~RoomView();

  /// @name What is shown
  ///@{
  Camera camera;
  GuiState gui;
  bool panels = true, glass_shown = true, help_shown = false;
  std::string notice;  ///< one line for the person, or empty
  std::string title;   ///< in place of the scene's own line; empty: that
  bool shadows = true, half_resolution = false;
  std::optional<bool> by_age;  ///< how the glass colours; none: by age where the material ages
  ///@}

  /// Each tick once, in order.
  void add(const PlotPoint& point);
  void forget();

  /// The panel shows what is in force, unless the person is at it: a script, a replay or a number out of
  /// range makes that another than what was asked for.
  void follow(const Settings& in_force);

  /// For displays of another scale (1 = 96 dots an inch).
  void set_scale(float scale);

  /// Between ImGui's platform part of a new frame and the next: draws and returns what the person asked for.
  /// `elapsed`: s since the last picture.
  Wishes draw(const Snapshot& room, int width, int height, float elapsed, std::uint32_t target);

  bool colours_by_age(const Snapshot& room) const {
    return by_age.value_or(room.settings.growth_per_decade > 0.0 &&
                           room.settings.model == FrictionModel::brush);
  }
  const History& history() const { return history_; }

  /// Of the last picture.
  const Layout& layout() const { return layout_; }
  const RoomMeasures& measures() const { return measures_; }

 private:
  void keep_glass_off_the_block(const Snapshot& room, int width, int height);

  RoomMeasures measures_;
  Renderer renderer_;
  BristleGlass glass_;
  Trails trails_;
  History history_;
  TimeHistogram times_;
  Fonts fonts_;
  Layout layout_;
  float scale_ = 1;
  bool glass_left_ = false;
};

}  // namespace room
