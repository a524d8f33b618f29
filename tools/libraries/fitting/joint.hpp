// Fits the friction of a geared joint to a log of angle, speed and torques: `bristle fit --joint`.
#pragma once

#include <algorithm>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <bristle/joint_friction.hpp>

namespace cli {

struct FitOptions;
struct FitReading;

/// Log of a joint's motion and torques, in SI units. Every column has one number per sample.
struct JointLog {
  std::string name;
  std::string understood;  ///< sentences that tell how the file was understood
  std::vector<double> t, angle, speed, motor, outside;
  std::vector<double> temperature;  ///< degrees; empty if not logged
  bool has_speed = false, has_outside = false;
  std::vector<std::size_t> parts;  ///< for joined logs, the first sample of each but the first

  /// Returns whether sample k is the first one of a log, so that the motion since the sample before it is
  /// unknown.
  bool begins(std::size_t k) const { return std::find(parts.begin(), parts.end(), k) != parts.end(); }
};

/// Appends another log of the same joint, a second behind the end of the first.
void append(JointLog& log, const JointLog& more);

/// Returns the play (backlash) of a joint of known inertia, rad: the median path after a reversal of the
/// motion on which friction is nearly absent, before it sets in; 0 if friction sets in at once, or steadily
/// as a spring bends.
double joint_play(const JointLog& log, double inertia);

/// Returns a log of at most `most` samples: pieces of equal length, evenly spread over a longer log.
JointLog pieces_of(JointLog log, std::size_t most);

/// Parses a log of a joint, with the names and units of `reading`. Columns: t, angle, speed (otherwise from
/// differences), motor torque (or current, with the torque constant), and outside torque (or that of a
/// pendulum; otherwise 0). Throws UserError that names file, line and column.
JointLog parse_joint_log(std::string_view text, const std::string& name, const FitReading& reading,
                         std::optional<double> torque_constant, std::optional<double> pendulum);

struct JointEstimate {
  std::string name, unit;
  double value = 0.0;
  double low = 0.0, high = 0.0;  ///< limits of the parameter's 95 % interval
  bool determined = false;       ///< whether the log distinguishes the parameter from 0
};

/// Part of a log to which models are fitted: its first seconds, or every second one of 24 parts of equal
/// time.
struct JointPart {
  bool alternate = false;
  /// End of the fitted part, s after the start, where the first seconds are fitted.
  double until = std::numeric_limits<double>::infinity();
};

/// Friction model of a joint, fitted to a part of a log.
struct JointFit {
  std::string model;
  std::vector<JointEstimate> numbers;
  bristle::JointMaterial material;  ///< fitted material, if the model is the brush

  /// Rms error of the torque, N m, on the fitted part of the log and on the rest.
  double fitted_rms = 0.0, judged_rms = 0.0;
  bool rigid = false;  ///< whether the angles are too coarse to show how the brush bends
  bool loaded =
      false;  ///< whether the outside torque varies by itself, so that shares of torques can be told
  double criterion = 0.0;  ///< information criterion of the fit; lower is better
  double count = 0.0;      ///< number of independent blocks that were fitted
  /// Relative changes of dry and of viscous friction per degree, if the temperature was logged; the other
  /// numbers then hold at the log's mean temperature.
  std::vector<JointEstimate> warming;

  /// Number of times that the friction model was run along the log, including runs for derivatives.
  int runs = 0;
};

/// Returns the options with which the brush of a joint is fitted: number of bristles, spread of their limits.
bristle::JointOptions joint_fit_options();

/// Fits the brush to a part of a joint's log. `by_differences`: computes derivatives by differences instead
/// of the library's, to test the library's.
JointFit fit_joint(const JointLog& log, JointPart part = {}, bool by_differences = false);
/// Fits the brush, Coulomb, Stribeck, LuGre and the models m3 to m6 of bam (Duclusaud et al. 2025) to a part
/// of a joint's log, and computes their errors on the rest.
std::vector<JointFit> judge_joint(const JointLog& log, JointPart part);

/// Runs the command `bristle fit --joint`. Throws UserError.
void fit_joint_command(const FitOptions& options);

}  // namespace cli
