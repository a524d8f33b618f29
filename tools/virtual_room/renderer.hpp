// Draws the room by OpenGL 3.3: shadow map, light of the sky, the glass. Knows no window and no panels.
#pragma once

#include <cstdint>
#include <memory>

#include "tools/virtual_room/bristle_glass.hpp"
#include "tools/virtual_room/camera.hpp"
#include "tools/virtual_room/room_state.hpp"

namespace room {

/// Where things are in a picture, in pixels from above left.
struct Picture {
  int width = 1280, height = 800;
  Area scene{0, 0, 1280, 800};                       ///< what the camera fills
  float glass_x = 0, glass_y = 0, glass_radius = 0;  ///< 0: no glass
  bool shadows = true, half_resolution = false;      ///< the latter where a pixel has one sample
};

class Trails;

/// Room to world: the world's z is up, the room leans by the slope.
Eigen::Matrix3f room_tilt(double slope);
Eigen::Vector3f to_vector(const double (&v)[3]);

/// Distance aside at which a block of Settings::compare is drawn, m: the first to the back, the second to the
/// front.
inline float aside_of(std::size_t compared) { return compared == 0 ? 0.12f : -0.12f; }

/// Length of the arrow that shows a force, m.
float arrow_length(double newtons);
/// Where the arrows begin and point to, in the room's axes.
struct ForceArrows {
  Eigen::Vector3f friction_from, friction_to, applied_from, applied_to;
  bool friction = false, applied = false;  ///< long enough to be drawn
};
ForceArrows place_arrows(const Snapshot& room, const RoomMeasures& measures);

/// Samples a pixel for the current context: 4, or 1 where OpenGL is computed in software.
int sensible_samples();

/// Needs a current context from construction to destruction, always on one thread.
class Renderer {
 public:
  /// Throws std::runtime_error where OpenGL is older than 3.3. `samples` a pixel: 1, 2, 4 or 8, as many as
  /// the driver has.
  Renderer(const RoomMeasures& measures, int samples);
  ~Renderer();

  /// Into the frame buffer object `target`; 0 is the window.
  void draw(const Snapshot& room, const BristleGlass& glass, const Trails& trails, const Camera& camera,
            const Picture& picture, std::uint32_t target);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace room
