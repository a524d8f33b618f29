// Draws the room by OpenGL 3.3: shadow map, sky light, magnifying glass. Knows no window and no panels.
#pragma once

#include <cstdint>
#include <memory>

#include "tools/virtual_room/bristle_glass.hpp"
#include "tools/virtual_room/camera.hpp"
#include "tools/virtual_room/room_state.hpp"

namespace room {

/// Places in a picture, in pixels from the upper left.
struct Picture {
  int width = 1280, height = 800;
  Area scene{0, 0, 1280, 800};                       ///< area of the picture that the camera fills
  float glass_x = 0, glass_y = 0, glass_radius = 0;  ///< centre and radius of the glass; radius 0: no glass
  bool shadows = true, half_resolution = false;      ///< half_resolution works where a pixel has one sample
};

class Trails;

/// Returns the rotation from room to world axes: the world's z is up, the room leans by the slope.
Eigen::Matrix3f room_tilt(double slope);
Eigen::Vector3f to_vector(const double (&v)[3]);

/// Returns the sideways distance (m) at which a compared block is drawn: the first to the back, the second to
/// the front.
inline float aside_of(std::size_t compared) { return compared == 0 ? 0.12f : -0.12f; }

/// Returns the length (m) of the arrow that shows a force.
float arrow_length(double newtons);
/// Ends of the force arrows, in the room's axes.
struct ForceArrows {
  Eigen::Vector3f friction_from, friction_to, applied_from, applied_to;
  bool friction = false, applied = false;  ///< whether each of the arrows is long enough to be drawn
};
ForceArrows place_arrows(const Snapshot& room, const RoomMeasures& measures);

/// Returns samples per pixel for the current context: 4, or 1 for software OpenGL.
int sensible_samples();

/// Renderer of the room. Needs a current context from construction to destruction, always on one thread.
class Renderer {
 public:
  /// Throws std::runtime_error where OpenGL is older than 3.3. `samples` per pixel: 1, 2, 4 or 8, limited by
  /// the driver.
  Renderer(const RoomMeasures& measures, int samples);
  ~Renderer();

  /// Draws into the frame buffer object `target`; 0 is the window.
  void draw(const Snapshot& room, const BristleGlass& glass, const Trails& trails, const Camera& camera,
            const Picture& picture, std::uint32_t target);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace room
