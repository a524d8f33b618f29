// Reads the rows of a CSV file whose header was already read. The library libfccp splits lines; its errors
// become UserErrors that name file and line.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>

#define CSV_IO_NO_THREAD
#include <libfccp/csv.h>

#include <fmt/format.h>

#include "tools/libraries/files/csv_columns.hpp"
#include "tools/libraries/files/user_error.hpp"

namespace cli {

/// Calls `take(cells, where)` for each row of CSV text that begins with its header. Cells are in the order of
/// `kinds`, null for columns that the file lacks; `where()` returns file and line for messages. `header_line`
/// is the header's line number in the file.
template <std::size_t count, class Take>
void for_csv_rows(std::string_view text, const std::string& name, std::size_t header_line,
                  const CsvHeader& header, const ColumnKind (&kinds)[count], Take&& take) {
  // Appends a line end if the text ends without one, because libfccp reads one byte beyond the last line.
  std::string canonical = header.canonical;
  canonical += text.substr(std::min(text.find('\n'), text.size()));
  if (!canonical.ends_with('\n')) canonical += '\n';

  using Reader = io::CSVReader<count, io::trim_chars<' ', '\t'>, io::no_quote_escape<','>,
                               io::throw_on_overflow, io::single_line_comment<'#'>>;
  Reader reader(name, canonical.data(), canonical.data() + canonical.size());
  reader.set_file_line(static_cast<unsigned>(header_line - 1));
  const auto where = [&] { return fmt::format("{}:{}", name, reader.get_file_line()); };
  const auto read_all = [&]<std::size_t... i>(std::index_sequence<i...>) {
    reader.read_header(io::ignore_extra_column | io::ignore_missing_column, std::string(kinds[i].name)...);
    std::array<char*, count> cells{};
    while (reader.read_row(cells[i]...)) take(cells, where);
  };
  try {
    read_all(std::make_index_sequence<count>());
  } catch (const io::error::too_few_columns&) {
    throw UserError(fmt::format("{}: fewer cells than the header has columns", where()));
  } catch (const io::error::too_many_columns&) {
    throw UserError(fmt::format("{}: more cells than the header has columns (decimal commas?)", where()));
  } catch (const io::error::base&) {
    throw UserError(fmt::format("{}: cannot be split into cells", where()));
  }
}

}  // namespace cli
