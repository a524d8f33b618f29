// Writes the output of `bristle experiment`: tables for people, CSV for plots, JSON for programs, the page
// EXPERIMENTS.md.
#include <algorithm>
#include <cctype>
#include <cmath>
#include <functional>
#include <iterator>
#include <map>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "tools/libraries/experiments/command.hpp"
#include "tools/libraries/reports/conditions.hpp"
#include "tools/libraries/reports/report_tables.hpp"
#include "tools/libraries/reports/text_layout.hpp"

namespace cli {
namespace {

// Formats a measured value with three digits. A value below 5e-7 is a rounding error and printed as 0.
std::string value_text(double value) {
  if (std::fabs(value) < 5e-7) return "0";
  const double size = std::fabs(value);
  if (size >= 1e5 || size < 1e-3) return fmt::format("{:.1e}", value);
  const int digits = std::max(0, 2 - static_cast<int>(std::floor(std::log10(size))));
  std::string text = fmt::format("{:.{}f}", value, digits);
  if (text.find('.') != std::string::npos) {
    text.erase(text.find_last_not_of('0') + 1);
    if (text.back() == '.') text.pop_back();
  }
  return text;
}

const Finding* find(const ExperimentResult& result, const std::string& phenomenon, const std::string& model) {
  for (const Finding& f : result.findings) {
    if (f.phenomenon == phenomenon && f.model == model) return &f;
  }
  return nullptr;
}

/// Formats a table cell: the verdict on a phenomenon and the measured value, without its unit.
std::string cell(const Finding* finding) {
  if (!finding) return "not measured";
  return fmt::format("{} {}", finding->shown ? "yes" : "no ", value_text(finding->value));
}

/// Formats a cell of the page: the measured value, in bold if the model shows the phenomenon.
std::string page_cell(const Finding* finding) {
  if (!finding) return "not measured";
  return finding->shown ? fmt::format("**{}**", value_text(finding->value)) : value_text(finding->value);
}

Cell found(const ExperimentResult& result, const Phenomenon& phenomenon, const std::string& model,
           bool with_value) {
  const Finding* finding = find(result, phenomenon.id, model);
  if (!finding) return "not measured";
  return {with_value       ? cell(finding)
          : finding->shown ? "yes"
                           : "no",
          finding->shown ? CellStyle::good : CellStyle::plain};
}

std::string capitalised(std::string text) {
  text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  return text;
}

Json parameters_json(const Settings& settings) {
  Json json = Json::object();
  for (const Parameter& p : settings.parameters()) {
    if (!p.choices.empty()) {
      json[p.name] = p.text;
    } else if (p.is_list) {
      json[p.name] = p.numbers;
    } else {
      json[p.name] = p.numbers.front();
    }
  }
  return json;
}

/// Calls `visit` for each group of successive experiments that have the same models, which can share a table.
template <class Visit>
void for_each_group(std::span<const ExperimentReport> reports, const Visit& visit) {
  while (!reports.empty()) {
    std::size_t same = 1;
    while (same < reports.size() && reports[same].models == reports[0].models) ++same;
    visit(reports.first(same), reports[0].models);
    reports = reports.subspan(same);
  }
}

std::string findings_answer(std::span<const ExperimentReport> reports,
                            const std::vector<std::string>& models) {
  // Titles of models, sorted by the number of phenomena that they show, highest number first.
  std::map<std::size_t, std::string, std::greater<>> groups;
  std::size_t phenomena = 0;
  for (const ExperimentReport& report : reports) phenomena += report.experiment->phenomena.size();
  for (const std::string& model : models) {
    std::size_t shown = 0;
    for (const ExperimentReport& report : reports)
      for (const Finding& f : report.result.findings) shown += f.model == model && f.shown ? 1 : 0;
    std::string& group = groups[shown];
    group += (group.empty() ? "" : "; ") + model_title(model);
  }
  std::string text =
      reports.size() == 1
          ? fmt::format("{}, what is shown of {}: ", reports[0].experiment->name,
                        phenomena == 1 ? "1 phenomenon" : fmt::format("{} phenomena", phenomena))
          : fmt::format("Shown of {} phenomena in {} experiments: ", phenomena, reports.size());
  const char* separator = "";
  for (const auto& [shown, who] : groups) {
    text += fmt::format("{}{} by {}", separator,
                        shown == phenomena && shown > 1 ? "all" : std::to_string(shown), who);
    separator = ", ";
  }
  return text + ".\n";
}

/// Returns a table with a row per phenomenon and a column per model, so that it becomes wider with every
/// model.
std::string wide_table(std::span<const ExperimentReport> reports, const std::vector<std::string>& models) {
  std::vector<std::string> headers = {"<phenomenon", "<unit"};
  for (const std::string& model : models) headers.push_back("<" + model_title(model));
  Table table(headers);
  for (const ExperimentReport& report : reports) {
    for (const Phenomenon& phenomenon : report.experiment->phenomena) {
      std::vector<Cell> row = {phenomenon.title, phenomenon.unit};
      for (const std::string& model : models) row.push_back(found(report.result, phenomenon, model, true));
      table.add(std::move(row));
    }
  }
  return table.text();
}

/// Returns a table with a row per model and a numbered column per phenomenon of one experiment. Lines above
/// the table say what the numbers mean.
std::string tall_table(const ExperimentReport& report, const std::vector<std::string>& models) {
  const std::vector<Phenomenon>& phenomena = report.experiment->phenomena;
  std::string legend;
  std::vector<std::string> headers = {"<" + report.experiment->name};
  for (std::size_t i = 0; i < phenomena.size(); ++i) {
    const Phenomenon& p = phenomena[i];
    headers.push_back(fmt::format("<[{}]", i + 1));
    legend += fmt::format("[{}]  {}{}\n", i + 1, p.title, p.unit.empty() ? "" : ", " + p.unit);
  }
  const auto table_of = [&](bool with_values) {
    Table table(headers);
    for (const std::string& model : models) {
      std::vector<Cell> row = {model_title(model)};
      for (const Phenomenon& p : phenomena) row.push_back(found(report.result, p, model, with_values));
      table.add(std::move(row));
    }
    return table;
  };
  const Table table = table_of(true);
  legend += '\n';
  const std::string note = report.experiment->note(report.settings, models);
  if (table.natural_width() <= text_layout().columns) return legend + table.text() + note;
  return legend + table_of(false).text() + "Measured values: --wide, --json.\n" + note;
}

}  // namespace

std::string findings_text(std::span<const ExperimentReport> reports) {
  std::string text;
  for_each_group(reports,
                 [&](std::span<const ExperimentReport> group, const std::vector<std::string>& models) {
                   text += (text.empty() ? "" : "\n") + findings_answer(group, models) + '\n';
                   if (text_layout().columns == 0) {
                     text += wide_table(group, models);
                     return;
                   }
                   const char* separator = "";
                   for (const ExperimentReport& report : group) {
                     text += separator + tall_table(report, models);
                     separator = "\n";
                   }
                 });
  return text;
}

std::string experiment_csv(const ExperimentReport& report) {
  fmt::memory_buffer buffer;
  const auto to = std::back_inserter(buffer);
  fmt::format_to(to, "panel,model,{}\n", fmt::join(report.experiment->columns, ","));
  for (const SeriesRow& row : report.result.series) {
    fmt::format_to(to, "{},{}", row.panel, row.model);
    for (const double value : row.values) fmt::format_to(to, ",{:.9g}", value);
    buffer.push_back('\n');
  }
  return {buffer.data(), buffer.size()};
}

std::string experiment_json(const std::vector<ExperimentReport>& reports) {
  Json json;
  json["schema"] = "bristle-experiment-1";
  json["conditions"] = to_json(conditions());
  json["experiments"] = Json::array();
  for (const ExperimentReport& report : reports) {
    Json one;
    one["name"] = report.experiment->name;
    one["parameters"] = parameters_json(report.settings);
    one["findings"] = Json::array();
    for (const Phenomenon& p : report.experiment->phenomena) {
      for (const Finding& f : report.result.findings) {
        if (f.phenomenon != p.id) continue;
        one["findings"].push_back({{"phenomenon", p.id},
                                   {"model", f.model},
                                   {"value", f.value},
                                   {"unit", p.unit},
                                   {"shown", f.shown},
                                   {"literature", p.literature},
                                   {"measured", p.measured},
                                   {"passes", p.passes},
                                   {"reason", reason_of(p.id, f.model, f.shown)}});
      }
    }
    json["experiments"].push_back(std::move(one));
  }
  return json_text(json);
}

std::string experiment_page(std::span<const ExperimentReport> reports) {
  std::string text =
      "# The classic friction experiments\n\n"
      "Written by `bristle experiment all --markdown tools/EXPERIMENTS.md`; not edited by hand. Each cell is "
      "what\n`bristle experiment NAME` measures with its default parameters, in bold where it meets the "
      "experiment's criterion: the\nmodel shows the phenomenon. `--json` adds literature, criterion and "
      "reason "
      "to each.\n"
      "Models: [rivals](libraries/rivals/README.md), [brush](../core/MODEL.md).\n\n## The table\n";
  for_each_group(reports, [&](std::span<const ExperimentReport> group, const std::vector<std::string>& of) {
    std::vector<std::string> headers = {"experiment", "phenomenon"};
    for (const std::string& model : of) headers.push_back(model_title(model));
    Table table(headers);
    for (const ExperimentReport& report : group) {
      for (const Phenomenon& p : report.experiment->phenomena) {
        std::vector<Cell> row = {report.experiment->name, p.title + (p.unit.empty() ? "" : ", " + p.unit)};
        for (const std::string& model : of) row.emplace_back(page_cell(find(report.result, p.id, model)));
        table.add(std::move(row));
      }
    }
    text += '\n' + table.markdown();
  });
  text += "\n## Gallery\n\n`tools/plots/make_experiment_pictures` draws all pictures.\n";
  for (const ExperimentReport& report : reports) {
    const std::string& name = report.experiment->name;
    std::string picture = name;
    std::replace(picture.begin(), picture.end(), '-', '_');
    text += fmt::format(
        "\n### {0}\n\n{1}. {2}.\n\n![{0}](plots/pictures/experiment_{3}.png)\n\n"
        "`bristle experiment {0} --plot {0}.png`\n",
        name, capitalised(report.experiment->title), report.experiment->result, picture);
  }
  return text;
}

}  // namespace cli
