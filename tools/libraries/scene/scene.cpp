#include "tools/libraries/scene/scene.hpp"

#include <algorithm>
#include <filesystem>
#include <map>
#include <utility>

#include <fmt/format.h>

#include <bristle/error.hpp>
#include <bristle/fields.hpp>
#include <bristle/patch_batch.hpp>
#include <bristle/typical_materials.hpp>

#include "tools/libraries/files/motion_file.hpp"
#include "tools/libraries/files/nearest_name.hpp"
#include "tools/libraries/files/text_file.hpp"
#include "tools/libraries/files/toml_table.hpp"
#include "tools/libraries/files/toml_text.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/platform/platform.hpp"
#include "tools/libraries/scene/scene_table.hpp"
#include "tools/libraries/scene/snap_law.hpp"
#include "tools/libraries/scene/waveform.hpp"

namespace cli {
namespace {

constexpr Range seconds{0.0, 1e6, false, "s"};
constexpr Range position{-1e6, 1e6, false, "m"};
constexpr Range load_range{0.0, 1e9, false, "N"};
constexpr Range force_range{-1e9, 1e9, false, "N"};
constexpr Range frequency_range{0.0, 1e6, true, "Hz"};
constexpr Range turns{-1e6, 1e6, false, "turns"};
constexpr Range any_not_negative{0.0, 1e300, false, ""};

// -------------------------------------------------------------------- readers of [[material]] tables

bristle::SnapLength read_snap_length(const TomlTable& table) {
  const Range length{0.0, 1.0, false, "m"};
  switch (table.choice("law", {"single", "uniform", "normal", "lognormal", "exponential", "table"}, 6)) {
    case 0:
      table.allow({"law", "length"});
      return bristle::SnapLength::single(table.number("length", length));
    case 1:
      table.allow({"law", "min", "max"});
      return bristle::SnapLength::uniform(table.number("min", length), table.number("max", length));
    case 2:
      table.allow({"law", "mean", "deviation"});
      return bristle::SnapLength::normal(table.number("mean", length), table.number("deviation", length));
    case 3:
      table.allow({"law", "mean", "cv"});
      return bristle::SnapLength::lognormal(table.number("mean", length),
                                            table.number("cv", {0.0, widest_cv}));
    case 4:
      table.allow({"law", "mean"});
      return bristle::SnapLength::exponential(table.number("mean", length));
    case 5: {
      table.allow({"law", "quantiles"});
      const std::vector<double> quantiles = table.numbers("quantiles", length);
      return bristle::SnapLength::table({quantiles.data(), quantiles.size()});
    }
    default:
      table.fail("key 'law' is missing");
  }
}

/// Returns the key of a field in a [[material]] table. The snap rule is called `rule`, as in Coefficients.
std::string_view key_of(const char* field) {
  return std::string_view(field) == "snap_rule" ? std::string_view("rule") : field;
}
/// Returns the range of a key, which is that of the field. Presliding lengths above 1 m are refused besides:
/// they were probably given in another unit.
template <class Field>
Range range_of(const Field& field) {
  const double most = std::string_view(field.name) == "presliding_length" ? 1.0 : field.about.most;
  return {field.about.least, most, false, field.about.unit};
}

/// Reads those fields of `to` that are among `keys`, if the table has a key for them.
template <class Parameters>
void read_keys(const TomlTable& table, const std::vector<std::string_view>& keys, Parameters& to) {
  bristle::for_each_field<Parameters>([&](const auto& field) {
    auto& value = to.*field.member;
    using Value = std::decay_t<decltype(value)>;
    const std::string_view key = key_of(field.name);
    if (std::find(keys.begin(), keys.end(), key) == keys.end() || !table.has(key)) return;
    if constexpr (std::is_enum_v<Value>)
      value = static_cast<Value>(
          table.choice(key, {field.about.names, field.about.names + field.about.name_count}, 0));
    else if constexpr (std::is_same_v<Value, bristle::SnapLength>)
      value = read_snap_length(table.table(key));
    else if constexpr (std::is_integral_v<Value>)
      value = static_cast<Value>(table.integer(key, static_cast<std::int64_t>(field.about.least),
                                               static_cast<std::int64_t>(field.about.most), 0));
    else if constexpr (std::is_same_v<Value, double>)
      value = table.number(key, range_of(field));
  });
}

/// Reads all fields of `to` for which the table has a key. Refuses keys of the table that are neither fields
/// nor in `keys`.
template <class Parameters>
void read_fields(const TomlTable& table, std::vector<std::string_view> keys, Parameters& to) {
  bristle::for_each_field<Parameters>([&](const auto& field) { keys.push_back(key_of(field.name)); });
  table.allow(keys);
  read_keys(table, keys, to);
}

bristle::Material read_bristle_parameters(const TomlTable& table) {
  bristle::Material m;
  read_fields(table, {"name"}, m);
  if (table.has("residual_length"))
    (void)table.number("residual_length", {0.0, bristle::largest_residual * m.snap_length.mean()});
  return m;
}

/// Reads the key `typical`, which names a common pair of materials; other keys may change its coefficients.
bristle::Coefficients read_typical(const TomlTable& table) {
  if (!table.has("typical")) return {};
  const std::string name = table.text("typical");
  NameList names;
  for (const bristle::TypicalMaterial& typical : bristle::typical_materials()) {
    if (name == typical.name) return typical.coefficients;
    names.push_back(typical.name);
  }
  table.fail("typical", fmt::format("'{}' is no typical material{}", name, allowed_text(name, names)));
}

bristle::Coefficients read_coefficients(const TomlTable& table) {
  bristle::Coefficients c = read_typical(table);
  c.drop = 0.0;
  read_fields(table, {"name", "typical", "peak_over_kinetic"}, c);
  // Requires the key `peak`, unless another key is given from which the peak follows: `drop` (slide rule) or
  // `spread` (other rules).
  const bool follows = c.rule == bristle::SnapRule::slide || c.spread != 0.0;
  if (follows && !table.has("peak")) c.peak = 0.0;
  if (table.has("peak_over_kinetic")) {
    if (table.has("peak")) table.fail("peak_over_kinetic", "is given beside peak; give one of them");
    c.peak = c.kinetic * table.number("peak_over_kinetic", {1.0, 1e3});
  }
  return c;
}

/// Returns the keys of those fields that the struct A has and the struct B lacks.
template <class A, class B>
std::vector<std::string_view> keys_of_one() {
  std::vector<std::string_view> keys;
  bristle::for_each_field<A>([&](const auto& field) {
    bool shared = false;
    bristle::for_each_field<B>(
        [&](const auto& other) { shared = shared || key_of(field.name) == key_of(other.name); });
    if (!shared) keys.push_back(key_of(field.name));
  });
  return keys;
}

SceneMaterial read_material(TomlTable table) {
  SceneMaterial result;
  result.name = table.name();
  result.where = table.where();
  try {
    if (table.has_any(keys_of_one<bristle::Material, bristle::Coefficients>())) {
      std::vector<std::string_view> keys = keys_of_one<bristle::Coefficients, bristle::Material>();
      keys.insert(keys.begin(), {"typical", "peak_over_kinetic"});
      if (table.has_any(keys))
        table.fail(fmt::format("mixes coefficients ({}) with bristle parameters; give one kind",
                               fmt::join(keys, ", ")));
      result.material = read_bristle_parameters(table);
    } else {
      result.coefficients = read_coefficients(table);
      result.material = bristle::Material::from_coefficients(*result.coefficients);
    }
    result.material.validate();
  } catch (const bristle::Error& error) {
    table.fail(error.what());
  }
  return result;
}

// ----------------------------------------------------------------------- readers of [[patch]] tables

/// Index by name of all tables of one kind. A scene may have hundreds of thousands of tables, too many to
/// search one by one.
class Names {
 public:
  /// Adds a table's name. Its index is the number of names added before.
  void add(const std::string& name, const TomlTable& table) {
    if (!index_.emplace(name, index_.size()).second)
      table.fail("name", fmt::format("'{}' appears twice", name));
  }
  std::size_t find(const std::string& name, const TomlTable& table, std::string_view key) const {
    const auto found = index_.find(name);
    if (found != index_.end()) return found->second;
    NameList known;
    for (auto other = index_.begin(); other != index_.end() && known.size() < 100; ++other)
      known.push_back(other->first);
    table.fail(key, fmt::format("names '{}', which does not exist{}", name, allowed_text(name, known)));
  }

 private:
  std::map<std::string, std::size_t> index_;
};

/// Reads the keys population and resolution of a patch. Refuses a resolution that the chosen population would
/// not use.
void read_population(const TomlTable& table, const bristle::Material& material, bristle::PatchOptions& o) {
  read_keys(table, {"population"}, o);
  o.population = bristle::choose_population(material, o);
  if (o.population != bristle::Population::infinite) {
    if (table.number("resolution", any_not_negative, 0.0) > 0.0)
      table.fail("resolution", "is for population = \"infinite\"; this patch has representatives");
    return;
  }
  if (material.snap_rule != bristle::SnapRule::redraw)
    table.fail(
        "population",
        "is 'infinite', but the material has rule = \"keep\" or \"slide\", whose bristles are what they "
        "are for ever; give the material rule = \"redraw\" or the patch population = \"representatives\"");
  // Takes a resolution of 0 as automatic, like a missing key.
  o.resolution = table.number("resolution", {0.0, 128.0, false, "pieces per mean snap length"}, 0.0);
  if (o.resolution > 0.0 && o.resolution < 1.0)
    table.fail(
        "resolution",
        fmt::format("is {}; allowed: 0 (automatic), or 1 to 128 pieces per mean snap length", o.resolution));
}

/// Reads the key `lay` of a patch (the direction of grooves in its surface). Refuses options that cannot be
/// combined with it.
void read_lay(const TomlTable& patch, const bristle::Material& material, bristle::PatchOptions& o) {
  if (!patch.has("lay")) return;
  bristle::Lay& lay = o.lay;
  const TomlTable table = patch.table("lay");
  read_fields(table, {}, lay);
  bristle::PatchOptions small = o;
  if (o.population == bristle::Population::representatives) small.bristles = 1;
  try {
    bristle::PatchBatch().add(material, small);
  } catch (const bristle::Error& error) {
    patch.fail("lay", fmt::format("is refused: {}", error.what()));
  }
}

/// Checks that a patch has enough bristles for its material. The error message names both tables, because the
/// user may change either.
void check_material(const ScenePatch& patch, const SceneMaterial& material) {
  if (patch.options.population == bristle::Population::infinite) return;
  try {
    material.material.validate_for_representatives();
  } catch (const bristle::Error& error) {
    throw UserError(
        fmt::format("{}: {}; so does population = \"infinite\" in the [[patch]]; patch '{}' uses this "
                    "material with representatives",
                    material.where, error.what(), patch.name));
  }
}

ScenePatch read_patch(TomlTable table, const Names& names, const std::vector<SceneMaterial>& materials) {
  ScenePatch patch;
  patch.name = table.name();
  patch.where = table.where();
  table.allow({"name", "material", "max_normal_load", "bristles", "axes", "outputs", "precision", "seed",
               "count", "population", "resolution", "lay"});
  patch.material = names.find(table.text("material"), table, "material");
  bristle::PatchOptions& o = patch.options;
  o.max_normal_load = table.number("max_normal_load", {0.0, 1e9, true, "N"});
  read_keys(table, {"bristles", "axes", "precision", "seed"}, o);
  for (const std::string& output : table.texts("outputs")) {
    if (output == "mean") {
      o.outputs = o.outputs | bristle::Outputs::mean;
    } else if (output == "energy") {
      o.outputs = o.outputs | bristle::Outputs::energy;
    } else if (output != "end") {
      table.fail("outputs", fmt::format("holds '{}'; allowed: end, mean, energy", output));
    }
  }
  read_population(table, materials[patch.material].material, o);
  check_material(patch, materials[patch.material]);
  read_lay(table, materials[patch.material].material, o);
  patch.count = static_cast<std::uint32_t>(table.integer("count", 1, 100'000'000, 1));
  return patch;
}

// ---------------------------------------------------------------------- readers of [[motion]] tables

std::vector<LoadStep> read_load_steps(const TomlTable& parent, std::string_view key, const Range& range) {
  std::vector<LoadStep> steps;
  for (const TomlTable& table : parent.tables(key)) {
    table.allow({"t", "load"});
    const LoadStep step{table.number("t", seconds), table.number("load", range)};
    if (!steps.empty() && !(step.t > steps.back().t)) table.fail("t", "does not come after the row before");
    if (steps.empty() && step.t != 0.0) table.fail("t", "of the first row must be 0");
    steps.push_back(step);
  }
  if (parent.has(key) && steps.empty()) parent.fail(key, "holds no rows");
  return steps;
}

std::vector<MotionRow> read_keyframes(const TomlTable& parent, bool with_load) {
  std::vector<MotionRow> rows;
  if (!parent.has("keyframes")) parent.fail("key 'keyframes' is missing");
  for (const TomlTable& table : parent.tables("keyframes")) {
    table.allow({"t", "x", "y", "load"});
    // Starts a row with the values of the last one, which stay for keys that the row does not have.
    MotionRow row = rows.empty() ? MotionRow{} : rows.back();
    row.t = table.number("t", seconds);
    if (!rows.empty() && row.t < rows.back().t) table.fail("t", "comes before the row above");
    row.x = table.number("x", position, row.x);
    row.y = table.number("y", position, row.y);
    if (!with_load && table.has("load"))
      table.fail("load", "is given twice: in a row and beside the keyframes");
    if (with_load && rows.empty() && !table.has("load")) table.fail("key 'load' is missing in the first row");
    row.load = table.number("load", load_range, row.load);
    rows.push_back(row);
  }
  if (rows.empty()) parent.fail("keyframes", "holds no rows");
  return rows;
}

using Trace = std::shared_ptr<const MotionFile>;

Trace read_trace(const std::string& path, double clip_load_n) {
  auto file = std::make_shared<MotionFile>(read_motion_file(path, clip_load_n));
  const double start = file->rows.front().t;
  for (MotionRow& row : file->rows) row.t -= start;
  return file;
}

/// Motion files read so far, by path and clip_load, so that each is read only once.
using Traces = std::map<std::pair<std::string, double>, Trace>;

void take_trace(PrescribedMotion& motion, const Trace& trace, const std::string& where) {
  if (!trace->has_load && motion.load_steps.empty())
    throw UserError(
        fmt::format("{}: {} has no column load; add one, or give load in the scene", where, trace->name));
  motion.type = MotionType::trace;
  for (const int axis : {0, 1})
    motion.velocity[axis] = motion.amplitude[axis] = 0.0;  // clears the motion that the file replaces
  motion.keyframes.clear();
  if (trace->has_load) motion.load_steps.clear();
  motion.trace = trace;
}

/// Reads the keys of a motion of this type from its table, after it has added them to the allowed `keys`. The
/// keys of a trace are read elsewhere.
void read_path(const TomlTable& table, std::vector<std::string_view> keys, PrescribedMotion& motion) {
  const auto allow = [&](std::initializer_list<std::string_view> own) {
    keys.insert(keys.end(), own);
    table.allow(keys);
  };
  switch (motion.type) {
    case MotionType::hold:
      allow({});
      break;
    case MotionType::ramp:
      allow({"velocity", "from", "until"});
      table.pair("velocity", {-1e6, 1e6, false, "m/s"}, motion.velocity);
      motion.from = table.number("from", seconds, 0.0);
      motion.until = table.number("until", seconds, motion.until);
      if (!(motion.until > motion.from)) table.fail("until", "must come after from");
      break;
    case MotionType::sine:
      allow({"amplitude", "frequency", "phase"});
      table.pair("amplitude", position, motion.amplitude);
      motion.frequency = table.number("frequency", frequency_range);
      motion.phase = table.number("phase", turns, 0.0);
      break;
    case MotionType::keyframes:
      allow({"keyframes"});
      motion.keyframes = read_keyframes(table, motion.load_steps.empty());
      break;
    case MotionType::trace:
      break;
  }
}

/// Reads a [[motion]] table. `traces` remembers motion files, so that each is read only once.
PrescribedMotion read_motion(const TomlTable& table, const std::string& scene_path, Traces& traces) {
  PrescribedMotion motion;
  if (!table.has("type")) table.fail("key 'type' is missing");
  motion.type =
      static_cast<MotionType>(table.choice("type", {"hold", "ramp", "sine", "keyframes", "trace"}, 0));

  if (table.has("load") && table.has("load_steps")) table.fail("load", "is given twice: load and load_steps");
  if (table.has("load")) motion.load_steps = {{0.0, table.number("load", load_range)}};
  if (table.has("load_steps")) motion.load_steps = read_load_steps(table, "load_steps", load_range);
  motion.turn_per_copy = table.number("turn_per_copy", turns, 0.0);
  motion.delay_per_copy = table.number("delay_per_copy", seconds, 0.0);

  std::vector<std::string_view> keys = {"patch",      "type",          "load",
                                        "load_steps", "turn_per_copy", "delay_per_copy"};
  if (motion.type == MotionType::trace) {
    keys.insert(keys.end(), {"file", "clip_load"});
    table.allow(keys);
    const std::filesystem::path path =
        std::filesystem::path(scene_path).parent_path() / std::filesystem::path(table.file("file"));
    const double clip_load = table.number("clip_load", load_range, 0.0);
    Trace& trace = traces[{path.string(), clip_load}];
    if (!trace) trace = read_trace(path.string(), clip_load);
    take_trace(motion, trace, table.where("file"));
  }
  read_path(table, keys, motion);
  if (motion.load_steps.empty() && motion.rows().empty())
    table.fail("key 'load' (or 'load_steps') is missing");
  return motion;
}

void check_axes(const ScenePatch& patch, const std::string& where) {
  if (patch.options.axes == 1 && patch.motion->moves_along_y())
    throw UserError(
        fmt::format("{}: moves along y (or turns), but patch '{}' has axes = 1", where, patch.name));
}

// ------------------------------------------------------------------------ readers of [[body]] tables

std::vector<ForceRow> read_force(const TomlTable& parent) {
  std::vector<ForceRow> rows;
  for (const TomlTable& table : parent.tables("force")) {
    table.allow({"t", "x", "y"});
    ForceRow row = rows.empty() ? ForceRow{} : rows.back();
    row.t = table.number("t", seconds);
    if (!rows.empty() && row.t < rows.back().t) table.fail("t", "comes before the row above");
    row.force[0] = table.number("x", force_range, row.force[0]);
    row.force[1] = table.number("y", force_range, row.force[1]);
    rows.push_back(row);
  }
  return rows;
}

std::vector<ForceSine> read_force_sines(const TomlTable& parent) {
  std::vector<ForceSine> sines;
  for (const TomlTable& table : parent.tables("force_sine")) {
    table.allow({"amplitude", "frequency", "phase", "from", "until"});
    ForceSine sine;
    table.pair("amplitude", force_range, sine.amplitude);
    sine.frequency = table.number("frequency", frequency_range);
    sine.phase = table.number("phase", turns, 0.0);
    sine.from = table.number("from", seconds, 0.0);
    sine.until = table.number("until", seconds, 1e6);
    if (!(sine.until > sine.from)) table.fail("until", "must come after from");
    sines.push_back(sine);
  }
  return sines;
}

SceneSpring read_spring(const TomlTable& table) {
  SceneSpring spring;
  if (!table.has("type")) table.fail("key 'type' is missing");
  spring.hand.type = static_cast<MotionType>(table.choice("type", {"hold", "ramp", "sine", "keyframes"}, 0));
  spring.hand.load_steps = {{0.0, 0.0}};                            // keyframes of a hand have no load
  read_path(table, {"stiffness", "damping", "type"}, spring.hand);  // refuses other keys
  spring.stiffness = table.number("stiffness", {0.0, 1e9, true, "N/m"});
  spring.damping = table.number("damping", {0.0, 1e9, false, "N s/m"}, 0.0);
  return spring;
}

/// Reads a [[body]] table. `body_on` maps the index of a patch to the name of the body on it.
SceneBody read_body(TomlTable table, Scene& scene, const Names& patches,
                    std::map<std::size_t, std::string>& body_on) {
  SceneBody body;
  body.name = table.name();
  table.allow({"name", "mass", "gravity", "extra_load", "extra_load_steps", "velocity", "patches", "force",
               "force_sine", "spring"});
  body.mass = table.number("mass", {0.0, 1e9, true, "kg"});
  body.gravity = table.number("gravity", {0.0, 1e6, false, "m/s^2"}, body.gravity);
  if (table.has("velocity")) table.pair("velocity", {-1e6, 1e6, false, "m/s"}, body.velocity);
  if (table.has("extra_load") && table.has("extra_load_steps"))
    table.fail("extra_load", "is given twice: extra_load and extra_load_steps");
  const Range extra{-body.mass * body.gravity, 1e9, false, "N (the weight can be lifted, no more)"};
  if (table.has("extra_load")) body.extra_load = {{0.0, table.number("extra_load", extra)}};
  if (table.has("extra_load_steps")) body.extra_load = read_load_steps(table, "extra_load_steps", extra);
  body.force = read_force(table);
  body.force_sines = read_force_sines(table);
  if (table.has("spring")) body.spring = read_spring(table.table("spring"));

  for (const std::string& name : table.texts("patches")) {
    const std::size_t index = patches.find(name, table, "patches");
    ScenePatch& patch = scene.patches[index];
    const auto [on, is_first] = body_on.emplace(index, body.name);
    if (!is_first)
      table.fail("patches", fmt::format("names '{}', which body '{}' rests on already", name, on->second));
    if (patch.motion)
      table.fail("patches", fmt::format("names '{}', which a [[motion]] moves already", name));
    if (!body.patches.empty() && patch.options.axes != body.axes)
      table.fail("patches", "have different axes; those under one body must have the same");
    body.axes = patch.options.axes;
    // Adds the mean force to the outputs of a patch under a body, because the body's motion is solved from
    // it.
    patch.options.outputs = patch.options.outputs | bristle::Outputs::mean;
    body.patches.push_back(index);
  }
  if (body.patches.empty()) table.fail("key 'patches' is missing or empty");
  const bool along_y = body.velocity[1] != 0.0 || (body.spring && body.spring->hand.moves_along_y()) ||
                       std::any_of(body.force.begin(), body.force.end(),
                                   [](const ForceRow& r) { return r.force[1] != 0.0; }) ||
                       std::any_of(body.force_sines.begin(), body.force_sines.end(),
                                   [](const ForceSine& s) { return s.amplitude[1] != 0.0; });
  if (body.axes == 1 && along_y) table.fail("is pushed or moves along y, but its patches have axes = 1");
  return body;
}

// ------------------------------------------------------------------------ readers of the whole scene

void check_all_moved(const Scene& scene) {
  std::vector<bool> moved(scene.patches.size(), false);
  for (const SceneBody& body : scene.bodies) {
    for (const std::size_t p : body.patches) moved[p] = true;
  }
  for (std::size_t p = 0; p < scene.patches.size(); ++p) {
    if (moved[p] || scene.patches[p].motion) continue;
    throw UserError(fmt::format("{}: nothing moves it: no [[motion]] names it and no [[body]] rests on it",
                                scene.patches[p].where));
  }
}

/// Returns the largest number of bristles that a patch may simulate; 0 for an infinite brush, whose memory
/// check_memory() counts.
std::uint64_t most_bristles_of(const bristle::PatchOptions& options) {
  if (options.population == bristle::Population::infinite) return 0;
  return options.bristles ? options.bristles : 4096;
}

void check_size(const Scene& scene) {
  if (scene.limits.bytes) return;  // with a limit in bytes, check_memory() counts bytes instead
  std::uint64_t bristles = 0, patches = 0;
  for (const ScenePatch& patch : scene.patches) {
    bristles += most_bristles_of(patch.options) * patch.count;
    patches += patch.count;
  }
  constexpr std::uint64_t most = 1ull << 28;
  if (bristles > most || patches > 1'000'000)
    throw UserError(
        fmt::format("{}: {} bristles in {} patches; allowed: at most {} in at most 1000000, or what --memory "
                    "gives room to",
                    scene.file, bristles, patches, most));
}

}  // namespace

void read_scene_table(TomlTable table, Scene& scene) {
  scene.name = table.name();
  table.allow({"name", "description", "dt", "duration", "deadline", "threads", "out_patches"});
  scene.description = table.text("description", "");
  scene.dt = table.number("dt", {0.0, 1.0, true, "s"});
  if (table.has("duration")) scene.duration = table.number("duration", {0.0, 1e6, true, "s"});
  scene.deadline = table.number("deadline", {0.0, 1e3, true, "s"}, scene.dt);
  scene.threads = static_cast<int>(table.integer("threads", 0, 1024, 1));
  scene.out_patches = static_cast<std::uint32_t>(table.integer("out_patches", 0, 1'000'000, 8));
}

void SceneBody::applied_force(double t, double (&force_n)[2]) const noexcept {
  force_n[0] = force_n[1] = 0.0;
  const auto after = std::upper_bound(force.begin(), force.end(), t,
                                      [](double time, const ForceRow& row) { return time < row.t; });
  for (std::size_t axis = 0; axis < 2 && !force.empty(); ++axis) {
    if (after == force.begin()) {
      force_n[axis] = force.front().force[axis];
    } else if (after == force.end()) {
      force_n[axis] = force.back().force[axis];
    } else {
      const ForceRow& a = *(after - 1);
      const double share = (t - a.t) / (after->t - a.t);
      force_n[axis] = a.force[axis] + share * (after->force[axis] - a.force[axis]);
    }
  }
  for (const ForceSine& sine : force_sines) {
    if (t < sine.from || t >= sine.until) continue;
    const double wave = sine_of_turns(sine.frequency * (t - sine.from) + sine.phase);
    force_n[0] += sine.amplitude[0] * wave;
    force_n[1] += sine.amplitude[1] * wave;
  }
}

std::size_t Scene::patch_count() const noexcept {
  std::size_t count = 0;
  for (const ScenePatch& patch : patches) count += patch.count;
  return count;
}

double Scene::trace_length() const noexcept {
  double longest = 0.0;
  for (const ScenePatch& patch : patches) {
    if (patch.motion && patch.motion->type == MotionType::trace)
      longest = std::max(longest, patch.motion->rows().back().t);
  }
  return longest;
}

Scene parse_scene(const std::string& text, const std::string& path, const SceneLimits& limits,
                  const ShareDone& progress) {
  return scene_of(parse_toml(text, path), path, limits, progress);
}

Scene scene_of(const toml::table& root, const std::string& path, const SceneLimits& limits,
               const ShareDone& progress) {
  const TomlTable table(path, root, "");
  for (const auto& [key, node] : root) {
    const std::string_view name = key.str();
    if (name == "scene" || name == "material" || name == "patch" || name == "motion" || name == "body")
      continue;
    if (name == "bed" || name == "joint")
      throw UserError(
          fmt::format("{}:{}: only `bristle run` steps a [[{}]]", path, key.source().begin.line, name));
    throw UserError(fmt::format(
        "{}:{}: unknown key '{}'; allowed: [scene], [[material]], [[patch]], [[motion]], [[body]]", path,
        key.source().begin.line, name));
  }
  Scene scene;
  scene.file = path;
  scene.limits = limits;
  if (!table.has("scene")) throw UserError(fmt::format("{}: table [scene] is missing", path));
  read_scene_table(table.table("scene"), scene);
  // Largest number of materials in a scene without a memory limit. Preparing a material takes milliseconds.
  constexpr std::size_t most_materials = 1000;
  Names materials, patches, bodies;
  std::vector<TomlTable> material_tables = table.tables("material");
  if (material_tables.size() > most_materials && !limits.bytes)
    material_tables[most_materials].fail(
        fmt::format("is material {}; allowed: at most {} in a scene, or any number with --memory",
                    most_materials + 1, most_materials));
  for (TomlTable& t : material_tables) {
    if (progress)
      progress(static_cast<double>(scene.materials.size()) / static_cast<double>(material_tables.size()));
    SceneMaterial material = read_material(t);
    materials.add(material.name, t);
    scene.materials.push_back(std::move(material));
  }
  for (TomlTable& t : table.tables("patch")) {
    ScenePatch patch = read_patch(t, materials, scene.materials);
    patches.add(patch.name, t);
    scene.patches.push_back(std::move(patch));
  }
  if (scene.patches.empty()) throw UserError(fmt::format("{}: no [[patch]]", path));
  Traces traces;
  for (TomlTable& t : table.tables("motion")) {
    ScenePatch& patch = scene.patches[patches.find(t.text("patch"), t, "patch")];
    if (patch.motion)
      t.fail("patch", fmt::format("names '{}', which another [[motion]] moves already", patch.name));
    patch.motion = read_motion(t, path, traces);
    check_axes(patch, t.where());
  }
  for (const auto& [trace, file] : traces) scene.traces.push_back(trace.first);
  std::map<std::size_t, std::string> body_on;
  for (TomlTable& t : table.tables("body")) {
    SceneBody body = read_body(t, scene, patches, body_on);
    bodies.add(body.name, t);
    scene.bodies.push_back(std::move(body));
  }
  check_all_moved(scene);
  check_size(scene);
  if (!scene.duration && scene.trace_length() == 0.0)
    table.table("scene").fail("key 'duration' is missing (only a scene with a trace may leave it out)");
  return scene;
}

Scene read_scene(const std::string& path, const SceneLimits& limits, const ShareDone& progress) {
  return parse_scene(read_text_file(path, most_scene_bytes), path, limits, progress);
}

void replace_motion(Scene& scene, const std::string& motion_path, double clip_load_n) {
  const Trace trace = read_trace(motion_path, clip_load_n);
  const bool has_trace = scene.trace_length() > 0.0;
  bool replaced = false;
  for (ScenePatch& patch : scene.patches) {
    if (!patch.motion || (has_trace && patch.motion->type != MotionType::trace)) continue;
    take_trace(*patch.motion, trace, patch.where);
    check_axes(patch, motion_path);
    replaced = true;
  }
  if (!replaced) throw UserError(fmt::format("{}: has no [[motion]] that a trace could replace", scene.file));
  scene.duration.reset();
  scene.traces.push_back(motion_path);
}

std::vector<FileOption> inputs_of(const Scene& scene) {
  std::vector<FileOption> inputs = {{"SCENE", scene.file}};
  for (const std::string& trace : scene.traces) inputs.push_back({"its motion", trace});
  return inputs;
}

void set_bristles(Scene& scene, std::uint32_t bristles) {
  for (ScenePatch& patch : scene.patches) patch.options.bristles = bristles;
  check_size(scene);
}

}  // namespace cli
