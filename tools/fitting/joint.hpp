// Fits the friction of a joint to a log of angle, speed and torques: `bristle fit --joint`.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <bristle/joint_friction.hpp>

namespace cli {

struct FitOptions;
struct FitReading;

/// Log of a joint in SI units; every column has one number per sample.
struct JointLog {
  std::string name;
  std::string understood;  ///< sentences on how the file was read
  std::vector<double> t, angle, speed, motor, outside;
  bool has_speed = false, has_outside = false;
};

/// Parses a log by the names and units of `reading`: t, angle, speed (else from differences), motor torque
/// (or current, with a torque constant), and outside torque (else that of a pendulum, or 0). Throws UserError
/// naming file, line and column.
JointLog parse_joint_log(std::string_view text, const std::string& name, const FitReading& reading,
                         std::optional<double> torque_constant, std::optional<double> pendulum);

struct JointEstimate {
  std::string name, unit;
  double value = 0.0;
  double low = 0.0, high = 0.0;  ///< limits of the 95 % interval
  bool determined = false;       ///< whether the log distinguishes the parameter from 0
};

/// Part of a log that a model is fitted to: every second of 24 parts of equal time, or the first seconds.
struct JointPart {
  bool alternate = false;
  /// s, end of the part, if the first seconds are fitted.
  double until = std::numeric_limits<double>::infinity();
};

/// Joint model fitted to a part of a log.
struct JointFit {
  std::string model;
  std::vector<JointEstimate> numbers;
  bristle::JointMaterial material;  ///< material, if the model is the brush

  /// N m, rms error of the torque on the fitted part and on the rest.
  double fitted_rms = 0.0, judged_rms = 0.0;
  bool rigid = false;  ///< whether the angles do not show how the brush bends

  /// Number of runs of the model along the log, those for derivatives included.
  int runs = 0;
};

/// Returns the options of the fitted brush: number of bristles and spread of the law.
bristle::JointOptions joint_fit_options();

/// Fits the brush, by its own derivatives or, to test them, by differences.
JointFit fit_joint(const JointLog& log, JointPart part = {}, bool by_differences = false);
/// Fits the brush, Coulomb, Stribeck, LuGre and the models m3 to m6 of bam (Duclusaud et al. 2025) to one
/// part of a log.
std::vector<JointFit> judge_joint(const JointLog& log, JointPart part);

/// Runs the subcommand with --joint. Throws UserError.
void fit_joint_command(const FitOptions& options);

}  // namespace cli
