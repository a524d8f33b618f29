// `bristle experiment`: options and what it writes.
#pragma once

#include <string>
#include <vector>

#include "tools/experiments/experiment.hpp"

namespace cli {

struct ExperimentOptions {
  std::string name;                 ///< of an experiment, or "all" or "list"
  std::vector<std::string> set;     ///< "key=value"; with "all": "experiment.key=value"
  std::string config;               ///< TOML file; empty: none
  std::vector<std::string> models;  ///< empty: all
  std::string csv, json, plot;      ///< files; empty: none, "-": stdout (not for plot)
  std::string markdown;             ///< with "all": the table as a page
  bool no_cost = false;             ///< with "all": without the time of a step
};

/// Throws UserError.
void experiment_command(const ExperimentOptions& options);

/// Names, titles, parameters with defaults and units of all experiments.
std::string experiment_list();

/// An experiment with its settings and what came out.
struct ExperimentReport {
  const Experiment* experiment;
  Settings settings;
  ExperimentResult result;
};

/// Says in words how many phenomena each model shows.
std::string findings_answer(const std::vector<ExperimentReport>& reports,
                            const std::vector<std::string>& models);
/// A table an experiment; one of all with --wide.
std::string findings_table(const std::vector<ExperimentReport>& reports,
                           const std::vector<std::string>& models);
std::string cost_table(const std::vector<CostRow>& cost, const std::vector<std::string>& models);
std::string experiment_json(const std::vector<ExperimentReport>& reports, const std::vector<CostRow>& cost);
std::string experiment_csv(const ExperimentReport& report);
/// The page tools/EXPERIMENTS.md.
std::string experiment_page(const std::vector<ExperimentReport>& reports, const std::vector<CostRow>& cost,
                            const std::vector<std::string>& models);

}  // namespace cli
