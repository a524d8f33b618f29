#include <cmath>
#include <string>

#include "check.hpp"
#include "input.hpp"
#include "targets.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/sweep/range.hpp"

namespace fuzz {
namespace {

/// Returns a text of words that files of parameter studies consist of, which random bytes rarely form.
std::string any_text(Input& input) {
  const char* const words[] = {"1",      "0",     "-1e-3", "1e308", "1e18",   "nan",
                               "inf",    "7",     "0.5",   ":",     ":",      ",",
                               ",",      ":log",  ":int",  "=",     "=",      "material.skin.residual_length",
                               "[1, 2]", "\"a\"", "{",     "}",     "[",      "]",
                               "\n",     " ",     "null",  "true",  "\\u0000"};
  std::string text;
  while (!input.empty() && text.size() < 2000) text += words[input.choice(sizeof words / sizeof *words)];
  return text;
}

void read_range(const std::string& text) {
  const cli::VariedKey key = cli::parse_varied(text);
  check(!key.key.empty(), "a key that varies has a name");
  check(!key.values.empty(), "a range has a value");
  for (const cli::SweepValue& value : key.values) {
    check(!value.is_null(), "a value is a number or a text");
    check(!value.is_number() || std::isfinite(value.get<double>()), "a number is finite");
  }
}

}  // namespace

void sweep(Bytes bytes) {
  Input input(bytes);
  const unsigned kind = input.choice(4);
  const std::string raw(reinterpret_cast<const char*>(bytes.data()) + (bytes.empty() ? 0 : 1),
                        bytes.empty() ? 0 : bytes.size() - 1);
  const std::string text = kind % 2 == 0 ? raw : any_text(input);
  try {
    read_range(kind < 2 ? "key=" + text : text);
  } catch (const cli::UserError& error) {
    check(*error.what() != 0, "a refusal says why");
  }
}

}  // namespace fuzz
