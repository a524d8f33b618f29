#include "comparison.hpp"

#include <array>
#include <chrono>
#include <utility>

#include "block.hpp"
#include "tools/libraries/experiments/experiment.hpp"

namespace page {
namespace {

struct Comparison {
  cli::Experiment experiment;
  std::vector<std::string> models;
  std::string panel, phenomenon;
  std::size_t x, y;                                     ///< indices of the plotted columns of a result's row
  std::vector<std::pair<const char*, double>> shorter;  ///< parameters set lower, so that the run is short
};

const std::array<Comparison, comparisons>& all() {
  static const std::array<Comparison, comparisons> table{{
      {cli::drift_experiment(), {"brush_rubbed", "lugre", "coulomb"}, "fig2", "drift_per_cycle", 0, 3, {}},
      {cli::rubbing_experiment(),
       {"brush_rubbed", "lugre", "brush_redraw"},
       "stroke",
       "hardening",
       1,
       2,
       {{"strokes", 1.0}, {"cycles", 60.0}, {"tremor_time", 2.0}, {"turns", 3.0}, {"force_cycles", 4.0}}},
      {cli::rolling_ball_experiment(), {"bed", "patch", "coulomb"}, "slope", "creeps_by_distance", 0, 3, {}},
  }};
  return table;
}

cli::Settings settings_of(const Comparison& comparison) {
  cli::Settings settings(comparison.experiment.parameters);
  for (const auto& [name, value] : comparison.shorter) settings.set_numbers(name, {value});
  return settings;
}

}  // namespace

std::vector<std::string> compared_models(int comparison) {
  return all().at(static_cast<std::size_t>(comparison)).models;
}

Compared compare(int comparison, const std::string& model) {
  const Comparison& it = all().at(static_cast<std::size_t>(comparison));
  const cli::Settings settings = settings_of(it);
  cli::ExperimentResult result;
  cli::ExperimentRun run{settings, model, result};
  it.experiment.run(run);
  Compared compared;
  for (const cli::SeriesRow& row : result.series)
    if (row.panel == it.panel)
      compared.points.insert(compared.points.end(), {row.values[it.x], row.values[it.y]});
  for (const cli::Finding& finding : result.findings) {
    if (finding.phenomenon != it.phenomenon) continue;
    compared.finding = finding.value;
    compared.shown = finding.shown;
  }
  return compared;
}

double step_microseconds() {
  using Clock = std::chrono::steady_clock;
  Block block;
  BlockSettings settings;
  settings.bristles = 10000;
  settings.coefficients.with_presliding_length(0.5e-3);
  block.set(settings);
  block.grab();
  constexpr int steps_to_slide = 600, steps = 300;
  Clock::time_point begin;
  for (int i = 0; i < steps_to_slide + steps; ++i) {
    if (i == steps_to_slide) begin = Clock::now();
    block.move_hand(1e-5 * i);
    block.step();
  }
  return std::chrono::duration<double, std::micro>(Clock::now() - begin).count() / steps;
}

}  // namespace page
