// Patches in steady motion, brought there before they are timed; for the benchmarks and `bristle capacity`.
#pragma once

#include <complex>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

#include <bristle/patch_batch.hpp>

#include "core/runtime/visit_all.hpp"

namespace bristle_bench {

/// Periodic motion in which the share of bristles that snap in a step stays the same.
struct SteadyMotion {
  double step = 0.0;            ///< displacement per step, mean snap lengths
  bool there_and_back = false;  ///< whether every other step goes back, so that patches stay in place
  bool zigzag = false;  ///< whether every other step is perpendicular to the one before (two axes only)
};

/// Motion that brings a scene from rest into its steady motion: `slides` steps of `slide` mean snap lengths,
/// which make the distribution of the deflections steady, then `moves` steps of the motion itself.
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
  /// Makes an empty scene. `eager`: steps visit every bristle, even where none can snap, to measure what
  /// skipping saves.
  SteadyScene(const bristle::BatchOptions& options, double dt_s, const Settling& settling, bool eager = false)
      : batch_(options), dt_s_(dt_s), settling_(settling) {
    if (eager) bristle::detail::visit_all(batch_);
  }

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
    // Lets each patch slide by another length. Otherwise all of them would merge cohorts in the same steps,
    // and times would jump.
    sliding_.push_back(moved(settling_.slide * (1.0 + 0.05 * static_cast<double>(sliding_.size() % 8))));
    motions_[0].push_back(moved(steady.step));
    motions_[1].push_back(moved(steady.there_and_back ? -steady.step : steady.step));
    if (steady.zigzag) {
      double* const d = motions_[1].back().displacement;
      std::swap(d[0], d[1]);
      d[1] = -d[1];
    }
    bristles_ += options.bristles;
  }

  /// Turns the direction of each patch, which moves one way, by `turn` rad in each step: to the left, or to
  /// either side at random. Lowers its load by a random share from 0 to `ripple`. Call it before settle().
  void vary(double turn, bool either_side, double ripple) {
    varied_ = turn != 0.0 || ripple != 0.0;
    turn_ = std::polar(1.0, turn);
    either_side_ = either_side;
    share_ = std::uniform_real_distribution<double>(1.0 - ripple, 1.0);
  }

  /// Brings all patches into their steady motion. Call it once, after the last add().
  void settle() {
    responses_.resize(motions_[0].size());
    batch_.warm_up();
    bring_to_steady_state(
        settling_, [this] { batch_.step(dt_s_, sliding_, responses_); }, [this] { step(); });
  }

  /// Runs one step of the steady motion. The caller times this call, so it does nothing else.
  bristle::StepReport step() { return batch_.step(dt_s_, next_motions(), responses_); }

  /// Calls find_force for the next motion of each patch, one by one, and passes each response to `use`.
  template <class Use>
  void find_forces(const Use& use) {
    for (const bristle::Motion& motion : next_motions()) use(batch_.find_force(dt_s_, motion));
  }

  std::uint64_t bristles() const { return bristles_; }
  const bristle::PatchBatch& batch() const { return batch_; }
  /// Returns size and state (PatchInfo) of the scene's first patch, for a benchmark's counters.
  bristle::PatchInfo info() const { return batch_.info(sliding_.front().id); }

 private:
  const std::vector<bristle::Motion>& next_motions() {
    std::vector<bristle::Motion>& motions = motions_[odd_];
    if (varied_)
      set_next(motions);
    else
      odd_ ^= 1;
    return motions;
  }

  void set_next(std::vector<bristle::Motion>& motions) {
    for (std::size_t i = 0; i < motions.size(); ++i) {
      double* const d = motions[i].displacement;
      const bool right = either_side_ && random_() % 1024 < 512;
      const auto turned = (right ? std::conj(turn_) : turn_) * std::complex<double>(d[0], d[1]);
      d[0] = turned.real();
      d[1] = turned.imag();
      motions[i].normal_load = share_(random_) * sliding_[i].normal_load;
    }
  }

  bristle::PatchBatch batch_;
  double dt_s_;
  Settling settling_;
  /// Motions of all patches; `motions_` has one set for even steps and one for odd steps.
  std::vector<bristle::Motion> sliding_, motions_[2];
  std::vector<bristle::Response> responses_;
  std::uint64_t bristles_ = 0;
  int odd_ = 0;
  bool varied_ = false, either_side_ = false;
  std::complex<double> turn_ = 1.0;
  std::uniform_real_distribution<double> share_{1.0, 1.0};
  std::minstd_rand random_;
};

}  // namespace bristle_bench
