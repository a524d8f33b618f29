// Puts the main result of a report into a sentence, which a command prints first.
#include "tools/libraries/reports/answers.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "tools/libraries/reports/numbers.hpp"

namespace cli {
namespace {

/// Returns the number under `key`. JSON stores numbers that are not finite as null, which becomes NaN.
double number_at(const Json& json, const char* key) {
  const Json& value = json.at(key);
  return value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>();
}

std::string error_text(const Json& setting) { return percent_text(setting.at("error").at("rms")) + " %"; }
std::string step_text(const Json& setting) { return time_text(number_at(setting, "scene_step_s")); }

}  // namespace

std::string setting_bristles(const Json& setting) {
  if (setting.at("as_scene").get<bool>()) return "as it is";
  if (setting.value("population", "") == "infinite")
    return "infinite, resolution " + number_text(setting.at("resolution"));
  return count_text(setting.at("bristles").get<unsigned long long>());
}

std::string setting_in_words(const Json& setting) {
  const std::string step = time_text(number_at(setting, "dt_s"));
  if (setting.at("as_scene").get<bool>()) return "the scene as it is";
  if (setting.value("population", "") == "infinite")
    return fmt::format("the infinite brush at resolution {}, steps of {}, {} force",
                       number_text(setting.at("resolution")), step, text_of(setting, "force"));
  return fmt::format("{} bristles a patch, steps of {}, {} rule, {} precision, {} force",
                     setting_bristles(setting), step, text_of(setting, "step_rule"),
                     text_of(setting, "precision"), text_of(setting, "force"));
}

std::string how_wrong_is_fast(const Json& accuracy) {
  const Json *fastest = nullptr, *as_it_is = nullptr;
  for (const Json& setting : accuracy.at("settings")) {
    if (!fastest || number_at(setting, "scene_step_s") < number_at(*fastest, "scene_step_s"))
      fastest = &setting;
    if (setting.at("as_scene").get<bool>()) as_it_is = &setting;
  }
  if (!fastest) return "";
  std::string text = fmt::format("The fastest tried is {} wrong at {} a step: {}.", error_text(*fastest),
                                 step_text(*fastest), setting_in_words(*fastest));
  if (as_it_is && as_it_is != fastest)
    text += fmt::format(" The scene as it is: {} wrong at {}.", error_text(*as_it_is), step_text(*as_it_is));
  return text;
}

std::string what_to_choose(const Json& accuracy) {
  const Json& best = accuracy.at("recommendation");
  const std::string wanted = percent_text(best.at("wanted_error"));
  if (!best.at("found").get<bool>())
    return fmt::format(
        "No setting tried meets {} %; the least error of all is {} %: allow that, or more time.", wanted,
        percent_text(best.at("least_error")));
  const Json& confirmed = best.at("confirmed");
  return fmt::format("For at most {} % take {}: {} wrong when run again, {} a step, {} % of the deadline.",
                     wanted, setting_in_words(best.at("setting")), error_text(confirmed),
                     step_text(confirmed), percent_text(best.at("share_of_deadline")));
}

std::string accuracy_answer(const Json& accuracy) {
  std::string text = what_to_choose(accuracy);
  const std::string fast = how_wrong_is_fast(accuracy);
  if (!fast.empty()) text += '\n' + fast;
  return text + '\n';
}

std::string is_mine_stable(const Json& stability) {
  std::string always;
  const Json* explicit_loop = nullptr;
  for (const Json& map : stability.at("maps")) {
    const Json& cells = map.at("cells");
    const bool all = std::all_of(cells.begin(), cells.end(),
                                 [](const Json& cell) { return cell.value("verdict", "") == "settles"; });
    std::string scheme = text_of(map, "scheme");
    if (scheme.starts_with("coupling, ")) scheme.erase(0, std::string("coupling, ").size());
    if (all && !cells.empty()) always += (always.empty() ? "" : " or ") + scheme;
    if (text_of(map, "scheme") == "explicit Euler") explicit_loop = &map;
  }
  std::string text;
  const Json& k = stability.at("k");
  if (!always.empty())
    text = fmt::format("Yes, at every step tried, if it is coupled by {}: k = K T²/m up to {}.", always,
                       number_text(k.at(k.size() - 1)));
  if (explicit_loop)
    text += fmt::format("{}An explicit loop is stable only where {}.", text.empty() ? "" : " ",
                        text_of(*explicit_loop, "linear_condition"));
  return text;
}

std::string stability_answer(const Json& stability) {
  std::string text = is_mine_stable(stability);
  const Json& maps = stability.at("maps");
  double least = 1.0, creep = 0.0, seconds = 0.0;
  for (const Json& map : maps) least = std::min(least, number_at(map, "fraction_agreeing"));
  if (!maps.empty())
    text += fmt::format(" Linear theory is right in {} % of the cells or more.", percent_text(least));
  for (const Json& row : stability.at("rests")) {
    creep = std::max(creep, std::fabs(number_at(row, "creep_m")));
    seconds = std::max(seconds, number_at(row, "seconds"));
  }
  if (seconds > 0.0)
    text +=
        fmt::format(" A block on a slope creeps by {} m in {} s.", number_text(creep), number_text(seconds));
  return text + '\n';
}

}  // namespace cli
