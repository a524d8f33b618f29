#include "tools/products/virtual_room/mouse_control.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tools/products/virtual_room/renderer.hpp"

namespace room {

namespace {
constexpr double height_a_notch = 0.002;  // height of the hand per notch of the wheel, m
constexpr double press_a_notch = 0.1;     // press on the tool per notch of the wheel, N
constexpr double most_press = 10.0;       // limit of the press on the tool, N
constexpr double fine_gain = 0.1;
constexpr double key_speed = 0.01;  // speed at which keys move the hand, m/s
constexpr double key_turn = 0.5;    // speed at which keys turn the block, rad/s
}  // namespace

void MouseControl::move(float px, float py, MouseButtons buttons, const Area& scene, Camera& camera,
                        const Snapshot& room, const RoomMeasures& measures) {
  const float dx = px - last_x_, dy = py - last_y_;
  last_x_ = px;
  last_y_ = py;
  const Drag before = drag_;
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
  if (drag_ == Drag::hand)
    hold(camera.ray(scene, px, py), before != Drag::hand, buttons.fine, room, measures);
  if (drag_ == Drag::turn) camera.orbit(-0.006f * dx, 0.006f * dy);
  if (drag_ == Drag::shift) camera.pan(dx / scene.height, -dy / scene.height);
}

// Moves the hand to where the pointer's ray meets the hand's plane. A fine drag moves it a tenth of the
// pointer's distance since the drag became fine. A hand that keys have put on the tool goes on from there.
void MouseControl::hold(const Ray& ray, bool begins, bool fine, const Snapshot& room,
                        const RoomMeasures& measures) {
  const Eigen::Matrix3f to_room = room_tilt(room.settings.slope).transpose();
  const Eigen::Vector3d from = (to_room * ray.from).cast<double>(),
                        along = (to_room * ray.along).cast<double>();
  const double path = (height_ - from.z()) / along.z();
  if (!(std::isfinite(path) && path > 0)) {
    if (!hand_.holds) put(hand_.position[0], hand_.position[1], measures);
    return;
  }
  const Eigen::Vector3d at = from + path * along;
  if (begins || fine != fine_) {
    const bool stays = !begins || hand_.holds;
    for (int i = 0; i < 2; ++i) {
      pointer_[i] = at[i];
      anchor_[i] = stays ? hand_.position[i] : at[i];
    }
    fine_ = fine;
  }
  const double gain = fine ? fine_gain : 1.0;
  put(anchor_[0] + gain * (at[0] - pointer_[0]), anchor_[1] + gain * (at[1] - pointer_[1]), measures);
}

void MouseControl::put(double x, double y, const RoomMeasures& measures) {
  const double most_x = measures.length / 2 - measures.tool_radius,
               most_y = measures.width / 2 - measures.tool_radius;
  const double position[3] = {std::clamp(x, -most_x, most_x), std::clamp(y, -most_y, most_y), height_};
  if (hand_.holds && std::equal(position, position + 3, hand_.position)) return;
  std::copy(position, position + 3, hand_.position);
  hand_.holds = true;
  changed_ = true;
}

void MouseControl::push(int right, int away, bool fine, double elapsed_s, const Snapshot& room,
                        const RoomMeasures& measures) {
  if (drag_ == Drag::hand || (right == 0 && away == 0)) return;
  if (!hand_.holds) {
    height_ = std::clamp(room.tool[2], measures.tool_radius, measures.height - measures.tool_radius);
    put(room.tool[0], room.tool[1], measures);
  }
  const double path = (fine ? fine_gain : 1.0) * key_speed * elapsed_s;
  put(hand_.position[0] + path * right, hand_.position[1] + path * away, measures);
}

double MouseControl::turn(int left, bool fine, double elapsed_s, const Snapshot& room) {
  const auto& q = room.block_orientation;
  const double block = heading(q[0], q[1], q[2], q[3]);
  if (left != 0) {
    if (!hand_.turns) hand_.angle = block;
    hand_.turns = changed_ = true;
    hand_.angle += (fine ? fine_gain : 1.0) * key_turn * elapsed_s * left;
  }
  return hand_.turns ? turn_stiffness * std::remainder(hand_.angle - block, 6.28318530717959) : 0.0;
}

void MouseControl::let_go() {
  if (!hand_.holds && !hand_.turns) return;
  hand_.holds = hand_.turns = false;
  changed_ = true;
}

std::string MouseControl::turn_wheel(float notches, bool control, Camera& camera,
                                     const RoomMeasures& measures) {
  if (drag_ != Drag::hand && !(control && hand_.holds)) {
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
