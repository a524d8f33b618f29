// Draws the whole picture, room and panels, into any frame buffer, of a window or not.
#pragma once

#include <optional>
#include <string>

#include "tools/virtual_room/bristle_glass.hpp"
#include "tools/virtual_room/overlay.hpp"
#include "tools/virtual_room/panels.hpp"
#include "tools/virtual_room/renderer.hpp"
#include "tools/virtual_room/trails.hpp"

namespace room {

/// Owner of the ImGui context and its OpenGL part. Needs a current context, always on one thread.
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
  std::string notice;  ///< line for the user, or empty
  std::string title;   ///< replaces the scene's own title, or empty
  bool shadows = true, half_resolution = false;
  std::optional<bool> by_age;  ///< whether the glass colours hairs by age; unset: if the material ages
  ///@}

  /// Adds a point to the plots; call it for each tick once, in order.
  void add(const PlotPoint& point);
  void forget();

  /// Shows the settings in force in the panel, unless the person is editing. A script, a replay or the
  /// clamping of a number makes them differ from those asked for.
  void follow(const Settings& in_force);

  /// Sets the display scale (1 = 96 dots an inch).
  void set_scale(float scale);

  /// Draws a picture and returns the person's requests. Call it after ImGui's platform part has begun a
  /// frame. `elapsed`: time since the last picture, s.
  Wishes draw(const Snapshot& room, int width, int height, float elapsed, std::uint32_t target);

  bool colours_by_age(const Snapshot& room) const {
    return by_age.value_or(room.settings.growth_per_decade > 0.0 &&
                           room.settings.model == FrictionModel::brush);
  }
  const History& history() const { return history_; }

  /// Returns the layout of the picture drawn last.
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
