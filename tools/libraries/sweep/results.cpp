#include "tools/libraries/sweep/results.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "tools/libraries/files/nearest_name.hpp"
#include "tools/libraries/files/user_error.hpp"

namespace cli {
namespace {

using Json = nlohmann::json;

constexpr const char* type_names[] = {"number", "whole", "hash", "text"};

/// Kind of result, and the pointer to its value in the part of the run's report on its patch or body.
struct Kind {
  const char* name;
  const char* unit;
  const char* pointer;
  enum Default { never, always, second_axis, energies } shown = always;
  ColumnType type = ColumnType::number;
};

constexpr ColumnType whole = ColumnType::whole;

constexpr Kind patch_kinds[] = {
    {"kinetic", "", "/coefficient/sliding"},
    {"peak", "", "/coefficient/highest"},
    {"kinetic_in_theory", "", "/coefficient/kinetic_theory", Kind::never},
    {"peak_in_theory", "", "/coefficient/peak_theory", Kind::never},
    {"missed_peak", "", "/coefficient/missed_peak", Kind::always, ColumnType::text},
    {"fx_mean", "N", "/force/x/mean"},
    {"fx_rms", "N", "/force/x/rms"},
    {"fx_min", "N", "/force/x/min"},
    {"fx_max", "N", "/force/x/max"},
    {"fy_mean", "N", "/force/y/mean", Kind::second_axis},
    {"fy_rms", "N", "/force/y/rms", Kind::second_axis},
    {"fy_min", "N", "/force/y/min", Kind::second_axis},
    {"fy_max", "N", "/force/y/max", Kind::second_axis},
    {"load_mean", "N", "/load/mean"},
    {"x", "m", "/path/0"},
    {"y", "m", "/path/1", Kind::second_axis},
    {"snaps", "", "/energy/snaps", Kind::energies, whole},
    {"dissipated", "J", "/energy/dissipated", Kind::energies},
    {"contact_loss", "J", "/energy/contact_loss", Kind::energies},
    {"damper_work", "J", "/energy/damper_work", Kind::energies},
    {"stored", "J", "/energy/stored", Kind::energies},
    {"bristles", "", "/bristles", Kind::never, whole},
    {"sliding_steps", "", "/coefficient/sliding_steps", Kind::never, whole},
    {"contact_steps", "", "/status/steps_in_contact", Kind::never, whole},
    {"overload_steps", "", "/status/overload", Kind::never, whole},
    {"bad_steps", "", "/status/bad_input", Kind::never, whole}};

constexpr Kind window_kinds[] = {{"window_peak", "", "/window/peak"}, {"window_mean", "", "/window/mean"}};

constexpr Kind error_kind = {"error", "", "/window/error"};

constexpr Kind body_kinds[] = {{"x", "m", "/position/0"},
                               {"y", "m", "/position/1", Kind::second_axis},
                               {"vx", "m/s", "/velocity/0"},
                               {"vy", "m/s", "/velocity/1", Kind::second_axis},
                               {"highest_speed", "m/s", "/highest_speed"}};

constexpr Kind run_kinds[] = {{"steps", "", "/steps", Kind::never, whole},
                              {"state_hash", "", "/state_hash", Kind::always, ColumnType::hash}};

constexpr Kind time_kinds[] = {{"time.step_p50", "s", "/step_time/p50_s", Kind::never},
                               {"time.step_p99", "s", "/step_time/p99_s", Kind::never},
                               {"time.wall", "s", "/wall_s", Kind::never},
                               {"time.cpu", "s", "/cpu_s", Kind::never}};

/// Largest number of patches, and of bodies, whose results a study reports if its options name none: the
/// first ones of the scene.
constexpr std::size_t most_by_default = 12;

/// Owner of results: a patch or a body, or the run itself without a name.
struct Owner {
  std::string name;
  const char* list = "";  ///< list in the run's report that has the owner
  std::size_t index = 0;  ///< index of the owner in this list
  int axes = 1;
  bool energies = false;
};

SweepResult result_of(const Kind& kind, const Owner& owner, bool measured = false) {
  const bool shown = kind.shown == Kind::always || (kind.shown == Kind::second_axis && owner.axes > 1) ||
                     (kind.shown == Kind::energies && owner.energies);
  const std::string place = *owner.list ? fmt::format("/{}/{}", owner.list, owner.index) : "";
  return {{owner.name.empty() ? kind.name : owner.name + '.' + kind.name, kind.unit, kind.type, measured},
          shown && owner.index < most_by_default,
          place + kind.pointer};
}

std::string owner_of(const std::string& name) { return name.substr(0, name.find('.')); }
std::string leaf_of(const std::string& name) {
  const std::size_t dot = name.find('.');
  return dot == std::string::npos ? name : name.substr(dot + 1);
}

bool chooses(const std::string& word, const SweepResult& result) {
  const std::string& name = result.column.name;
  if (word == "all") return !result.column.measured;
  if (word == "default") return result.by_default;
  return word == name ||
         (name.find('.') != std::string::npos && (word == leaf_of(name) || word == owner_of(name)));
}

}  // namespace

Json to_json(const SweepColumn& column) {
  return {{"name", column.name},
          {"unit", column.unit},
          {"type", type_names[static_cast<int>(column.type)]},
          {"measured", column.measured}};
}

void WindowSums::write(nlohmann::ordered_json& patch) const {
  patch["path"] = path;
  if (count > 0) {
    patch["window"]["peak"] = highest_coefficient;
    patch["window"]["mean"] = coefficient_sum / static_cast<double>(count);
  }
  if (reference_square_sum > 0.0)
    patch["window"]["error"] = std::sqrt(error_square_sum / reference_square_sum);
}

Json SweepResult::read(const nlohmann::ordered_json& run) const {
  const nlohmann::ordered_json::json_pointer at(pointer);
  if (!run.contains(at)) return {};
  const auto& value = run.at(at);
  return value.is_number_float() && !std::isfinite(value.get<double>()) ? Json() : Json(value);
}

std::vector<SweepResult> all_results(const Scene& scene, bool with_error, bool with_window) {
  std::vector<SweepResult> all;
  for (std::size_t p = 0; p < scene.patches.size(); ++p) {
    const bristle::PatchOptions& options = scene.patches[p].options;
    const Owner owner{scene.patches[p].name, "patches", p, options.axes,
                      has(options.outputs, bristle::Outputs::energy)};
    if (with_error) all.push_back(result_of(error_kind, owner));
    if (with_window)
      for (const Kind& kind : window_kinds) all.push_back(result_of(kind, owner));
    for (const Kind& kind : patch_kinds) all.push_back(result_of(kind, owner));
  }
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    const SceneBody& body = scene.bodies[b];
    const bool taken = std::any_of(scene.patches.begin(), scene.patches.end(),
                                   [&](const ScenePatch& patch) { return patch.name == body.name; });
    const Owner owner{taken ? "body." + body.name : body.name, "bodies", b, body.axes};
    for (const Kind& kind : body_kinds) all.push_back(result_of(kind, owner));
  }
  for (const Kind& kind : run_kinds) all.push_back(result_of(kind, {}));
  for (const Kind& kind : time_kinds) all.push_back(result_of(kind, {}, true));
  return all;
}

std::vector<SweepResult> chosen_results(const Scene& scene, const std::vector<std::string>& report,
                                        bool with_error, bool with_window) {
  const std::vector<std::string> words = report.empty() ? std::vector<std::string>{"default"} : report;
  const std::vector<SweepResult> all = all_results(scene, with_error, with_window);
  std::vector<SweepResult> chosen;
  std::vector<bool> taken(all.size(), false);
  for (const std::string& word : words) {
    bool found = false;
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (!chooses(word, all[i])) continue;
      found = true;
      if (!taken[i]) chosen.push_back(all[i]);
      taken[i] = true;
    }
    if (found) continue;
    std::vector<std::string> names = {"all", "default"};
    for (const SweepResult& result : all) {
      names.push_back(result.column.name);
      names.push_back(leaf_of(result.column.name));
      names.push_back(owner_of(result.column.name));
    }
    std::vector<std::string> leaves;
    for (const SweepResult& result : all) {
      const std::string leaf = result.column.measured ? result.column.name : leaf_of(result.column.name);
      if (std::find(leaves.begin(), leaves.end(), leaf) == leaves.end()) leaves.push_back(leaf);
    }
    throw UserError(
        fmt::format("--report {}: no such result{}; allowed: default, all, the name of a patch or body, "
                    "or one of {}",
                    word, meant(word, names), fmt::join(leaves, ", ")));
  }
  return chosen;
}

}  // namespace cli
