#include "tools/libraries/files/toml_text.hpp"

#include <algorithm>
#include <cstddef>
#include <string_view>

#include <fmt/format.h>

#include "tools/libraries/files/user_error.hpp"

namespace cli {
namespace {

constexpr int most_dots = 16;  // limit of dots in a key such as "a.b.c"; scene files have two at most

/// Returns the offset behind the quoted TOML string that begins at `from`. It ends at its closing quotes or,
/// if they are missing, at the end of the line or file.
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
      // Includes further quotes, because a string in """ may end in quotes of its own.
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

/// Refuses TOML keys with many dots. The parser toml++ limits how deep values nest, but not keys: each dot
/// makes a table within a table, and the destructors of deep nesting overflow the stack.
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
    // Shortens error texts of the parser that end with the name of a macro, which means nothing to users:
    // "... depth of 256 (TOML_MAX_NESTED_VALUES)".
    const std::string_view why = error.description();
    throw UserError(fmt::format("{}:{}: not TOML: {}", path, error.source().begin.line,
                                why.substr(0, why.find(" (TOML_"))));
  }
}

}  // namespace cli
