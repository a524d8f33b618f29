// Draws labels and rings over the picture of the room: forces in newtons, lengths on the floor, the rim of
// the magnifying glass.
#pragma once

#include <string>

#include "tools/products/virtual_room/bristle_glass.hpp"
#include "tools/products/virtual_room/gui_style.hpp"
#include "tools/products/virtual_room/panels.hpp"

namespace room {

/// Draws the overlay into ImGui's background list. `title` replaces the scene's own title unless it is empty;
/// `notice` is a line for the user, or empty.
void draw_overlay(const Layout& layout, const Fonts& fonts, const Snapshot& room, const BristleGlass& glass,
                  const Camera& camera, const RoomMeasures& measures, const std::string& title,
                  const std::string& notice);

}  // namespace room
