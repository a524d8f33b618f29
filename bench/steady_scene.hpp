// Patches in steady motion, prepared for timing; shared by the benchmarks and `bristle capacity`.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include <bristle/patch_batch.hpp>

namespace bristle_bench {

/// Periodic motion that keeps the share of snapping bristles constant.
struct SteadyMotion {
  double step = 0.0;            ///< displacement per step, mean snap lengths
  bool there_and_back = false;  ///< whether every other step goes back, so that patches stay in place
  bool zigzag = false;  ///< whether every other step is perpendicular to the one before (two axes only)
};

/// Motion that brings a scene from rest into its steady motion: `slides` steps of `slide` mean snap lengths,
/// after which the distribution of the deflections is steady, then `moves` steps of the motion itself.
struct Settling {
  double slide;
  int slides, moves;
};

template <class Slide, class Move>
void bring_to_steady_state(const Settling& settling, Slide slide, Move move) {
  for (int i = 0; i < settling.slides; ++i) slide();
  for (int i = 0; i < settling.moves; ++i) move();
}

class SteadyScene {
 public:
  SteadyScene(const bristle::BatchOptions& options, double dt_s, const Settling& settling)
      : batch_(options), dt_s_(dt_s), settling_(settling) {}

  /// Adds a patch that moves along (0.8, 0.6), with `zigzag` across it in every other step, or along x with
  /// one axis, under full load.
  void add(const bristle::Material& material, const bristle::PatchOptions& options,
           const SteadyMotion& steady) {
    const double mean = material.snap_length.mean();
    bristle::Motion motion;
    motion.id = batch_.add(material, options);
    motion.normal_load = options.max_normal_load;
    const auto moved = [&](double lengths) {
      motion.displacement[0] = (options.axes == 1 ? 1.0 : 0.8) * (lengths * mean);
      motion.displacement[1] = (options.axes == 1 ? 0.0 : 0.6) * (lengths * mean);
      return motion;
    };
    sliding_.push_back(moved(settling_.slide));
    motions_[0].push_back(moved(steady.step));
    motions_[1].push_back(moved(steady.there_and_back ? -steady.step : steady.step));
    if (steady.zigzag) {
      double* const d = motions_[1].back().displacement;
      std::swap(d[0], d[1]);
      d[1] = -d[1];
    }
    bristles_ += options.bristles;
  }

  /// Brings all patches into their steady motion. Call it once, after the last add().
  void settle() {
    responses_.resize(motions_[0].size());
    batch_.warm_up();
    bring_to_steady_state(
        settling_, [this] { batch_.step(dt_s_, sliding_, responses_); }, [this] { step(); });
  }

  /// Leaves all patches out of later steps, so that they rest.
  void name_none() {
    for (std::vector<bristle::Motion>& motions : motions_) motions.clear();
    responses_.clear();
  }

  /// Runs one step of the motion, which the caller times.
  bristle::StepReport step() {
    const std::vector<bristle::Motion>& motions = motions_[turn_];
    turn_ ^= 1;
    return batch_.step(dt_s_, motions, responses_);
  }

  std::uint64_t bristles() const { return bristles_; }
  const bristle::PatchBatch& batch() const { return batch_; }
  /// Returns the PatchInfo of the scene's first patch.
  bristle::PatchInfo info() const { return batch_.info(sliding_.front().id); }

 private:
  bristle::PatchBatch batch_;
  double dt_s_;
  Settling settling_;
  /// Motions of all patches, one set for even steps and one for odd steps.
  std::vector<bristle::Motion> sliding_, motions_[2];
  std::vector<bristle::Response> responses_;
  std::uint64_t bristles_ = 0;
  int turn_ = 0;
};

}  // namespace bristle_bench
