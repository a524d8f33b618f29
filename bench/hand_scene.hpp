// Scene of a patch that moves as a hand does (turns, strokes, a rippling load), for `bristle capacity`.
#pragma once

#include <cmath>
#include <random>

#include <bristle/patch_batch.hpp>

namespace bristle_bench {

/// Path and load of a patch that a hand moves.
struct HandPath {
  const char* name;
  double turn, wander;  ///< turn of the direction, rad per step: steady part, random part
  int stroke;           ///< number of steps after which the path reverses; 0 = never
  double ripple;        ///< amplitude of the load's swing over its mean; its period is 20 steps
};
constexpr HandPath straight_path = {"straight", 0.0, 0.0, 0, 0.0};
constexpr HandPath hand_paths[] = {straight_path,
                                   {"slow_turn", 0.02, 0.0, 0, 0.0},
                                   {"turn_0.3", 0.3, 0.0, 0, 0.0},
                                   {"random_turn", 0.0, 0.1, 0, 0.0},
                                   {"strokes", 0.0, 0.0, 50, 0.0},
                                   {"ripple", 0.0, 0.0, 0, 0.1}};

/// Patch of 10,000 representatives that moves as a hand does, at 1 kHz.
class HandScene {
 public:
  HandScene(const bristle::Material& material, const HandPath& path, double mm_per_s,
            const bristle::BatchOptions& options = {})
      : batch_(options), path_(path), step_m_(mm_per_s * 1e-3 * tick_s) {
    motion_.id = batch_.add(material, bristle::PatchOptions{}.with_bristles(bristles).with_axes(2));
    batch_.warm_up();
    for (int k = 0; k < 100; ++k) step();
  }

  bristle::StepReport step() {
    ++steps_;
    heading_ += path_.turn + path_.wander * normal_(random_);
    if (path_.stroke > 0 && steps_ % path_.stroke == 0) heading_ += pi;
    motion_.displacement[0] = step_m_ * std::cos(heading_);
    motion_.displacement[1] = step_m_ * std::sin(heading_);
    motion_.normal_load = (1.0 + path_.ripple * std::sin(pi * steps_ / 10.0)) / (1.0 + path_.ripple);
    return batch_.step(tick_s, {&motion_, 1}, {&response_, 1});
  }

  static constexpr std::uint32_t bristles = 10000;

 private:
  static constexpr double pi = 3.141592653589793, tick_s = 1e-3;
  bristle::PatchBatch batch_;
  HandPath path_;
  double step_m_;
  bristle::Motion motion_;
  bristle::Response response_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  double heading_ = 0.0;
  int steps_ = 0;
};

}  // namespace bristle_bench
