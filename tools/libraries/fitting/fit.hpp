// Fits a material to measured friction: the command `bristle fit`.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include <bristle/material.hpp>

#include "tools/libraries/fitting/data.hpp"
#include "tools/libraries/fitting/path_force.hpp"

namespace cli {

/// Largest residual and shared renewal (together called rubbing) that a fit may find.
inline constexpr double widest_residual = 0.95;  ///< largest residual, as a share of the presliding
                                                 ///< length
inline constexpr double most_renewed = 8.0;

struct FitOptions {
  std::vector<std::string> data;  ///< CSV files of measured friction, joined into one record
  FitReading reading;             ///< names, units and quantities stated by the user
  std::optional<double> load;     ///< constant normal load instead of the file's column, N
  double mass = 0.0;              ///< mass between force sensor and contact, kg; the sensor measures its
                                  ///< inertia, which is subtracted
  ForceSign sign = ForceSign::automatic;
  /// Law of snap lengths; `table` stands for any law, which only the rule slide can have.
  bristle::SnapLaw law = bristle::SnapLaw::lognormal;
  bristle::SnapRule rule = bristle::SnapRule::redraw;
  bool choose_rule = false;  ///< whether to choose redraw or slide, by errors on parts of the record left out
                             ///< of the fit
  bristle::DamperDecay decay = bristle::DamperDecay::exponential;
  /// Quantiles of the snap lengths over their mean, for SnapLaw::table; found by the fit.
  std::vector<double> quantiles;
  std::optional<double> residual;    ///< residual over presliding length; fixed if given, 0 with the rule
                                     ///< keep
  std::optional<double> renewal;     ///< bristles renewed for each snap; fixed if given, 0 with the rule
                                     ///< keep
  std::optional<double> compliance;  ///< compliance of the contact's stage, m/N; fixed if given
  std::optional<double> delay;       ///< delay of the force sensor, s; fixed if given

  /// Whether to fit the friction of a geared joint (joint.hpp), with the two options below.
  bool joint = false;
  std::optional<double> torque_constant;  ///< motor torque per current, N m/A

  /// Gravity torque of a pendulum on the joint when horizontal, N m; at angle 0 it hangs down.
  std::optional<double> pendulum;
  bool rivals = false;  ///< whether to fit other friction models too: all to a part of the record, judged on
                        ///< the rest

  /// End of the fitted part of the record, s after its first sample; none: after a third of it.
  std::optional<double> fit_until;
  std::string json, csv, html, write, plot;  ///< names of files to write; empty: none

  /// Whether to fit for prediction: any term that lowers the residuals stays, even with a wide interval.
  bool for_prediction = false;
  bool no_drift = false;  ///< whether the sensor's drift is fixed at 0
  bool no_time = false;   ///< whether ageing and speed strengthening are left out
  bool quiet = false;     ///< whether the terminal shows no progress
};

/// Returns whether a law of snap lengths has a spread as a parameter.
inline bool has_spread(bristle::SnapLaw law) {
  return law != bristle::SnapLaw::exponential && law != bristle::SnapLaw::table;
}

/// Parameters of a fit: twelve of the material, then those of stage, direction and sensor.
enum FitParameter : unsigned {
  fit_kinetic,   ///< kinetic coefficient, at the speed FitFrame::speed if it depends on speed
  fit_length,    ///< presliding length, m: residual plus mean snap length, at FitFrame::age if it ages
  fit_spread,    ///< standard deviation of snap lengths over their mean
  fit_residual,  ///< deflection left after a snap over presliding length
  fit_renewal,   ///< bristles renewed for each snap, if so many are bent

  /// Logarithmic ageing: growth of the snap length per e-fold of age, over its value at FitFrame::age.
  /// Saturating ageing: Ageing::strength.
  fit_ageing,
  fit_ageing_time,          ///< age from which snap lengths grow, s
  fit_strengthening,        ///< growth of friction with speed, Material::speed_strengthening
  fit_strengthening_speed,  ///< speed from which friction grows with speed, m/s
  fit_viscous,              ///< viscous friction of a lubricant, N s/m
  fit_damping,              ///< damping of the bristles over load, s/m
  fit_stribeck,             ///< Stribeck velocity, over which the damping of bristles fades, m/s
  fit_compliance,           ///< compliance between measured position and contact, m/N
  fit_softening,            ///< half of the compliance's growth per newton (by the body), m/N^2; one axis
  fit_delay,                ///< time constant of a low-pass on the measured force, s
  fit_asymmetry,            ///< share by which friction is higher towards +x and lower towards -x
  fit_offset,               ///< offset of the force sensor in the middle of the record, N
  fit_drift,                ///< drift of the force sensor, N/s
  fit_offset_y,             ///< offset of the sensor's second axis, N
  fit_drift_y,              ///< drift of the sensor's second axis, N/s
  fit_parameters            ///< number of fitted parameters, those above
};
using FitValues = std::array<double, fit_parameters>;

/// Default values, which parameters keep if the data do not determine them.
inline constexpr FitValues fit_defaults = {0.40, 10e-6, 0.3, 0.0, 0.0, 0.0, 1.0, 0.0, 1e-6, 0.0,
                                           0.0,  1e-3,  0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,  0.0};

/// Returns whether the stage yields, so that the contact is not where the position is measured.
inline bool bends_stage(const FitValues& p) { return p[fit_compliance] > 0.0 || p[fit_softening] != 0.0; }

/// Reference speed and age for which a fit states parameters that depend on them: in the middle of the
/// record's range, where the data determine them best.
struct FitFrame {
  double speed = 0.0;                            ///< reference speed, m/s; 0 without ageing or
                                                 ///< strengthening
  double age = 0.0;                              ///< reference age of bristles, s
  double shortest_age = 0.0, longest_age = 0.0;  ///< range of the bristles' ages in the record,
                                                 ///< s
  bristle::AgeingForm form = bristle::AgeingForm::logarithmic;
  /// Whether the form of ageing is assumed, because the data fit both forms about equally.
  bool form_assumed = true;
  friend bool operator==(const FitFrame&, const FitFrame&) = default;
};

struct FitEstimate {
  double value = 0.0;
  bool fitted = false;
  double low = 0.0, high = 0.0;  ///< ends of the 95 % interval of a fitted parameter
  std::string why;               ///< reason why it is not fitted; empty if it is
};

struct FitResult {
  std::array<FitEstimate, fit_parameters> estimates;
  FitFrame frame;
  /// Estimates derived from the fitted parameters: peak coefficient (at FitFrame::age, if bristles age),
  /// stiffness over load (1/m), and friction coefficients towards +x and -x if they differ.
  FitEstimate peak, stiffness, forward, backward;
  std::vector<std::string> notes;  ///< remarks that a reader of the fitted numbers needs
  bristle::SnapRule rule = bristle::SnapRule::redraw;
  bristle::SnapLaw law = bristle::SnapLaw::lognormal;
  std::vector<double> quantiles;  ///< quantiles of snap lengths over their mean, for SnapLaw::table
  bristle::Material material;
  Past past;
  /// Fitted force by the body at the samples, N, including the sensor's offset and drift.
  std::vector<double> curve;
  double residual_rms = 0.0;  ///< rms of measured minus fitted force, N
  double held_out_rms = 0.0;  ///< rms error on parts of the record, each predicted from the rest, N
  double explained = 0.0;     ///< share of the force's sum of squares explained by the fit

  /// Number of correlated samples that carry as much information as one independent sample.
  double correlated_samples = 1.0;
  /// Smallest over largest singular value of the fit's Jacobian, its columns scaled to length 1.
  double smallest_singular_value = 0.0;
  /// Lower estimate of the bristles per newton, from force fluctuations in sliding; may be infinite.
  double fluctuating_bristles = 0.0;
  int evaluations = 0;  ///< number of times the brush was stepped along the path
};

/// Names of the numbers in a fit's report: those of FitParameter in order, then peak, stiffness, forward and
/// backward friction.
inline constexpr std::size_t fit_report_rows = fit_parameters + 4;
const char* fit_name(std::size_t row);
const FitEstimate& report_estimate(const FitResult& result, std::size_t row);

/// The force of another friction model that was fitted to the record.
struct ModelForce {
  std::string model;
  std::vector<double> force;  ///< force on each sample, N, with the sign of FitData::force
};

/// Fits a material to a record. Throws UserError where the brush explains too little of the force.
FitResult fit_material(const FitData& data, const FitOptions& options);

std::string fit_table(const FitData& data, const FitResult& result);
std::string fit_json(const FitData& data, const FitResult& result);
/// Returns a row per sample, with a column for the force of each model in `beside`, which reports of one axis
/// may have.
std::string fit_csv(const FitData& data, const FitResult& result, const std::vector<ModelForce>& beside = {});
/// Returns the prepared motion as text of a motion file, with the columns t,x,load or t,x,y,load.
std::string fit_motion(const FitData& data);
/// Returns a scene file that has the fitted material and replays the measured motion by `bristle run`.
std::string fit_toml(const FitData& data, const FitOptions& options, const FitResult& result);

/// The page of text that fit_table() returns: how the file was read, data and fit, residuals, parameters, and
/// what the data do not determine.

/// Runs the command `bristle fit`: reads files, fits, reports. Throws UserError.
void fit_command(const FitOptions& options);

}  // namespace cli
