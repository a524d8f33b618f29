// `bristle fit`: a file with the force alone gets its motion from stated strokes, or from another logger, and
// the material is found all the same.
#include <catch2/catch.hpp>

#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "tests/fit_helpers.hpp"
#include "tests/synthetic_friction.hpp"
#include "tests/temporary_folder.hpp"

using Catch::Matchers::Contains;
using namespace bristle_test;

namespace {

/// Strokes to and fro that begin at a time, with a rest after each.
struct Strokes {
  double begin = 0.503, speed = 0.2e-3, stroke = 0.4e-3, rest = 0.0;  // time s, speed m/s, length m, rest s
  double period() const { return stroke / std::abs(speed) + rest; }
  double operator()(double t) const {
    if (t < begin) return 0.0;
    const double k = std::floor((t - begin) / period()), since = t - begin - k * period();
    const double moved = std::min(std::abs(speed) * since, stroke);
    const double place = std::fmod(k, 2.0) == 0.0 ? moved : stroke - moved;
    return speed < 0.0 ? -place : place;
  }
};

/// Returns the CSV text of a record's time, load and force, without its position.
std::string force_csv(const RecordedFriction& r, double sign = 1.0) {
  std::string text = "t,load,force\n";
  for (std::size_t i = 0; i < r.t.size(); ++i)
    text += fmt::format("{},{},{}\n", r.t[i], r.load[i], sign * r.force[i]);
  return text;
}

/// Returns the CSV text of a separate logger of positions: `rate` rows a second, by a clock that is `ahead`
/// seconds ahead.
std::string motion_csv(const std::function<double(double)>& x, double from, double to, double rate,
                       double ahead = 0.0, double encoder = 0.0) {
  std::string text = "t [ms];x [um]\n";
  for (double t = from; t <= to; t += 1.0 / rate)
    text += fmt::format("{};{}\n", 1e3 * (t + ahead),
                        1e6 * (encoder > 0.0 ? encoder * std::round(x(t) / encoder) : x(t)));
  return text;
}

SyntheticFriction noisy(std::function<double(double)> motion) {
  SyntheticFriction s;
  s.noise = 0.01;
  s.motion = std::move(motion);
  return s;
}

std::string refused(const std::function<void()>& act) {
  try {
    act();
  } catch (const cli::UserError& error) {
    return error.what();
  }
  return {};
}

}  // namespace

TEST_CASE("Strokes at a stated speed need no position", "[fit][files]") {
  const struct {
    const char* what;
    Strokes motion;
    double sign, rate, begin;  // begin: time cut off at the record's start, s
  } cases[] = {{"from rest", {}, 1.0, 200.0, 0.0},
               {"on the body, from the far end", {0.503, -0.2e-3, 0.4e-3, 0.0}, -1.0, 200.0, 0.0},
               {"rests at both ends", {0.503, 0.2e-3, 0.4e-3, 0.7}, 1.0, 200.0, 0.0},
               {"the record begins in a stroke", {0.503, 0.2e-3, 0.4e-3, 0.0}, 1.0, 200.0, 1.8},
               {"few samples", {0.503, 0.2e-3, 0.4e-3, 0.0}, 1.0, 40.0, 0.0}};
  for (const auto& c : cases) {
    CAPTURE(c.what);
    SyntheticFriction s = noisy(c.motion);
    s.duration = 24.0;
    s.rate = 1000.0;  // so fast that turns fall between the record's rows
    s.every = static_cast<int>(s.rate / c.rate);
    RecordedFriction r = record(s, 7);
    const auto cut = static_cast<std::ptrdiff_t>(c.begin * c.rate);
    for (std::vector<double>* column : {&r.t, &r.x, &r.load, &r.force})
      column->erase(column->begin(), column->begin() + cut);
    cli::FitOptions options;
    options.quiet = true;
    options.reading.speed = c.motion.speed;
    options.reading.stroke = c.motion.stroke;
    const Fitted fitted = fit(force_csv(r, c.sign), options);
    // Tolerance: noise and few bristles shift a turn by up to 2 ms (0.4 um), coarse samples by 0.1 of one.
    double worst = 0.0;
    for (const cli::PathPoint& turn : fitted.data.columns.turns) {
      const double since = std::remainder(turn.t - c.motion.begin, c.motion.period());
      worst = std::max(
          worst,
          std::abs(c.motion.rest > 0.0 && since < -0.5 * c.motion.rest ? since + c.motion.rest : since));
    }
    CHECK(fitted.data.columns.turns.size() >= 8);
    CHECK(worst < 2e-3 + 0.1 / c.rate);
    check_recovered(fitted[cli::fit_kinetic], s.kinetic, 0.02 * s.kinetic);
    check_recovered(fitted[cli::fit_length], s.length, 0.06 * s.length);
    check_recovered(fitted[cli::fit_spread], s.spread, 0.1);
  }
}

TEST_CASE("Stated strokes that the force contradicts are refused", "[fit][files]") {
  SyntheticFriction s = noisy(Strokes{});
  s.rate = 100.0;
  const std::string text = force_csv(record(s, 3));
  const auto says = [&](std::optional<double> speed, std::optional<double> stroke, const std::string& csv) {
    cli::FitReading reading;
    reading.speed = speed;
    reading.stroke = stroke;
    return refused([&] { cli::parse_fit_columns(csv, "data.csv", reading); });
  };
  CHECK(says(0.2e-3, 0.4e-3, text).empty());
  CHECK_THAT(says(0.2e-3, 0.45e-3, text), Contains("data.csv: the force turns after ") &&
                                              Contains("--stroke 0.45 mm at --speed 0.2 mm/s takes 2.25 s"));
  CHECK_THAT(says(0.2e-3, 0.15e-3, text),
             Contains("takes 0.75 s (a rest at its end may take as long again)"));
  CHECK_THAT(says(0.2e-3, {}, text), Contains("the force has both signs") && Contains("--stroke"));
  for (const std::optional<double> speed : {std::optional<double>(), std::optional(0.0)})
    CHECK_THAT(says(speed, 0.4e-3, text), Contains("--stroke: needs the speed of the strokes, not 0"));
  CHECK_THAT(says(0.2e-3, 0.4e-3, "t,x,load,force\n0,0,1,1\n"), Contains("--speed stands for a column"));
  std::string one_way = "t,load,force\n";
  for (int i = 0; i < 100; ++i) one_way += fmt::format("{},2,{}\n", 0.1 * i, 0.7 + 0.01 * (i % 3));
  CHECK_THAT(says(0.2e-3, 0.4e-3, one_way), Contains("the force does not turn twice"));
}

TEST_CASE("Force and motion of two loggers are merged by time", "[fit][files]") {
  // The loggers of force and position differ in rate, begin and end; one clock is 100 s ahead.
  const struct {
    const char* what;
    int every;  // keeps one row of this many of the 1000 force rows a second
    double rate, ahead, encoder;
    // Largest error of a position, m: half of an encoder's count, or what a chord of the motion cuts off, 0.4
    // mm (pi / s)^2 (1 / rate)^2 / 8.
    double most_error;
  } cases[] = {{"a slow motion", 5, 50.0, 0.0, 0.0, 0.2e-6},
               {"a fast motion", 20, 1000.0, 100.0, 0.0, 1e-9},
               {"an encoder", 5, 1000.0, 0.0, 1e-6, 0.55e-6}};
  for (const auto& c : cases) {
    CAPTURE(c.what);
    SyntheticFriction s = noisy(loops_and_strokes);
    s.duration = 11.0;
    s.rate = 1000.0;
    s.every = c.every;
    const RecordedFriction r = record(s, 5);
    cli::FitReading reading;
    reading.position = "encoder.csv";
    reading.clock = -c.ahead;
    const cli::FitColumns merged = cli::merge_fit_columns(
        force_csv(r), "force.csv", motion_csv(loops_and_strokes, -0.5, 10.0, c.rate, c.ahead, c.encoder),
        reading);
    CHECK(merged.t.front() == 0.0);
    CHECK(merged.t.back() == Approx(10.0).margin(1.001e-3 * c.every + 1e-3));
    double worst = 0.0;
    for (std::size_t i = 0; i < merged.t.size(); ++i)
      worst = std::max(worst, std::abs(merged.x[i] - loops_and_strokes(merged.t[i])));
    CHECK(worst < c.most_error);
    Fitted fitted;
    fitted.data = cli::prepare_fit_data(merged, cli::ForceSign::automatic, {});
    cli::FitOptions options;
    options.quiet = true;
    fitted.result = cli::fit_material(fitted.data, options);
    check_recovered(fitted[cli::fit_kinetic], s.kinetic, 0.02 * s.kinetic);
    check_recovered(fitted[cli::fit_length], s.length, 0.1 * s.length);
    check_recovered(fitted[cli::fit_spread], s.spread, 0.1);
  }
}

TEST_CASE("Turns of a fast motion between the rows of a slow force are kept", "[fit][files]") {
  // Position is recorded as a triangle of 40 um at 4 Hz, force at 10 Hz; corners are at 0.125 s, 0.25 s etc.
  const auto motion = [](double t) { return 40e-6 * (2.0 / M_PI) * std::asin(std::sin(8.0 * M_PI * t)); };
  std::string force = "t,load,force\n";
  for (int i = 0; i < 50; ++i)
    force += fmt::format("{},2,{}\n", 0.1 * i, std::cos(0.8 * M_PI * i) > 0.0 ? 0.7 : -0.7);
  cli::FitReading reading;
  reading.position = "encoder.csv";
  const cli::FitColumns merged =
      cli::merge_fit_columns(force, "force.csv", motion_csv(motion, 0.0, 5.0, 1600.0), reading);
  REQUIRE(merged.turns.size() == 39);
  for (std::size_t k = 0; k < merged.turns.size(); ++k) {
    CHECK(merged.turns[k].t == Approx(0.0625 + 0.125 * static_cast<double>(k)).margin(1e-3));
    CHECK(merged.turns[k].x == Approx(k % 2 == 0 ? 40e-6 : -40e-6).epsilon(0.01));
  }
}

TEST_CASE("Two loggers that do not go together are refused", "[fit][files]") {
  const std::string force = "t,load,force\n0,2,0.5\n1,2,0.6\n2,2,0.7\n", motion = "t,x\n0,0\n2,1e-3\n";
  cli::FitReading reading;
  reading.position = "encoder.csv";
  const auto says = [&](const std::string& of_force, const std::string& of_motion) {
    return refused([&] { cli::merge_fit_columns(of_force, "force.csv", of_motion, reading); });
  };
  CHECK(says(force, motion).empty());
  CHECK_THAT(
      says(force, "t,x\n100,0\n102,1e-3\n"),
      Contains("force.csv: its rows, from 0 to 2 s, and those of encoder.csv, from 100 to 102 s, have no "
               "time in common") &&
          Contains("--clock"));
  CHECK_THAT(says("t,x,load,force\n0,0,2,0.5\n", motion), Contains("--position stands for a column"));
  CHECK_THAT(says(force, force), Contains("encoder.csv:1") && Contains("no column x"));
  CHECK_THAT(says(motion, motion), Contains("force.csv:1") && Contains("no column force"));
  CHECK_THAT(says(force, "t,x\n0,0\n"), Contains("encoder.csv: data rows: 1; --position needs two or more"));
  CHECK_THAT(says("t,load,force\n", motion), Contains("force.csv: no data rows"));
  reading.speed = 1e-3;
  CHECK_THAT(says(force, motion), Contains("--position and --speed together"));
  const TemporaryFolder folder;
  const std::string file = folder.write("force.csv", force);
  reading = {};
  reading.position = folder.write("encoder.csv", motion);
  CHECK_THAT(refused([&] {
               cli::read_fit_columns({file, file}, reading);
             }),
             Contains("one file of the force only"));
  reading.position.clear();
  reading.clock = 1.0;
  CHECK_THAT(refused([&] { cli::read_fit_columns({file}, reading); }),
             Contains("--clock: only with --position"));
}
