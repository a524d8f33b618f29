// The part of the page about `bristle accuracy`.
#include <cmath>

#include <fmt/format.h>

#include "tools/reports/conditions.hpp"
#include "tools/reports/report.hpp"

namespace cli {
namespace {

using Json = nlohmann::ordered_json;

std::string text_of(const Json& json, const char* key) { return json.at(key).get<std::string>(); }

std::string microseconds(const Json& seconds) { return number_text(seconds, 1e6); }

std::string bristles_text(const Json& setting) {
  if (setting.at("as_scene").get<bool>()) return "as in the scene";
  return count_text(setting.at("bristles").get<unsigned long long>());
}

std::string setting_text(const Json& s) {
  return fmt::format("bristles a patch: {}, steps of {}, {} rule, {} precision, {} sampling, {} force",
                     bristles_text(s), time_text(s.at("dt_s").get<double>()), text_of(s, "step_rule"),
                     text_of(s, "precision"), text_of(s, "sampling"), text_of(s, "force"));
}

HtmlTable front_table(const Json& accuracy) {
  HtmlTable table({"bristles", "dt", "<rule", "<precision", "<sampling", "<force", "error, rms %", "max %",
                   "energy %", "µs a scene step", "ns a bristle"});
  for (const Json& s : accuracy.at("settings")) {
    if (!s.at("pareto").get<bool>()) continue;
    const Json& error = s.at("error");
    table.add({bristles_text(s), time_text(s.at("dt_s").get<double>()), text_of(s, "step_rule"),
               text_of(s, "precision"), text_of(s, "sampling"), text_of(s, "force"),
               percent_text(error.at("rms")), percent_text(error.at("max")), percent_text(error.at("energy")),
               microseconds(s.at("scene_step_s")), number_text(s.at("ns_per_bristle"))});
  }
  return table;
}

HtmlTable slopes_table(const Json& accuracy) {
  HtmlTable table({"<patch", "<error against", "slope", "±", "points", "<theory"});
  for (const Json& s : accuracy.at("slopes")) {
    const auto two_places = [](const Json& value) {
      return value.is_null() ? std::string("-") : fmt::format("{:.2f}", value.get<double>());
    };
    table.add({text_of(s, "patch"), text_of(s, "against"), two_places(s.at("slope")),
               two_places(s.at("standard_error")), number_text(s.at("points")), text_of(s, "theory")});
  }
  return table;
}

HtmlTable features_table(const Json& accuracy) {
  HtmlTable table(
      {"<feature", "<here", "leaving it out saves %", "quartiles", "error with %", "without %", "<so"});
  const auto whole = [](const Json& share) {
    return fmt::format("{:.0f}", std::round(100.0 * share.get<double>()) + 0.0);
  };
  for (const Json& f : accuracy.at("features")) {
    if (f.contains("saves")) {
      table.add({text_of(f, "feature"), text_of(f, "state"), whole(f.at("saves")),
                 whole(f.at("quartiles").at(0)) + " to " + whole(f.at("quartiles").at(1)),
                 percent_text(f.at("error_with")), percent_text(f.at("error_without")),
                 text_of(f, "advice")});
    } else {
      table.add({text_of(f, "feature"), text_of(f, "state"), "-", "-", "-", "-", text_of(f, "advice")});
    }
  }
  return table;
}

void add_recommendation(HtmlPage& page, const Json& accuracy) {
  const Json& best = accuracy.at("recommendation");
  const std::string wanted = percent_text(best.at("wanted_error"));
  if (!best.at("found").get<bool>()) {
    page.warning(fmt::format("No setting tried meets {} %; the least error in the search is {} %.", wanted,
                             percent_text(best.at("least_error"))));
    return;
  }
  page.paragraph(fmt::format("The cheapest setting with at most {} % rms: {}.", wanted,
                             setting_text(best.at("setting"))));
  HtmlTable table({"<", "error, rms %", "max %", "energy %", "µs a scene step"});
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
      percent_text(best.at("share_of_deadline")), setting_text(best.at("setting")),
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
  for (const Picture& picture : measurement.pictures) {
    page.picture(picture.bytes, picture.media_type,
                 "Error of the force against CPU time of a step, scene " + name +
                     ". Down and left is better; the yellow band is where people begin to notice "
                     "a difference of force.");
  }
  page.heading("Recommended");
  add_recommendation(page, accuracy);
  page.heading("The front: nothing tried is both faster and better");
  page.table(front_table(accuracy));
  const std::size_t tried = accuracy.at("settings").size(), dropped = accuracy.at("not_run").size();
  page.paragraph(fmt::format(
      "Out of {} settings measured{}.", tried,
      dropped ? fmt::format("; {} more were too slow for the time given", dropped) : std::string()));
  page.heading("Orders of convergence");
  page.paragraph("Slopes fitted on log-log scales, beside the theory.");
  page.table(slopes_table(accuracy));
  page.heading("What the scene could leave out");
  page.paragraph("With and without, in turns, all else as in the scene.");
  page.table(features_table(accuracy));
}

}  // namespace cli
