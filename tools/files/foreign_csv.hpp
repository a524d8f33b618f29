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

/// The user's choice for a column, by kind.
struct ColumnWish {
  /// The column's header in the file, or its number from 1; empty: our name, or an alias.
  std::string name;
  const Unit* unit = nullptr;  ///< replaces the header's unit; null: the header's, else SI
};

/// Pairs of the command line: our name of a column, and the user's name or unit for it.
using ColumnWords = std::vector<std::pair<std::string, std::string>>;

/// Returns the choices of `columns` (--columns) and `units` (--units), by kind. Throws UserError on unknown
/// names and units.
std::vector<ColumnWish> column_wishes(std::span<const ColumnKind> kinds, const ColumnWords& columns,
                                      const ColumnWords& units);

struct PlainCsv {
  std::string text;                  ///< begins with the header; has as many lines as the file from there on
  std::size_t header_line = 1;       ///< line in the file; 0: no header
  std::string header;                ///< header as the file has it
  std::vector<std::string> headers;  ///< header cell in the file, by kind; empty: no such column
  std::vector<std::string> units;    ///< unit, by kind; empty: none stated
  std::vector<std::string> notes;    ///< deviations from our format other than names and units
  bool ours = true;                  ///< whether names and format are ours, so that it may be a motion file
};

/// Converts `text`, which begins with line `first_line` of the file. `enough` decides from the kinds that a
/// line names whether it can be the header; if no line can, the first line is taken, for the caller to
/// complain about. Throws UserError if the file lacks a chosen column, and on numbers where names should be.
PlainCsv plain_csv(std::string_view text, const std::string& name, std::size_t first_line,
                   std::span<const ColumnKind> kinds, const std::vector<ColumnWish>& wishes,
                   const std::function<bool(const std::vector<bool>&)>& enough);

/// Returns a sentence such as "t in ms, x = 'Position' in mm, force; SI where no unit is stated", and the
/// notes.
std::string mapping_text(const PlainCsv& csv, std::span<const ColumnKind> kinds);

}  // namespace cli
