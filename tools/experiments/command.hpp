// Command `bristle experiment`: its options and output.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "tools/experiments/experiment.hpp"

namespace cli {

struct ExperimentOptions {
  std::string name;                 ///< name of an experiment, or "all" or "list"
  std::vector<std::string> set;     ///< settings, each "key=value"; with "all": "experiment.key=value"
  std::string config;               ///< TOML file of settings; empty: none
  std::vector<std::string> models;  ///< names of the models to run; empty: all
  std::string csv, json, plot;      ///< output files; empty: none, "-": stdout (not for plot)
  std::string markdown;             ///< file for all results as a Markdown page, with "all"
  bool no_cost = false;             ///< whether the results leave out the times of a step, with "all"
};

/// Runs the command and writes its outputs. Throws UserError.
void experiment_command(const ExperimentOptions& options);

/// Lists names, titles, and parameters with defaults and units of all experiments.
std::string experiment_list();

/// Experiment that was run, with its settings and result.
struct ExperimentReport {
  const Experiment* experiment;
  Settings settings;
  std::vector<std::string> models;
  ExperimentResult result;
};

/// Returns a sentence on how many phenomena each model shows, and a table per experiment; with --wide one
/// table for all experiments that have the same models.
std::string findings_text(std::span<const ExperimentReport> reports);
std::string cost_table(const std::vector<CostRow>& cost, const std::vector<std::string>& models);
std::string experiment_json(const std::vector<ExperimentReport>& reports, const std::vector<CostRow>& cost);
std::string experiment_csv(const ExperimentReport& report);
/// Returns the page tools/EXPERIMENTS.md.
std::string experiment_page(std::span<const ExperimentReport> reports, const std::vector<CostRow>& cost,
                            const std::vector<std::string>& models);

}  // namespace cli
