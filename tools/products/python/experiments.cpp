// Binds experiment(), the Python form of the command `bristle experiment NAME`.
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/stl.h>

#include "tools/libraries/experiments/command.hpp"
#include "tools/products/python/tools.hpp"

namespace bristle_python {
namespace {

/// Returns a parameter's value as text, in the form of the command line: a list with commas.
std::string setting_text(const py::handle& value) {
  if (py::isinstance<py::str>(value)) return py::cast<std::string>(value);
  if (!py::isinstance<py::iterable>(value)) return py::cast<std::string>(py::str(value));
  std::string text;
  for (const py::handle item : py::iter(value)) text += (text.empty() ? "" : ",") + setting_text(item);
  return text;
}

/// Returns the rows of each curve as an array of shape (rows, columns), by panel and friction model.
py::dict series_of(const cli::ExperimentResult& result) {
  std::map<std::pair<std::string, std::string>, std::vector<const cli::SeriesRow*>> curves;
  for (const cli::SeriesRow& row : result.series) curves[{row.panel, row.model}].push_back(&row);
  py::dict series;
  for (const auto& [key, rows] : curves) {
    const std::size_t columns = rows.front()->values.size();
    py::array_t<double> array({rows.size(), columns});
    double* to = array.mutable_data();
    for (const cli::SeriesRow* row : rows) to = std::copy_n(row->values.begin(), columns, to);
    series[py::make_tuple(key.first, key.second)] = std::move(array);
  }
  return series;
}

py::dict experiment(const std::string& name, const std::optional<std::vector<std::string>>& models,
                    const py::kwargs& parameters) {
  const cli::Experiment& experiment = cli::find_experiment(name);
  cli::Settings settings(experiment.parameters);
  for (const auto& [key, value] : parameters)
    settings.set(py::cast<std::string>(key) + "=" + setting_text(value), "experiment " + name, {"models"});
  cli::ExperimentInput input{
      settings, cli::choose_models(models.value_or(std::vector<std::string>()), "models", &experiment)};
  cli::ExperimentResult result;
  {
    WithoutLock unlocked;
    InterruptCheck interrupted(unlocked);
    input.progress = [&](double) { interrupted(); };
    result = cli::run_experiment(experiment, input);
  }
  const py::dict series = series_of(result);
  const cli::ExperimentReport report{&experiment, settings, input.models, std::move(result)};
  const py::dict found = report_of(cli::experiment_json({report}))["experiments"][py::int_(0)];
  found["title"] = experiment.title;
  found["columns"] = experiment.columns;
  found["series"] = series;
  return found;
}

}  // namespace

void define_experiments(py::module_& module) {
  module.def(
      "experiment", &experiment, py::arg("name"), py::kw_only(), optional("models"),
      "A classic friction experiment (tools/EXPERIMENTS.md) on the brush and its rivals, all or those in "
      "`models`; other keywords set its parameters (`bristle experiment list`). Returns a dict: name, title, "
      "parameters, findings (a list of dicts: phenomenon, model, value, unit, shown, ...), columns, and "
      "series, {(panel, model): array of shape (rows, columns)}. Lets go of the interpreter's lock; Ctrl-C "
      "ends it. Raises bristle.Error.");
}

}  // namespace bristle_python
