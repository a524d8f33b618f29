// Reads keys of one TOML table and checks their ranges; error messages name file, line and key.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <toml++/toml.h>

namespace cli {

/// Range allowed for a number in TOML. `above` excludes the lower bound itself.
struct Range {
  double min = -1e9;
  double max = 1e9;
  bool above = false;
  const char* unit = "";
};

class TomlTable {
 public:
  /// Wraps a TOML table, which error messages call `what`: "[scene]", "[[patch]]".
  TomlTable(const std::string& file, const toml::table& table, std::string what);

  /// Reads the key `name`; later error messages use it to name the table. Read it before other keys.
  std::string name();

  /// Throws UserError if the table has a key that is not in `keys`, since it is probably misspelt.
  void allow(const std::vector<std::string_view>& keys) const;

  bool has(std::string_view key) const { return table_.contains(key); }
  bool has_any(const std::vector<std::string_view>& keys) const;

  double number(std::string_view key, const Range& range) const;
  double number(std::string_view key, const Range& range, double otherwise) const;
  std::int64_t integer(std::string_view key, std::int64_t min, std::int64_t max,
                       std::int64_t otherwise) const;
  std::string text(std::string_view key) const;
  std::string text(std::string_view key, std::string otherwise) const;
  /// Reads the name of a file, which must not be empty or contain a zero byte.
  std::string file(std::string_view key) const;
  /// Reads a word that must be one of `names`. Returns its index.
  std::size_t choice(std::string_view key, const std::vector<std::string_view>& names,
                     std::size_t otherwise) const;
  /// Reads an array of texts; returns an empty one if the table lacks the key.
  std::vector<std::string> texts(std::string_view key) const;
  std::vector<double> numbers(std::string_view key, const Range& range) const;
  /// Reads an array of two numbers; a single number means that the second is 0.
  void pair(std::string_view key, const Range& range, double (&to)[2]) const;
  TomlTable table(std::string_view key) const;
  /// Reads an array of tables; returns an empty one if the table lacks the key.
  std::vector<TomlTable> tables(std::string_view key) const;

  /// Returns where the table, or one of its keys, stands, for messages: "file:line: what".
  std::string where() const;
  std::string where(std::string_view key) const;
  [[noreturn]] void fail(std::string_view key, const std::string& why) const;
  [[noreturn]] void fail(const std::string& why) const;

 private:
  const toml::node& need(std::string_view key) const;
  double checked(const toml::node& node, std::string_view key, const Range& range) const;

  const std::string& file_;
  const toml::table& table_;
  std::string what_;
};

}  // namespace cli
