// Writes the setting recommended by `bristle accuracy` as TOML: a fragment, or the whole scene file.
#include <cstddef>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <toml++/toml.h>

#include "tools/libraries/accuracy/accuracy.hpp"
#include "tools/libraries/files/text_file.hpp"
#include "tools/libraries/files/toml_text.hpp"
#include "tools/libraries/platform/platform.hpp"

namespace cli {
namespace {

const char* name_of(bristle::Precision p) { return p == bristle::Precision::single ? "single" : "double"; }

// Returns the options of patch number p under the recommended setting.
bristle::PatchOptions tuned_options(const Scene& scene, const AccuracyResult& r, std::size_t p) {
  return apply(scene, r.recommendation.setting, scene.dt, 0).patches[p].options;
}

double tuned_dt(const AccuracyResult& r) { return r.reference_dt_s * r.recommendation.setting.parts; }

bool dt_changes(const AccuracyResult& r) { return r.recommendation.setting.parts != r.scene_parts; }

double tuned_deadline(const Scene& scene, const AccuracyResult& r) {
  return scene.deadline * r.recommendation.setting.parts / r.scene_parts;
}

// Edits a TOML text: replaces values in place and adds keys below a table's name, so that comments stay.
class TomlEditor {
 public:
  explicit TomlEditor(const std::string& text) {
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);) lines_.push_back({line, {}, {}});
  }

  void set(const toml::table& table, const char* key, const std::string& value) {
    if (const toml::node* old = table.get(key)) {
      replace(old->source().begin, old->source().end, value);
      return;
    }
    const toml::source_region& name = table.get("name")->source();
    if (table.is_inline()) {
      replace(name.end, name.end, fmt::format(", {} = {}", key, value));
    } else {
      lines_[name.begin.line - 1].added += fmt::format("{} = {}\n", key, value);
    }
  }

  std::string text() const {
    std::string all;
    for (const Line& line : lines_) {
      std::string changed = line.text;
      // Edits a line from right to left, so that the columns of edits further left stay valid.
      for (auto edit = line.edits.rbegin(); edit != line.edits.rend(); ++edit)
        changed.replace(edit->first, edit->second.length, edit->second.value);
      all += changed + '\n' + line.added;
    }
    return all;
  }

 private:
  struct Edit {
    std::size_t length;  // number of characters that the edit replaces
    std::string value;
  };
  struct Line {
    std::string text;
    std::multimap<std::size_t, Edit> edits;  // replacements, by their offset in the line
    std::string added;                       // text of the lines to insert below
  };

  void replace(const toml::source_position& begin, const toml::source_position& end, std::string value) {
    Line& line = lines_[begin.line - 1];
    const std::size_t at = place(line.text, begin.column);
    line.edits.insert({at, {place(line.text, end.column) - at, std::move(value)}});
  }

  // Converts a column of a line, counted in characters from 1, to a byte offset from 0.
  static std::size_t place(const std::string& line, std::size_t column) {
    std::size_t at = 0;
    for (std::size_t left = column - 1; at < line.size(); ++at) {
      const bool continues = (static_cast<unsigned char>(line[at]) & 0xC0u) == 0x80u;
      if (!continues && left-- == 0) break;
    }
    return at;
  }

  std::vector<Line> lines_;
};

std::string quoted(const std::string& text) {
  if (text.find_first_of("\"\\") == std::string::npos) return '"' + text + '"';
  std::ostringstream out;
  out << toml::value<std::string>(text);
  return out.str();
}

// Returns the path of the motion file relative to the folder of the tuned scene.
std::string moved_file(const std::string& file, const std::string& scene, const std::string& to) {
  namespace fs = std::filesystem;
  const fs::path here = fs::absolute(platform::path_of(scene)).parent_path() / platform::path_of(file);
  if (platform::path_of(file).is_absolute() || to == "-") return file;
  return here.lexically_normal()
      .lexically_relative(fs::absolute(platform::path_of(to)).parent_path().lexically_normal())
      .string();
}

// Writes the keys for a patch's kind of population: all of them for an infinite brush, and for
// representatives only keys that the file has. The value 0 of a key means automatic.
void set_population(TomlEditor& editor, const toml::table& patch, const bristle::PatchOptions& o) {
  const bool infinite = o.population == bristle::Population::infinite;
  if (infinite || patch.contains("population"))
    editor.set(patch, "population", infinite ? "\"infinite\"" : "\"representatives\"");
  if (infinite || patch.contains("resolution"))
    editor.set(patch, "resolution", fmt::format("{}", o.resolution));
  if (patch.contains("cohorts")) editor.set(patch, "cohorts", fmt::format("{}", o.cohorts));
}

}  // namespace

std::string scene_fragment(const Scene& scene, const AccuracyResult& r) {
  std::string text;
  if (dt_changes(r))
    text +=
        fmt::format("[scene]\ndt = {:.12g}\ndeadline = {:.12g}\n\n", tuned_dt(r), tuned_deadline(scene, r));
  for (std::size_t p = 0; p < scene.patches.size(); ++p) {
    const bristle::PatchOptions o = tuned_options(scene, r, p);
    if (o.population == bristle::Population::infinite) {
      text += fmt::format("[[patch]]\nname = \"{}\"\npopulation = \"infinite\"\nresolution = {}\n",
                          scene.patches[p].name, o.resolution);
    } else {
      text += fmt::format(
          "[[patch]]\nname = \"{}\"\nbristles = {}\nprecision = \"{}\"\nstep_rule = \"{}\"\nsampling = "
          "\"{}\"\n",
          scene.patches[p].name, o.bristles, name_of(o.precision), rule_name(o.compared),
          sampling_name(o.compared));
    }
    if (p + 1 < scene.patches.size()) text += '\n';
  }
  return text;
}

std::string tuned_scene(const Scene& scene, const AccuracyResult& r, const std::string& to) {
  const std::string text = read_text_file(scene.file);
  const toml::table root = parse_toml(text, scene.file);
  TomlEditor editor(text);
  if (dt_changes(r)) {
    const toml::table& head = *root["scene"].as_table();
    editor.set(head, "dt", fmt::format("{:.12g}", tuned_dt(r)));
    editor.set(head, "deadline", fmt::format("{:.12g}", tuned_deadline(scene, r)));
  }
  for (std::size_t p = 0; p < scene.patches.size(); ++p) {
    const bristle::PatchOptions o = tuned_options(scene, r, p);
    const toml::table& patch = *root["patch"][p].as_table();
    set_population(editor, patch, o);
    if (o.population == bristle::Population::infinite) {
      if (patch.contains("step_rule")) editor.set(patch, "step_rule", quoted(rule_name(o.compared)));
      continue;
    }
    editor.set(patch, "bristles", fmt::format("{}", o.bristles));
    editor.set(patch, "precision", quoted(name_of(o.precision)));
    editor.set(patch, "step_rule", quoted(rule_name(o.compared)));
    editor.set(patch, "sampling", quoted(sampling_name(o.compared)));
  }
  if (const toml::array* motions = root["motion"].as_array()) {
    for (const toml::node& node : *motions) {
      const toml::table& motion = *node.as_table();
      const auto file = motion["file"].value<std::string>();
      if (file) editor.set(motion, "file", quoted(moved_file(*file, scene.file, to)));
    }
  }
  const Recommendation& best = r.recommendation;
  return fmt::format("# Tuned by bristle accuracy: error {:.3g} % rms at {:.3g} us of CPU time a step.\n",
                     100.0 * best.confirmed.rms, 1e6 * best.confirmed_step_s) +
         editor.text();
}

}  // namespace cli
