#include "tools/libraries/reports/table.hpp"

#include <algorithm>
#include <numeric>
#include <string_view>

#include <fmt/color.h>
#include <fmt/format.h>

namespace cli {
namespace {

constexpr std::size_t gap = 2;           // number of blanks between two columns
constexpr std::size_t readable = 20;     // least width of a text column, in characters
constexpr std::size_t widest_word = 30;  // width in characters beyond which a word is cut

std::size_t longest_word(std::string_view text) {
  std::size_t longest = 0;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    longest = std::max(longest, width_of(text.substr(0, end)));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return longest;
}

// Adds the terminal's colour for a cell's style. Colours only repeat what the words say.
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

// Returns a column's least width, in characters: numbers stay on one line, headers and texts may break.
std::size_t Table::least_width(std::size_t column) const {
  std::size_t least = longest_word(headers_[column].text);
  for (const Row& row : rows_) {
    if (row.is_note) continue;
    const std::string& text = row.cells[column].text;
    const std::size_t words = std::clamp(width_of(text), std::size_t{0}, readable);
    least = std::max(
        least, left_[column] ? std::max(words, std::min(longest_word(text), widest_word)) : width_of(text));
  }
  return least;
}

std::string Table::text_row(const std::vector<Cell>& cells, const std::vector<std::size_t>& block,
                            const std::vector<std::size_t>& width, bool is_header) const {
  std::vector<std::vector<std::string>> broken;
  std::size_t height = 1;
  for (const std::size_t c : block) {
    broken.push_back(broken_lines(cells[c].text, width[c]));
    height = std::max(height, broken.back().size());
  }
  std::string out;
  for (std::size_t y = 0; y < height; ++y) {
    std::string line;
    std::size_t ink = 0;  // length of the line up to its last visible character, bytes
    for (std::size_t i = 0; i < block.size(); ++i) {
      const std::size_t c = block[i], lines = broken[i].size();
      // Aligns headers to the bottom of their line of the table, and cells to the top.
      const std::size_t above = is_header ? height - lines : 0;
      const std::string text = y < above || y - above >= lines ? std::string() : broken[i][y - above];
      const std::string padding(width[c] - width_of(text), ' ');
      if (i) line.append(gap, ' ');
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

std::string Table::text_block(const std::vector<std::size_t>& block, const std::vector<std::size_t>& width,
                              bool with_notes) const {
  std::string out = text_row(headers_, block, width, true);
  for (const Row& row : rows_) {
    if (!row.is_note)
      out += text_row(row.cells, block, width, false);
    else if (with_notes)
      out += filled(row.cells[0].text) + '\n';
  }
  return out;
}

std::string Table::text() const {
  const std::size_t columns = text_layout().columns;
  const std::vector<std::size_t> natural = natural_widths();
  std::vector<std::size_t> width = natural, block(headers_.size());
  std::iota(block.begin(), block.end(), std::size_t{0});
  if (columns == 0 || natural_width() <= columns) return text_block(block, natural, true);

  std::string out;
  for (std::size_t c = 0; c < width.size(); ++c) width[c] = std::min(least_width(c), columns);
  for (std::size_t next = 1; next < width.size() || out.empty();) {
    block = {0};
    std::size_t used = width[0];
    while (next < width.size() && (block.size() == 1 || used + gap + width[next] <= columns)) {
      used += gap + width[next];
      block.push_back(next++);
    }
    // Widens columns to use up the width left: first columns of text, then those with long headers.
    std::vector<std::size_t> shown = width;
    for (const bool left : {true, false}) {
      for (const std::size_t c : block) {
        if (left_[c] != left || used >= columns) continue;
        const std::size_t more = std::min(natural[c] - std::min(natural[c], shown[c]), columns - used);
        shown[c] += more;
        used += more;
      }
    }
    out += (out.empty() ? "" : "\n") + text_block(block, shown, next == width.size());
  }
  return out;
}

std::string Table::csv() const {
  std::string out = csv_line(headers_);
  for (const Row& row : rows_) {
    if (!row.is_note) out += csv_line(row.cells);
  }
  return out;
}

}  // namespace cli
