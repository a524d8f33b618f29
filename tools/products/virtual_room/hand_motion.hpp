// The motion of a hand that is known beforehand, from a script, a recording or a motion file, as rows of time
// with position or force.
#pragma once

#include <string>
#include <vector>

#include "tools/products/virtual_room/device.hpp"
#include "tools/products/virtual_room/room_state.hpp"

namespace room {

struct HandRow {
  double t = 0.0;  ///< time of the row, s; rows are in order
  Hand hand;
};

/// Motion of a hand: linear between rows, constant before the first and after the last. Between a row with a
/// position and one without, the earlier row's values last until the later row.
struct HandMotion {
  std::vector<HandRow> rows;
  Hand at(double t) const noexcept;  ///< returns the hand at time t (s), without allocating
  double end() const noexcept { return rows.empty() ? 0.0 : rows.back().t; }
};

/// Reads a recording (columns t,x,y,z,holds,fx,fy,fz,turns,angle in the room's axes), or a motion file of
/// `bristle run` (t,x,y,load; no z): then the tool lies in the middle of the block's top, follows x and y
/// from there, and presses with the load. Throws cli::UserError naming file, line and column.
HandMotion read_hand_file(const std::string& path, const RoomMeasures& measures);

/// Device that plays a known motion. It fails from `lost_at` to `back_at` (s), for tests of how the room
/// bears the loss of a device.
class PlayedHand final : public Device {
 public:
  PlayedHand(const char* name, HandMotion motion, double lost_at = 1e300, double back_at = 1e300)
      : name_(name), motion_(std::move(motion)), lost_at_(lost_at), back_at_(back_at) {}
  const char* name() const noexcept override { return name_; }
  bool read(double time_s, Hand& hand) noexcept override {
    if (time_s >= lost_at_ && time_s < back_at_) return false;
    hand = motion_.at(time_s);
    return true;
  }
  void write(const double (&)[3]) noexcept override {}
  double end() const noexcept { return motion_.end(); }

 private:
  const char* name_;
  HandMotion motion_;
  double lost_at_, back_at_;
};

}  // namespace room
