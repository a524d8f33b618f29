// What CSV files with a header have in common: columns by name, units in brackets, numbers by line.
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
inline constexpr Unit time_units[] = {{"s", 1.0}, {"ms", 1e3}, {"us", 1e6}};
inline constexpr Unit length_units[] = {{"m", 1.0}, {"cm", 1e2}, {"mm", 1e3}, {"um", 1e6}};
inline constexpr Unit speed_units[] = {{"m/s", 1.0}, {"cm/s", 1e2}, {"mm/s", 1e3}, {"um/s", 1e6}};
inline constexpr Unit force_units[] = {{"N", 1.0}, {"mN", 1e3}, {"uN", 1e6}, {"gf", 1e3 / 9.80665}};

/// What a column may hold, either sign, SI units: what scenes allow, and times of any clock.
inline constexpr double most_time = 1e12, most_length = 1e6, most_speed = 1e6, most_force = 1e9;

struct ColumnKind {
  std::string_view name;
  std::span<const Unit> units;
  double most = std::numeric_limits<double>::max();  ///< SI units; the first unit's name is theirs
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

/// Reads "x [mm],load". Throws UserError on a unit that is not known and on a column that comes twice.
CsvHeader read_csv_header(std::string_view line, const std::string& where, std::span<const ColumnKind> kinds);

std::string_view trim(std::string_view text);

/// What every such file asks of a row: time increases, no load is negative. Throw UserError.
void require_later(double t, double last_t, const std::string& where);
void require_load(double load_n, std::string_view cell, const std::string& where);

/// A finite number, the whole cell. Throws UserError naming `where`, column and reason.
double parse_number(std::string_view cell, std::string_view column, const std::string& where);
/// The same in SI units, within what the kind may hold.
double parse_cell(std::string_view cell, const ColumnKind& kind, double per_si, const std::string& where);
/// For what was integrated from a column of velocities.
void require_near(double position_m, const std::string& where);

}  // namespace cli
