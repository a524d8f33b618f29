// Writes the reports of `bristle run`: a table for people and JSON for programs.
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include <fmt/format.h>

#include "tools/libraries/files/one_line.hpp"
#include "tools/libraries/reports/conditions.hpp"
#include "tools/libraries/reports/numbers.hpp"
#include "tools/libraries/reports/report_tables.hpp"
#include "tools/libraries/run/run.hpp"

namespace cli {
namespace {

std::string joined(const std::vector<std::string>& texts) {
  std::string all;
  for (const std::string& text : texts) all += (all.empty() ? "" : ", ") + text;
  return all.empty() ? "nothing" : all;
}

/// Returns the resolution of an infinite patch, in pieces per mean snap length: the option or, where that is
/// 0 (automatic), what the patch chose.
double resolution_of(const bristle::PatchOptions& options, const bristle::PatchInfo& info) {
  return options.resolution > 0.0 ? options.resolution : info.representatives;
}

std::string name_of(const ScenePatch& patch) {
  return patch.count == 1 ? patch.name : fmt::format("{} x {}", patch.name, count_text(patch.count));
}

// Largest number of rows in a table for people. The JSON report has all rows.
constexpr std::size_t rows_shown = 12;

std::string more_rows(std::size_t rows) {
  return rows > rows_shown ? fmt::format("... and {} more patches: see --json\n", rows - rows_shown)
                           : std::string();
}

std::string size_text(const RunResult& r, std::size_t patch_count) {
  std::string text = r.bristles > 0 || r.infinite_patches == 0
                         ? fmt::format("{} bristles in ", count_text(r.bristles))
                         : std::string();
  fmt::format_to(std::back_inserter(text), "{} {}", count_text(patch_count),
                 patch_count == 1 ? "patch" : "patches");
  if (r.infinite_patches > 0)
    fmt::format_to(std::back_inserter(text), ", {} of infinitely many bristles",
                   count_text(r.infinite_patches));
  return text + fmt::format(", {} kB", count_text((r.memory_bytes + 1023) / 1024));
}

/// Returns the kind of a patch's population and its number of bristles, as text.
std::string population_text(const bristle::PatchOptions& options, const bristle::PatchInfo& info) {
  if (options.population == bristle::Population::infinite)
    return fmt::format("infinite, resolution {}{}", resolution_of(options, info),
                       options.bristles == 0 ? "" : fmt::format(" (bristles = {} unused)", options.bristles));
  return fmt::format("{} representatives", count_text(info.representatives));
}

std::string head(const Scene& scene, const RunOptions& options, const RunResult& r) {
  std::string text;
  const auto line = [&](const char* label, const std::string& value) {
    fmt::format_to(std::back_inserter(text), "{:<12}{}\n", label, value);
  };
  const Conditions c = conditions();
  const bristle::DeadlineMonitor& m = r.monitor;
  // Passes the description through one_line(), because it comes from a file and may contain control
  // characters.
  line("scene", scene.name + (scene.description.empty() ? "" : ": " + one_line(scene.description)));
  line("library", fmt::format("bristle {}, commit {}, {}, {} kernels, {} {}", c.version, c.commit, c.flags,
                              r.isa, r.threads, r.threads == 1 ? "thread" : "threads"));
  line("machine", c.cpu);
  const std::size_t patch_count = scene.patch_count();
  line("size", size_text(r, patch_count));
  line("steps", fmt::format("{} of {}: {} simulated in {}", count_text(r.steps), time_text(scene.dt),
                            time_text(static_cast<double>(r.steps) * scene.dt), time_text(r.seconds)));
  if (r.steps_before > 0)
    line("restored",
         fmt::format("{}: continues after {} steps", options.restore_state, count_text(r.steps_before)));
  line("step time", fmt::format("p50 {}   p99 {}   p99.9 {}   max {}", time_text(m.p50()), time_text(m.p99()),
                                time_text(m.p999()), time_text(m.max())));
  line("deadline",
       fmt::format("{}: {} late ({} by this program, {} by the machine)", time_text(m.deadline()),
                   count_text(m.misses()), count_text(m.misses_ours()), count_text(m.misses_machine())));
  for (const ScenePatch& patch : scene.patches) {
    if (!patch.motion || patch.motion->type != MotionType::trace) continue;
    const MotionFile& trace = *patch.motion->trace;
    line("trace", fmt::format("{}: {} rows over {}{}", one_line(trace.name), count_text(trace.rows.size()),
                              time_text(trace.rows.back().t),
                              trace.ignored_columns.empty()
                                  ? ""
                                  : "; columns not used: " + one_line(joined(trace.ignored_columns))));
  }
  if (!options.out.empty())
    line("forces", fmt::format("{}: {} of {} patches{}", options.out, count_text(r.patches_written),
                               count_text(patch_count),
                               r.patches_written < patch_count ? " (out_patches in the scene)" : ""));
  return text;
}

/// Returns tables of forces, friction and energies of the first patches, from the results of the run.
std::string patch_tables(const Scene& scene, const Json& run) {
  static const std::vector<JsonColumn> of_forces = {column("<force on the body", "/title"),
                                                    column("load N", "/load", "{:.4f}"),
                                                    column("<along", "/axis"),
                                                    column("mean N", "/mean", "{:.4f}"),
                                                    column("rms", "/rms", "{:.4f}"),
                                                    column("min", "/min", "{:.4f}"),
                                                    column("max", "/max", "{:.4f}")};
  static const std::vector<JsonColumn> of_friction = {
      column("<friction / load", "/title"),
      column("sliding", "/coefficient/sliding", "{:.4f}"),
      column("in theory", "/coefficient/kinetic_theory", "{:.4f}"),
      column("highest", "/coefficient/highest", "{:.4f}"),
      column("in theory at first loading", "/coefficient/peak_theory", "{:.4f}"),
      column("steps overloaded", "/status/overload", "count"),
      column("bad input", "/status/bad_input", "count")};
  static const std::vector<JsonColumn> of_energies = {
      column("<energy", "/title"), column("snaps", "/energy/snaps", "count"),
      column("lost in snaps J", "/energy/dissipated", "{:.4g}"),
      column("with contacts J", "/energy/contact_loss", "{:.4g}"),
      column("in dampers J", "/energy/damper_work", "{:.4g}")};
  Json forces, patches, energies;
  for (std::size_t p = 0; p < std::min(scene.patches.size(), rows_shown); ++p) {
    Json& patch = patches.emplace_back(run.at("patches").at(p));
    patch["title"] = name_of(scene.patches[p]);
    for (const auto& [axis, force] : patch["force"].items()) {
      forces.push_back({{"title", ""}, {"load", ""}, {"axis", axis}});
      if (axis == "x") forces.back().update({{"title", patch["title"]}, {"load", patch["load"]["mean"]}});
      forces.back().update(force);
    }
    if (patch.contains("energy")) energies.push_back(patch);
  }
  const std::string more = more_rows(scene.patches.size()) + '\n';
  return tabulate(forces, of_forces).text() + more + tabulate(patches, of_friction).text() + more +
         (energies.empty() ? std::string() : tabulate(energies, of_energies).text() + more);
}

/// Returns sentences on loads above those for which patches were made. There are none if no load was.
std::string overload_answer(const Scene& scene, const RunResult& r) {
  std::string text;
  std::size_t said = 0;
  for (std::size_t p = 0; p < r.patches.size() && said < 3; ++p) {
    const PatchResult& patch = r.patches[p];
    if (patch.overload_steps == 0) continue;
    ++said;
    const std::uint64_t steps = patch.load.count;
    text += fmt::format(
        "OVERLOAD of {} in {}: up to {:.4g} N on a max_normal_load of {:.4g} N, so that its bristles are "
        "fewer "
        "and stiffer than the load asks for.\n",
        scene.patches[p].name,
        patch.overload_steps == steps
            ? std::string("every step")
            : fmt::format("{} of {} steps", count_text(patch.overload_steps), count_text(steps)),
        patch.load.max, scene.patches[p].options.max_normal_load);
  }
  return text;
}

// Writes reasons without commas. In the tables of sweeps a comma would need quotes.

/// Returns the reason why a patch's friction stayed below the peak of its material.
std::string peak_reason(const ScenePatch& patch, const bristle::Material& m, double dt,
                        const FirstLoading& first) {
  const double mean = m.snap_length.mean(), path = first.path();
  const auto um = [](double length) { return fmt::format("{:.4g} um", 1e6 * length); };
  if (first.most_load == 0.0) return "the run continues another whose first loading is past";
  const std::string load_rose =
      first.most_load > 1.02 * first.least_load
          ? fmt::format("the load rose from {:.3g} to {:.3g} N meanwhile", first.least_load, first.most_load)
          : "";
  if (path < mean)
    return fmt::format("its first loading {} {} and the peak comes within {}{}{}",
                       first.turned ? "turned back after" : "went no farther than", um(path),
                       um(m.residual_length + mean), load_rose.empty() ? "" : "; ", load_rose);
  if (first.longest_step > 0.05 * mean)
    return fmt::format(
        "it was passed in steps of up to {:.2g} mean snap lengths and only their ends count; a dt of {} "
        "shows "
        "it",
        first.longest_step / mean, time_text(0.02 * dt * mean / first.longest_step));
  if (!load_rose.empty()) return load_rose;
  if (!(patch.options.lay == bristle::Lay{})) return "its lay has other peaks across and back";
  if (m.ageing_strength > 0.0) return "with ageing it depends on speed and rest";
  if (first.turned) return fmt::format("its first loading turned back after {}", um(path));
  return "its few bristles ripple";
}

/// Returns the reason why a patch's friction rose above the peak of its material.
std::string crossing_reason(const ScenePatch& patch, const bristle::Material& m, const PatchResult& result,
                            double over_peak) {
  if (m.ageing_strength > 0.0 || m.speed_strengthening > 0.0) return "friction grows at rest or with speed";
  if (m.snap_rule == bristle::SnapRule::redraw && m.shared_renewal == 0.0 && over_peak > 1.2)
    return "rubbed without shared renewal it hardens";
  if (patch.options.population == bristle::Population::infinite)
    return result.load.max > 1.02 * result.load.min ? "its load changes in sliding"
                                                    : "after a reversal it rises higher than at first";
  return fmt::format("its {} bristles ripple", result.info.representatives);
}

/// Returns a sentence for a body that stuck in the run with less than a twentieth of critical damping, and so
/// rings on its bristles: it names the damping that would stop that. Returns "" for other bodies.
std::string ringing_answer(const Scene& scene, const RunResult& r, std::size_t b) {
  const SceneBody& body = scene.bodies[b];
  if (r.bodies[b].sticking.stuck == 0.0 || (body.spring && body.spring->damping > 0.0)) return {};
  double load = 0.0, bristles = 0.0, stiffness = 0.0, damping = 0.0;
  for (const std::size_t p : body.patches) {
    const bristle::Material& m = scene.materials[scene.patches[p].material].material;
    const double on_copies = scene.patches[p].count * r.patches[p].load.mean();
    load += on_copies;
    bristles += m.bristles_in_contact(on_copies);
    stiffness += m.bristles_in_contact(on_copies) * m.bristle_stiffness;
    damping +=
        m.bristles_in_contact(on_copies) * m.bristle_damping + scene.patches[p].count * m.viscous_friction;
  }
  const bool by_coefficients =
      scene.materials[scene.patches[body.patches.front()].material].coefficients.has_value();
  const double quarter = 0.5 * std::sqrt(stiffness * body.mass);  // of critical damping, N s/m
  if (!(load > 0.0) || damping > 0.2 * quarter) return {};
  return fmt::format(
      "{} rings on its bristles when it sticks, because {} damps it; {} = {:.3g} in its material, a "
      "quarter of critical, brings it to rest.\n",
      body.name, damping > 0.0 ? "hardly anything" : "nothing",
      by_coefficients ? "damping_per_newton" : "bristle_damping",
      quarter / (by_coefficients ? load : bristles));
}

/// Returns the run's main result in words: whether the steps keep the deadline, and the friction.
std::string run_answer(const Scene& scene, const RunResult& r) {
  const bristle::DeadlineMonitor& m = r.monitor;
  std::string text = overload_answer(scene, r);
  text += fmt::format("A step of {} takes {}, {} % of its {}{}; ", scene.name, time_text(m.p50()),
                      number_text(m.p50() / m.deadline(), 100.0), time_text(m.deadline()),
                      r.threads == 1 ? " on one thread" : fmt::format(" on {} threads", r.threads));
  text += m.misses() == 0
              ? "no step was late.\n"
              : fmt::format("{} of {} were late, {} by this program, {} because the machine was busy.\n",
                            count_text(m.misses()), count_text(m.count()), count_text(m.misses_ours()),
                            count_text(m.misses_machine()));
  for (std::size_t b = 0; b < std::min<std::size_t>(r.bodies.size(), 3); ++b) {
    const Sticking& s = r.bodies[b].sticking;
    const double all = static_cast<double>(r.steps) * scene.dt;
    text += s.broke_away
                ? fmt::format("{} breaks away after {} at {:.3g} N applied, and sticks for {} of {}.\n",
                              scene.bodies[b].name, time_text(s.time), s.applied, time_text(s.stuck),
                              time_text(all))
                : fmt::format("{} sticks all the time.\n", scene.bodies[b].name);
    text += ringing_answer(scene, r, b);
  }
  std::size_t said = 0;
  std::uint64_t bad = 0;
  for (std::size_t p = 0; p < r.patches.size(); ++p) {
    const PatchResult& patch = r.patches[p];
    bad += patch.bad_steps;
    if (!(patch.sliding_load > 0.0) || said == 3) continue;
    ++said;
    text += fmt::format("{} slides at {:.3f} of its load (theory{} {:.3f}), and rubs with {:.3f} at most.\n",
                        scene.patches[p].name, patch.sliding_force / patch.sliding_load,
                        scene.patches[p].options.lay == bristle::Lay{} ? "" : " along its lay",
                        scene.materials[scene.patches[p].material].material.kinetic_coefficient(),
                        patch.highest_coefficient);
  }
  if (said == 0) text += "No patch slid for long enough to say its sliding friction.\n";
  said = 0;
  for (std::size_t p = 0; p < r.patches.size() && said < 3; ++p) {
    const std::string missed = missed_peak(scene, r.patches[p], p);
    if (missed.empty()) continue;
    ++said;
    text += missed + ".\n";
  }
  if (bad > 0)
    text += fmt::format("BAD INPUT in {} steps of patches: motions or loads that are no numbers.\n", bad);
  return text;
}

std::string feature_table(const Scene& scene, const RunResult& r) {
  Table table({"<features used", "<population", "<kernel", "bytes"});
  for (std::size_t p = 0; p < std::min(r.patches.size(), rows_shown); ++p) {
    const ScenePatch& patch = scene.patches[p];
    const bristle::PatchInfo& info = r.patches[p].info;
    table.add({name_of(patch), population_text(patch.options, info), info.kernel,
               patch.options.population == bristle::Population::infinite
                   ? fmt::format("{} a patch", count_text(info.memory_bytes))
                   : fmt::format("{} a bristle", info.bytes_per_representative)});
    table.add_note(
        fmt::format("  left out  {}", joined(left_out(patch, scene.materials[patch.material].material))));
  }
  std::string text = table.text() + more_rows(r.patches.size());
  if (r.threads == 1) text += "no worker threads\n";
  return text;
}

std::string body_table(const Json& run) {
  static const std::vector<JsonColumn> columns = {
      column("<body", "/name"),
      column("x m", "/position/0", "{:.6g}"),
      column("y m", "/position/1", "{:.6g}"),
      {"speed m/s",
       [](const Json& row) {
         const auto v = row.at("velocity").get<std::array<double, 2>>();
         return Cell(fmt::format("{:.3g}", std::sqrt(v[0] * v[0] + v[1] * v[1])));
       }},
      column("highest", "/highest_speed", "{:.3g}"),
      column("solver calls", "/solver/evaluations", "count"),
      column("most in a step", "/solver/worst_evaluations", "count"),
      column("worst residual", "/solver/worst_residual", "{:.1e}")};
  return tabulate(run.at("bodies"), columns).text();
}

Json patch_json(const Scene& scene, const PatchResult& r, std::size_t p) {
  const ScenePatch& scene_patch = scene.patches[p];
  const bristle::Material& material = scene.materials[scene_patch.material].material;
  const std::string missed = missed_peak(scene, r, p);
  const bristle::Outputs outputs = scene_patch.options.outputs;
  const bool infinite = scene_patch.options.population == bristle::Population::infinite;
  Json patch = {{"name", scene_patch.name},
                {"count", scene_patch.count},
                {"population", infinite ? "infinite" : "representatives"},
                {"resolution", infinite ? Json(resolution_of(scene_patch.options, r.info)) : Json(nullptr)},
                {"kernel", r.info.kernel},
                {"left_out", left_out(scene_patch, material)},
                {"bristles", infinite ? Json(nullptr) : Json(r.info.representatives)},
                {"weight", infinite ? Json(nullptr) : Json(r.info.weight)},
                {"bytes_per_bristle", infinite ? Json(nullptr) : Json(r.info.bytes_per_representative)},
                {"memory_bytes", r.memory_bytes},
                {"load", r.load}};
  Json force = {{"x", r.force[0]}};
  if (scene_patch.options.axes == 2) force["y"] = r.force[1];
  patch["force"] = force;
  if (has(outputs, bristle::Outputs::mean)) {
    Json mean_force = {{"x", r.mean_force[0]}};
    if (scene_patch.options.axes == 2) mean_force["y"] = r.mean_force[1];
    patch["mean_force"] = mean_force;
  }
  patch["coefficient"] = {
      {"sliding", r.sliding_load > 0.0 ? Json(r.sliding_force / r.sliding_load) : Json(nullptr)},
      {"sliding_steps", r.sliding_steps},
      {"kinetic_theory", material.kinetic_coefficient()},
      {"highest", r.highest_coefficient},
      {"peak_theory", material.peak_coefficient()},
      {"missed_peak", missed.empty() ? Json(nullptr) : Json(missed)}};
  if (has(outputs, bristle::Outputs::energy)) {
    Json energy = {{"snaps", r.snaps},
                   {"dissipated", r.dissipated},
                   {"contact_loss", r.contact_loss},
                   {"damper_work", r.damper_work},
                   {"stored", r.stored}};
    if (has(outputs, bristle::Outputs::mean)) {
      energy["work"] = r.work;
      energy["balance_error"] = r.work - r.stored - r.dissipated - r.contact_loss - r.damper_work;
    }
    patch["energy"] = energy;
  }
  patch["status"] = {
      {"steps_in_contact", r.steps_in_contact}, {"overload", r.overload_steps}, {"bad_input", r.bad_steps}};
  return patch;
}

}  // namespace

void to_json(Json& json, const ForceStatistics& f) {
  json = {{"mean", f.mean()}, {"rms", f.rms()}, {"min", f.min}, {"max", f.max}};
}

std::string missed_peak(const Scene& scene, const PatchResult& result, std::size_t p) {
  const ScenePatch& patch = scene.patches[p];
  const bristle::Material& m = scene.materials[patch.material].material;
  const double peak = m.peak_coefficient(), highest = result.highest_coefficient;
  if (result.steps_in_contact == 0 || (highest > 0.98 * peak && highest < 1.02 * peak)) return {};
  if (highest > peak)
    return fmt::format(
        "{} reaches {:.3f} of its load and so more than its peak of {:.3f} at first loading: {}", patch.name,
        highest, peak, crossing_reason(patch, m, result, highest / peak));
  return fmt::format("{} reaches {:.3f} of its load and not its peak of {:.3f}: {}", patch.name, highest,
                     peak, peak_reason(patch, m, scene.dt, result.first_loading));
}

std::string run_table(const Scene& scene, const RunOptions& options, const RunResult& r) {
  const Json run = run_results(scene, r);
  std::string text = run_answer(scene, r) + '\n' + head(scene, options, r) + '\n' +
                     (r.realtime ? realtime_table(*r.realtime, r.threads) + '\n' : "") +
                     patch_tables(scene, run);
  if (!r.bodies.empty()) text += body_table(run) + '\n';
  text += feature_table(scene, r);
  text += fmt::format("\nstate hash  {:016x}\n", r.state_hash);
  return text;
}

Json run_results(const Scene& scene, const RunResult& r) {
  const bristle::DeadlineMonitor& m = r.monitor;
  Json report = {{"steps", r.steps},
                 {"wall_s", r.seconds},
                 {"step_time",
                  {{"p50_s", m.p50()},
                   {"p99_s", m.p99()},
                   {"p999_s", m.p999()},
                   {"max_s", m.max()},
                   {"mean_s", m.mean()}}}};
  report["patches"] = Json::array();
  for (std::size_t p = 0; p < scene.patches.size(); ++p)
    report["patches"].push_back(patch_json(scene, r.patches[p], p));
  report["bodies"] = Json::array();
  for (std::size_t b = 0; b < r.bodies.size(); ++b) {
    const BodyResult& body = r.bodies[b];
    report["bodies"].push_back(
        {{"name", scene.bodies[b].name},
         {"position", body.position},
         {"velocity", body.velocity},
         {"highest_speed", body.highest_speed},
         {"broke_away_s", body.sticking.broke_away ? Json(body.sticking.time) : Json(nullptr)},
         {"broke_away_n", body.sticking.broke_away ? Json(body.sticking.applied) : Json(nullptr)},
         {"stuck_s", body.sticking.stuck},
         {"solver",
          {{"evaluations", body.solve.iterations},
           {"worst_evaluations", body.solve.worst_iterations},
           {"worst_residual", body.solve.worst_residual}}}});
  }
  report["state_hash"] = fmt::format("{:016x}", r.state_hash);
  return report;
}

std::string run_json(const Scene& scene, const RunOptions& options, const RunResult& r) {
  const bristle::DeadlineMonitor& m = r.monitor;
  Json report = {{"schema", "bristle-run-1"}};
  report["conditions"] = to_json(conditions());
  report["conditions"]["isa"] = r.isa;
  report["conditions"]["threads"] = r.threads;
  report["scene"] = {{"name", scene.name}, {"file", scene.file}, {"dt", scene.dt}};
  report["steps_before"] = r.steps_before;
  report["simulated_s"] = static_cast<double>(r.steps) * scene.dt;
  report["deadline"] = {{"deadline_s", m.deadline()},
                        {"misses", m.misses()},
                        {"misses_ours", m.misses_ours()},
                        {"misses_machine", m.misses_machine()}};
  if (r.realtime) report["realtime"] = to_json(*r.realtime, r.threads);
  report["bristles"] = r.bristles;
  report["patch_count"] = scene.patch_count();
  report["memory_bytes"] = r.memory_bytes;
  report.update(run_results(scene, r));
  report["traces"] = Json::array();
  for (const ScenePatch& patch : scene.patches) {
    if (!patch.motion || patch.motion->type != MotionType::trace) continue;
    const MotionFile& trace = *patch.motion->trace;
    report["traces"].push_back({{"patch", patch.name},
                                {"file", trace.name},
                                {"rows", trace.rows.size()},
                                {"length_s", trace.rows.back().t},
                                {"ignored_columns", trace.ignored_columns}});
  }
  if (!options.out.empty()) report["forces"] = {{"file", options.out}, {"patches", r.patches_written}};
  return json_text(report);
}

}  // namespace cli
