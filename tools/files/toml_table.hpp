// Reads keys of one TOML table with range checks; every error names file, line and key.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <toml++/toml.h>

namespace cli {

/// Range allowed for a number. `above` excludes the lower bound itself.
struct Range {
  double min = -1e9;
  double max = 1e9;
  bool above = false;
  const char* unit = "";
};

class TomlTable {
 public:
  /// Wraps a TOML table; error messages call it `what`, such as "[scene]" or "[[patch]]".
  TomlTable(const std::string& file, const toml::table& table, std::string what);

  /// Reads the key `name`, by which later messages call the table. Usually read before other keys.
  std::string name();

  /// Throws UserError if the table holds a key that is not among these names.
  void allow(const std::vector<std::string_view>& keys) const;

  bool has(std::string_view key) const { return table_.contains(key); }
  bool has_any(std::initializer_list<std::string_view> keys) const;

  double number(std::string_view key, const Range& range) const;
  double number(std::string_view key, const Range& range, double otherwise) const;
  std::int64_t integer(std::string_view key, std::int64_t min, std::int64_t max,
                       std::int64_t otherwise) const;
  std::string text(std::string_view key) const;
  std::string text(std::string_view key, std::string otherwise) const;
  /// Reads a text that must be one of these names; returns the name's index.
  std::size_t choice(std::string_view key, std::initializer_list<std::string_view> names,
                     std::size_t otherwise) const;
  /// Reads an array of texts; empty if the table lacks the key.
  std::vector<std::string> texts(std::string_view key) const;
  std::vector<double> numbers(std::string_view key, const Range& range) const;
  /// Reads an array of two numbers, or one number, after which the second is 0.
  void pair(std::string_view key, const Range& range, double (&to)[2]) const;
  TomlTable table(std::string_view key) const;
  /// Reads an array of tables; empty if the table lacks the key.
  std::vector<TomlTable> tables(std::string_view key) const;

  /// Returns the place of the table, or of a key in it, for messages: "file:line: what".
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
