// `bristle fit`: data in the forms that people have (names, units, separators, several files, gaps) are read
// as intended, and the fit states how it read them.
#include <catch2/catch.hpp>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "tests/fit_helpers.hpp"
#include "tests/synthetic_friction.hpp"
#include "tests/temporary_folder.hpp"
#include "tools/libraries/files/motion_file.hpp"

namespace bristle_test::test_fit_reading {

using Catch::Matchers::Contains;

namespace {

struct Sample {
  double t, x, load, force;
};
/// Returns a record of sixty samples, 10 ms apart.
std::vector<Sample> samples() {
  std::vector<Sample> all;
  for (int i = 0; i < 60; ++i)
    all.push_back(
        {0.01 * i, 1e-3 * std::sin(0.3 * i), 2.0 + 0.25 * (i % 5), std::cos(0.3 * i) > 0.0 ? 0.5 : -0.75});
  return all;
}

std::string joined(const std::vector<std::string>& lines) {
  std::string all;
  for (const std::string& line : lines) all += line + '\n';
  return all;
}

std::string with_commas(std::string text) {
  for (char& c : text)
    if (c == '.') c = ',';
  return text;
}

std::string refused(const std::string& text, const cli::FitReading& reading = {}) {
  return bristle_test::message_of<cli::UserError>([&] { cli::parse_fit_columns(text, "data.csv", reading); });
}

/// Writes a record of strokes x(t), `rate` samples a second, under 2 N.
std::string strokes(double rate, double seconds, const std::function<double(double)>& x,
                    const std::function<double(double)>& force) {
  std::string text = "t,x,load,force\n";
  for (int i = 0; i < static_cast<int>(rate * seconds); ++i) {
    const double t = i / rate;
    text += fmt::format("{},{},2,{}\n", t, x(t), force(t));
  }
  return text;
}

}  // namespace

TEST_CASE("A record is the same in any separator, names, units and place of its header", "[fit][files]") {
  const std::vector<Sample> truth = samples();
  constexpr double gram_force = 9.80665e-3;
  const auto rows = [&](const char* format, double t, double x, double load, double force) {
    std::string text;
    for (const Sample& s : truth)
      text += fmt::format(fmt::runtime(format), s.t * t, s.x * x, s.load * load, s.force * force);
    return text;
  };
  using Names = std::vector<std::pair<std::string, std::string>>;
  const struct {
    std::string what, text;
    Names columns, units;
    const char* said;
  } cases[] = {
      {"plain", "t,x,load,force\n" + rows("{},{},{},{}\n", 1, 1, 1, 1), {}, {}, "SI where no unit is stated"},
      {"semicolons and decimal commas",
       "Zeit [ms];Weg [um];Last [N];Kraft [gf]\r\n" +
           with_commas(rows("{};{};{};{}\r\n", 1e3, 1e6, 1, 1 / gram_force)),
       {{"t", "Zeit"}, {"x", "Weg"}, {"n", "Last"}, {"f", "Kraft [gf]"}},
       {},
       "cells between semicolons; decimal commas"},
      {"tabs, other names, units in round brackets",
       "Time (s)\tPosition (mm)\tNormal force (mN)\tFriction force (uN)\n" +
           rows("{}\t{}\t{}\t{}\n", 1, 1e3, 1e3, 1e6),
       {{"t", "Time"}, {"x", "Position"}, {"load", "Normal force"}, {"force", "Friction force"}},
       {},
       "x = 'Position (mm)' in mm"},
      {"lines before the header and units below it",
       "Tribometer 3\nOperator: A, B\n\nrun;7\nt;x;load;force\ns;\xC2\xB5m;N;mN\n" +
           rows("{};{};{};{}\n", 1, 1e6, 1, 1e3),
       {},
       {},
       "lines before the header skipped; units from the row below the header; cells between semicolons"},
      {"a byte order mark and quotes",
       "\xEF\xBB\xBF\"t\",\"x\",\"load\",\"force\"\n" + rows("\"{}\",\"{}\",\"{}\",\"{}\"\n", 1, 1, 1, 1),
       {},
       {},
       "t, x, load, force"},
      {"blanks", "t  x load   force\n" + rows(" {}  {} {} {}\n", 1, 1, 1, 1), {}, {}, "cells between blanks"},
      {"units from the command line",
       "t,x,load,force\n" + rows("{},{},{},{}\n", 1e3, 1e6, 1, 1 / gram_force),
       {},
       {{"t", "ms"}, {"x", "um"}, {"force", "gf"}},
       "t in ms, x in um, load, force in gf"},
      {"units after an underscore",
       "t_ms,position_um,load_N,force_N\n" + rows("{},{},{},{}\n", 1e3, 1e6, 1, 1),
       {{"x", "position"}},
       {},
       "x = 'position_um' in um"},
  };
  for (const auto& c : cases) {
    CAPTURE(c.what);
    cli::FitReading reading;
    reading.columns = c.columns;
    reading.units = c.units;
    const cli::FitColumns read = cli::parse_fit_columns(c.text, "data.csv", reading);
    CHECK_THAT(joined(read.understood), Contains(c.said));
    REQUIRE(read.t.size() == truth.size());
    double worst = 0.0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
      worst = std::max({worst, std::abs(read.t[i] - truth[i].t), std::abs(read.x[i] - truth[i].x) / 1e-3,
                        std::abs(read.load[i] - truth[i].load), std::abs(read.force[i] - truth[i].force)});
    }
    CHECK(worst < 1e-12);
    CHECK(read.replayable == (c.what == "plain"));
  }
}

TEST_CASE("Each common mistake in a file has a message that says what to do", "[fit][files]") {
  const std::string row = "0,0,1,1\n";
  CHECK_THAT(refused("0,0,1,1\n1,1,1,1\n"),
             Contains("data.csv:1") && Contains("holds numbers") && Contains("add a header"));
  CHECK_THAT(refused("t,x,load,force\n0,5,0,1,1,0,1\n"),
             Contains("data.csv:2") && Contains("decimal commas?"));
  CHECK_THAT(refused("t,x,load,force\n12:30:01.5,0,1,1\n"),
             Contains("data.csv:2") && Contains("'12:30:01.5' is a time of day"));
  for (const char* text :
       {",t,x,load,force\n7,0,0,1,5\n8,1,0,1,5\n", "t,x,load,force,\n0,0,1,5,\n1,0,1,5,\n"})
    CHECK(cli::parse_fit_columns(text, "data.csv").force[1] == 5.0);
  const cli::FitColumns inches =
      cli::parse_fit_columns("t,x [inch],load [lbf],force [kip]\n0,1,2,3\n", "data.csv");
  CHECK(inches.x[0] == Approx(0.0254));
  CHECK(inches.load[0] == Approx(2.0 * 4.4482216152605));
  CHECK(inches.force[0] == Approx(3000.0 * 4.4482216152605));
  CHECK_THAT(refused("t,place,load,force\n" + row), Contains("no column x") && Contains("--columns x=NAME"));
  CHECK_THAT(refused("Time,x,load,force\n" + row), Contains("no column t") && Contains("--columns t=NAME"));
  cli::FitReading named;
  named.columns = {{"x", "Posn"}};
  CHECK_THAT(refused("t,Position,load,force\n" + row, named),
             Contains("no column 'Posn' for x; the columns are 't', 'Position', 'load', 'force'"));
  named.columns = {{"place", "Position"}};
  CHECK_THAT(refused("t,x,load,force\n" + row, named),
             Contains("--columns: 'place' is no column of a record"));
  cli::FitReading unit;
  unit.units = {{"force", "kg"}};
  CHECK_THAT(refused("t,x,load,force\n" + row, unit), Contains("unit of force is 'kg'; allowed: N, mN"));
  CHECK_THAT(refused("t,x,load,force\n0,0,-0.01,1\n1,0,1,1\n"), Contains("--clip-load"));
  CHECK_THAT(
      refused(",t,x,load\n1,0,0,1\n"),
      Contains("no force was measured") && Contains("column 1 has no name: give it one in the header"));
  CHECK_THAT(refused("0\t0\t1\t1\t\n1\t1\t1\t1\t\n"), Contains("holds numbers"));
  CHECK_THAT(refused("x,load,force\n0,1,1\n"), Contains("--rate 100Hz"));
  const std::string milliseconds = "t,x,load,force\n0,0,1,1\n10,0,1,1\n20,0,1,1\n";
  CHECK_THAT(joined(cli::parse_fit_columns(milliseconds, "data.csv").understood),
             Contains("10 s apart; if these are ms, give --units t=ms"));
  const TemporaryFolder folder;
  const std::string wide = folder.write("wide.csv", std::string("\xFF\xFEt\0,\0x\0", 8));
  CHECK_THROWS_WITH(cli::read_fit_columns({wide}, {}), Contains("UTF-16; save it as UTF-8"));
  CHECK_THROWS_WITH(cli::read_fit_columns({folder.write("a.json", "{}")}, {}),
                    Contains("is JSON, not CSV") && Contains("pandas.read_json"));
  CHECK_THROWS_WITH(cli::read_fit_columns({folder.write("a.mat", "MATLAB 5.0")}, {}), Contains("loadmat"));
}

TEST_CASE("What a record lacks is taken from what is stated, each in a line", "[fit][files]") {
  SECTION("a sampling rate in place of times") {
    cli::FitReading reading;
    reading.rate = 50.0;
    const cli::FitColumns read = cli::parse_fit_columns("x,load,force\n0,1,1\n1,1,1\n", "data.csv", reading);
    CHECK(read.t[1] == Approx(0.02));
    CHECK_THAT(refused("t,x,load,force\n0,0,1,1\n", reading), Contains("--rate is for files without time"));
  }
  SECTION("speeds of a turning body") {
    cli::FitReading reading;
    reading.radius = 0.01;
    const auto speed = [&](const char* unit) {
      return cli::parse_fit_columns(fmt::format("t,speed [{}],load,force\n0,60,1,1\n1,60,1,1\n", unit),
                                    "data.csv", reading);
    };
    CHECK(speed("rpm").v[0] == Approx(2.0 * M_PI * 0.01));
    CHECK(speed("deg/s").v[0] == Approx(M_PI / 3.0 * 0.01));
    CHECK(speed("rad/s").v[0] == Approx(0.6));
    CHECK_THAT(refused("t,v [rpm],load,force\n0,60,1,1\n"), Contains("column v needs the radius"));
  }
  SECTION("loads that are all negative") {
    const cli::FitColumns read = cli::parse_fit_columns("t,x,load,force\n0,0,-2,1\n1,1,-3,1\n", "data.csv");
    CHECK(read.load == std::vector<double>{2.0, 3.0});
    CHECK_THAT(joined(read.understood), Contains("taken with the other sign"));
  }
  SECTION("a speed in mm/min") {
    const cli::FitColumns read =
        cli::parse_fit_columns("t,v [mm/min],load,force\n0,60,1,1\n1,60,1,1\n", "data.csv");
    CHECK(read.v[1] == Approx(1e-3));
    CHECK(read.x[1] == Approx(1e-3));
  }
  SECTION("negative loads clipped when asked") {
    cli::FitReading reading;
    reading.clip_load = 0.02;
    const std::string text = "t,x,load,force\n0,0,-0.01,1\n1,1,1,1\n";
    const cli::FitColumns read = cli::parse_fit_columns(text, "data.csv", reading);
    CHECK(read.load[0] == 0.0);
    CHECK_THAT(joined(read.understood), Contains("1 negative loads, down to -0.01 N, taken as 0"));
    reading.clip_load = 0.0099;
    CHECK_THAT(refused(text, reading), Contains("allowed: -0.0099 N or more (--clip-load)"));
    // A load below the limit is refused where the loads before it press.
    reading.clip_load = 0.005;
    CHECK_THAT(refused("t,x,load,force\n0,0,1,1\n1,1,-0.01,1\n", reading), Contains("-0.01 is negative"));
  }
  SECTION("a wild row of the first file leaves the second where it begins") {
    const auto file = [](const char* name, bool wild) {
      std::string text = "t,x,load,force\n";
      for (int i = 0; i < 100; ++i)
        text += fmt::format("{},{:.9f},2,{}\n", 0.01 * i, 1e-3 * std::sin(0.2 * i),
                            wild && i == 3            ? 90.0
                            : std::cos(0.2 * i) > 0.0 ? 0.6
                                                      : -0.6);
      return cli::parse_fit_columns(text, name);
    };
    const cli::FitData data =
        cli::prepare_fit_data(cli::join_fit_columns({file("a.csv", true), file("b.csv", false)}), {}, {});
    CHECK(data.samples() == 199);
    CHECK(data.columns.parts == std::vector<std::size_t>{99});
  }
  SECTION("a tribometer's names and grams") {
    cli::FitReading reading;
    reading.columns = {{"t", "Time"}, {"load", "Normal"}, {"x", "Position"}, {"force", "Friction"}};
    const cli::FitColumns read = cli::parse_fit_columns(
        "Time [s]\tNormal [uN]\tPosition [mm]\tFriction [g]\n0\t5e6\t1\t50\n1\t5e6\t2\t60\n", "data.txt",
        reading);
    CHECK(read.load[0] == Approx(5.0));
    CHECK(read.force[1] == Approx(60e-3 * 9.80665));
    CHECK_THAT(joined(read.understood), Contains("column Friction [g]: g is taken as gram-force"));
    CHECK_THAT(joined(cli::parse_fit_columns("t,x,load,force\n0,0,1,1\n", "data.csv").understood),
               !Contains("gram-force"));
  }
  SECTION("torque and angle of a ring") {
    cli::FitReading reading;
    const std::string text = "t,angle [deg],load,torque [mN m]\n0,0,1,10\n1,90,1,20\n";
    CHECK_THAT(refused(text), Contains("--radius"));
    reading.radius = 0.02;
    const cli::FitColumns read = cli::parse_fit_columns(text, "data.csv", reading);
    CHECK(read.x[1] == Approx(0.5 * M_PI * 0.02));
    CHECK(read.force[1] == Approx(1.0));
    CHECK_THAT(joined(read.understood), Contains("at a radius of 20 mm"));
    CHECK_THAT(refused("t,x,load,force\n0,0,1,1\n", reading),
               Contains("--radius is for columns angle and torque"));
  }
  SECTION("a constant load") {
    const std::string text = strokes(
        100, 1, [](double t) { return 1e-3 * std::sin(20.0 * t); },
        [](double t) { return std::cos(20.0 * t) > 0.0 ? 0.7 : -0.7; });
    const cli::FitData data = cli::prepare_fit_data(cli::parse_fit_columns(text, "a.csv"), {}, 3.0);
    CHECK(data.mean_load == 3.0);
    CHECK_THAT(joined(data.columns.understood), Contains("load of 3 N throughout, as given"));
  }
}

TEST_CASE("The inertia of a mass that moves with the sensor is taken off the force", "[fit][files]") {
  // The measured mass shakes by 1 mm at 5 Hz, at up to 0.99 m/s^2. Its inertia force is 0.49 N for half a
  // kilogram, beside a friction of 0.7 N.
  const double w = 2.0 * M_PI * 5.0, mass = 0.5, amplitude = 1e-3;
  const auto position = [&](double t) { return amplitude * std::sin(w * t); };
  const auto friction = [&](double t) { return std::cos(w * t) > 0.0 ? 0.7 : -0.7; };
  for (const double sign : {1.0, -1.0}) {
    const std::string text = strokes(1000, 2, position, [&](double t) {
      return sign * (friction(t) - mass * amplitude * w * w * std::sin(w * t));
    });
    const cli::FitData data =
        cli::prepare_fit_data(cli::parse_fit_columns(text, "a.csv"), cli::ForceSign::automatic, {}, mass);
    CHECK(data.sign == (sign > 0.0 ? cli::ForceSign::by_body : cli::ForceSign::on_body));
    // The program computes acceleration by second differences over dt = 1 ms, with a relative error of (w
    // dt)^2 / 12. The first and last sample have one-sided differences and are left out here.
    double worst = 0.0;
    for (std::size_t i = 1; i + 1 < data.samples(); ++i)
      worst = std::max(worst, std::abs(data.force[i] - friction(data.columns.t[i])));
    CHECK(worst < 0.001);
    CHECK_THAT(joined(data.columns.understood),
               Contains("inertia of 0.5 kg taken off the force: up to 0.49"));
  }
}

TEST_CASE("Several files are one record of contacts that remember nothing of each other", "[fit][files]") {
  SyntheticFriction s;
  s.rate = 100.0;
  s.noise = 0.01;
  s.duration = 5.0;
  s.motion = loops_and_strokes;
  const RecordedFriction first = record(s, 3);
  s.motion = [](double t) { return 5e-3 + loops_and_strokes(t + 3.0); };
  const RecordedFriction second = record(s, 4);
  // Third file of a record, which begins in the middle of a slide, with bent bristles.
  s.motion = [](double t) { return 1e-3 * std::fmin(t, 3.0) - 0.5e-3 * std::fmax(t - 3.0, 0.0); };
  RecordedFriction third = record(s, 5);
  for (std::vector<double>* column : {&third.t, &third.x, &third.load, &third.force})
    column->erase(column->begin(), column->begin() + 100);
  const auto parse = [](const RecordedFriction& r, const char* name) {
    return cli::parse_fit_columns(r.csv(), name);
  };
  const cli::FitColumns all =
      cli::join_fit_columns({parse(first, "a.csv"), parse(second, "b.csv"), parse(third, "c.csv")});
  CHECK(all.parts == std::vector<std::size_t>{500, 1000});
  CHECK(all.t[500] > all.t[499]);
  CHECK(all.t[1001] - all.t[1000] == Approx(0.01));
  CHECK_THAT(joined(all.understood), Contains("3 files as one record (2 clocks start anew and are joined)"));
  Fitted fitted;
  fitted.data = cli::prepare_fit_data(all, cli::ForceSign::automatic, {});
  // Checks that the distance from one file's end to the next one's start does not count as motion.
  CHECK(fitted.data.range < 2.5e-3);
  CHECK(fitted.data.travelled < 0.012);
  cli::FitOptions options;
  options.quiet = true;
  fitted.result = cli::fit_material(fitted.data, options);
  check_recovered(fitted[cli::fit_kinetic], s.kinetic, 0.02 * s.kinetic);
  check_recovered(fitted[cli::fit_length], s.length, 0.15 * s.length);
  CHECK(fitted.result.past.of_part(0) == cli::StartState::straight);
  CHECK(fitted.result.past.of_part(1) == cli::StartState::straight);
  CHECK(fitted.result.past.of_part(2) == cli::StartState::forward);
  // The fitted curve begins in the second file with a straight brush and nearly no force, although the first
  // file ends with a large one.
  CHECK(std::abs(fitted.result.curve[500]) < 0.1);
  CHECK(std::abs(fitted.result.curve[499]) > 0.5);
  CHECK(std::abs(fitted.result.curve[1000]) > 0.6);
  CHECK_THROWS_WITH(
      cli::join_fit_columns({parse(first, "a.csv"), cli::parse_fit_columns("t,x,force\n0,0,1\n", "d.csv")}),
      Contains("d.csv: its columns") && Contains("are not those of"));
}

TEST_CASE("A replay of data in words of their own reads the motion that was understood", "[fit][files]") {
  SyntheticFriction s;
  s.rate = 100.0;
  s.noise = 0.01;
  s.motion = loops_and_strokes;
  const RecordedFriction r = record(s, 3);
  std::string text = "Zeit;Weg;Kraft\n";
  for (std::size_t i = 0; i < r.t.size(); ++i)
    text += with_commas(fmt::format("{};{};{}\n", r.t[i], 1e6 * r.x[i], r.force[i]));
  cli::FitOptions options;
  options.reading.columns = {{"t", "Zeit"}, {"x", "Weg"}, {"force", "Kraft"}};
  options.reading.units = {{"x", "um"}};
  options.load = 2.0;
  options.write = "out/fitted.toml";
  options.quiet = true;
  const cli::FitData data = cli::prepare_fit_data(cli::parse_fit_columns(text, "data.csv", options.reading),
                                                  options.sign, options.load);
  const cli::FitResult result = cli::fit_material(data, options);
  const std::string scene = cli::fit_toml(data, options, result);
  CHECK_THAT(scene, Contains("type = \"trace\"") && Contains("file = 'fitted_motion.csv'") &&
                        Contains("load = 2  # N"));
  const cli::MotionFile motion = cli::parse_motion_file(cli::fit_motion(data), "fitted_motion.csv");
  REQUIRE(motion.rows.size() == r.t.size());
  CHECK(motion.rows[700].x == Approx(r.x[700]));
  // Checks that the printed table states how the fit has read the data.
  CHECK_THAT(cli::fit_table(data, result),
             Contains("read") && Contains("x = 'Weg' in um") && Contains("load of 2 N throughout"));
}

}  // namespace bristle_test::test_fit_reading
