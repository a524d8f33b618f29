// The part of the page about `bristle capacity`.
#include <fmt/format.h>

#include "tools/files/user_error.hpp"
#include "tools/reports/charts.hpp"
#include "tools/reports/numbers.hpp"
#include "tools/reports/report.hpp"
#include "tools/reports/report_tables.hpp"

namespace cli {

std::vector<std::string> capacity_summary(const Json& capacity) {
  std::vector<std::string> lines;
  // Every bristle snaps in every step, and all that a force-feedback loop may need is computed.
  for (const Json& row : capacity.at("capacities")) {
    if (text_of(row, "motion") != "all snap" || text_of(row, "layout") != "one patch" ||
        text_of(row, "kernel") != "2 axes, keep, end + mean, single") {
      continue;
    }
    const int threads = row.at("threads").get<int>();
    if (row.value("unconfirmed", false)) {
      lines.push_back(
          fmt::format("Bristles that all snap, threads: {}: {}.", threads, bristles_that_fit(row)));
      continue;
    }
    lines.push_back(fmt::format(
        "{} bristles that all snap fit in {} on {} {} (rule keep, end and mean force, two axes, float).",
        bristles_that_fit(row), time_text(capacity.at("deadline_s").get<double>()), threads,
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
  page.charts(capacity_chart(capacity),
              "Time of a step against the number of bristles, one patch. Point at a "
              "measurement for its values; the tables below have all others.");
  for (const Picture& picture : measurement.pictures) {
    page.picture(picture.bytes, picture.media_type,
                 "Time of a step (99th percentile) against the number of bristles; the dashed line is the "
                 "deadline, the square what the paper of 2004 reached.");
  }
  const auto tabulate = [&](const char* part, const char* title, const char* key, const char* meaning,
                            const Table& table) {
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
           targets_table(capacity, Medium::page));
  tabulate("-fits", "Bristles that fit", "capacities",
           "The paper reached 900 bristles in 1 ms (1 GHz Pentium III, 2004, literal rule). In cache: 14,400 "
           "bristles.",
           capacities_table(capacity, Medium::page));
  tabulate("-loops", "Beside plain loops", "comparisons",
           "One thread, loops in turns in the same run: medians. The plain loops have the same physics and "
           "every compiler flag turned on, approximate divisions included, and no promise of equal bits; the "
           "paper's loop steps by its literal rule. Above 1 bristle is faster.",
           comparisons_table(capacity, Medium::page));
  tabulate("-features", "What a feature costs", "features",
           "A kernel holds the code of its own features only: what a scene does not ask for costs nothing. "
           "14,400 bristles, one thread, in turns.",
           kernel_features_table(capacity, Medium::page));
  if (capacity.contains("infinite"))  // not in reports of older builds
    tabulate("-infinite", "Patches of infinitely many bristles", "infinite",
             "One thread: a step of each patch, alone (in cache) and among ten thousand.",
             infinite_table(capacity, Medium::page));
  if (capacity.contains("contacts"))
    tabulate(
        "-contacts", "Sliding contacts that fit", "contacts",
        "Contacts of infinitely many bristles, 0.1 mean snap lengths a step in zigzag, in a deadline at p99. "
        "With four pieces per mean snap length the force is within 1 % at every step.",
        contacts_table(capacity, Medium::page));
  page.paragraph(text_of(capacity, "note"));
}

}  // namespace cli
