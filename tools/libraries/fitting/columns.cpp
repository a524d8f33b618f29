// Reads the CSV files of measured friction for `bristle fit`, and converts their columns to SI units.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "tools/libraries/files/csv_rows.hpp"
#include "tools/libraries/files/foreign_csv.hpp"
#include "tools/libraries/files/text_file.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/fitting/data.hpp"

namespace cli {
namespace {

enum Column : unsigned {
  column_t,
  column_x,
  column_v,
  column_vx,
  column_speed,
  column_load,
  column_force,
  column_fx,
  column_friction,
  column_y,
  column_fy,
  column_angle,
  column_torque,
  column_count
};
/// Unit name "g" of a column of loads. Tribometers mean by it the weight of a gram, not a mass.
constexpr std::string_view grams = "g";
constexpr Unit weighed_units[] = {{"N", 1.0},
                                  {"mN", 1e3},
                                  {"uN", 1e6},
                                  {"kN", 1e-3},
                                  {"gf", 1e3 / 9.80665},
                                  {"kgf", 1.0 / 9.80665},
                                  {grams, 1e3 / 9.80665},
                                  {"lbf", 1.0 / 4.4482216152605},
                                  {"kip", 1e-3 / 4.4482216152605}};
constexpr Unit position_units[] = {{"m", 1.0},  {"cm", 1e2},          {"mm", 1e3},           {"um", 1e6},
                                   {"nm", 1e9}, {"in", 1.0 / 0.0254}, {"inch", 1.0 / 0.0254}};
/// Units in which a file may give a speed. The last three are angular; the speed is then that of a point at
/// the radius --radius.
constexpr Unit moving_units[] = {{"m/s", 1.0},
                                 {"cm/s", 1e2},
                                 {"mm/s", 1e3},
                                 {"um/s", 1e6},
                                 {"nm/s", 1e9},
                                 {"m/min", 60.0},
                                 {"mm/min", 6e4},
                                 {"um/min", 6e7},
                                 {"in/s", 1.0 / 0.0254},
                                 {"rad/s", 1.0},
                                 {"deg/s", 57.29577951308232},
                                 {"rpm", 9.549296585513721}};
bool turns_in(std::string_view unit) { return unit == "rad/s" || unit == "deg/s" || unit == "rpm"; }
constexpr ColumnKind kinds[column_count] = {{"t", time_units, most_time},
                                            {"x", position_units, most_length},
                                            {"v", moving_units, most_speed},
                                            {"vx", moving_units, most_speed},
                                            {"speed", moving_units, most_speed},
                                            {"load", weighed_units, most_force},
                                            {"force", weighed_units, most_force},
                                            {"fx", weighed_units, most_force},
                                            {"friction", weighed_units, most_force},
                                            {"y", position_units, most_length},
                                            {"fy", weighed_units, most_force},
                                            {"angle", angle_units, most_length},
                                            {"torque", torque_units, most_force}};
constexpr const char* expected = "t,x,load,force";

// Columns that exclude each other: a file may have only one column for position, one for speed, one for
// force.
constexpr unsigned position_columns[] = {column_x, column_angle},
                   speed_columns[] = {column_v, column_vx, column_speed},
                   force_columns[] = {column_force, column_fx, column_friction, column_torque};

/// Returns which of several alternative columns a CSV header has; column_count if it has none.
unsigned pick(const CsvHeader& header, std::span<const unsigned> names, const std::string& where) {
  unsigned found = column_count;
  for (const unsigned c : names) {
    if (!header.present[c]) continue;
    if (found != column_count)
      throw UserError(
          fmt::format("{}: columns {} and {} together: give one", where, kinds[found].name, kinds[c].name));
    found = c;
  }
  return found;
}

bool varies(const std::vector<double>& column) {
  return std::any_of(column.begin(), column.end(), [&](double value) { return value != column.front(); });
}

/// Decides whether a record of friction has one axis or two. Two axes need the columns y and fy. If both are
/// constant, as `bristle run` writes them for a patch on one axis, the record has one axis.
void settle_axes(FitColumns& data, bool has_y, bool has_fy) {
  const bool moves = has_y && varies(data.y), measured = has_fy && varies(data.force_y);
  if (moves && !has_fy)
    throw UserError(data.name +
                    ": column y varies, and there is no column fy: add the force along y, or leave "
                    "out column y if that motion has no part in the friction");
  if (moves && measured) {
    if (!data.has_x)
      throw UserError(data.name + ": a record in the plane needs the positions x and y; here is no column x");
    if (!data.v.empty()) data.v.clear();
    return;
  }
  if (moves)
    throw UserError(data.name +
                    ": column y varies, and column fy is one value throughout: no friction of a "
                    "motion in the plane");
  if (has_y && !moves) data.ignored_columns.push_back("y");
  if (has_fy) data.ignored_columns.push_back("fy");
  data.y.clear();
  data.force_y.clear();
}

std::vector<ColumnWish> wishes_of(FitReading reading) {
  for (ColumnWords* const words : {&reading.columns, &reading.units})
    for (auto& [ours, theirs] : *words) {
      if (ours == "f") ours = "force";
      if (ours == "n") ours = "load";
    }
  return column_wishes(kinds, reading.columns, reading.units);
}

bool is_record(const std::vector<bool>& present, const FitReading& reading) {
  const auto any = [&](std::span<const unsigned> of) {
    return std::any_of(of.begin(), of.end(), [&](unsigned c) { return present[c]; });
  };
  return (present[column_t] || reading.rate) && (any(position_columns) || any(speed_columns)) &&
         any(force_columns);
}

/// Columns of a file that give position, speed and force; column_count for a quantity that the file lacks.
struct Choice {
  unsigned x = column_count, v = column_count, force = column_count;
};

/// Returns a sentence with the numbers of those columns of a file that have no name in the header; an empty
/// text if all have one.
std::string unnamed_columns(const PlainCsv& csv) {
  std::string all;
  for (const std::size_t column : csv.unnamed) all += fmt::format("{}{}", all.empty() ? "" : ", ", column);
  return all.empty() ? all : fmt::format("; column {} has no name: give it one in the header", all);
}

Choice choose(const CsvHeader& header, const PlainCsv& csv, const FitReading& reading,
              const std::string& where) {
  const Choice choice{pick(header, position_columns, where), pick(header, speed_columns, where),
                      pick(header, force_columns, where)};
  const auto need = [&](bool ok, const char* what, const std::string& help) {
    if (!ok)
      throw UserError(fmt::format("{}: header '{}' has no {}; expected {}, or your own names: {}{}", where,
                                  trim(csv.header), what, expected, help, unnamed_columns(csv)));
  };
  need(header.present[column_t] || reading.rate, "column t",
       "--columns t=NAME; or give the samples per second: --rate 100Hz");
  need(choice.x != column_count || choice.v != column_count, "column x (nor v, speed)", "--columns x=NAME");
  need(choice.force != column_count, "column force (nor fx, friction): as it stands, no force was measured",
       "--columns force=NAME");
  if (reading.rate && header.present[column_t])
    throw UserError(where + ": --rate is for files without time, and here is column t");
  const bool spins = choice.v != column_count && turns_in(csv.units[choice.v]);
  const bool turns = choice.x == column_angle || (choice.x == column_count && spins),
             twists = choice.force == column_torque;
  if ((turns || twists) && !reading.radius)
    throw UserError(
        fmt::format("{}: column {} needs the radius at which it acts: --radius 20mm (a ring: its "
                    "mean radius), or that of a full disc: --disc 20mm",
                    where,
                    twists  ? "torque"
                    : spins ? kinds[choice.v].name
                            : "angle"));
  if (choice.x != column_count && turns != twists)
    throw UserError(fmt::format("{}: column {} goes with column {}", where, turns ? "angle" : "torque",
                                turns ? "torque" : "angle"));
  if (reading.radius && !turns && !twists)
    throw UserError(
        fmt::format("{}: --{} is for columns angle and torque, or a speed in rpm, rad/s or deg/s, "
                    "and here are none",
                    where, reading.disc ? "disc" : "radius"));
  return choice;
}

/// Warns if the times of a file, whose header names no unit of time, look like milliseconds.
void doubt_time(const PlainCsv& csv, FitColumns& data) {
  if (!csv.units[column_t].empty() || data.t.size() < 2) return;
  const double between = (data.t.back() - data.t.front()) / static_cast<double>(data.t.size() - 1);
  if (between >= 0.5)
    data.understood.push_back(fmt::format(
        "column t states no unit: rows are taken to be {:.3g} s apart; if these are ms, give --units t=ms",
        between));
}

/// Reverses the sign of the loads if none is positive: the sensor then counts pressing as negative.
void settle_load_sign(FitColumns& data) {
  if (data.load.empty() || *std::max_element(data.load.begin(), data.load.end()) > 0.0) return;
  if (!varies(data.load) && data.load.front() == 0.0) return;
  for (double& load : data.load) load = -load;
  data.understood.push_back("all loads are negative: taken with the other sign, as pressing");
  data.replayable = false;
}

/// Returns the end of an error message about a normal load: which loads are allowed, and which option helps.
std::string allowed_loads(const FitReading& reading) {
  return fmt::format("allowed: {}; --clip-load NEWTONS takes what a sensor shows at zero load as 0",
                     reading.clip_load > 0.0 ? fmt::format("{} N or more (--clip-load)", -reading.clip_load)
                                             : std::string("0 or more"));
}

/// Returns the normal load (N) of a row. With --clip-load, small negative loads, which are the sensor's noise
/// out of contact, count as 0; otherwise negative loads throw.
double clipped(double load, std::string_view cell, const FitReading& reading, const std::string& where,
               std::size_t& clipped_rows, double& lowest) {
  if (load >= 0.0) return load;
  if (load >= -reading.clip_load) {
    ++clipped_rows;
    lowest = std::min(lowest, load);
    return 0.0;
  }
  throw UserError(fmt::format("{}: column load: {} is negative; {}", where, cell, allowed_loads(reading)));
}

/// Checks a number that a program passes in memory (not in a file) against the range that the column has in
/// files. Throws for a number outside.
void require_within(double value, const ColumnKind& kind, const std::string& where) {
  if (std::fabs(value) <= kind.most) return;
  throw UserError(fmt::format("{}: column {} is {} {}; allowed: {} to {}", where, kind.name, value,
                              kind.units.front().name, -kind.most, kind.most));
}

}  // namespace

FitColumns parse_fit_columns(std::string_view text, const std::string& name, const FitReading& reading) {
  FitColumns data;
  data.name = name;
  std::size_t first_line = 1;
  text = skip_to_header(text, name, expected, first_line);
  const PlainCsv csv =
      plain_csv(text, name, first_line, kinds, wishes_of(reading),
                [&](const std::vector<bool>& present) { return is_record(present, reading); });
  const std::string header_where = fmt::format("{}:{}", name, csv.header_line);
  const std::string_view plain = csv.text;
  const CsvHeader header = read_csv_header(plain.substr(0, plain.find('\n')), header_where, kinds);
  const Choice choice = choose(header, csv, reading, header_where);
  data.has_x = choice.x != column_count;
  data.has_load = header.present[column_load];
  data.replayable = csv.ours && !reading.rate && (choice.x == column_x || choice.v == column_vx);
  data.ignored_columns = header.other_columns;
  const bool has_y = header.present[column_y], has_fy = header.present[column_fy];
  const double lever = reading.radius.value_or(1.0);
  const double speed_lever = choice.v != column_count && turns_in(csv.units[choice.v]) ? lever : 1.0;
  data.disc = reading.disc && reading.radius;
  std::size_t clipped_rows = 0;
  double lowest_load = 0.0;
  // Whether all loads read so far are negative, as a sensor writes them that counts pressing as negative. The
  // first other load clears this.
  bool all_negative = true;
  for_csv_rows(plain, name, csv.header_line, header, kinds, [&](const auto& cells, const auto& where) {
    const auto value = [&](unsigned c) { return parse_cell(cells[c], kinds[c], header.per_si[c], where()); };
    if (!reading.rate && std::string_view(cells[column_t]).find(':') != std::string_view::npos)
      throw UserError(
          fmt::format("{}: column t: '{}' is a time of day; give seconds", where(), cells[column_t]));
    const double t = reading.rate ? static_cast<double>(data.t.size()) / *reading.rate : value(column_t);
    if (!data.t.empty()) require_later(t, data.t.back(), where());
    if (choice.v != column_count) data.v.push_back(speed_lever * value(choice.v));
    if (data.has_x) {
      data.x.push_back(value(choice.x) * (choice.x == column_angle ? lever : 1.0));
    } else if (choice.v != column_count) {
      const std::size_t n = data.t.size();
      data.x.push_back(n ? data.x.back() + 0.5 * (data.v[n - 1] + data.v[n]) * (t - data.t.back()) : 0.0);
      require_near(data.x.back(), where());
    }
    if (data.has_load) {
      const double load = value(column_load);
      const bool turned = load < 0.0 && load < -reading.clip_load && all_negative;
      if (!turned && all_negative && !data.load.empty() && data.load.front() < 0.0)
        throw UserError(fmt::format("{}: column load: negative in the rows before, and here {}; {}", where(),
                                    cells[column_load], allowed_loads(reading)));
      all_negative = turned;
      data.load.push_back(
          turned ? load : clipped(load, cells[column_load], reading, where(), clipped_rows, lowest_load));
    }
    if (choice.force != column_count)
      data.force.push_back(value(choice.force) / (choice.force == column_torque ? lever : 1.0));
    if (has_y) data.y.push_back(value(column_y));
    if (has_fy) data.force_y.push_back(value(column_fy));
    data.t.push_back(t);
  });
  if (!data.t.empty()) settle_axes(data, has_y, has_fy);

  data.understood.push_back(mapping_text(csv, kinds));
  doubt_time(csv, data);
  for (const unsigned c : {unsigned{column_load}, choice.force})
    if (c != column_count && csv.units[c] == grams)
      data.understood.push_back(
          fmt::format("column {}: g is taken as gram-force, 1 g = 9.80665 mN (else --units {}=UNIT)",
                      csv.headers[c], kinds[c].name));
  settle_load_sign(data);
  if (reading.rate)
    data.understood.push_back(fmt::format("{:g} samples per second, as given", *reading.rate));
  if (reading.radius)
    data.understood.push_back(
        data.disc
            ? fmt::format("angle and torque of a full disc under an even pressure, as a path and a force at "
                          "its radius of {:.4g} mm",
                          1e3 * lever)
            : fmt::format("angle and torque as a path and a force at a radius of {:.4g} mm", 1e3 * lever));
  if (clipped_rows > 0) {
    data.understood.push_back(
        fmt::format("{} negative loads, down to {:.3g} N, taken as 0", clipped_rows, lowest_load));
    data.replayable = false;
  }
  return data;
}

FitColumns join_fit_columns(std::vector<FitColumns> records) {
  FitColumns all = std::move(records.front());
  const std::size_t count = records.size();
  if (count == 1) return all;
  std::size_t joined_clocks = 0;
  for (std::size_t k = 1; k < count; ++k) {
    FitColumns& next = records[k];
    if (next.has_x != all.has_x || next.has_load != all.has_load || next.v.empty() != all.v.empty() ||
        next.planar() != all.planar())
      throw UserError(
          fmt::format("{}: its columns (t, x, v, load, force) are not those of {}", next.name, all.name));
    constexpr std::size_t fewest_rows = 3;  // number of rows below which a file gives no velocity
    for (const FitColumns* file : {&all, &next})
      if (file->t.size() < fewest_rows)
        throw UserError(fmt::format("{}: {} data rows; a file of several needs at least {}", file->name,
                                    file->t.size(), fewest_rows));
    all.parts.push_back(all.t.size());
    const double spacing = (all.t.back() - all.t.front()) / static_cast<double>(all.t.size() - 1);
    const bool anew = next.t.front() <= all.t.back();
    const double shift = anew ? all.t.back() + std::max(spacing, 1e-9) - next.t.front() : 0.0;
    joined_clocks += anew ? 1 : 0;
    for (const double t : next.t) all.t.push_back(t + shift);
    const auto append = [](std::vector<double>& to, const std::vector<double>& from) {
      to.insert(to.end(), from.begin(), from.end());
    };
    append(all.x, next.x);
    append(all.v, next.v);
    append(all.load, next.load);
    append(all.force, next.force);
    append(all.y, next.y);
    append(all.force_y, next.force_y);
    for (const std::string& line : next.understood)
      if (std::find(all.understood.begin(), all.understood.end(), line) == all.understood.end())
        all.understood.push_back(next.name + ": " + line);
  }
  all.replayable = false;
  all.understood.push_back(fmt::format(
      "{} files as one record{}: what the contact remembers is not carried from one to the next; the sensor "
      "has one offset and one drift in all of them",
      count, joined_clocks > 0 ? fmt::format(" ({} clocks start anew and are joined)", joined_clocks) : ""));
  all.name += fmt::format(" and {} more", count - 1);
  return all;
}

/// Refuses a file that is no text or no table (such as a spreadsheet), with a message that says how to
/// convert it.
static void require_text(const std::string& file, std::string_view text) {
  const struct {
    const char *ending, *begin, *kind, *convert;
  } others[] = {
      {".json", "{", "JSON", "pandas.read_json('{0}').to_csv('record.csv', index=False)"},
      {".xlsx", "PK", "a spreadsheet", "pandas.read_excel('{0}').to_csv('record.csv', index=False)"},
      {".mat", "MATLAB", "a file of MATLAB",
       "pandas.DataFrame({{k: v.ravel() for k, v in scipy.io.loadmat('{0}').items() if k[0] != '_'}})"
       ".to_csv('record.csv', index=False)"},
      {".h5", "\x89HDF", "HDF5",
       "pandas.DataFrame({{k: v[:].ravel() for k, v in h5py.File('{0}').items()}}).to_csv('record.csv', "
       "index=False)"}};
  for (const auto& other : others)
    if (file.ends_with(other.ending) || text.starts_with(other.begin))
      throw UserError(fmt::format("{}: is {}, not CSV; in Python: {}", file, other.kind,
                                  fmt::format(fmt::runtime(other.convert), file)));
}

FitColumns read_fit_columns(const std::vector<std::string>& files, const FitReading& reading) {
  std::vector<FitColumns> records;
  for (const std::string& file : files) {
    const std::string text = read_text_file(file);
    require_text(file, text);
    records.push_back(parse_fit_columns(text, file, reading));
  }
  return join_fit_columns(std::move(records));
}

void check_fit_columns(const FitColumns& c) {
  const auto require_size = [&](const std::vector<double>& column, const char* name) {
    if (column.size() != c.t.size())
      throw UserError(fmt::format("{}: column {} has {} rows, column t {}; allowed: as many", c.name, name,
                                  column.size(), c.t.size()));
  };
  require_size(c.x, "x");
  require_size(c.force, "force");
  if (c.has_load) require_size(c.load, "load");
  if (c.planar() || !c.force_y.empty()) {
    require_size(c.y, "y");
    require_size(c.force_y, "fy");
  }
  for (std::size_t i = 0; i < c.t.size(); ++i) {
    const std::string where = fmt::format("{}: row {}", c.name, i);
    require_within(c.t[i], kinds[column_t], where);
    require_within(c.x[i], kinds[column_x], where);
    require_within(c.force[i], kinds[column_force], where);
    if (c.planar()) {
      require_within(c.y[i], kinds[column_y], where);
      require_within(c.force_y[i], kinds[column_fy], where);
    }
    if (i > 0) require_later(c.t[i], c.t[i - 1], where);
    if (!c.has_load) continue;
    require_within(c.load[i], kinds[column_load], where);
    require_load(c.load[i], fmt::format("{}", c.load[i]), where);
  }
}

}  // namespace cli
