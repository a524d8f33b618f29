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

/// Largest residual and shared renewal that a fit may find. Both together are called rubbing.
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
  /// Law of the snap lengths. `table` stands for a free law, which only the rule slide can have.
  bristle::SnapLaw law = bristle::SnapLaw::lognormal;
  bristle::SnapRule rule = bristle::SnapRule::redraw;
  /// Whether the fit chooses the kind of brush (redraw without or with rubbing, slide with this law or with a
  /// free one) by its error on blocks of the record that it is not fitted to.
  bool choose_rule = false;
  bristle::DamperDecay decay = bristle::DamperDecay::exponential;
  /// Quantiles of the snap lengths over their mean, for SnapLaw::table. The fit finds them.
  std::vector<double> quantiles;
  std::optional<double> residual;  ///< residual over presliding length; fixed if given, 0 with the rule slide
  std::optional<double> renewal;   ///< bristles renewed for each snap; fixed if given, 0 with the rule slide

  /// Whether to fit the friction of a geared joint (joint.hpp) instead of a material, with the two options
  /// below.
  bool joint = false;
  std::optional<double> torque_constant;  ///< motor torque per current, N m/A

  /// Torque of gravity, N m, on a joint with a pendulum when the pendulum is horizontal; at the angle 0 it
  /// hangs down.
  std::optional<double> pendulum;
  bool rivals = false;  ///< whether to judge other friction models too: all fitted to a part of the record,
                        ///< judged on the rest
  /// End of the fitted part of the record, s after its first sample; none: half of 32 blocks of its time.
  std::optional<double> fit_until;
  std::string json, csv, html, write, plot;  ///< names of files to write; empty: none

  bool no_drift = false;  ///< whether the sensor's drift is fixed at 0
  bool quiet = false;     ///< whether the terminal shows no progress
};

/// Returns whether a law of snap lengths has a spread as a parameter.
inline bool has_spread(bristle::SnapLaw law) {
  return law != bristle::SnapLaw::exponential && law != bristle::SnapLaw::table;
}

/// Parameters of a fit: five of the brush, one of the stage that carries the specimen, three of terms that
/// depend on speed, then those of the sensor.
enum FitParameter : unsigned {
  fit_kinetic,    ///< kinetic coefficient
  fit_length,     ///< presliding length, m: residual plus mean snap length
  fit_spread,     ///< standard deviation of snap lengths over their mean
  fit_residual,   ///< deflection left after a snap over presliding length
  fit_renewal,    ///< bristles renewed for each snap, if so many are bent
  fit_softening,  ///< bending of the stage between measured position and contact, over force squared, m/N^2:
                  ///< a stage that is stiffer one way than the other
  fit_viscous,    ///< viscous friction of a lubricant, N s/m
  fit_damping,    ///< damping of the bristles over load, s/m
  fit_stribeck,   ///< Stribeck velocity, over which the damping of bristles fades, m/s
  fit_delay,      ///< time of the force sensor's first-order low-pass, s
  fit_offset,     ///< offset of the force sensor in the middle of the record, N
  fit_drift,      ///< drift of the force sensor, N/s
  fit_offset_y,   ///< offset of the sensor's second axis, N
  fit_drift_y,    ///< drift of the sensor's second axis, N/s
  fit_parameters  ///< number of fitted parameters, those above
};
using FitValues = std::array<double, fit_parameters>;

/// Values from which a search starts.
inline constexpr FitValues fit_defaults = {0.40, 10e-6, 0.3, 0.0, 0.0, 0.0, 0.0,
                                           0.0,  1e-3,  0.0, 0.0, 0.0, 0.0, 0.0};

/// Estimate of a parameter. Its interval is for the law of the surface, of which the bristles of a contact
/// are a random sample. A record cannot show their number unless the body slides, so that the interval counts
/// 900 per newton, or fewer if friction in sliding scatters more.
struct FitEstimate {
  double value = 0.0;
  bool fitted = false;
  double low = 0.0, high = 0.0;  ///< ends of the 95 % interval of a fitted parameter
  std::string why;               ///< reason why it is not fitted; empty if it is
};

struct FitResult {
  std::array<FitEstimate, fit_parameters> estimates;
  /// Estimates that follow from the fitted parameters: peak coefficient, and stiffness over load (1/m).
  FitEstimate peak, stiffness;
  std::vector<std::string> notes;  ///< remarks that a reader of the fitted numbers needs
  bristle::SnapRule rule = bristle::SnapRule::redraw;
  bristle::SnapLaw law = bristle::SnapLaw::lognormal;
  std::vector<double> quantiles;  ///< quantiles of snap lengths over their mean, for SnapLaw::table
  bristle::Material material;
  Past past;
  /// Force by the body at the samples, N, as fitted, with the sensor's offset and drift.
  std::vector<double> curve;
  /// For each sample whether the fit left it out, because friction around a reversal may be anything there;
  /// empty if it used all.
  std::vector<bool> left_out;
  double residual_rms = 0.0;  ///< rms of measured minus fitted force, N
  double held_out_rms = 0.0;  ///< rms error on parts of the record, each predicted from the rest, N
  double explained = 0.0;     ///< share of the force's sum of squares explained by the fit

  /// Number of correlated samples that carry as much information as one independent sample, by which
  /// intervals are widened.
  double correlated_samples = 1.0;
};

/// Number of rows in a fit's report, and the name of each: the parameters in the order of FitParameter, then
/// peak and stiffness.
inline constexpr std::size_t fit_report_rows = fit_parameters + 2;
const char* fit_name(std::size_t row);
const FitEstimate& report_estimate(const FitResult& result, std::size_t row);
/// Returns whether a row (a parameter) of the report has a meaning for this record. A number that follows
/// from undetermined numbers has none; a record of one axis has no offset of a second one.
bool concerns(const FitData& data, const FitResult& result, std::size_t row);

/// Force of another friction model that was fitted to the same record, for comparison.
struct ModelForce {
  std::string model;
  std::vector<double> force;  ///< force on each sample, N, with the sign of FitData::force
};

/// Fits a material to a record of measured friction. Throws UserError if the brush explains too little of the
/// force.
FitResult fit_material(const FitData& data, const FitOptions& options);

std::string fit_table(const FitData& data, const FitResult& result);
std::string fit_json(const FitData& data, const FitResult& result);
/// Returns CSV text with a row per sample; the residual of a sample that was left out is nan. Each model in
/// `beside`, which only records of one axis may have, gets a column for its force.
std::string fit_csv(const FitData& data, const FitResult& result, const std::vector<ModelForce>& beside = {});
/// Returns the motion of the prepared record as text of a motion file, with the columns t,x,load or
/// t,x,y,load.
std::string fit_motion(const FitData& data);
/// Returns a scene file with the fitted material, by which `bristle run` replays the measured motion.
std::string fit_toml(const FitData& data, const FitOptions& options, const FitResult& result);

/// Runs the command `bristle fit`: reads files, fits, reports. Throws UserError.
void fit_command(const FitOptions& options);

}  // namespace cli
