// Writes the pictures of a run without a window as PNG files.
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <system_error>
#include <vector>

#include "tools/libraries/files/user_error.hpp"
#include "tools/products/virtual_room/offscreen.hpp"
#include "tools/products/virtual_room/panels.hpp"
#include "tools/products/virtual_room/screen.hpp"

namespace room {

namespace {

Camera camera_of(const PictureOptions& picture) {
  Camera camera;
  if (const std::vector<double>& eye = picture.eye; eye.size() == 6) {
    constexpr double degree = 3.14159265358979 / 180;
    camera.azimuth = static_cast<float>(eye[0] * degree);
    camera.elevation = static_cast<float>(eye[1] * degree);
    camera.distance = static_cast<float>(eye[2]);
    camera.target = Eigen::Vector3d(eye[3], eye[4], eye[5]).cast<float>();
  }
  return camera;
}

}  // namespace

DrawFrame draw_into(const RunOptions& options) {
  std::error_code error;
  std::filesystem::create_directories(options.frames, error);
  if (error) throw cli::UserError("cannot make the folder " + options.frames + ": " + error.message());
  leave_cores_to_the_haptic_loop();
  const PictureOptions& picture = options.picture;
  const float wanted = picture.scale > 0 ? static_cast<float>(picture.scale) : 1.0f;
  const float scale = fitting_scale(wanted, picture.width, picture.height);
  const auto room =
      std::make_shared<OffscreenRoom>(options.loop.measures, picture.width, picture.height, scale);
  room->view().panels = picture.panels;
  room->view().title = picture.title;
  room->view().camera = camera_of(picture);
  const auto elapsed = static_cast<float>(1 / options.frames_per_second);
  return {[room](const PlotPoint& point) { room->view().add(point); },
          [room, elapsed, folder = options.frames](const Snapshot& now, long frame) {
            write_png(fmt::format("{}/frame_{:05d}.png", folder, frame), room->draw(now, elapsed));
          }};
}

}  // namespace room
