// Experiment on a contact that is rubbed to and fro many times: by a stroke, by a trembling hand, in a
// circle, under a wavering force. It is then moved back over the point where it began.
#include <algorithm>
#include <array>
#include <cmath>

#include "tools/libraries/experiments/body.hpp"
#include "tools/libraries/experiments/experiment.hpp"
#include "tools/libraries/experiments/subject.hpp"
#include "tools/libraries/scene/waveform.hpp"

namespace cli {
namespace {

using rivals::Pair;

/// Contact moved at constant speed. Lengths are in presliding lengths, forces over kinetic friction.
class Rubbed {
 public:
  Rubbed(const Settings& s, const std::string& model, int axes = 1)
      : subject_(model, s, {axes, 1.0}),
        load_(s.number("load")),
        length_(s.number("presliding")),
        kinetic_(s.number("kinetic") * load_),
        speed_(s.number("velocity")) {}

  /// Moves by `d`. Returns friction at the end of the step, over kinetic; positive along the motion.
  Pair move(Pair d) {
    const double path = length(d);
    if (path == 0.0) return friction_;
    const rivals::Force f = subject_.step(length_ * d, length_ * path / speed_, load_);
    friction_ = (-1.0 / kinetic_) * f.end;
    work_ -= dot(f.mean, d) / kinetic_;
    return friction_;
  }
  double work() const noexcept { return work_; }

 private:
  Subject subject_;
  double load_, length_, kinetic_, speed_;
  double work_ = 0.0;
  Pair friction_;
};

struct Loop {
  double highest = 0.0;
  double work = 0.0;
};

// Least work of a loop, over that of rigid Coulomb friction, with which the loop counts as open, that is, as
// losing energy.
constexpr double open_loop = 0.02;

/// Moves a contact to `stroke`, -`stroke` and back to the middle. Returns the highest friction and the work.
Loop rub(Rubbed& contact, double stroke, double per_length) {
  const auto steps = std::max(4L, std::lround(stroke * per_length));
  const double before = contact.work();
  Loop loop;
  for (const double direction : {1.0, -1.0, -1.0, 1.0}) {
    for (long k = 0; k < steps; ++k) {
      const Pair f = contact.move({direction * stroke / static_cast<double>(steps), 0.0});
      loop.highest = std::max(loop.highest, std::fabs(f.x));
    }
  }
  loop.work = contact.work() - before;
  return loop;
}

bool is_shown_on_the_axis(long cycle) {  // selects about a dozen cycles per decade for the plot
  long decade = 1;
  while (decade * 10 <= cycle) decade *= 10;
  return decade == 1 || cycle % std::max(1L, decade / 2) == 0;
}

void strokes(ExperimentRun& run) {
  const Settings& s = run.settings;
  const auto cycles = std::lround(s.number("cycles"));
  double hardest = 0.0, least = 1e300, most = 0.0, lasts_from = 1e300;
  bool wide = false;
  const std::vector<double>& list = s.numbers("strokes");
  for (std::size_t i = 0; i < list.size(); ++i) {
    const double stroke = list[i];
    Rubbed contact(s, run.model);
    Loop first, tenth, last;
    for (long cycle = 1; cycle <= cycles; ++cycle) {
      last = rub(contact, stroke, s.number("steps_per_length"));
      if (cycle == 1) first = last;
      if (cycle == 10) tenth = last;
      if (is_shown_on_the_axis(cycle))
        run.add("stroke", {stroke, static_cast<double>(cycle), last.highest, last.work / (4.0 * stroke)});
    }
    hardest = std::max(hardest, last.highest / first.highest);
    if (stroke >= 1.5) {
      wide = true;
      least = std::min(least, last.work / tenth.work);
      most = std::max(most, last.work / tenth.work);
    }
    if (last.work < 0.9 * tenth.work || last.work < open_loop * 4.0 * stroke)
      lasts_from = 1e300;
    else
      lasts_from = std::min(lasts_from, stroke);
    if (stroke == 0.5) {
      const double open = last.work / (4.0 * stroke);
      run.add("open_loops", 100.0 * open, open > open_loop);
    }
    run.progress(0.6 * static_cast<double>(i + 1) / static_cast<double>(list.size()));
  }
  run.add("hardening", hardest, hardest <= 1.25);
  if (wide) {
    const double worst = 1.0 - least > most - 1.0 ? least : most;
    run.add("loop_work", worst, std::fabs(worst - 1.0) <= 0.1);
  }
  if (lasts_from < 1e300) run.add("lasts_from", lasts_from, lasts_from <= 1.5);
}

/// Moves a contact as a hand does that tries to hold still: by the sum of two swings, at 8 and 11 Hz.
void tremor(ExperimentRun& run) {
  const Settings& s = run.settings;
  const double dt = 1e-3, duration = s.number("tremor_time"), swing = s.number("tremor");
  Rubbed contact(s, run.model);
  const auto steps = std::lround(duration / dt);
  double x = 0.0, first = 0.0, last = 0.0, highest = 0.0;
  const auto window = std::max(1L, steps / 50);
  for (long k = 1; k <= steps; ++k) {
    const double t = static_cast<double>(k) * dt;
    const double next = swing * (0.6 * sine_of_turns(8.0 * t) + 0.4 * sine_of_turns(11.0 * t));
    const double f = std::fabs(contact.move({next - x, 0.0}).x);
    x = next;
    highest = std::max(highest, f);
    if (t <= 0.5) first = std::max(first, f);  // first 0.5 s, which are four swings of 8 Hz
    if (k > steps - steps / 10) last = std::max(last, f);
    if (k % window == 0) {
      run.add("tremor", {swing, t, highest, 0.0});
      highest = 0.0;
    }
  }
  run.add("tremor", last / first, last / first <= 1.25);
}

void circle(ExperimentRun& run) {
  const Settings& s = run.settings;
  const double radius = s.number("radius");
  const auto turns = std::lround(s.number("turns"));
  const auto steps = std::max(8L, std::lround(2.0 * M_PI * radius * s.number("steps_per_length")));
  Rubbed contact(s, run.model, 2);
  Pair at{radius, 0.0};
  double first = 0.0, last = 0.0;
  for (long turn = 1; turn <= turns; ++turn) {
    last = 0.0;
    for (long k = 1; k <= steps; ++k) {
      const double part = static_cast<double>(k % steps) / static_cast<double>(steps);
      const Pair next{radius * sine_of_turns(part + 0.25), radius * sine_of_turns(part)};
      last += length(contact.move(next - at)) / static_cast<double>(steps);
      at = next;
    }
    if (turn == 2) first = last;
    run.add("circle", {radius, static_cast<double>(turn), last, 0.0});
  }
  const double ratio = last / first;
  run.add("circle", ratio, std::fabs(ratio - 1.0) <= 0.1);
}

/// Loads a block with a force that wavers between two shares of kinetic friction, to see whether it drifts.
/// Returns its drift per cycle over the second half, in presliding lengths. `taps` adds short pushes.
double ratchet(ExperimentRun& run, double low, double high, bool taps) {
  const Settings& s = run.settings;
  const double load = s.number("load"), kinetic = s.number("kinetic") * load, dt = s.number("dt");
  const double period = 1.0 / s.number("frequency"), dbar = s.number("presliding");
  const double tap = taps ? s.number("tap") : 0.0, tap_every = period / 8.0, tap_time = 10.0 * dt;
  const auto cycles = std::max(4L, std::lround(s.number("force_cycles")));
  const auto steps = std::max(20L, std::lround(period / dt));
  Subject subject(run.model, s);
  SlidingBlock block(s.number("mass"));
  std::vector<double> means;
  for (long cycle = 0; cycle < cycles; ++cycle) {
    double mean = 0.0;
    for (long k = 0; k < steps; ++k) {
      const double part = (static_cast<double>(k) + 0.5) / static_cast<double>(steps);
      double share = 0.5 * (low + high) + 0.5 * (high - low) * sine_of_turns(part);
      if (cycle == 0) share *= std::min(1.0, 4.0 * part);  // the force rises slowly from 0 in the first cycle
      if (std::fmod(part * period, tap_every) < tap_time) share += tap;
      block.advance(subject, {share * kinetic}, dt, load);
      mean += block.position() / dbar / static_cast<double>(steps);
    }
    means.push_back(mean);
    run.add(taps ? "ratchet_taps" : "ratchet", {high, static_cast<double>(cycle + 1), low, mean});
  }
  const auto last = means.size() - 1, middle = last / 2;
  return (means[last] - means[middle]) / static_cast<double>(last - middle);
}

void ratchets(ExperimentRun& run) {
  constexpr std::array<std::array<double, 2>, 4> shares{{{0.2, 0.5}, {0.0, 0.8}, {-0.3, 0.8}, {-0.5, 0.9}}};
  for (const bool taps : {false, true}) {
    double worst = 0.0;
    for (const auto& [low, high] : shares) {
      const double drift = ratchet(run, low, high, taps);
      if (std::fabs(drift) > std::fabs(worst)) worst = drift;
    }
    run.add(taps ? "ratchet_taps" : "ratchet", worst, std::fabs(worst) < 1e-4);
    run.progress(taps ? 0.95 : 0.85);
  }
}

/// Moves a contact far from where it began and back over that point, and records its friction, which should
/// not depend on the point.
void echo(ExperimentRun& run) {
  const Settings& s = run.settings;
  const double per_length = s.number("steps_per_length"), away = s.number("away");
  Rubbed contact(s, run.model);
  const auto steps = std::lround(away * per_length);
  for (long k = 0; k < steps; ++k) contact.move({-1.0 / per_length, 0.0});
  double before = 0.0, near = 0.0;
  long counted = 0;
  for (long k = 1; k <= steps + std::lround(4.0 * per_length); ++k) {
    const double x = static_cast<double>(k - steps) / per_length;
    const double f = contact.move({1.0 / per_length, 0.0}).x;
    if (x > -0.5 * away && x < -3.0) {
      before += f;
      ++counted;
    }
    if (std::fabs(x) <= 2.0) near = std::max(near, f);
    if (x > -6.0) run.add("echo", {away, x, f, 0.0});
  }
  const double excess = 100.0 * (near / (before / static_cast<double>(std::max(counted, 1L))) - 1.0);
  run.add("echo", excess, excess < 3.0);
}

void run_rubbing(ExperimentRun& run) {
  strokes(run);
  tremor(run);
  circle(run);
  ratchets(run);
  echo(run);
}

std::vector<Parameter> surface() {
  std::vector<Parameter> all = common_parameters(
      {{"viscous", 0.0}, {"bristles", 3600}, {"cv", 0.3}, {"static", 0.46}, {"damping", 60.0}});
  for (Parameter& p : all) {
    if (p.name == "law") p.text = "lognormal";
  }
  return all;
}

}  // namespace

Experiment rubbing_experiment() {
  return {
      "rubbing",
      "to and fro many times: strokes, tremor, circles, wavering forces, and back over the origin",
      "Brushes that draw a new snap length at every snap harden when rubbed, which the default brush's "
      "shared renewal prevents",
      surface() +
          std::vector<Parameter>{
              number_parameter("velocity", 1e-6, "m/s", "of strokes and circles", 1e-9, 1.0),
              list_parameter("strokes", {0.2, 0.35, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 5.0}, "",
                             "to either side, presliding lengths; 0.5 and those from 1.5 on are judged apart",
                             0.01, 1e3),
              whole_parameter("cycles", 1000, "of each stroke", 10, 1e6),
              whole_parameter("steps_per_length", 10, "steps in a presliding length", 4, 1e4),
              number_parameter("tremor", 1.2, "", "swing of the trembling hand, presliding lengths", 0.01,
                               100.0),
              number_parameter("tremor_time", 30.0, "s", "how long it trembles", 1.0, 1e5),
              number_parameter("radius", 1.0, "", "of the circle, presliding lengths", 0.05, 1e3),
              whole_parameter("turns", 100, "of the circle", 3, 1e6),
              number_parameter("mass", 0.1, "kg", "of the block under a wavering force", 1e-6, 1e6),
              number_parameter("frequency", 5.0, "Hz", "of the wavering force", 1e-3, 40.0),
              whole_parameter("force_cycles", 60, "of the wavering force", 4, 1e6),
              number_parameter(
                  "tap", 0.05, "",
                  "push of a tap along the motion for ten steps, eight a cycle, over kinetic friction", 0.0,
                  10.0),
              number_parameter("away", 30.0, "",
                               "path from the origin before it comes back, presliding lengths", 10.0, 1e5)},
      {{"hardening", "rubbing does not harden",
        "loops of a contact moved to and fro repeat after a few cycles (Courtney-Pratt and Eisner 1957)",
        "highest force of the last cycle over that of the first, worst of all strokes", "", "at most 1.25"},
       {"loop_work", "sliding strokes keep their loss",
        "a rubbed contact keeps warming: loops keep their area",
        "work of the last loop over that of the tenth, worst of the strokes from 1.5 presliding lengths on",
        "", "within 10 % of 1"},
       {"open_loops", "presliding loops stay open",
        "loops below break-away lose energy cycle after cycle (Courtney-Pratt and Eisner 1957; Mindlin's "
        "fretting loops)",
        "work of the last loop, half a presliding length to either side, over that of rigid Coulomb friction",
        "%", "above 2 %"},
       {"lasts_from", "loops last from some stroke on", "as above",
        "smallest stroke from which on the last loop keeps nine tenths of the tenth's work and 2 % of "
        "Coulomb's",
        "", "at most 1.5 presliding lengths"},
       {"tremor", "a trembling hand does not harden it", "as above, for swings that beat",
        "highest force of the last tenth of the time over that of the first half second", "", "at most 1.25"},
       {"circle", "nor does a circle", "as above, in the plane",
        "mean force of the last turn over that of the second", "", "within 10 % of 1"},
       {"ratchet", "no drift under forces that waver widely",
        "a force that wavers below break-away moves nothing permanently (Dupont et al. 2002)",
        "drift per cycle, worst of forces between 0.2 and 0.5, 0 and 0.8, -0.3 and 0.8, -0.5 and 0.9 of "
        "kinetic friction",
        "lengths", "below 1e-4 presliding lengths"},
       {"ratchet_taps", "nor when it is tapped", "as above, with short pushes",
        "drift per cycle, worst of the same forces", "lengths", "below 1e-4 presliding lengths"},
       {"echo", "it does not remember its origin",
        "no record shows where the contact was made, once it has slid away",
        "highest force within two lengths of the origin when it slides back over it, above that of sliding",
        "%", "below 3 %"}},
      {"setting", "cycle_or_x", "force_over_kinetic", "work_or_position"},
      &run_rubbing};
}

}  // namespace cli
