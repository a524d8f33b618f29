// `bristle fit --joint`: the friction of a joint from a log of angle, speed and torques.
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

/// A log in SI units, one number a sample.
struct JointLog {
  std::string name;
  std::string understood;  ///< how the file was read
  std::vector<double> t, angle, speed, motor, outside;
  bool has_speed = false, has_outside = false;
};

/// Reads t, angle, speed (else by differences), motor (or current, with a torque constant) and outside (else
/// that of a pendulum, or 0), by the names and units of `reading`. Throws UserError naming file, line and
/// column.
JointLog parse_joint_log(std::string_view text, const std::string& name, const FitReading& reading,
                         std::optional<double> torque_constant, std::optional<double> pendulum);

struct JointEstimate {
  std::string name, unit;
  double value = 0.0;
  double low = 0.0, high = 0.0;  ///< 95 % interval
  bool determined = false;       ///< else the log does not tell it from 0
};

/// The part of a log that is fitted to: every second of 24 parts of equal time, or the first seconds.
struct JointPart {
  bool alternate = false;
  double until = std::numeric_limits<double>::infinity();  ///< s
};

/// A model fitted to a part of a log.
struct JointFit {
  std::string model;
  std::vector<JointEstimate> numbers;
  bristle::JointMaterial material;            ///< of the brush
  double fitted_rms = 0.0, judged_rms = 0.0;  ///< N m, of the part that was fitted to, and of the rest
  bool rigid = false;                         ///< Whether the angles do not show how the brush bends.
  int runs = 0;                               ///< of the model along the log, those for differences included
};

/// Bristles and spread with which the brush is fitted.
bristle::JointOptions joint_fit_options();

/// Fits the brush, by its own derivatives or, to judge them, by differences.
JointFit fit_joint(const JointLog& log, JointPart part = {}, bool by_differences = false);
/// The brush, Coulomb, Stribeck, LuGre and bam's m3 to m6, each fitted to that part.
std::vector<JointFit> judge_joint(const JointLog& log, JointPart part);

/// The subcommand with --joint. Throws UserError.
void fit_joint_command(const FitOptions& options);

}  // namespace cli
