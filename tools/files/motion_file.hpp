// Reads a motion file: CSV with time, position (or velocity) and load. Format: tools/scenes/README.md.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace cli {

struct MotionRow {
  double t = 0.0;     ///< s, strictly ascending over the rows
  double x = 0.0;     ///< m
  double y = 0.0;     ///< m, position along y; 0 without a column y
  double load = 0.0;  ///< N, normal load; 0 without a column load
};

struct MotionFile {
  std::string name;
  std::vector<MotionRow> rows;  ///< two at least
  bool has_y = false;           ///< whether there is a column y or vy
  bool has_load = false;
  bool from_velocity = false;  ///< whether positions are integrals of vx, vy (trapezoids)
  std::vector<std::string> ignored_columns;
};

/// Reads a motion file. Loads from -clip_load_n to 0 count as 0, because a force sensor's zero is never
/// exact. Throws UserError naming file, line and column.
MotionFile read_motion_file(const std::string& path, double clip_load_n = 0.0);

/// As read_motion_file(), for text in memory; `name` stands for the file in messages.
MotionFile parse_motion_file(std::string_view text, const std::string& name, double clip_load_n = 0.0);

}  // namespace cli
