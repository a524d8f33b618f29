// Measured friction for `bristle fit`: reads the file, finds the sign of the force, undoes what an encoder
// and slow sampling do to the path, and refuses what nothing can be learnt from. Format: README.md of this
// folder.
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

/// Whose force the column holds. On the body it opposes the motion, by the body it points along.
enum class ForceSign : unsigned char { automatic, on_body, by_body };

/// The user's words on a file: facts that it lacks, names that it gives. Names of columns are those of
/// tools/README.md (t, x, v, load, force, y, fx, fy, angle, torque).
struct FitReading {
  ColumnWords columns;           ///< ours, the file's header or place from 1
  ColumnWords units;             ///< ours, the unit
  std::optional<double> speed;   ///< m/s, of a motion that no column has
  std::optional<double> radius;  ///< m, at which angle and torque act
  bool disc = false;             ///< the contact is a full disc of this radius, not a ring
  double clip_load = 0.0;        ///< N: loads from -clip_load to 0 count as 0
  bool automatic() const { return columns.empty() && units.empty() && !speed && !radius && clip_load == 0.0; }
};

/// A column of the file, before anything was done to it.
struct WrittenColumn {
  std::string header;  ///< with its unit
  std::vector<double> values;
};

struct FitColumns {
  std::string name;  ///< of the file
  std::vector<double> t, x, v, load,
      force;                       ///< SI units; v empty without a column, x integrated where only v is there
  std::vector<double> y, force_y;  ///< of a record in the plane; else empty
  bool has_x = false, has_load = false;
  bool disc = false;  ///< turns about its middle under an even pressure: x and force (torque over radius) are
                      ///< those at its rim
  bool planar() const { return !y.empty(); }
  bool replayable = false;  ///< `run` can read it as a motion file
  std::vector<std::string> ignored_columns;
  std::vector<std::size_t> parts;       ///< first rows of the second file and of those after it
  std::vector<std::string> understood;  ///< how the file was read, a sentence each
  std::vector<WrittenColumn> written;   ///< time, way, load and force, where a file has them
  /// Whether row i follows the row before in one motion.
  bool follows(std::size_t i) const { return i > 0 && !std::binary_search(parts.begin(), parts.end(), i); }
};

struct FitData {
  FitColumns columns;
  ForceSign sign = ForceSign::by_body;
  bool sign_found = false;  ///< from the data, not given
  unsigned axes = 1;
  std::vector<double> force;     ///< N, by the body: positive along the motion. Two axes: all x, then all y
  std::vector<double> load;      ///< N, as the fit uses it
  std::vector<double> velocity;  ///< m/s, for what goes with the speed; as `force`
  std::vector<PathPoint> path;   ///< samples and the turning points between them
  bool steady_load = false;      ///< it wobbles so little that it is taken as constant
  double quantum = 0.0;          ///< m, of an encoder; 0: none seen
  double position_noise = 0.0;   ///< m
  double range = 0.0, travelled = 0.0;  ///< m
  double finest_move = 0.0;             ///< m, between samples: a tenth of the moves are shorter
  int reversals = 0;
  double longest_rest = 0.0;      ///< s, between motions
  double slow = 0.0, fast = 0.0;  ///< m/s, a tenth of the moving samples is slower, a tenth faster
  double ratio_of_speeds = 1.0;   ///< fast over slow, of one axis towards the side where it is more
  double mean_load = 0.0, force_scale = 0.0;  ///< N, force: rms
  double sample_time = 0.0;                   ///< s, median
  double least_load = 0.0, most_load = 0.0;   ///< N, of moving samples: a tenth is below, a tenth above
  std::size_t samples() const { return load.size(); }
  double start() const { return columns.t.front(); }
  double length() const { return columns.t.back() - columns.t.front(); }
};

/// Throws UserError naming file, line and column.
FitColumns parse_fit_columns(std::string_view text, const std::string& name, const FitReading& reading = {});

/// One record of several: their clocks are joined where they restart, and what the contact remembers is
/// not carried from one to the next. Throws UserError where their columns differ.
FitColumns join_fit_columns(std::vector<FitColumns> records);
/// Reads and joins.
FitColumns read_fit_columns(const std::vector<std::string>& files, const FitReading& reading);

/// Checks as of a file, for t, x, force and, unless empty, load that are in memory: errors name a row, from
/// 0. Throws UserError.
void check_fit_columns(const FitColumns& columns);

/// `load`: in place of the file's column. `mass` (kg) moves with the force sensor: its inertia is taken off.
/// Throws UserError on data that nothing can be learnt from.
FitData prepare_fit_data(FitColumns columns, ForceSign sign, std::optional<double> load, double mass = 0.0);

/// A record without most samples of its rests, in which nothing new happens: they thin out as they grow old.
FitData without_rests(const FitData& data);

/// Bristles that keep their lengths are straight together again where they began, and snap there all at once.
/// Where the position is known to a count of an encoder only, what samples about that place say of the length
/// is wrong by more than their number tells: they are passed without a force, half of the record at most.
/// Twenty counts, by measurement: of 24 records 14 intervals of the length held with one, 20 or 21 with 16 or
/// 25.
FitData without_origin(const FitData& data);

/// A record of at most `most` samples, evenly taken, and the turning points between them. What was found of
/// the whole (sign, noise, speeds) stays. `kept`: which samples, if wanted.
FitData thinned(const FitData& data, std::size_t most, std::vector<std::size_t>* kept = nullptr);

}  // namespace cli
