// Words and rings over the picture of the room: forces in newtons, lengths on the floor, the rim of the
// glass.
#pragma once

#include <string>

#include "tools/virtual_room/bristle_glass.hpp"
#include "tools/virtual_room/gui_style.hpp"
#include "tools/virtual_room/panels.hpp"

namespace room {

/// Into ImGui's background list of the current picture. `title`: in place of the scene's own, or empty;
/// `notice`: a line for the person, or empty.
void draw_overlay(const Layout& layout, const Fonts& fonts, const Snapshot& room, const BristleGlass& glass,
                  const Camera& camera, const RoomMeasures& measures, const std::string& title,
                  const std::string& notice);

}  // namespace room
