// CSV as other programs write it (semicolons, tabs, decimal commas, lines before the header, units below it,
// names of their own), made into the CSV that csv_columns.hpp and csv_rows.hpp read, line by line.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tools/files/csv_columns.hpp"

namespace cli {

/// The user's words on a column, by kind.
struct ColumnWish {
  std::string name;            ///< its header in the file, or its place from 1; empty: our name, or an alias
  const Unit* unit = nullptr;  ///< in place of the header's; null: the header's, else SI
};

/// Pairs of the command line: our name of a column, and the user's word.
using ColumnWords = std::vector<std::pair<std::string, std::string>>;

/// What `columns` (--columns) and `units` (--units) say, by kind. Throws UserError on other names and units.
std::vector<ColumnWish> column_wishes(std::span<const ColumnKind> kinds, const ColumnWords& columns,
                                      const ColumnWords& units);

struct PlainCsv {
  std::string text;                  ///< begins with the header; as many lines as the file from there on
  std::size_t header_line = 1;       ///< of the file; 0: it has none
  std::string header;                ///< as the file has it
  std::vector<std::string> headers;  ///< by kind, of the file; empty: no such column
  std::vector<std::string> units;    ///< by kind, empty: none stated
  std::vector<std::string> notes;    ///< what was not as we write it, but for names and units
  bool ours = true;                  ///< our names, and all else as we write it: a motion file may be this
};

/// `text` begins with line `first_line` of the file. `enough` says of the kinds that a line names whether it
/// can be the header; where none is, the first line is taken as the header, for the caller to complain about.
/// Throws UserError on a wish that the file does not have, and on numbers where names should be.
PlainCsv plain_csv(std::string_view text, const std::string& name, std::size_t first_line,
                   std::span<const ColumnKind> kinds, const std::vector<ColumnWish>& wishes,
                   const std::function<bool(const std::vector<bool>&)>& enough);

/// "t in ms, x = 'Position' in mm, force; SI where no unit is stated", and the notes.
std::string mapping_text(const PlainCsv& csv, std::span<const ColumnKind> kinds);

}  // namespace cli
