// Shared by CSV files with a header: columns by name, units in brackets, numbers by line.
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
  double per_si;  ///< a division by a power of ten rounds once; a product with its inverse would twice
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

/// Largest magnitudes of a column, SI units: what scenes allow, and times of any clock.
inline constexpr double most_time = 1e12, most_length = 1e6, most_speed = 1e6, most_force = 1e9;

struct ColumnKind {
  std::string_view name;
  std::span<const Unit> units;
  double most = std::numeric_limits<double>::max();  ///< SI units; the first unit's name is theirs
  /// Other names of the column, in small letters.
  std::span<const std::string_view> aliases = {};
};

struct CsvHeader {
  std::vector<bool> present;               ///< by kind
  std::vector<double> per_si;              ///< by kind
  std::vector<std::string> other_columns;  ///< not of these kinds
  std::string canonical;                   ///< our names without units, others as "-": for the splitter
};

/// `text` without byte order mark and leading comments, `header_line` the number of its first line. Throws
/// UserError when it holds no text; `expected` is a header that would do.
std::string_view skip_to_header(std::string_view text, const std::string& name, std::string_view expected,
                                std::size_t& header_line);

/// The unit of that name, in any of its spellings ("µm", "Nm", "sec"); null: none of these.
const Unit* find_unit(std::span<const Unit> units, std::string_view name);
/// "N, mN, uN".
std::string unit_names(std::span<const Unit> units);
/// "2N", "0.5 mm/s", "3" (in the first unit), in SI units. Throws UserError naming `what`.
double parse_quantity(std::string_view text, std::span<const Unit> units, const std::string& what);

/// Reads "x [mm],load". Throws UserError on a unit that is not known and on a column that comes twice.
CsvHeader read_csv_header(std::string_view line, const std::string& where, std::span<const ColumnKind> kinds);

std::string_view trim(std::string_view text);

/// Checks of every row: time increases, no load is negative. Throw UserError.
void require_later(double t, double last_t, const std::string& where);
void require_load(double load_n, std::string_view cell, const std::string& where);

/// A finite number, the whole cell. Throws UserError naming `where`, column and reason.
double parse_number(std::string_view cell, std::string_view column, const std::string& where);
/// Reads a cell in SI units, within the limits of its kind.
double parse_cell(std::string_view cell, const ColumnKind& kind, double per_si, const std::string& where);
/// For what was integrated from a column of velocities.
void require_near(double position_m, const std::string& where);

}  // namespace cli
