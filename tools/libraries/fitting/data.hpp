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

/// Sign convention of the measured force: the force on the body opposes the motion, the force by the body
/// points along it.
enum class ForceSign : unsigned char { automatic, on_body, by_body };

/// What the user states about a file of measured friction: units, names, and quantities that it lacks.
/// Columns are named as in tools/README.md (t, x, v, load, force, y, fx, fy, angle, torque).
struct FitReading {
  ColumnWords columns;           ///< pairs: column's standard name, its header or number (from 1)
  ColumnWords units;             ///< pairs: a column's standard name, and its unit
  std::optional<double> rate;    ///< samples per second of a file without time
  std::optional<double> radius;  ///< radius by which angle and torque become path and force, m
  bool disc = false;             ///< whether the contact is a full disc of this radius; if not, a ring
  double clip_load = 0.0;        ///< loads from -clip_load to 0 count as 0, N
  bool automatic() const { return columns.empty() && units.empty() && !rate && !radius && clip_load == 0.0; }
};

/// Column of a measured file in its own units, before conversion.
struct WrittenColumn {
  std::string header;  ///< header cell of the column, with its unit
  std::vector<double> values;
};

struct FitColumns {
  std::string name;  ///< name of the file of measured friction

  /// Columns in SI units. v is empty if the file has no speed; x is the integral of v if it has no position.
  std::vector<double> t, x, v, load, force;
  /// Position and force on the second axis, if the record is in the plane; else empty.
  std::vector<double> y, force_y;
  bool has_x = false, has_load = false;
  /// Whether the contact is a disc under even pressure that turns about its centre; x is then the path of its
  /// rim, and force the torque over its radius.
  bool disc = false;
  bool planar() const { return !y.empty(); }
  bool replayable = false;  ///< whether `bristle run` can read the file as it is
  std::vector<std::string> ignored_columns;
  std::vector<std::size_t> parts;       ///< for joined files, the first row of each but the first
  std::vector<std::string> understood;  ///< sentences that tell how the file was understood
  std::vector<WrittenColumn> written;   ///< time, path, load and force in the file's own units

  /// Returns whether row i continues the motion of the row before; the first row of each file does not.
  bool follows(std::size_t i) const { return i > 0 && !std::binary_search(parts.begin(), parts.end(), i); }
};

struct FitData {
  FitColumns columns;
  ForceSign sign = ForceSign::by_body;
  bool sign_found = false;  ///< whether the force's sign was found from the data, not given
  unsigned axes = 1;
  /// Measured force by the body, N: positive along the motion. In the plane, all x components, then all y.
  std::vector<double> force;
  std::vector<double> load;  ///< normal load used by the fit, N

  /// Velocity for terms that depend on speed, m/s; in the plane, all x components, then all y.
  std::vector<double> velocity;
  std::vector<PathPoint> path;  ///< samples of the motion, with turning points between them

  /// Whether the load varies so little that the fit takes it as constant.
  bool steady_load = false;
  double quantum = 0.0;                 ///< encoder's count, m; 0: none found
  double position_noise = 0.0;          ///< standard deviation of position noise, m
  double range = 0.0, travelled = 0.0;  ///< extent of the path; distance travelled, m
  double finest_move = 0.0;             ///< 10th percentile of moves between samples, m
  int reversals = 0;
  double slow = 0.0, fast = 0.0;  ///< 10th and 90th percentile of speed while moving, m/s

  /// Ratio of fast to slow speed while moving; on one axis, the larger of the two directions' ratios.
  double ratio_of_speeds = 1.0;
  double mean_load = 0.0, force_scale = 0.0;  ///< mean normal load; rms of the force, N
  double sample_time = 0.0;                   ///< median interval between samples, s

  /// 10th and 90th percentile of the normal load while moving, N.
  double least_load = 0.0, most_load = 0.0;
  std::size_t samples() const { return load.size(); }
  double start() const { return columns.t.front(); }
  double length() const { return columns.t.back() - columns.t.front(); }
};

/// Parses the columns of a file of measured friction. Throws UserError naming file, line and column.
FitColumns parse_fit_columns(std::string_view text, const std::string& name, const FitReading& reading = {});

/// Joins several records into one: clocks that restart are continued, and the brush begins each record with
/// no memory of the one before. Throws UserError where their columns differ.
FitColumns join_fit_columns(std::vector<FitColumns> records);
/// Reads several files of measured friction and joins them into one record.
FitColumns read_fit_columns(const std::vector<std::string>& files, const FitReading& reading);

/// Checks columns given in memory (t, x, force, and load unless empty) by the rules for files; error messages
/// name a row, counted from 0. Throws UserError.
void check_fit_columns(const FitColumns& columns);

/// Returns positions (m) without an encoder's staircase; sets `quantum` to the encoder's count (0: none).
std::vector<double> smoothed_positions(const FitColumns& columns, const std::vector<double>& x,
                                       double& quantum);

/// Estimates the noise of positions (m) from the median of second differences, to which motion adds little.
/// `least` is a lower limit: smoothed encoder positions are wrong by 0.2 counts, at most by half.
double position_noise(const std::vector<double>& x, double least);

/// Makes the path that a fit replays: the samples, and the turning points between them, which sampling misses
/// though friction reverses there. Parabolas through samples find them.
std::vector<PathPoint> make_path(const std::vector<double>& t, const std::vector<double>& x,
                                 const std::vector<double>& load, double noise);

/// Prepares measured columns for a fit. `load` replaces the column of loads. `mass` (kg) moves with the force
/// sensor, so its inertia is subtracted. Throws UserError on data that determine no parameter.
FitData prepare_fit_data(FitColumns columns, ForceSign sign, std::optional<double> load, double mass = 0.0);

/// Thins out samples within rests, where nothing changes: the longer the rest, the fewer samples stay.
FitData without_rests(const FitData& data);

/// Returns a record that has the force only of the samples `stay` (indices, in order), but the whole motion.
FitData with_samples(const FitData& data, const std::vector<std::size_t>& stay);

/// Returns a record of at most `most` evenly chosen samples and the turning points between them. Sign, noise
/// and speeds stay those of the whole record.
FitData thinned(const FitData& data, std::size_t most);

}  // namespace cli
