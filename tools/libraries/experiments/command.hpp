// The command `bristle experiment`: its options, and the text that it prints.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "tools/libraries/experiments/experiment.hpp"

namespace cli {

struct ExperimentOptions {
  std::string name;                 ///< name of an experiment, "all" or "list"
  std::vector<std::string> set;     ///< settings "key=value"; with "all": "experiment.key=value"
  std::string config;               ///< TOML file with settings; empty: none
  std::vector<std::string> models;  ///< names of friction models to run; empty: all
  std::string csv, json, plot;      ///< report files; empty: none, "-": stdout (not for plot)
  std::string markdown;             ///< Markdown page to write with all results, with "all"
};

/// Runs the command `bristle experiment` and writes its outputs. Throws UserError.
void experiment_command(const ExperimentOptions& options);

/// Lists all experiments by name and title, each with its parameters, their defaults and units.
std::string experiment_list();

/// Experiment with the settings and models it ran with, and its result.
struct ExperimentReport {
  const Experiment* experiment;
  Settings settings;
  std::vector<std::string> models;
  ExperimentResult result;
};

/// Returns a sentence on how many phenomena each model shows, and a table for each experiment, which leaves
/// the measured values out if they do not fit the width. With --wide, experiments that have the same models
/// share a table.
std::string findings_text(std::span<const ExperimentReport> reports);
std::string experiment_json(const std::vector<ExperimentReport>& reports);
std::string experiment_csv(const ExperimentReport& report);
/// Returns the text of the page tools/EXPERIMENTS.md, from the results of all experiments.
std::string experiment_page(std::span<const ExperimentReport> reports);

}  // namespace cli
