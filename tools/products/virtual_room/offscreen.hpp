// Draws pictures of the virtual room without a window, for files and tests.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "tools/products/virtual_room/room_view.hpp"

namespace room {

/// Image of three bytes (RGB) per pixel, in rows from the upper left.
struct PixelImage {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};
/// Reads a picture of this size from OpenGL's current frame buffer for reading.
PixelImage read_pixels(int width, int height);
/// Writes an image as a PNG file. Throws cli::UserError if it cannot be written.
void write_png(const std::string& file, const PixelImage& image);

/// Limits software OpenGL (llvmpipe) to one thread, so that the haptic loop has the other cores. Call it
/// before the first context is made. A setting in the user's environment has priority.
void leave_cores_to_the_haptic_loop();

/// Renderer of pictures of a fixed size. It has its own OpenGL context, which is current on this thread as
/// long as the renderer lives.
class OffscreenRoom {
 public:
  /// Makes the OpenGL context, without window or display, and the renderer. Throws cli::UserError where EGL
  /// or OpenGL 3.3 is missing.
  OffscreenRoom(const RoomMeasures& measures, int width, int height, float scale = 1, int samples = 4);
  OffscreenRoom(const OffscreenRoom&) = delete;
  OffscreenRoom& operator=(const OffscreenRoom&) = delete;
  ~OffscreenRoom();

  RoomView& view() { return *view_; }
  /// Draws a picture of the room; `elapsed` is the time since the last picture, s.
  PixelImage draw(const Snapshot& room, float elapsed);

 private:
  struct Context;
  std::unique_ptr<Context> context_;
  std::unique_ptr<RoomView> view_;
  int width_, height_;
  unsigned frame_ = 0, colour_ = 0;
};

}  // namespace room
