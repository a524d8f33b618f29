// The command line `bristle`. Exit codes: 0 done, 1 an internal failure, 2 bad input (one line on stderr).
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <memory>
#include <new>
#include <span>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <bristle/error.hpp>
#include <bristle/patch_batch.hpp>

#include "tools/accuracy/accuracy.hpp"
#include "tools/capacity/capacity.hpp"
#include "tools/cli/command_tree.hpp"
#include "tools/cli/completion.hpp"
#include "tools/cli/help_text.hpp"
#include "tools/cli/manual.hpp"
#include "tools/cli/option_checks.hpp"
#include "tools/experiments/command.hpp"
#include "tools/files/csv_columns.hpp"
#include "tools/files/one_line.hpp"
#include "tools/files/text_file.hpp"
#include "tools/files/user_error.hpp"
#include "tools/fitting/fit.hpp"
#include "tools/reports/conditions.hpp"
#include "tools/reports/report.hpp"
#include "tools/reports/text_layout.hpp"
#include "tools/run/run.hpp"
#include "tools/stability/stability.hpp"
#include "tools/sweep/sweep.hpp"

namespace {

constexpr int exit_done = 0;
constexpr int exit_failure = 1;
constexpr int exit_bad_input = 2;

int complain(const std::string& message, int code) {
  cli::print_note("bristle: " + cli::one_line(message) + '\n');
  return code;
}

std::string version_text() {
  const cli::Conditions c = cli::conditions();
  std::string text =
      fmt::format("bristle {}\ncommit   {}\nbuild    {}\nkernels  ", c.version, c.commit, c.flags);
  std::string chosen;
  try {
    chosen = bristle::PatchBatch().isa();
  } catch (const bristle::Error& error) {
    throw cli::UserError(error.what());  // BRISTLE_ISA names an instruction set that this machine lacks
  }
  const char* separator = "";
  for (const bristle::IsaInfo& isa : bristle::instruction_sets()) {
    text += fmt::format("{}{}{}", separator, isa.name,
                        isa.name == chosen ? " (chosen)"
                        : isa.usable       ? ""
                                           : " (not on this machine)");
    separator = ", ";
  }
  if (BRISTLE_MINIMAL)
    text +=
        "\nwithout  two axes, redraw, literal rule, infinite brush, mean, energy, double precision, TBB "
        "(BRISTLE_MINIMAL)";
  else if (!BRISTLE_WITH_DOUBLE || !BRISTLE_WITH_TBB)
    text +=
        fmt::format("\nwithout {}{}", BRISTLE_WITH_DOUBLE ? "" : " double precision (BRISTLE_WITH_DOUBLE)",
                    BRISTLE_WITH_TBB ? "" : " threads (BRISTLE_WITH_TBB)");
  return cli::filled(text + '\n');
}

// "1ms", "500 us", "0.001" (seconds).
double parse_time(const std::string& text) {
  double value = 0.0;
  const char* const end = text.data() + text.size();
  auto [rest, error] = std::from_chars(text.data(), end, value);
  while (rest != end && *rest == ' ') ++rest;
  const std::string unit(rest, end);
  const double per_second = unit == "ms" ? 1e3 : unit == "us" ? 1e6 : unit.empty() || unit == "s" ? 1.0 : 0.0;
  const double seconds = value / per_second;
  if (error != std::errc() || per_second == 0.0 || !(seconds >= 1e-6 && seconds <= 10.0)) {
    throw cli::UserError(
        fmt::format("--deadline is '{}'; allowed: 1us to 10s, as a number with s, ms or us", text));
  }
  return seconds;
}

// "500M", "16G" or "16GiB", "1000000" (bytes).
std::uint64_t parse_memory(const std::string& text) {
  double value = 0.0;
  const char* const end = text.data() + text.size();
  auto [rest, error] = std::from_chars(text.data(), end, value);
  while (rest != end && *rest == ' ') ++rest;
  std::string unit(rest, end);
  if (unit.ends_with("iB")) unit.resize(unit.size() - 2);
  const double per_byte = unit.empty()  ? 1.0
                          : unit == "M" ? 0x1p20
                          : unit == "G" ? 0x1p30
                          : unit == "T" ? 0x1p40
                                        : 0.0;
  if (error != std::errc() || !(value * per_byte >= 1e6 && value * per_byte <= 1e15))
    throw cli::UserError(
        fmt::format("--memory is '{}'; allowed: 1M to 900T, as a number with M, G or T, or of bytes", text));
  return static_cast<std::uint64_t>(value * per_byte);
}

// "1%", "1 %", "0.01".
double parse_share(const std::string& text) {
  double value = 0.0;
  const char* const end = text.data() + text.size();
  auto [rest, error] = std::from_chars(text.data(), end, value);
  while (rest != end && *rest == ' ') ++rest;
  const std::string unit(rest, end);
  if (unit == "%") value /= 100.0;
  if (error != std::errc() || !(unit.empty() || unit == "%") || !(value >= 1e-6 && value <= 1.0)) {
    throw cli::UserError(fmt::format("--error is '{}'; allowed: 0.0001% to 100%, as 1% or 0.01", text));
  }
  return value;
}

/// "1,2".
std::vector<int> parse_threads(const std::string& text) {
  std::vector<int> counts;
  const char* at = text.data();
  const char* const end = at + text.size();
  for (bool more = true; more;) {
    int count = 0;
    const auto [rest, error] = std::from_chars(at, end, count);
    more = rest != end && *rest == ',';
    if (error != std::errc() || (rest != end && !more) || count < 1 || count > 1024)
      throw cli::UserError(fmt::format("--threads is '{}'; allowed: counts from 1 to 1024, as 1,2,4", text));
    counts.push_back(count);
    at = rest + 1;
  }
  return counts;
}

using Assignments = std::vector<std::pair<std::string, std::string>>;

/// "x=Position,force=Fx".
Assignments parse_assignments(const std::string& text, const char* option) {
  Assignments all;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string one = text.substr(begin, end - begin);
    const std::size_t equals = one.find('=');
    if (equals == 0 || equals == std::string::npos || equals + 1 == one.size())
      throw cli::UserError(fmt::format(
          "{} is '{}'; allowed: {}", option, text,
          std::string(option) == "--units" ? "x=mm,force=gf and so on" : "x=Position,force=Fx and so on"));
    const std::string name = one.substr(0, equals);
    for (const auto& [known, value] : all)
      if (known == name)
        throw cli::UserError(fmt::format("{} is '{}': {} is given twice", option, text, name));
    all.emplace_back(name, one.substr(equals + 1));
    begin = end + 1;
  }
  return all;
}

/// A number with a unit within a range of SI values.
double parse_within(const std::string& text, std::span<const cli::Unit> units, const char* option, double low,
                    double high) {
  const double value = cli::parse_quantity(text, units, option);
  if (value >= low && value <= high) return value;
  throw cli::UserError(
      fmt::format("{} is '{}'; allowed: {} to {} {}", option, text, low, high, units.front().name));
}

/// What the data of a fit do not say themselves.
void add_reading(CLI::App* app, cli::FitOptions& options) {
  const auto quantity = [app](const char* option, std::span<const cli::Unit> units, double low, double high,
                              const char* text, auto set) {
    app->add_option_function<std::string>(
           option, [=](const std::string& given) { set(parse_within(given, units, option, low, high)); },
           text)
        ->type_name("QUANTITY");
  };
  app->add_option_function<std::string>(
         "--columns",
         [&](const std::string& text) { options.reading.columns = parse_assignments(text, "--columns"); },
         "Columns by the names (or places) that the data give them, e.g. x=Position,force=Fx,load=4")
      ->type_name("NAMES");
  app->add_option_function<std::string>(
         "--units",
         [&](const std::string& text) { options.reading.units = parse_assignments(text, "--units"); },
         "Units of columns, in place of the header's, e.g. t=ms,x=um,force=gf")
      ->type_name("UNITS");
  quantity("--load", cli::force_units, 1e-9, 1e9, "Normal load in place of a column, e.g. 2N or 200gf",
           [&](double load) { options.load = load; });
  quantity("--clip-load", cli::force_units, 0.0, 1e9, "Loads from minus this to 0 count as 0, e.g. 5mN",
           [&](double load) { options.reading.clip_load = load; });
  quantity("--speed", cli::speed_units, -1e3, 1e3,
           "Speed of the motion where no column has it, e.g. 10mm/min",
           [&](double speed) { options.reading.speed = speed; });
  quantity("--mass", cli::mass_units, 0.0, 1e6,
           "Mass that the force sensor accelerates: its inertia is taken off, e.g. 120g",
           [&](double mass) { options.mass = mass; });
  quantity("--radius", cli::length_units, 1e-9, 1e3,
           "Radius at which columns angle and torque act, of a ring its mean radius, e.g. 20mm",
           [&](double radius) { options.reading.radius = radius; });
  quantity("--disc", cli::length_units, 1e-9, 1e3,
           "Radius of a full disc that turns about its middle, for columns angle and torque, e.g. 20mm",
           [&](double radius) {
             options.reading.radius = radius;
             options.reading.disc = true;
           });
  app->get_option("--disc")->excludes(app->get_option("--radius"));
  quantity("--compliance", cli::compliance_units, 0.0, 1.0,
           "Hold what the stage bends per force at this (default: fitted), e.g. 2um/N",
           [&](double compliance) { options.compliance = compliance; });
  quantity("--delay", cli::time_units, 0.0, 1e3,
           "Hold the delay of the force sensor at this (default: fitted), e.g. 5ms",
           [&](double delay) { options.delay = delay; });
}

// CLI11 itself would only say that a subcommand is missing.
void check_command(const CLI::App& app, const std::string& name) {
  std::string known;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    if (command->get_name() == name) return;
    known += (known.empty() ? "" : ", ") + command->get_name();
  }
  throw cli::UserError(fmt::format("'{}' is not a command; allowed: {}", name, known));
}

/// An option that takes one of some words. (CLI11's own refusal shows the words as pairs with nothing.)
template <class T>
void add_choice(CLI::App* app, const char* option, std::vector<std::pair<std::string, T>> words, T& chosen,
                const std::string& description) {
  std::string allowed, choices;
  for (const auto& [word, value] : words) {
    allowed += (allowed.empty() ? "" : ", ") + word;
    choices += (choices.empty() ? "" : "|") + word;
  }
  const auto choose = [option, words = std::move(words), allowed, &chosen](const std::string& text) {
    for (const auto& [word, value] : words) {
      if (word != text) continue;
      chosen = value;
      return;
    }
    throw cli::UserError(fmt::format("{} is '{}'; allowed: {}", option, text, allowed));
  };
  app->add_option_function<std::string>(option, choose, description)->type_name(choices);
}

// One subcommand per experiment, so that `experiment NAME --help` shows its parameters.
void add_experiments(CLI::App& app, cli::ExperimentOptions& options) {
  CLI::App* all =
      app.add_subcommand("experiment", "Repeat a classic friction experiment, the brush beside its rivals");
  all->require_subcommand(1);
  all->footer("bristle experiment list shows all parameters; bristle experiment NAME --help those of one.");
  const auto add = [&](const std::string& name, const std::string& title) {
    CLI::App* command = all->add_subcommand(name, title);
    command->parse_complete_callback([&options, name] { options.name = name; });
    return command;
  };
  const auto add_common = [&](CLI::App* command) {
    command->add_option("--set", options.set, "A parameter: KEY=VALUE, lists with commas; may be repeated")
        ->type_name("KEY=VALUE")
        ->allow_extra_args(false)
        ->trigger_on_parse(false);
    command->add_option("--config", options.config, "Parameters from a TOML file (tools/README.md)")
        ->type_name(cli::file_value);
    command->add_option("--models", options.models, "Only these models, e.g. lugre,brush_redraw")
        ->type_name("NAMES")
        ->delimiter(',');
    command
        ->add_option("--json", options.json, "Write parameters and findings to this JSON file (- for stdout)")
        ->type_name(cli::file_value);
  };
  for (const cli::Experiment& experiment : cli::experiments()) {
    CLI::App* command = add(experiment.name, experiment.title);
    add_common(command);
    command->add_option("--csv", options.csv, "Write the curves to this CSV file (- for stdout)")
        ->type_name(cli::file_value);
    command->add_option("--plot", options.plot, "Draw them into this PNG file, by gnuplot")
        ->type_name(cli::file_value);
    command->footer("Parameters for --set and --config:\n" + cli::parameter_table(experiment.parameters));
  }
  CLI::App* every = add("all", "Every experiment, the table of all findings, and what a step costs");
  add_common(every);
  every
      ->add_option("--markdown", options.markdown,
                   "Write the table with its reasons to this page (- for stdout)")
      ->type_name(cli::file_value);
  every->add_flag("--no-cost", options.no_cost, "Leave out the time of a step");
  add("list", "List experiments, models and parameters");
}

// `run --realtime` and what belongs to it.
void add_realtime(CLI::App* run_app, bool& wanted, cli::RealtimeOptions& options) {
  CLI::Option* realtime = run_app->add_flag(
      "--realtime", wanted,
      "Step against the clock, alternating with a bare sleep loop; Ctrl-C stops it and prints the report");
  run_app->add_option("--rate", options.rate_hz, "Ticks per second, e.g. 1000; the scene's dt becomes 1/rate")
      ->check(cli::within(1.0, 1e5))
      ->needs(realtime);
  run_app->add_option("--fifo", options.thread.fifo_priority, "Real-time priority (SCHED_FIFO), if permitted")
      ->check(CLI::Range(1, 99))
      ->needs(realtime);
  run_app->add_option("--core", options.thread.core, "Bind the loop to this core, its workers to the others")
      ->check(CLI::Range(0, 1023))
      ->needs(realtime);
  run_app
      ->add_option_function<double>(
          "--busy-wait", [&options](double us) { options.busy_wait_s = 1e-6 * us; },
          "Sleep until this many us before a tick, then poll the clock")
      ->check(cli::within(0.0, 1e6))
      ->needs(realtime);
  run_app
      ->add_option(
          "--bare-share", options.bare_share,
          "Ticks of the bare sleep loop for each of bristle's: 1 (default) doubles the time of a run")
      ->check(cli::within(1e-3, 1.0))
      ->needs(realtime);
  run_app->add_flag("--mlock", options.thread.lock_memory, "Lock the process in memory, if permitted")
      ->needs(realtime);
  run_app
      ->add_option("--histograms", options.histograms,
                   "Write histograms of step time and jitter to this CSV file (- for stdout)")
      ->type_name(cli::file_value)
      ->needs(realtime);
}

// `sweep`, and within it `merge`.
CLI::App* add_sweep(CLI::App& app, cli::SweepOptions& options, cli::MergeOptions& merge) {
  CLI::App* sweep = app.add_subcommand("sweep", "A scene over a grid or sample of parameters, as one table");
  sweep->add_option("SCENE", options.study.scene, "Scene file, TOML (tools/README.md)")
      ->type_name(cli::file_value);
  const auto add_list = [&](const char* option, std::vector<std::string>& list, const char* value,
                            const char* description) {
    return sweep->add_option(option, list, description)
        ->type_name(value)
        ->allow_extra_args(false)
        ->trigger_on_parse(false);
  };
  add_list("--vary", options.study.vary, "KEY=VALUES",
           "KEY=FROM:TO:NUMBER (with :log, :int) or KEY=V1,V2,...; a key as material.wood.kinetic; may be "
           "repeated");
  sweep
      ->add_option_function<std::vector<std::string>>(
          "--sample",
          [&options](const std::vector<std::string>& words) {
            const std::vector<std::string> names = {"grid", "latin", "sobol"};
            const auto found = std::find(names.begin(), names.end(), words[0]);
            if (found == names.end())
              throw cli::UserError(
                  fmt::format("--sample is '{}'; allowed: grid, latin NUMBER, sobol NUMBER", words[0]));
            options.study.sampling = static_cast<cli::SweepSampling>(found - names.begin());
            if (words.size() < 2) return;
            const std::string& count = words[1];
            const auto [rest, error] =
                std::from_chars(count.data(), count.data() + count.size(), options.study.points);
            if (error != std::errc() || rest != count.data() + count.size() || words[0] == "grid")
              throw cli::UserError(fmt::format(
                  "--sample is '{} {}'; allowed: grid, latin NUMBER, sobol NUMBER", words[0], count));
          },
          "grid (default), latin NUMBER (hypercube), sobol NUMBER of points")
      ->type_name("KIND")
      ->expected(1, 2);
  sweep->add_option("--repeat", options.study.repeat, "Rows at each point, each with seeds by its index")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{10'000'000}));
  sweep->add_option("--seed", options.study.seed, "Of the rows' seeds and of the sample");
  add_list("--set", options.study.set, "KEY=VALUE", "KEY=VALUE in every row; may be repeated");
  add_list("--reference", options.study.reference, "KEY=VALUE",
           "KEY=VALUE of a second run of each row, to which its forces are compared (result error); may be "
           "repeated");
  sweep
      ->add_option("--report", options.study.report,
                   "Results: default, all, a patch or body, or names such as "
                   "kinetic,tip.peak,state_hash,time.step_p50")
      ->type_name("NAMES")
      ->allow_extra_args(false)
      ->trigger_on_parse(false)
      ->delimiter(',');
  sweep
      ->add_option("--window", options.study.window,
                   "FROM:UNTIL, s: results window_peak and window_mean, and the time of error")
      ->type_name("FROM:UNTIL");
  sweep->add_option("--steps", options.study.steps, "Steps, instead of the scene's duration")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1'000'000'000'000}));
  add_list("--out", options.out, cli::file_value,
           "Table: .csv, or .nc (NetCDF) with units; - for stdout; may be repeated");
  sweep
      ->add_option("--journal", options.journal,
                   "Rows as they are done (default: beside the table), kept at the end")
      ->type_name(cli::file_value);
  sweep->add_option("--json", options.json, "Write the report to this JSON file (- for stdout)")
      ->type_name(cli::file_value);
  sweep->add_option("--threads", options.threads, "Rows at a time; 0 = one per core")
      ->check(CLI::Range(0, 1024));
  sweep->add_option("--shard", options.shard, "i/N: only this part of the rows, i from 1; then sweep merge")
      ->type_name("i/N");
  sweep
      ->add_option("--dask", options.dask,
                   "Address of a Dask scheduler that has the rows run, e.g. tcp://host:8786")
      ->type_name("ADDRESS");
  sweep->add_option("--isa", options.isa, "Instruction set: see bristle --version")->type_name("NAME");
  sweep->add_option("--row", options.row,
                    "Run nothing: write the scene of this row (--out SCENE.toml, else stdout)");
  sweep->footer(
      "A sweep that was stopped or killed is resumed by the same command. bristle sweep merge --help: "
      "shards.");
  CLI::App* merge_app = sweep->add_subcommand("merge", "One table of the journals of all shards");
  merge_app->add_option("JOURNAL", merge.journals, "Journals of one study, in any order")
      ->type_name(cli::file_value)
      ->required();
  merge_app
      ->add_option("--out", merge.out,
                   "Table: .csv, or .nc (NetCDF) with units; - for stdout; may be repeated")
      ->type_name(cli::file_value)
      ->allow_extra_args(false)
      ->trigger_on_parse(false);
  merge_app->add_option("--json", merge.json, "Write the report to this JSON file (- for stdout)")
      ->type_name(cli::file_value);
  merge_app->add_flag("--partial", merge.partial, "Write what there is, though rows are missing");
  return sweep;
}

int run_sweep(const CLI::App& sweep, const cli::SweepOptions& options, const cli::MergeOptions& merge) {
  if (!sweep.get_subcommands().empty()) {
    cli::merge_command(merge);
    return exit_done;
  }
  if (options.study.scene.empty()) throw cli::UserError("sweep: SCENE is missing (see bristle sweep --help)");
  return cli::sweep_command(options);
}

/// Of a command that prints figures, and of what is below it.
void add_wide(CLI::App& command, bool& wide) {
  const std::vector<CLI::App*> below = command.get_subcommands([](const CLI::App*) { return true; });
  if (command.get_name() != "experiment")
    command.add_flag("--wide", wide, "All columns, in lines as long as they get (default: 80 columns)");
  for (CLI::App* sub : below) add_wide(*sub, wide);
}

std::string names_of_commands(const CLI::App& app) {
  std::string names;
  for (const CLI::App* command : cli::subcommands_of(app))
    names += (names.empty() ? "" : "|") + command->get_name();
  return names;
}

int run(int argc, char** argv) {
  CLI::App app("Friction by the brush model: contact patches of bristles that bend and snap.", "bristle");
  app.formatter(std::make_shared<cli::HelpText>());  // subcommands take it over
  app.require_subcommand(1);
  bool version = false;
  // Done at once, so that it needs no subcommand.
  app.add_flag_callback(
      "--version",
      [&] {
        version = true;
        throw CLI::Success();
      },
      "Version, commit, and the instruction sets of this build");

  cli::RunOptions run_options;
  CLI::App* run_app =
      app.add_subcommand("run", "Step a scene and report forces, step times and the state hash");
  run_app->add_option("SCENE", run_options.scene, "Scene file, TOML (tools/README.md)")
      ->type_name(cli::file_value)
      ->required();
  run_app
      ->add_option("--trace", run_options.trace,
                   "Motion file, CSV t,x,y,load, in place of the scene's motion")
      ->type_name(cli::file_value);
  run_app
      ->add_option("--clip-load", run_options.clip_load,
                   "Loads of that file from minus this, N, to 0 count as 0: the zero of a force sensor")
      ->check(cli::within(0.0, 1e9));
  run_app->add_option("--out", run_options.out, "Write forces to this CSV file (- for stdout)")
      ->type_name(cli::file_value);
  run_app->add_option("--json", run_options.json, "Write the report to this JSON file (- for stdout)")
      ->type_name(cli::file_value);
  run_app->add_option("--threads", run_options.threads, "Threads that step; 0 = one per core")
      ->check(CLI::Range(0, 1024));
  run_app->add_option("--isa", run_options.isa, "Instruction set: see bristle --version")->type_name("NAME");
  run_app
      ->add_option("--budget", run_options.overload.budget_us,
                   "Time for a step, us: a step that takes longer leaves out bristles, which come back later")
      ->check(cli::within(1e-3, 1e9));
  run_app
      ->add_option("--record-decisions", run_options.overload.record,
                   "Write what was left out and when to this CSV file")
      ->type_name(cli::file_value);
  run_app
      ->add_option("--replay-decisions", run_options.overload.replay,
                   "Leave out what such a file lists, whatever the clock says: the same bits")
      ->type_name(cli::file_value);
  run_app->add_option("--steps", run_options.steps, "Steps, instead of the scene's duration")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1'000'000'000'000}));
  run_app
      ->add_option("--bristles", run_options.bristles,
                   "Representative bristles of each patch, instead of the scene's")
      ->check(CLI::Range(std::uint32_t{1}, bristle::max_bristles_per_patch));
  cli::RealtimeOptions realtime_options;
  bool realtime = false;
  add_realtime(run_app, realtime, realtime_options);
  run_app
      ->add_option_function<std::string>(
          "--memory", [&](const std::string& size) { run_options.limits.bytes = parse_memory(size); },
          "What the scene may take, e.g. 16G, in place of what is free; lifts the limits of bristles, "
          "patches "
          "and "
          "materials")
      ->type_name("SIZE");
  run_app
      ->add_option("--restore-state", run_options.restore_state,
                   "Continue from this state file, written by a run of the same scene")
      ->type_name(cli::file_value);
  run_app->add_option("--save-state", run_options.save_state, "Write where the run ended to this state file")
      ->type_name(cli::file_value);

  cli::CapacityOptions capacity_options;
  std::string deadline = "1ms";
  CLI::App* capacity_app =
      app.add_subcommand("capacity", "How many bristles fit in a deadline on this machine");
  capacity_app->add_option("--deadline", deadline, "Time for a step, e.g. 1ms or 250us")
      ->type_name("TIME")
      ->capture_default_str();
  capacity_app->add_flag("--quick", capacity_options.quick, "Fewer rows, shorter runs");
  capacity_app->add_flag("--targets", capacity_options.targets, "Only the library's speed targets");
  capacity_app->add_flag("--features", capacity_options.features, "Only what each feature of a kernel costs");
  capacity_app
      ->add_option_function<std::string>(
          "--threads", [&](const std::string& text) { capacity_options.threads = parse_threads(text); },
          "Thread counts, e.g. 1,2")
      ->type_name("COUNTS");
  capacity_app->add_option("--isa", capacity_options.isa, "Instruction set: see bristle --version")
      ->type_name("NAME");
  capacity_app
      ->add_option("--json", capacity_options.json, "Write the report to this JSON file (- for stdout)")
      ->type_name(cli::file_value);
  capacity_app->add_option("--csv", capacity_options.csv, "Write step time against bristles to this CSV file")
      ->type_name(cli::file_value);

  cli::ExperimentOptions experiment_options;
  add_experiments(app, experiment_options);

  cli::FitOptions fit_options;
  CLI::App* fit_app = app.add_subcommand("fit", "A material from measured friction");
  fit_app
      ->add_option("DATA", fit_options.data,
                   "Measured friction, CSV t,x,load,force (tools/README.md); several files are one record")
      ->type_name(cli::file_value)
      ->required();
  add_reading(fit_app, fit_options);
  add_choice(
      fit_app, "--sign",
      {{"auto", cli::ForceSign::automatic}, {"on", cli::ForceSign::on_body}, {"by", cli::ForceSign::by_body}},
      fit_options.sign,
      "Whose force: on the body (opposes the motion) or by the body; default: found from the data");
  add_choice(fit_app, "--law",
             {{"lognormal", bristle::SnapLaw::lognormal},
              {"normal", bristle::SnapLaw::normal},
              {"uniform", bristle::SnapLaw::uniform},
              {"exponential", bristle::SnapLaw::exponential}},
             fit_options.law, "Family of snap lengths (default lognormal)");
  add_choice(fit_app, "--rule", {{"redraw", bristle::SnapRule::redraw}, {"keep", bristle::SnapRule::keep}},
             fit_options.rule, "What a bristle does after a snap (default redraw)");
  add_choice(
      fit_app, "--decay",
      {{"exponential", bristle::DamperDecay::exponential}, {"gaussian", bristle::DamperDecay::gaussian}},
      fit_options.decay, "Decay of the damper with speed (default exponential)");
  fit_app
      ->add_option("--residual", fit_options.residual,
                   "Hold the residual at this share of the presliding length (default: fitted)")
      ->check(cli::within(0.0, cli::widest_residual));
  fit_app->add_option("--renewal", fit_options.renewal, "Hold the shared renewal (default: fitted)")
      ->check(cli::within(0.0, cli::most_renewed));
  fit_app->add_flag(
      "--rivals", fit_options.rivals,
      "Fit Coulomb, LuGre and Maxwell-slip too, to the first part of the record; judge all on the "
      "rest");
  fit_app
      ->add_option(
          "--fit-until", fit_options.fit_until,
          "With --rivals: the first part ends so many seconds after the first sample (default: a third)")
      ->check(cli::within(1e-9, 1e9));
  fit_app
      ->add_option("--write", fit_options.write, "Write the material, in a scene that replays the data, TOML")
      ->type_name(cli::file_value);
  fit_app->add_option("--plot", fit_options.plot, "Draw the fit over the data, PNG (needs gnuplot)")
      ->type_name(cli::file_value);
  fit_app
      ->add_option("--html", fit_options.html,
                   "Write a page to read to this HTML file: what was read, fit, residuals (- for stdout)")
      ->type_name(cli::file_value);
  fit_app->add_option("--json", fit_options.json, "Write the report to this JSON file (- for stdout)")
      ->type_name(cli::file_value);
  fit_app
      ->add_option("--csv", fit_options.csv, "Write data, fit and residuals to this CSV file (- for stdout)")
      ->type_name(cli::file_value);
  cli::StabilityOptions stability_options;
  CLI::App* stability_app = app.add_subcommand(
      "stability", "Closed-loop stability of a mass on a patch, simulated, beside linear theory");
  stability_app->add_flag("--quick", stability_options.quick, "A coarser map, shorter runs");
  stability_app->add_option("--threads", stability_options.threads, "Threads that simulate; 0 = one per core")
      ->check(CLI::Range(0, 1024));
  add_choice(stability_app, "--population",
             {{"representatives", bristle::Population::representatives},
              {"infinite", bristle::Population::infinite}},
             stability_options.population, "What stands for the bristles of the maps and the slope");
  stability_app
      ->add_option("--json", stability_options.json, "Write the report to this JSON file (- for stdout)")
      ->type_name(cli::file_value);
  stability_app->add_option("--csv", stability_options.csv, "Write the map to this CSV file (- for stdout)")
      ->type_name(cli::file_value);
  cli::SweepOptions sweep_options;
  cli::MergeOptions merge_options;
  const CLI::App* sweep_app = add_sweep(app, sweep_options, merge_options);
  cli::AccuracyOptions accuracy_options;
  std::string wanted_error;
  CLI::App* accuracy_app = app.add_subcommand(
      "accuracy", "Error against run time of a scene, the cheapest setting for an error, what to leave out");
  accuracy_app->add_option("SCENE", accuracy_options.scene, "Scene file, TOML (tools/README.md)")
      ->type_name(cli::file_value)
      ->required();
  accuracy_app->add_option("--error", wanted_error, "Wanted error of the force, rms, e.g. 1%")
      ->type_name("SHARE");
  accuracy_app
      ->add_option("--write", accuracy_options.write,
                   "Write the scene with the recommended setting to this TOML file")
      ->type_name(cli::file_value);
  accuracy_app->add_flag("--quick", accuracy_options.quick, "Fewer settings, less than a minute");
  accuracy_app->add_option("--seconds", accuracy_options.seconds, "Time to spend, about")
      ->check(cli::within(0.5, 1e5));
  accuracy_app->add_option("--isa", accuracy_options.isa, "Instruction set: see bristle --version")
      ->type_name("NAME");
  accuracy_app
      ->add_option("--json", accuracy_options.json, "Write the report to this JSON file (- for stdout)")
      ->type_name(cli::file_value);
  accuracy_app
      ->add_option("--csv", accuracy_options.csv, "Write the settings to this CSV file (- for stdout)")
      ->type_name(cli::file_value);
  cli::ReportOptions report_options;
  CLI::App* report_app = app.add_subcommand(
      "report", "One HTML page of the JSON reports of capacity, accuracy and stability, with pictures");
  report_app
      ->add_option("FILE", report_options.files,
                   "JSON reports, and pictures (PNG, SVG): capacity.png belongs to capacity.json")
      ->type_name(cli::file_value)
      ->required();
  report_app->add_option("--out", report_options.out, "Write the page to this file (- for stdout)")
      ->type_name(cli::file_value)
      ->capture_default_str();

  bool wide = false;
  for (CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
    add_wide(*command, wide);
  std::string shell;
  CLI::App* completion_app =
      app.add_subcommand("completion", "Print what a shell needs to complete words of this command line");
  completion_app->add_option("SHELL", shell, "Shell that the script is for")
      ->type_name("bash|zsh|fish")
      ->required();
  completion_app->footer(
      "For this session: source <(bristle completion bash), or bristle completion fish | source. The "
      "packages "
      "install all three.");
  std::string manual_of, manual_folder;
  CLI::App* manual_app =
      app.add_subcommand("manual", "Print a page of the manual: bristle manual run | man -l -");
  manual_app->add_option("COMMAND", manual_of, "Command (default: the program itself)")
      ->type_name(names_of_commands(app))
      ->option_text("NAME");  // all names would be a long line of --help
  manual_app->add_option("--out", manual_folder, "Write all pages into this folder")->type_name("FILE");

  cli::refuse_empty_files(app, cli::file_value);
  if (argc > 1 && argv[1][0] != '-') check_command(app, argv[1]);
  if (argc > 2 && std::string(argv[1]) == "experiment" && argv[2][0] != '-') {
    const std::string name = argv[2];
    if (name != "all" && name != "list") cli::find_experiment(name, ", all, list");
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& success) {
    if (version) {
      cli::print_text(version_text());
      return exit_done;
    }
    std::ostringstream help;
    app.exit(success, help, help);
    cli::print_text(help.str());
    return exit_done;
  } catch (const CLI::ParseError& error) {
    return complain(std::string(error.what()) + " (see bristle --help)", exit_bad_input);
  }
  cli::set_text_layout(wide);
  if (completion_app->parsed()) cli::print_text(cli::completion_script(app, shell));
  if (manual_app->parsed()) cli::manual_command(app, manual_of, manual_folder);
  if (run_app->parsed()) {
    if (realtime) run_options.realtime = realtime_options;
    cli::run_command(run_options);
  }
  if (!experiment_options.name.empty()) cli::experiment_command(experiment_options);
  if (accuracy_app->parsed()) {
    if (!wanted_error.empty()) accuracy_options.error = parse_share(wanted_error);
    cli::accuracy_command(accuracy_options);
  }
  if (capacity_app->parsed()) {
    capacity_options.deadline_s = parse_time(deadline);
    cli::capacity_command(capacity_options);
  }
  if (fit_app->parsed()) cli::fit_command(fit_options);
  if (report_app->parsed()) cli::report_command(report_options);
  if (stability_app->parsed()) cli::stability_command(stability_options);
  if (sweep_app->parsed()) return run_sweep(*sweep_app, sweep_options, merge_options);
  return exit_done;
}

}  // namespace

int main(int argc, char** argv) {
  cli::hold_standard_streams();
  try {
    return run(argc, argv);
  } catch (const cli::UserError& error) {
    return complain(error.what(), exit_bad_input);
  } catch (const std::bad_alloc&) {
    return complain("out of memory", exit_failure);
  } catch (const std::exception& error) {
    return complain(std::string("failed: ") + error.what(), exit_failure);
  }
}
