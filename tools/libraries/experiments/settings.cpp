#include "tools/libraries/experiments/settings.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <toml++/toml.h>

#include "tools/libraries/files/csv_columns.hpp"
#include "tools/libraries/files/number_text.hpp"
#include "tools/libraries/files/text_file.hpp"
#include "tools/libraries/files/toml_text.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/reports/table.hpp"

namespace cli {
namespace {

double parse_number(std::string_view text, const std::string& where) {
  if (const std::optional<double> value = number_in<double>(text)) return *value;
  throw UserError(fmt::format("{}: '{}' is not a finite number", where, text));
}

std::vector<double> parse_numbers(std::string_view text, const std::string& where) {
  std::vector<double> numbers;
  for (;;) {
    const auto comma = text.find(',');
    numbers.push_back(parse_number(trim(text.substr(0, comma)), where));
    if (comma == std::string_view::npos) return numbers;
    text.remove_prefix(comma + 1);
  }
}

std::string where_is(const std::string& path, const toml::node& node, std::string_view key) {
  return fmt::format("{}:{}: {}", path, node.source().begin.line, key);
}

std::vector<double> toml_numbers(const toml::node& node, const std::string& where) {
  const auto one = [&](const toml::node& n) {
    const auto value = n.is_number() ? n.value<double>() : std::nullopt;
    if (!value) throw UserError(where + " needs a number");
    return *value;
  };
  std::vector<double> numbers;
  if (const toml::array* array = node.as_array()) {
    for (const toml::node& element : *array) numbers.push_back(one(element));
  } else {
    numbers.push_back(one(node));
  }
  return numbers;
}

}  // namespace

void Settings::set(std::string_view assignment, const std::string& prefix, NameList others) {
  const auto equals = assignment.find('=');
  if (equals == std::string_view::npos)
    throw UserError(fmt::format("{} {}: needs KEY=VALUE", prefix, assignment));
  const std::string name(trim(assignment.substr(0, equals)));
  const std::string_view value = trim(assignment.substr(equals + 1));
  Parameter& p = find(name, prefix, std::move(others));
  const std::string where = prefix + " " + name;
  if (p.choices.empty()) {
    check(p, parse_numbers(value, where), where);
  } else {
    check(p, std::string(value), where);
  }
}

void Settings::read_file(const std::string& path, const std::string& experiment,
                         const std::function<bool(std::string_view)>& is_table_name) {
  const toml::table file = parse_toml(read_text_file(path, std::size_t{1} << 20), path);
  for (const auto& [key, node] : file) {
    if (node.is_table() && !is_table_name(key.str()))
      throw UserError(
          fmt::format("{}:{}: '{}' is not an experiment", path, node.source().begin.line, key.str()));
  }
  const toml::table* own = file[experiment].as_table();
  for (const auto& [key, node] : own ? *own : file) {
    // Skips a table of the file that belongs to another experiment.
    if (!own && node.is_table() && is_table_name(key.str())) continue;
    const std::string where = where_is(path, node, key.str());
    Parameter& p = find(key.str(), fmt::format("{}:{}", path, node.source().begin.line));
    if (p.choices.empty()) {
      check(p, toml_numbers(node, where), where);
    } else {
      check(p, node.value_or(std::string("(no text)")), where);
    }
  }
}

std::string Settings::value_text(const Parameter& p) {
  if (!p.choices.empty()) return p.text;
  std::string text;
  for (const double n : p.numbers) text += fmt::format("{}{:.6g}", text.empty() ? "" : ",", n);
  return text;
}

std::string parameter_table(const std::vector<Parameter>& parameters) {
  Table table({"<parameter", "<default", "<unit", "<meaning"});
  for (const Parameter& p : parameters) {
    std::string meaning = p.help;
    if (!p.choices.empty()) meaning += fmt::format(" ({})", fmt::join(p.choices, ", "));
    table.add({p.name, Settings::value_text(p), p.unit, meaning});
  }
  return table.text();
}

}  // namespace cli
