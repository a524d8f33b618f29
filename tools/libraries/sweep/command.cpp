// Runs the command `bristle sweep`, a study in which parameters of a scene vary.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include <fmt/format.h>

#include <bristle/deadline_monitor.hpp>

#include "tools/libraries/files/one_line.hpp"
#include "tools/libraries/files/output_file.hpp"
#include "tools/libraries/files/text_file.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/platform/platform.hpp"
#include "tools/libraries/reports/conditions.hpp"
#include "tools/libraries/reports/numbers.hpp"
#include "tools/libraries/reports/progress.hpp"
#include "tools/libraries/reports/report_tables.hpp"
#include "tools/libraries/reports/text_layout.hpp"
#include "tools/libraries/run/paced_clock.hpp"
#include "tools/libraries/sweep/sweep.hpp"

namespace cli {
namespace {

std::string left_text(double seconds) {
  if (seconds < 100.0) return fmt::format("{:.0f} s", std::ceil(seconds));
  if (seconds < 6000.0) return fmt::format("{:.0f} min", std::ceil(seconds / 60.0));
  return fmt::format("{:.1f} h", seconds / 3600.0);
}

/// Shows the progress of a sweep: the number of rows done, and the time predicted for the others.
class RowProgress {
 public:
  explicit RowProgress(std::uint64_t rows) : rows_(rows), line_("sweep") {}
  void one_done() {
    ++done_;
    const double share = static_cast<double>(done_) / static_cast<double>(rows_);
    const double left = (bristle::DeadlineMonitor::wall_now() - start_) * (1.0 - share) / share;
    line_.update(
        share,
        fmt::format("{} of {} rows, {} left", count_text(done_), count_text(rows_), left_text(left)).c_str());
  }

 private:
  std::uint64_t rows_, done_ = 0;
  double start_ = bristle::DeadlineMonitor::wall_now();
  Progress line_;
};

/// Range of a column of the table: lowest and highest value, sum and number of values.
struct Spread {
  double least = 0.0, greatest = 0.0, sum = 0.0;
  std::uint64_t count = 0;
  void add(double value) {
    least = count ? std::min(least, value) : value;
    greatest = count ? std::max(greatest, value) : value;
    sum += value;
    ++count;
  }
};

struct Overview {
  const std::vector<SweepColumn>& columns;
  std::vector<Spread> spreads;
  std::uint64_t failures = 0;
  std::string first_failure;
  std::uint64_t missed_peaks = 0;  ///< number of rows in which a patch did not reach its peak
  std::string first_missed;
};

bool is_missed_peak(const SweepColumn& column) { return column.name.ends_with(".missed_peak"); }

Overview overview_of(const SweepRows& rows) {
  Overview overview{rows.columns(), std::vector<Spread>(rows.columns().size()), 0, {}, 0, {}};
  for (const std::string& row : rows.rows()) {
    const auto cells = nlohmann::json::parse(row);
    bool missed = false;
    for (std::size_t c = 0; c < cells.size(); ++c) {
      if (cells[c].is_number()) overview.spreads[c].add(cells[c].get<double>());
      if (!cells[c].is_string() || !is_missed_peak(overview.columns[c])) continue;
      if (overview.missed_peaks == 0 && !missed)
        overview.first_missed = fmt::format("row {}: {}", cells[0].dump(), cells[c].get<std::string>());
      missed = true;
    }
    overview.missed_peaks += missed;
    if (cells.back().is_null()) continue;
    if (overview.failures++ == 0)
      overview.first_failure = fmt::format("row {}: {}", cells[0].dump(), cells.back().get<std::string>());
  }
  return overview;
}

std::string number(double value) { return fmt::format("{:.5g}", value); }

/// Returns a sentence with the ranges of the first three results that differ between rows.
std::string ranges_answer(const SweepRows& rows, const Overview& overview) {
  std::string text;
  std::size_t said = 0;
  const std::size_t varied = rows.header()["vary"].size();
  for (std::size_t c = 1 + varied; c + 1 < overview.columns.size() && said < 3; ++c) {
    const Spread& spread = overview.spreads[c];
    const SweepColumn& column = overview.columns[c];
    if (spread.count < 2 || column.name == "seed" || column.measured || spread.least == spread.greatest)
      continue;
    text += fmt::format("{}{} goes from {} to {}{}", said++ ? "; " : "", column.name, number(spread.least),
                        number(spread.greatest), column.unit.empty() ? "" : " " + column.unit);
  }
  return text.empty() ? "" : text + ".\n";
}

std::string ranges_table(const Overview& overview) {
  Table table({"<column", "<unit", "rows", "least", "mean", "greatest"});
  constexpr std::size_t shown = 24;
  std::size_t more = 0;
  for (std::size_t c = 1; c + 1 < overview.columns.size(); ++c) {
    const Spread& spread = overview.spreads[c];
    const SweepColumn& column = overview.columns[c];
    if (spread.count == 0 || column.name == "seed") continue;
    if (c > shown) {
      ++more;
      continue;
    }
    table.add({column.name, column.unit, count_text(spread.count), number(spread.least),
               number(spread.sum / static_cast<double>(spread.count)), number(spread.greatest)});
  }
  return table.text() + (more ? fmt::format("... and {} more columns: see the table\n", more) : "");
}

/// Returns a table of all rows, if the study is small and the table narrow enough to read; otherwise an empty
/// text.
std::string rows_table(const SweepRows& rows, const Overview& overview) {
  std::vector<std::string> heads;
  std::vector<std::size_t> shown;
  for (std::size_t c = 0; c + 1 < overview.columns.size(); ++c) {
    if (is_missed_peak(overview.columns[c])) continue;  // a sentence above the table reports missed peaks
    heads.push_back(overview.columns[c].head());
    shown.push_back(c);
  }
  Table table(heads);
  for (const std::string& row : rows.rows()) {
    const auto cells = nlohmann::json::parse(row);
    std::vector<Cell> line;
    for (const std::size_t c : shown) {
      const auto& cell = cells[c];
      line.emplace_back(cell.is_null()           ? "-"
                        : cell.is_string()       ? cell.get<std::string>()
                        : cell.is_number_float() ? number(cell.get<double>())
                                                 : cell.dump());
    }
    table.add(std::move(line));
  }
  const std::size_t columns = text_layout().columns;
  return columns == 0 || table.natural_width() <= columns ? table.text() : std::string();
}

std::string report_json(const SweepRows& rows, const std::string& out, double seconds) {
  const Overview overview = overview_of(rows);
  Json report = {{"schema", "bristle-sweep-1"}};
  report["conditions"] = to_json(conditions());
  report["study"] = rows.header()["study"];
  report["scene"] = rows.header()["scene"];
  report["vary"] = rows.header()["vary"];
  report["rows"] = rows.rows().size();
  report["done"] = rows.done();
  report["failures"] = overview.failures;
  report["first_failure"] = overview.failures ? Json(overview.first_failure) : Json();
  report["table_hash"] = rows.table_hash();
  report["wall_s"] = seconds;
  report["table"] = out.empty() ? Json() : Json(out);
  report["columns"] = Json::array();
  for (std::size_t c = 0; c < overview.columns.size(); ++c) {
    Json column = to_json(overview.columns[c]);
    const Spread& spread = overview.spreads[c];
    if (spread.count) {
      column["least"] = spread.least;
      column["mean"] = spread.sum / static_cast<double>(spread.count);
      column["greatest"] = spread.greatest;
    }
    report["columns"].push_back(column);
  }
  return json_text(report);
}

std::string refusal_of(const Overview& overview, std::size_t rows) {
  if (overview.failures == 0) return {};
  return fmt::format("{}; {}",
                     overview.failures == rows ? "every row was refused"
                                               : fmt::format("{} of {} rows were refused (column failure)",
                                                             count_text(overview.failures), count_text(rows)),
                     overview.first_failure);
}

std::string resume_text(const std::string& unfinished, const SweepRows& rows) {
  if (unfinished.empty())
    return "bristle: stopped; no row is kept: with --out FILE the next sweep can be resumed\n";
  return fmt::format("bristle: stopped after {} of {} rows, which are in {}; resume by the same command\n",
                     count_text(rows.done()), count_text(rows.rows().size()), unfinished);
}

}  // namespace

SweepRefusal sweep_refusal(const SweepRows& rows) {
  const Overview overview = overview_of(rows);
  return {refusal_of(overview, rows.rows().size()), overview.failures == rows.rows().size()};
}

std::string sweep_summary(const SweepRows& rows, const std::string& out) {
  const Overview overview = overview_of(rows);
  std::string text =
      fmt::format("{} rows of scene {}{}\n", count_text(rows.done()),
                  rows.header()["scene"].get<std::string>(), out.empty() ? "" : ", in " + one_line(out));
  if (const std::string refusal = refusal_of(overview, rows.rows().size()); !refusal.empty())
    text += refusal + '\n';
  text += ranges_answer(rows, overview);
  if (overview.missed_peaks)
    text += fmt::format("{} of {} rows reach another peak than their material's (column missed_peak); {}.\n",
                        count_text(overview.missed_peaks), count_text(rows.done()), overview.first_missed);
  text += '\n';
  const std::string all = rows.done() <= 20 ? rows_table(rows, overview) : std::string();
  text += !all.empty() ? all : ranges_table(overview);
  text += fmt::format("\nstudy       {}\ntable hash  {}\n", rows.header()["study"].get<std::string>(),
                      rows.table_hash());
  return text;
}

int sweep_command(const SweepOptions& options) {
  const Study study(options.study);
  const std::string unfinished = unfinished_table(options.out);
  check_table_file(options.out);
  // Whether a table or the report goes to stdout. The summary for people would mix with it, and is left out
  // then.
  const bool quiet_stdout = check_files(
      study.inputs(), {{"--json", options.json}, {"--out", options.out}, {"its rows", unfinished}});
  OutputFile json(options.json);
  SweepRows rows(study, unfinished);
  if (rows.found() > 0)
    print_note(fmt::format("bristle: {} of {} rows are in {} already\n", count_text(rows.found()),
                           count_text(study.rows()), unfinished));
  const std::vector<std::uint64_t> to_do = rows.missing();
  const double start = bristle::DeadlineMonitor::wall_now();
  stop_on_signals();
  try {
    RowProgress progress(std::max<std::uint64_t>(to_do.size(), 1));
    const RowDone done = [&](const std::string& row) {
      rows.add(row);
      progress.one_done();
    };
    const StepCheck check = [] {
      if (stop_requested()) throw SweepStopped();
    };
    run_rows(study, to_do, options.threads, options.isa, done, check);
  } catch (const SweepStopped&) {
    print_note(resume_text(unfinished, rows));
    return 130;
  }
  if (!options.out.empty()) rows.write(options.out);
  if (json) json.write(report_json(rows, options.out, bristle::DeadlineMonitor::wall_now() - start));
  rows.remove();
  const SweepRefusal refusal = sweep_refusal(rows);
  if (refusal.of_all) throw UserError(refusal.text);
  if (!quiet_stdout) print_report(sweep_summary(rows, options.out));
  return 0;
}

}  // namespace cli
