// The reader of measured friction.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "tools/files/csv_rows.hpp"
#include "tools/files/user_error.hpp"
#include "tools/fitting/data.hpp"

namespace cli {
namespace {

enum Column : unsigned {
  column_t,
  column_x,
  column_v,
  column_vx,
  column_load,
  column_force,
  column_fx,
  column_friction,
  column_y,
  column_fy,
  column_count
};
constexpr ColumnKind kinds[column_count] = {
    {"t", time_units, most_time},      {"x", length_units, most_length},
    {"v", speed_units, most_speed},    {"vx", speed_units, most_speed},
    {"load", force_units, most_force}, {"force", force_units, most_force},
    {"fx", force_units, most_force},   {"friction", force_units, most_force},
    {"y", length_units, most_length},  {"fy", force_units, most_force}};
constexpr const char* expected = "t,x,load,force";

/// The one of several names for a thing that is there; column_count when none is.
unsigned pick(const CsvHeader& header, std::initializer_list<unsigned> names, const std::string& where) {
  unsigned found = column_count;
  for (const unsigned c : names) {
    if (!header.present[c]) continue;
    if (found != column_count) {
      throw UserError(
          fmt::format("{}: columns {} and {} together: give one", where, kinds[found].name, kinds[c].name));
    }
    found = c;
  }
  return found;
}

struct Choice {
  unsigned v = column_count, force = column_count;
};

bool varies(const std::vector<double>& column) {
  return std::any_of(column.begin(), column.end(), [&](double value) { return value != column.front(); });
}

/// A record in the plane has y and fy. Columns y and fy of nothing but one value, as `run` writes them for a
/// patch on one axis, are no second axis.
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

Choice choose(const CsvHeader& header, std::string_view line, const std::string& where) {
  const Choice choice{pick(header, {column_v, column_vx}, where),
                      pick(header, {column_force, column_fx, column_friction}, where)};
  const auto need = [&](bool ok, const char* what) {
    if (!ok)
      throw UserError(
          fmt::format("{}: header '{}' has no {}; expected {}", where, trim(line), what, expected));
  };
  need(header.present[column_t], "column t");
  need(header.present[column_x] || choice.v != column_count, "column x (nor v)");
  need(choice.force != column_count, "column force (nor fx, friction)");
  return choice;
}

/// What parse_cell asks of a cell, of a number.
void require_within(double value, const ColumnKind& kind, const std::string& where) {
  if (std::fabs(value) <= kind.most) return;
  throw UserError(fmt::format("{}: column {} is {} {}; allowed: {} to {}", where, kind.name, value,
                              kind.units.front().name, -kind.most, kind.most));
}

}  // namespace

FitColumns parse_fit_columns(std::string_view text, const std::string& name) {
  FitColumns data;
  data.name = name;
  std::size_t header_line = 1;
  text = skip_to_header(text, name, expected, header_line);
  const std::string header_where = fmt::format("{}:{}", name, header_line);
  const std::string_view line = text.substr(0, text.find('\n'));
  const CsvHeader header = read_csv_header(line, header_where, kinds);
  const Choice choice = choose(header, line, header_where);
  data.has_x = header.present[column_x];
  data.has_load = header.present[column_load];
  data.replayable = data.has_x || choice.v == column_vx;
  data.ignored_columns = header.other_columns;
  const bool has_y = header.present[column_y], has_fy = header.present[column_fy];

  for_csv_rows(text, name, header_line, header, kinds, [&](const auto& cells, const auto& where) {
    const auto value = [&](unsigned c) { return parse_cell(cells[c], kinds[c], header.per_si[c], where()); };
    const double t = value(column_t);
    if (!data.t.empty()) require_later(t, data.t.back(), where());
    if (choice.v != column_count) data.v.push_back(value(choice.v));
    if (data.has_x) {
      data.x.push_back(value(column_x));
    } else {
      const std::size_t n = data.t.size();
      data.x.push_back(n ? data.x.back() + 0.5 * (data.v[n - 1] + data.v[n]) * (t - data.t.back()) : 0.0);
      require_near(data.x.back(), where());
    }
    if (data.has_load) {
      data.load.push_back(value(column_load));
      require_load(data.load.back(), cells[column_load], where());
    }
    data.force.push_back(value(choice.force));
    if (has_y) data.y.push_back(value(column_y));
    if (has_fy) data.force_y.push_back(value(column_fy));
    data.t.push_back(t);
  });
  if (!data.t.empty()) settle_axes(data, has_y, has_fy);
  return data;
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
