// `bristle fit`: a material from measured friction.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include <bristle/material.hpp>

#include "tools/fitting/data.hpp"
#include "tools/fitting/path_force.hpp"

namespace cli {

/// Ranges in which rubbing is looked for, or held.
inline constexpr double widest_residual = 0.95;  ///< share of the presliding length
inline constexpr double most_renewed = 8.0;

struct FitOptions {
  std::vector<std::string> data;  ///< measured friction, CSV; several files are one record
  FitReading reading;             ///< what the files do not say
  std::optional<double> load;     ///< N, in place of a column
  double mass = 0.0;              ///< kg, that the force sensor accelerates with the body
  ForceSign sign = ForceSign::automatic;
  bristle::SnapLaw law = bristle::SnapLaw::lognormal;  ///< table: any law, of bristles that slide
  bristle::SnapRule rule = bristle::SnapRule::redraw;
  bool choose_rule = false;  ///< redraw, or slide where parts that are not fitted to are clearly closer to it
  bristle::DamperDecay decay = bristle::DamperDecay::exponential;
  std::vector<double> quantiles;     ///< over their mean, of SnapLaw::table: found, not given
  std::optional<double> residual;    ///< share of the presliding length; held there. keep: 0
  std::optional<double> renewal;     ///< held there. keep: 0
  std::optional<double> compliance;  ///< m/N, of the stage; held there
  std::optional<double> delay;       ///< s, of the force sensor; held there
  bool joint = false;                ///< the friction of a joint (joint.hpp), of which the options below are
  std::optional<double> torque_constant;  ///< N m/A
  std::optional<double> pendulum;         ///< N m, that hangs on the joint, straight down at angle 0
  bool rivals = false;  ///< fit them too, to a part of the record, and judge all on the rest
  std::optional<double>
      fit_until;  ///< s after the first sample, end of that part; none: a third of the record
  std::string json, csv, write, plot;  ///< files; empty: none
  bool for_prediction = false;  ///< takes what lessens the residuals, and takes nothing out for its interval
  bool no_drift = false;        ///< the sensor's is held at 0
  bool no_time = false;         ///< neither ageing nor strengthening with speed is looked for
  bool quiet = false;           ///< no progress on a terminal
};

/// Whether the law has a spread to choose.
inline bool has_spread(bristle::SnapLaw law) {
  return law != bristle::SnapLaw::exponential && law != bristle::SnapLaw::table;
}

/// The fitted parameters: twelve numbers of the material, and those of stage, direction and sensor.
enum FitParameter : unsigned {
  fit_kinetic,        ///< dry friction over load in sliding; with ageing or strengthening at FitFrame::speed
  fit_length,         ///< m, presliding length: residual and mean snap length; with ageing at FitFrame::age
  fit_spread,         ///< deviation of the snap length over its mean
  fit_residual,       ///< share of the presliding length that a snap leaves
  fit_renewal,        ///< bristles renewed per snap, where all are bent far enough
  fit_ageing,         ///< logarithmic: growth of the snap length per e-fold of age, over that at
                      ///< FitFrame::age. saturating: Ageing::strength
  fit_ageing_time,    ///< s
  fit_strengthening,  ///< Material::speed_strengthening
  fit_strengthening_speed,  ///< m/s
  fit_viscous,              ///< N s/m
  fit_damping,              ///< s/m, per newton of load
  fit_stribeck,             ///< m/s
  fit_compliance,           ///< m/N, of what is between the measured position and the contact
  fit_softening,  ///< m/N^2, one axis: the stage's compliance grows by twice this per newton by the body
  fit_delay,      ///< s, of a first-order low-pass between the friction and the force column
  fit_asymmetry,  ///< friction towards +x is larger by this share, towards -x smaller
  fit_offset,     ///< N, of the sensor, in the middle of the record
  fit_drift,      ///< N/s
  fit_offset_y,   ///< N, of the sensor of a second axis
  fit_drift_y,    ///< N/s
  fit_parameters  ///< how many
};
using FitValues = std::array<double, fit_parameters>;

/// Where a parameter stays when the data do not determine it.
inline constexpr FitValues fit_defaults = {0.40, 10e-6, 0.3, 0.0, 0.0, 0.0, 1.0, 0.0, 1e-6, 0.0,
                                           0.0,  1e-3,  0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,  0.0};

/// Whether the contact is elsewhere than the measured position.
inline bool bends_stage(const FitValues& p) { return p[fit_compliance] > 0.0 || p[fit_softening] != 0.0; }

/// At which speed and age numbers are given that change with them: in the middle of the record, so that the
/// data determine them as well as they can.
struct FitFrame {
  double speed = 0.0;                            ///< m/s; 0 without ageing and strengthening
  double age = 0.0;                              ///< s
  double shortest_age = 0.0, longest_age = 0.0;  ///< s, of bristles in the record
  bristle::AgeingForm form = bristle::AgeingForm::logarithmic;
  bool form_assumed = true;  ///< the data do not tell it from the other
  friend bool operator==(const FitFrame&, const FitFrame&) = default;
};

struct FitEstimate {
  double value = 0.0;
  bool fitted = false;
  double low = 0.0, high = 0.0;  ///< 95 % interval, where fitted
  std::string why;               ///< where not: what the data lack
};

struct FitResult {
  std::array<FitEstimate, fit_parameters> estimates;
  FitFrame frame;
  /// Follow from the others: peak coefficient (with ageing of bristles of FitFrame::age), K over load in 1/m,
  /// friction over load towards +x and -x where these differ.
  FitEstimate peak, stiffness, forward, backward;
  std::vector<std::string> notes;  ///< what else a reader of these numbers must know
  bristle::SnapRule rule = bristle::SnapRule::redraw;
  bristle::SnapLaw law = bristle::SnapLaw::lognormal;
  std::vector<double> quantiles;  ///< over their mean, of SnapLaw::table
  bristle::Material material;
  Past past;
  std::vector<double> curve;        ///< N, the fit at the samples, by the body, offset and drift included
  double residual_rms = 0.0;        ///< N
  double held_out_rms = 0.0;        ///< N, of parts of the record that were not fitted to, each in its turn
  double explained = 0.0;           ///< share of the sum of squares of the force
  double correlated_samples = 1.0;  ///< as many samples count as one, for the intervals
  double smallest_singular_value = 0.0;  ///< of the Jacobian, columns scaled to length 1, over the largest
  double fluctuating_bristles = 0.0;  ///< 1/N: as many at least, by the residuals in sliding; may be infinite
  int evaluations = 0;                ///< of the force of the brush along the path, the search included
};

/// Names of the fitted numbers in a report, by FitParameter, then peak, stiffness, forward and backward.
inline constexpr std::size_t fit_report_rows = fit_parameters + 4;
const char* fit_name(std::size_t row);
const FitEstimate& report_estimate(const FitResult& result, std::size_t row);

/// Throws UserError where the brush explains too little of the force.
FitResult fit_material(const FitData& data, const FitOptions& options);

std::string fit_table(const FitData& data, const FitResult& result);
std::string fit_json(const FitData& data, const FitResult& result);
std::string fit_csv(const FitData& data, const FitResult& result);
/// The motion that was understood, as a motion file: t,x,load (t,x,y,load).
std::string fit_motion(const FitData& data);
/// A scene with the material that replays the measured motion: `bristle run` takes it.
std::string fit_toml(const FitData& data, const FitOptions& options, const FitResult& result);

/// One page for people: what was read, data and fit, residuals, parameters, what is not determined.

/// The subcommand: reads, fits, reports. Throws UserError.
void fit_command(const FitOptions& options);

}  // namespace cli
