// The part of the page about `bristle accuracy`.
#include <fmt/format.h>

#include "tools/reports/answers.hpp"
#include "tools/reports/charts.hpp"
#include "tools/reports/numbers.hpp"
#include "tools/reports/report.hpp"
#include "tools/reports/report_tables.hpp"

namespace cli {
namespace {

std::string microseconds(const Json& seconds) { return number_text(seconds, 1e6); }

void add_recommendation(HtmlPage& page, const Json& accuracy) {
  const Json& best = accuracy.at("recommendation");
  const std::string wanted = percent_text(best.at("wanted_error"));
  if (!best.at("found").get<bool>()) {
    page.warning(fmt::format("No setting tried meets {} %; the least error in the search is {} %.", wanted,
                             percent_text(best.at("least_error"))));
    return;
  }
  page.paragraph(fmt::format("The cheapest setting with at most {} % rms: {}.", wanted,
                             setting_in_words(best.at("setting"))));
  Table table({"<", "error, rms %", "max %", "energy %", "µs a scene step"});
  for (const auto& [key, name] :
       {std::pair{"search", "in the search"}, std::pair{"confirmed", "run again, other seeds"}}) {
    const Json &run = best.at(key), &error = run.at("error");
    table.add({name, percent_text(error.at("rms")), percent_text(error.at("max")),
               percent_text(error.at("energy")), microseconds(run.at("scene_step_s"))});
  }
  page.table(table);
  const Json& real = best.at("as_scene");
  page.paragraph(fmt::format(
      "One thread needs {} % of the deadline. Run as a scene, a step takes {} at p99 and {} at most; {} of "
      "{} "
      "steps were late, {} of them by the library's own time, the others by what else the machine did.",
      percent_text(best.at("share_of_deadline")), time_text(real.at("p99_s").get<double>()),
      time_text(real.at("max_s").get<double>()), count_text(real.at("misses").get<unsigned long long>()),
      count_text(real.at("steps").get<unsigned long long>()),
      count_text(real.at("misses_ours").get<unsigned long long>())));
  page.paragraph("To paste into the scene:");
  page.preformatted(text_of(best, "fragment"));
}

}  // namespace

std::vector<std::string> accuracy_summary(const Json& accuracy) {
  const std::string scene = text_of(accuracy.at("scene"), "name");
  const Json& best = accuracy.at("recommendation");
  const std::string wanted = percent_text(best.at("wanted_error"));
  if (!best.at("found").get<bool>()) return {fmt::format("{}: no setting tried meets {} %.", scene, wanted)};
  return {fmt::format(
      "{}: an error of {} % costs {} µs a step of the scene, {} % of its deadline on one thread ({}); "
      "measured again with other seeds: {} %.",
      scene, wanted, microseconds(best.at("confirmed").at("scene_step_s")),
      percent_text(best.at("share_of_deadline")), setting_in_words(best.at("setting")),
      percent_text(best.at("confirmed").at("error").at("rms")))};
}

void add_accuracy(HtmlPage& page, const std::string& id, const Measurement& measurement) {
  const Json& accuracy = measurement.json;
  const Json &scene = accuracy.at("scene"), &reference = accuracy.at("reference");
  const std::string name = text_of(scene, "name");
  page.part(id, name);
  page.paragraph(fmt::format(
      "Scene {}: steps of {}, deadline {}. Reference: exact rule, {} precision, steps of {}, mean "
      "of {} runs of {} bristles a patch.",
      name, time_text(scene.at("dt_s").get<double>()), time_text(scene.at("deadline_s").get<double>()),
      text_of(reference, "precision"), time_text(reference.at("dt_s").get<double>()),
      number_text(reference.at("runs")), count_text(reference.at("bristles").get<unsigned long long>())));
  std::vector<std::string> patches;
  for (const Json& patch : reference.at("patches")) {
    patches.push_back(fmt::format(
        "patch {}: the reference's own error is {} %{}", text_of(patch, "name"),
        percent_text(patch.at("standard_error")),
        patch.contains("rms_to_closed_form")
            ? fmt::format(", and {} % off the closed form", percent_text(patch.at("rms_to_closed_form")))
            : std::string()));
  }
  page.list(patches);
  page.charts(accuracy_chart(accuracy),
              "Error of the force against CPU time of a step, scene " + name +
                  ". Point at a setting for its values. The front is of settings that the scene could take: "
                  "steps no longer than its own, and the force that it uses.");
  for (const Picture& picture : measurement.pictures) {
    page.picture(picture.bytes, picture.media_type,
                 "Error of the force against CPU time of a step, scene " + name +
                     ". Down and left is better; the yellow band is where people begin to notice "
                     "a difference of force.");
  }
  page.heading("Recommended");
  add_recommendation(page, accuracy);
  page.heading("The front: nothing tried is both faster and better");
  page.table(settings_table(accuracy, Medium::page, true));
  const std::size_t tried = accuracy.at("settings").size(), dropped = accuracy.at("not_run").size();
  page.paragraph(fmt::format(
      "Out of {} settings measured{}.", tried,
      dropped ? fmt::format("; {} more were too slow for the time given", dropped) : std::string()));
  page.heading("Orders of convergence");
  page.paragraph("Slopes fitted on log-log scales, beside the theory.");
  page.table(slopes_table(accuracy, Medium::page));
  page.heading("What the scene could leave out");
  page.paragraph("With and without, in turns, all else as in the scene.");
  page.table(scene_features_table(accuracy, Medium::page));
}

}  // namespace cli
