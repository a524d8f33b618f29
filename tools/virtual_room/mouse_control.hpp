// Controls the room by mouse: the left button holds the tool, the others turn and move the view.
#pragma once

#include <string>

#include "tools/virtual_room/camera.hpp"
#include "tools/virtual_room/room_state.hpp"

namespace room {

struct MouseButtons {
  bool left = false, right = false, middle = false;
  bool fine = false;  ///< whether the hand moves a tenth of the pointer's distance
};

class MouseControl {
 public:
  /// Handles the pointer at this pixel with these buttons down. A drag is handled only if it began inside
  /// `scene`.
  void move(float px, float py, MouseButtons buttons, const Area& scene, Camera& camera, const Snapshot& room,
            const RoomMeasures& measures);
  /// Moves the hand by keys: `right` and `away`, -1, 0 or 1, give 10 mm/s along x and y, a tenth with `fine`.
  /// The hand takes the tool where it is, and holds it until let_go().
  void push(int right, int away, bool fine, double elapsed_s, const Snapshot& room,
            const RoomMeasures& measures);
  /// Turns the block by keys, `left` -1, 0 or 1, at half a radian per second, a tenth with `fine`. The spring
  /// starts without torque, and holds until let_go(). Returns its torque, N m.
  double turn(int left, bool fine, double elapsed_s, const Snapshot& room);
  void let_go();
  /// Handles the wheel: zooms; while the tool is held it raises it, with `control` presses it down. Returns a
  /// message for the person, or nothing.
  std::string turn_wheel(float notches, bool control, Camera& camera, const RoomMeasures& measures);

  /// Returns whether a drag is under way; the panels must then not get the mouse.
  bool busy() const { return drag_ != Drag::none; }
  /// Returns whether the hand changed since the last call.
  bool hand_changed();
  const MouseHand& hand() const { return hand_; }

 private:
  enum class Drag : unsigned char { none, hand, turn, shift, elsewhere };
  void hold(const Ray& ray, bool begins, bool fine, const Snapshot& room, const RoomMeasures& measures);
  void put(double x, double y, const RoomMeasures& measures);

  Drag drag_ = Drag::none;
  MouseHand hand_;
  bool changed_ = false;
  float last_x_ = 0, last_y_ = 0;
  /// m, height of the hand over the floor; a push at this height hardly tips the block.
  double height_ = 0.01;
  bool fine_ = false;
  // m, places of hand and pointer when the drag, or its fine mode, began.
  double anchor_[2] = {0, 0}, pointer_[2] = {0, 0};
};

}  // namespace room
