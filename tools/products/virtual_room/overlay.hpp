// Draws labels and rings over the picture of the room: forces in newtons, lengths on the floor, the rim of
// the magnifying glass.
#pragma once

#include <string>

#include "tools/products/virtual_room/bristle_glass.hpp"
#include "tools/products/virtual_room/gui_style.hpp"
#include "tools/products/virtual_room/panels.hpp"

namespace room {

/// Lines of text over the picture; empty ones are not drawn.
struct OverlayWords {
  std::string title;           ///< replaces the scene's own title
  std::string notice;          ///< answer to the user
  std::string warning;         ///< what is wrong
  std::string rates;           ///< speed of simulation and pictures, in the lower right corner
  bool rates_are_low = false;  ///< whether the simulation is slower than real time
};

/// Draws the overlay into the list of shapes that ImGui draws behind its panels.
void draw_overlay(const Layout& layout, const Fonts& fonts, const Snapshot& room, const BristleGlass& glass,
                  const Camera& camera, const RoomMeasures& measures, const OverlayWords& words);

}  // namespace room
