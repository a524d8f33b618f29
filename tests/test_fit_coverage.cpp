// How many of the 95 % intervals of `bristle fit` hold the truth: the table of tools/README.md. Takes
// minutes: bristle_tests '[.coverage]'; BRISTLE_FIT_REPEATS=200 for more than 40 repeats of each record,
// BRISTLE_FIT_CELLS=ageing for the records with this in their name (rule and record) only.
#include <catch2/catch.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "tests/synthetic_friction.hpp"
#include "tools/fitting/fit.hpp"

using namespace bristle_test;
using bristle::SnapRule;

namespace {

struct Record {
  std::string name;
  SyntheticFriction setting;
};

/// Ten seconds at 200 Hz, noise of 10 mN, of 1800 bristles; and what disturbs them.
std::vector<Record> plain_records() {
  SyntheticFriction s;
  s.motion = loops_and_strokes;
  s.noise = 0.01;
  SyntheticFriction drift = s, slow = s, encoder = s, all = s, strokes = s, loops = s, swings = s;
  drift.drift = [](double t) { return 0.004 * (t - 5.0); };
  slow.every = all.every = 4;
  encoder.encoder = all.encoder = 1e-6;
  all.drift = [](double t) { return 0.004 * (t - 5.0) + 0.01 * std::sin(2.0 * M_PI * t / 7.0); };
  strokes.motion = [](double t) {
    return 0.4e-3 * std::sin(M_PI * t) * std::pow(std::min((t + 0.5) / 6.0, 1.0), 1.5);
  };
  loops.motion = [](double t) { return 12e-6 * t / 10.0 * std::sin(2.0 * M_PI * 1.5 * t); };
  swings.motion = [](double t) { return 4e-6 * t * std::sin(2.0 * M_PI * 0.7 * t); };
  return {{"noise of 10 mN", s},        {"and a linear drift of 40 mN", drift},
          {"noise, 50 Hz", slow},       {"noise, encoder of 1 um", encoder},
          {"all, and a swing", all},    {"noise, strokes only", strokes},
          {"noise, loops only", loops}, {"noise, growing swings", swings}};
}

/// A minute at 100 Hz of contacts that age by 0.02 per e-fold from 1 ms on, or strengthen by 0.01 per e-fold
/// from 1 um/s on.
std::vector<Record> time_records() {
  SyntheticFriction s;
  s.noise = 0.01;
  s.rate = 100.0;
  SyntheticFriction holds = s, steps = s, both = s, stronger = s, skin = s, none = s, strokes = s;
  const auto log_growth = [](double age) { return logarithmic_growth(age, 0.02, 1e-3); };
  const auto run = [](SyntheticFriction& to, const std::vector<Piece>& pieces) {
    to.motion = programme(pieces);
    to.duration = programme_length(pieces);
  };
  run(holds, slide_hold_slide());
  for (SyntheticFriction* of : {&steps, &both, &stronger, &skin, &none}) run(*of, velocity_steps());
  for (SyntheticFriction* of : {&holds, &steps, &both, &strokes}) of->growth = log_growth;
  skin.growth = [](double age) { return 1.0 + 0.15 * (1.0 - std::exp(-age / 0.5)); };
  for (SyntheticFriction* of : {&both, &stronger}) {
    of->strengthening = 0.01;
    of->strengthening_speed = 1e-6;
  }
  strokes.motion = loops_and_strokes;
  SyntheticFriction skewed = s;
  skewed.motion = loops_and_strokes;
  skewed.asymmetry = 0.05;
  skewed.drift = [](double) { return 0.03; };
  skewed.load = [](double t) { return 2.0 + std::sin(1.3 * t); };
  skewed.most_load = 3.0;
  skewed.bristles = 2700;
  return {{"ageing, slide-hold-slide", holds},         {"ageing, velocity steps and holds", steps},
          {"ageing, loops and strokes", strokes},      {"ageing and strengthening, velocity steps", both},
          {"strengthening, velocity steps", stronger}, {"saturating ageing, velocity steps", skin},
          {"no ageing, velocity steps", none},         {"direction and offset, load of 1 to 3 N", skewed}};
}

/// What lies between the contact and the file. Brush and sensor at 1 kHz, recorded at 200 Hz.
std::vector<Record> stage_records() {
  SyntheticFriction s;
  s.motion = loops_and_strokes;
  s.noise = 0.01;
  s.rate = 1000.0;
  s.every = 5;
  SyntheticFriction late = s, soft = s, both = s, loads = s, soft_loads = s, all = s;
  late.delay = both.delay = all.delay = 0.008;
  for (SyntheticFriction* of : {&loads, &soft_loads, &both}) {
    of->load = [](double t) { return 2.0 + std::sin(1.3 * t); };
    of->most_load = 3.0;
    of->bristles = 2700;
  }
  for (SyntheticFriction* of : {&soft, &soft_loads, &both}) of->compliance = 4e-6;
  all.encoder = 0.5e-6;
  all.drift = [](double t) { return 0.03 + 0.004 * (t - 5.0); };
  return {{"stage: neither", s},
          {"stage: delay of 8 ms", late},
          {"stage: 4 um/N, one load", soft},
          {"stage: neither, loads of 1 to 3 N", loads},
          {"stage: 4 um/N, loads of 1 to 3 N", soft_loads},
          {"stage: delay and 4 um/N, loads of 1 to 3 N", both},
          {"stage: delay, encoder of 0.5 um, drift", all}};
}

/// Estimates of one parameter.
struct Held {
  const char* name;
  int count = 0, held = 0;
  double sum = 0.0, truth = 0.0, half_width = 0.0;
  void add(const cli::FitEstimate& e, double true_value) {
    if (!e.fitted) return;
    ++count;
    held += e.low <= true_value && true_value <= e.high ? 1 : 0;
    sum += e.value;
    truth += true_value;
    half_width += 0.5 * (e.high - e.low);
  }
  /// Three deviations of the count at the end of 90 %.
  bool holds() const { return held >= 0.90 * count - 3.0 * std::sqrt(count * 0.90 * 0.10); }
};

cli::FitResult fit_of(const SyntheticFriction& s, SnapRule rule, std::uint64_t seed) {
  cli::FitOptions options;
  options.rule = rule;
  options.quiet = true;
  const std::string csv = record(s, seed).csv();
  const cli::FitData data =
      cli::prepare_fit_data(cli::parse_fit_columns(csv, "data.csv"), options.sign, options.load);
  return cli::fit_material(data, options);
}

void add_all(std::vector<Held>& held, const SyntheticFriction& s, const cli::FitResult& r) {
  const double age_growth = s.growth && r.frame.age > 0.0 ? s.growth(r.frame.age) : 1.0;
  const double speed = r.frame.speed > 0.0 ? r.frame.speed : 1e-4;
  const bool logarithmic = r.frame.form == bristle::AgeingForm::logarithmic;
  const bool skin = s.growth && s.growth(1e9) < 1.2;
  const double bend = (s.redraw ? 0.5 * (1.0 + s.spread * s.spread) : 0.5) * s.length;
  held[0].add(r.estimates[cli::fit_kinetic], kinetic_at(s, speed));
  held[1].add(r.estimates[cli::fit_length], s.length * age_growth);
  held[2].add(r.estimates[cli::fit_spread], s.spread);
  held[3].add(r.stiffness, s.kinetic / bend);
  if (!s.growth || skin != logarithmic)
    held[4].add(r.estimates[cli::fit_ageing], !s.growth ? 0.0 : skin ? 0.15 : 0.02 / age_growth);
  if (!s.growth || skin != logarithmic) held[5].add(r.estimates[cli::fit_ageing_time], skin ? 0.5 : 1e-3);
  held[6].add(r.estimates[cli::fit_strengthening], s.strengthening);
  held[7].add(r.estimates[cli::fit_strengthening_speed], s.strengthening_speed);
  held[8].add(r.estimates[cli::fit_asymmetry], s.asymmetry);
  held[9].add(r.estimates[cli::fit_offset], s.drift(0.0));
  held[10].add(r.estimates[cli::fit_compliance], s.compliance);
  held[11].add(r.estimates[cli::fit_delay], s.delay);
}

void run_record(const Record& r, SnapRule rule, int repeats) {
  const char* only = std::getenv("BRISTLE_FIT_CELLS");
  const std::string name = std::string(rule == SnapRule::keep ? "keep" : "redraw") + " | " + r.name;
  if (only && name.find(only) == std::string::npos) return;
  SyntheticFriction s = r.setting;
  s.redraw = rule == SnapRule::redraw;
  std::vector<Held> held = {{"kinetic"},   {"length"},      {"spread"},        {"stiffness"},
                            {"ageing"},    {"ageing time"}, {"strengthening"}, {"strengthening speed"},
                            {"asymmetry"}, {"offset"},      {"compliance"},    {"delay"}};
  int other_form = 0;
  for (int i = 0; i < repeats; ++i) {
    const cli::FitResult result = fit_of(s, rule, 1000 + 10 * static_cast<std::uint64_t>(i));
    add_all(held, s, result);
    other_form += result.frame.form == bristle::AgeingForm::saturating ? 1 : 0;
  }
  std::printf("| %s", name.c_str());
  for (const Held& h : held) {
    if (h.count == 0) continue;
    const double n = h.count;
    std::printf(" | %s %.4g (%.4g), %.2g, %d of %d", h.name, h.sum / n, h.truth / n, h.half_width / n, h.held,
                h.count);
    INFO(name << ", " << h.name);
    // Drift is not an offset at the first sample; where ageing is seen and is not there no interval holds it.
    if (std::string(h.name) != "offset" || s.asymmetry > 0.0) CHECK(h.holds());
  }
  std::printf(" | saturating %d |\n", other_form);
  std::fflush(stdout);
}

int repeats_asked() {
  const char* given = std::getenv("BRISTLE_FIT_REPEATS");
  return given ? std::atoi(given) : 40;
}

}  // namespace

TEST_CASE("Of many repeated experiments 90 to 98 % of the intervals hold the truth", "[.coverage]") {
  for (const SnapRule rule : {SnapRule::redraw, SnapRule::keep}) {
    for (Record r : plain_records()) {
      // No sample at the origin itself: there all kept bristles snap at once, and rounding decides.
      r.setting.motion = [motion = r.setting.motion](double t) { return motion(t + 1.3e-3); };
      run_record(r, rule, repeats_asked());
    }
  }
}

TEST_CASE(
    "Of many experiments behind a soft stage or a slow sensor 90 to 98 % of the intervals hold the truth",
    "[.coverage]") {
  for (const Record& r : stage_records()) run_record(r, SnapRule::redraw, repeats_asked());
}

TEST_CASE("Of many experiments with time and direction 90 to 98 % of the intervals hold the truth",
          "[.coverage]") {
  for (const Record& r : time_records()) run_record(r, SnapRule::redraw, repeats_asked());
}
