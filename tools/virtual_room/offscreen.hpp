// Draws pictures of the room without a window.
#pragma once

#include <memory>

#include "tools/virtual_room/png_file.hpp"
#include "tools/virtual_room/room_view.hpp"
#include "tools/virtual_room/surfaceless.hpp"

namespace room {

/// Renderer of pictures of fixed size, in a context of its own that is current on this thread as long as it
/// lives.
class OffscreenRoom {
 public:
  /// Makes the context. Throws cli::UserError where there is no OpenGL 3.3.
  OffscreenRoom(const RoomMeasures& measures, int width, int height, float scale = 1, int samples = 4);
  OffscreenRoom(const OffscreenRoom&) = delete;
  OffscreenRoom& operator=(const OffscreenRoom&) = delete;
  ~OffscreenRoom();

  RoomView& view() { return *view_; }
  /// Draws a picture of the room. `elapsed`: time since the last picture, s.
  PixelImage draw(const Snapshot& room, float elapsed);

 private:
  SurfacelessContext context_;
  std::unique_ptr<RoomView> view_;
  int width_, height_;
  unsigned frame_ = 0, colour_ = 0;
};

}  // namespace room
