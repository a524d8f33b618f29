// A table of figures, printed as text for a terminal, as CSV or as Markdown. Its columns can be declared
// once, as functions of the rows of a JSON report.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "tools/libraries/reports/text_layout.hpp"

namespace cli {

enum class CellStyle { plain, good, bad };

struct Cell {
  std::string text;
  CellStyle style = CellStyle::plain;  ///< colour and weight on a terminal: plain, good or bad
  Cell(std::string t, CellStyle s = CellStyle::plain) : text(std::move(t)), style(s) {}
  Cell(const char* t) : text(t) {}
};

/// Table in which columns of text are aligned left and columns of numbers right.
class Table {
 public:
  /// Sets the headers of the columns. A column whose header begins with '<' is aligned left.
  explicit Table(std::vector<std::string> headers);

  void add(std::vector<Cell> row);
  /// Adds a row as the first one, above all rows added before.
  void add_first(std::vector<Cell> row);
  /// Adds a line of text below the last row; it spans all columns.
  void add_note(std::string text);
  bool empty() const { return rows_.empty(); }
  std::size_t columns() const { return headers_.size(); }

  /// Returns the table as text within the width of text_layout(). Headers and texts break over lines. If
  /// there is no room for the last columns, they are left out and named below the table.
  std::string text() const;
  /// Returns the width of the table's longest line, in characters, when no text is broken.
  std::size_t natural_width() const;
  /// Returns the table as CSV (RFC 4180, but lines end in \n), without its lines of text.
  std::string csv() const;
  /// Returns the table in Markdown, without the lines of text added by add_note().
  std::string markdown() const;

 private:
  struct Row {
    std::vector<Cell> cells;
    bool is_note = false;
  };
  std::vector<std::size_t> natural_widths() const;
  std::size_t least_width(std::size_t column) const;
  std::string text_row(const std::vector<Cell>& cells, std::size_t columns,
                       const std::vector<std::size_t>& width, bool is_header) const;
  std::string text_block(std::size_t columns, const std::vector<std::size_t>& width) const;

  std::vector<Cell> headers_;
  std::vector<bool> left_;
  std::vector<Row> rows_;
};

/// Column of a table: a header, and a function from a row (of a JSON report, or a struct) to a cell.
template <class Row>
struct Column {
  enum Where { everywhere, wide_only };  ///< wide_only: shown only with --wide
  std::string header;
  std::function<Cell(const Row&)> cell;
  Where where = everywhere;
};

/// Makes a table from rows. The first `group` cells of a row are left blank if they all equal those of the
/// row above. `after_row(table, row)` may add lines of text.
template <class Row, class Rows>
Table tabulate(const Rows& rows, const std::vector<Column<Row>>& columns, std::size_t group = 0,
               const std::type_identity_t<std::function<void(Table&, const Row&)>>& after_row = {}) {
  std::vector<const Column<Row>*> shown;
  std::vector<std::string> headers, last;
  for (const Column<Row>& column : columns) {
    if (column.where == Column<Row>::wide_only && text_layout().columns != 0) continue;
    shown.push_back(&column);
    headers.push_back(column.header);
  }
  Table table(headers);
  for (const auto& row : rows) {
    std::vector<Cell> cells;
    std::vector<std::string> first;
    for (const Column<Row>* column : shown) {
      cells.push_back(column->cell(row));
      if (first.size() < group) first.push_back(cells.back().text);
    }
    if (first == last) {
      for (std::size_t i = 0; i < group; ++i) cells[i].text.clear();
    }
    last = std::move(first);
    table.add(std::move(cells));
    if (after_row) after_row(table, row);
  }
  return table;
}

}  // namespace cli
