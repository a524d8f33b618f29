// A brush of many bristles that can be brought into steady sliding, and the sampling error of its mean
// deflection.
#pragma once

#include <cmath>
#include <vector>

#include "reference_table.hpp"
#include "scenes.hpp"
#include "statistics.hpp"

namespace bristle_test {

struct Deflection {
  double x = 0.0;
  double y = 0.0;
};

/// Mean deflection, in mean snap lengths, of one patch of n bristles. With a single snap length all bristles
/// that start together stay in step for ever. Steady sliding is then the average over their phase, taken over
/// `phases` patches of one bristle that start spread over a snap length.
class SteadyBrush {
 public:
  static constexpr int phases = 500;

  SteadyBrush(const SnapLength& law, SnapRule rule, std::uint32_t n, int axes, Precision precision,
              bool steady)
      : single_(law.law() == bristle::SnapLaw::single), rule_(rule), load_(single_ ? 1.0 : n) {
    const int patches = single_ && steady ? phases : 1;
    ids_ = add_patches(batch_, patches, plain_material(law, rule),
                       plain_options(single_ ? 1u : n, axes, precision, Outputs::end));
    bristles_ = load_ * patches;
    move({});
  }

  /// Slides all bristles along the unit vector (ex, ey) from rest to steady sliding; patches of single
  /// bristles slide by lengths spread over one snap length.
  void slide_to_steady(double ex, double ey) {
    if (single_) {
      std::vector<Motion> motions = same_motion(ids_, 0.0, 0.0, load_);
      for (std::size_t i = 0; i < motions.size(); ++i) {
        const double slide =
            dbar * (3.0 + (static_cast<double>(i) + 0.5) / static_cast<double>(motions.size()));
        motions[i].displacement[0] = slide * ex;
        motions[i].displacement[1] = slide * ey;
      }
      move(motions);
    } else if (rule_ == SnapRule::keep) {
      // Takes one far step, because the phases of bristles of nearly equal lengths separate slowly.
      step(1000.37 * ex, 1000.37 * ey);
    } else {
      // Takes small steps, none of which jumps many snaps. At a cv of the law of 0.29, the memory of the
      // start has decayed to 1e-6 after 9 mean lengths.
      for (int k = 0; k < 60; ++k) step(0.83 * ex, 0.83 * ey);
    }
  }

  /// Moves by (dx, dy) mean snap lengths. Returns the mean deflection after the step.
  Deflection step(double dx, double dy) { return move(same_motion(ids_, dx * dbar, dy * dbar, load_)); }

  bool single() const { return single_; }

 private:
  Deflection move(const std::vector<Motion>& given) {
    const std::vector<Motion> motions = given.empty() ? same_motion(ids_, 0.0, 0.0, load_) : given;
    std::vector<Response> responses(motions.size());
    batch_.step(tick, motions, responses);
    Deflection sum;
    for (const Response& r : responses) {
      sum.x -= r.elastic[0];
      sum.y -= r.elastic[1];
    }
    return {sum.x / (bristles_ * dbar), sum.y / (bristles_ * dbar)};
  }

  PatchBatch batch_;
  std::vector<PatchId> ids_;
  bool single_;
  SnapRule rule_;
  double load_;
  double bristles_ = 0.0;
};

/// Number of bristles of the simulations that made the reference tables; with the tables' standard errors it
/// gives the variance of one bristle.
constexpr double monte_carlo_bristles = 2e6;

/// Returns the allowed error of the mean deflection (in mean snap lengths) of n bristles: from a table row's
/// standard error, plus the error of float, 2^-24 of a length per rewrite and per comparison, over some
/// hundred steps.
inline double sampling_tolerance(double mc_se, double n, Precision precision) {
  const double rounding = precision == Precision::single ? 1e-5 : 1e-10;
  return sigmas * mc_se * std::sqrt(monte_carlo_bristles / n) + rounding;
}

}  // namespace bristle_test
