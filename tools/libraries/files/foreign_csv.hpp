// Converts other programs' CSV (semicolons, tabs, decimal commas, lines before the header, units below it)
// line by line to the CSV that csv_columns.hpp and csv_rows.hpp read.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tools/libraries/files/csv_columns.hpp"

namespace cli {

/// Name and unit that the user states for one kind of column (time, position, force ...) by options.
struct ColumnWish {
  /// Name of the column in the file's header; empty: the standard name.
  std::string name;
  const Unit* unit = nullptr;  ///< unit of the column; null: as in the file's header, else SI
};

/// Pairs from the command line: standard name of a column, and the header or unit stated for it.
using ColumnWords = std::vector<std::pair<std::string, std::string>>;

/// Returns for each kind of column what the user states by the options --columns and --units. Throws
/// UserError on unknown names and units.
std::vector<ColumnWish> column_wishes(std::span<const ColumnKind> kinds, const ColumnWords& columns,
                                      const ColumnWords& units);

struct PlainCsv {
  std::string text;             ///< converted text from the header on; line numbers stay
  std::size_t header_line = 1;  ///< line number of the header in the file
  std::string header;           ///< header line of the CSV file as it stands there
  /// For each kind of column, its header in the file; empty: none there.
  std::vector<std::string> headers;
  std::vector<std::string> units;    ///< for each kind of column, the unit's name; empty: none stated
  std::vector<std::size_t> unnamed;  ///< numbers of columns without a name, from 1
  std::vector<std::string> notes;    ///< remarks for the user on other deviations in format
  bool ours = true;                  ///< whether the file is a motion file as it stands
};

/// Converts another program's CSV text; `first_line` is its first line's number in the file. `enough` decides
/// from the kinds of column that a line names whether it can be the header; if no line can, the first counts
/// as header, for the caller to refuse. Throws UserError if a column stated by the user is missing, and where
/// numbers stand in place of names.
PlainCsv plain_csv(std::string_view text, const std::string& name, std::size_t first_line,
                   std::span<const ColumnKind> kinds, const std::vector<ColumnWish>& wishes,
                   const std::function<bool(const std::vector<bool>&)>& enough);

/// Returns a text that says how columns were understood, such as "t in ms, x = 'Position' in mm, force; SI
/// where no unit is stated", followed by the notes.
std::string mapping_text(const PlainCsv& csv, std::span<const ColumnKind> kinds);

}  // namespace cli
