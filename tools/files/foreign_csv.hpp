// Converts CSV of other programs (semicolons, tabs, decimal commas, lines before the header, units below it,
// other names) line by line to the CSV that csv_columns.hpp and csv_rows.hpp read.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tools/files/csv_columns.hpp"

namespace cli {

/// User's choice of header and unit for one kind of column.
struct ColumnWish {
  /// Header of the column in the file, or its number from 1. Empty: found by our name or an alias.
  std::string name;
  const Unit* unit = nullptr;  ///< unit of the column; null: the unit in the file's header, otherwise SI
};

/// Pairs from the command line: our name of a column, and the header or unit that the user gave for it.
using ColumnWords = std::vector<std::pair<std::string, std::string>>;

/// Returns the user's choices by kind of column, from the options --columns and --units. Throws UserError on
/// unknown names and units.
std::vector<ColumnWish> column_wishes(std::span<const ColumnKind> kinds, const ColumnWords& columns,
                                      const ColumnWords& units);

struct PlainCsv {
  std::string text;                  ///< converted file from its header on, with equal line numbers
  std::size_t header_line = 1;       ///< number of the header's line in the file; 0: no header
  std::string header;                ///< the header line, as the file has it
  std::vector<std::string> headers;  ///< header cell of the column in the file, by kind; empty: no such
                                     ///< column
  std::vector<std::string> units;    ///< name of the column's unit, by kind; empty: none stated
  std::vector<std::string> notes;    ///< sentences for the user on other deviations from our format
  bool ours = true;                  ///< whether the file can be read as a motion file without conversion
};

/// Converts `text`, whose first line is line `first_line` of its file. `enough` decides, from the kinds of
/// column that a line names, whether that line can be the header. If none can, takes the first line as
/// header, for the caller to refuse. Throws UserError if the file lacks a column that the user chose, and on
/// numbers in place of names.
PlainCsv plain_csv(std::string_view text, const std::string& name, std::size_t first_line,
                   std::span<const ColumnKind> kinds, const std::vector<ColumnWish>& wishes,
                   const std::function<bool(const std::vector<bool>&)>& enough);

/// Returns a sentence that says how columns were understood, such as "t in ms, x = 'Position' in mm, force;
/// SI where no unit is stated", and the notes.
std::string mapping_text(const PlainCsv& csv, std::span<const ColumnKind> kinds);

}  // namespace cli
