// Runs the experiments of `bristle experiment` in the test's process and looks up rows and findings in their
// results.
#pragma once

#include <catch2/catch.hpp>

#include <cmath>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "tools/libraries/experiments/experiment.hpp"

namespace bristle_test {

using Sets = std::vector<std::string>;

inline cli::ExperimentResult run(const std::string& name, const Sets& sets,
                                 const std::vector<std::string>& models) {
  const cli::Experiment& experiment = cli::find_experiment(name);
  cli::Settings settings(experiment.parameters);
  for (const std::string& set : sets) settings.set(set);
  return cli::run_experiment(experiment, {settings, models});
}

inline std::vector<cli::SeriesRow> rows_of(const cli::ExperimentResult& result, const std::string& panel,
                                           const std::string& model) {
  std::vector<cli::SeriesRow> rows;
  for (const cli::SeriesRow& row : result.series) {
    if (row.panel == panel && row.model == model) rows.push_back(row);
  }
  REQUIRE(!rows.empty());
  return rows;
}

inline double finding(const cli::ExperimentResult& result, const std::string& phenomenon,
                      const std::string& model) {
  for (const cli::Finding& f : result.findings) {
    if (f.phenomenon == phenomenon && f.model == model) return f.value;
  }
  FAIL("no finding " << phenomenon << " of " << model);
  return 0.0;
}

/// Finds the row of a table that has the value x in a column.
inline std::optional<cli::SeriesRow> at(const std::vector<cli::SeriesRow>& rows, double x, double within,
                                        std::size_t column = 0) {
  for (const cli::SeriesRow& row : rows) {
    if (std::abs(row.values[column] - x) <= within) return row;
  }
  return std::nullopt;
}

inline Sets operator+(Sets a, const Sets& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

inline std::string set(const std::string& key, double value) {
  std::ostringstream text;
  text.precision(17);
  text << key << '=' << value;
  return text.str();
}

inline Sets law_of(const std::string& dist) {
  if (dist == "uniform_0.5_1.5") return {"law=uniform", "cv=0.28867513459481287"};
  if (dist == "lognormal_cv0.3") return {"law=lognormal", "cv=0.3"};
  if (dist == "exponential") return {"law=exponential"};
  return {"law=single"};
}

}  // namespace bristle_test
