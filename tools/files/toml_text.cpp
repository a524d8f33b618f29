#include "tools/files/toml_text.hpp"

#include <algorithm>
#include <cstddef>
#include <string_view>

#include <fmt/format.h>

#include "tools/files/user_error.hpp"

namespace cli {
namespace {

constexpr int most_dots = 16;  // most dots in a key such as "a.b.c"; our keys have at most two

/// Returns the end of the quoted text that begins at `from`: behind its closing quotes, or the end of the
/// line or file.
std::size_t end_of_string(std::string_view text, std::size_t from) {
  const char quote = text[from];
  const std::string three(3, quote);
  const bool lines = text.substr(from, 3) == three;
  std::size_t at = from + (lines ? 3 : 1);
  while (at < text.size()) {
    if (text[at] == '\\' && quote == '"') {
      at += 2;
    } else if (lines && text.substr(at, 3) == three) {
      at += 3;
      // Skips two more quotes that may belong to the string.
      while (at < text.size() && text[at] == quote) ++at;
      return at;
    } else if (!lines && (text[at] == quote || text[at] == '\n')) {
      return at + 1;
    } else {
      ++at;
    }
  }
  return text.size();
}

/// Refuses keys with many dots. toml++ limits the nesting of values, but not of keys: each dot is a table
/// within a table, and destructors of deep nesting overflow the stack.
void refuse_deep_keys(std::string_view text, const std::string& path) {
  int dots = 0, line = 1;
  std::size_t at = 0;
  while (at < text.size()) {
    const char c = text[at];
    if (c == '"' || c == '\'') {
      const std::size_t end = end_of_string(text, at);
      for (; at < end && at < text.size(); ++at) line += text[at] == '\n';
      continue;
    }
    if (c == '#') {
      at = std::min(text.find('\n', at), text.size());
      continue;
    }
    line += c == '\n';
    if (c == '.') {
      if (++dots > most_dots)
        throw UserError(
            fmt::format("{}:{}: a key with {} dots; allowed: at most {}", path, line, dots, most_dots));
    } else if (std::string_view("=,[]{}\n").find(c) != std::string_view::npos) {
      dots = 0;
    }
    ++at;
  }
}

}  // namespace

toml::table parse_toml(const std::string& text, const std::string& path) {
  refuse_deep_keys(text, path);
  try {
    return toml::parse(text, path);
  } catch (const toml::parse_error& error) {
    throw UserError(fmt::format("{}:{}: not TOML: {}", path, error.source().begin.line, error.description()));
  }
}

}  // namespace cli
