// Computes errors of a scene's forces, against a converged reference run and against closed forms.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "tools/libraries/accuracy/run.hpp"

namespace cli {

/// Errors of one patch of the scene file, over all its copies and the whole run. Forces are divided by the
/// rms force of the reference run.
struct PatchError {
  double rms = 0.0;     ///< root mean square of the force's difference
  double max = 0.0;     ///< highest force difference at any step
  double energy = 0.0;  ///< relative difference of the work done on the patch, without sign
  double path = 0.0;    ///< largest difference of a body's position from the reference, m
};

/// Reference run against which errors are measured: the mean of finely resolved runs with several seeds, with
/// the standard error of that mean.
class Reference {
 public:
  /// Adds a run to the reference. Runs go alternately to two halves, whose difference gives the standard
  /// error of the mean.
  void add(const ForceRecord& record);
  /// Computes the mean of all runs that were added. Call it after the last add().
  void finish();

  const ForceRecord& mean() const noexcept { return mean_; }
  int runs() const noexcept { return runs_; }
  /// Returns the standard error of the reference's mean force, by patch, over the rms force: half the
  /// difference between the mean forces of the two halves of runs. Smaller errors than this cannot be
  /// measured.
  const std::vector<double>& floor() const noexcept { return floor_; }

 private:
  ForceRecord mean_, other_;
  int runs_ = 0;
  std::vector<double> floor_;
};

/// Returns the errors of a recorded run, by patch. Each of its steps lasts `parts` steps of the reference.
/// Forces at the end of a step are compared with the reference's at that time; with `mean`, forces averaged
/// over a step with the reference's average over it.
std::vector<PatchError> compare(const ForceRecord& record, const ForceRecord& reference, std::uint32_t parts,
                                bool mean);

/// Compares forces with a closed form. It exists for a patch that moves as a ramp under constant load: the
/// loading curve of straight bristles, plus dampers and lubricant. Gives the relative rms difference for each
/// patch; unset without a closed form. `most_parts`, the longest step in steps of the reference, makes the
/// compared times the same for every step length.
class ClosedForm {
 public:
  ClosedForm(const Scene& cut_scene, double reference_dt_s, std::uint32_t most_parts);
  bool any() const noexcept { return !points_.empty(); }
  std::vector<std::optional<double>> compare(const ForceRecord& record, std::uint32_t parts) const;

 private:
  struct Point {
    std::size_t copy, step;  // `step` counts the reference run's steps
    double force[2];
  };
  std::size_t patches_;
  std::vector<Point> points_;
};

}  // namespace cli
