// `bristle fit --joint`: the friction of a joint from a log of angle, speed and torques.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <bristle/joint_friction.hpp>

namespace cli {

struct FitOptions;

/// A log in SI units, one number a sample.
struct JointLog {
  std::string name;
  std::vector<double> t, angle, speed, motor, outside;
  bool has_speed = false, has_outside = false;
};

/// Reads t, angle, speed (else by differences), motor (or current, with a torque constant) and outside (else
/// that of a pendulum, or 0). Throws UserError naming file, line and column.
JointLog parse_joint_log(std::string_view text, const std::string& name,
                         std::optional<double> torque_constant, std::optional<double> pendulum);

struct JointEstimate {
  std::string name, unit;
  double value = 0.0;
  double low = 0.0, high = 0.0;  ///< 95 % interval
  bool determined = false;       ///< else the log does not tell it from 0
};

/// A model fitted to a part of a log.
struct JointFit {
  std::string model;
  std::vector<JointEstimate> numbers;
  bristle::JointMaterial material;            ///< of the brush
  double fitted_rms = 0.0, judged_rms = 0.0;  ///< N m, of the part that was fitted to, and of the rest
  bool rigid = false;                         ///< Whether the angles do not show how the brush bends.
  int runs = 0;                               ///< of the model along the log, with its derivatives
};

/// Bristles and spread with which the brush is fitted.
bristle::JointOptions joint_fit_options();

/// Fits the brush to the first `until` seconds.
JointFit fit_joint(const JointLog& log, double until);
/// The brush, Coulomb, Stribeck, LuGre and bam's m3 to m6, each fitted to the first `until` seconds.
std::vector<JointFit> judge_joint(const JointLog& log, double until);

/// The subcommand with --joint. Throws UserError.
void fit_joint_command(const FitOptions& options);

}  // namespace cli
