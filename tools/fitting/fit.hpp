// Fits a material to measured friction: the command `bristle fit`.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include <bristle/material.hpp>

#include "tools/fitting/data.hpp"
#include "tools/fitting/path_force.hpp"

namespace cli {

/// Largest residual and shared renewal (together "rubbing") that a fit may find.
inline constexpr double widest_residual = 0.95;  ///< largest residual length, as a share of the presliding
                                                 ///< length
inline constexpr double most_renewed = 8.0;

struct FitOptions {
  std::vector<std::string> data;  ///< files of measured friction, CSV; several make one record
  FitReading reading;             ///< names, units and quantities that the files lack
  std::optional<double> load;     ///< N, constant normal load that replaces the file's column of loads
  double mass = 0.0;              ///< kg, mass between force sensor and contact, whose inertia the sensor
                                  ///< measures too
  ForceSign sign = ForceSign::automatic;
  /// Law of snap lengths; table: any law, for the slide rule.
  bristle::SnapLaw law = bristle::SnapLaw::lognormal;
  bristle::SnapRule rule = bristle::SnapRule::redraw;
  bool choose_rule = false;  ///< whether to choose between the rules redraw and slide, by the error of
                             ///< held-out parts
  bristle::DamperDecay decay = bristle::DamperDecay::exponential;
  /// Quantiles of the snap lengths over their mean, for SnapLaw::table; found by the fit.
  std::vector<double> quantiles;
  std::optional<double> residual;    ///< residual length as a share of the presliding length; fixed if given;
                                     ///< the rule keep has 0
  std::optional<double> renewal;     ///< number of bristles renewed per snap; fixed if given; the rule keep
                                     ///< has 0
  std::optional<double> compliance;  ///< m/N, compliance of the stage that holds the contact; fixed if given
  std::optional<double> delay;       ///< s, delay of the force sensor; fixed if given

  /// Whether to fit the friction of a joint (joint.hpp), with the options below.
  bool joint = false;
  std::optional<double> torque_constant;  ///< N m/A, motor torque per current

  /// N m, gravity torque of a pendulum on the joint; it hangs straight down at angle 0.
  std::optional<double> pendulum;
  bool rivals = false;  ///< whether to fit other friction models too, to a part of the record, and judge all
                        ///< on the rest

  /// s after the first sample, end of the part that is fitted; none: a third of the record.
  std::optional<double> fit_until;
  std::string json, csv, write, plot;  ///< output files; empty: none

  /// Whether to add any term that lowers the residuals, and keep terms with wide intervals.
  bool for_prediction = false;
  bool no_drift = false;  ///< whether to keep the sensor's drift at 0
  bool no_time = false;   ///< whether to leave out ageing and strengthening with speed
  bool quiet = false;     ///< whether to show no progress on a terminal
};

/// Returns whether a law of snap lengths has a spread that can be chosen.
inline bool has_spread(bristle::SnapLaw law) {
  return law != bristle::SnapLaw::exponential && law != bristle::SnapLaw::table;
}

/// Fitted parameters: twelve of the material, and those of stage, direction and sensor.
enum FitParameter : unsigned {
  fit_kinetic,   ///< kinetic coefficient; if it ages or strengthens, at the speed FitFrame::speed
  fit_length,    ///< m, presliding length: residual plus mean snap length; if it ages, at FitFrame::age
  fit_spread,    ///< spread: standard deviation of the snap length over its mean
  fit_residual,  ///< share of the presliding length that a snap leaves
  fit_renewal,   ///< bristles renewed per snap, if enough of them are bent

  /// Logarithmic ageing: growth of the snap length per e-fold of age, over the length at FitFrame::age.
  /// Saturating ageing: Ageing::strength.
  fit_ageing,
  fit_ageing_time,          ///< s, time from which ageing acts
  fit_strengthening,        ///< strengthening with speed, Material::speed_strengthening
  fit_strengthening_speed,  ///< m/s, speed from which strengthening acts
  fit_viscous,              ///< N s/m, viscous friction (lubricant)
  fit_damping,              ///< s/m, damping of the bristles per newton of load
  fit_stribeck,             ///< m/s, Stribeck velocity, over which that damping fades
  fit_compliance,           ///< m/N, compliance between the measured position and the contact
  fit_softening,            ///< m/N^2, one axis: half the growth of the compliance per newton (by the body)
  fit_delay,                ///< s, time constant of a low-pass between friction and force column
  fit_asymmetry,            ///< share by which friction is larger towards +x and smaller towards -x
  fit_offset,               ///< N, offset of the sensor in the middle of the record
  fit_drift,                ///< N/s, drift of the sensor
  fit_offset_y,             ///< N, offset of the sensor's second axis
  fit_drift_y,              ///< N/s, drift of the sensor's second axis
  fit_parameters            ///< number of parameters above
};
using FitValues = std::array<double, fit_parameters>;

/// Values that parameters keep if the data do not determine them.
inline constexpr FitValues fit_defaults = {0.40, 10e-6, 0.3, 0.0, 0.0, 0.0, 1.0, 0.0, 1e-6, 0.0,
                                           0.0,  1e-3,  0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,  0.0};

/// Returns whether a compliant stage displaces the contact from the measured position.
inline bool bends_stage(const FitValues& p) { return p[fit_compliance] > 0.0 || p[fit_softening] != 0.0; }

/// Speed and age at which speed- and age-dependent parameters are given: in the middle of the record, where
/// the data determine them best.
struct FitFrame {
  double speed = 0.0;                            ///< m/s, speed for which speed-dependent parameters are
                                                 ///< given; 0 without ageing or strengthening
  double age = 0.0;                              ///< s, reference age
  double shortest_age = 0.0, longest_age = 0.0;  ///< s, shortest and longest age of the bristles in the
                                                 ///< record
  bristle::AgeingForm form = bristle::AgeingForm::logarithmic;
  /// Whether the form is assumed, since the data do not distinguish it from the other.
  bool form_assumed = true;
  friend bool operator==(const FitFrame&, const FitFrame&) = default;
};

struct FitEstimate {
  double value = 0.0;
  bool fitted = false;
  double low = 0.0, high = 0.0;  ///< lower and upper end of the 95 % interval, if the parameter is fitted
  std::string why;               ///< reason why the parameter is not fitted; empty if it is
};

struct FitResult {
  std::array<FitEstimate, fit_parameters> estimates;
  FitFrame frame;
  /// Estimates that follow from the others: peak coefficient (of bristles of age FitFrame::age, if they age),
  /// K over load in 1/m, friction coefficient towards +x and -x if they differ.
  FitEstimate peak, stiffness, forward, backward;
  std::vector<std::string> notes;  ///< further remarks that a reader of the fitted numbers must know
  bristle::SnapRule rule = bristle::SnapRule::redraw;
  bristle::SnapLaw law = bristle::SnapLaw::lognormal;
  std::vector<double> quantiles;  ///< quantiles of the snap lengths over their mean, of SnapLaw::table
  bristle::Material material;
  Past past;
  /// N, fitted force (by the body) at the samples, with the sensor's offset and drift.
  std::vector<double> curve;
  double residual_rms = 0.0;  ///< N, rms of the measured less the fitted force
  double held_out_rms = 0.0;  ///< N, rms error of parts of the record, each predicted from a fit to the rest
  double explained = 0.0;     ///< share of the force's sum of squares that the fit explains

  /// Number of correlated samples that count as one independent sample in the intervals.
  double correlated_samples = 1.0;
  /// Smallest over largest singular value of the Jacobian, with columns scaled to length 1.
  double smallest_singular_value = 0.0;
  /// 1/N, lower estimate of the bristles per newton, from residuals in sliding; may be infinite
  double fluctuating_bristles = 0.0;
  int evaluations = 0;  ///< number of times that the brush was stepped along the path, the search included
};

/// Names of the numbers in a report, in the order of FitParameter, then peak, stiffness, forward and
/// backward.
inline constexpr std::size_t fit_report_rows = fit_parameters + 4;
const char* fit_name(std::size_t row);
const FitEstimate& report_estimate(const FitResult& result, std::size_t row);

/// Fits a material. Throws UserError where the brush explains too little of the force.
FitResult fit_material(const FitData& data, const FitOptions& options);

std::string fit_table(const FitData& data, const FitResult& result);
std::string fit_json(const FitData& data, const FitResult& result);
std::string fit_csv(const FitData& data, const FitResult& result);
/// Returns the prepared motion as a motion file: t,x,load (t,x,y,load).
std::string fit_motion(const FitData& data);
/// Returns a scene with the material that replays the measured motion by `bristle run`.
std::string fit_toml(const FitData& data, const FitOptions& options, const FitResult& result);

/// Returns a text of one page: how the file was read, data and fit, residuals, parameters, what is not
/// determined.

/// Runs the subcommand: reads, fits, reports. Throws UserError.
void fit_command(const FitOptions& options);

}  // namespace cli
