// Parses CSV files with a header: columns by name, units in brackets, errors with line numbers. For all
// readers of CSV.
#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace cli {

struct Unit {
  std::string_view name;
  /// Number of this unit in one SI unit. Dividing by a power of ten rounds once; multiplying by its inverse,
  /// twice.
  double per_si;
};
inline constexpr Unit time_units[] = {{"s", 1.0}, {"ms", 1e3}, {"us", 1e6}, {"min", 1.0 / 60.0}};
inline constexpr Unit length_units[] = {{"m", 1.0}, {"cm", 1e2}, {"mm", 1e3}, {"um", 1e6}, {"nm", 1e9}};
inline constexpr Unit speed_units[] = {{"m/s", 1.0},  {"cm/s", 1e2},   {"mm/s", 1e3},   {"um/s", 1e6},
                                       {"nm/s", 1e9}, {"m/min", 60.0}, {"mm/min", 6e4}, {"um/min", 6e7}};
inline constexpr Unit force_units[] = {{"N", 1.0},   {"mN", 1e3},           {"uN", 1e6},
                                       {"kN", 1e-3}, {"gf", 1e3 / 9.80665}, {"kgf", 1.0 / 9.80665}};
inline constexpr Unit angle_units[] = {
    {"rad", 1.0}, {"mrad", 1e3}, {"deg", 57.29577951308232}, {"rev", 0.15915494309189535}};
inline constexpr Unit torque_units[] = {
    {"N m", 1.0}, {"mN m", 1e3}, {"uN m", 1e6}, {"N mm", 1e3}, {"N cm", 1e2}};
inline constexpr Unit compliance_units[] = {{"m/N", 1.0}, {"mm/N", 1e3}, {"um/N", 1e6}, {"nm/N", 1e9}};
inline constexpr Unit mass_units[] = {{"kg", 1.0}, {"g", 1e3}, {"mg", 1e6}};

/// Largest magnitudes of values in a column, SI units: the limits of scenes, and times of any clock.
inline constexpr double most_time = 1e12, most_length = 1e6, most_speed = 1e6, most_force = 1e9;

struct ColumnKind {
  std::string_view name;
  std::span<const Unit> units;
  /// Largest magnitude of a value, SI units.
  double most = std::numeric_limits<double>::max();
  /// Other names under which files may have this column, in lower case.
  std::span<const std::string_view> aliases = {};
};

struct CsvHeader {
  std::vector<bool> present;               ///< whether the file has a column of this kind, by kind of column
  std::vector<double> per_si;              ///< number of the column's units in one SI unit, by kind of column
  std::vector<std::string> other_columns;  ///< names of the file's columns of unknown kind

  /// Header line for the splitter: our names of the columns without units, "-" for others.
  std::string canonical;
};

/// Returns `text` without byte order mark and leading comment lines, and sets `header_line` to the number of
/// the line it then begins with. Throws UserError, which shows `expected` as an example of a header, if there
/// is no text.
std::string_view skip_to_header(std::string_view text, const std::string& name, std::string_view expected,
                                std::size_t& header_line);

/// Finds a unit by name, in any of its spellings ("µm", "Nm", "sec"); null if it is none of these.
const Unit* find_unit(std::span<const Unit> units, std::string_view name);
/// Returns the names of the units as a list such as "N, mN, uN".
std::string unit_names(std::span<const Unit> units);
/// Parses a quantity such as "2N", "0.5 mm/s" or "3" (in the first of `units`); returns its value in SI
/// units. Throws UserError, which calls the quantity `what`.
double parse_quantity(std::string_view text, std::span<const Unit> units, const std::string& what);

/// Parses a header such as "x [mm],load". Throws UserError on an unknown unit and on a column that comes
/// twice.
CsvHeader read_csv_header(std::string_view line, const std::string& where, std::span<const ColumnKind> kinds);

std::string_view trim(std::string_view text);

/// Check a row: the time must be later than in the row before, the load not negative. Throw UserError.
void require_later(double t, double last_t, const std::string& where);
void require_load(double load_n, std::string_view cell, const std::string& where);

/// Parses a cell that must be one finite number. Throws UserError with `where` (file and line), column and
/// reason.
double parse_number(std::string_view cell, std::string_view column, const std::string& where);
/// Parses a cell and returns its value in SI units. Refuses a value beyond the limit of its kind of column.
double parse_cell(std::string_view cell, const ColumnKind& kind, double per_si, const std::string& where);
/// Refuses a position, integrated from velocities, that is too large for a position column.
void require_near(double position_m, const std::string& where);

}  // namespace cli
