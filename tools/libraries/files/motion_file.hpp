// Reads a motion file: CSV with time, position or velocity, and load. The format is described in
// tools/scenes/README.md.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace cli {

struct MotionRow {
  double t = 0.0;     ///< time, s, strictly ascending over the rows
  double x = 0.0;     ///< position, m
  double y = 0.0;     ///< second coordinate, m; 0 without a column y
  double load = 0.0;  ///< normal load, N; 0 without a column load
};

struct MotionFile {
  std::string name;
  std::vector<MotionRow> rows;  ///< rows of the file, at least two
  bool has_y = false;           ///< whether the file has a column y or vy
  bool has_load = false;
  bool from_velocity = false;  ///< whether positions were integrated from the columns vx, vy
  std::vector<std::string> ignored_columns;
};

/// Reads a motion file. Loads from -clip_load_n (N) to 0 become 0, because a force sensor's zero is never
/// exact. Throws UserError naming file, line and column.
MotionFile read_motion_file(const std::string& path, double clip_load_n = 0.0);

/// Parses a motion file's text in memory as read_motion_file() does; messages call the file `name`.
MotionFile parse_motion_file(std::string_view text, const std::string& name, double clip_load_n = 0.0);

}  // namespace cli
