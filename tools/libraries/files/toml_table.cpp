#include "tools/libraries/files/toml_table.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "tools/libraries/files/nearest_name.hpp"
#include "tools/libraries/files/number_text.hpp"
#include "tools/libraries/files/user_error.hpp"

namespace cli {
namespace {

std::string describe(const Range& range) {
  const char* space = *range.unit ? " " : "";
  return fmt::format("{} {} and at most {}{}{}", range.above ? "more than" : "at least", range.min, range.max,
                     space, range.unit);
}

std::string spell(const toml::node& node) {
  if (const auto* value = node.as_floating_point()) return fmt::format("{}", value->get());
  if (const auto* value = node.as_integer()) return fmt::format("{}", value->get());
  if (const auto* value = node.as_string()) return fmt::format("'{}'", value->get());
  if (const auto* value = node.as_boolean()) return value->get() ? "true" : "false";
  if (node.is_array()) return "an array";
  if (node.is_table()) return "a table";
  return "a date";
}

}  // namespace

TomlTable::TomlTable(const std::string& file, const toml::table& table, std::string what)
    : file_(file), table_(table), what_(std::move(what)) {}

std::string TomlTable::where() const {
  return fmt::format("{}:{}: {}", file_, table_.source().begin.line, what_);
}

std::string TomlTable::where(std::string_view key) const {
  const toml::node* node = table_.get(key);
  return fmt::format("{}:{}: {}", file_,
                     (node ? *node : static_cast<const toml::node&>(table_)).source().begin.line, what_);
}

void TomlTable::fail(std::string_view key, const std::string& why) const {
  throw UserError(fmt::format("{}: {} {}", where(key), key, why));
}

void TomlTable::fail(const std::string& why) const { throw UserError(fmt::format("{}: {}", where(), why)); }

std::string TomlTable::name() {
  const std::string result = text("name");
  const auto plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  };
  if (result.empty() || !std::all_of(result.begin(), result.end(), plain))
    fail("name", fmt::format("is '{}'; allowed: letters, digits, _ and -, at least one", result));
  what_ += fmt::format(" '{}'", result);
  return result;
}

void TomlTable::allow(const std::vector<std::string_view>& keys) const {
  for (const auto& [key, node] : table_) {
    if (std::find(keys.begin(), keys.end(), key.str()) != keys.end()) continue;
    throw UserError(fmt::format("{}:{}: {}: unknown key '{}'{}", file_, key.source().begin.line, what_,
                                key.str(), allowed_text(key.str(), {keys.begin(), keys.end()})));
  }
}

bool TomlTable::has_any(const std::vector<std::string_view>& keys) const {
  return std::any_of(keys.begin(), keys.end(), [&](std::string_view key) { return has(key); });
}

const toml::node& TomlTable::need(std::string_view key) const {
  const toml::node* node = table_.get(key);
  if (!node) fail(fmt::format("key '{}' is missing", key));
  return *node;
}

double TomlTable::checked(const toml::node& node, std::string_view key, const Range& range) const {
  if (!node.is_number())
    fail(key, fmt::format("is {}; a number is needed, {}", spell(node), describe(range)));
  // Refuses a whole number that double precision cannot represent. toml++ would not give it as a double.
  const toml::value<std::int64_t>* const whole = node.as_integer();
  if (whole && (whole->get() > most_whole_double || whole->get() < -most_whole_double))
    fail(key, fmt::format("is {}; allowed: whole numbers up to 2^53, {}", spell(node), describe(range)));
  const double value = whole ? static_cast<double>(whole->get()) : node.as_floating_point()->get();
  const bool inside =
      std::isfinite(value) && value <= range.max && (range.above ? value > range.min : value >= range.min);
  if (!inside) fail(key, fmt::format("is {}; allowed: {}", spell(node), describe(range)));
  return value;
}

double TomlTable::number(std::string_view key, const Range& range) const {
  return checked(need(key), key, range);
}

double TomlTable::number(std::string_view key, const Range& range, double otherwise) const {
  return has(key) ? number(key, range) : otherwise;
}

std::int64_t TomlTable::integer(std::string_view key, std::int64_t min, std::int64_t max,
                                std::int64_t otherwise) const {
  const toml::node* node = table_.get(key);
  if (!node) return otherwise;
  const auto* value = node->as_integer();
  if (!value || value->get() < min || value->get() > max)
    fail(key, fmt::format("is {}; a whole number from {} to {} is needed", spell(*node), min, max));
  return value->get();
}

std::string TomlTable::text(std::string_view key) const {
  const toml::node& node = need(key);
  const auto* value = node.as_string();
  if (!value) fail(key, fmt::format("is {}; a text is needed", spell(node)));
  return value->get();
}

std::string TomlTable::text(std::string_view key, std::string otherwise) const {
  return has(key) ? text(key) : std::move(otherwise);
}

std::string TomlTable::file(std::string_view key) const {
  const std::string name = text(key);
  if (name.empty() || name.find('\0') != std::string::npos)
    fail(key,
         fmt::format("is '{}'; the name of a file is needed, at least one character and no zero byte", name));
  return name;
}

std::size_t TomlTable::choice(std::string_view key, const std::vector<std::string_view>& names,
                              std::size_t otherwise) const {
  if (!has(key)) return otherwise;
  const std::string chosen = text(key);
  const auto found = std::find(names.begin(), names.end(), chosen);
  if (found == names.end())
    fail(key, fmt::format("is '{}'{}", chosen, allowed_text(chosen, {names.begin(), names.end()})));
  return static_cast<std::size_t>(found - names.begin());
}

std::vector<std::string> TomlTable::texts(std::string_view key) const {
  std::vector<std::string> result;
  if (!has(key)) return result;
  const toml::array* array = need(key).as_array();
  if (!array) fail(key, "must be an array of texts");
  for (const toml::node& node : *array) {
    const auto* value = node.as_string();
    if (!value) fail(key, fmt::format("holds {}; texts are needed", spell(node)));
    result.push_back(value->get());
  }
  return result;
}

std::vector<double> TomlTable::numbers(std::string_view key, const Range& range) const {
  const toml::array* array = need(key).as_array();
  if (!array) fail(key, "must be an array of numbers");
  std::vector<double> result;
  for (const toml::node& node : *array) result.push_back(checked(node, key, range));
  return result;
}

void TomlTable::pair(std::string_view key, const Range& range, double (&to)[2]) const {
  if (!need(key).is_array()) {
    to[0] = number(key, range);
    to[1] = 0.0;
    return;
  }
  const std::vector<double> values = numbers(key, range);
  if (values.size() != 2)
    fail(key, fmt::format("holds {} numbers; one number, or an array of two, is needed", values.size()));
  to[0] = values[0];
  to[1] = values[1];
}

TomlTable TomlTable::table(std::string_view key) const {
  const toml::table* inner = need(key).as_table();
  if (!inner) fail(key, fmt::format("is {}; a table is needed", spell(need(key))));
  return {file_, *inner, what_.empty() ? fmt::format("[{}]", key) : fmt::format("{} {}", what_, key)};
}

std::vector<TomlTable> TomlTable::tables(std::string_view key) const {
  std::vector<TomlTable> result;
  if (!has(key)) return result;
  const toml::array* array = need(key).as_array();
  if (!array) fail(key, fmt::format("is {}; an array of tables is needed", spell(need(key))));
  for (const toml::node& node : *array) {
    const toml::table* inner = node.as_table();
    if (!inner) fail(key, fmt::format("holds {}; tables are needed", spell(node)));
    result.emplace_back(file_, *inner,
                        what_.empty() ? fmt::format("[[{}]]", key) : fmt::format("{} {}", what_, key));
  }
  return result;
}

}  // namespace cli
