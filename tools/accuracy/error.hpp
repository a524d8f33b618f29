// Computes the error of a run against a converged reference and against closed forms.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "tools/accuracy/run.hpp"

namespace cli {

/// Errors of one [[patch]], over all its copies and the whole run. Forces are divided by the rms force of the
/// reference.
struct PatchError {
  double rms = 0.0;     ///< root mean square of the force difference
  double max = 0.0;     ///< highest force difference
  double energy = 0.0;  ///< absolute value of the relative difference of the work done on the patch
  double path = 0.0;    ///< m, largest difference of a body's position from the reference
};

/// Reference that errors are measured against: the mean of fine runs with several seeds, and the standard
/// error of that mean.
class Reference {
 public:
  /// Adds a run. Runs go alternately to two halves, whose difference tells the error of the mean.
  void add(const ForceRecord& record);
  /// Computes the means of all added runs. Call it after the last one.
  void finish();

  const ForceRecord& mean() const noexcept { return mean_; }
  int runs() const noexcept { return runs_; }
  /// Returns the standard error of the mean force (rms, per patch): half the difference between the means of
  /// the two halves.
  const std::vector<double>& floor() const noexcept { return floor_; }

 private:
  ForceRecord mean_, other_;
  int runs_ = 0;
  std::vector<double> floor_;
};

/// Returns the error of `record` per [[patch]]. Each of its steps spans `parts` steps of the reference.
/// Forces at the end of a step are compared with the reference's force at that time; mean forces (`mean`),
/// with the reference's mean over that step.
std::vector<PatchError> compare(const ForceRecord& record, const ForceRecord& reference, std::uint32_t parts,
                                bool mean);

/// Compares forces with a closed form, which exists for a patch that moves as a ramp under constant load: the
/// loading curve of straight bristles, plus dampers and lubricant. Gives the relative rms difference at ends
/// of steps, per [[patch]]; unset without a closed form. `most_parts` keeps the compared times equal for
/// every step length.
class ClosedForm {
 public:
  ClosedForm(const Scene& cut_scene, double reference_dt_s, std::uint32_t most_parts);
  bool any() const noexcept { return !points_.empty(); }
  std::vector<std::optional<double>> compare(const ForceRecord& record, std::uint32_t parts) const;

 private:
  struct Point {
    std::size_t copy, step;  // `step` counts steps of the reference
    double force[2];
  };
  std::size_t patches_;
  std::vector<Point> points_;
};

/// Straight line fitted through points on log-log axes.
struct Slope {
  int points = 0;
  double slope = 0.0;
  double error = 0.0;  ///< standard error of the line's slope; 0 for two points
};
Slope fit_slope(const std::vector<double>& x, const std::vector<double>& y);

}  // namespace cli
