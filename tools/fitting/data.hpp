// Prepares measured friction for `bristle fit`: reads the file, finds the sign of the force, undoes the
// effects of an encoder and of slow sampling on the path, and refuses data that determine nothing. Format:
// README.md of this folder.
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tools/files/foreign_csv.hpp"
#include "tools/fitting/path_force.hpp"

namespace cli {

/// Sign convention of the force column. The force on the body opposes the motion; the force by the body
/// points along it.
enum class ForceSign : unsigned char { automatic, on_body, by_body };

/// Facts about a file that the user gives: units, names and quantities that the file lacks. Column names are
/// those of tools/README.md (t, x, v, load, force, y, fx, fy, angle, torque).
struct FitReading {
  ColumnWords columns;           ///< pairs of a column name and the file's header or column number (from 1)
  ColumnWords units;             ///< pairs of a column name and its unit
  std::optional<double> speed;   ///< m/s, constant speed, for a file without a column of position or speed
  std::optional<double> stroke;  ///< m, length of strokes to and fro at this speed; else it is one way
  std::string position;          ///< file of another logger with the motion; empty: none
  double clock = 0.0;            ///< s, added to the times of `position`
  std::optional<double> radius;  ///< m, radius at which angle and torque are converted
  bool disc = false;             ///< whether the contact is a full disc of this radius, not a ring
  double clip_load = 0.0;        ///< N, loads from -clip_load to 0 count as 0
  bool automatic() const {
    return columns.empty() && units.empty() && !speed && position.empty() && !radius && clip_load == 0.0;
  }
};

/// Column as the file has it, before conversion.
struct WrittenColumn {
  std::string header;  ///< header cell of the column, with its unit
  std::vector<double> values;
};

struct FitColumns {
  std::string name;  ///< name of the file

  /// Columns in SI units. v is empty if the file has no such column; if it has v but not x, x is integrated.
  std::vector<double> t, x, v, load, force;
  /// Position and force on the second axis of a record in the plane; else empty.
  std::vector<double> y, force_y;
  bool has_x = false, has_load = false;
  /// Whether the contact is a disc under even pressure that turns about its middle; then x and force (torque
  /// over radius) are those at its rim.
  bool disc = false;
  bool planar() const { return !y.empty(); }
  bool replayable = false;  ///< whether `bristle run` can read the file as a motion file
  std::vector<std::string> ignored_columns;
  std::vector<std::size_t> parts;  ///< first row of each file after the first
  std::vector<PathPoint> turns;    ///< known turning points between rows, in order of time; loads are unset
  double quantum = 0.0;            ///< m, count of the encoder that positions are already free of
  std::vector<std::string> understood;  ///< sentences on how the file was read
  std::vector<WrittenColumn> written;   ///< columns of time, path, load and force in the file's own units

  /// Returns whether row i continues the motion of the row before.
  bool follows(std::size_t i) const { return i > 0 && !std::binary_search(parts.begin(), parts.end(), i); }
};

struct FitData {
  FitColumns columns;
  ForceSign sign = ForceSign::by_body;
  bool sign_found = false;  ///< whether the sign of the force was determined from the data and not given
  unsigned axes = 1;
  /// N, measured force by the body: positive along the motion. In the plane all x components, then all y.
  std::vector<double> force;
  std::vector<double> load;  ///< N, normal load that the fit uses

  /// m/s, velocity for terms that depend on speed; components ordered as in `force`.
  std::vector<double> velocity;
  std::vector<PathPoint> path;  ///< samples, and the turning points between them

  /// Whether the load varies so little that the fit takes it as constant.
  bool steady_load = false;
  double quantum = 0.0;                 ///< m, count of an encoder; 0: none seen
  double position_noise = 0.0;          ///< m, standard deviation of the noise of the position
  double range = 0.0, travelled = 0.0;  ///< m, extent of the path and distance travelled
  double finest_move = 0.0;             ///< m, tenth percentile of the moves between samples
  int reversals = 0;
  double longest_rest = 0.0;      ///< s, longest rest between two motions
  double slow = 0.0, fast = 0.0;  ///< m/s, tenth and ninetieth percentile of the moving samples' speeds

  /// Ratio of fast to slow speed; on one axis, in the direction where the ratio is larger.
  double ratio_of_speeds = 1.0;
  double mean_load = 0.0, force_scale = 0.0;  ///< N; force_scale is the rms of the force
  double sample_time = 0.0;                   ///< s, median interval between samples

  /// N, tenth and ninetieth percentile of the moving samples' loads.
  double least_load = 0.0, most_load = 0.0;
  std::size_t samples() const { return load.size(); }
  double start() const { return columns.t.front(); }
  double length() const { return columns.t.back() - columns.t.front(); }
};

/// Parses columns of measured friction. Throws UserError naming file, line and column.
FitColumns parse_fit_columns(std::string_view text, const std::string& name, const FitReading& reading = {});

/// Parses and merges the columns of the force and, from the file reading.position, of the motion. Throws
/// UserError where their times do not overlap.
FitColumns merge_fit_columns(std::string_view force, const std::string& name, std::string_view motion,
                             const FitReading& reading);

/// Joins several records into one: clocks that restart are continued, and the contact forgets its state
/// between records. Throws UserError where their columns differ.
FitColumns join_fit_columns(std::vector<FitColumns> records);
/// Reads several files and joins them.
FitColumns read_fit_columns(const std::vector<std::string>& files, const FitReading& reading);

/// Checks columns in memory (t, x, force and, unless empty, load) as those of a file; errors name a row, from
/// 0. Throws UserError.
void check_fit_columns(const FitColumns& columns);

/// Returns positions (m) without the staircase of an encoder, whose count `quantum` is then, else 0.
std::vector<double> smoothed_positions(const FitColumns& columns, const std::vector<double>& x,
                                       double& quantum);

/// Estimates the noise of the position (m) from the median of its second differences, to which motion adds
/// little. A smoothed encoder count is wrong by about 0.2 of it, at most by half.
double position_noise(const std::vector<double>& x, double least);

/// Makes a path of the samples and, between them, the turning points of parabolas through three samples each.
std::vector<PathPoint> make_path(const std::vector<double>& t, const std::vector<double>& x,
                                 const std::vector<double>& load, double noise);

/// Prepares the data. `load` replaces the file's column. `mass` (kg) moves with the force sensor: its inertia
/// is subtracted. Throws UserError on data that determine nothing.
FitData prepare_fit_data(FitColumns columns, ForceSign sign, std::optional<double> load, double mass = 0.0);

/// Thins out the samples within rests, in which nothing new happens, the more the longer the rest lasts.
FitData without_rests(const FitData& data);

/// Leaves out samples near where the contact began, half of the record at most. Kept bristles are all
/// straight there again and snap together, so an encoder's count of position error misleads about the length
/// by more than the number of samples suggests. The zone is twenty counts, by measurement: of 24 records 14
/// intervals of the length held with one count, 20 or 21 with 16 or 25.
FitData without_origin(const FitData& data);

/// Returns a record of at most `most` evenly chosen samples and the turning points between them. Properties
/// of the whole (sign, noise, speeds) stay. `kept`, if wanted, gets the indices of the samples.
FitData thinned(const FitData& data, std::size_t most, std::vector<std::size_t>* kept = nullptr);

}  // namespace cli
