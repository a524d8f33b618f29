#include "tools/libraries/reports/table.hpp"

#include <algorithm>
#include <numeric>
#include <string_view>

#include <fmt/color.h>
#include <fmt/format.h>

namespace cli {
namespace {

constexpr std::size_t gap = 2;        // number of blanks between two columns
constexpr std::size_t readable = 20;  // least width of a text column, in characters
// Width in characters beyond which a single word is cut. Names of rows are never cut.
constexpr std::size_t widest_word = 30;

std::size_t longest_word(std::string_view text) {
  std::size_t longest = 0;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    longest = std::max(longest, width_of(text.substr(0, end)));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return longest;
}

// Wraps a cell's text in the terminal's colour for its style. Colours only repeat what the words say.
std::string coloured(const std::string& text, CellStyle style) {
  if (!text_layout().colour || style == CellStyle::plain || text.empty()) return text;
  return style == CellStyle::bad ? fmt::format(fmt::emphasis::bold | fg(fmt::terminal_color::red), "{}", text)
                                 : fmt::format(fg(fmt::terminal_color::cyan), "{}", text);
}

std::string csv_line(const std::vector<Cell>& cells) {
  std::string line;
  for (const Cell& cell : cells) {
    if (&cell != &cells.front()) line += ',';
    const bool quoted = cell.text.find_first_of(",\"\n") != std::string::npos;
    if (quoted) line += '"';
    for (const char c : cell.text) line += c == '"' ? std::string("\"\"") : std::string(1, c);
    if (quoted) line += '"';
  }
  return line + '\n';
}

}  // namespace

Table::Table(std::vector<std::string> headers) {
  for (std::string& header : headers) {
    left_.push_back(header.starts_with('<'));
    headers_.emplace_back(header.substr(left_.back() ? 1 : 0));
  }
}

void Table::add(std::vector<Cell> row) { rows_.push_back({std::move(row)}); }
void Table::add_first(std::vector<Cell> row) { rows_.insert(rows_.begin(), {std::move(row)}); }
void Table::add_note(std::string text) { rows_.push_back({{std::move(text)}, true}); }

std::vector<std::size_t> Table::natural_widths() const {
  std::vector<std::size_t> widths;
  for (std::size_t c = 0; c < headers_.size(); ++c) {
    std::size_t width = width_of(headers_[c].text);
    for (const Row& row : rows_)
      if (!row.is_note) width = std::max(width, width_of(row.cells[c].text));
    widths.push_back(width);
  }
  return widths;
}

std::size_t Table::natural_width() const {
  const std::vector<std::size_t> widths = natural_widths();
  return std::accumulate(widths.begin(), widths.end(), gap * (widths.size() - 1));
}

// Returns the least width of a column, in characters: its longest word, because headers and texts may break
// into lines, or its longest number, which may not.
std::size_t Table::least_width(std::size_t column) const {
  std::size_t least = longest_word(headers_[column].text);
  for (const Row& row : rows_) {
    if (row.is_note) continue;
    const std::string& text = row.cells[column].text;
    const std::size_t words = std::clamp(width_of(text), std::size_t{0}, readable);
    least = std::max(least, left_[column]
                                ? std::max(words, column == 0 ? longest_word(text)
                                                              : std::min(longest_word(text), widest_word))
                                : width_of(text));
  }
  return least;
}

std::string Table::text_row(const std::vector<Cell>& cells, std::size_t columns,
                            const std::vector<std::size_t>& width, bool is_header) const {
  std::vector<std::vector<std::string>> broken;
  std::size_t height = 1;
  for (std::size_t c = 0; c < columns; ++c) {
    broken.push_back(broken_lines(cells[c].text, width[c]));
    height = std::max(height, broken.back().size());
  }
  std::string out;
  for (std::size_t y = 0; y < height; ++y) {
    std::string line;
    std::size_t ink = 0;  // length of the line up to its last visible character, bytes
    for (std::size_t c = 0; c < columns; ++c) {
      const std::size_t lines = broken[c].size();
      // Aligns headers to the bottom of their line of the table, and cells to the top.
      const std::size_t above = is_header ? height - lines : 0;
      const std::string text = y < above || y - above >= lines ? std::string() : broken[c][y - above];
      const std::string padding(width[c] - width_of(text), ' ');
      if (c) line.append(gap, ' ');
      if (!left_[c]) line += padding;
      line += coloured(text, cells[c].style);
      if (!text.empty()) ink = line.size();
      if (left_[c]) line += padding;
    }
    line.resize(ink);
    out += line + '\n';
  }
  return out;
}

// Returns the first `columns` columns of the table as text, with the lines of text that span all columns.
std::string Table::text_block(std::size_t columns, const std::vector<std::size_t>& width) const {
  std::string out = text_row(headers_, columns, width, true);
  for (const Row& row : rows_)
    out += row.is_note ? filled(row.cells[0].text) + '\n' : text_row(row.cells, columns, width, false);
  return out;
}

std::string Table::text() const {
  const std::size_t room = text_layout().columns;
  const std::vector<std::size_t> natural = natural_widths();
  if (room == 0 || natural_width() <= room) return text_block(columns(), natural);

  std::vector<std::size_t> width = {std::min(least_width(0), room)};
  std::size_t used = width[0];
  for (std::size_t c = 1; c < columns() && used + gap + least_width(c) <= room; ++c) {
    width.push_back(least_width(c));
    used += gap + width.back();
  }
  // Widens columns by the room that is left in the line: first columns of text, then those with long headers.
  for (const bool left : {true, false}) {
    for (std::size_t c = 0; c < width.size(); ++c) {
      if (left_[c] != left) continue;
      const std::size_t more = std::min(natural[c] - std::min(natural[c], width[c]), room - used);
      width[c] += more;
      used += more;
    }
  }
  std::string out = text_block(width.size(), width), missing;
  for (std::size_t c = width.size(); c < columns(); ++c)
    missing += fmt::format("{}\"{}\"", missing.empty() ? "" : ", ", headers_[c].text);
  return missing.empty() ? out
                         : out + filled("Columns without room (--wide shows them): " + missing + ".") + '\n';
}

std::string Table::csv() const {
  std::string out = csv_line(headers_);
  for (const Row& row : rows_) {
    if (!row.is_note) out += csv_line(row.cells);
  }
  return out;
}

std::string Table::markdown() const {
  const auto line = [](const std::vector<Cell>& cells) {
    std::string text = "|";
    for (const Cell& cell : cells) text += cell.text + '|';
    return text + '\n';
  };
  std::string out = line(headers_) + '|';
  for (std::size_t c = 0; c < columns(); ++c) out += "---|";
  out += '\n';
  for (const Row& row : rows_) {
    if (!row.is_note) out += line(row.cells);
  }
  return out;
}

}  // namespace cli
