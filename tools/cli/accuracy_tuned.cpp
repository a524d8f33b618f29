// The recommended setting as TOML: a fragment to paste, or the whole scene file.
#include <cstddef>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <toml++/toml.h>

#include "tools/cli/accuracy.hpp"
#include "tools/cli/text_file.hpp"

namespace cli {
namespace {

const char* name_of(bristle::Precision p) { return p == bristle::Precision::single ? "single" : "double"; }
const char* name_of(bristle::StepRule r) { return r == bristle::StepRule::exact ? "exact" : "literal"; }
const char* name_of(bristle::Sampling s) {
  return s == bristle::Sampling::stratified ? "stratified" : "random";
}

// Everything of a patch that a setting touches, as it is in the tuned scene.
bristle::PatchOptions tuned_options(const Scene& scene, const AccuracyResult& r, std::size_t p) {
  return apply(scene, r.recommendation.setting, scene.dt, 0).patches[p].options;
}

double tuned_dt(const AccuracyResult& r) { return r.reference_dt_s * r.recommendation.setting.parts; }

bool dt_changes(const AccuracyResult& r) { return r.recommendation.setting.parts != r.scene_parts; }

double tuned_deadline(const Scene& scene, const AccuracyResult& r) {
  return scene.deadline * r.recommendation.setting.parts / r.scene_parts;
}

// Replaces values of a TOML text where they stand and adds keys after a table's name, so that its comments
// stay.
class TomlEditor {
 public:
  explicit TomlEditor(const std::string& text) {
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);) lines_.push_back(line);
    added_.resize(lines_.size());
  }

  void set(const toml::table& table, const char* key, const std::string& value) {
    const toml::node* old = table.get(key);
    if (old == nullptr) {
      const std::size_t line = table.get("name")->source().begin.line - 1;
      added_[line] += fmt::format("{} = {}\n", key, value);
      return;
    }
    const toml::source_region& at = old->source();
    std::string& line = lines_[at.begin.line - 1];
    // A key has one value on its line here: its place counts from the left, whatever was replaced before.
    line.replace(at.begin.column - 1, at.end.column - at.begin.column, value);
  }

  std::string text() const {
    std::string all;
    for (std::size_t i = 0; i < lines_.size(); ++i) all += lines_[i] + '\n' + added_[i];
    return all;
  }

 private:
  std::vector<std::string> lines_, added_;
};

std::string quoted(const std::string& text) {
  if (text.find_first_of("\"\\") == std::string::npos) return '"' + text + '"';
  std::ostringstream out;
  out << toml::value<std::string>(text);
  return out.str();
}

// The same motion file, named from the folder of the tuned scene.
std::string moved_file(const std::string& file, const std::string& scene, const std::string& to) {
  namespace fs = std::filesystem;
  const fs::path here = fs::absolute(scene).parent_path() / file;
  if (fs::path(file).is_absolute() || to == "-") return file;
  return here.lexically_normal()
      .lexically_relative(fs::absolute(to).parent_path().lexically_normal())
      .string();
}

}  // namespace

std::string scene_fragment(const Scene& scene, const AccuracyResult& r) {
  std::string text;
  if (dt_changes(r)) {
    text += fmt::format("[scene]\ndt = {:g}\ndeadline = {:g}\n\n", tuned_dt(r), tuned_deadline(scene, r));
  }
  for (std::size_t p = 0; p < scene.patches.size(); ++p) {
    const bristle::PatchOptions o = tuned_options(scene, r, p);
    text += fmt::format(
        "[[patch]]\nname = \"{}\"\nbristles = {}\nprecision = \"{}\"\nstep_rule = \"{}\"\nsampling = "
        "\"{}\"\n",
        scene.patches[p].name, o.bristles, name_of(o.precision), name_of(o.step_rule), name_of(o.sampling));
    if (p + 1 < scene.patches.size()) text += '\n';
  }
  return text;
}

std::string tuned_scene(const Scene& scene, const AccuracyResult& r, const std::string& to) {
  const std::string text = read_text_file(scene.file);
  const toml::table root = toml::parse(text, scene.file);
  TomlEditor editor(text);
  if (dt_changes(r)) {
    const toml::table& head = *root["scene"].as_table();
    editor.set(head, "dt", fmt::format("{:g}", tuned_dt(r)));
    editor.set(head, "deadline", fmt::format("{:g}", tuned_deadline(scene, r)));
  }
  for (std::size_t p = 0; p < scene.patches.size(); ++p) {
    const bristle::PatchOptions o = tuned_options(scene, r, p);
    const toml::table& patch = *root["patch"][p].as_table();
    editor.set(patch, "bristles", fmt::format("{}", o.bristles));
    editor.set(patch, "precision", quoted(name_of(o.precision)));
    editor.set(patch, "step_rule", quoted(name_of(o.step_rule)));
    editor.set(patch, "sampling", quoted(name_of(o.sampling)));
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
