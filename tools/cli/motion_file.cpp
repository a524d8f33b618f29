#include "tools/cli/motion_file.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <limits>
#include <span>

#define CSV_IO_NO_THREAD
#include <libfccp/csv.h>

#include <fmt/format.h>

#include "tools/cli/text_file.hpp"
#include "tools/cli/user_error.hpp"

namespace cli {
namespace {

struct Unit {
  std::string_view name;
  double per_si;  // a division by a power of ten rounds once; a product with its inverse would twice
};
constexpr Unit time_units[] = {{"s", 1.0}, {"ms", 1e3}, {"us", 1e6}};
constexpr Unit length_units[] = {{"m", 1.0}, {"cm", 1e2}, {"mm", 1e3}, {"um", 1e6}};
constexpr Unit speed_units[] = {{"m/s", 1.0}, {"cm/s", 1e2}, {"mm/s", 1e3}, {"um/s", 1e6}};
constexpr Unit force_units[] = {{"N", 1.0}, {"mN", 1e3}};

enum Column : unsigned { column_t, column_x, column_y, column_vx, column_vy, column_load, column_count };

struct ColumnKind {
  std::string_view name;
  std::span<const Unit> units;
};
constexpr ColumnKind kinds[column_count] = {{"t", time_units},   {"x", length_units}, {"y", length_units},
                                            {"vx", speed_units}, {"vy", speed_units}, {"load", force_units}};

struct Header {
  bool present[column_count] = {};
  double per_si[column_count] = {1, 1, 1, 1, 1, 1};
  std::string canonical;  // what the CSV library is given: our names without units, others as "-"
};

std::string_view trim(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::string unit_names(std::span<const Unit> units) {
  std::string names;
  for (const Unit& unit : units) names += fmt::format("{}{}", names.empty() ? "" : ", ", unit.name);
  return names;
}

// "x [mm]" -> column x, unit mm. A column that is not ours is noted and left alone.
void read_header_cell(std::string_view cell, const std::string& where, Header& header, MotionFile& file) {
  const auto bracket = cell.find('[');
  const std::string_view name = trim(cell.substr(0, bracket));
  const auto kind = std::find_if(std::begin(kinds), std::end(kinds), [&](auto& k) { return k.name == name; });
  if (!header.canonical.empty()) header.canonical += ',';
  if (kind == std::end(kinds)) {
    header.canonical += '-';
    file.ignored_columns.emplace_back(cell);
    return;
  }
  const auto column = static_cast<std::size_t>(kind - std::begin(kinds));
  if (header.present[column]) throw UserError(fmt::format("{}: column {} appears twice", where, name));
  header.present[column] = true;
  header.canonical += name;
  if (bracket == std::string_view::npos) return;
  const std::string_view rest = cell.substr(bracket + 1);
  const std::string_view unit = rest.ends_with(']') ? trim(rest.substr(0, rest.size() - 1)) : rest;
  for (const Unit& u : kind->units) {
    if (u.name != unit || !rest.ends_with(']')) continue;
    header.per_si[column] = u.per_si;
    return;
  }
  throw UserError(
      fmt::format("{}: unit of column {} is '{}'; allowed: {}", where, name, unit, unit_names(kind->units)));
}

Header read_header(std::string_view line, const std::string& where, MotionFile& file) {
  Header header;
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t comma = std::min(line.find(',', begin), line.size());
    read_header_cell(trim(line.substr(begin, comma - begin)), where, header, file);
    begin = comma + 1;
  }
  const auto need = [&](bool ok, const char* what) {
    if (!ok)
      throw UserError(fmt::format("{}: header '{}' has no {}; expected t,x,y,load", where, trim(line), what));
  };
  need(header.present[column_t], "column t");
  need(header.present[column_x] || header.present[column_vx], "column x (nor vx)");
  if (header.present[column_x] && header.present[column_vy] && !header.present[column_y]) {
    throw UserError(fmt::format("{}: columns x and vy together: give x and y, or vx and vy", where));
  }
  if (!header.present[column_x] && header.present[column_y]) {
    throw UserError(fmt::format("{}: columns vx and y together: give x and y, or vx and vy", where));
  }
  file.from_velocity = !header.present[column_x];
  file.has_y = header.present[file.from_velocity ? column_vy : column_y];
  file.has_load = header.present[column_load];
  for (const Column column : {column_vx, column_vy}) {
    if (!file.from_velocity && header.present[column]) file.ignored_columns.emplace_back(kinds[column].name);
  }
  return header;
}

double parse_number(std::string_view cell, std::string_view column, const std::string& where) {
  const auto fail = [&](std::string_view why) -> double {
    throw UserError(fmt::format("{}: column {}: '{}' {}", where, column, cell, why));
  };
  std::string_view digits = cell;
  if (digits.size() > 1 && digits[0] == '+' && digits[1] != '-') digits.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error == std::errc::result_out_of_range) return fail("is out of the range of a number");
  if (error != std::errc() || end != digits.data() + digits.size()) {
    return fail(cell.empty() ? "is empty: a number is needed" : "is not a number");
  }
  if (!std::isfinite(value)) return fail("is not finite");
  return value;
}

std::size_t count_lines(std::string_view text) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

}  // namespace

MotionFile parse_motion_file(std::string_view text, const std::string& name) {
  MotionFile file;
  file.name = name;
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  // A zero byte would end a cell early for the splitter, and lose what follows it.
  if (const auto zero = text.find('\0'); zero != std::string_view::npos) {
    throw UserError(
        fmt::format("{}:{}: a zero byte: not a text file", name, count_lines(text.substr(0, zero)) + 1));
  }

  std::size_t header_line = 1;
  while (text.starts_with('#')) {
    const auto end = text.find('\n');
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    ++header_line;
  }
  if (trim(text).empty())
    throw UserError(fmt::format("{}: empty: expected a header t,x,y,load and rows", name));
  const std::size_t header_end = std::min(text.find('\n'), text.size());
  const Header header =
      read_header(text.substr(0, header_end), fmt::format("{}:{}", name, header_line), file);

  // The splitter looks at the byte behind the last line if that has no line end: give it one.
  std::string canonical = header.canonical;
  canonical += text.substr(header_end);
  if (!canonical.ends_with('\n')) canonical += '\n';

  using Reader = io::CSVReader<column_count, io::trim_chars<' ', '\t'>, io::no_quote_escape<','>,
                               io::throw_on_overflow, io::single_line_comment<'#'>>;
  Reader reader(name, canonical.data(), canonical.data() + canonical.size());
  reader.set_file_line(static_cast<unsigned>(header_line - 1));
  const auto where = [&] { return fmt::format("{}:{}", name, reader.get_file_line()); };
  try {
    reader.read_header(io::ignore_extra_column | io::ignore_missing_column, "t", "x", "y", "vx", "vy",
                       "load");
    double last_vx = 0.0, last_vy = 0.0;
    char* cells[column_count] = {};
    while (reader.read_row(cells[0], cells[1], cells[2], cells[3], cells[4], cells[5])) {
      double value[column_count] = {};
      for (unsigned c = 0; c < column_count; ++c) {
        const bool velocity = c == column_vx || c == column_vy;
        if (!header.present[c] || (velocity && !file.from_velocity)) continue;
        value[c] = parse_number(cells[c], kinds[c].name, where()) / header.per_si[c];
      }
      MotionRow row{value[column_t], value[column_x], value[column_y], value[column_load]};
      if (row.load < 0.0) {
        throw UserError(
            fmt::format("{}: column load: {} is negative; allowed: 0 or more", where(), cells[column_load]));
      }
      if (!file.rows.empty()) {
        const MotionRow& last = file.rows.back();
        if (!(row.t > last.t)) {
          throw UserError(fmt::format("{}: column t: {} s does not come after {} s of the row before",
                                      where(), row.t, last.t));
        }
        if (file.from_velocity) {
          row.x = last.x + 0.5 * (last_vx + value[column_vx]) * (row.t - last.t);
          row.y = last.y + 0.5 * (last_vy + value[column_vy]) * (row.t - last.t);
        }
      }
      last_vx = value[column_vx];
      last_vy = value[column_vy];
      file.rows.push_back(row);
    }
  } catch (const io::error::too_few_columns&) {
    throw UserError(fmt::format("{}: fewer cells than the header has columns", where()));
  } catch (const io::error::too_many_columns&) {
    throw UserError(fmt::format("{}: more cells than the header has columns", where()));
  } catch (const io::error::base& error) {
    throw UserError(fmt::format("{}: {}", where(), error.what()));
  }
  if (file.rows.size() < 2) {
    throw UserError(fmt::format("{}: {} data rows; a motion needs at least 2", name, file.rows.size()));
  }
  return file;
}

MotionFile read_motion_file(const std::string& path) { return parse_motion_file(read_text_file(path), path); }

}  // namespace cli
