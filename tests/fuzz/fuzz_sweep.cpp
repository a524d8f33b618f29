#include <cmath>
#include <cstdio>
#include <memory>
#include <string>

#include "check.hpp"
#include "input.hpp"
#include "targets.hpp"
#include "tools/files/user_error.hpp"
#include "tools/sweep/journal.hpp"
#include "tools/sweep/range.hpp"
#include "tools/sweep/study.hpp"
#include "tools/sweep/table_file.hpp"

namespace fuzz {
namespace {

/// Text of the words that such files are made of, which bytes at random seldom make.
std::string any_text(Input& input) {
  const char* const words[] = {"1", "0", "-1e-3", "1e308", "1e18", "nan", "inf", "7", "0.5", ":", ":", ",",
                               ",", ":log", ":int", "=", "=", "material.skin.residual_length", "[1, 2]",
                               "\"a\"", "{", "}", "[", "]", "\n", " ", "null", "true", "\\u0000",
                               // A journal's first line, whole and nearly so.
                               "{\"schema\":\"bristle-sweep-journal-1\",\"study\":\"s\",\"rows\":3,"
                               "\"columns\":[{\"name\":\"a\",\"unit\":\"\","
                               "\"type\":\"number\",\"measured\":false}]}\n",
                               "{\"schema\":\"bristle-sweep-journal-1\",\"study\":\"s\",\"rows\":3,"
                               "\"columns\":[{\"name\":\"a\",\"unit\":\"N\","
                               "\"type\":\"text\",\"measured\":true}]}\n",
                               "{\"schema\":\"bristle-sweep-journal-1\",\"study\":", "\"rows\":",
                               "\"columns\":", "[0,", "[1,", "[2,1.5]\n"};
  std::string text;
  while (!input.empty() && text.size() < 2000) text += words[input.choice(sizeof words / sizeof *words)];
  return text;
}

void read_range(const std::string& text) {
  const cli::VariedKey key = cli::parse_varied(text);
  check(!key.key.empty(), "a key that varies has a name");
  const double low = std::fmin(key.from, key.to), high = std::fmax(key.from, key.to);
  for (const double share : {0.0, 0.3, 0.999999999}) {
    const cli::SweepValue value = key.at(share);
    check(!value.is_null(), "a range has a value everywhere");
    if (!key.values.empty() || !value.is_number()) continue;
    const double x = value.get<double>();
    check(std::isfinite(x) && x >= low - 0.5 - 1e-9 * std::fabs(low) &&
              x <= high + 0.5 + 1e-9 * std::fabs(high),
          "a value lies in its range");
  }
}

/// A journal; `right`: the hash of each line is that of the line.
void read_rows(const std::string& text, bool right) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::tmpfile(), &std::fclose);
  if (file == nullptr) return;
  std::size_t start = 0;
  while (start < text.size()) {
    const std::size_t end = std::min(text.find('\n', start), text.size());
    const std::string line = text.substr(start, end - start);
    if (right) std::fputs((cli::text_hash(line) + " ").c_str(), file.get());
    std::fwrite(line.data(), 1, line.size(), file.get());
    std::fputc('\n', file.get());
    start = end + 1;
  }
  std::fflush(file.get());
  const cli::SweepRows rows = cli::read_journal("/proc/self/fd/" + std::to_string(fileno(file.get())));
  check(rows.done <= rows.rows.size(), "no more rows are done than there are");
  static_cast<void>(cli::columns_of(rows.header));
  static_cast<void>(rows.table_hash());
  static_cast<void>(cli::table_csv(rows));
}

}  // namespace

void sweep(Bytes bytes) {
  Input input(bytes);
  const unsigned kind = input.choice(8);
  const std::string raw(reinterpret_cast<const char*>(bytes.data()) + (bytes.empty() ? 0 : 1),
                        bytes.empty() ? 0 : bytes.size() - 1);
  const std::string text = kind % 2 == 0 ? raw : any_text(input);
  try {
    if (kind < 4)
      read_range(kind < 2 ? "key=" + text : text);
    else
      read_rows(text, kind < 7);
  } catch (const cli::UserError& error) {
    check(*error.what() != 0, "a refusal says why");
  }
}

}  // namespace fuzz
