// Draws the whole picture, which is the room and its panels, into any frame buffer, with or without a window.
#pragma once

#include <optional>
#include <string>

#include "tools/products/virtual_room/bristle_glass.hpp"
#include "tools/products/virtual_room/overlay.hpp"
#include "tools/products/virtual_room/panels.hpp"
#include "tools/products/virtual_room/renderer.hpp"

namespace room {

/// View of the room and its panels; owns the ImGui context. All calls must come from the thread on which its
/// OpenGL context is current.
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
  std::string notice;          ///< line of text for the user, or ""
  std::string title;           ///< replaces the title of the scene, unless empty
  std::optional<bool> by_age;  ///< whether hairs are coloured by age; unset: if the material ages
  ///@}

  /// Adds the values of a tick to the plots. Call it once for each tick, in order.
  void add(const PlotPoint& point);
  void forget();

  /// Shows the settings in force in the panel, unless the user is editing. They differ from those that the
  /// user chose if a script or a replay changed them, or a number was clamped.
  void follow(const Settings& in_force);

  /// Sets the display scale of fonts and panels (1 = 96 dots an inch).
  void set_scale(float scale);

  /// Draws a picture into the frame buffer `target` and returns the user's requests. Call it after ImGui's
  /// platform part has begun a frame. `elapsed` is the time since the last picture, s.
  Wishes draw(const Snapshot& room, int width, int height, float elapsed, std::uint32_t target);

  bool colours_by_age(const Snapshot& room) const {
    return by_age.value_or(room.settings.growth_per_decade > 0.0 &&
                           room.settings.model == FrictionModel::brush);
  }
  const History& history() const { return history_; }

  /// Returns where room and panels lie in the picture that was drawn last.
  const Layout& layout() const { return layout_; }
  const RoomMeasures& measures() const { return measures_; }

 private:
  void keep_glass_off_the_block(const Snapshot& room, int width, int height);

  RoomMeasures measures_;
  Renderer renderer_;
  BristleGlass glass_;
  History history_;
  TimeHistogram times_;
  Fonts fonts_;
  Layout layout_;
  float scale_ = 1;
  bool glass_left_ = false;
};

}  // namespace room
