// The part of the page about `bristle stability`.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "tools/reports/charts.hpp"
#include "tools/reports/numbers.hpp"
#include "tools/reports/report.hpp"
#include "tools/reports/report_tables.hpp"

namespace cli {
namespace {

Table rests_table(const Json& stability) {
  static const std::vector<JsonColumn> columns = {text_column("<coupling", "scheme"),
                                                  number_column("simulated s", "seconds"),
                                                  number_column("settled within µm", "first_second_m", 1e6),
                                                  number_column("crept from then on, m", "creep_m")};
  return tabulate(stability.at("rests"), columns, Medium::page);
}

Table cases_table(const Json& stability) {
  Table table({"<case", "<scheme", "k", "c", "start speed m/s", "<verdict", "peak to peak / mean length"});
  for (const Json& row : stability.at("cases")) {
    const double dt = row.at("dt_s").get<double>(), mass = row.at("mass_kg").get<double>();
    bool first = true;
    for (const Json& start : row.at("starts")) {
      const auto once = [&](std::string text) { return first ? text : std::string(); };
      table.add({once(text_of(row, "name")), once(text_of(row, "scheme")),
                 once(number_text(row.at("stiffness_n_per_m"), dt * dt / mass)),
                 once(number_text(row.at("damping_ns_per_m"), dt / mass)),
                 number_text(start.at("start_velocity_m_per_s")), text_of(start, "verdict"),
                 number_text(start.at("peak_to_peak_m"), 1.0 / row.at("mean_snap_length_m").get<double>())});
      first = false;
    }
  }
  return table;
}

double critical(const Json& row, const char* key) {
  return row.at("critical_stiffness_n_per_m").at(key).get<double>();
}

Table pulled_table(const Json& pulled) {
  const auto on_a_quarter = [](const char* low, const char* high, double scale) {
    return [low, high, scale](const Json& row) {
      const Json& soft = row.at("on_a_quarter");
      return Cell(range_text({soft.at(low), soft.at(high)}, scale));
    };
  };
  static const std::vector<JsonColumn> columns = {
      text_column("<contact", "contact"),
      text_column("<coupling", "scheme"),
      number_column("mass kg", "mass_kg"),
      number_column("load N", "load_n"),
      number_column("pull µm/s", "speed_m_per_s", 1e6),
      {"k_c by theory, N/m",
       [](const Json& row) { return Cell(number_text(row.at("critical_stiffness_n_per_m").at("theory"))); }},
      {"measured over it",
       [](const Json& row) {
         return Cell(fmt::format("{:.3f}", critical(row, "measured") / critical(row, "theory")));
       }},
      {"on a quarter of it: force N", on_a_quarter("lowest_force_n", "highest_force_n", 1.0)},
      {"speed over pull", on_a_quarter("slowest_over_pull", "fastest_over_pull", 1.0)}};
  return tabulate(pulled, columns, Medium::page);
}

void add_pulled(HtmlPage& page, const std::string& id, const Json& pulled) {
  page.part(id + "-pulled", "Pulled slowly on a spring");
  page.paragraph(
      "A mass on a spring whose end is pulled at constant speed over a contact that ages (infinite brush). "
      "Below the critical stiffness k_c steady sliding turns into stick-slip: by linear theory, and by "
      "bisection. A lowest speed of 0 is sticking.");
  page.table(pulled_table(pulled));
}

}  // namespace

std::vector<std::string> stability_summary(const Json& stability) {
  std::vector<std::string> lines;
  const Json& maps = stability.at("maps");
  if (!maps.empty()) {
    const auto less = [](const Json& a, const Json& b) {
      return a.at("fraction_agreeing").get<double>() < b.at("fraction_agreeing").get<double>();
    };
    const Json &worst = *std::min_element(maps.begin(), maps.end(), less),
               &best = *std::max_element(maps.begin(), maps.end(), less);
    lines.push_back(fmt::format(
        "Closed loops do what linear theory says in {} % ({}) to {} % ({}) of the cells of their maps.",
        percent_text(worst.at("fraction_agreeing")), text_of(worst, "scheme"),
        percent_text(best.at("fraction_agreeing")), text_of(best, "scheme")));
  }
  double creep = 0.0, seconds = 0.0;
  for (const Json& row : stability.at("rests")) {
    creep = std::max(creep, std::abs(row.at("creep_m").get<double>()));
    seconds = std::max(seconds, row.at("seconds").get<double>());
  }
  if (seconds > 0.0)
    lines.push_back(fmt::format("A block on a slope creeps by at most {} m in {} simulated seconds.",
                                number_text(creep), number_text(seconds)));
  double worst = 0.0;
  const Json pulled = stability.value("pulled", Json::array());  // not in reports of older builds
  for (const Json& row : pulled)
    worst = std::max(worst, std::abs(critical(row, "measured") / critical(row, "theory") - 1.0));
  if (!pulled.empty())
    lines.push_back(
        fmt::format("Contacts that age stick and slip below the stiffness of linear theory, to within {} %.",
                    percent_text(worst)));
  return lines;
}

void add_stability(HtmlPage& page, const std::string& id, const Measurement& measurement) {
  const Json& stability = measurement.json;
  const Json &k = stability.at("k"), &second = stability.at("c_or_beta");
  page.paragraph(fmt::format(
      "A mass m on one patch of stiffness K and damping C, stepped by T, no applied force: k = K T²/m from "
      "{} "
      "to {}, c = C T/m (for devices their own damping b, β = b T/m) from {} to {}. Each cell is run from a "
      "push within presliding and from steady sliding; the worse counts.",
      number_text(k.at(0)), number_text(k.at(k.size() - 1)), number_text(second.at(0)),
      number_text(second.at(second.size() - 1))));
  page.list({"settles: the energy falls to the end of the run",
             "rings: bristles keep snapping, with an amplitude of a snap length or so",
             "grows: the energy rises, and nothing snaps yet or there is no bound"});
  page.charts(stability_charts(stability),
              "What the simulation does over k and c: blue settles, yellow grows, "
              "orange rings. Point at a cell for its values.");
  for (const Picture& picture : measurement.pictures) {
    page.picture(picture.bytes, picture.media_type,
                 "What the simulation does over k and c (colour), and the limit of linear theory (line).");
  }
  page.part(id + "-agreement", "Agreement with linear theory");
  page.table(maps_table(stability, Medium::page));
  page.part(id + "-stops", "Stopping distance");
  page.paragraph("From sliding to rest, over the true distance; no damper. 1 is right.");
  page.table(stops_table(stability));
  page.part(id + "-slope", "At rest on a slope");
  page.paragraph("A rigid block on four patches, two thirds of the way to sliding.");
  page.table(rests_table(stability));
  page.part(id + "-varied", "Direction changed in sliding, load that swings");
  page.paragraph(
      "Coarser maps: a change of direction on two axes; a load between a quarter and all, so that K swings "
      "with it.");
  page.table(varied_table(stability, Medium::page));
  if (stability.contains("pulled")) add_pulled(page, id, stability.at("pulled"));
  page.part(id + "-cases", "Cases in SI units");
  page.table(cases_table(stability));
  std::vector<std::string> late;
  for (const Json& row : stability.at("late_force")) {
    late.push_back(fmt::format("{} force: b = {} K T", text_of(row, "force"),
                               number_text(row.at("device_damping_over_kt"))));
  }
  if (!late.empty()) {
    page.paragraph("The device damping b that pays for a force applied one step late:");
    page.list(late);
  }
}

}  // namespace cli
