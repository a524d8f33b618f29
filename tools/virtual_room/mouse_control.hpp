// Control by the mouse: the left button holds the tool, the others turn and move the view.
#pragma once

#include <string>

#include "tools/virtual_room/camera.hpp"
#include "tools/virtual_room/room_state.hpp"

namespace room {

struct MouseButtons {
  bool left = false, right = false, middle = false;
  bool fine = false;  ///< the hand goes a tenth of the pointer's way
};

class MouseControl {
 public:
  /// The pointer is at this pixel with these buttons down. A drag belongs to where it began: `scene`, or not
  /// to us.
  void move(float px, float py, MouseButtons buttons, const Area& scene, Camera& camera, const Snapshot& room,
            const RoomMeasures& measures);
  /// Keys that push: `right` and `away`, -1, 0 or 1, move the hand at 10 mm/s along x and y, `fine` at a
  /// tenth. It takes the tool where that is, and holds on until let_go().
  void push(int right, int away, bool fine, double elapsed_s, const Snapshot& room,
            const RoomMeasures& measures);
  void let_go();
  /// Zooms; while the tool is held raises it, with `control` presses it down. Returns what to tell the
  /// person, or nothing.
  std::string turn_wheel(float notches, bool control, Camera& camera, const RoomMeasures& measures);

  /// A drag is under way: the panels must not see it.
  bool busy() const { return drag_ != Drag::none; }
  /// True once after the hand changed.
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
  double height_ = 0.01;  ///< m, of the hand over the floor: a low push hardly tips the block
  bool fine_ = false;
  double anchor_[2] = {0, 0},
         pointer_[2] = {0, 0};  // m: hand and pointer where the drag or its fineness began
};

}  // namespace room
