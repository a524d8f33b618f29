// Prepares measured friction for `bristle fit`: reads files, finds the sign of the force, removes what an
// encoder and slow sampling did to the path, and refuses data that determine no parameter. File format:
// README.md of this folder.
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/libraries/files/foreign_csv.hpp"
#include "tools/libraries/fitting/path_force.hpp"

namespace cli {

/// Sign convention of a measured force. The force on the body opposes the motion; the force by the body
/// points along it. `automatic`: the data decide.
enum class ForceSign : unsigned char { automatic, on_body, by_body };

/// What the user states about a file of measured friction: units, names of columns, and quantities that the
/// file lacks. Columns are named as in tools/README.md (t, x, v, load, force, y, fx, fy, angle, torque).
struct FitReading {
  ColumnWords columns;           ///< pairs: column's standard name, its header
  ColumnWords units;             ///< pairs: a column's standard name, and its unit
  std::optional<double> rate;    ///< samples per second of a file without time
  std::optional<double> radius;  ///< radius by which angle and torque become path and force, m
  bool disc = false;             ///< whether the contact is a full disc of this radius; if not, a ring
  double clip_load = 0.0;        ///< loads from -clip_load to 0 count as 0, N
  bool automatic() const { return columns.empty() && units.empty() && !rate && !radius && clip_load == 0.0; }
};

struct FitColumns {
  std::string name;  ///< name of the file of measured friction

  /// Columns in SI units. v is empty if the file has no speed. x is the integral of v if the file has no
  /// position.
  std::vector<double> t, x, v, load, force;
  /// Position and force along the second axis; empty for a record on one axis.
  std::vector<double> y, force_y;
  bool has_x = false, has_load = false;
  /// Whether the contact is a disc under even pressure that turns about its centre. x is then the path of its
  /// rim, and force the torque over its radius.
  bool disc = false;
  bool planar() const { return !y.empty(); }
  bool replayable = false;  ///< whether `bristle run` can read the file as it is
  std::vector<std::string> ignored_columns;
  std::vector<std::size_t> parts;       ///< for joined files, the first row of each but the first
  std::vector<std::string> understood;  ///< sentences that tell how the file was understood

  /// Returns whether row i continues the motion of the row before. The first row of each joined file does
  /// not.
  bool follows(std::size_t i) const { return i > 0 && !std::binary_search(parts.begin(), parts.end(), i); }
};

struct FitData {
  FitColumns columns;
  ForceSign sign = ForceSign::by_body;
  bool sign_found = false;  ///< whether the force's sign was found from the data, not given
  unsigned axes = 1;
  /// Measured force by the body, N: positive along the motion. In the plane, all x components, then all y
  /// components.
  std::vector<double> force;
  std::vector<double> load;  ///< normal load used by the fit, N

  /// Velocity for terms that depend on speed, m/s. In the plane, all x components, then all y components.
  std::vector<double> velocity;
  std::vector<PathPoint> path;  ///< samples of the motion, with reversals between them

  /// Whether the load varies so little that the fit takes it as constant.
  bool steady_load = false;
  double quantum = 0.0;                 ///< encoder's count, m; 0: none found
  double position_noise = 0.0;          ///< standard deviation of position noise, m
  double range = 0.0, travelled = 0.0;  ///< extent of the path; distance travelled, m
  double finest_move = 0.0;             ///< 10th percentile of moves between samples, m
  int reversals = 0;
  double slow = 0.0, fast = 0.0;  ///< 10th and 90th percentile of speed while moving, m/s

  /// Ratio of fast to slow speed while the body moves; on one axis the larger of the ratios of the two
  /// directions.
  double ratio_of_speeds = 1.0;
  double mean_load = 0.0, force_scale = 0.0;  ///< mean normal load; rms of the force, N
  double sample_time = 0.0;                   ///< median interval between samples, s

  std::size_t samples() const { return load.size(); }
  /// Times of the first and the last sample, s. A part of a record keeps those of the whole, to which the
  /// sensor's offset and drift refer.
  double first_time = 0.0, last_time = 0.0;
  double length() const { return last_time - first_time; }
  double middle_time() const { return 0.5 * (first_time + last_time); }
};

/// Parses the text of a file of measured friction to columns. Throws UserError that names file, line and
/// column.
FitColumns parse_fit_columns(std::string_view text, const std::string& name, const FitReading& reading = {});

/// Joins several records into one. A clock that restarts is continued, and at the start of each record the
/// brush has no memory of the one before. Throws UserError if the records have different columns.
FitColumns join_fit_columns(std::vector<FitColumns> records);
/// Reads several files of measured friction and joins them into one record.
FitColumns read_fit_columns(const std::vector<std::string>& files, const FitReading& reading);

/// Checks columns that a program gives in memory (t, x, force, and load unless empty) by the rules for files.
/// Throws UserError that names the row, counted from 0.
void check_fit_columns(const FitColumns& columns);

/// Returns the positions (m) without the staircase of an encoder, if one is found; sets `quantum` to its
/// count (m; 0: none found).
std::vector<double> smoothed_positions(const FitColumns& columns, const std::vector<double>& x,
                                       double& quantum);

/// Returns the value below which this share of some values lies; 0 for no values.
double quantile_of(std::vector<double> values, double share);
double root_mean_square(const std::vector<double>& values);

/// Estimates the standard deviation of the noise in evenly sampled values, from the median of their fourth
/// differences, in which even a curved motion hardly shows.
double noise_of(const std::vector<double>& x);

/// Makes the path that a fit replays: the samples, and the reversals between them, found by parabolas
/// through samples. Sampling misses the points of reversal, where friction changes its sign.
std::vector<PathPoint> make_path(const std::vector<double>& t, const std::vector<double>& x,
                                 const std::vector<double>& load, double noise);

/// Prepares measured columns for a fit. `load` (N) replaces the column of loads. `mass` (kg) is a mass that
/// moves with the force sensor, whose inertia is subtracted. Throws UserError on data that determine no
/// parameter.
FitData prepare_fit_data(FitColumns columns, ForceSign sign, std::optional<double> load, double mass = 0.0);

/// Thins out samples within rests, where nothing changes, so that long rests do not slow the fit: the longer
/// the rest, the smaller the share that stays.
FitData without_rests(const FitData& data);

/// Returns the positions of the samples along the (first) axis, m, smoothed as in the path.
std::vector<double> positions_of(const FitData& data);

/// Returns the acceleration at the samples of a record on one axis, m/s^2, smoothed as its noise asks.
std::vector<double> acceleration(const FitData& data);

/// Returns a record with the force of the samples `stay` (indices, in order) only, but the whole motion, on
/// which the state of the bristles depends.
FitData with_samples(const FitData& data, const std::vector<std::size_t>& stay);

/// Returns a record of at most `most` evenly chosen samples and of the reversals between them, for a
/// faster fit. Sign, noise and speeds stay those of the whole record.
FitData thinned(const FitData& data, std::size_t most);

}  // namespace cli
