// Computes the error of a run against a converged reference and against closed forms.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "tools/accuracy/run.hpp"

namespace cli {

/// Error of one [[patch]] over its copies and the run. Forces are relative to the rms of the reference's.
struct PatchError {
  double rms = 0.0;     ///< root mean square difference of forces
  double max = 0.0;     ///< highest difference of forces
  double energy = 0.0;  ///< relative difference of the work done on the patch, absolute value
  double path = 0.0;    ///< m, highest difference of positions (bodies)
};

/// Reference: mean over several seeds of a fine run, with the error of that mean.
class Reference {
 public:
  /// Adds a run; runs go alternately to two halves.
  void add(const ForceRecord& record);
  /// Computes the means. Call it after the last run.
  void finish();

  const ForceRecord& mean() const noexcept { return mean_; }
  int runs() const noexcept { return runs_; }
  /// Returns the standard error of the mean as rms per patch: half the difference of the two halves' means.
  const std::vector<double>& floor() const noexcept { return floor_; }

 private:
  ForceRecord mean_, other_;
  int runs_ = 0;
  std::vector<double> floor_;
};

/// Returns an error per [[patch]]. A step of `record` is `parts` reference steps. Forces at the end of steps
/// are compared with the force at that time; means (`mean`) with the reference's mean over the same interval.
std::vector<PatchError> compare(const ForceRecord& record, const ForceRecord& reference, std::uint32_t parts,
                                bool mean);

/// Comparison with the closed form, per [[patch]]: relative rms difference of forces at ends of steps from
/// the virgin curve with dampers and lubricant, if the patch moves as a ramp under a constant load; else
/// unset. `most_parts` keeps the compared times the same for every step length.
class ClosedForm {
 public:
  ClosedForm(const Scene& cut_scene, double reference_dt_s, std::uint32_t most_parts);
  bool any() const noexcept { return !points_.empty(); }
  std::vector<std::optional<double>> compare(const ForceRecord& record, std::uint32_t parts) const;

 private:
  struct Point {
    std::size_t copy, step;  // `step`: step of the reference
    double force[2];
  };
  std::size_t patches_;
  std::vector<Point> points_;
};

/// Straight line fitted through points on log-log axes.
struct Slope {
  int points = 0;
  double slope = 0.0;
  double error = 0.0;  ///< standard error; 0 for two points
};
Slope fit_slope(const std::vector<double>& x, const std::vector<double>& y);

}  // namespace cli
