#include "tools/libraries/stability/stability.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <mutex>
#include <thread>

#include <bristle/deadline_monitor.hpp>
#include <bristle/error.hpp>

#include "tools/libraries/files/output_file.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/reports/jobs.hpp"
#include "tools/libraries/reports/progress.hpp"
#include "tools/libraries/reports/text_layout.hpp"

namespace cli {
namespace {

constexpr double mass_kg = 0.1, dt_s = 1e-3, mean_snap_length_m = 1e-5;
constexpr double push = 0.3;  // initial amplitude of sticking runs, in mean snap lengths

// Distance, in mean snap lengths, in which friction alone brakes the mass of a sliding run to rest. The run's
// initial speed follows from it.
constexpr double slide = 20.0;
constexpr double encoder_quantum = 0.1;  // count of the encoder, in mean snap lengths

// Returns values of a map's axis in geometric progression that avoid round numbers. The theoretical limits k
// = c and k = 2 c then lie between cells, and c = 1, which stops a mass in one step, is avoided.
std::vector<double> axis_values(double from, double to, int per_decade, double offset) {
  std::vector<double> values;
  for (int i = 0;; ++i) {
    const double value = from * std::pow(10.0, (i + offset) / per_decade);
    if (value > to * 1.0001) return values;
    values.push_back(value);
  }
}

int severity(const LoopResult& r) {
  return r.unbounded ? 3 : r.verdict == Verdict::rings ? 2 : r.verdict == Verdict::grows ? 1 : 0;
}

double beta_of(Scheme scheme, double second) { return is_device(scheme) ? second : 0.0; }
double c_of(Scheme scheme, double second) { return is_device(scheme) ? 0.0 : second; }

}  // namespace

Why why_of(const MapCell& cell, Scheme scheme, double steps) {
  if ((cell.verdict == Verdict::settles) == cell.linear_stable) return Why::agree;
  const double c = c_of(scheme, cell.second), beta = beta_of(scheme, cell.second);
  if (!is_implicit(scheme)) {
    const double radius = linear_radius(scheme, cell.k, c, beta);
    if (std::fabs(std::pow(radius, steps / 4.0) - 1.0) < 0.05) return Why::at_the_limit;
  }
  if (!cell.linear_stable) return Why::snaps_damp;
  if (!is_implicit(scheme) && sliding_radius(scheme, c, beta) > 1.0) return Why::damper_in_sliding;
  if (scheme == Scheme::device) return Why::encoder;
  if (cell.sticking.verdict == Verdict::settles) return Why::after_sliding;
  return Why::other;
}

namespace {

void simulate(MapCell& cell, Scheme scheme, const StabilityOptions& options) {
  cell.linear_stable =
      linearly_stable(scheme, cell.k, c_of(scheme, cell.second), beta_of(scheme, cell.second));
  const LoopSetup sticking = cell_setup(scheme, cell.k, cell.second, false, options);
  cell.sticking = run_loop(sticking);
  cell.sliding = run_loop(cell_setup(scheme, cell.k, cell.second, true, options));
  const LoopResult& worse = severity(cell.sticking) >= severity(cell.sliding) ? cell.sticking : cell.sliding;
  cell.verdict = worse.verdict;
  cell.unbounded = worse.unbounded;
  cell.why = why_of(cell, scheme, static_cast<double>(sticking.steps));
}

void simulate_varied(VariedMap& map, const StabilityOptions& options) {
  const Scheme scheme = map.scheme;
  constexpr double smallest_load = 0.25;
  for (const double k : axis_values(1e-3, 1e2, options.quick ? 1 : 2, 0.25)) {
    for (const double second : axis_values(1e-3, 1e1, options.quick ? 1 : 2, 0.1)) {
      const double c = c_of(scheme, second), beta = beta_of(scheme, second);
      LoopSetup turned = cell_setup(scheme, k, second, true, options);
      turned.axes = 2;
      turned.turn = true;
      const bool at_largest = linearly_stable(scheme, k, c, beta);
      const bool settles = run_loop(turned).verdict == Verdict::settles;
      ++map.turned;
      map.turned_agree += settles == at_largest;

      LoopSetup swinging = cell_setup(scheme, k, second, true, options);
      swinging.smallest_load = smallest_load;
      swinging.stop_early = false;
      // Scales stiffness and damping of the patch with its load. A device's damping does not depend on the
      // load.
      const bool at_smallest = linearly_stable(scheme, smallest_load * k, smallest_load * c, beta);
      const bool swing_settles = run_loop(swinging).verdict == Verdict::settles;
      const bool always = at_largest && at_smallest, never = !at_largest && !at_smallest;
      auto& cells = always ? map.always : never ? map.never : map.partly;
      auto& settled = always ? map.always_settle : never ? map.never_settle : map.partly_settle;
      ++cells;
      settled += swing_settles;
    }
  }
}

StabilityResult measure(const StabilityOptions& options) {
  StabilityResult result;
  result.ks = axis_values(1e-3, 1e2, options.quick ? 2 : 5, 0.25);
  result.seconds = axis_values(1e-3, 1e1, options.quick ? 2 : 5, 0.1);
  result.maps.resize(mapped_schemes().size());
  result.varied.resize(mapped_schemes().size());
  std::vector<std::function<void()>> jobs;
  result.rests.resize(2);  // the jobs of the resting plate start first, since they take longest
  for (std::size_t i = 0; i < 2; ++i) {
    jobs.push_back([&result, &options, i] {
      result.rests[i] =
          rest_on_slope(i ? Scheme::midpoint : Scheme::predictor, options.quick ? 60.0 : 3600.0, options);
    });
  }
  for (std::size_t s = 0; s < mapped_schemes().size(); ++s) {
    const Scheme scheme = mapped_schemes()[s];
    result.maps[s].scheme = result.varied[s].scheme = scheme;
    auto& cells = result.maps[s].cells;
    for (const double k : result.ks) {
      for (const double second : result.seconds) {
        cells.emplace_back();
        cells.back().k = k;
        cells.back().second = second;
      }
    }
  }
  for (SchemeMap& map : result.maps) {
    for (MapCell& cell : map.cells) {
      jobs.push_back([&cell, &map, &options] { simulate(cell, map.scheme, options); });
    }
  }
  for (VariedMap& map : result.varied) jobs.push_back([&map, &options] { simulate_varied(map, options); });
  jobs.push_back([&result, &options] { result.stops = stopping_distances(options.rule); });
  result.cases = stability_cases();
  for (CaseRow& row : result.cases) {
    jobs.push_back([&row] {
      for (const double v : row.start_velocities) {
        row.setup.start_velocity = v;
        row.results.push_back(run_loop(row.setup));
      }
    });
  }
  for (const SpringPull& pull : pulls()) {
    for (const Scheme scheme : {Scheme::predictor, Scheme::midpoint}) {
      result.pulled.emplace_back();
      result.pulled.back().pull = pull;
      result.pulled.back().scheme = scheme;
    }
  }
  for (PullRow& row : result.pulled) jobs.push_back([&row] { row = pull_row(row.pull, row.scheme); });
  result.wheels = wheel_rows();
  for (WheelRow& row : result.wheels) jobs.push_back([&row] { run_wheel(row); });
  jobs.push_back([&result] {
    result.late = {{"end", late_force_damping(false)}, {"mean", late_force_damping(true)}};
  });
  const int cores = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  Progress progress("stability");
  std::mutex mutex;
  run_jobs(jobs.size(), static_cast<std::size_t>(options.threads > 0 ? options.threads : cores),
           [&](std::size_t i, const auto&) {
             jobs[i]();
             const std::lock_guard lock(mutex);
             progress.update(static_cast<double>(i) / static_cast<double>(jobs.size()));
           });
  return result;
}

}  // namespace

const char* to_string(Why why) noexcept {
  static constexpr const char* texts[] = {"agrees",
                                          "at the limit: under 5 % in a quarter of the run",
                                          "stable when stuck, but damper and mass alone are not (sliding)",
                                          "settles from sticking; coming from sliding it keeps snapping",
                                          "the encoder's counts keep it going",
                                          "grows when stuck, but snaps take that energy",
                                          "other"};
  return texts[static_cast<int>(why)];
}

std::uint64_t SchemeMap::agreeing() const {
  return static_cast<std::uint64_t>(
      std::count_if(cells.begin(), cells.end(), [](const MapCell& c) { return c.why == Why::agree; }));
}

const std::vector<Scheme>& mapped_schemes() {
  static const std::vector<Scheme> schemes = {
      Scheme::explicit_euler,  Scheme::semi_implicit, Scheme::semi_implicit_mean,
      Scheme::predictor,       Scheme::midpoint,      Scheme::hold,
      Scheme::hold_difference, Scheme::device,        Scheme::device_mean};
  return schemes;
}

LoopSetup cell_setup(Scheme scheme, double k, double second, bool sliding, const StabilityOptions& options) {
  LoopSetup s;
  s.scheme = scheme;
  s.mass_kg = mass_kg;
  s.dt_s = dt_s;
  s.mean_snap_length = mean_snap_length_m;
  s.stiffness = k * mass_kg / (dt_s * dt_s);
  s.damping = c_of(scheme, second) * mass_kg / dt_s;
  s.device_damping = beta_of(scheme, second) * mass_kg / dt_s;
  if (scheme == Scheme::device) s.quantum_m = encoder_quantum * mean_snap_length_m;
  s.bristles = 256;
  s.population = options.population;
  s.rule = options.rule;
  s.steps = options.quick ? 4000 : 8000;
  s.sliding = sliding;
  // Sets the start velocity of a run. If the mass sticks, it is that of a free swing of amplitude `push`, at
  // most `push` per step; if it slides, the one that stops after the distance `slide`, from v^2 / (2 F / m)
  // with friction F.
  const double speed = mean_snap_length_m / dt_s;
  s.start_velocity = sliding ? std::sqrt(2.0 * s.kinetic_n() / mass_kg * slide * mean_snap_length_m)
                             : speed * push * std::min(1.0, std::sqrt(k));
  return s;
}

void stability_command(const StabilityOptions& options) {
  const bool on_stdout = check_files({}, {{"--json", options.json}, {"--csv", options.csv}});
  OutputFile json(options.json), csv(options.csv);
  const double start = bristle::DeadlineMonitor::wall_now();
  StabilityResult result;
  try {
    result = measure(options);
  } catch (const bristle::Error& error) {
    throw UserError(error.what());  // BRISTLE_ISA names an instruction set that the machine lacks
  }
  result.seconds_taken = bristle::DeadlineMonitor::wall_now() - start;
  if (!on_stdout) print_report(stability_table(options, result));
  if (json) json.write(stability_json(options, result));
  if (csv) csv.write(stability_csv(result));
}

}  // namespace cli
