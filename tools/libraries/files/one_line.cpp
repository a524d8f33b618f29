#include "tools/libraries/files/one_line.hpp"

#include <cstddef>

namespace cli {
namespace {

constexpr std::size_t head_bytes = 400, tail_bytes = 200;

unsigned byte_at(std::string_view text, std::size_t at) {
  return at < text.size() ? static_cast<unsigned char>(text[at]) : 0u;
}

/// Returns the length in bytes of the UTF-8 character at `at`; 0 if it is invalid or a control character.
std::size_t printable(std::string_view text, std::size_t at) {
  const unsigned first = byte_at(text, at);
  if (first < 0x80) return first >= 0x20 && first != 0x7F ? 1 : 0;
  const std::size_t size = first >= 0xC2 && first < 0xE0   ? 2
                           : first >= 0xE0 && first < 0xF0 ? 3
                           : first >= 0xF0 && first < 0xF5 ? 4
                                                           : 0;
  for (std::size_t i = 1; i < size; ++i)
    if ((byte_at(text, at + i) & 0xC0) != 0x80) return 0;
  return first == 0xC2 && byte_at(text, at + 1) < 0xA0 ? 0 : size;
}

}  // namespace

std::string one_line(std::string_view text) {
  std::string shortened;
  if (text.size() > head_bytes + tail_bytes + 5) {
    shortened.append(text.substr(0, head_bytes))
        .append(" ... ")
        .append(text.substr(text.size() - tail_bytes));
    text = shortened;
  }
  std::string line;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t size = printable(text, at);
    if (size > 0) {
      line += text.substr(at, size);
    } else {
      line += text[at] == '\n' ? ' ' : '?';
    }
    at += size > 0 ? size : 1;
  }
  return line;
}

}  // namespace cli
