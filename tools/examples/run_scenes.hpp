// Runs scenes of a physics engine with several kinds of friction, which take turns so that their times
// compare: the common part of the scenes for MuJoCo and Bullet.
#pragma once

#include <algorithm>
#include <cmath>
#include <deque>
#include <vector>

#include <bristle/deadline_monitor.hpp>

namespace bristle_example {

/// Run of a scene with one kind of friction.
template <class Friction, class Sample>
struct SceneRun {
  Friction friction{};
  std::vector<Sample> samples;  ///< states of the observed body, at least ten per simulated second
  double creep = 0.0;           ///< mean speed in the last quarter of the run, m/s
  double step_us = 0.0;         ///< CPU time per step, us: median over blocks of steps
  double contacts = 0.0;        ///< mean number of contact points per step
};

/// Runs a scene with all kinds of friction from one start, `sample_s` (s) each in turn. A Stepper is made
/// from a scene and a kind of friction. It has step(), which returns the number of contact points, sample(),
/// creep(), time_step() and its `result`.
template <class Stepper, class Scene, class Friction>
auto run_scene(const Scene& scene, const std::vector<Friction>& kinds, double sample_s) {
  std::deque<Stepper> steppers;
  for (const Friction kind : kinds) steppers.emplace_back(scene, kind);
  const double dt_s = steppers.front().time_step();
  const int block = std::max(1, static_cast<int>(std::lround(sample_s / dt_s)));
  const int blocks = static_cast<int>(std::lround(scene.seconds / (block * dt_s)));
  std::vector<std::vector<double>> times(kinds.size());  // CPU time per step in each block of steps, s
  for (int b = 0; b < blocks; ++b)
    for (std::size_t k = 0; k < kinds.size(); ++k) {
      Stepper& stepper = steppers[k];
      const double before = bristle::DeadlineMonitor::cpu_now();
      for (int i = 0; i < block; ++i) stepper.result.contacts += stepper.step();
      times[k].push_back((bristle::DeadlineMonitor::cpu_now() - before) / block);
      stepper.sample();
    }
  std::vector<decltype(Stepper::result)> runs;
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    auto& run = runs.emplace_back(std::move(steppers[k].result));
    run.friction = kinds[k];
    run.creep = Stepper::creep(run.samples);
    run.contacts /= static_cast<double>(blocks) * block;
    const auto middle = times[k].begin() + static_cast<std::ptrdiff_t>(times[k].size() / 2);
    std::nth_element(times[k].begin(), middle, times[k].end());
    run.step_us = 1e6 * *middle;
  }
  return runs;
}

}  // namespace bristle_example
