#include "tools/products/virtual_room/script.hpp"

#include <algorithm>
#include <filesystem>

#include <fmt/format.h>

#include "tools/libraries/files/text_file.hpp"
#include "tools/libraries/files/toml_table.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/scene/snap_law.hpp"
#include "tools/products/virtual_room/compared.hpp"
#include "tools/products/virtual_room/parameters.hpp"

namespace room {
namespace {

using cli::Range;
using cli::snap_rule_names;
using cli::TomlTable;

constexpr double degree = 3.14159265358979323846 / 180.0;
constexpr Range seconds_range{0.0, 1e6, false, "s"};
constexpr const char* model_names[] = {"brush", "lugre", "coulomb"};

void read_settings(const TomlTable& table, Settings& s) {
  s.model = static_cast<FrictionModel>(table.choice("model", {std::begin(model_names), std::end(model_names)},
                                                    static_cast<std::size_t>(s.model)));
  s.rule = static_cast<bristle::SnapRule>(table.choice(
      "rule", {std::begin(snap_rule_names), std::end(snap_rule_names)}, static_cast<std::size_t>(s.rule)));
  s.infinite = table.choice("population", {"representatives", "infinite"}, s.infinite ? 1 : 0) == 1;
  s.compare = static_cast<Comparison>(
      table.choice("compare",
                   {compared_scenes[0].key, compared_scenes[1].key, compared_scenes[2].key,
                    compared_scenes[3].key, compared_scenes[4].key},
                   static_cast<std::size_t>(s.compare)));
  s.bristles =
      static_cast<std::uint32_t>(table.integer("bristles", fewest_bristles, most_bristles, s.bristles));
  for (const SettingRange& r : setting_ranges)
    s.*r.member = table.number(r.name, {r.min, r.max, false, r.unit}, s.*r.member);
  if (table.has("slope_deg")) s.slope = degree * table.number("slope_deg", {-45.0, 45.0, false, "degrees"});
  std::string message;
  checked_settings(s, Settings{}, message);
  if (!message.empty()) table.fail(message);
}

void read_material(const TomlTable& table, Settings& s) {
  std::vector<std::string_view> keys = {"rule"};
  for (std::size_t i = 0; i < surface_numbers; ++i) keys.push_back(setting_ranges[i].name);
  table.allow(keys);
  read_settings(table, s);
}

void allow_settings(const TomlTable& table, bool with_time) {
  std::vector<std::string_view> keys = {"t",        "model",     "rule",   "population",
                                        "bristles", "slope_deg", "compare"};
  for (const SettingRange& range : setting_ranges) keys.push_back(range.name);
  table.allow(keys);
  if (!with_time && table.has("t")) table.fail("t", "belongs in [[change]]");
}

bool read_vector(const TomlTable& table, std::string_view key, const Range& range, double (&to)[3]) {
  if (!table.has(key)) return false;
  const std::vector<double> numbers = table.numbers(key, range);
  if (numbers.size() != 3) table.fail(key, "needs three numbers: x, y, z");
  std::copy(numbers.begin(), numbers.end(), to);
  return true;
}

HandRow read_hand_row(const TomlTable& table) {
  table.allow({"t", "position", "force", "angle"});
  HandRow row;
  row.t = table.number("t", seconds_range);
  row.hand.holds = read_vector(table, "position", {-10.0, 10.0, false, "m"}, row.hand.position);
  read_vector(table, "force", {-1000.0, 1000.0, false, "N"}, row.hand.force);
  row.hand.turns = table.has("angle");
  row.hand.angle = table.number("angle", {-100.0, 100.0, false, "rad"}, 0.0);
  return row;
}

void read_room(const TomlTable& table, const std::string& path, const RoomMeasures& measures,
               Script& script) {
  table.allow({"title", "seconds", "hand_file", "lost_at", "back_at"});
  script.title = table.text("title", "");
  script.seconds = table.number("seconds", seconds_range, 0.0);
  script.lost_at = table.number("lost_at", seconds_range, script.lost_at);
  script.back_at = table.number("back_at", seconds_range, script.back_at);
  if (table.has("hand_file")) {
    const auto folder = std::filesystem::path(path).parent_path();
    script.hand = read_hand_file((folder / table.text("hand_file")).string(), measures);
  }
}

}  // namespace

Script parse_script(const std::string& text, const std::string& path, const RoomMeasures& measures,
                    const Settings& before) {
  toml::table parsed;
  try {
    parsed = toml::parse(text, path);
  } catch (const toml::parse_error& error) {
    throw cli::UserError(fmt::format("{}:{}: {}", path, error.source().begin.line, error.description()));
  }
  const TomlTable root(path, parsed, "the script");
  root.allow({"room", "settings", "material", "change", "hand"});
  Script script;
  if (root.has("material") && !root.has("settings")) script.settings = before;
  if (root.has("room")) read_room(root.table("room"), path, measures, script);
  if (root.has("settings")) {
    const TomlTable table = root.table("settings");
    allow_settings(table, false);
    read_settings(table, script.settings);
  }
  if (root.has("material")) read_material(root.table("material"), script.settings);
  Settings settings = script.settings;
  for (const TomlTable& table : root.tables("change")) {
    allow_settings(table, true);
    const double t = table.number("t", seconds_range);
    if (!script.changes.empty() && t < script.changes.back().t)
      table.fail("t", "is before that of the last change");
    read_settings(table, settings);
    script.changes.push_back({t, settings});
  }
  const auto rows = root.tables("hand");
  if (!rows.empty() && !script.hand.rows.empty()) root.fail("has both hand_file and [[hand]] rows: give one");
  for (const TomlTable& table : rows) {
    HandRow row = read_hand_row(table);
    if (!script.hand.rows.empty()) {
      const HandRow& last = script.hand.rows.back();
      if (row.t < last.t) table.fail("t", "is before that of the last row");
      // Keeps the hand's end of the spring where it was when the hand let go. Otherwise the fading force of
      // the spring would jump.
      if (!row.hand.holds) std::copy_n(last.hand.position, 3, row.hand.position);
    }
    script.hand.rows.push_back(row);
  }
  if (script.seconds == 0.0)
    script.seconds = std::max(script.hand.end(), script.changes.empty() ? 0.0 : script.changes.back().t);
  return script;
}

Script read_script(const std::string& path, const RoomMeasures& measures, const Settings& before) {
  return parse_script(cli::read_text_file(path), path, measures, before);
}

namespace {

// Writes a setting as a TOML float, which needs a point or an exponent; {:e} prints both.
std::string as_toml(const SettingRange& range, const Settings& s) {
  return fmt::format("{} = {:.17e}\n", range.name, s.*range.member);
}

}  // namespace

std::string material_as_toml(const Settings& s) {
  std::string text = fmt::format("rule = \"{}\"\n", cli::to_string(s.rule));
  for (std::size_t i = 0; i < surface_numbers; ++i) text += as_toml(setting_ranges[i], s);
  return text;
}

std::string settings_as_toml(const Settings& s) {
  std::string text =
      fmt::format("model = \"{}\"\nrule = \"{}\"\npopulation = \"{}\"\nbristles = {}\ncompare = \"{}\"\n",
                  model_names[static_cast<std::size_t>(s.model)], cli::to_string(s.rule),
                  s.infinite ? "infinite" : "representatives", s.bristles, scene_of(s.compare).key);
  for (const SettingRange& r : setting_ranges) text += as_toml(r, s);
  return text;
}

}  // namespace room
