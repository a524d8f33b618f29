// The part of the page about `bristle capacity`.
#include <iterator>
#include <set>

#include <fmt/format.h>

#include "tools/files/user_error.hpp"
#include "tools/reports/conditions.hpp"
#include "tools/reports/report.hpp"

namespace cli {
namespace {

using Json = nlohmann::ordered_json;

std::string text_of(const Json& json, const char* key) { return json.at(key).get<std::string>(); }

// Reports of older builds do not say.
bool is_unconfirmed(const Json& row) { return row.value("unconfirmed", false); }

std::string bristles_text(const Json& row) {
  const auto bristles = row.at("bristles").get<unsigned long long>();
  if (is_unconfirmed(row)) return "not confirmed: machine too busy";
  if (bristles == 0) return "fewer than 900";
  return (row.at("more_would_fit").get<bool>() ? "> " : "") + count_text(bristles);
}

HtmlTable targets_table(const Json& capacity) {
  HtmlTable table({"<target", "<", "measured", "limit", "spread", "<unit", "<what"});
  for (const Json& row : capacity.at("targets")) {
    const bool met = row.at("met").get<bool>();
    table.add({text_of(row, "name"),
               {met ? "met" : "MISSED", met ? CellStyle::good : CellStyle::bad},
               number_text(row.at("measured")),
               (row.at("at_least").get<bool>() ? "≥ " : "≤ ") + number_text(row.at("limit")),
               range_text(row.at("spread")),
               text_of(row, "unit"),
               text_of(row, "what")});
  }
  return table;
}

HtmlTable capacities_table(const Json& capacity) {
  HtmlTable table({"<motion", "<kernel", "<layout", "threads", "bristles that fit", "times the paper's",
                   "ns per bristle", "in cache", "p50", "p99", "longest"});
  const double papers = capacity.at("paper").at("bristles").get<double>();
  for (const Json& row : capacity.at("capacities")) {
    std::vector<HtmlCell> cells = {text_of(row, "motion"), text_of(row, "kernel"), text_of(row, "layout"),
                                   number_text(row.at("threads")), bristles_text(row)};
    const Json &fits = row.at("at_capacity"), &cached = row.at("in_cache");
    const double bristles = row.at("bristles").get<double>();
    if (bristles == 0.0) {
      cells.insert(cells.end(), 6, "-");
    } else {
      cells.push_back(count_text(static_cast<unsigned long long>(bristles / papers)));
      cells.push_back(number_text(fits.at("ns_per_bristle")));
      cells.push_back(number_text(cached.at("ns_per_bristle")));
      for (const char* key : {"p50_s", "p99_s", "max_s"}) {
        cells.push_back(time_text(fits.at(key).get<double>()));
      }
    }
    table.add(std::move(cells));
  }
  return table;
}

HtmlTable comparisons_table(const Json& capacity) {
  HtmlTable table(
      {"bristles", "<motion", "<loop", "ns per bristle", "its time / bristle's", "quartiles", "<faster"});
  for (const Json& row : capacity.at("comparisons")) {
    // The first of each group is ours, which the others are compared with.
    const double ratio = row.at("time_over_bristle").get<double>();
    const bool ours = text_of(row, "loop").starts_with("bristle");
    const bool loses =
        ratio < 1.0 && !text_of(row, "loop").starts_with("streaming");  // that is a limit, no rival
    table.add({count_text(row.at("bristles").get<unsigned long long>()),
               text_of(row, "motion"),
               text_of(row, "loop"),
               number_text(row.at("ns_per_bristle")),
               ours ? "1" : fmt::format("{:.2f}", ratio),
               ours ? "" : range_text(row.at("quartiles")),
               {ours           ? ""
                : ratio >= 1.0 ? "bristle"
                : loses        ? "the other loop"
                               : "the limit",
                loses ? CellStyle::bad : CellStyle::plain}});
  }
  return table;
}

HtmlTable features_table(const Json& capacity) {
  HtmlTable table(
      {"<motion", "<feature", "<kernel", "bytes per bristle", "ns per bristle", "time / least", "quartiles"});
  for (const Json& row : capacity.at("features")) {
    table.add({text_of(row, "motion"), text_of(row, "feature"), text_of(row, "kernel"),
               number_text(row.at("bytes_per_bristle")), number_text(row.at("ns_per_bristle")),
               number_text(row.at("time_over_least")), range_text(row.at("quartiles"))});
  }
  return table;
}

}  // namespace

std::vector<std::string> capacity_summary(const Json& capacity) {
  std::vector<std::string> lines;
  // Every bristle snaps in every step, and all that a force-feedback loop may need is computed.
  for (const Json& row : capacity.at("capacities")) {
    if (text_of(row, "motion") != "all snap" || text_of(row, "layout") != "one patch" ||
        text_of(row, "kernel") != "2 axes, keep, end + mean, single") {
      continue;
    }
    const int threads = row.at("threads").get<int>();
    if (is_unconfirmed(row)) {
      lines.push_back(fmt::format("Bristles that all snap, threads: {}: {}.", threads, bristles_text(row)));
      continue;
    }
    lines.push_back(fmt::format(
        "{} bristles that all snap fit in {} on {} {} (rule keep, end and mean force, two axes, float).",
        bristles_text(row), time_text(capacity.at("deadline_s").get<double>()), threads,
        threads == 1 ? "thread" : "threads"));
  }
  const Json& targets = capacity.at("targets");
  if (!targets.empty()) {
    std::size_t met = 0;
    std::string missed;
    for (const Json& row : targets) {
      if (row.at("met").get<bool>()) {
        ++met;
      } else {
        missed += (missed.empty() ? "" : "; ") + text_of(row, "name");
      }
    }
    lines.push_back(fmt::format("{} of {} speed targets met{}.", met, targets.size(),
                                missed.empty() ? "" : "; missed: " + missed));
  }
  return lines;
}

void add_capacity(HtmlPage& page, const std::string& id, const Measurement& measurement) {
  const Json& capacity = measurement.json;
  // Rows are set beside it.
  const double papers = capacity.at("paper").at("bristles").get<double>();
  if (!(papers >= 1.0)) {
    throw UserError(fmt::format("{}: paper.bristles is {}; it must be at least 1", measurement.file, papers));
  }
  const std::string deadline = time_text(capacity.at("deadline_s").get<double>());
  page.paragraph(fmt::format(
      "How many bristles a step of {} holds. Mean snap length {} µm, snap lengths {}; a row fits when 99 % "
      "of "
      "its steps end in time, confirmed by a run of its own.",
      deadline, number_text(capacity.at("mean_snap_length_m"), 1e6), text_of(capacity, "snap_length")));
  std::vector<std::string> motions;
  for (const Json& m : capacity.at("motions"))
    motions.push_back(text_of(m, "name") + ": " + text_of(m, "meaning"));
  page.list(motions);
  for (const Picture& picture : measurement.pictures) {
    page.picture(picture.bytes, picture.media_type,
                 "Time of a step (99th percentile) against the number of bristles; the dashed line is the "
                 "deadline, the square what the paper of 2004 reached.");
  }
  const auto tabulate = [&](const char* part, const char* title, const char* key, const char* meaning,
                            const HtmlTable& table) {
    page.part(id + part, title);
    if (capacity.at(key).empty()) {
      page.paragraph("Not measured in this run.");
      return;
    }
    page.paragraph(meaning);
    page.table(table);
  };
  tabulate("-targets", "Speed targets", "targets",
           "What the library set out to reach, and what was measured here: the median and its quartiles; for "
           "p99 the best of three runs, and from the median of that run to the worst p99.",
           targets_table(capacity));
  tabulate("-fits", "Bristles that fit", "capacities",
           "The paper reached 900 bristles in 1 ms (1 GHz Pentium III, 2004, literal rule). In cache: 14,400 "
           "bristles.",
           capacities_table(capacity));
  tabulate("-loops", "Beside plain loops", "comparisons",
           "One thread, loops in turns in the same run: medians. The plain loops have the same physics and "
           "every compiler flag turned on, approximate divisions included, and no promise of equal bits; the "
           "paper's loop steps by its literal rule. Above 1 bristle is faster.",
           comparisons_table(capacity));
  tabulate("-features", "What a feature costs", "features",
           "A kernel holds the code of its own features only: what a scene does not ask for costs nothing. "
           "14,400 bristles, one thread, in turns.",
           features_table(capacity));
  page.paragraph(text_of(capacity, "note"));
}

}  // namespace cli
