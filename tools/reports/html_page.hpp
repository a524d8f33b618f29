// One HTML page with everything in it: styles, tables, pictures. Text that comes in is escaped; nothing
// refers outside.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tools/reports/table.hpp"

namespace cli {

/// RFC 4648, with padding.
std::string base64(std::string_view bytes);

/// A question and what the reports say to it, a paragraph each.
struct Answer {
  std::string question;
  std::vector<std::string> paragraphs;
};

class HtmlPage {
 public:
  /// Above all else, on the first screen of a desk and of a phone.
  void answers(const std::vector<Answer>& answers);
  /// Sections and parts also make the table of contents; `id` is unique in the page and holds letters,
  /// digits, '-'.
  void section(std::string_view id, std::string_view title);
  void part(std::string_view id, std::string_view title);
  void heading(std::string_view title);
  void paragraph(std::string_view text);
  void warning(std::string_view text);
  void list(const std::vector<std::string>& items);
  void preformatted(std::string_view text);
  void table(const Table& table);
  /// `media_type` such as image/png.
  void picture(std::string_view bytes, std::string_view media_type, std::string_view caption);

  /// Charts (SVG, as point_chart.hpp makes them) side by side where there is room.
  void charts(std::string_view svg, std::string_view caption);

  /// The whole page.
  std::string text(std::string_view title, std::string_view subtitle) const;

 private:
  void element(const char* tag, const char* attributes, std::string_view text);
  std::string answers_, contents_, body_;
};

}  // namespace cli
