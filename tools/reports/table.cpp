#include "tools/reports/table.hpp"

#include <algorithm>
#include <iterator>
#include <string_view>

#include <fmt/format.h>

namespace cli {
namespace {

// Characters, not bytes.
std::size_t width_of(std::string_view text) {
  return static_cast<std::size_t>(std::count_if(
      text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

const char* class_of(bool left, CellStyle style) {
  if (style == CellStyle::good) return left ? " class=\"left good\"" : " class=\"good\"";
  if (style == CellStyle::bad) return left ? " class=\"left bad\"" : " class=\"bad\"";
  return left ? " class=\"left\"" : "";
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

std::string Table::text_line(const std::vector<Cell>& cells, const std::vector<std::size_t>& width) const {
  std::string out;
  for (std::size_t c = 0; c < cells.size(); ++c) {
    const std::string padding(width[c] - width_of(cells[c].text), ' ');
    out += (c ? "  " : "") + (left_[c] ? cells[c].text + padding : padding + cells[c].text);
  }
  out.erase(out.find_last_not_of(' ') + 1);
  return out + '\n';
}

std::string Table::text() const {
  std::vector<std::size_t> width;
  for (std::size_t c = 0; c < headers_.size(); ++c) {
    width.push_back(width_of(headers_[c].text));
    for (const Row& row : rows_) {
      if (!row.is_note) width[c] = std::max(width[c], width_of(row.cells[c].text));
    }
  }
  std::string out = text_line(headers_, width);
  for (const Row& row : rows_) out += row.is_note ? row.cells[0].text + '\n' : text_line(row.cells, width);
  return out;
}

std::string Table::html() const {
  std::string out = "<div class=\"scroll\"><table>\n<thead><tr>";
  const auto to = std::back_inserter(out);
  for (std::size_t c = 0; c < headers_.size(); ++c)
    fmt::format_to(to, "<th{}>{}</th>", class_of(left_[c], CellStyle::plain), escape_html(headers_[c].text));
  out += "</tr></thead>\n<tbody>\n";
  for (const Row& row : rows_) {
    out += "<tr>";
    for (std::size_t c = 0; c < row.cells.size() && !row.is_note; ++c) {
      const Cell& cell = row.cells[c];
      fmt::format_to(to, "<td{}>{}</td>", class_of(left_[c], cell.style), escape_html(cell.text));
    }
    if (row.is_note) {
      fmt::format_to(to, "<td class=\"note\" colspan=\"{}\">{}</td>", headers_.size(),
                     escape_html(row.cells[0].text));
    }
    out += "</tr>\n";
  }
  return out + "</tbody></table></div>\n";
}

std::string Table::csv() const {
  std::string out = csv_line(headers_);
  for (const Row& row : rows_) {
    if (!row.is_note) out += csv_line(row.cells);
  }
  return out;
}

std::string escape_html(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        if ((code < 0x20 && c != '\n' && c != '\t') || code == 0x7F) {
          out += "\xEF\xBF\xBD";
        } else {
          out += c;
        }
    }
  }
  return out;
}

}  // namespace cli
