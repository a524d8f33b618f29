// One HTML page with everything in it: styles, tables, pictures. Text that comes in is escaped; nothing
// refers outside.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace cli {

/// Safe between tags and in quoted attributes. Control characters, which HTML forbids, become U+FFFD.
std::string escape_html(std::string_view text);
/// RFC 4648, with padding.
std::string base64(std::string_view bytes);

enum class CellStyle { plain, good, bad };

struct HtmlCell {
  std::string text;
  CellStyle style = CellStyle::plain;
  HtmlCell(std::string t, CellStyle s = CellStyle::plain) : text(std::move(t)), style(s) {}
  HtmlCell(const char* t) : text(t) {}
};

/// Names to the left, numbers to the right: as in TextTable a header that begins with '<' asks for left
/// alignment.
class HtmlTable {
 public:
  explicit HtmlTable(std::vector<std::string> headers);
  void add(std::vector<HtmlCell> row);
  /// A line of text across all columns.
  void add_note(std::string_view text);
  bool empty() const { return body_.empty(); }
  std::string markup() const;

 private:
  std::vector<std::string> headers_;
  std::vector<bool> left_;
  std::string body_;
};

class HtmlPage {
 public:
  /// Sections and parts also make the table of contents; `id` is unique in the page and holds letters,
  /// digits, '-'.
  void section(std::string_view id, std::string_view title);
  void part(std::string_view id, std::string_view title);
  void heading(std::string_view title);
  void paragraph(std::string_view text);
  void warning(std::string_view text);
  void list(const std::vector<std::string>& items);
  void preformatted(std::string_view text);
  void table(const HtmlTable& table);
  /// `media_type` such as image/png.
  void picture(std::string_view bytes, std::string_view media_type, std::string_view caption);

  /// The whole page.
  std::string text(std::string_view title, std::string_view subtitle) const;

 private:
  void element(const char* tag, const char* attributes, std::string_view text);
  std::string contents_, body_;
};

}  // namespace cli
