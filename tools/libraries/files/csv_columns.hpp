// Parses CSV files that have a header: finds columns by name, converts units given in brackets, and reports
// errors with line numbers. Used by all readers of CSV.
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
  /// Number of these units in one SI unit (1000 for mm). Values are divided by it: dividing by a power of ten
  /// rounds once, multiplying by its inverse twice.
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
inline constexpr Unit frequency_units[] = {{"Hz", 1.0}, {"kHz", 1e-3}};
inline constexpr Unit mass_units[] = {{"kg", 1.0}, {"g", 1e3}, {"mg", 1e6}};

/// Largest magnitudes that a CSV column of each kind may have, SI units: the limits of scenes, and times of
/// any clock.
inline constexpr double most_time = 1e12, most_length = 1e6, most_speed = 1e6, most_force = 1e9;

struct ColumnKind {
  std::string_view name;
  std::span<const Unit> units;
  /// Largest magnitude allowed for a value in this column, SI units.
  double most = std::numeric_limits<double>::max();
};

struct CsvHeader {
  std::vector<bool> present;               ///< whether the file has a column of each kind
  std::vector<double> per_si;              ///< for each kind, how many of the column's units make one SI unit
  std::vector<std::string> other_columns;  ///< names of columns that are of no known kind

  /// Header line in standard form, for the reader of rows: the columns' standard names without units, "-" for
  /// unknown columns.
  std::string canonical;
};

/// Skips the byte order mark and leading comment lines of CSV text, and returns the text from its header on.
/// Sets `header_line` to the header's line number. Throws UserError if nothing is left; its message shows
/// `expected` as an example of a header.
std::string_view skip_to_header(std::string_view text, const std::string& name, std::string_view expected,
                                std::size_t& header_line);

/// Finds a unit by its name or another spelling ("µm", "Nm", "sec"); returns null for an unknown unit.
const Unit* find_unit(std::span<const Unit> units, std::string_view name);
/// Returns the names of units as a text for messages, such as "N, mN, uN".
std::string unit_names(std::span<const Unit> units);
/// Parses a quantity such as "2N", "0.5 mm/s" or "3" (without a unit: in the first of `units`). Returns its
/// SI value. Throws UserError, which calls the quantity `what`.
double parse_quantity(std::string_view text, std::span<const Unit> units, const std::string& what);

/// Parses a CSV header such as "x [mm],load". Throws UserError on an unknown unit and on a column that occurs
/// twice.
CsvHeader read_csv_header(std::string_view line, const std::string& where, std::span<const ColumnKind> kinds);

std::string_view trim(std::string_view text);

/// Check a row of a CSV file: its time must be later than the last row's, and its load must be at least 0.
/// Throw UserError.
void require_later(double t, double last_t, const std::string& where);
void require_load(double load_n, std::string_view cell, const std::string& where);

/// Parses a CSV cell that must be one finite number. Throws a UserError that begins with `where` (file and
/// line) and names the column and the reason.
double parse_number(std::string_view cell, std::string_view column, const std::string& where);
/// Parses a CSV cell and converts it to SI units. Refuses a value beyond the limit of its kind of column
/// (ColumnKind::most).
double parse_cell(std::string_view cell, const ColumnKind& kind, double per_si, const std::string& where);
/// Refuses a position that was integrated from velocities and is larger than a position column may hold.
void require_near(double position_m, const std::string& where);

}  // namespace cli
