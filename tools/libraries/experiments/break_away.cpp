// Experiment on break-away: a growing force pulls a block until it slides, at different rates of growth,
// loads, and times at rest.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "tools/libraries/experiments/body.hpp"
#include "tools/libraries/experiments/experiment.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/reports/line_fit.hpp"

namespace cli {
namespace {

struct BreakAway {
  double friction = 0.0;  // highest friction before the block slides, N
  double applied = 0.0;   // applied force when friction is highest, N
};

BreakAway pull(const std::string& model, const Settings& s, double rate, double load, double highest_load) {
  Subject::Options options;
  options.highest_load_over_load = highest_load / s.number("load");
  Subject subject(model, s, options);
  SlidingBlock block(s.number("mass"));
  const double strongest = 4.0 * std::max(s.number("static"), s.number("kinetic")) * load;
  const double dt = std::min(s.number("dt"), strongest / rate / 100.0);
  BreakAway found;
  for (long k = 1; block.velocity() < s.number("sliding_velocity"); ++k) {
    const double applied = rate * dt * (static_cast<double>(k) - 0.5);
    // Gives up when the pull is a hundred times the highest friction. Only viscous terms hold the block then,
    // and it will never break away.
    if (applied > 100.0 * strongest) break;
    const double friction = -block.advance(subject, {applied}, dt, load);
    if (friction > found.friction) found = {friction, applied};
  }
  return found;
}

// Returns the highest friction in a slow pull on a contact that slid and then rested for `rest_s`.
double after_rest(const std::string& model, const Settings& s, double rest_s) {
  Subject subject(model, s);
  const double dbar = s.number("presliding"), load = s.number("load");
  const auto move = [&](double path, double speed) {
    const double step = dbar / 50.0;
    double highest = 0.0;
    for (long k = 0; k < std::lround(path / step); ++k)
      highest = std::max(highest, -subject.step({step, 0.0}, step / speed, load).end.x);
    return highest;
  };
  move(20.0 * dbar, 1e-3);
  for (int k = 0; k < 100; ++k) subject.step({}, rest_s / 100.0, load);
  return move(3.0 * dbar, 1e-5);
}

void over_rates(ExperimentRun& run) {
  const Settings& s = run.settings;
  const double load = s.number("load");
  std::vector<BreakAway> found;
  for (const double rate : s.numbers("rates")) {
    found.push_back(pull(run.model, s, rate, load, load));
    run.add("rate", {rate, load, 0.0, found.back().friction, found.back().applied});
  }
  const double peak = found.front().friction / (s.number("kinetic") * load);
  run.add("static_peak", peak, peak > 1.05);
  const double ratio = found.back().friction / found.front().friction;
  run.add("break_away_rate", ratio, ratio < 0.98);
}

void over_loads(ExperimentRun& run) {
  const Settings& s = run.settings;
  const std::vector<double>& loads = s.numbers("loads");
  const double highest = std::max(s.number("load"), *std::max_element(loads.begin(), loads.end()));
  std::vector<double> friction;
  for (const double load : loads) {
    // Scales the rate of the growing pull with the load. Break-away then takes equally long at any load, and
    // the results compare.
    const double rate = s.number("rate_at_loads") * load / s.number("load");
    const BreakAway found = pull(run.model, s, rate, load, highest);
    friction.push_back(found.friction);
    run.add("load", {rate, load, 0.0, found.friction, found.applied});
  }
  const double power = fit_power(loads, friction).slope;
  run.add("break_away_load", power, std::fabs(power - 1.0) < 0.1);
}

void over_rests(ExperimentRun& run) {
  const Settings& s = run.settings;
  std::vector<double> friction;
  for (const double rest : s.numbers("rests")) {
    friction.push_back(after_rest(run.model, s, rest));
    run.add("rest", {0.0, s.number("load"), rest, friction.back(), 0.0});
  }
  const double again = friction.front() / (s.number("kinetic") * s.number("load"));
  run.add("peak_again", again, again > 1.05);
  const double ratio = friction.back() / friction.front();
  run.add("dwell_time", ratio, ratio > 1.02);
}

void check_break_away(const Settings& settings) {
  const std::vector<double>& loads = settings.numbers("loads");
  if (std::adjacent_find(loads.begin(), loads.end(), std::not_equal_to<>()) == loads.end())
    throw UserError("experiment break-away: loads must hold two loads that differ");
}

// Returns a sentence with the peaks that follow from the settings, with which the measured ones are to be
// compared.
std::string stated_peaks(const Settings& settings, const std::vector<std::string>& models) {
  std::string text =
      fmt::format("[1] as stated, without damping and viscous terms: {:.3g} by static over kinetic",
                  settings.number("static") / settings.number("kinetic"));
  for (const std::string& model : models) {
    if (!is_brush(model) || model == "brush_aged") continue;  // whose peak depends on time
    const bristle::Material material = brush_material(model, settings);
    text += fmt::format("; {} {:.3g}", model_title(model),
                        material.peak_coefficient() / material.kinetic_coefficient());
  }
  return text + ".\n";
}

void run_break_away(ExperimentRun& run) {
  over_rates(run);
  over_loads(run);
  over_rests(run);
}

}  // namespace

Experiment break_away_experiment() {
  return {
      "break-away",
      "static peak against force rate, load and time at rest",
      "Every brush has a static peak at the first pull; after a stop only ageing or a static limit brings it "
      "back",
      common_parameters({{"bristles", 3600}, {"dt", 5e-4}}) +
          std::vector<Parameter>{
              number_parameter("mass", 1.0, "kg", "of the block", 1e-6, 1e6),
              list_parameter("rates", {0.1, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0}, "N/s",
                             "growth of the applied force; the last over the first decides", 1e-4, 1e6),
              list_parameter("loads", {0.25, 0.5, 1.0, 2.5, 5.0, 10.0}, "N", "loads, two or more", 1e-6, 1e6),
              number_parameter("rate_at_loads", 2.0, "N/s",
                               "growth at the common load, in proportion elsewhere", 1e-4, 1e6),
              list_parameter("rests", {0.1, 1.0, 10.0, 100.0}, "s", "times at rest", 1e-3, 1e6),
              number_parameter("sliding_velocity", 0.02, "m/s", "from here on it slides", 1e-9, 1e3)},
      {{"static_peak", "a static peak at the first pull",
        "it takes more force to start than to keep sliding (Coulomb 1785)",
        "break-away friction at the slowest rate, over kinetic friction", "", "above 1.05"},
       {"peak_again", "a static peak again after sliding and a stop",
        "it takes more force to start again than to keep sliding (Coulomb 1785)",
        "break-away friction after sliding and the shortest rest, over kinetic friction", "", "above 1.05"},
       {"break_away_rate", "break-away falls with the force rate",
        "break-away is lower the faster the force grows (Johannes, Green, Brockley 1973)",
        "break-away friction at the fastest rate, over that at the slowest", "", "below 0.98"},
       {"break_away_load", "break-away is proportional to load", "Amontons' law for static friction",
        "exponent of break-away friction over load", "", "1 within 0.1"},
       {"dwell_time", "static friction grows at rest",
        "static friction grows with the logarithm of the time at rest (Rabinowicz 1958; Dieterich 1972)",
        "break-away friction after the longest rest, over that after the shortest", "", "above 1.02"}},
      {"rate[N/s]", "load[N]", "rest[s]", "friction[N]", "applied[N]"},
      &run_break_away,
      {},
      &check_break_away,
      &stated_peaks};
}

}  // namespace cli
