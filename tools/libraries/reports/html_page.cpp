#include "tools/libraries/reports/html_page.hpp"

#include <cstdint>
#include <fstream>
#include <iterator>

#include <fmt/format.h>

#include "tools/libraries/files/one_line.hpp"

namespace cli {
namespace {

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : masked(text))
    out += c == '&' ? std::string("&amp;") : c == '<' ? std::string("&lt;") : std::string(1, c);
  return out;
}

}  // namespace

std::string html_page(const std::string& title, const std::string& report, const std::string& picture) {
  return fmt::format(
      "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<title>{0}</title>\n<h1>{0}</h1>\n"
      "<pre>{1}</pre>\n{2}</html>\n",
      escaped(one_line(title)), escaped(report), picture);
}

std::string html_picture(const std::string& file) {
  std::ifstream bytes(file, std::ios::binary);
  const std::string png{std::istreambuf_iterator<char>(bytes), {}};
  constexpr const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string base64;
  for (std::size_t i = 0; i < png.size(); i += 3) {
    const auto byte = [&](std::size_t k) -> std::uint32_t {
      return i + k < png.size() ? static_cast<unsigned char>(png[i + k]) : 0;
    };
    const std::uint32_t bits = byte(0) << 16 | byte(1) << 8 | byte(2);
    for (std::size_t k = 0; k < 4; ++k)
      base64 += i + k <= png.size() ? digits[bits >> (18 - 6 * k) & 63] : '=';
  }
  return fmt::format("<img alt=\"forces\" src=\"data:image/png;base64,{}\">\n", base64);
}

}  // namespace cli
