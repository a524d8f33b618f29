#include "tools/libraries/files/motion_file.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "tools/libraries/files/csv_rows.hpp"
#include "tools/libraries/files/text_file.hpp"
#include "tools/libraries/files/user_error.hpp"

namespace cli {
namespace {

enum Column : unsigned { column_t, column_x, column_y, column_vx, column_vy, column_load, column_count };

constexpr ColumnKind kinds[column_count] = {
    {"t", time_units, most_time},    {"x", length_units, most_length}, {"y", length_units, most_length},
    {"vx", speed_units, most_speed}, {"vy", speed_units, most_speed},  {"load", force_units, most_force}};

CsvHeader read_header(std::string_view line, const std::string& where, MotionFile& file) {
  CsvHeader header = read_csv_header(line, where, kinds);
  file.ignored_columns = header.other_columns;
  const auto need = [&](bool ok, const char* what) {
    // Leaves the first line out of the error if the file names no known column: it may be any private text.
    const bool known = std::find(header.present.begin(), header.present.end(), true) != header.present.end();
    if (!ok && !known)
      throw UserError(fmt::format("{}: names no column of a motion file; expected t,x,y,load", where));
    if (!ok)
      throw UserError(fmt::format("{}: header '{}' has no {}; expected t,x,y,load", where, trim(line), what));
  };
  need(header.present[column_t], "column t");
  need(header.present[column_x] || header.present[column_vx], "column x (nor vx)");
  if (header.present[column_x] && header.present[column_vy] && !header.present[column_y])
    throw UserError(fmt::format("{}: columns x and vy together: give x and y, or vx and vy", where));
  if (!header.present[column_x] && header.present[column_y])
    throw UserError(fmt::format("{}: columns vx and y together: give x and y, or vx and vy", where));
  file.from_velocity = !header.present[column_x];
  file.has_y = header.present[file.from_velocity ? column_vy : column_y];
  file.has_load = header.present[column_load];
  for (const Column column : {column_vx, column_vy}) {
    if (!file.from_velocity && header.present[column]) file.ignored_columns.emplace_back(kinds[column].name);
  }
  return header;
}

/// Returns the normal load of a row, N. Loads from -clip_load_n to 0 count as 0, because a sensor's zero is
/// never exact; lower ones are refused.
double read_load(double load_n, std::string_view cell, double clip_load_n, const std::string& where) {
  if (load_n >= 0.0) return load_n;
  if (load_n >= -clip_load_n) return 0.0;
  throw UserError(fmt::format(
      "{}: column load: {} is negative; allowed: {}; clip_load in the scene's [[motion]], or --clip-load, "
      "takes what a sensor shows at zero load as 0",
      where, cell, clip_load_n > 0.0 ? fmt::format("{} N or more (clip_load)", -clip_load_n) : "0 or more"));
}

}  // namespace

MotionFile parse_motion_file(std::string_view text, const std::string& name, double clip_load_n) {
  MotionFile file;
  file.name = name;
  std::size_t header_line = 1;
  text = skip_to_header(text, name, "t,x,y,load", header_line);
  const CsvHeader header =
      read_header(text.substr(0, text.find('\n')), fmt::format("{}:{}", name, header_line), file);
  double last_vx = 0.0, last_vy = 0.0;
  for_csv_rows(text, name, header_line, header, kinds, [&](const auto& cells, const auto& where) {
    double value[column_count] = {};
    for (unsigned c = 0; c < column_count; ++c) {
      const bool velocity = c == column_vx || c == column_vy;
      if (!header.present[c] || (velocity && !file.from_velocity)) continue;
      value[c] = parse_cell(cells[c], kinds[c], header.per_si[c], where());
    }
    MotionRow row{value[column_t], value[column_x], value[column_y], value[column_load]};
    if (file.has_load) row.load = read_load(row.load, cells[column_load], clip_load_n, where());
    if (!file.rows.empty()) {
      const MotionRow& last = file.rows.back();
      require_later(row.t, last.t, where());
      if (file.from_velocity) {
        row.x = last.x + 0.5 * (last_vx + value[column_vx]) * (row.t - last.t);
        row.y = last.y + 0.5 * (last_vy + value[column_vy]) * (row.t - last.t);
        require_near(row.x, where());
        require_near(row.y, where());
      }
    }
    last_vx = value[column_vx];
    last_vy = value[column_vy];
    file.rows.push_back(row);
  });
  if (file.rows.size() < 2)
    throw UserError(fmt::format("{}: {} data rows; a motion needs at least 2", name, file.rows.size()));
  return file;
}

MotionFile read_motion_file(const std::string& path, double clip_load_n) {
  return parse_motion_file(read_text_file(path), path, clip_load_n);
}

}  // namespace cli
