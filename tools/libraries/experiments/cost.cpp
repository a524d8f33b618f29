// Measures the time of a step of each friction model. Steps of all models alternate, and CPU time of the
// thread is taken, which other programs do not lengthen.
#include <memory>

#include <bristle/deadline_monitor.hpp>

#include "tools/libraries/experiments/experiment.hpp"
#include "tools/libraries/experiments/subject.hpp"
#include "tools/libraries/reports/quantile.hpp"

namespace cli {
namespace {

struct Motion {
  const char* name;
  double step_over_length;
};
constexpr Motion motions[] = {{"presliding", 0.003}, {"sliding", 1.0}};

// Receives the computed forces, so that the compiler does not remove their computation.
volatile double sink = 0.0;

double time_of_steps(Subject& subject, double step, double load, int steps) {
  double sum = 0.0;
  const double start = bristle::DeadlineMonitor::cpu_now();
  for (int k = 0; k < steps; ++k) sum += subject.step({step, 0.0}, 1e-3, load).end.x;
  const double seconds = bristle::DeadlineMonitor::cpu_now() - start;
  sink = sum;
  return seconds / steps;
}

}  // namespace

std::vector<Parameter> cost_parameters() {
  std::vector<Parameter> parameters =
      common_parameters() + std::vector<Parameter>{whole_parameter("rounds", 25, "interleaved", 3, 1e4),
                                                   whole_parameter("steps", 2000, "in a round", 10, 1e7)};
  for (Parameter& p : parameters) {
    if (p.name == "precision") p.text = "single";
  }
  return parameters;
}

std::vector<CostRow> measure_cost(const ExperimentInput& input) {
  const Settings& s = input.settings;
  const auto rounds = static_cast<std::size_t>(s.number("rounds"));
  const auto steps = static_cast<int>(s.number("steps"));
  std::vector<CostRow> rows;
  for (const Motion& motion : motions) {
    std::vector<std::unique_ptr<Subject>> subjects;
    for (const std::string& model : input.models)
      subjects.push_back(std::make_unique<Subject>(model, s, Subject::Options{2, 1.0}));
    std::vector<std::vector<double>> times(subjects.size());
    for (std::size_t round = 0; round < rounds; ++round) {
      for (std::size_t m = 0; m < subjects.size(); ++m) {
        const double step = motion.step_over_length * s.number("presliding");
        times[m].push_back(time_of_steps(*subjects[m], step, s.number("load"), steps));
      }
      input.progress(static_cast<double>(round + 1) / static_cast<double>(rounds));
    }
    for (std::size_t m = 0; m < subjects.size(); ++m) {
      const auto at = [&](double share) { return 1e9 * quantile(times[m], share); };
      rows.push_back({input.models[m], motion.name, at(0.5), at(0.25), at(0.75)});
    }
  }
  return rows;
}

}  // namespace cli
