// Writes the reports of `bristle stability`: tables for people, JSON for programs, CSV for the plot.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>

#include <fmt/format.h>

#include "tools/libraries/reports/answers.hpp"
#include "tools/libraries/reports/conditions.hpp"
#include "tools/libraries/reports/numbers.hpp"
#include "tools/libraries/reports/report_tables.hpp"
#include "tools/libraries/scene/snap_law.hpp"
#include "tools/libraries/stability/stability.hpp"

namespace cli {
namespace {

std::map<Why, std::uint64_t> reasons(const SchemeMap& map) {
  std::map<Why, std::uint64_t> counts;
  for (const MapCell& cell : map.cells) ++counts[cell.why];
  counts.erase(Why::agree);
  return counts;
}

// Returns the verdicts of the cases as a table by start speed; with --wide also their scheme and peak-to-peak
// motion.
std::string cases_table(const StabilityResult& result) {
  const bool wide = text_layout().columns == 0;
  std::vector<std::string> headers = {"<case", "1e-5 m/s", "1e-3 m/s", "1e-2 m/s", "0.1 m/s", "1 m/s"};
  if (wide) headers.insert(headers.end(), {"<scheme", "k", "c"});
  Table table(headers);
  for (const CaseRow& row : result.cases) {
    const LoopSetup& s = row.setup;
    std::vector<Cell> cells = {row.name};
    for (const LoopResult& r : row.results)
      cells.push_back(
          wide ? fmt::format("{} {:.2g}", to_string(r.verdict), r.peak_to_peak_m / s.mean_snap_length)
               : to_string(r.verdict));
    if (wide)
      cells.insert(cells.end(),
                   {to_string(s.scheme), fmt::format("{:.3g}", s.stiffness * s.dt_s * s.dt_s / s.mass_kg),
                    fmt::format("{:.3g}", s.damping * s.dt_s / s.mass_kg)});
    table.add(std::move(cells));
  }
  return table.text();
}

std::string pulled_table(const StabilityResult& result) {
  Table table({"<contact", "<coupling", "k_c N/m", "measured", "force N", "speed over pull"});
  for (const PullRow& row : result.pulled)
    table.add({row.pull.name, row.scheme == Scheme::predictor ? "predictor" : "midpoint",
               fmt::format("{:.4g}", row.theory), fmt::format("{:.3f} k_c", row.measured / row.theory),
               fmt::format("{:.3g} to {:.3g}", row.soft.lowest_force, row.soft.highest_force),
               fmt::format("{:.2g} to {:.3g}", row.soft.slowest, row.soft.fastest)});
  return table.text();
}

std::string wheels_table(const StabilityResult& result) {
  Table table({"slip stiffness N", "inertia kg m^2", "T ms", "k", "midpoint mm/s", "gains J", "held mm/s",
               "gains J"});
  const auto number = [](double x) { return std::fabs(x) < 1e6 ? fmt::format("{:.2g}", x) : "no bound"; };
  for (const WheelRow& row : result.wheels)
    table.add({fmt::format("{:g}", row.slip_stiffness), fmt::format("{:g}", row.inertia),
               fmt::format("{:g}", 1e3 * row.dt_s), fmt::format("{:.3g}", row.k),
               number(1e3 * row.midpoint.speed_error), number(row.midpoint.gained_j),
               number(1e3 * row.held.speed_error), number(row.held.gained_j)});
  return table.text();
}

Json wheels_json(const StabilityResult& result) {
  Json rows = Json::array();
  const auto of = [](const WheelResult& r) {
    return Json{{"speed_error_m_per_s", r.speed_error}, {"gained_j", r.gained_j}};
  };
  for (const WheelRow& row : result.wheels)
    rows.push_back({{"slip_stiffness_n", row.slip_stiffness},
                    {"inertia_kg_m2", row.inertia},
                    {"dt_s", row.dt_s},
                    {"k", row.k},
                    {"midpoint", of(row.midpoint)},
                    {"held", of(row.held)}});
  return rows;
}

Json pulled_json(const StabilityResult& result) {
  Json rows = Json::array();
  for (const PullRow& row : result.pulled) {
    rows.push_back({{"contact", row.pull.name},
                    {"scheme", to_string(row.scheme)},
                    {"mass_kg", row.pull.mass_kg},
                    {"load_n", row.pull.load_n},
                    {"speed_m_per_s", row.pull.speed_m_per_s},
                    {"dt_s", row.pull.dt_s},
                    {"critical_stiffness_n_per_m", {{"theory", row.theory}, {"measured", row.measured}}},
                    {"on_a_quarter",
                     {{"slowest_over_pull", row.soft.slowest},
                      {"fastest_over_pull", row.soft.fastest},
                      {"lowest_force_n", row.soft.lowest_force},
                      {"highest_force_n", row.soft.highest_force}}}});
  }
  return rows;
}

Json result_json(const LoopResult& r) {
  return {{"verdict", to_string(r.verdict)},
          {"unbounded", r.unbounded},
          {"peak_to_peak_m", r.peak_to_peak_m},
          {"highest_speed_m_per_s", r.highest_speed},
          {"energy_ratio", r.energy_ratio}};
}

Json map_json(const SchemeMap& map) {
  Json why = Json::object();
  for (const auto& [reason, cells] : reasons(map)) why[to_string(reason)] = cells;
  Json cells = Json::array();
  for (const MapCell& c : map.cells) {
    cells.push_back({{"k", c.k},
                     {is_device(map.scheme) ? "beta" : "c", c.second},
                     {"linear_stable", c.linear_stable},
                     {"verdict", to_string(c.verdict)},
                     {"unbounded", c.unbounded},
                     {"why", to_string(c.why)},
                     {"sticking", result_json(c.sticking)},
                     {"sliding", result_json(c.sliding)}});
  }
  return {{"scheme", to_string(map.scheme)},
          {"linear_condition", linear_condition(map.scheme)},
          {"agreeing", map.agreeing()},
          {"fraction_agreeing", static_cast<double>(map.agreeing()) / static_cast<double>(map.cells.size())},
          {"why_not", why},
          {"cells", cells}};
}

// Adds the points of a scheme's stability limit to the CSV text. Each lies between a stable and an unstable
// neighbour on a fine grid, because the limit may have several values of c at one k.
void add_limit_points(std::string& text, Scheme scheme) {
  if (is_implicit(scheme)) return;
  constexpr int ks = 240, seconds = 200;
  const auto k_at = [](int i) { return std::pow(10.0, -3.0 + 5.0 * i / ks); };
  const auto second_at = [](int j) { return std::pow(10.0, -3.0 + 4.0 * j / seconds); };
  std::vector<char> stable;
  for (int i = 0; i <= ks; ++i) {
    for (int j = 0; j <= seconds; ++j) {
      const double second = second_at(j);
      stable.push_back(linearly_stable(scheme, k_at(i), is_device(scheme) ? 0.0 : second,
                                       is_device(scheme) ? second : 0.0));
    }
  }
  const auto is_stable = [&](int i, int j) {
    return stable[static_cast<std::size_t>(i) * (seconds + 1) + static_cast<std::size_t>(j)];
  };
  const auto point = [&](double k, double second) {
    fmt::format_to(std::back_inserter(text), "limit,{},{:.5g},{:.5g},,,,,\n", static_cast<int>(scheme), k,
                   second);
  };
  for (int i = 0; i < ks; ++i) {
    for (int j = 0; j < seconds; ++j) {
      if (is_stable(i, j) != is_stable(i + 1, j)) point(std::sqrt(k_at(i) * k_at(i + 1)), second_at(j));
      if (is_stable(i, j) != is_stable(i, j + 1)) point(k_at(i), std::sqrt(second_at(j) * second_at(j + 1)));
    }
  }
}

const char* population_name(const StabilityOptions& options) {
  return options.population == bristle::Population::infinite ? "infinite" : "representatives";
}

Json report_of(const StabilityOptions& options, const StabilityResult& result) {
  Json report = {{"schema", "bristle-stability-1"}};
  report["conditions"] = to_json(conditions());
  report["quick"] = options.quick;
  report["population"] = population_name(options);
  report["rule"] = to_string(options.rule);
  report["k"] = result.ks;
  report["c_or_beta"] = result.seconds;
  report["maps"] = Json::array();
  for (const SchemeMap& map : result.maps) report["maps"].push_back(map_json(map));
  report["varied"] = Json::array();
  for (const VariedMap& v : result.varied) {
    report["varied"].push_back({{"scheme", to_string(v.scheme)},
                                {"turned", {{"cells", v.turned}, {"agreeing", v.turned_agree}}},
                                {"swinging_load",
                                 {{"stable_at_all_loads", {{"cells", v.always}, {"settle", v.always_settle}}},
                                  {"stable_at_some", {{"cells", v.partly}, {"settle", v.partly_settle}}},
                                  {"stable_at_none", {{"cells", v.never}, {"settle", v.never_settle}}}}}});
  }
  report["stopping_distances"] = Json::array();
  for (const StopRow& row : result.stops)
    report["stopping_distances"].push_back({{"k", row.k},
                                            {"path_over_mean_snap_length", row.slide},
                                            {"scheme", to_string(row.scheme)},
                                            {"ratio", row.ratio}});
  report["rests"] = Json::array();
  for (const RestRow& r : result.rests)
    report["rests"].push_back({{"scheme", to_string(r.scheme)},
                               {"seconds", r.seconds},
                               {"first_second_m", r.first_second_m},
                               {"creep_m", r.creep_m}});
  report["cases"] = Json::array();
  for (const CaseRow& row : result.cases) {
    const LoopSetup& s = row.setup;
    Json starts = Json::array();
    for (std::size_t i = 0; i < row.results.size(); ++i) {
      Json start = {{"start_velocity_m_per_s", row.start_velocities[i]}};
      start.update(result_json(row.results[i]));
      starts.push_back(std::move(start));
    }
    report["cases"].push_back({{"name", row.name},
                               {"scheme", to_string(s.scheme)},
                               {"mass_kg", s.mass_kg},
                               {"stiffness_n_per_m", s.stiffness},
                               {"damping_ns_per_m", s.damping},
                               {"device_damping_ns_per_m", s.device_damping},
                               {"dt_s", s.dt_s},
                               {"mean_snap_length_m", s.mean_snap_length},
                               {"starts", starts}});
  }
  report["late_force"] = Json::array();
  for (const LateRow& row : result.late)
    report["late_force"].push_back({{"force", row.force}, {"device_damping_over_kt", row.damping_over_kt}});
  report["pulled"] = pulled_json(result);
  report["wheels"] = wheels_json(result);
  report["seconds"] = result.seconds_taken;
  return report;
}

}  // namespace

std::string stability_table(const StabilityOptions& options, const StabilityResult& result) {
  const Json report = report_of(options, result);
  const Conditions c = conditions();
  std::string text = stability_answer(report) + '\n';
  text += fmt::format(
      "bristle {}, commit {}, {}\n"
      "A mass on one patch, one axis, no applied force. k = K T^2/m from {:.3g} to {:.3g}, c = C T/m "
      "(devices: beta = b T/m) from {:.3g} to {:.3g}. Snap lengths uniform, 0.5 to 1.5 of the mean dbar, {}. "
      "Each cell from two starts: a push within presliding, and steady sliding; the worse counts. {} steps. "
      "Population of maps and slope: {}.\n\n",
      c.version, c.commit, c.flags, result.ks.front(), result.ks.back(), result.seconds.front(),
      result.seconds.back(), to_string(options.rule), options.quick ? 4000 : 8000, population_name(options));
  text += maps_table(report).text();
  text +=
      "\nSettles: the energy falls from the third quarter of the run to the fourth. Rings: bristles snap to "
      "the end.\nGrows: the energy rises, and nothing snaps yet or there is no bound.\n\n"
      "Direction changed in sliding (two axes), and a load that swings between a quarter and all, coarse "
      "grid:\n\n";
  text += varied_table(report).text();
  text += "\nStopping distance from sliding over the true one, no damper:\n\n";
  text += stops_table(report).text();
  text += "\nA block (rigid, four patches) at rest on a slope, two thirds of the way to sliding:\n";
  for (const RestRow& r : result.rests)
    text += fmt::format("  {:<20} {:g} s: settled within {:.3g} um, then crept {:.2g} m = {:.2g} dbar\n",
                        to_string(r.scheme), r.seconds, 1e6 * r.first_second_m, r.creep_m,
                        r.creep_over_snap_length);
  text +=
      "\nCases in SI units (keep, uniform snap lengths): verdict by start speed (--wide: and peak to peak "
      "over dbar):\n\n";
  text += cases_table(result);
  text += "\nThe device damping that pays for a force applied one step late, measured on a stuck patch:\n";
  for (const LateRow& row : result.late)
    text += fmt::format("  {:<4} force  b = {:.3f} K T\n", row.force, row.damping_over_kt);
  text +=
      "\nA mass that a spring pulls over a contact that ages (infinite brush): above the\n"
      "critical stiffness k_c it slides steadily, below in jerks. By linear theory, by\n"
      "bisection, and what happens on k_c/4. Creep: inertia is nothing, strengthening\n"
      "with speed damps. Inertial: a lubricant damps.\n\n";
  text += pulled_table(result);
  text +=
      "\nA car (400 kg on one wheel of 0.3 m, a bed) rolls up a slope of 5 %, stops and rolls back in 8 s: "
      "speed off\nthat of rolling without slip, and the most energy gained in a step. k = K T^2 (1/m + "
      "r^2/I). Midpoint: solved\nfor the mean force. Held: the force of the last step; linear theory bounds "
      "k by 4.\n\n";
  text += wheels_table(result);
  text += fmt::format("\nTook {}.\n", time_text(result.seconds_taken));
  return text;
}

std::string stability_json(const StabilityOptions& options, const StabilityResult& result) {
  return json_text(report_of(options, result));
}

std::string stability_csv(const StabilityResult& result) {
  std::string text =
      "row,scheme,k,c_or_beta,linear_stable,verdict,unbounded,agrees,peak_to_peak_over_dbar,scheme_name\n";
  for (const SchemeMap& map : result.maps) {
    for (const MapCell& c : map.cells) {
      fmt::format_to(std::back_inserter(text), "cell,{},{:.5g},{:.5g},{},{},{},{},{:.4g},\"{}\"\n",
                     static_cast<int>(map.scheme), c.k, c.second, int{c.linear_stable},
                     static_cast<int>(c.verdict), int{c.unbounded}, int{c.why == Why::agree},
                     std::max(c.sticking.peak_to_peak_m, c.sliding.peak_to_peak_m) / 1e-5,
                     to_string(map.scheme));
    }
    add_limit_points(text, map.scheme);
  }
  return text;
}

}  // namespace cli
