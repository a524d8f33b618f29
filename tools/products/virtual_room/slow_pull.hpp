// Makes the motion of the program's own hand. It pulls so slowly that one sees the block break away.
#pragma once

#include <cmath>

#include "tools/products/virtual_room/hand_motion.hpp"
#include "tools/products/virtual_room/room_state.hpp"

namespace room {

/// Positions of a hand that moves the block along x. The tool comes to the block from behind and low, so that
/// its push hardly shifts load between the corners; after that its spring pulls.
struct PullPoints {
  /// Time until the hand reaches the block (s), gap before that (m), height of the hand over the floor (m).
  static constexpr double approach = 0.3, gap = 2e-3, height = 1e-3;
  double touching;  ///< position of the tool when it touches the block, m

  /// Path of the hand, m, from `touching` until the force of the spring is the peak of friction. Bristles
  /// bend meanwhile.
  double to_peak;
  double z;

  /// Computes the points of a pull; `peak` is the highest friction of first loading, over load.
  PullPoints(const Settings& s, double peak, const RoomMeasures& m)
      : touching(-0.5 * m.block[0] - m.tool_radius), z(m.tool_radius + height) {
    const double load = load_at_rest(s);
    const double force = peak * load - s.mass * gravity * std::sin(s.slope);
    to_peak = std::fmax(force, 0.1 * load) / std::fmax(s.hand_stiffness, 20.0) + s.presliding_length;
  }
  HandRow at(double t, double x) const { return {t, {true, {x, 0.0, z}, {0, 0, 0}}}; }
};

/// Returns the motion of a slow pull, to begin after a reset. Its force reaches the peak after two seconds
/// and grows for two more; then the hand lets go. `peak` is friction over load.
inline HandMotion slow_pull(const Settings& s, double peak, const RoomMeasures& m) {
  constexpr double to_peak = 2.0;  // time from the reset to the peak of the force, s
  const PullPoints points(s, peak, m);
  HandMotion motion;
  motion.rows = {points.at(0.0, points.touching - points.gap), points.at(points.approach, points.touching),
                 points.at(points.approach + 2.0 * to_peak, points.touching + 2.0 * points.to_peak)};
  HandRow end = motion.rows.back();
  end.t += 0.5;
  motion.rows.push_back(end);
  end.t += 0.01;
  end.hand.holds = false;
  motion.rows.push_back(end);
  return motion;
}

/// Part of the tour, a guided demonstration. After `tour_hand_s` the program's hand has finished, and the
/// scene that compares models begins.
struct TourPart {
  double until_s;    ///< end of the part since the tour began, s
  const char* says;  ///< line of text for the user
};
inline constexpr double tour_hand_s = 13.0, tour_s = 20.0;
inline constexpr TourPart tour_parts[] = {
    {5.0, "A push below the peak: the bristles bend, and the block holds"},
    {8.0, "The hand lets go: the bristles spring back, and the block with them"},
    {tour_hand_s, "A harder push: at the peak the bristles snap, and the block slides"},
    {tour_s, "Tapped on a slope: the brush stays where it is, LuGre and Coulomb creep"}};
inline const char* tour_says(double t) {
  for (const TourPart& part : tour_parts)
    if (t < part.until_s) return part.says;
  return "";
}

/// Returns the motion of the tour's hand: it goes 0.6 of the path to the peak (some 0.8 of its force), waits,
/// lets the block go back, and then pushes through the peak.
inline HandMotion tour_hand(const Settings& s, double peak, const RoomMeasures& m) {
  const PullPoints points(s, peak, m);
  const double away = points.touching - points.gap;
  HandMotion motion;
  motion.rows = {points.at(0.0, away),
                 points.at(0.5, points.touching),
                 points.at(3.0, points.touching + 0.6 * points.to_peak),
                 points.at(5.0, points.touching + 0.6 * points.to_peak),
                 points.at(6.0, away),
                 points.at(8.0, away),
                 points.at(8.3, points.touching),
                 points.at(12.0, points.touching + 2.0 * points.to_peak),
                 points.at(tour_hand_s - 0.1, points.touching + 2.0 * points.to_peak)};
  HandRow end = motion.rows.back();
  end.t = tour_hand_s;
  end.hand.holds = false;
  motion.rows.push_back(end);
  return motion;
}

}  // namespace room
