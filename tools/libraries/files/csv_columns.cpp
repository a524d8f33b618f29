#include "tools/libraries/files/csv_columns.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "tools/libraries/files/number_text.hpp"
#include "tools/libraries/files/user_error.hpp"

namespace cli {
namespace {

/// Returns the standard name of a unit, which a file may spell otherwise ("µm", "Nm", "sec", "°").
std::string plain_unit(std::string_view name) {
  std::string plain(trim(name));
  for (const std::string_view micro : {"\xC2\xB5", "\xCE\xBC", "\xB5"}) {
    if (plain.starts_with(micro)) plain = "u" + plain.substr(micro.size());
  }
  if (plain == "\xC2\xB0" || plain == "\xB0" || plain == "degrees") return "deg";
  if (plain == "sec" || plain == "seconds") return "s";
  if (plain == "msec") return "ms";
  for (const std::string_view newton : {"N", "mN", "uN"}) {
    for (const std::string_view length : {"m", "mm", "cm"}) {
      for (const std::string_view between : {"", ".", "*", "\xC2\xB7"}) {
        if (plain == std::string(newton) + std::string(between) + std::string(length))
          return std::string(newton) + " " + std::string(length);
      }
    }
  }
  return plain;
}

// Reads a cell of a CSV header: "x [mm]" means column x in mm. Unknown columns are recorded, for a note, and
// ignored.
void read_header_cell(std::string_view cell, const std::string& where, std::span<const ColumnKind> kinds,
                      CsvHeader& header) {
  const auto bracket = cell.find('[');
  const std::string_view name = trim(cell.substr(0, bracket));
  const auto kind = std::find_if(kinds.begin(), kinds.end(), [&](auto& k) { return k.name == name; });
  if (!header.canonical.empty()) header.canonical += ',';
  if (kind == kinds.end()) {
    header.canonical += '-';
    header.other_columns.emplace_back(cell);
    return;
  }
  const auto column = static_cast<std::size_t>(kind - kinds.begin());
  if (header.present[column]) throw UserError(fmt::format("{}: column {} appears twice", where, name));
  header.present[column] = true;
  header.canonical += name;
  if (bracket == std::string_view::npos) return;
  const std::string_view tail = cell.substr(bracket + 1);
  const std::string_view unit = tail.ends_with(']') ? trim(tail.substr(0, tail.size() - 1)) : tail;
  if (const Unit* const known = tail.ends_with(']') ? find_unit(kind->units, unit) : nullptr) {
    header.per_si[column] = known->per_si;
    return;
  }
  throw UserError(
      fmt::format("{}: unit of column {} is '{}'; allowed: {}", where, name, unit, unit_names(kind->units)));
}

std::size_t count_lines(std::string_view text) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

}  // namespace

std::string unit_names(std::span<const Unit> units) {
  std::string names;
  for (const Unit& unit : units) names += fmt::format("{}{}", names.empty() ? "" : ", ", unit.name);
  return names;
}

const Unit* find_unit(std::span<const Unit> units, std::string_view name) {
  const std::string plain = plain_unit(name);
  for (const Unit& unit : units)
    if (unit.name == plain) return &unit;
  return nullptr;
}

double parse_quantity(std::string_view text, std::span<const Unit> units, const std::string& what) {
  text = trim(text);
  std::string_view unit = text;
  const std::optional<double> value = take_number<double>(unit);
  unit = trim(unit);
  const Unit* const known = unit.empty() ? &units.front() : find_unit(units, unit);
  if (!value || !known)
    throw UserError(fmt::format("{} is '{}'; allowed: a number, alone ({}) or with a unit: {}", what, text,
                                units.front().name, unit_names(units)));
  return *value / known->per_si;
}

std::string_view trim(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::string_view skip_to_header(std::string_view text, const std::string& name, std::string_view expected,
                                std::size_t& header_line) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  // Refuses a zero byte in CSV text. The library that splits lines would end a cell there and lose the rest
  // of the line.
  if (const auto zero = text.find('\0'); zero != std::string_view::npos)
    throw UserError(
        fmt::format("{}:{}: a zero byte: not a text file", name, count_lines(text.substr(0, zero)) + 1));
  header_line = 1;
  while (text.starts_with('#')) {
    const auto end = text.find('\n');
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    ++header_line;
  }
  if (trim(text).empty())
    throw UserError(fmt::format("{}: empty: expected a header {} and rows", name, expected));
  return text;
}

CsvHeader read_csv_header(std::string_view line, const std::string& where,
                          std::span<const ColumnKind> kinds) {
  CsvHeader header;
  header.present.assign(kinds.size(), false);
  header.per_si.assign(kinds.size(), 1.0);
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t comma = std::min(line.find(',', begin), line.size());
    read_header_cell(trim(line.substr(begin, comma - begin)), where, kinds, header);
    begin = comma + 1;
  }
  return header;
}

double parse_cell(std::string_view cell, const ColumnKind& kind, double per_si, const std::string& where) {
  const double value = parse_number(cell, kind.name, where) / per_si;
  if (std::fabs(value) <= kind.most) return value;
  throw UserError(fmt::format("{}: column {}: '{}' is {} {}; allowed: {} to {}", where, kind.name, cell,
                              value, kind.units.front().name, -kind.most, kind.most));
}

void require_near(double position_m, const std::string& where) {
  if (std::fabs(position_m) <= most_length) return;
  throw UserError(fmt::format("{}: the velocities lead to {} m; allowed: {} to {}", where, position_m,
                              -most_length, most_length));
}

void require_later(double t, double last_t, const std::string& where) {
  if (t > last_t) return;
  throw UserError(
      fmt::format("{}: column t: {} s does not come after {} s of the row before", where, t, last_t));
}

void require_load(double load_n, std::string_view cell, const std::string& where) {
  if (load_n < 0.0)
    throw UserError(fmt::format("{}: column load: {} is negative; allowed: 0 or more", where, cell));
}

double parse_number(std::string_view cell, std::string_view column, const std::string& where) {
  if (const std::optional<double> value = number_in<double>(cell)) return *value;
  double value = 0.0;
  const char* const last = cell.data() + cell.size();
  const auto [end, error] = std::from_chars(cell.data(), last, value);
  throw UserError(fmt::format("{}: column {}: '{}' {}", where, column, cell,
                              cell.empty()                              ? "is empty: a number is needed"
                              : error == std::errc::result_out_of_range ? "is out of the range of a number"
                              : error == std::errc() && end == last     ? "is not finite"
                                                                        : "is not a number"));
}

}  // namespace cli
