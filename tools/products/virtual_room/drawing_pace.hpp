// Chooses how much of the room is drawn, so that the haptic loop gets its time where OpenGL is slow.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

namespace room {

struct Drawing {
  bool shadows = true;
  bool half_resolution = false;  ///< whether the room, not its panels, has half resolution
  double period_s = 1.0 / 60;    ///< shortest time from one picture to the next, s
  const char* says = "";         ///< tells the user what is left out
};

/// Chooses a level of drawing by the time that pictures take. Tries a level that turned out too slow again,
/// but ever more rarely.
class DrawingPace {
 public:
  static constexpr std::array<Drawing, 4> levels = {
      {{true, false, 1.0 / 60, ""},
       {false, false, 1.0 / 60, "no shadows"},
       {false, true, 1.0 / 60, "no shadows, half resolution"},
       {false, true, 1.0 / 15, "no shadows, half resolution, at most 15 pictures a second"}}};
  /// Time of a picture above which the next plainer level is drawn, and below which a richer one may be, s.
  static constexpr double too_slow_s = 0.04, fast_s = 0.02;

  const Drawing& now() const noexcept { return levels[level_]; }

  /// Takes in the time of a picture (s), and the share of real time at which the simulation ran meanwhile (1
  /// if unknown). Call it for every picture; `t` is the present time, s.
  void take(double t, double picture_s, double share) noexcept {
    mean_s_ = count_ == 0 ? picture_s : mean_s_ + 0.1 * (picture_s - mean_s_);
    mean_share_ = count_ == 0 ? share : mean_share_ + 0.1 * (share - mean_share_);
    if (count_++ == 0) since_ = t;
    const double lasted = t - since_;
    if (count_ >= 8 && lasted >= 1.0 && level_ + 1 < levels.size() &&
        (mean_s_ > too_slow_s || mean_share_ < 0.85)) {
      if (tried_ && lasted < 10.0) wait_s_ = std::min(2.0 * wait_s_, 600.0);
      change(level_ + 1, false);
    } else if (level_ > 0 && lasted >= wait_s_ && mean_s_ < fast_s && mean_share_ > 0.97) {
      change(level_ - 1, true);
    }
  }

 private:
  void change(std::size_t level, bool tried) noexcept {
    level_ = level;
    tried_ = tried;
    count_ = 0;
  }

  std::size_t level_ = 0;
  long count_ = 0;      ///< number of pictures drawn at this level
  bool tried_ = false;  ///< whether this level follows a plainer one
  double mean_s_ = 0.0, mean_share_ = 1.0, since_ = 0.0, wait_s_ = 5.0;
};

}  // namespace room
