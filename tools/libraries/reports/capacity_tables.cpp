// Makes the tables of a report of `bristle capacity` from the report's JSON (schema bristle-capacity-1).
#include <cmath>

#include <fmt/format.h>

#include "tools/libraries/reports/numbers.hpp"
#include "tools/libraries/reports/report_tables.hpp"

namespace cli {
namespace {

std::string ns_text(const Json& value) {
  if (value.is_null()) return "-";
  const double ns = value.get<double>();
  return ns < 0.001 ? "< 0.001" : fmt::format("{:.{}f}", ns, ns < 10.0 ? 3 : 1);
}

std::string two_places(const Json& value) { return fmt::format("{:.2f}", value.get<double>()); }

// Returns whether a row of loop times is that of the library's own loop, with which the other loops are
// compared.
bool is_ours(const Json& row) { return text_of(row, "loop").starts_with("bristle"); }

// Makes a column of quartiles, each with two decimals, so that decimal points stand below each other.
JsonColumn quartile_column() {
  return only_wide({"quartiles", [](const Json& row) {
                      if (row.contains("loop") && is_ours(row)) return Cell("");
                      return Cell(two_places(row.at("quartiles").at(0)) + " to " +
                                  two_places(row.at("quartiles").at(1)));
                    }});
}

// Makes a column of a figure, which is "-" in rows where no number of bristles meets the deadline.
template <class Figure>
JsonColumn fit_column(const char* header, Figure figure) {
  return {header, [figure](const Json& row) {
            return Cell(row.at("bristles").get<double>() == 0.0 ? std::string("-") : figure(row));
          }};
}

JsonColumn fit_time_column(const char* header, const char* key) {
  return fit_column(
      header, [key](const Json& row) { return time_text(row.at("at_capacity").at(key).get<double>()); });
}

}  // namespace

bool was_busy(const Json& row, double deadline_s) {
  // Median step time, as a share of the deadline, below which other programs count as having disturbed the
  // measurement. At the largest number of bristles that fits the share is 0.7 to 0.95 on a quiet machine.
  constexpr double usual = 0.6;
  return row.value("unconfirmed", false) ||
         (row.at("bristles").get<double>() > 0.0 && !row.at("more_would_fit").get<bool>() &&
          row.at("at_capacity").at("p50_s").get<double>() < usual * deadline_s);
}

std::string bristles_that_fit(const Json& row) {
  if (row.value("unconfirmed", false)) return "not confirmed";
  const auto bristles = row.at("bristles").get<unsigned long long>();
  if (bristles == 0) return "fewer than 900";
  return (row.at("more_would_fit").get<bool>() ? "> " : "") + count_text(bristles);
}

Table targets_table(const Json& capacity) {
  const std::vector<JsonColumn> columns = {
      column("<target", "/name"),
      column("measured", "/measured"),
      column("<", "/unit"),
      {"limit",
       [](const Json& row) {
         return Cell((row.at("at_least").get<bool>() ? ">= " : "<= ") + number_text(row.at("limit")));
       }},
      {"<",
       [](const Json& row) {
         return row.at("met").get<bool>() ? Cell("met", CellStyle::good) : Cell("MISSED", CellStyle::bad);
       }},
      only_wide(column("spread", "/spread", "range")),
      only_wide(column("<what", "/what")),
      only_wide(column("<bound by", "/bound"))};
  return tabulate(capacity.at("targets"), columns);
}

namespace {

std::string targets_answer(const Json& targets) {
  if (targets.empty()) return "";
  std::size_t met = 0;
  std::string missed;
  for (const Json& row : targets) {
    met += row.at("met").get<bool>() ? 1 : 0;
    if (!row.at("met").get<bool>()) missed += (missed.empty() ? "; missed: " : ", ") + text_of(row, "name");
  }
  return fmt::format("{} of {} speed targets met{}.\n", met, targets.size(), missed);
}

}  // namespace

std::string capacity_answer(const Json& capacity) {
  const double deadline_s = capacity.at("deadline_s").get<double>();
  const Json* dearest = nullptr;
  const auto look_for_dearest = [&](bool default_material) {
    for (const Json& row : capacity.at("capacities")) {
      if (row.at("threads") != 1 ||
          text_of(row, "kernel").starts_with("default material") != default_material)
        continue;
      if (dearest == nullptr || row.at("bristles").get<double>() < dearest->at("bristles").get<double>())
        dearest = &row;
    }
  };
  look_for_dearest(true);
  const bool of_default = dearest != nullptr;
  if (!of_default) look_for_dearest(false);
  if (dearest == nullptr) return targets_answer(capacity.at("targets"));
  std::string text;
  if (dearest->at("bristles").get<double>() > 0.0)
    text = fmt::format("{} of one thread are enough for {} bristles{}, whatever the motion (dearest: {}).\n",
                       time_text(deadline_s), bristles_that_fit(*dearest),
                       of_default ? " of the default material" : "", text_of(*dearest, "motion"));
  std::size_t busy = 0;
  const Json& rows = capacity.at("capacities");
  for (const Json& row : rows) busy += was_busy(row, deadline_s) ? 1 : 0;
  if (busy > 0)
    text += fmt::format(
        "LOWER BOUND, MACHINE BUSY in {} of {} rows: others delayed one step in a hundred. Run it again on a "
        "quiet machine, or see --wide: the column \"median allows\" says what would fit if they had not.\n",
        busy, rows.size());
  return text;
}

Table capacities_table(const Json& capacity) {
  const double papers = capacity.at("paper").at("bristles").get<double>();
  const double deadline_s = capacity.at("deadline_s").get<double>();
  const std::vector<JsonColumn> columns = {
      column("<motion", "/motion"),
      {"<kernel and layout",
       [](const Json& row) {
         const std::string layout = text_of(row, "layout");
         return Cell(text_of(row, "kernel") + (layout == "one patch" ? "" : ", " + layout));
       }},
      column("threads", "/threads"),
      {"bristles that fit",
       [deadline_s](const Json& row) {
         if (!was_busy(row, deadline_s)) return Cell(bristles_that_fit(row));
         const bool counted = row.at("bristles").get<double>() > 0.0;
         return Cell((counted ? "at least " : "") + bristles_that_fit(row));
       }},
      only_wide(fit_column("median allows",
                           [deadline_s](const Json& row) {
                             if (row.at("more_would_fit").get<bool>()) return std::string("-");
                             const double p50 = row.at("at_capacity").at("p50_s").get<double>();
                             return count_text(static_cast<unsigned long long>(
                                 std::llround(row.at("bristles").get<double>() * deadline_s / p50)));
                           })),
      only_wide(fit_column("x 900",
                           [papers](const Json& row) {
                             return count_text(
                                 static_cast<unsigned long long>(row.at("bristles").get<double>() / papers));
                           })),
      fit_column("ns per bristle",
                 [](const Json& row) { return ns_text(row.at("at_capacity").at("ns_per_bristle")); }),
      only_wide(fit_column("in cache",
                           [](const Json& row) { return ns_text(row.at("in_cache").at("ns_per_bristle")); })),
      only_wide(fit_time_column("p50", "p50_s")),
      only_wide(fit_time_column("p99", "p99_s")),
      only_wide(fit_time_column("max", "max_s"))};
  Table table = tabulate(capacity.at("capacities"), columns);
  std::vector<Cell> papers_row = {"the paper (2004)", "1 GHz Pentium III", "1", "900"};
  papers_row.resize(table.columns(), Cell("-"));
  table.add_first(std::move(papers_row));
  return table;
}

Table comparisons_table(const Json& capacity) {
  static const std::vector<JsonColumn> columns = {
      column("bristles", "/bristles", "count"),
      column("<motion", "/motion"),
      column("<loop", "/loop"),
      {"ns per bristle", [](const Json& row) { return Cell(ns_text(row.at("ns_per_bristle"))); }},
      {"a step us",
       [](const Json& row) {
         return Cell(number_text(row.at("ns_per_bristle"), 1e-3 * row.at("bristles").get<double>()));
       }},
      {"time / bristle's",
       [](const Json& row) { return Cell(is_ours(row) ? "1" : two_places(row.at("time_over_bristle"))); }},
      quartile_column()};
  return tabulate(capacity.at("comparisons"), columns, 2);
}

Table infinite_table(const Json& capacity) {
  static const std::vector<JsonColumn> columns = {column("<motion", "/motion"),
                                                  column("step / mean length", "/step_over_mean_snap_length"),
                                                  column("turn rad", "/turn_rad"),
                                                  only_wide(column("<kernel", "/kernel")),
                                                  only_wide(column("resolution", "/resolution")),
                                                  column("patches", "/patches", "count"),
                                                  only_wide(column("bytes per patch", "/bytes_per_patch")),
                                                  column("ns per patch", "/ns_per_patch"),
                                                  only_wide(column("quartiles", "/quartiles", "range")),
                                                  column("p99 of a step", "/p99_s", "time")};
  return tabulate(capacity.at("infinite"), columns);
}

Table contacts_table(const Json& capacity) {
  static const std::vector<JsonColumn> columns = {
      column("<motion", "/motion"),
      column("step / mean length", "/step_over_mean_snap_length"),
      only_wide(column("turn rad", "/turn_rad")),
      column("resolution", "/resolution"),
      column("threads", "/threads"),
      {"contacts that fit", [](const Json& row) { return Cell(bristles_that_fit(row)); }},
      fit_column("ns per contact",
                 [](const Json& row) { return ns_text(row.at("at_capacity").at("ns_per_bristle")); }),
      only_wide(fit_time_column("p50", "p50_s")),
      fit_time_column("p99", "p99_s"),
      only_wide(fit_time_column("max", "max_s"))};
  return tabulate(capacity.at("contacts"), columns, 2);
}

Table snapshots_table(const Json& capacity) {
  static const std::vector<JsonColumn> columns = {
      column("<contact", "/contact"), column("memory bytes", "/memory_bytes"),
      column("state bytes", "/state_bytes"), column("save", "/save_s", "time"),
      column("restore", "/restore_s", "time")};
  return tabulate(capacity.at("snapshots"), columns);
}

}  // namespace cli
