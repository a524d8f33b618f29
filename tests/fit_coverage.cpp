// Counts the 95 % intervals of `bristle fit` that hold the true value, for
// tools/libraries/fitting/VALIDATION.md. It repeats experiments made by brute force; a run can be stopped,
// resumed, and shared between machines:
//
//   bristle_fit_coverage run JOURNAL [--repeats 200] [--cells TEXT] [--shard i/N]
//   bristle_fit_coverage table JOURNAL...
//   bristle_fit_coverage record CELL REPEAT    prints the record of a repeat as CSV
//
// A repeat depends on its cell and its number alone. A journal has one line for each finished fit, and `run`
// makes the fits that its journal lacks; another version of the fit needs another journal file.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <functional>
#include <map>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "tests/brute_rubbing.hpp"
#include "tests/made_up_joint.hpp"
#include "tests/sliding_springs.hpp"
#include "tests/synthetic_friction.hpp"
#include "tools/libraries/fitting/fit.hpp"

using namespace bristle_test;
using bristle::SnapRule;

namespace {

/// True parameters by name, which a fit of one record should find; a NaN is not checked.
using Truth = std::map<std::string, double>;
struct Cell {
  std::string name;
  SnapRule rule = SnapRule::redraw;
  std::function<std::string(std::uint64_t seed)> record;
  std::function<Truth(const cli::FitResult&)> truth;
  cli::FitReading reading = {};
  bool joint = false;            ///< Whether the record is the log of a robot joint instead of a contact.
  std::uint64_t first_seed = 0;  ///< seed of the first repeat; no other cell uses the seeds from there on
};

/// Returns the settings of the usual experiment: ten seconds at 50 Hz, noise of 10 mN, 1800 bristles.
SyntheticFriction usual() {
  SyntheticFriction s;
  s.motion = loops_and_strokes;
  s.noise = 0.01;
  s.every = 4;
  return s;
}

Truth brush_truth(const SyntheticFriction& s) {
  const double bend = 0.5 * (1.0 + s.spread * s.spread) * s.length;
  Truth truth{{"kinetic", s.kinetic},
              {"presliding_length", s.length},
              {"spread", s.spread},
              {"sensor_offset", s.drift(0.5 * s.duration)},
              {"viscous_friction", s.viscous},
              {"damping_per_newton", s.damping},
              {"residual_share", 0.0},
              {"shared_renewal", 0.0}};
  truth["sensor_drift"] = (s.drift(s.duration) - s.drift(0.0)) / s.duration;
  truth["stiffness_per_newton"] = s.kinetic / bend;
  if (s.damping > 0.0) truth["stribeck_velocity"] = s.stribeck;
  return truth;
}

Cell cell_of(const std::string& name, SyntheticFriction s, SnapRule rule = SnapRule::redraw) {
  return {name, rule, [s](std::uint64_t seed) { return record(s, seed).csv(); },
          [s](const cli::FitResult&) { return brush_truth(s); }};
}

void add_plain(std::vector<Cell>& cells) {
  const std::string prefix = "redraw, ";
  SyntheticFriction drift = usual(), encoder = usual(), strokes = usual(), loops = usual(), swings = usual();
  drift.drift = [](double t) { return 0.03 + 0.004 * (t - 5.0); };
  encoder.encoder = 1e-6;
  strokes.motion = [](double t) {
    return 0.4e-3 * std::sin(M_PI * t) * std::pow(std::min((t + 0.5) / 6.0, 1.0), 1.5);
  };
  loops.motion = [](double t) { return 12e-6 * t / 10.0 * std::sin(2.0 * M_PI * 1.5 * t); };
  swings.motion = [](double t) { return 4e-6 * t * std::sin(2.0 * M_PI * 0.7 * t); };
  cells.push_back(cell_of(prefix + "loops and strokes, offset and drift", drift));
  cells.push_back(cell_of(prefix + "strokes only", strokes));
  cells.push_back(cell_of(prefix + "swings that grow to 40 um", swings));
  cells.push_back(cell_of(prefix + "loops of up to 12 um only", loops));
  cells.push_back(cell_of(prefix + "loops and strokes, encoder of 1 um", encoder));
}

/// Makes a cell (a kind of experiment) with viscous friction and a damper that has a Stribeck velocity.
Cell lubricated() {
  SyntheticFriction s = usual();
  s.every = 2;
  s.viscous = 100.0;
  s.damping = 400.0;
  s.stribeck = 0.2e-3;
  return cell_of("redraw, lubricant and damper", s);
}

/// Makes a cell (a kind of experiment) with the torque of a full disc that turns about its middle.
Cell disc() {
  constexpr double radius = 0.02;
  SyntheticFriction s = usual();
  s.annuli = 60;
  s.viscous = 60.0;
  s.drift = [](double t) { return 0.03 + 0.004 * (t - 5.0); };
  Cell cell = cell_of("redraw, torque of a disc, lubricant, offset and drift", s);
  cell.record = [s](std::uint64_t seed) { return record(s, seed).disc_csv(radius); };
  cell.reading.radius = radius;
  cell.reading.disc = true;
  return cell;
}

Cell rubbed() {
  const RubbedStrokes s;
  return {"redraw, rubbed (residual, shared renewal)", SnapRule::redraw,
          [s](std::uint64_t seed) { return s.csv(seed); },
          [s](const cli::FitResult&) {
            return Truth{
                {"kinetic", s.kinetic},        {"presliding_length", s.length + s.residual},
                {"spread", s.spread},          {"residual_share", s.residual / (s.length + s.residual)},
                {"shared_renewal", s.renewal}, {"sensor_offset", 0.0},
                {"sensor_drift", 0.0}};
          }};
}

Cell slides(const std::string& name, const SlidingSprings& s) {
  return {"slide, " + name, SnapRule::slide,
          [s](std::uint64_t seed) { return s.csv(static_cast<unsigned>(seed)); },
          [s](const cli::FitResult&) {
            Truth truth{{"kinetic", s.kinetic},    {"presliding_length", s.mean_limit()},
                        {"spread", s.spread},      {"sensor_offset", s.offset},
                        {"sensor_drift", 0.0},     {"stiffness_per_newton", s.kinetic / s.mean_limit()},
                        {"viscous_friction", 0.0}, {"damping_per_newton", 0.0}};
            return truth;
          }};
}

void add_slide(std::vector<Cell>& cells) {
  SlidingSprings both, strokes;
  strokes.motion = [](double t) { return 60e-6 * std::sin(M_PI * t); };
  cells.push_back(slides("loops and strokes", both));
  cells.push_back(slides("strokes only", strokes));
}

/// Makes a cell (a kind of experiment) in the plane: the motion is a spiral that opens to 60 um.
Cell plane() {
  const double kinetic = 0.35, length = 15e-6, spread = 0.4;
  const auto make = [=](std::uint64_t seed) {
    BruteForcePatch brush(1800, lognormal_quantile(length, spread), true, seed);
    const double bend = 0.5 * length * (1.0 + spread * spread), load = 2.0;
    std::mt19937_64 generator(seed + 1);
    std::normal_distribution<double> noise(0.0, 0.01);
    std::string csv = "t,x,y,load,fx,fy\n";
    double x = 0.0, y = 0.0;
    for (int i = 0; i < 500; ++i) {
      const double t = 0.016 * i, radius = 60e-6 * t / 8.0, angle = 2.0 * M_PI * 1.1 * t;
      const double next_x = radius * std::cos(angle), next_y = 0.6 * radius * std::sin(angle);
      const BruteStep step = brush.step(next_x - x, next_y - y);
      x = next_x;
      y = next_y;
      const double drift = 0.003 * (t - 0.016 * 249.5);
      csv += fmt::format("{},{},{},{},{},{}\n", t, x, y, load,
                         kinetic * load * step.end_x / bend + 0.02 + drift + noise(generator),
                         kinetic * load * step.end_y / bend - 0.03 - drift + noise(generator));
    }
    return csv;
  };
  return {"redraw, in the plane, offsets and drifts", SnapRule::redraw, make, [=](const cli::FitResult&) {
            return Truth{{"kinetic", kinetic},      {"presliding_length", length}, {"spread", spread},
                         {"sensor_offset", 0.02},   {"sensor_drift", 0.003},       {"sensor_offset_y", -0.03},
                         {"sensor_drift_y", -0.003}};
          }};
}

/// Makes a cell (a kind of experiment) with a joint, six of whose thirteen parameters are not zero.
Cell joint() {
  Cell cell;
  cell.name = "joint, 6 s at 1 kHz";
  cell.joint = true;
  return cell;
}

std::vector<Cell> all_cells() {
  std::vector<Cell> cells;
  add_plain(cells);
  cells.push_back(lubricated());
  cells.push_back(rubbed());
  cells.push_back(plane());
  cells.push_back(disc());
  add_slide(cells);
  cells.push_back(joint());
  for (std::size_t i = 0; i < cells.size(); ++i) cells[i].first_seed = 1000 + 1000000 * i;
  return cells;
}

/// A line of a journal: kind of experiment (cell), number of its repeat, then name, value, lower and upper
/// end of the interval and true value of each fitted number.
struct Line {
  std::string cell;
  int repeat = 0;
  struct Number {
    std::string name;
    double value, low, high, truth;
  };
  std::vector<Number> numbers;
};

/// Reads the whole lines of a journal; the last one may be cut off because the run was killed.
std::vector<Line> read_journal(const std::string& name) {
  std::vector<Line> lines;
  std::ifstream file(name);
  for (std::string text; std::getline(file, text);) {
    if (text.size() < 2 || text.substr(text.size() - 2) != "|.") continue;
    std::istringstream parts(text);
    Line line;
    std::string field;
    std::getline(parts, line.cell, '|');
    std::getline(parts, field, '|');
    line.repeat = std::atoi(field.c_str());
    Line::Number number;
    while (std::getline(parts, number.name, '|') && number.name != ".") {
      std::getline(parts, field, '|');
      if (std::sscanf(field.c_str(), "%lg %lg %lg %lg", &number.value, &number.low, &number.high,
                      &number.truth) == 4)
        line.numbers.push_back(number);
    }
    lines.push_back(std::move(line));
  }
  return lines;
}

/// Fits the log of a joint. Returns name, value, interval and true value of each fitted number.
std::string fitted_joint(unsigned seed) {
  const cli::JointFit fit = cli::fit_joint(made_up_log(6.0, seed));
  const bristle::JointMaterial gear = made_up_gear(seed);
  std::string line;
  for (std::size_t i = 0; i < fit.numbers.size(); ++i) {
    const cli::JointEstimate& e = fit.numbers[i];
    const double truth = i == 0 ? made_up_inertia : (&gear.stiffness)[i - 1];
    if (e.determined)
      line += fmt::format("{}|{:.9g} {:.9g} {:.9g} {:.9g}|", e.name, e.value, e.low, e.high, truth);
  }
  return line;
}

std::uint64_t seed_of(const Cell& cell, int repeat) {
  return cell.first_seed + 10 * static_cast<std::uint64_t>(repeat);
}

std::string fitted_line(const Cell& cell, int repeat) {
  if (cell.joint)
    return fmt::format("{}|{}|{}.\n", cell.name, repeat,
                       fitted_joint(static_cast<unsigned>(seed_of(cell, repeat))));
  cli::FitOptions options;
  options.rule = cell.rule;
  options.quiet = true;
  const cli::FitData data = cli::prepare_fit_data(
      cli::parse_fit_columns(cell.record(seed_of(cell, repeat)), "data.csv", cell.reading), options.sign,
      options.load);
  const cli::FitResult result = cli::fit_material(data, options);
  std::string line = fmt::format("{}|{}|", cell.name, repeat);
  for (const auto& [name, truth] : cell.truth(result)) {
    for (std::size_t i = 0; i < cli::fit_report_rows; ++i) {
      if (name != cli::fit_name(i)) continue;
      const cli::FitEstimate& e = cli::report_estimate(result, i);
      if (e.fitted)
        line += fmt::format("{}|{:.9g} {:.9g} {:.9g} {:.9g}|", name, e.value, e.low, e.high, truth);
    }
  }
  return line + ".\n";
}

void run(const std::string& journal, int repeats, const std::string& only, int part, int parts) {
  std::set<std::pair<std::string, int>> done;
  for (const Line& line : read_journal(journal)) done.insert({line.cell, line.repeat});
  std::ofstream out(journal, std::ios::app);
  if (!out) throw std::runtime_error(journal + ": cannot be written");
  out << '\n';  // ends a line of the journal that a killed run may have left unfinished
  const std::vector<Cell> cells = all_cells();
  for (int repeat = part - 1; repeat < repeats; repeat += parts) {
    for (const Cell& cell : cells) {
      if (cell.name.find(only) == std::string::npos || done.count({cell.name, repeat})) continue;
      out << fitted_line(cell, repeat) << std::flush;
    }
    std::fprintf(stderr, "\rrepeat %d of %d", repeat + 1, repeats);
  }
  std::fprintf(stderr, "\n");
}

/// Returns the 95 % interval of a share that was observed as `held` of `count`, by Wilson's formula.
std::pair<double, double> share_interval(int held, int count) {
  const double n = count, p = held / n, z = 1.96, z2 = z * z;
  const double middle = (p + z2 / (2.0 * n)) / (1.0 + z2 / n);
  const double width = z / (1.0 + z2 / n) * std::sqrt(p * (1.0 - p) / n + z2 / (4.0 * n * n));
  return {middle - width, middle + width};
}

/// Prints the table of experiments as Markdown. Marks shares whose own 95 % interval lies outside 90 to 98 %.
void print_table(const std::vector<std::string>& journals) {
  struct Sums {
    int count = 0, held = 0, low = 0;
    double value = 0.0, truth = 0.0, half = 0.0;
  };
  std::map<std::string, std::map<int, Line>> cells;
  for (const std::string& journal : journals)
    for (Line& line : read_journal(journal)) cells[line.cell].insert({line.repeat, line});
  std::printf(
      "| record | number | truth | mean | half width | intervals that hold | "
      "|\n|---|---|---|---|---|---|---|\n");
  for (const Cell& cell : all_cells()) {
    const auto found = cells.find(cell.name);
    if (found == cells.end()) continue;
    std::map<std::string, Sums> sums;
    for (const auto& [repeat, line] : found->second) {
      for (const Line::Number& n : line.numbers) {
        Sums& s = sums[n.name];
        ++s.count;
        s.held += n.low <= n.truth && n.truth <= n.high ? 1 : 0;
        s.low += n.high < n.truth ? 1 : 0;
        s.value += n.value;
        s.truth += n.truth;
        s.half += 0.5 * (n.high - n.low);
      }
    }
    for (const auto& [name, s] : sums) {
      const auto [low, high] = share_interval(s.held, s.count);
      const char* verdict = high < 0.90 ? "too narrow" : low > 0.98 ? "too wide" : "";
      const int repeats = static_cast<int>(found->second.size());
      const std::string times = s.count < repeats ? fmt::format(", found in {} of {}", s.count, repeats) : "";
      std::printf("| %s | %s | %.4g | %.4g | %.2g | %d of %d, %.0f %% (%.0f to %.0f)%s | %s |\n",
                  cell.name.c_str(), name.c_str(), s.truth / s.count, s.value / s.count, s.half / s.count,
                  s.held, s.count, 100.0 * s.held / s.count, 100.0 * low, 100.0 * high, times.c_str(),
                  verdict);
    }
  }
}

int usage() {
  std::fprintf(stderr,
               "bristle_fit_coverage run JOURNAL [--repeats 200] [--cells TEXT] [--shard i/N]\n"
               "bristle_fit_coverage table JOURNAL...\n"
               "bristle_fit_coverage record CELL REPEAT\n");
  return 2;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 3) return usage();
  const std::string command = argv[1];
  if (command == "table") {
    print_table({argv + 2, argv + argc});
    return 0;
  }
  if (command == "record" && argc == 4) {
    for (const Cell& cell : all_cells())
      if (!cell.joint && cell.name.find(argv[2]) != std::string::npos)
        std::fputs(cell.record(seed_of(cell, std::atoi(argv[3]))).c_str(), stdout);
    return 0;
  }
  if (command != "run") return usage();
  int repeats = 200, part = 1, parts = 1;
  std::string only;
  for (int i = 3; i < argc; i += 2) {
    const std::string option = argv[i];
    if (i + 1 == argc) return usage();
    if (option == "--repeats") {
      repeats = std::atoi(argv[i + 1]);
    } else if (option == "--cells") {
      only = argv[i + 1];
    } else if (option != "--shard" || std::sscanf(argv[i + 1], "%d/%d", &part, &parts) != 2) {
      return usage();
    }
  }
  if (repeats < 1 || part < 1 || part > parts) return usage();
  run(argv[2], repeats, only, part, parts);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "bristle_fit_coverage: %s\n", error.what());
  return 1;
}
