#include "tools/reports/html_page.hpp"

#include <cstddef>
#include <cstdint>
#include <iterator>

#include <fmt/format.h>

namespace cli {
namespace {

// Colours of Okabe and Ito, told apart by everybody; words carry the meaning as well. Prints on A4.
constexpr const char* style_sheet = R"css(
body { font: 16px/1.5 sans-serif; color: #222; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
h1, h2, h3, h4 { line-height: 1.2; }
h1 { font-size: 1.5rem; margin: 0 0 .2rem; }
h2 { margin-top: 3rem; border-bottom: 2px solid #0072B2; padding-bottom: .2rem; }
h3 { margin-top: 2.2rem; }
h4 { margin: 1.6rem 0 .4rem; }
p, li { max-width: 48rem; }
.answers { display: grid; grid-template-columns: 1fr 1fr; gap: .8rem; margin: 1rem 0; }
.answer { background: #eef5fa; border-left: 4px solid #0072B2; padding: .6rem .8rem; }
.answer h2 { margin: 0 0 .3rem; border: 0; padding: 0; font-size: 1.05rem; }
.answer p { margin: .3rem 0; }
.charts { display: grid; grid-template-columns: repeat(auto-fit, minmax(20rem, 1fr)); gap: 1rem; }
.chart { display: block; width: 100%; max-width: 44rem; font: 12px sans-serif; }
.chart .chart-title { font-weight: bold; }
.chart .grid { stroke: #e0e0e0; fill: none; }
.chart .guide { stroke: #777; fill: none; stroke-dasharray: 5 4; }
.chart .tick { fill: #555; font-size: 11px; }
.chart .says { visibility: hidden; }
.chart .point:hover .says, .chart .point:focus .says { visibility: visible; }
.chart .point:hover .mark, .chart .point:focus .mark { stroke: #000; stroke-width: 2; }
.chart .point:focus { outline: none; }
details summary { cursor: pointer; color: #005a8c; }
nav ul { list-style: none; padding-left: 1rem; }
a { color: #005a8c; }
figure { margin: 1.5rem 0; }
img { max-width: 100%; height: auto; }
figcaption { color: #555; font-size: .9rem; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: .85rem; margin: .6rem 0; }
th, td { text-align: right; padding: .2rem .6rem; border-bottom: 1px solid #ddd; vertical-align: top; }
th { border-bottom: 2px solid #888; }
.left { text-align: left; }
.note { text-align: left; color: #555; padding-left: 1.8rem; }
.good { color: #005a8c; }
.bad { color: #a84300; font-weight: bold; }
.warning { border-left: 4px solid #D55E00; padding-left: .8rem; }
.subtitle { color: #555; }
pre { background: #f4f4f4; padding: .8rem; overflow-x: auto; font-size: .85rem; }
@media (max-width: 40rem) {
  body { font-size: 15px; margin: .6rem auto; padding: 0 .7rem; }
  h1 { font-size: 1.15rem; }
  .subtitle { font-size: .8rem; margin: 0; }
  .answers { grid-template-columns: 1fr; gap: .45rem; margin: .5rem 0; }
  .answer { padding: .3rem .6rem; font-size: .85rem; line-height: 1.35; }
  .answer h2 { font-size: .95rem; margin: 0 0 .1rem; }
  .answer p { margin: .1rem 0; }
  .scroll table { width: max-content; }
  .scroll td, .scroll th { max-width: 13rem; }
  .chart { font-size: 14px; }
  .chart .tick { font-size: 13px; }
  .chart .key { font-size: 12px; }
  .picture { overflow-x: auto; }
  .picture img { max-width: none; width: 44rem; }
}
@media print {
  body { font-size: 10pt; max-width: none; margin: 0; }
  table { font-size: 7.5pt; }
  th, td { padding: .1rem .3rem; }
  tr, figure, pre { break-inside: avoid; }
  h2, h3, h4 { break-after: avoid; }
  .scroll, pre { overflow: visible; white-space: pre-wrap; }
}
)css";

}  // namespace

std::string base64(std::string_view bytes) {
  static constexpr char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t j = 0; j < 3; ++j)
      group = group << 8 | (i + j < bytes.size() ? static_cast<unsigned char>(bytes[i + j]) : 0u);
    for (std::size_t j = 0; j < 4; ++j)
      out += i + j <= bytes.size() ? digits[group >> (18 - 6 * j) & 63u] : '=';
  }
  return out;
}

void HtmlPage::section(std::string_view id, std::string_view title) {
  fmt::format_to(std::back_inserter(body_), "<h2 id=\"{}\">{}</h2>\n", id, escape_html(title));
  fmt::format_to(std::back_inserter(contents_), "<li><a href=\"#{}\">{}</a></li>\n", id, escape_html(title));
}

void HtmlPage::part(std::string_view id, std::string_view title) {
  fmt::format_to(std::back_inserter(body_), "<h3 id=\"{}\">{}</h3>\n", id, escape_html(title));
  fmt::format_to(std::back_inserter(contents_), "<li>&#8211; <a href=\"#{}\">{}</a></li>\n", id,
                 escape_html(title));
}

void HtmlPage::element(const char* tag, const char* attributes, std::string_view text) {
  fmt::format_to(std::back_inserter(body_), "<{}{}>{}</{}>\n", tag, attributes, escape_html(text), tag);
}

void HtmlPage::heading(std::string_view title) { element("h4", "", title); }
void HtmlPage::paragraph(std::string_view text) { element("p", "", text); }
void HtmlPage::warning(std::string_view text) { element("p", " class=\"warning\"", text); }
void HtmlPage::preformatted(std::string_view text) { element("pre", "", text); }
void HtmlPage::table(const Table& table) { body_ += table.html(); }

void HtmlPage::list(const std::vector<std::string>& items) {
  body_ += "<ul>\n";
  for (const std::string& item : items) element("li", "", item);
  body_ += "</ul>\n";
}

void HtmlPage::answers(const std::vector<Answer>& answers) {
  answers_ += "<div class=\"answers\">\n";
  for (const Answer& answer : answers) {
    answers_ += "<div class=\"answer\"><h2>" + escape_html(answer.question) + "</h2>";
    for (const std::string& paragraph : answer.paragraphs)
      answers_ += "<p>" + escape_html(paragraph) + "</p>";
    answers_ += "</div>\n";
  }
  answers_ += "</div>\n";
}

void HtmlPage::charts(std::string_view svg, std::string_view caption) {
  if (svg.empty()) return;
  fmt::format_to(std::back_inserter(body_),
                 "<figure><div class=\"charts\">\n{}</div><figcaption>{}</figcaption></figure>\n", svg,
                 escape_html(caption));
}

void HtmlPage::picture(std::string_view bytes, std::string_view media_type, std::string_view caption) {
  const std::string words = escape_html(caption);
  fmt::format_to(std::back_inserter(body_),
                 "<figure class=\"picture\"><img alt=\"{}\" "
                 "src=\"data:{};base64,{}\"/><figcaption>{}</figcaption></figure>\n",
                 words, escape_html(media_type), base64(bytes), words);
}

std::string HtmlPage::text(std::string_view title, std::string_view subtitle) const {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>{0}</title>\n"
      "<style>{1}</style>\n</head>\n<body>\n<h1>{0}</h1>\n<p class=\"subtitle\">{2}</p>\n"
      "{3}<nav><details><summary>Contents</summary><ul>\n{4}</ul></details></nav>\n{5}</body>\n</html>\n",
      escape_html(title), style_sheet, escape_html(subtitle), answers_, contents_, body_);
}

}  // namespace cli
