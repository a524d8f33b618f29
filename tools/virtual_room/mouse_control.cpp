#include "tools/virtual_room/mouse_control.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tools/virtual_room/renderer.hpp"

namespace room {

namespace {
constexpr double height_a_notch = 0.002;  // m
constexpr double press_a_notch = 0.1;     // N
constexpr double most_press = 10.0;       // N
}  // namespace

void MouseControl::move(float px, float py, MouseButtons buttons, const Area& scene, Camera& camera,
                        const Snapshot& room, const RoomMeasures& measures) {
  const float dx = px - last_x_, dy = py - last_y_;
  last_x_ = px;
  last_y_ = py;
  const bool any = buttons.left || buttons.right || buttons.middle;
  if (drag_ == Drag::none && any) {
    drag_ = !scene.holds(px, py) ? Drag::elsewhere
            : buttons.left       ? Drag::hand
            : buttons.right      ? Drag::turn
                                 : Drag::shift;
  } else if (!any) {
    if (drag_ == Drag::hand) {
      hand_.holds = false;
      changed_ = true;
    }
    drag_ = Drag::none;
  }
  if (drag_ == Drag::hand) hold(camera.ray(scene, px, py), room, measures);
  if (drag_ == Drag::turn) camera.orbit(-0.006f * dx, 0.006f * dy);
  if (drag_ == Drag::shift) camera.pan(dx / scene.height, -dy / scene.height);
}

// Where the ray meets the plane on which the hand moves.
void MouseControl::hold(const Ray& ray, const Snapshot& room, const RoomMeasures& measures) {
  const Eigen::Matrix3f to_room = room_tilt(room.settings.slope).transpose();
  const Eigen::Vector3d from = (to_room * ray.from).cast<double>(),
                        along = (to_room * ray.along).cast<double>();
  double position[3] = {hand_.position[0], hand_.position[1], height_};
  const double way = (height_ - from.z()) / along.z();
  if (std::isfinite(way) && way > 0) {
    const Eigen::Vector3d at = from + way * along;
    const double x = measures.length / 2 - measures.tool_radius,
                 y = measures.width / 2 - measures.tool_radius;
    position[0] = std::clamp(at.x(), -x, x);
    position[1] = std::clamp(at.y(), -y, y);
  }
  const bool same = hand_.holds && std::equal(position, position + 3, hand_.position);
  if (same) return;
  std::copy(position, position + 3, hand_.position);
  hand_.holds = true;
  changed_ = true;
}

std::string MouseControl::turn_wheel(float notches, bool control, Camera& camera,
                                     const RoomMeasures& measures) {
  if (drag_ != Drag::hand) {
    camera.zoom(std::pow(0.9f, notches));
    return {};
  }
  changed_ = true;
  if (control) {
    hand_.press = std::clamp(hand_.press - press_a_notch * static_cast<double>(notches), 0.0, most_press);
    return fmt::format("load of the hand {:.1f} N", hand_.press);
  }
  height_ = std::clamp(height_ + height_a_notch * static_cast<double>(notches), measures.tool_radius,
                       measures.height - measures.tool_radius);
  hand_.position[2] = height_;
  return fmt::format("height of the hand {:.0f} mm", 1e3 * height_);
}

bool MouseControl::hand_changed() {
  const bool changed = changed_;
  changed_ = false;
  return changed;
}

}  // namespace room
