#include "tools/cli/motion_file.hpp"

#include <limits>

#define CSV_IO_NO_THREAD
#include <libfccp/csv.h>

#include <fmt/format.h>

#include "tools/cli/csv_columns.hpp"
#include "tools/cli/text_file.hpp"
#include "tools/cli/user_error.hpp"

namespace cli {
namespace {

enum Column : unsigned { column_t, column_x, column_y, column_vx, column_vy, column_load, column_count };

constexpr ColumnKind kinds[column_count] = {{"t", time_units},   {"x", length_units}, {"y", length_units},
                                            {"vx", speed_units}, {"vy", speed_units}, {"load", force_units}};

CsvHeader read_header(std::string_view line, const std::string& where, MotionFile& file) {
  CsvHeader header = read_csv_header(line, where, kinds);
  file.ignored_columns = header.other_columns;
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

}  // namespace

MotionFile parse_motion_file(std::string_view text, const std::string& name) {
  MotionFile file;
  file.name = name;
  std::size_t header_line = 1;
  text = skip_to_header(text, name, "t,x,y,load", header_line);
  const std::size_t header_end = std::min(text.find('\n'), text.size());
  const CsvHeader header =
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
