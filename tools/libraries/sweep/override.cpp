#include "tools/libraries/sweep/override.hpp"

#include <algorithm>
#include <sstream>

#include <fmt/format.h>

#include "tools/libraries/files/number_text.hpp"
#include "tools/libraries/files/toml_text.hpp"
#include "tools/libraries/files/user_error.hpp"

namespace cli {
namespace {

using Path = std::vector<std::string>;

Path split(const std::string& text) {
  Path parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, '.');) parts.push_back(part);
  if (!text.empty() && text.back() == '.') parts.emplace_back();
  return parts;
}

std::string quoted(const std::vector<std::string>& names) {
  std::string all;
  for (const std::string& name : names) {
    if (all.size() > 200) return all + ", ...";
    all += (all.empty() ? "" : ", ") + name;
  }
  return all.empty() ? "none" : all;
}

std::vector<std::string> keys_of(const toml::table& table) {
  std::vector<std::string> keys;
  for (const auto& [key, node] : table) keys.emplace_back(key.str());
  return keys;
}

[[noreturn]] void fail(const std::string& path, const std::string& why) {
  throw UserError(fmt::format("{}: {}", path, why));
}

void unknown(const std::string& path, const std::string& what, const std::string& name,
             const std::vector<std::string>& known) {
  fail(path, fmt::format("no {} '{}'{}; there are: {}", what, name, meant(name, known), quoted(known)));
}

std::size_t index_of(const toml::array& array, const std::string& part, const std::string& path) {
  const std::optional<std::size_t> index = number_in<std::size_t>(part);
  if (!index || *index >= array.size())
    fail(path, fmt::format("'{}' is no place in an array of {}; allowed: 0 to {}", part, array.size(),
                           array.empty() ? 0 : array.size() - 1));
  return *index;
}

/// Returns a TOML table that has the value under the key "v", from which it can be copied as a TOML node.
toml::table holder(const SweepValue& value, const std::string& path) {
  if (value.is_number_integer()) return toml::table{{"v", value.get<std::int64_t>()}};
  if (value.is_number()) return toml::table{{"v", value.get<double>()}};
  const std::string text = value.get<std::string>();
  if (text == "true" || text == "false" ||
      std::string_view("[{\"'").find(text.front()) != std::string_view::npos)
    return parse_toml("v = " + text + "\n", path);
  return toml::table{{"v", text}};
}

void set_in(toml::node& node, const Path& parts, std::size_t at, const SweepValue& value,
            const std::string& path) {
  const std::string& part = parts[at];
  const bool last = at + 1 == parts.size();
  if (toml::table* table = node.as_table()) {
    if (part.empty()) fail(path, "has an empty part");
    if (last) {
      if (part == "peak_over_kinetic") table->erase("peak");  // erases peak, as only one may be given
      if (part == "peak") table->erase("peak_over_kinetic");
      table->insert_or_assign(part, *holder(value, path).get("v"));
      return;
    }
    toml::node* inner = table->get(part);
    if (inner == nullptr || inner->is_value()) unknown(path, "table or array", part, keys_of(*table));
    return set_in(*inner, parts, at + 1, value, path);
  }
  if (toml::array* array = node.as_array()) {
    const std::size_t index = index_of(*array, part, path);
    if (!last) return set_in((*array)[index], parts, at + 1, value, path);
    array->replace(array->cbegin() + static_cast<std::ptrdiff_t>(index), *holder(value, path).get("v"));
    return;
  }
  fail(path, fmt::format("'{}' lies within a value, which has no parts", part));
}

/// Returns the name by which a path selects a table of the scene: the table's own name or, for a motion, that
/// of the patch it moves.
std::string name_of(const toml::table& table, const std::string& kind) {
  const toml::node* name = table.get(kind == "motion" ? "patch" : "name");
  return name && name->is_string() ? name->as_string()->get() : std::string();
}

void set_in_tables(toml::array& tables, const Path& parts, const SweepValue& value, const std::string& path) {
  const std::string& kind = parts[0];
  std::vector<std::string> names;
  bool found = false;
  for (toml::node& node : tables) {
    toml::table* table = node.as_table();
    if (table == nullptr) continue;
    names.push_back(name_of(*table, kind));
    if (parts.size() < 3 || (parts[1] != "*" && parts[1] != names.back())) continue;
    set_in(*table, parts, 2, value, path);
    found = true;
  }
  if (found) return;
  toml::table* only = tables.size() == 1 ? tables.get(0)->as_table() : nullptr;
  const bool names_it = parts.size() == 2 && std::find(names.begin(), names.end(), parts[1]) != names.end();
  if (only && !names_it && (parts.size() == 2 || (only->get(parts[1]) && !only->get(parts[1])->is_value())))
    return set_in(*only, parts, 1, value, path);
  if (names_it || (parts.size() == 2 && parts[1] == "*"))
    fail(path, fmt::format("names a {}; its key is missing: {}.KEY", kind, path));
  unknown(path, kind, parts[1], names);
}

}  // namespace

void set_key(toml::table& root, const std::string& path, const SweepValue& value) {
  const Path parts = split(path);
  static const std::vector<std::string> kinds = {"scene", "material", "patch", "motion", "body"};
  if (parts.empty() || std::find(kinds.begin(), kinds.end(), parts[0]) == kinds.end())
    fail(path, fmt::format("a key begins with scene, material, patch, motion or body{}",
                           meant(parts.empty() ? "" : parts[0], kinds)));
  toml::node* node = root.get(parts[0]);
  if (node == nullptr) fail(path, fmt::format("the scene has no {}", parts[0]));
  if (parts.size() < 2) fail(path, fmt::format("a key is missing: {}.KEY", path));
  toml::array* tables = node->as_array();
  if (parts[0] == "scene" || tables == nullptr) return set_in(*node, parts, 1, value, path);
  set_in_tables(*tables, parts, value, path);
}

void for_each_motion_file(toml::table& root, const std::function<void(std::string&)>& visit) {
  toml::node* motions = root.get("motion");
  if (motions == nullptr || !motions->is_array()) return;
  for (toml::node& node : *motions->as_array()) {
    toml::table* table = node.as_table();
    toml::node* file = table ? table->get("file") : nullptr;
    if (file && file->is_string()) visit(file->as_string()->get());
  }
}

std::string canonical_text(const toml::table& root) {
  std::ostringstream text;
  text << toml::toml_formatter{root};
  return text.str() + '\n';
}

}  // namespace cli
