// Error of a run: against a converged reference, and against closed forms.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "tools/accuracy/run.hpp"

namespace cli {

/// Of one [[patch]] over its copies and the run. Forces relative to the root mean square of the reference's.
struct PatchError {
  double rms = 0.0;     ///< root mean square of the difference of forces
  double max = 0.0;     ///< its highest value
  double energy = 0.0;  ///< work done on the patch: difference over the reference's, absolute
  double path = 0.0;    ///< m, highest difference of positions (bodies)
};

/// Mean over several seeds of a fine run, with the error of that mean.
class Reference {
 public:
  /// Takes one run; every second one belongs to the other half.
  void add(const ForceRecord& record);
  /// After the last one.
  void finish();

  const ForceRecord& mean() const noexcept { return mean_; }
  int runs() const noexcept { return runs_; }
  /// Standard error of the mean, per patch, as rms: half the difference of the means of both halves.
  const std::vector<double>& floor() const noexcept { return floor_; }

 private:
  ForceRecord mean_, other_;
  int runs_ = 0;
  std::vector<double> floor_;
};

/// One error per [[patch]]. A step of `record` is `parts` of the reference's. Ends of steps are compared with
/// the force at that time, means (`mean`) with the reference's mean over the same interval.
std::vector<PatchError> compare(const ForceRecord& record, const ForceRecord& reference, std::uint32_t parts,
                                bool mean);

/// Relative difference, root mean square, between forces at ends of steps and the closed form, per [[patch]]:
/// the virgin curve with dampers and lubricant, where the patch moves as a ramp under a constant load. Unset
/// elsewhere. `most_parts` keeps the times the same for every step length.
class ClosedForm {
 public:
  ClosedForm(const Scene& cut_scene, double reference_dt_s, std::uint32_t most_parts);
  bool any() const noexcept { return !points_.empty(); }
  std::vector<std::optional<double>> compare(const ForceRecord& record, std::uint32_t parts) const;

 private:
  struct Point {
    std::size_t copy, step;  // step of the reference
    double force[2];
  };
  std::size_t patches_;
  std::vector<Point> points_;
};

/// Straight line through points on log-log paper.
struct Slope {
  int points = 0;
  double slope = 0.0;
  double error = 0.0;  ///< standard error; 0 for two points
};
Slope fit_slope(const std::vector<double>& x, const std::vector<double>& y);

}  // namespace cli
