#include "tools/libraries/files/one_line.hpp"

#include <algorithm>
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
  // Refuses by the second byte control characters (C2), forms longer than needed (E0, F0), surrogates (ED),
  // and numbers beyond Unicode (F4).
  const unsigned second = size > 0 ? byte_at(text, at + 1) : 0u;
  const unsigned least = first == 0xC2 || first == 0xE0 ? 0xA0u : first == 0xF0 ? 0x90u : 0x80u;
  const unsigned most = first == 0xED ? 0x9Fu : first == 0xF4 ? 0x8Fu : 0xBFu;
  return second >= least && second <= most ? size : 0;
}

/// Returns the length of the escape sequence at `at` that only colours text, such as "\x1B[31m"; 0 if there
/// is none. Other sequences could move the cursor or worse.
std::size_t colour_at(std::string_view text, std::size_t at) {
  if (!text.substr(at).starts_with("\x1B[")) return 0;
  const std::size_t end = text.find_first_not_of("0123456789;", at + 2);
  return end < text.size() && text[end] == 'm' ? end + 1 - at : 0;
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
  std::string line = masked(text);
  std::replace(line.begin(), line.end(), '\n', ' ');
  return line;
}

std::string masked(std::string_view text, bool colours) {
  std::string safe;
  for (std::size_t at = 0; at < text.size();) {
    std::size_t size = text[at] == '\n' ? 1 : printable(text, at);
    if (colours && size == 0) size = colour_at(text, at);
    if (size > 0) {
      safe += text.substr(at, size);
    } else {
      safe += '?';
    }
    at += size > 0 ? size : 1;
  }
  return safe;
}

}  // namespace cli
