#include "tools/libraries/experiments/command.hpp"

#include <algorithm>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "tools/libraries/files/gnuplot.hpp"
#include "tools/libraries/files/output_file.hpp"
#include "tools/libraries/files/text_file.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/reports/progress.hpp"
#include "tools/libraries/reports/text_layout.hpp"

namespace cli {
namespace {

bool is_experiment(std::string_view name) {
  return std::any_of(experiments().begin(), experiments().end(),
                     [&](const Experiment& e) { return e.name == name; });
}

Settings settings_for(const Experiment& experiment, const ExperimentOptions& options) {
  Settings settings(experiment.parameters);
  if (!options.config.empty()) settings.read_file(options.config, experiment.name, is_experiment);
  for (const std::string& assignment : options.set) {
    std::string_view text = assignment;
    if (options.name == "all") {
      const auto dot = text.find('.');
      if (dot == std::string_view::npos || dot > text.find('='))
        throw UserError(fmt::format("--set {}: with 'all' it needs EXPERIMENT.KEY=VALUE", assignment));
      if (find_experiment(text.substr(0, dot)).name != experiment.name) continue;
      text.remove_prefix(dot + 1);
    }
    settings.set(text);
  }
  return settings;
}

std::string plot_script(const std::string& name) {
  std::string file = "experiment_" + name + ".gp";
  std::replace(file.begin(), file.end(), '-', '_');
  return find_plot_script(file, "--plot");
}

void check_plot(const ExperimentOptions& options) {
  if (options.plot.empty()) return;
  check_picture_name("--plot", options.plot);
  if (options.name == "all") throw UserError("--plot: one experiment at a time");
  plot_script(options.name);
}

void draw(const ExperimentOptions& options, const ExperimentReport& report, OutputFile& picture) {
  OutputFile data(temporary_csv("--plot"));
  data.append(experiment_csv(report));
  data.flush();
  draw_csv(plot_script(options.name), data.written_path(), picture.written_path(),
           is_vector_picture(options.plot), "", "--plot");
  picture.finish();
}

void check_files(const ExperimentOptions& options) {
  if (options.name == "all" && !options.csv.empty()) throw UserError("--csv: one experiment at a time");
  if (options.name != "all" && !options.markdown.empty()) throw UserError("--markdown: only with 'all'");
  check_plot(options);
}

ExperimentReport run_one(const Experiment& experiment, const ExperimentOptions& options,
                         const std::vector<std::string>& models) {
  Progress progress("experiment " + experiment.name);
  ExperimentInput input{settings_for(experiment, options), models,
                        [&](double share) { progress.update(share); }};
  return {&experiment, input.settings, models, run_experiment(experiment, input)};
}

}  // namespace

std::string experiment_list() {
  std::string text = "Experiments: bristle experiment NAME; all of them: bristle experiment all\n";
  for (const Experiment& e : experiments()) text += fmt::format("  {:<18} {}\n", e.name, e.title);
  text += fmt::format(
      "\nModels (--models A,B): {}\n\nParameters (--set KEY=VALUE) of every experiment; some have "
      "other defaults for them, listed there\n",
      fmt::join(model_names(), ", "));
  const std::vector<Parameter> common = common_parameters();
  text += parameter_table(common);
  for (const Experiment& e : experiments()) {
    std::vector<Parameter> own;
    for (const Parameter& p : e.parameters) {
      const auto same = std::find_if(common.begin(), common.end(), [&](const Parameter& c) {
        return c.name == p.name && Settings::value_text(c) == Settings::value_text(p);
      });
      if (same == common.end()) own.push_back(p);
    }
    text += fmt::format("\n{}: {}\n", e.name, e.title);
    if (!e.models.empty()) text += fmt::format("Models of its own: {}\n", fmt::join(models_of(&e), ", "));
    text += parameter_table(own);
  }
  return text;
}

void experiment_command(const ExperimentOptions& options) {
  if (options.name == "list") {
    print_report(experiment_list());
    return;
  }
  const bool on_stdout = check_files({{"--config", options.config}}, {{"--csv", options.csv},
                                                                      {"--json", options.json},
                                                                      {"--markdown", options.markdown},
                                                                      {"--plot", options.plot}});
  check_files(options);
  std::vector<const Experiment*> wanted;
  for (const Experiment& e : experiments()) {
    if (options.name == "all" || options.name == e.name) wanted.push_back(&e);
  }
  if (wanted.empty()) find_experiment(options.name, {"all", "list"});
  const std::vector<std::string> models =
      choose_models(options.models, "--models", options.name == "all" ? nullptr : wanted.front());
  for (const Experiment* e : wanted)
    // Checks the settings of every experiment before the first one runs, so that a bad one is refused at
    // once.
    e->check(settings_for(*e, options));
  OutputFile csv(options.csv), json(options.json), markdown(options.markdown), picture(options.plot);
  std::vector<ExperimentReport> reports;
  for (const Experiment* e : wanted)
    reports.push_back(run_one(*e, options, wanted.size() > 1 && !e->models.empty() ? models_of(e) : models));
  if (!on_stdout) print_report(findings_text(reports));
  if (csv) csv.write(experiment_csv(reports.front()));
  if (json) json.write(experiment_json(reports));
  if (markdown) markdown.write(experiment_page(reports));
  if (picture) draw(options, reports.front(), picture);
}

}  // namespace cli
