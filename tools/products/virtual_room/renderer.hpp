// Draws the virtual room, with a magnifying glass, by OpenGL 3.3. It knows nothing of windows and panels.
#pragma once

#include <cstdint>
#include <memory>

#include "tools/products/virtual_room/bristle_glass.hpp"
#include "tools/products/virtual_room/camera.hpp"
#include "tools/products/virtual_room/room_state.hpp"

namespace room {

/// Size of a picture, and where the room and the magnifying glass lie in it, in pixels from the upper left.
struct Picture {
  int width = 1280, height = 800;
  Area scene{0, 0, 1280, 800};                       ///< part that the camera's view fills
  float glass_x = 0, glass_y = 0, glass_radius = 0;  ///< centre and radius of the glass; radius 0: none
};

/// Returns the rotation from the room's axes to the world's, in which z is up: a slope tilts the whole room.
Eigen::Matrix3f room_tilt(double slope);
Eigen::Vector3f to_vector(const double (&v)[3]);

/// Returns how far to the side (m) compared block 0 (to the back) or 1 (to the front) is drawn.
inline float aside_of(std::size_t compared) { return compared == 0 ? 0.12f : -0.12f; }

/// Returns the length (m) of the arrow that shows a force of this size.
float arrow_length(double newtons);
/// Ends of the two arrows that show friction and applied force, in the room's axes.
struct ForceArrows {
  Eigen::Vector3f friction_from, friction_to, applied_from, applied_to;
  bool friction = false, applied = false;  ///< whether the arrow is long enough to be drawn
};
ForceArrows place_arrows(const Snapshot& room, const RoomMeasures& measures);

/// Returns a number of samples per pixel for the current OpenGL context: 4, or 1 for software OpenGL.
int sensible_samples();

/// Renderer of the room. All calls, from construction to destruction, come from the thread on which its
/// OpenGL context is current.
class Renderer {
 public:
  /// Prepares drawing with 1, 2, 4 or 8 samples per pixel, as far as the driver allows. Throws
  /// std::runtime_error where OpenGL is older than 3.3.
  Renderer(const RoomMeasures& measures, int samples);
  ~Renderer();

  /// Draws a picture of the room into the frame buffer object `target`; 0 is the window.
  void draw(const Snapshot& room, const BristleGlass& glass, const Camera& camera, const Picture& picture,
            std::uint32_t target);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace room
