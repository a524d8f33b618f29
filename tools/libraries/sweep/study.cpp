#include "tools/libraries/sweep/study.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include <fmt/format.h>

#include <bristle/deadline_monitor.hpp>
#include <bristle/error.hpp>
#include <bristle/fields.hpp>
#include <bristle/version.hpp>

#include "tools/libraries/files/number_text.hpp"
#include "tools/libraries/files/one_line.hpp"
#include "tools/libraries/files/text_file.hpp"
#include "tools/libraries/files/toml_text.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/platform/platform.hpp"
#include "tools/libraries/reports/conditions.hpp"
#include "tools/libraries/scene/scene_memory.hpp"
#include "tools/libraries/scene/scene_stepper.hpp"
#include "tools/libraries/scene/scene_table.hpp"
#include "tools/libraries/sweep/override.hpp"

namespace cli {
namespace {

using Json = nlohmann::json;

constexpr std::uint64_t most_reference_numbers = 100'000'000;

/// Returns 64 random bits from a seed and two counters, by the finaliser of SplitMix64 (Steele, Lea and Flood
/// 2014). All random numbers of a sweep come from this function, so each depends only on its place in the
/// study.
std::uint64_t counted_bits(std::uint64_t seed, std::uint64_t stream, std::uint64_t index) noexcept {
  constexpr std::uint64_t golden = 0x9e3779b97f4a7c15u;
  const auto mixed = [](std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  };
  return mixed(mixed(mixed(seed + golden) + stream + golden) + index + golden);
}

/// Returns the unit of a varied key by the last part of its path. It is empty for keys that are pure numbers
/// or not listed.
std::string unit_of(const VariedKey& varied) {
  static constexpr std::pair<const char*, const char*> units[] = {
      {"s", " dt duration deadline delay_per_copy from until t "},
      {"m", " length mean min max deviation "},
      {"m/s", " velocity "},
      {"m/s^2", " gravity "},
      {"N", " load clip_load extra_load "},
      {"Hz", " frequency "},
      {"N/m", " stiffness "},
      {"N s/m", " damping "},
      {"turns", " turn_per_copy phase "},
      {"kg", " mass "}};
  std::string path = varied.key;
  const bool in_body = path.starts_with("body");
  const bool force = path.find(".force") != std::string::npos;
  std::string leaf = path.substr(path.rfind('.') + 1);
  if (!leaf.empty() && std::all_of(leaf.begin(), leaf.end(), [](char c) { return c >= '0' && c <= '9'; })) {
    path.resize(path.rfind('.'));
    leaf = path.substr(path.rfind('.') + 1);
  }
  if (leaf == "amplitude" || leaf == "x" || leaf == "y") return in_body && force ? "N" : "m";
  for (const auto& [unit, keys] : units)
    if (std::string_view(keys).find(' ' + leaf + ' ') != std::string_view::npos) return unit;
  std::string unit;
  const auto look = [&](const auto& field) {
    if (leaf == field.name) unit = field.about.unit;
  };
  bristle::for_each_field<bristle::Material>(look);
  bristle::for_each_field<bristle::Coefficients>(look);
  bristle::for_each_field<bristle::PatchOptions>(look);
  bristle::for_each_field<bristle::Lay>(look);
  return unit;
}

ColumnType type_of(const VariedKey& varied) {
  const auto all = [&](bool (*is)(const Json&)) {
    return std::all_of(varied.values.begin(), varied.values.end(), is);
  };
  if (all([](const Json& value) { return value.is_number_integer(); })) return ColumnType::whole;
  if (all([](const Json& value) { return value.is_number(); })) return ColumnType::number;
  return ColumnType::text;
}

/// Converts the value of a varied key to a cell of its column. If one value is a text, the whole column is
/// text.
Json cell_of(const SweepValue& value, ColumnType type) {
  if (type == ColumnType::text && value.is_number()) return value.dump();
  if (type == ColumnType::number) return value.get<double>();
  return value;
}

std::vector<VariedKey> settings_of(const std::vector<std::string>& texts, const std::string& option) {
  std::vector<VariedKey> settings;
  for (const std::string& text : texts) settings.push_back(parse_setting(text, option));
  return settings;
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  if (what.empty()) return text;
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += by.size())
    text.replace(at, what.size(), by);
  return text;
}

void parse_window(const std::string& text, double& from, double& until) {
  const std::size_t colon = text.find(':');
  const auto seconds = [&](const std::string& part, double otherwise) {
    if (part.empty()) return otherwise;
    const std::optional<double> value = number_in<double>(part);
    if (!value)
      throw UserError(fmt::format("--window is '{}'; allowed: FROM:UNTIL in s, either may be missing", text));
    return *value;
  };
  if (colon == std::string::npos)
    throw UserError(fmt::format("--window is '{}'; allowed: FROM:UNTIL in s, either may be missing", text));
  from = seconds(text.substr(0, colon), 0.0);
  until = seconds(text.substr(colon + 1), 1e300);
  if (!(until > from))
    throw UserError(fmt::format("--window is '{}'; its end must come after its beginning", text));
}

/// Extracts the allowed keys from the scene reader's message on an unknown key. Returns none for any other
/// message.
std::vector<std::string> keys_allowed_by(const std::string& message, const std::string& key) {
  const std::size_t said = message.find(fmt::format("unknown key '{}'", key));
  const std::string_view before = "; allowed: ";
  std::vector<std::string> keys;
  if (said == std::string::npos) return keys;
  std::string rest = message.substr(message.find(before, said) + before.size());
  for (std::size_t comma; (comma = rest.find(", ")) != std::string::npos; rest.erase(0, comma + 2))
    keys.push_back(rest.substr(0, comma));
  keys.push_back(rest);
  return keys;
}

/// End forces of all steps of a run, N. Within a step they are in the order of the copies.
using Forces = std::vector<double>;

/// Observer of a run that computes what the run's own statistics lack, such as errors in a time window.
class Gatherer {
 public:
  Gatherer(const Scene& scene, double from, double until, const Forces* reference)
      : scene_(scene), from_(from), until_(until), reference_(reference), windows_(scene.patches.size()) {}

  void operator()(const SceneStepper& stepper) {
    const double t = static_cast<double>(++steps_) * scene_.dt;
    // Widens the time window by half a step at its ends, because step times are rounded.
    const bool inside = t > from_ + 0.5 * scene_.dt && t < until_ + 0.5 * scene_.dt;
    std::size_t last = windows_.size();
    for (std::size_t c = 0; c < stepper.copies().size(); ++c) {
      const std::size_t p = stepper.copies()[c].patch;
      const bristle::Motion& motion = stepper.motions()[c];
      WindowSums& sums = windows_[p];
      if (p != last) {
        sums.path[0] += motion.displacement[0];
        sums.path[1] += motion.displacement[1];
      }
      last = p;
      if (inside)
        add(sums, motion, stepper.responses()[c], scene_.patches[p].options.axes, c, stepper.copies().size());
    }
  }

  const std::vector<WindowSums>& windows() const { return windows_; }

 private:
  void add(WindowSums& sums, const bristle::Motion& motion, const bristle::Response& response, int axes,
           std::size_t copy, std::size_t copies) const {
    const double fx = response.elastic[0], fy = axes == 2 ? response.elastic[1] : 0.0;
    if (motion.normal_load > 0.0) {
      const double coefficient = std::sqrt(fx * fx + fy * fy) / motion.normal_load;
      sums.coefficient_sum += coefficient;
      sums.highest_coefficient = std::max(sums.highest_coefficient, coefficient);
      ++sums.count;
    }
    const std::size_t at = 2 * ((steps_ - 1) * copies + copy);
    for (std::size_t axis = 0; reference_ && axis < static_cast<std::size_t>(axes); ++axis) {
      const double truth = (*reference_)[at + axis], error = response.end[axis] - truth;
      sums.error_square_sum += error * error;
      sums.reference_square_sum += truth * truth;
    }
  }

  const Scene& scene_;
  double from_, until_;
  const Forces* reference_;
  std::vector<WindowSums> windows_;
  std::uint64_t steps_ = 0;
};

RunOptions run_options(const Study& study, const std::string& isa) {
  RunOptions options;
  options.threads = 1;
  options.quiet = true;
  options.isa = isa;
  options.steps = study.options().steps;
  return options;
}

Forces forces_of(const Scene& scene, const RunOptions& options, const StepCheck& check) {
  const std::uint64_t numbers =
      2 * (options.steps ? *options.steps : step_count(scene)) * scene.patch_count();
  if (numbers > most_reference_numbers)
    throw UserError(fmt::format(
        "--reference: its forces are {} numbers; allowed: at most {}; take fewer steps or patches", numbers,
        most_reference_numbers));
  check_memory(scene);
  Forces forces;
  forces.reserve(numbers);
  run_scene(scene, options, [&](const SceneStepper& stepper) {
    for (const bristle::Response& response : stepper.responses()) {
      forces.push_back(response.end[0]);
      forces.push_back(response.end[1]);
    }
    if (check) check();
  });
  return forces;
}

/// Returns a text of modification time and size, which changes when the file does.
std::string stamp_of(const std::string& path) {
  std::error_code error;
  const auto time =
      std::filesystem::last_write_time(std::filesystem::path(path), error).time_since_epoch().count();
  const auto size = std::filesystem::file_size(std::filesystem::path(path), error);
  return error ? std::string("gone") : fmt::format("{} {}", time, size);
}

/// Error of this machine, such as too little memory. It does not mean that the row's scene is impossible.
struct NotHere : UserError {
  using UserError::UserError;
};

}  // namespace

std::string text_hash(std::string_view text) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  return fmt::format("{:016x}", hash);
}

Study::Study(const StudyOptions& options) : options_(options) {
  scene_text_ = read_text_file(options.scene, most_scene_bytes);
  scene_file_ = std::filesystem::path(options.scene).filename().string();
  if (scene_file_.empty()) scene_file_ = "scene.toml";
  varied_.reserve(options.vary.size());
  for (const std::string& text : options.vary) varied_.push_back(parse_varied(text));
  set_ = settings_of(options.set, "--set");
  reference_ = settings_of(options.reference, "--reference");
  collect_files();
  prepare();
}

Study::Study(const std::string& recipe, const std::string& folder) {
  const Json json = Json::parse(recipe);
  options_.scene = scene_file_ = json.at("scene_file").get<std::string>();
  scene_text_ = json.at("scene").get<std::string>();
  files_ = json.at("files").get<std::map<std::string, std::string>>();
  options_.vary = json.at("vary").get<std::vector<std::string>>();
  options_.repeat = json.at("repeat").get<std::uint64_t>();
  if (!json.at("seed").is_null()) options_.seed = json.at("seed").get<std::uint32_t>();
  options_.set = json.at("set").get<std::vector<std::string>>();
  options_.reference = json.at("reference").get<std::vector<std::string>>();
  options_.report = json.at("report").get<std::vector<std::string>>();
  options_.window = json.at("window").get<std::string>();
  if (!json.at("steps").is_null()) options_.steps = json.at("steps").get<std::uint64_t>();
  for (const std::string& text : options_.vary) varied_.push_back(parse_varied(text));
  set_ = settings_of(options_.set, "--set");
  reference_ = settings_of(options_.reference, "--reference");
  for (const auto& [name, text] : files_) {
    const std::string path = (std::filesystem::path(folder) / fmt::format("{}.csv", paths_.size())).string();
    std::ofstream(std::filesystem::path(path), std::ios::binary) << text;
    paths_[name] = path;
  }
  prepare();
}

std::string Study::recipe() const {
  const Json json = {{"scene_file", scene_file_},
                     {"scene", scene_text_},
                     {"files", files_},
                     {"vary", options_.vary},
                     {"repeat", options_.repeat},
                     {"seed", options_.seed ? Json(*options_.seed) : Json()},
                     {"set", options_.set},
                     {"reference", options_.reference},
                     {"report", options_.report},
                     {"window", options_.window},
                     {"steps", options_.steps ? Json(*options_.steps) : Json()}};
  return json.dump();
}

std::vector<FileOption> Study::inputs() const {
  std::vector<FileOption> inputs = {{"SCENE", options_.scene}};
  for (const auto& [name, path] : paths_) inputs.push_back({"its motion", path});
  return inputs;
}

// Reads every motion file that a row may need: those named in the scene, in settings, and as values of a
// varied key `file`.
void Study::collect_files() {
  const std::filesystem::path folder = std::filesystem::path(options_.scene).parent_path();
  const auto add = [&](const std::string& name) {
    if (files_.contains(name)) return;
    const std::string path = std::filesystem::absolute(folder / std::filesystem::path(name)).string();
    stamps_[path] = stamp_of(path);
    files_[name] = read_text_file(path);
    paths_[name] = path;
  };
  toml::table root = parse_toml(scene_text_, scene_file_);
  for_each_motion_file(root, [&](const std::string& name) { add(name); });
  for (const std::vector<VariedKey>* keys : {&varied_, &set_, &reference_})
    for (const VariedKey& varied : *keys) {
      if (!varied.key.starts_with("motion") || !varied.key.ends_with(".file")) continue;
      for (const SweepValue& value : varied.values)
        if (value.is_string()) add(value.get<std::string>());
    }
}

void Study::prepare() {
  if (options_.repeat < 1) throw UserError("--repeat is 0; allowed: 1 or more");
  if (!options_.window.empty()) parse_window(options_.window, window_from_, window_until_);
  find_points();
  const bool seeded = options_.seed || options_.repeat > 1;
  for (const VariedKey& varied : varied_)
    if (seeded && varied.key.ends_with(".seed"))
      throw UserError(fmt::format(
          "--vary {}: --repeat and --seed give every row its seeds; take one of the two", varied.key));
  toml::table base = document();
  for (const VariedKey& setting : set_) set_key(base, setting.key, setting.values[0]);
  const Scene scene = scene_from(std::move(base));
  scene_name_ = scene.name;
  check_keys();
  results_ = chosen_results(scene, options_.report, !reference_.empty(), !options_.window.empty());
  columns_.push_back({"index", "", ColumnType::whole});
  if (seeded) columns_.push_back({"seed", "", ColumnType::whole});
  for (const VariedKey& varied : varied_) columns_.push_back({varied.key, unit_of(varied), type_of(varied)});
  for (const SweepResult& result : results_) columns_.push_back(result.column);
  columns_.push_back({"failure", "", ColumnType::text});
  hash_ = study_hash();
}

void Study::find_points() {
  for (std::size_t i = 0; i < varied_.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (varied_[i].key == varied_[j].key)
        throw UserError(fmt::format("--vary {}: is given twice", varied_[i].key));
  points_ = 1;
  for (const VariedKey& varied : varied_) {
    points_ *= varied.values.size();
    if (points_ > most_rows) break;
  }
  if (points_ > most_rows || options_.repeat > most_rows || points_ * options_.repeat > most_rows)
    throw UserError(fmt::format("the study has more than {} rows", most_rows));
}

std::string Study::study_hash() const {
  Json json = {{"version", bristle::library_version()},
               {"scene", canonical_text(parse_toml(scene_text_, scene_file_))},
               {"repeat", options_.repeat},
               {"seed", options_.seed ? Json(*options_.seed) : Json()},
               {"set", options_.set},
               {"reference", options_.reference},
               {"window", {window_from_, window_until_}},
               {"steps", options_.steps ? Json(*options_.steps) : Json()}};
  for (const auto& [name, text] : files_) json["files"][name] = text_hash(text);
  for (const VariedKey& v : varied_) json["vary"].push_back({v.key, v.values});
  for (const SweepColumn& column : columns_) json["columns"].push_back(to_json(column));
  return text_hash(json.dump());
}

Json Study::header() const {
  Json columns = Json::array(), vary = Json::array();
  for (const SweepColumn& column : columns_) columns.push_back(to_json(column));
  for (const VariedKey& varied : varied_) vary.push_back(varied.key + '=' + varied.range);
  return {{"study", hash_},
          {"scene", scene_name_},
          {"rows", rows()},
          {"vary", vary},
          {"repeat", options_.repeat},
          {"set", options_.set},
          {"reference", options_.reference},
          {"columns", columns},
          {"version", bristle::library_version()},
          {"commit", conditions().commit}};
}

// Parses the scene's text again for each row. A copy of a parsed document would lose its line numbers, which
// messages need.
toml::table Study::document() const { return parse_toml(scene_text_, scene_file_); }

void Study::set_values(toml::table& root, const std::vector<SweepValue>& values) const {
  for (const VariedKey& setting : set_) set_key(root, setting.key, setting.values[0]);
  for (std::size_t v = 0; v < varied_.size(); ++v) set_key(root, varied_[v].key, values[v]);
}

// Sets the seeds of a row's patches: the first patch gets the row's `seed`, so that a scene with this seed
// repeats the row; the others get hashes of it.
void Study::set_seeds(toml::table& root, std::uint32_t seed) const {
  toml::node* patches = root.get("patch");
  if (patches == nullptr || !patches->is_array()) return;
  std::uint64_t k = 0;
  for (toml::node& node : *patches->as_array()) {
    const auto own = k == 0 ? seed : static_cast<std::uint32_t>(counted_bits(seed, 2, k));
    if (toml::table* table = node.as_table()) table->insert_or_assign("seed", static_cast<std::int64_t>(own));
    ++k;
  }
}

std::vector<SweepValue> Study::values_of(std::uint64_t index) const {
  std::vector<SweepValue> values(varied_.size());
  std::uint64_t point = index / options_.repeat;
  for (std::size_t v = varied_.size(); v-- > 0;) {  // goes from the last key, which varies fastest
    values[v] = varied_[v].values[point % varied_[v].values.size()];
    point /= varied_[v].values.size();
  }
  return values;
}

std::optional<std::uint32_t> Study::seed_of(std::uint64_t index) const {
  if (!options_.seed && options_.repeat == 1) return std::nullopt;
  return static_cast<std::uint32_t>(counted_bits(options_.seed.value_or(1), 1, index));
}

toml::table Study::row_document(std::uint64_t index, bool reference) const {
  toml::table root = document();
  set_values(root, values_of(index));
  if (const auto seed = seed_of(index)) set_seeds(root, *seed);
  if (reference)
    for (const VariedKey& setting : reference_) set_key(root, setting.key, setting.values[0]);
  return root;
}

Scene Study::scene_from(toml::table root) const {
  for_each_motion_file(root, [&](std::string& name) {
    const auto found = paths_.find(name);
    if (found != paths_.end()) name = found->second;
  });
  return scene_of(root, scene_file_);
}

// Checks the keys before any row is run, and throws for keys that the scene never accepts. (A value that the
// scene refuses concerns only its row.) Tries each key alone and in the first and last row, because a key may
// need others that vary with it.
void Study::check_keys() const {
  for (const std::vector<VariedKey>* keys : {&set_, &varied_, &reference_})
    for (const VariedKey& varied : *keys) {
      const std::string leaf = varied.key.substr(varied.key.rfind('.') + 1);
      std::string complaint;
      std::vector<std::string> known;
      for (int attempt = 0; attempt < 3; ++attempt) {
        try {
          toml::table root =
              attempt == 0 ? document() : row_document(attempt == 1 ? 0 : rows() - 1, keys == &reference_);
          if (attempt == 0) set_key(root, varied.key, varied.values[0]);
          scene_from(std::move(root));
          known.clear();
          break;
        } catch (const UserError& error) {
          const std::vector<std::string> allowed = keys_allowed_by(error.what(), leaf);
          const bool no_field = std::string_view(error.what()).starts_with(varied.key + ':');
          if (no_field && attempt == 0) throw;
          if (allowed.empty()) {
            known.clear();
            break;
          }
          known = allowed;
        }
      }
      if (known.empty()) continue;
      throw UserError(
          fmt::format("{}: the scene has no key '{}'{}", varied.key, leaf, allowed_text(leaf, known)));
    }
}

// Checks that motion files, which each row reads again, have not changed since the study's hash was computed.
void Study::check_files() const {
  for (const auto& [path, stamp] : stamps_)
    if (stamp_of(path) != stamp)
      throw NotHere(
          fmt::format("{}: changed while the sweep ran; begin again, with the file left as it is", path));
}

std::string Study::without_paths(std::string message) const {
  for (const auto& [name, path] : paths_) message = replaced(std::move(message), path, name);
  message = replaced(std::move(message), scene_file_ + ":0: ", scene_file_ + ": ");
  return one_line(message);
}

std::vector<Json> Study::results_of(std::uint64_t index, const std::string& isa,
                                    const StepCheck& check) const {
  const RunOptions options = run_options(*this, isa);
  try {
    bristle::PatchBatch(bristle::BatchOptions{}.with_isa(isa.empty() ? nullptr : isa.c_str()));
  } catch (const bristle::Error& error) {
    throw NotHere(error.what());
  }
  const Scene scene = scene_from(row_document(index, false));
  std::optional<Forces> reference;
  const auto not_here = [&](const Scene& s) {
    try {
      check_memory(s);
    } catch (const UserError& error) {
      throw NotHere(error.what());
    }
  };
  if (!reference_.empty()) {
    const Scene truth = scene_from(row_document(index, true));
    not_here(truth);
    const auto steps = [&](const Scene& s) { return options.steps ? *options.steps : step_count(s); };
    if (truth.dt != scene.dt || steps(truth) != steps(scene) || truth.patch_count() != scene.patch_count())
      throw UserError(
          "--reference must keep dt, duration and patches, so that forces can be compared step by step");
    reference = forces_of(truth, options, check);
  }
  not_here(scene);
  Gatherer gatherer(scene, window_from_, window_until_, reference ? &*reference : nullptr);
  const double cpu = bristle::DeadlineMonitor::cpu_now();
  const RunResult result = run_scene(scene, options, [&](const SceneStepper& stepper) {
    gatherer(stepper);
    if (check) check();
  });
  nlohmann::ordered_json run = run_results(scene, result);
  run["cpu_s"] = bristle::DeadlineMonitor::cpu_now() - cpu;
  for (std::size_t p = 0; p < scene.patches.size(); ++p) gatherer.windows()[p].write(run["patches"][p]);
  check_files();
  std::vector<Json> cells;
  for (const SweepResult& r : results_) cells.push_back(r.read(run));
  return cells;
}

std::string Study::run_row(std::uint64_t index, const std::string& isa, const StepCheck& check) const {
  if (index >= rows()) throw UserError(fmt::format("row {}; the study has {}", index, rows()));
  Json row = Json::array({index});
  if (const auto seed = seed_of(index)) row.push_back(*seed);
  const std::vector<SweepValue> values = values_of(index);
  for (std::size_t v = 0; v < values.size(); ++v) row.push_back(cell_of(values[v], type_of(varied_[v])));
  std::vector<Json> results(results_.size());
  Json failure;
  try {
    results = results_of(index, isa, check);
  } catch (const NotHere&) {
    throw;
  } catch (const UserError& error) {
    check_files();
    failure = without_paths(error.what());
  } catch (const bristle::Error& error) {
    failure = without_paths(error.what());
  }
  for (Json& cell : results) row.push_back(std::move(cell));
  row.push_back(std::move(failure));
  return row.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace cli
