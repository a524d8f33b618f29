// Pictures of a run without a window, one file each.
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>
#include <system_error>

#include "tools/cli/user_error.hpp"
#include "tools/virtual_room/offscreen.hpp"
#include "tools/virtual_room/screen.hpp"

namespace room {

DrawFrame draw_into(const RunOptions& options, HapticLoop& loop) {
  std::error_code error;
  std::filesystem::create_directories(options.frames, error);
  if (error) throw cli::UserError("cannot make the folder " + options.frames + ": " + error.message());
  leave_cores_to_the_haptic_loop();
  const PictureOptions& picture = options.picture;
  const float scale = picture.scale > 0 ? static_cast<float>(picture.scale) : 1.0f;
  const auto room = std::make_shared<OffscreenRoom>(options.loop.measures, picture.width, picture.height, scale);
  room->view().panels = picture.panels;
  const auto elapsed = static_cast<float>(1 / options.frames_per_second);
  return [room, elapsed, folder = options.frames, &plot = loop.exchange().plot](const Snapshot& now, long frame) {
    for (PlotPoint point; plot.pop(point);) room->view().add(point);
    write_png(fmt::format("{}/frame_{:05d}.png", folder, frame), room->draw(now, elapsed));
  };
}

}  // namespace room
