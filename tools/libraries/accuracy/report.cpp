// Writes reports of `bristle accuracy`: tables for people, JSON for programs, CSV for the plot.
#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "tools/libraries/accuracy/accuracy.hpp"
#include "tools/libraries/reports/answers.hpp"
#include "tools/libraries/reports/conditions.hpp"
#include "tools/libraries/reports/numbers.hpp"
#include "tools/libraries/reports/report_tables.hpp"

namespace cli {
namespace {

// Relative change of friction that people just notice by touch, a lower and an upper estimate. The report
// compares errors with it.
constexpr double discrimination_low = 0.07, discrimination_high = 0.10;

// Pieces per mean snap length into which an infinite patch cuts its path when the option `resolution` is 0.
constexpr double default_resolution = 8.0;

std::string percent(double share) { return fmt::format("{:.3g}", 100.0 * share); }

std::string microseconds(double seconds) { return fmt::format("{:.3g}", 1e6 * seconds); }

const char* output_name(const Setting& s) { return s.mean ? "mean" : "end"; }

// Names of a setting's options as the report shows them. The row of the unchanged scene shows the options of
// its first patch.
struct Shown {
  const char *population, *rule, *precision;
  double resolution;  // pieces of path per mean snap length, for an infinite patch
};
Shown shown(const Scene& scene, const Setting& s) {
  const bristle::PatchOptions o = apply(scene, s, scene.dt, 0).patches.front().options;
  if (s.paper_loop) return {"the paper's loop", "paper", "double", 0.0};
  const char* const precision = o.precision == bristle::Precision::single ? "single" : "double";
  if (o.population == bristle::Population::infinite)
    return {"infinite", "exact", precision, o.resolution > 0.0 ? o.resolution : default_resolution};
  return {"representatives", "exact", precision, 0.0};
}

// Returns the time of a step divided by the number of representatives, ns; unset if all patches are infinite.
std::optional<double> ns_per_bristle(const Scene& scene, const SettingResult& s) {
  const std::uint64_t bristles = total_bristles(scene, s.setting);
  if (bristles == 0) return std::nullopt;
  return 1e9 * s.step_s() / static_cast<double>(bristles);
}

std::vector<const SettingResult*> sorted(const AccuracyResult& r) {
  std::vector<const SettingResult*> rows;
  for (const SettingResult& s : r.settings) rows.push_back(&s);
  std::sort(rows.begin(), rows.end(), [&](const SettingResult* a, const SettingResult* b) {
    return scene_step_s(r, *a) < scene_step_s(r, *b);
  });
  return rows;
}

std::string cheapest_text(const AccuracyResult& r, const CheapestOf& c) {
  return fmt::format("{}: {} % at {} us a scene step",
                     setting_name(c.setting, r.reference_dt_s * c.setting.parts), percent(c.error),
                     microseconds(c.scene_step_s));
}

// Returns the sentence of the report that says whether representatives or the infinite brush are cheaper.
std::string populations_text(const AccuracyResult& r) {
  const CheapestOf &bristles = r.cheapest[0], &infinite = r.cheapest[1];
  const std::string wanted = percent(r.recommendation.wanted);
  if (!r.no_infinite.empty())
    return fmt::format("The infinite brush is not compared: {}.\n\n", r.no_infinite);
  if (!bristles.found && !infinite.found)
    return fmt::format("Neither representatives nor the infinite brush tried has at most {} % rms.\n\n",
                       wanted);
  if (!infinite.found)
    return fmt::format(
        "Cheapest with at most {} % rms: representatives; no infinite brush tried reaches it.\n"
        "  {}\n\n",
        wanted, cheapest_text(r, bristles));
  if (!bristles.found)
    return fmt::format(
        "Cheapest with at most {} % rms: the infinite brush; no number of representatives tried "
        "reaches it.\n  {}\n\n",
        wanted, cheapest_text(r, infinite));
  const bool wins = infinite.scene_step_s < bristles.scene_step_s;
  const CheapestOf &first = wins ? infinite : bristles, &second = wins ? bristles : infinite;
  return fmt::format(
      "Cheapest with at most {} % rms: {}, {:.3g} times cheaper than {}.\n  {}\n  {}\n\n", wanted,
      wins ? "the infinite brush" : "representatives", second.scene_step_s / first.scene_step_s,
      wins ? "representatives" : "the infinite brush", cheapest_text(r, first), cheapest_text(r, second));
}

std::string head(const Scene& scene, const AccuracyResult& r) {
  std::string text = populations_text(r) + fmt::format("{}\nscene {}: steps of {}, deadline {}\n",
                                                       measured_with(conditions(), r.isa), scene.name,
                                                       time_text(scene.dt), time_text(scene.deadline));
  text += fmt::format(
      "reference: exact rule, {} precision, steps of {}, mean of {} runs of {} bristles a patch\n",
      r.reference_double ? "double" : "single", time_text(r.reference_dt_s), r.reference_runs,
      count_text(r.reference_bristles));
  for (std::size_t p = 0; p < r.floor.size(); ++p) {
    text += fmt::format("  {}: its own error {} % rms", scene.patches[p].name, percent(r.floor[p]));
    if (p < r.reference_closed_form.size() && r.reference_closed_form[p])
      text +=
          fmt::format(", {} % off the closed form of first loading", percent(*r.reference_closed_form[p]));
    text += '\n';
  }
  if (r.copies_compared < r.copies)
    text += fmt::format("errors over {} of {} patches, times over all\n", count_text(r.copies_compared),
                        count_text(r.copies));
  text +=
      "\nErrors: difference of forces from the limit of many bristles, over the rms of the force, of the "
      "patch that is worst; the scatter that a patch with so many real bristles would have is part of it. "
      "Times: one thread's CPU, median over rounds. A scene step is one dt of the scene, in however many "
      "steps.\n";
  if (!r.no_paper_loop.empty())
    text += fmt::format("The paper's loop is not among the settings: {}.\n", r.no_paper_loop);
  if (!scene.bodies.empty()) {
    text +=
        "Bodies: forces are compared at equal times. Breaking away or stopping a little earlier or later "
        "counts as error until both are at rest again, and then the force still holds what the stop left; "
        "few bristles make that large.\n";
  }
  return text;
}

std::string threads_text(int threads) {
  return threads == 0 ? "a thread per core"
                      : fmt::format("{} {}", threads, threads == 1 ? "thread" : "threads");
}

std::string recommendation_text(const Scene& scene, const AccuracyResult& r) {
  const Recommendation& best = r.recommendation;
  if (!best.found)
    return fmt::format(
        "no setting tried meets {} % with other seeds too; the least error in the search is {} %\n",
        percent(best.wanted), percent(best.least_error));
  const double parts = static_cast<double>(r.scene_parts) / best.setting.parts;
  std::string text = fmt::format(
      "Cheapest setting with at most {} % rms: {}\n  in the search  {} % at {} us a scene step\n"
      "  run again      {} % rms, {} % max, {} % energy at {} us a scene step (other seeds)\n"
      "  as a scene     p99 {}, max {} a step, {} of {} over {} ({} by this program; {})\n",
      percent(best.wanted), setting_name(best.setting, r.reference_dt_s * best.setting.parts),
      percent(best.promised.rms), microseconds(best.promised_step_s * parts), percent(best.confirmed.rms),
      percent(best.confirmed.max), percent(best.confirmed.energy),
      microseconds(best.confirmed_step_s * parts), time_text(best.p99_s), time_text(best.max_s),
      count_text(best.misses), count_text(best.steps), time_text(scene.deadline / parts),
      count_text(best.misses_ours), threads_text(scene.threads));
  const double share = best.confirmed_step_s * parts / scene.deadline;
  text += fmt::format("  deadline       one thread needs {} % of {}{}\n", percent(share),
                      time_text(scene.deadline),
                      share > 1.0 ? ": it does not fit; allow a larger error, or more threads" : "");
  if (best.confirmed.path > 0.0)
    text += fmt::format("  position off by at most {:.3g} m\n", best.confirmed.path);
  return text + "\n" + scene_fragment(scene, r);
}

Json error_json(const PatchError& e) {
  return {{"rms", e.rms}, {"max", e.max}, {"energy", e.energy}, {"position_m", e.path}};
}

Json setting_fields(const Scene& scene, const AccuracyResult& r, const Setting& s) {
  const Shown show = shown(scene, s);
  return {{"as_scene", s.as_scene},
          {"population", show.population},
          {"resolution", show.resolution > 0.0 ? Json(show.resolution) : Json(nullptr)},
          {"bristles", s.as_scene || s.is_infinite() ? Json(nullptr) : Json(s.bristles)},
          {"dt_s", r.reference_dt_s * s.parts},
          {"step_rule", show.rule},
          {"precision", show.precision},
          {"force", output_name(s)}};
}

Json setting_json(const Scene& scene, const AccuracyResult& r, const SettingResult& s) {
  Json row = setting_fields(scene, r, s.setting);
  row["error"] = error_json(s.worst());
  row["error"]["rms_standard_error"] = s.rms_spread();
  row["runs"] = s.errors.size();
  row["step_s"] = {{"median", s.step_s()}, {"quartiles", {s.step_s(0.25), s.step_s(0.75)}}};
  row["scene_step_s"] = scene_step_s(r, s);
  const std::optional<double> per_bristle = ns_per_bristle(scene, s);
  row["ns_per_bristle"] = per_bristle ? Json(*per_bristle) : Json(nullptr);
  row["usable"] = is_usable(r, s.setting);
  row["pareto"] = s.on_front;
  row["patches"] = Json::array();
  for (std::size_t p = 0; p < scene.patches.size(); ++p) {
    Json patch = error_json(SettingResult::over_runs(s.errors, p));
    patch["name"] = scene.patches[p].name;
    if (!s.same_steps.empty()) patch["rms_at_equal_steps"] = SettingResult::over_runs(s.same_steps, p).rms;
    if (!s.pairs.empty()) patch["rms_to_same_bristles"] = SettingResult::over_runs(s.pairs, p).rms;
    if (!s.closed_form.empty() && s.closed_form[p]) patch["rms_to_closed_form"] = *s.closed_form[p];
    row["patches"].push_back(patch);
  }
  return row;
}

Json recommendation_json(const Scene& scene, const AccuracyResult& r) {
  const Recommendation& best = r.recommendation;
  Json json = {{"wanted_error", best.wanted}, {"found", best.found}, {"least_error", best.least_error}};
  if (!best.found) return json;
  const double parts = static_cast<double>(r.scene_parts) / best.setting.parts;
  json["setting"] = setting_fields(scene, r, best.setting);
  json["search"] = {{"error", error_json(best.promised)}, {"scene_step_s", best.promised_step_s * parts}};
  json["confirmed"] = {{"error", error_json(best.confirmed)},
                       {"scene_step_s", best.confirmed_step_s * parts}};
  json["as_scene"] = {{"steps", best.steps},   {"p99_s", best.p99_s},
                      {"max_s", best.max_s},   {"deadline_s", scene.deadline / parts},
                      {"misses", best.misses}, {"misses_ours", best.misses_ours}};
  json["share_of_deadline"] = best.confirmed_step_s * parts / scene.deadline;
  json["fragment"] = scene_fragment(scene, r);
  return json;
}

Json populations_json(const Scene& scene, const AccuracyResult& r) {
  Json rows = Json::array();
  for (const CheapestOf& c : r.cheapest) {
    Json row = {{"population", c.infinite ? "infinite" : "representatives"}, {"found", c.found}};
    if (c.found) {
      row["setting"] = setting_fields(scene, r, c.setting);
      row["error_rms"] = c.error;
      row["scene_step_s"] = c.scene_step_s;
    }
    if (c.infinite && !r.no_infinite.empty()) row["not_compared"] = r.no_infinite;
    rows.push_back(row);
  }
  return rows;
}

Json report_of(const Scene& scene, const AccuracyOptions& options, const AccuracyResult& r) {
  Json report = {{"schema", "bristle-accuracy-1"}};
  report["conditions"] = to_json(conditions());
  report["conditions"]["isa"] = r.isa;
  report["scene"] = {
      {"name", scene.name}, {"file", scene.file}, {"dt_s", scene.dt}, {"deadline_s", scene.deadline}};
  report["quick"] = options.quick;
  report["wall_s"] = r.seconds;
  report["force_discrimination"] = {discrimination_low, discrimination_high};
  Json reference = {{"dt_s", r.reference_dt_s},
                    {"bristles", r.reference_bristles},
                    {"runs", r.reference_runs},
                    {"precision", r.reference_double ? "double" : "single"}};
  reference["patches"] = Json::array();
  for (std::size_t p = 0; p < scene.patches.size(); ++p) {
    Json patch = {{"name", scene.patches[p].name},
                  {"standard_error", r.floor[p]},
                  {"path_m", r.path[p]},
                  {"step_over_mean_snap_length", r.step_over_snap[p]}};
    if (p < r.reference_closed_form.size() && r.reference_closed_form[p])
      patch["rms_to_closed_form"] = *r.reference_closed_form[p];
    reference["patches"].push_back(patch);
  }
  report["reference"] = reference;
  report["patches_compared"] = r.copies_compared;
  report["patch_count"] = r.copies;
  report["paired_bristles"] = r.pair_bristles;
  report["settings"] = Json::array();
  for (const SettingResult* s : sorted(r)) report["settings"].push_back(setting_json(scene, r, *s));
  report["not_run"] = r.not_run;
  report["slopes"] = Json::array();
  for (const SlopeResult& s : r.slopes) {
    const bool fits = s.fit.points >= 2;
    report["slopes"].push_back({{"patch", s.patch},
                                {"against", s.sweep},
                                {"slope", fits ? Json(s.fit.slope) : Json(nullptr)},
                                {"standard_error", s.fit.points > 2 ? Json(s.fit.error) : Json(nullptr)},
                                {"points", s.fit.points},
                                {"theory", s.theory}});
  }
  report["recommendation"] = recommendation_json(scene, r);
  report["populations"] = populations_json(scene, r);
  return report;
}

}  // namespace

std::string scene_fragment(const Scene& scene, const AccuracyResult& r) {
  const Setting& best = r.recommendation.setting;
  std::string text;
  if (best.parts != r.scene_parts)
    text += fmt::format("[scene]\ndt = {:.12g}\ndeadline = {:.12g}\n\n", r.reference_dt_s * best.parts,
                        scene.deadline * best.parts / r.scene_parts);
  for (std::size_t p = 0; p < scene.patches.size(); ++p) {
    const bristle::PatchOptions o = apply(scene, best, scene.dt, 0).patches[p].options;
    text += fmt::format("[[patch]]\nname = \"{}\"\n{}\nprecision = \"{}\"\n", scene.patches[p].name,
                        o.population == bristle::Population::infinite
                            ? fmt::format("population = \"infinite\"\nresolution = {}", o.resolution)
                            : fmt::format("bristles = {}", o.bristles),
                        o.precision == bristle::Precision::single ? "single" : "double");
    if (p + 1 < scene.patches.size()) text += '\n';
  }
  return text;
}

std::uint64_t total_bristles(const Scene& scene, const Setting& setting) {
  std::uint64_t total = 0;
  for (const ScenePatch& patch : scene.patches) {
    const bristle::Material& m = scene.materials[patch.material].material;
    if (setting.as_scene ? patch.options.population == bristle::Population::infinite : setting.is_infinite())
      continue;
    std::uint64_t n = setting.as_scene ? patch.options.bristles : setting.bristles;
    if (n == 0) {
      const double all = std::ceil(m.bristles_in_contact(patch.options.max_normal_load));
      n = static_cast<std::uint64_t>(std::clamp(all, 1.0, 4096.0));
    }
    total += n * patch.count;
  }
  return total;
}

std::string accuracy_table(const Scene& scene, const AccuracyOptions& options, const AccuracyResult& r) {
  const Json report = report_of(scene, options, r);
  std::string text = accuracy_answer(report) + '\n' + head(scene, r);
  text += "\nAll settings, by time\n\n" + settings_table(report, false).text();
  if (!r.not_run.empty())
    text += fmt::format("{} settings more were too slow for the time given (--seconds): {}{}\n",
                        r.not_run.size(), r.not_run.front(), r.not_run.size() > 1 ? ", ..." : "");
  text += fmt::format(
      "\nThe front: nothing tried is both faster and better. (Steps no longer than the scene's, the force it "
      "uses: {}.)\n"
      "People notice differences of force from {:.0f} to {:.0f} % up.\n\n",
      r.own_mean ? "mean" : "end", 100.0 * discrimination_low, 100.0 * discrimination_high);
  text += settings_table(report, true).text();
  text += fmt::format(
      "\nOrders of convergence, fitted on log-log scales above three times the error of what they are "
      "compared with "
      "(bristles: the reference at the scene's dt; steps: the same {} bristles, double, steps of {})\n\n",
      count_text(r.pair_bristles), time_text(r.reference_dt_s));
  text += slopes_table(report).text() + '\n' + recommendation_text(scene, r);
  text += fmt::format("\n{} in all\n", time_text(r.seconds));
  return text;
}

std::string accuracy_json(const Scene& scene, const AccuracyOptions& options, const AccuracyResult& r) {
  return json_text(report_of(scene, options, r));
}

std::string accuracy_csv(const Scene& scene, const AccuracyResult& r) {
  Json rows = Json::array();
  for (const SettingResult* s : sorted(r)) {
    rows.push_back(setting_json(scene, r, *s));
    if (s->setting.as_scene)
      rows.back()["bristles"] = total_bristles(scene, s->setting) / scene.patch_count();
  }
  if (r.recommendation.found) {
    SettingResult best;
    best.setting = r.recommendation.setting;
    best.errors = {std::vector<PatchError>(scene.patches.size(), r.recommendation.confirmed)};
    best.times = {{r.recommendation.confirmed_step_s, 0.0, 1}};
    rows.push_back(setting_json(scene, r, best));
    rows.back()["recommended"] = true;
  }
  const double floor =
      r.floor.empty() ? 0.0 : std::max(0.0, *std::max_element(r.floor.begin(), r.floor.end()));
  for (Json& row : rows) {
    if (!row.contains("recommended")) row["recommended"] = false;
    row["deadline_s"] = scene.deadline;
    row["reference_error"] = floor;
  }
  static constexpr CsvColumn columns[] = {{"bristles", "/bristles"},
                                          {"dt_s", "/dt_s"},
                                          {"step_rule", "/step_rule"},
                                          {"precision", "/precision"},
                                          {"force", "/force"},
                                          {"as_scene", "/as_scene"},
                                          {"usable", "/usable"},
                                          {"pareto", "/pareto"},
                                          {"recommended", "/recommended"},
                                          {"error_rms", "/error/rms"},
                                          {"error_rms_se", "/error/rms_standard_error"},
                                          {"error_max", "/error/max"},
                                          {"error_energy", "/error/energy"},
                                          {"position_m", "/error/position_m"},
                                          {"step_us", "/step_s/median", 1e6},
                                          {"step_us_q1", "/step_s/quartiles/0", 1e6},
                                          {"step_us_q3", "/step_s/quartiles/1", 1e6},
                                          {"scene_step_us", "/scene_step_s", 1e6},
                                          {"ns_per_bristle", "/ns_per_bristle"},
                                          {"runs", "/runs"},
                                          {"deadline_us", "/deadline_s", 1e6},
                                          {"reference_error", "/reference_error"},
                                          {"population", "/population"},
                                          {"resolution", "/resolution"}};
  return csv_text(rows, columns);
}

}  // namespace cli
