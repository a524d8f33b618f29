#include "tools/libraries/sweep/results.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "tools/libraries/files/nearest_name.hpp"
#include "tools/libraries/files/user_error.hpp"

namespace cli {
namespace {

using Json = nlohmann::json;
using Reader = Json (*)(const SweepRun&, std::size_t);

constexpr const char* type_names[] = {"number", "whole", "hash", "text"};

Json finite(double value) { return std::isfinite(value) ? Json(value) : Json(); }
Json ratio(double numerator, double denominator) {
  return denominator > 0.0 ? finite(numerator / denominator) : Json();
}

const PatchResult& patch(const SweepRun& run, std::size_t p) { return run.result.patches[p]; }
const BodyResult& body(const SweepRun& run, std::size_t b) { return run.result.bodies[b]; }
const bristle::Material& material(const SweepRun& run, std::size_t p) {
  return run.scene.materials[run.scene.patches[p].material].material;
}

template <int axis, double ForceStatistics::*field>
Json force(const SweepRun& run, std::size_t p) {
  return run.scene.patches[p].options.axes > axis ? finite(patch(run, p).force[axis].*field) : Json();
}
template <int axis, double (ForceStatistics::*get)() const noexcept>
Json force(const SweepRun& run, std::size_t p) {
  return run.scene.patches[p].options.axes > axis ? finite((patch(run, p).force[axis].*get)()) : Json();
}
/// Returns one of the energies of a patch, J. It is JSON null if the patch does not compute energies.
template <auto field>
Json energy(const SweepRun& run, std::size_t p) {
  if (!has(run.scene.patches[p].options.outputs, bristle::Outputs::energy)) return {};
  return Json(patch(run, p).*field);
}
template <std::uint64_t PatchResult::*field>
Json steps(const SweepRun& run, std::size_t p) {
  return patch(run, p).*field;
}

struct Kind {
  const char* name;
  const char* unit;
  ColumnType type;
  enum Default { never, always, second_axis, energies } shown;
  Reader read;
};

constexpr ColumnType number = ColumnType::number, whole = ColumnType::whole;

const Kind patch_kinds[] = {
    {"kinetic", "", number, Kind::always,
     [](const SweepRun& r, std::size_t p) {
       return ratio(patch(r, p).sliding_force, patch(r, p).sliding_load);
     }},
    {"peak", "", number, Kind::always,
     [](const SweepRun& r, std::size_t p) { return finite(patch(r, p).highest_coefficient); }},
    {"kinetic_in_theory", "", number, Kind::never,
     [](const SweepRun& r, std::size_t p) { return finite(material(r, p).kinetic_coefficient()); }},
    {"peak_in_theory", "", number, Kind::never,
     [](const SweepRun& r, std::size_t p) { return finite(material(r, p).peak_coefficient()); }},
    {"missed_peak", "", ColumnType::text, Kind::always,
     [](const SweepRun& r, std::size_t p) {
       const std::string missed = missed_peak(r.scene, patch(r, p), p);
       return missed.empty() ? Json() : Json(missed);
     }},
    {"fx_mean", "N", number, Kind::always, force<0, &ForceStatistics::mean>},
    {"fx_rms", "N", number, Kind::always, force<0, &ForceStatistics::rms>},
    {"fx_min", "N", number, Kind::always, force<0, &ForceStatistics::min>},
    {"fx_max", "N", number, Kind::always, force<0, &ForceStatistics::max>},
    {"fy_mean", "N", number, Kind::second_axis, force<1, &ForceStatistics::mean>},
    {"fy_rms", "N", number, Kind::second_axis, force<1, &ForceStatistics::rms>},
    {"fy_min", "N", number, Kind::second_axis, force<1, &ForceStatistics::min>},
    {"fy_max", "N", number, Kind::second_axis, force<1, &ForceStatistics::max>},
    {"load_mean", "N", number, Kind::always,
     [](const SweepRun& r, std::size_t p) { return finite(patch(r, p).load.mean()); }},
    {"x", "m", number, Kind::always,
     [](const SweepRun& r, std::size_t p) { return finite(r.windows[p].way[0]); }},
    {"y", "m", number, Kind::second_axis,
     [](const SweepRun& r, std::size_t p) { return finite(r.windows[p].way[1]); }},
    {"snaps", "", whole, Kind::energies, energy<&PatchResult::snaps>},
    {"dissipated", "J", number, Kind::energies, energy<&PatchResult::dissipated>},
    {"contact_loss", "J", number, Kind::energies, energy<&PatchResult::contact_loss>},
    {"damper_work", "J", number, Kind::energies, energy<&PatchResult::damper_work>},
    {"stored", "J", number, Kind::energies,
     [](const SweepRun& r, std::size_t p) { return finite(patch(r, p).stored); }},
    {"bristles", "", whole, Kind::never,
     [](const SweepRun& r, std::size_t p) { return Json(patch(r, p).info.representatives); }},
    {"sliding_steps", "", whole, Kind::never, steps<&PatchResult::sliding_steps>},
    {"contact_steps", "", whole, Kind::never, steps<&PatchResult::steps_in_contact>},
    {"overload_steps", "", whole, Kind::never, steps<&PatchResult::overload_steps>},
    {"bad_steps", "", whole, Kind::never, steps<&PatchResult::bad_steps>},
};

const Kind window_kinds[] = {
    {"window_peak", "", number, Kind::always,
     [](const SweepRun& r, std::size_t p) {
       return r.windows[p].count ? finite(r.windows[p].highest_coefficient) : Json();
     }},
    {"window_mean", "", number, Kind::always,
     [](const SweepRun& r, std::size_t p) {
       return ratio(r.windows[p].coefficient_sum, static_cast<double>(r.windows[p].count));
     }},
};

const Kind error_kind = {"error", "", number, Kind::always, [](const SweepRun& r, std::size_t p) {
                           const WindowSums& w = r.windows[p];
                           return w.reference_square_sum > 0.0
                                      ? finite(std::sqrt(w.error_square_sum / w.reference_square_sum))
                                      : Json();
                         }};

const Kind body_kinds[] = {
    {"x", "m", number, Kind::always,
     [](const SweepRun& r, std::size_t b) { return finite(body(r, b).position[0]); }},
    {"y", "m", number, Kind::second_axis,
     [](const SweepRun& r, std::size_t b) { return finite(body(r, b).position[1]); }},
    {"vx", "m/s", number, Kind::always,
     [](const SweepRun& r, std::size_t b) { return finite(body(r, b).velocity[0]); }},
    {"vy", "m/s", number, Kind::second_axis,
     [](const SweepRun& r, std::size_t b) { return finite(body(r, b).velocity[1]); }},
    {"highest_speed", "m/s", number, Kind::always,
     [](const SweepRun& r, std::size_t b) { return finite(body(r, b).highest_speed); }},
};

const Kind run_kinds[] = {
    {"steps", "", whole, Kind::never, [](const SweepRun& r, std::size_t) { return Json(r.result.steps); }},
    {"state_hash", "", ColumnType::hash, Kind::always,
     [](const SweepRun& r, std::size_t) { return Json(fmt::format("{:016x}", r.result.state_hash)); }},
};

const Kind time_kinds[] = {
    {"time.step_p50", "s", number, Kind::never,
     [](const SweepRun& r, std::size_t) { return finite(r.result.monitor.p50()); }},
    {"time.step_p99", "s", number, Kind::never,
     [](const SweepRun& r, std::size_t) { return finite(r.result.monitor.p99()); }},
    {"time.wall", "s", number, Kind::never,
     [](const SweepRun& r, std::size_t) { return finite(r.result.seconds); }},
    {"time.cpu", "s", number, Kind::never, [](const SweepRun& r, std::size_t) { return finite(r.cpu_s); }},
};

/// Largest number of patches, and of bodies, whose results a study reports if its options name none: the
/// first ones of the scene.
constexpr std::size_t most_by_default = 12;

class Results {
 public:
  void add(const Kind& kind, const std::string& owner, std::size_t index, int axes, bool energies,
           bool measured) {
    const bool shown = kind.shown == Kind::always || (kind.shown == Kind::second_axis && axes > 1) ||
                       (kind.shown == Kind::energies && energies);
    const std::string name = owner.empty() ? kind.name : owner + '.' + kind.name;
    all.push_back(
        {{name, kind.unit, kind.type, measured}, shown && index < most_by_default, kind.read, index});
  }
  std::vector<SweepResult> all;
};

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

std::vector<SweepResult> all_results(const Scene& scene, bool with_error, bool with_window) {
  Results results;
  for (std::size_t p = 0; p < scene.patches.size(); ++p) {
    const ScenePatch& patch = scene.patches[p];
    const bool energies = has(patch.options.outputs, bristle::Outputs::energy);
    const auto add = [&](const Kind& kind) {
      results.add(kind, patch.name, p, patch.options.axes, energies, false);
    };
    if (with_error) add(error_kind);
    if (with_window)
      for (const Kind& kind : window_kinds) add(kind);
    for (const Kind& kind : patch_kinds) add(kind);
  }
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    const SceneBody& body = scene.bodies[b];
    const bool taken = std::any_of(scene.patches.begin(), scene.patches.end(),
                                   [&](const ScenePatch& patch) { return patch.name == body.name; });
    for (const Kind& kind : body_kinds)
      results.add(kind, taken ? "body." + body.name : body.name, b, body.axes, false, false);
  }
  for (const Kind& kind : run_kinds) results.add(kind, "", 0, 1, false, false);
  for (const Kind& kind : time_kinds) results.add(kind, "", 0, 1, false, true);
  return std::move(results.all);
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
