// Controls the virtual room by mouse: the left button drags the tool, the others turn and shift the view;
// keys push and turn.
#pragma once

#include <string>

#include "tools/products/virtual_room/camera.hpp"
#include "tools/products/virtual_room/room_state.hpp"

namespace room {

struct MouseButtons {
  bool left = false, right = false, middle = false;
  bool fine = false;  ///< whether the hand moves a tenth of the pointer's path
};

class MouseControl {
 public:
  /// Handles the pointer at a pixel, with the buttons that are down. Ignores a drag that began outside
  /// `scene`.
  void move(float px, float py, MouseButtons buttons, const Area& scene, Camera& camera, const Snapshot& room,
            const RoomMeasures& measures);
  /// Moves the hand by keys: `right` and `away` (-1, 0 or 1) give 10 mm/s along x and y, a tenth with `fine`.
  /// The hand takes hold of the tool where it is, until let_go().
  void push(int right, int away, bool fine, double elapsed_s, const Snapshot& room,
            const RoomMeasures& measures);
  /// Turns the block by keys: `left` (-1, 0 or 1) gives half a radian per second, a tenth with `fine`. A
  /// torsion spring does it, which starts without torque and stays until let_go(). Returns its torque, N m.
  double turn(int left, bool fine, double elapsed_s, const Snapshot& room);
  void let_go();
  /// Handles the wheel: zooms the view or, while the tool is held, raises the tool (with `control`, presses
  /// it down). Returns a message for the user, or "".
  std::string turn_wheel(float notches, bool control, Camera& camera, const RoomMeasures& measures);

  /// Returns whether the mouse is dragging; the panels must not get the mouse then.
  bool busy() const { return drag_ != Drag::none; }
  /// Returns whether the hand has changed since the last call of this function.
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
  /// Height of the hand over the floor, m. It is so low that a push hardly tips the block.
  double height_ = 0.01;
  bool fine_ = false;
  // Positions of hand and pointer on the hand's plane when the drag, or its fine part, began, m.
  double anchor_[2] = {0, 0}, pointer_[2] = {0, 0};
};

}  // namespace room
