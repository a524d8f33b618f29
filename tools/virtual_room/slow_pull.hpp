// Makes the motion of the room's own hand, which pulls slowly enough to show the block break away.
#pragma once

#include <cmath>

#include "tools/virtual_room/hand_motion.hpp"
#include "tools/virtual_room/room_state.hpp"

namespace room {

/// Returns the slow pull, from the reset on. The tool comes to the block from behind, low, so that the push
/// hardly shifts load between the corners; then its spring pulls, so that the force reaches the peak after
/// two seconds, and continues as long again. At the end the hand lets go. `peak` and `kinetic`: friction over
/// load.
inline HandMotion slow_pull(const Settings& s, double peak, const RoomMeasures& m) {
  constexpr double gravity = 9.80665, approach = 0.3, to_peak = 2.0, gap = 2e-3, height = 1e-3;  // m, s
  const double load = s.mass * gravity * std::cos(s.slope) + s.extra_load;
  const double force = peak * load - s.mass * gravity * std::sin(s.slope);
  const double stiffness = std::fmax(s.hand_stiffness, 20.0);
  // Adds the distance that the block moves while its bristles bend.
  const double way = std::fmax(force, 0.1 * load) / stiffness + s.presliding_length;
  const double touching = -0.5 * m.block[0] - m.tool_radius;
  const auto at = [&](double t, double x) {
    return HandRow{t, {true, {x, 0.0, m.tool_radius + height}, {0, 0, 0}}};
  };
  HandMotion motion;
  motion.rows = {at(0.0, touching - gap), at(approach, touching),
                 at(approach + 2.0 * to_peak, touching + 2.0 * way)};
  HandRow end = motion.rows.back();
  end.t += 0.5;
  motion.rows.push_back(end);
  end.t += 0.01;
  end.hand.holds = false;
  motion.rows.push_back(end);
  return motion;
}

}  // namespace room
