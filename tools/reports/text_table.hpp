// Columns of text that line up: names to the left, numbers to the right.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace cli {

class TextTable {
 public:
  /// A header that begins with '<' asks for left alignment.
  explicit TextTable(std::vector<std::string> headers) : headers_(std::move(headers)) {
    for (std::string& header : headers_) {
      left_.push_back(header.starts_with('<'));
      if (left_.back()) header.erase(0, 1);
    }
  }

  void add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }
  /// A line of text across all columns.
  void add_heading(std::string text) { rows_.push_back({std::move(text)}); }
  bool empty() const { return rows_.empty(); }

  std::string text() const {
    std::vector<std::size_t> width;
    for (std::size_t c = 0; c < headers_.size(); ++c) {
      width.push_back(columns(headers_[c]));
      for (const auto& row : rows_) {
        if (row.size() > 1) width[c] = std::max(width[c], columns(row[c]));
      }
    }
    std::string out = line(headers_, width);
    for (const auto& row : rows_)
      out += row.size() > 1 || headers_.size() == 1 ? line(row, width) : row[0] + '\n';
    return out;
  }

 private:
  static std::size_t columns(std::string_view text) {
    return static_cast<std::size_t>(std::count_if(
        text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
  }
  std::string line(const std::vector<std::string>& cells, const std::vector<std::size_t>& width) const {
    std::string out;
    for (std::size_t c = 0; c < cells.size(); ++c) {
      const std::string padding(width[c] - columns(cells[c]), ' ');
      out += (c ? "  " : "") + (left_[c] ? cells[c] + padding : padding + cells[c]);
    }
    out.erase(out.find_last_not_of(' ') + 1);
    return out + '\n';
  }

  std::vector<std::string> headers_;
  std::vector<bool> left_;
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace cli
