// The scenes that compare blocks: which blocks there are, what moves them, and which figure is shown for
// each.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "tools/products/virtual_room/room_state.hpp"

namespace room {

struct ComparedScene {
  const char* name;  ///< name on the scene's button
  const char* key;   ///< name in scripts
  const char* says;
  std::size_t beside;  ///< number of blocks besides the first one
  bool driven;         ///< whether a carriage on rails moves all blocks
  const char* names[1 + most_compared];
};
inline constexpr std::array<ComparedScene, 5> compared_scenes = {{
    {"Level floor", "no", "one block, and your hand", 0, false, {"", "", ""}},
    {"Models, tapped",
     "models",
     "brush, LuGre and Coulomb on a tapped slope: which one creeps?",
     2,
     false,
     {"brush", "LuGre", "Coulomb"}},
    {"Rubbing",
     "rubbing",
     "strokes 2.5 bristle lengths wide: the default's loop closes on itself, the paper's law hardens",
     1,
     true,
     {"default law", "the paper's law", ""}},
    {"Slide, hold, slide",
     "rest",
     "longer and longer rests: static friction grows where bristles age",
     2,
     true,
     {"brush that ages", "brush", "LuGre"}},
    {"Ratchet, tapped",
     "ratchet",
     "a floor with a nap (velvet, skis, scales) and one without, tapped to and fro: which block walks?",
     1,
     false,
     {"on the nap", "no nap", ""}},
}};
inline const ComparedScene& scene_of(Comparison which) {
  return compared_scenes[std::min(static_cast<std::size_t>(which), compared_scenes.size() - 1)];
}

/// Returns the settings of compared block number i, which stands beside the first block; `s` are the settings
/// of the first.
inline Settings settings_beside(const Settings& s, std::size_t i) {
  Settings other = s;
  switch (s.compare) {
    case Comparison::none:
      break;
    case Comparison::models:
      other.model = i == 0 ? FrictionModel::lugre : FrictionModel::coulomb;
      break;
    case Comparison::rubbing:
      other.residual_share = other.shared_renewal = 0.0;
      break;
    case Comparison::rest:
      other.growth_per_decade = 0.0;
      if (i == 1) other.model = FrictionModel::lugre;
      break;
    case Comparison::ratchet:
      other.nap = 1.0;
      break;
  }
  return other;
}

// Motion of the carriage that moves the compared blocks.

/// Cycles of the carriage per second in the rubbing scene, and their amplitude in presliding lengths.
inline constexpr double rubbing_per_s = 4.0, rubbing_amplitude = 1.25;
/// Durations (s) of the rests between slides of one second each, in the scene of rests. After the last slide
/// the sequence repeats in the other direction.
inline constexpr std::array<double, 5> rests_s = {0.1, 0.3, 1.0, 3.0, 10.0};
inline constexpr double slide_speed = 8e-3, slide_lasts = 1.0;  ///< speed (m/s) and duration (s) of a slide

struct RestPhase {
  double position = 0.0;  ///< position of the carriage that moves the blocks, m
  bool slides = false;
  double rested = 0.0;  ///< duration of the rest before this slide or, at rest, of this rest, s
};
inline RestPhase rest_phase(double t) {
  double once = slide_lasts;
  for (const double rest : rests_s) once += rest + slide_lasts;
  const double times = std::floor(t / once);
  const bool back = std::fmod(times, 2.0) != 0.0;
  double left = t - times * once;
  const double far = slide_speed * slide_lasts * static_cast<double>(rests_s.size() + 1);
  RestPhase phase;
  for (std::size_t i = 0; i <= rests_s.size(); ++i) {
    const double slid = std::min(left, slide_lasts);
    phase.position += slide_speed * slid;
    if ((left -= slide_lasts) < 0.0 || i == rests_s.size()) {
      phase.slides = true;
      phase.rested = i == 0 ? 0.0 : rests_s[i - 1];
      break;
    }
    if ((left -= rests_s[i]) < 0.0) {
      phase.rested = rests_s[i];
      break;
    }
  }
  if (back) phase.position = far - phase.position;
  return phase;
}

/// Returns the position of the carriage (m along x, from the middle of the floor) at time t.
inline double carriage_position(const Settings& s, double t) {
  constexpr double turn = 2.0 * 3.14159265358979323846;
  if (s.compare == Comparison::rubbing)
    return rubbing_amplitude * s.presliding_length * std::sin(turn * rubbing_per_s * t);
  return s.compare == Comparison::rest ? rest_phase(t).position : 0.0;
}

/// Period of a pair of taps on the block, one down the slope and one up, s.
inline constexpr double tap_pair = 0.5;

// Figures that are shown for each compared block.

/// Measures how far a block creeps on a tapped slope. The block swings under the taps, so its position is
/// averaged over pairs of taps.
class Moved {
 public:
  static constexpr double settles = 6.0;  ///< time for the block to settle before creep is counted, s

  /// Restarts the measurement of creep at the time `time_s`. Call it after the user has moved the block,
  /// because that motion is no creep.
  void begin(double time_s = 0.0) noexcept {
    *this = {};
    since_ = time_s;
  }
  /// Adds the block's position down the slope (m) at a tick. Call it every tick.
  void take(double time_s, double x) noexcept {
    const double pair = std::floor(time_s / tap_pair);
    if (pair != pair_) {
      if (count_ > 0.0) {  // a pair of taps has ended: takes its mean position
        const double position = sum_ / count_;
        if (pair_ * tap_pair >= since_ + settles && begun_) {
          moved_ = position - from_;
        } else {
          from_ = position;
          begun_ = true;
        }
      }
      pair_ = pair;
      sum_ = count_ = 0.0;
    }
    sum_ += x;
    count_ += 1.0;
  }
  /// Returns the creep (m) since the measurement began; NaN before that.
  double metres() const noexcept { return moved_; }

 private:
  double pair_ = -1.0, sum_ = 0.0, count_ = 0.0, from_ = 0.0, since_ = 0.0;
  double moved_ = std::numeric_limits<double>::quiet_NaN();
  bool begun_ = false;
};

/// Measures the highest friction of a block that a carriage moves, which is the strength of its contact.
class Strength {
 public:
  void begin() noexcept { *this = {}; }
  /// Takes the friction (N, along x) of a tick into account. Call it every tick.
  void take(Comparison scene, double t, double friction) noexcept {
    const double size = std::fabs(friction);
    if (scene == Comparison::rubbing) {
      const double cycle = std::floor(t * rubbing_per_s);
      if (cycle != part_) {
        if (part_ == 0.0) first_ = highest_;
        newton_ = highest_;
        part_ = cycle;
        highest_ = 0.0;
      }
      highest_ = std::fmax(highest_, size);
    } else if (scene == Comparison::rest) {
      const RestPhase phase = rest_phase(t);
      if (!phase.slides || phase.rested == 0.0) return;
      if (phase.rested != part_) {
        part_ = phase.rested;
        highest_ = 0.0;
      }
      newton_ = highest_ = std::fmax(highest_, size);
    }
  }
  /// Returns the strength (N). In the rubbing scene it is the highest friction of the last whole cycle; in
  /// the scene of rests, that of the slide after the last rest. 0: none yet.
  double newton() const noexcept { return newton_; }
  /// Returns the second figure, shown beside newton(). In the rubbing scene it is newton() over its value in
  /// the first cycle; in the scene of rests, the duration of the rest, s.
  double beside(Comparison scene) const noexcept {
    if (scene == Comparison::rubbing) return first_ > 0.0 ? newton_ / first_ : 0.0;
    return part_;
  }

 private:
  double part_ = 0.0, highest_ = 0.0, newton_ = 0.0, first_ = 0.0;
};

}  // namespace room
