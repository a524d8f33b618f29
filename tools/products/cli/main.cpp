// Runs the command line `bristle`. Exit codes: 0 done, 1 an internal failure, 2 bad input (one line on
// stderr).
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>

#include <bristle/error.hpp>
#include <bristle/patch_batch.hpp>

#include "tools/libraries/accuracy/accuracy.hpp"
#include "tools/libraries/capacity/capacity.hpp"
#include "tools/libraries/experiments/command.hpp"
#include "tools/libraries/files/csv_columns.hpp"
#include "tools/libraries/files/nearest_name.hpp"
#include "tools/libraries/files/number_text.hpp"
#include "tools/libraries/files/one_line.hpp"
#include "tools/libraries/files/text_file.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/fitting/fit.hpp"
#include "tools/libraries/platform/platform.hpp"
#include "tools/libraries/reports/conditions.hpp"
#include "tools/libraries/reports/text_layout.hpp"
#include "tools/libraries/run/run.hpp"
#include "tools/libraries/stability/stability.hpp"
#include "tools/libraries/sweep/sweep.hpp"
#include "tools/products/cli/command_tree.hpp"
#include "tools/products/cli/help_text.hpp"
#include "tools/products/cli/option_checks.hpp"

namespace {

constexpr int exit_done = 0;
constexpr int exit_failure = 1;
constexpr int exit_bad_input = 2;

/// Function that runs a command and returns the exit code. It owns the options that the parser fills in.
using Action = std::function<int()>;

template <class Options>
Action action_of(const std::shared_ptr<Options>& options, void (*command)(const Options&)) {
  return [=] {
    command(*options);
    return exit_done;
  };
}

int complain(const std::string& message, int code) {
  cli::print_note("bristle: " + cli::one_line(message) + '\n');
  return code;
}

std::string version_text() {
  const cli::Conditions c = cli::conditions();
  std::string text =
      fmt::format("bristle {}\ncommit   {}\nbuild    {}\nkernels  ", c.version, c.commit, c.flags);
  const std::string chosen = bristle::PatchBatch().isa();
  const char* separator = "";
  for (const bristle::IsaInfo& isa : bristle::instruction_sets()) {
    text += fmt::format("{}{}{}", separator, isa.name,
                        isa.name == chosen ? " (chosen)"
                        : isa.usable       ? ""
                                           : " (not on this machine)");
    separator = ", ";
  }
  if (!BRISTLE_WITH_DOUBLE || !BRISTLE_WITH_TBB)
    text +=
        fmt::format("\nwithout {}{}", BRISTLE_WITH_DOUBLE ? "" : " double precision (BRISTLE_WITH_DOUBLE)",
                    BRISTLE_WITH_TBB ? "" : " threads (BRISTLE_WITH_TBB)");
  return cli::filled(text + '\n');
}

/// Splits a text into the number at its beginning (NaN if there is none) and the unit behind it.
std::pair<double, std::string> number_and_unit(std::string_view text) {
  const double value = cli::take_number<double>(text).value_or(std::nan(""));
  return {value, std::string(cli::trim(text))};
}

/// Parses a time such as "1ms" or "500 us". Refuses a bare number: 1 would mean a second, which nobody wants
/// here.
double parse_time(const std::string& text) {
  const auto [value, unit] = number_and_unit(text);
  const double seconds = value / (unit == "s" ? 1.0 : unit == "ms" ? 1e3 : unit == "us" ? 1e6 : 0.0);
  if (seconds >= 1e-6 && seconds <= 10.0) return seconds;
  throw cli::UserError(
      fmt::format("--deadline is '{}'; allowed: 1us to 10s, with its unit: 1ms, 250us", text));
}

/// Parses a number of bytes such as "500M", "16G", "16GiB" or "1000000".
std::uint64_t parse_memory(const std::string& text) {
  auto [value, unit] = number_and_unit(text);
  if (unit.ends_with("iB")) unit.resize(unit.size() - 2);
  const double per_byte = unit.empty()  ? 1.0
                          : unit == "M" ? 0x1p20
                          : unit == "G" ? 0x1p30
                          : unit == "T" ? 0x1p40
                                        : 0.0;
  if (!(value * per_byte >= 1e6 && value * per_byte <= 1e15))
    throw cli::UserError(
        fmt::format("--memory is '{}'; allowed: 1M to 900T, as a number with M, G or T, or of bytes", text));
  return static_cast<std::uint64_t>(value * per_byte);
}

/// Parses a share such as "1%" or "1 %". Refuses a bare number: 1 would mean all of the force.
double parse_share(const std::string& text) {
  const auto [value, unit] = number_and_unit(text);
  if (unit == "%" && value >= 1e-4 && value <= 100.0) return value / 100.0;
  throw cli::UserError(fmt::format("--error is '{}'; allowed: 0.0001% to 100%, with its unit: 1%", text));
}

/// Parses a list of numbers of threads such as "1,2", for which a command measures.
std::vector<int> parse_threads(const std::string& text) {
  std::vector<int> counts;
  // Adds a comma, so that an empty last count is seen and refused; getline() would leave it out.
  std::istringstream words(text + ',');
  for (std::string word; std::getline(words, word, ',');) {
    const std::optional<int> count = cli::number_in<int>(word);
    if (!count || *count < 1 || *count > 1024)
      throw cli::UserError(fmt::format("--threads is '{}'; allowed: counts from 1 to 1024, as 1,2,4", text));
    counts.push_back(*count);
  }
  return counts;
}

using Assignments = std::vector<std::pair<std::string, std::string>>;

/// Parses an option of assignments, such as --columns: "x=Position,force=Fx".
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

/// Parses a number with a unit. Throws unless its SI value lies between `low` and `high`.
double parse_within(const std::string& text, std::span<const cli::Unit> units, const char* option, double low,
                    double high) {
  const double value = cli::parse_quantity(text, units, option);
  if (value >= low && value <= high) return value;
  throw cli::UserError(
      fmt::format("{} is '{}'; allowed: {} to {} {}", option, text, low, high, units.front().name));
}

/// Adds an option whose value is the name of a file, or several names.
template <class Value>
CLI::Option* add_file(CLI::App* command, const char* option, Value& value, const std::string& description) {
  return command->add_option(option, value, description)->type_name(cli::file_value);
}

void add_report_file(CLI::App* command, std::string& file) {
  add_file(command, "--json", file, "Write the report to this JSON file (- for stdout)");
}

/// Sets the names that shell completion offers as values of an option. --help shows `text` in their place,
/// because all names would make a long line.
CLI::Option* add_names(CLI::Option* option, const cli::NameList& names, const std::string& text) {
  return option->type_name(fmt::format("{}", fmt::join(names, "|")))->option_text(text);
}

void add_isa(CLI::App* command, std::string& isa) {
  cli::NameList names;
  for (const bristle::IsaInfo& known : bristle::instruction_sets())
    if (known.usable) names.emplace_back(known.name);
  add_names(command->add_option("--isa", isa, "Instruction set: see bristle --version"), names, "NAME");
}

/// Adds the options that say how to read the measured data of `bristle fit`.
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
         "Columns by the names that the data give them, e.g. x=Position,force=Fx")
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
  quantity("--rate", cli::frequency_units, 1e-9, 1e12,
           "Samples per second of a file without time, e.g. 100Hz",
           [&](double rate) { options.reading.rate = rate; });
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
}

cli::NameList command_names(const CLI::App& app) {
  cli::NameList names;
  for (const CLI::App* command : cli::subcommands_of(app)) names.push_back(command->get_name());
  return names;
}

// Refuses an unknown command in a message that lists all commands; CLI11 would only say that a subcommand is
// missing.
void check_command(const CLI::App& app, const std::string& name) {
  const cli::NameList known = command_names(app);
  if (std::find(known.begin(), known.end(), name) == known.end())
    throw cli::UserError(fmt::format("'{}' is not a command{}", name, cli::allowed_text(name, known)));
}

/// Returns a note on the script that draws what a command writes by --csv, for a command without --plot. It
/// is empty if the command has no --csv.
std::string drawn_by(const cli::Command& called, const cli::NameList& options) {
  if (std::find(options.begin(), options.end(), "--csv") == options.end()) return {};
  return fmt::format("; tools/plots/{}.gp draws what --csv writes, by gnuplot", called.path.front());
}

/// Returns the message for a command line that CLI11 refused; it begins with the words of the command.
std::string complaint(const CLI::App& program, const CLI::ParseError& error,
                      const std::vector<std::string>& words) {
  cli::Command called{&program, {}};
  while (!called.app->get_subcommands().empty()) {
    called.app = called.app->get_subcommands().front();
    called.path.push_back(called.app->get_name());
  }
  cli::NameList known;
  for (const cli::OptionWords& option : cli::options_of(*called.app))
    if (!option.positional) known.push_back(option.name);
  std::string text = cli::complaint_of(*called.app, error);
  if (dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr)
    for (const std::string& word : words) {
      const std::string name = word.substr(0, word.find('='));
      if (name.starts_with("--") && std::find(known.begin(), known.end(), name) == known.end())
        text = fmt::format("'{}' is not an option of {}{}", name, called.call(),
                           name == "--plot" ? drawn_by(called, known) : cli::meant(name, known));
    }
  return fmt::format("{} (see {} --help)", text, called.call());
}

/// Refuses a second assignment behind an option that takes one (--set a=1 b=2), which CLI11 would take for
/// the command's file.
void check_assignments(const std::vector<std::string>& words) {
  for (std::size_t i = 2; i < words.size(); ++i) {
    const std::string &option = words[i - 2], &first = words[i - 1], &second = words[i];
    const bool again = option == "--set" || option == "--vary" || option == "--reference";
    if (!again && option != "--columns" && option != "--units") continue;
    if (second.starts_with('-') || second.find('=') == std::string::npos) continue;
    if (std::filesystem::exists(std::filesystem::path(second))) continue;  // the file that the command reads
    throw cli::UserError(fmt::format("'{}' has no option before it; write {} {}{}{}", second, option, first,
                                     again ? " " + option + ' ' : ",", second));
  }
}

/// Adds an option whose value is one of some words. An error lists just the words; CLI11's own message would
/// add the numbers behind them.
template <class T>
void add_choice(CLI::App* app, const char* option, std::vector<std::pair<std::string, T>> words, T& chosen,
                const std::string& description) {
  cli::NameList allowed;
  for (const auto& [word, value] : words) allowed.push_back(word);
  const std::string choices = fmt::format("{}", fmt::join(allowed, "|"));
  const auto choose = [option, words = std::move(words), allowed, &chosen](const std::string& text) {
    for (const auto& [word, value] : words) {
      if (word != text) continue;
      chosen = value;
      return;
    }
    throw cli::UserError(fmt::format("{} is '{}'{}", option, text, cli::allowed_text(text, allowed)));
  };
  app->add_option_function<std::string>(option, choose, description)->type_name(choices);
}

// Adds a subcommand per experiment, so that `experiment NAME --help` shows its parameters.
Action add_experiments(CLI::App* all) {
  const auto kept = std::make_shared<cli::ExperimentOptions>();
  cli::ExperimentOptions& options = *kept;
  all->require_subcommand(1);
  all->footer("bristle experiment list shows all parameters; bristle experiment NAME --help those of one.");
  const auto add = [&](const std::string& name, const std::string& title) {
    CLI::App* command = all->add_subcommand(name, title);
    command->parse_complete_callback([&options, name] { options.name = name; });
    return command;
  };
  const auto add_common = [&](CLI::App* command, const cli::Experiment* experiment) {
    command->add_option("--set", options.set, "A parameter: KEY=VALUE, lists with commas; may be repeated")
        ->type_name("KEY=VALUE")
        ->allow_extra_args(false)
        ->trigger_on_parse(false);
    add_file(command, "--config", options.config, "Parameters from a TOML file (tools/README.md)");
    add_names(command->add_option("--models", options.models, "Only these models, e.g. lugre,brush_redraw"),
              cli::models_of(experiment), "NAMES")
        ->delimiter(',');
    add_file(command, "--json", options.json,
             "Write parameters and findings to this JSON file (- for stdout)");
  };
  for (const cli::Experiment& experiment : cli::experiments()) {
    CLI::App* command = add(experiment.name, experiment.title);
    add_common(command, &experiment);
    add_file(command, "--csv", options.csv, "Write the curves to this CSV file (- for stdout)");
    add_file(command, "--plot", options.plot, "Draw them into this PNG or SVG file, by gnuplot");
    command->footer("Parameters for --set and --config:\n" + cli::parameter_table(experiment.parameters));
  }
  CLI::App* every = add("all", "Every experiment, and the tables of all findings");
  add_common(every, nullptr);
  add_file(every, "--markdown", options.markdown,
           "Write the tables and the gallery to this page (- for stdout)");
  add("list", "List experiments, models and parameters");
  return action_of(kept, cli::experiment_command);
}

/// The options of `run --realtime`, and whether --realtime was given at all.
struct RealtimeWish {
  bool wanted = false;
  cli::RealtimeOptions options;
};

/// Adds the option `--realtime`, and the options that are valid only with it.
void add_realtime(CLI::App* run_app, bool& wanted, cli::RealtimeOptions& options) {
  CLI::Option* realtime = run_app->add_flag(
      "--realtime", wanted,
      "Step against the clock, alternating with a bare sleep loop; Ctrl-C stops it and prints the report");
  run_app->add_option("--rate", options.rate_hz, "Ticks per second, e.g. 1000; the scene's dt becomes 1/rate")
      ->check(cli::within(1.0, 1e5))
      ->needs(realtime);
  run_app->add_option("--fifo", options.thread.fifo_priority, "Real-time priority (SCHED_FIFO), if permitted")
      ->check(cli::within(1, 99))
      ->needs(realtime);
  run_app->add_option("--core", options.thread.core, "Bind the loop to this core")
      ->check(cli::within(0, 1023))
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
  add_file(run_app, "--histograms", options.histograms,
           "Write histograms of step time and jitter to this CSV file (- for stdout)")
      ->needs(realtime);
}

Action add_sweep(CLI::App* sweep) {
  const auto kept = std::make_shared<cli::SweepOptions>();
  cli::SweepOptions& options = *kept;
  add_file(sweep, "SCENE", options.study.scene, "Scene file, TOML (tools/scenes/README.md)")->required();
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
  sweep->add_option("--repeat", options.study.repeat, "Rows at each point, each with seeds by its index")
      ->check(cli::within(std::uint64_t{1}, std::uint64_t{10'000'000}));
  sweep->add_option("--seed", options.study.seed, "Of the rows' seeds")
      ->check(cli::within(std::uint32_t{0}, std::numeric_limits<std::uint32_t>::max()));
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
      ->type_name("FROM:UNTIL")
      ->option_text("FROM:UNTIL");
  sweep->add_option("--steps", options.study.steps, "Steps, instead of the scene's duration")
      ->check(cli::within(std::uint64_t{1}, std::uint64_t{1'000'000'000'000}));
  add_file(sweep, "--out,--csv", options.out,
           "Write the table to this CSV file (- for stdout), until it is done to FILE.part");
  add_report_file(sweep, options.json);
  sweep->add_option("--threads", options.threads, "Rows at a time; 0 = one per core")
      ->check(cli::within(0, 1024));
  add_isa(sweep, options.isa);
  sweep->footer("A sweep that was stopped or killed is resumed by the same command.");
  return [kept] { return cli::sweep_command(*kept); };
}

/// Adds --wide (lines of any length) to a command that prints figures, and to its subcommands.
void add_wide(CLI::App& command, bool& wide) {
  const std::vector<CLI::App*> below = command.get_subcommands([](const CLI::App*) { return true; });
  if (command.get_name() != "experiment")
    command.add_flag("--wide", wide, "All columns, in lines as long as they get (default: 80 columns)");
  for (CLI::App* sub : below) add_wide(*sub, wide);
}

Action add_run(CLI::App* command) {
  const auto kept = std::make_shared<cli::RunOptions>();
  const auto realtime = std::make_shared<RealtimeWish>();
  cli::RunOptions& options = *kept;
  add_file(command, "SCENE", options.scene, "Scene file, TOML (tools/scenes/README.md)")->required();
  add_file(command, "--trace", options.trace, "Motion file, CSV t,x,y,load, in place of the scene's motion");
  command
      ->add_option("--clip-load", options.clip_load,
                   "Loads of that file from minus this, N, to 0 count as 0: the zero of a force sensor")
      ->check(cli::within(0.0, 1e9));
  add_file(command, "--csv,--out", options.out, "Write forces to this CSV file (- for stdout)");
  add_file(command, "--plot", options.plot, "Draw the forces, PNG or SVG (needs gnuplot)");
  add_file(command, "--html", options.html,
           "Write report and picture to this page, which opens offline (needs gnuplot)");
  add_report_file(command, options.json);
  command->add_option("--threads", options.threads, "Threads that step; 0 = one per core")
      ->check(cli::within(0, 1024));
  add_isa(command, options.isa);
  command->add_option("--steps", options.steps, "Steps, instead of the scene's duration")
      ->check(cli::within(std::uint64_t{1}, std::uint64_t{1'000'000'000'000}));
  command
      ->add_option("--bristles", options.bristles,
                   "Representative bristles of each patch, instead of the scene's")
      ->check(cli::within(std::uint32_t{1}, bristle::max_bristles_per_patch));
  add_realtime(command, realtime->wanted, realtime->options);
  command
      ->add_option_function<std::string>(
          "--memory", [&](const std::string& size) { options.limits.bytes = parse_memory(size); },
          "What the scene may take, e.g. 16G, in place of what is free; lifts the limits of bristles, "
          "patches and materials")
      ->type_name("SIZE");
  add_file(command, "--restore-state", options.restore_state,
           "Continue from this file, written by a run of the same scene");
  add_file(command, "--save-state", options.save_state, "Write where the run ended to this file");
  return [kept, realtime] {
    if (realtime->wanted) kept->realtime = realtime->options;
    cli::run_command(*kept);
    return exit_done;
  };
}

void add_rule(CLI::App* command, bristle::SnapRule& rule, const std::string& description) {
  add_choice(command, "--rule",
             {{"redraw", bristle::SnapRule::redraw},
              {"keep", bristle::SnapRule::keep},
              {"slide", bristle::SnapRule::slide}},
             rule, description);
}

Action add_capacity(CLI::App* command) {
  const auto kept = std::make_shared<cli::CapacityOptions>();
  const auto deadline = std::make_shared<std::string>("1ms");
  cli::CapacityOptions& options = *kept;
  command->add_option("--deadline", *deadline, "Time for a step, e.g. 1ms or 250us")
      ->type_name("TIME")
      ->capture_default_str();
  command->add_flag("--quick", options.quick, "Fewer rows, shorter runs");
  command->add_flag("--targets", options.targets, "Only the library's speed targets");
  command
      ->add_option_function<std::string>(
          "--threads", [&](const std::string& text) { options.threads = parse_threads(text); },
          "Thread counts, e.g. 1,2")
      ->type_name("COUNTS");
  add_isa(command, options.isa);
  add_report_file(command, options.json);
  add_file(command, "--csv", options.csv, "Write step time against bristles to this CSV file");
  return [kept, deadline] {
    kept->deadline_s = parse_time(*deadline);
    cli::capacity_command(*kept);
    return exit_done;
  };
}

Action add_fit(CLI::App* command) {
  const auto kept = std::make_shared<cli::FitOptions>();
  cli::FitOptions& options = *kept;
  add_file(command, "DATA", options.data,
           "Measured friction, CSV t,x,load,force (tools/libraries/fitting/README.md); several files are one "
           "record")
      ->required();
  add_reading(command, options);
  add_choice(
      command, "--sign",
      {{"auto", cli::ForceSign::automatic}, {"on", cli::ForceSign::on_body}, {"by", cli::ForceSign::by_body}},
      options.sign,
      "Whose force: on the body (opposes the motion) or by the body; default: found from the data");
  add_choice(command, "--law",
             {{"lognormal", bristle::SnapLaw::lognormal},
              {"normal", bristle::SnapLaw::normal},
              {"uniform", bristle::SnapLaw::uniform},
              {"exponential", bristle::SnapLaw::exponential},
              {"free", bristle::SnapLaw::table}},
             options.law, "Family of snap lengths (default lognormal); free: any, with --rule slide");
  add_choice(command, "--rule", {{"redraw", bristle::SnapRule::redraw}, {"slide", bristle::SnapRule::slide}},
             options.rule, "What a bristle does at its limit (default: what predicts better)");
  add_choice(
      command, "--decay",
      {{"exponential", bristle::DamperDecay::exponential}, {"gaussian", bristle::DamperDecay::gaussian}},
      options.decay, "Decay of the damper with speed (default exponential)");
  command
      ->add_option("--residual", options.residual,
                   "Hold the residual at this share of the presliding length (default: fitted)")
      ->check(cli::within(0.0, cli::widest_residual));
  command->add_option("--renewal", options.renewal, "Hold the shared renewal (default: fitted)")
      ->check(cli::within(0.0, cli::most_renewed));
  command->add_flag(
      "--rivals", options.rivals,
      "Fit Coulomb, LuGre and Maxwell-slip too, to every other block of time; judge all on the rest");
  command
      ->add_option("--fit-until", options.fit_until,
                   "With --rivals: fit to the first so many seconds instead of blocks all over the record")
      ->check(cli::within(1e-9, 1e9));
  command->add_flag(
      "--joint", options.joint,
      "The friction of a robot's joint: DATA is a log t,angle,speed,motor,outside (s, rad, rad/s, N m)");
  command
      ->add_option("--torque-constant", options.torque_constant,
                   "With --joint and a column current: N m of motor torque at the joint for an ampere")
      ->check(cli::within(1e-9, 1e9));
  command
      ->add_option("--pendulum", options.pendulum,
                   "With --joint: a weight hangs on it, N m at the horizontal, straight down at angle 0")
      ->check(cli::within(-1e9, 1e9));
  add_file(command, "--write", options.write, "Write the material, in a scene that replays the data, TOML");
  add_file(command, "--plot", options.plot, "Draw the fit over the data, PNG or SVG (needs gnuplot)");
  add_file(command, "--html", options.html,
           "Write tables and picture to this page, which opens offline (needs gnuplot)");
  add_report_file(command, options.json);
  add_file(command, "--csv", options.csv, "Write data, fit and residuals to this CSV file (- for stdout)");
  return [kept, command] {
    for (const char* const option : {"--load", "--clip-load", "--rate", "--mass", "--radius", "--disc",
                                     "--sign", "--law", "--rule", "--decay", "--residual", "--renewal"})
      if (kept->joint && command->count(option) > 0)
        throw cli::UserError(fmt::format(
            "{}: of a contact; a joint's log is read by --columns, --units, --torque-constant, --pendulum",
            option));
    kept->choose_rule = command->count("--rule") == 0;
    cli::fit_command(*kept);
    return exit_done;
  };
}

Action add_stability(CLI::App* command) {
  const auto kept = std::make_shared<cli::StabilityOptions>();
  cli::StabilityOptions& options = *kept;
  command->add_flag("--quick", options.quick, "A coarser map, shorter runs");
  command->add_option("--threads", options.threads, "Threads that simulate; 0 = one per core")
      ->check(cli::within(0, 1024));
  add_choice(command, "--population",
             {{"representatives", bristle::Population::representatives},
              {"infinite", bristle::Population::infinite}},
             options.population, "What stands for the bristles of the maps and the slope");
  add_rule(command, options.rule, "What a bristle of theirs does at its limit (default redraw)");
  add_report_file(command, options.json);
  add_file(command, "--csv", options.csv, "Write the map to this CSV file (- for stdout)");
  return action_of(kept, cli::stability_command);
}

Action add_accuracy(CLI::App* command) {
  const auto kept = std::make_shared<cli::AccuracyOptions>();
  const auto error = std::make_shared<std::string>();
  cli::AccuracyOptions& options = *kept;
  add_file(command, "SCENE", options.scene, "Scene file, TOML (tools/scenes/README.md)")->required();
  command->add_option("--error", *error, "Wanted error of the force, rms, e.g. 1%")->type_name("SHARE");
  command->add_flag("--quick", options.quick, "Fewer settings, less than a minute");
  command->add_option("--seconds", options.seconds, "Time to spend, about")->check(cli::within(0.5, 1e5));
  add_isa(command, options.isa);
  add_report_file(command, options.json);
  add_file(command, "--csv", options.csv, "Write the settings to this CSV file (- for stdout)");
  return [kept, error] {
    if (!error->empty()) kept->error = parse_share(*error);
    cli::accuracy_command(*kept);
    return exit_done;
  };
}

Action add_completion(CLI::App* command) {
  command->footer("The package installs it where bash looks.");
  return [command] {
    cli::print_text(cli::completion_script(*command->get_parent()));
    return exit_done;
  };
}

/// A command of the program: its name, its line in --help, and the function that adds its options.
struct CommandEntry {
  const char* name;
  const char* description;
  const char* example;
  Action (*add)(CLI::App* command);
  bool prints_figures = true;  ///< whether the command prints figures, and so has the option --wide
};

/// The commands of the program, in the order in which --help lists them.
constexpr CommandEntry entries[] = {
    {"run", "Step a scene and report forces, step times and the state hash",
     "bristle run tools/scenes/block_on_floor.toml", add_run},
    {"capacity", "How many bristles fit in a deadline on this machine",
     "bristle capacity --quick --deadline 1ms", add_capacity},
    {"experiment", "Repeat a classic friction experiment, the brush beside its rivals",
     "bristle experiment stick-slip --plot stick_slip.png", add_experiments},
    {"fit", "A material from measured friction", "bristle fit measured.csv --load 2N --write material.toml",
     add_fit},
    {"stability", "Closed-loop stability of a mass on a patch, simulated, beside linear theory",
     "bristle stability --quick", add_stability},
    {"sweep", "A scene over a grid of parameters, as one table",
     "bristle sweep tools/scenes/three_populations.toml --vary material.skin.peak=0.45:0.6:4", add_sweep},
    {"accuracy", "Error against run time of a scene, the cheapest setting for an error",
     "bristle accuracy tools/scenes/fingertip.toml --quick --error 1%", add_accuracy},
    {"completion", "Print what bash needs to complete words of this command line",
     "source <(bristle completion)", add_completion, false}};

int run(const std::vector<std::string>& words) {
  CLI::App app("Friction by the brush model: contact patches of bristles that bend and snap.", "bristle");
  app.formatter(std::make_shared<cli::HelpText>());  // set before subcommands exist, because they inherit it
  bool version = false;
  // Acts on --version as soon as it is read. Otherwise the parser would ask for a command.
  app.add_flag_callback(
      "--version",
      [&] {
        version = true;
        throw CLI::Success();
      },
      "Version, commit, and the instruction sets of this build");

  app.require_subcommand(0, 1);

  bool wide = false;
  std::vector<std::pair<const CLI::App*, Action>> actions;
  for (const CommandEntry& entry : entries) {
    CLI::App* command = app.add_subcommand(entry.name, entry.description);
    actions.emplace_back(command, entry.add(command));
    command->footer(fmt::format("{}{}\n{}", cli::example_line, entry.example, command->get_footer()));
    if (entry.prints_figures) add_wide(*command, wide);
  }
  cli::refuse_empty_files(app, cli::file_value);
  if (!words.empty() && !words[0].starts_with('-')) check_command(app, words[0]);
  if (words.size() > 1 && words[0] == "experiment" && !words[1].starts_with('-')) {
    const std::string& name = words[1];
    if (name != "all" && name != "list") cli::find_experiment(name, {"all", "list"});
  }
  check_assignments(words);
  try {
    app.parse(std::vector<std::string>(words.rbegin(), words.rend()));  // CLI11 takes words from the back
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
    return complain(complaint(app, error, words), exit_bad_input);
  }
  cli::set_text_layout(wide);
  for (const auto& [command, act] : actions)
    if (command->parsed()) return act();
  cli::print_text(app.help());
  return exit_done;
}

}  // namespace

int main(int argc, char** argv) {
  cli::platform::hold_standard_streams();
  try {
    return run(std::vector<std::string>(argv + std::min(argc, 1), argv + argc));
  } catch (const cli::UserError& error) {
    return complain(error.what(), exit_bad_input);
  } catch (const bristle::Error& error) {
    // Thrown, for example, for an instruction set that the machine lacks.
    return complain(error.what(), exit_bad_input);
  } catch (const std::filesystem::filesystem_error& error) {
    // Thrown, for example, if the working folder was removed.
    return complain(
        fmt::format("{}: {}", error.path1().empty() ? "the working folder" : error.path1().string(),
                    error.code().message()),
        exit_bad_input);
  } catch (const std::bad_alloc&) {
    return complain("out of memory", exit_failure);
  } catch (const std::exception& error) {
    return complain(std::string("failed: ") + error.what(), exit_failure);
  }
}
