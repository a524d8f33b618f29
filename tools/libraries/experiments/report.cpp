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
#include <nlohmann/json.hpp>

#include "tools/libraries/experiments/command.hpp"
#include "tools/libraries/reports/conditions.hpp"
#include "tools/libraries/reports/table.hpp"
#include "tools/libraries/reports/text_layout.hpp"

namespace cli {
namespace {

using Json = nlohmann::ordered_json;

// Formats a measured value with three digits, and a value below 5e-7 (a rounding error) as 0.
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
std::string cell(const Finding* finding, const char* yes, const char* no) {
  if (!finding) return "not measured";
  return fmt::format("{} {}", finding->shown ? yes : no, value_text(finding->value));
}

Cell found(const ExperimentResult& result, const Phenomenon& phenomenon, const std::string& model) {
  const Finding* finding = find(result, phenomenon.id, model);
  return {cell(finding, "yes", "no "), !finding         ? CellStyle::plain
                                       : finding->shown ? CellStyle::good
                                                        : CellStyle::bad};
}

std::string capitalised(std::string text) {
  text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
  return text;
}

/// Returns the titles of models, joined. Where a whole family of brushes (those that snap, or slide) is in
/// the list, the family's name replaces its titles.
std::string titles_of(const std::vector<std::string>& models) {
  static const std::vector<std::pair<std::string, std::vector<std::string>>> families = {
      {"brushes that snap", {"brush_redraw", "brush_keep", "brush_infinite", "brush_rubbed", "brush_aged"}},
      {"brushes that slide", {"brush_slide", "brush_slide_drop"}}};
  const auto has = [](const std::vector<std::string>& list, const std::string& model) {
    return std::find(list.begin(), list.end(), model) != list.end();
  };
  std::vector<std::string> titles;
  for (const std::string& model : models) {
    std::string title = model_title(model);
    for (const auto& [name, members] : families) {
      if (has(members, model) &&
          std::all_of(members.begin(), members.end(), [&](const auto& m) { return has(models, m); }))
        title = name;
    }
    if (!has(titles, title)) titles.push_back(title);
  }
  return fmt::format("{}", fmt::join(titles, "; "));
}

/// Returns a line for each group of models that have one verdict on a phenomenon for one reason. For the
/// verdict that most models have, only brushes and beds are named.
std::string reasons(const ExperimentResult& result, const Phenomenon& phenomenon,
                    const std::vector<std::string>& models) {
  struct Group {
    std::string reason;
    bool shown;
    std::vector<std::string> models;
  };
  std::vector<Group> groups;
  std::size_t shown = 0, judged = 0;
  for (const std::string& model : models) {
    const Finding* f = find(result, phenomenon.id, model);
    if (!f) continue;
    ++judged;
    shown += f->shown ? 1 : 0;
    std::string reason = reason_of(phenomenon.id, model, f->shown);
    if (reason.empty()) reason = "differs from the outcome with default parameters";
    auto group = std::find_if(groups.begin(), groups.end(),
                              [&](const Group& g) { return g.reason == reason && g.shown == f->shown; });
    if (group == groups.end()) group = groups.insert(group, {reason, f->shown, {}});
    group->models.push_back(model);
  }
  const bool most = 2 * shown >= judged;
  std::string text;
  for (Group& group : groups) {
    const bool all = group.models.size() == models.size();
    if (group.shown == most && !all)
      std::erase_if(group.models, [](const std::string& m) {
        return model_title(m).find("brush") == std::string::npos && m != "bed";
      });
    if (group.models.empty()) continue;
    text += fmt::format("  - *{}*, {}: {}.\n", all ? "all" : titles_of(group.models),
                        group.shown ? "yes" : "no", group.reason);
  }
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

std::string cost_page(const std::vector<CostRow>& cost, const std::vector<std::string>& models) {
  if (cost.empty()) return "";
  const Conditions c = conditions();
  std::string text = fmt::format(
      "\n## Cost\n\nCPU time of one step of one contact, two axes, force at the end and mean, all models "
      "interleaved: median (quartiles), ns.\nPresliding: steps of 0.003 mean snap lengths; sliding: 1. "
      "Brush: 900 bristles, single precision; infinite brush: 8 pieces.\n{}; {}; commit {}.\n\n"
      "| model | presliding | sliding |\n|---|---|---|\n",
      c.cpu, c.flags, c.commit);
  for (const std::string& model : models) {
    text += fmt::format("| {} |", model_title(model));
    for (const CostRow& row : cost) {
      if (row.model == model) text += fmt::format(" {:.0f} ({:.0f}-{:.0f}) |", row.ns, row.low, row.high);
    }
    text += '\n';
  }
  return text;
}

/// Calls `visit` for each run of successive experiments that have the same models.
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
  // Titles of models by the number of phenomena that they show, highest number first.
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

/// Returns a table with a row per phenomenon and a column per model; its width grows with the models.
std::string wide_table(std::span<const ExperimentReport> reports, const std::vector<std::string>& models) {
  std::vector<std::string> headers = {"<phenomenon", "<unit"};
  for (const std::string& model : models) headers.push_back("<" + model_title(model));
  Table table(headers);
  for (const ExperimentReport& report : reports) {
    for (const Phenomenon& phenomenon : report.experiment->phenomena) {
      std::vector<Cell> row = {phenomenon.title, phenomenon.unit};
      for (const std::string& model : models) row.push_back(found(report.result, phenomenon, model));
      table.add(std::move(row));
    }
  }
  return table.text();
}

/// Returns a table with a row per model and a column per phenomenon of one experiment.
std::string tall_table(const ExperimentReport& report, const std::vector<std::string>& models) {
  std::vector<std::string> headers = {"<" + report.experiment->name};
  for (const Phenomenon& p : report.experiment->phenomena)
    headers.push_back("<" + p.title + (p.unit.empty() ? "" : ", " + p.unit));
  Table table(headers);
  for (const std::string& model : models) {
    std::vector<Cell> row = {model_title(model)};
    for (const Phenomenon& p : report.experiment->phenomena) row.push_back(found(report.result, p, model));
    table.add(std::move(row));
  }
  return table.text();
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

std::string cost_table(const std::vector<CostRow>& cost, const std::vector<std::string>& models) {
  Table table({"<model", "<motion", "ns a step", "quartiles"});
  for (const std::string& model : models) {
    for (const CostRow& row : cost) {
      if (row.model != model) continue;
      table.add({model_title(model), row.motion, fmt::format("{:.0f}", row.ns),
                 fmt::format("{:.0f} to {:.0f}", row.low, row.high)});
    }
  }
  return table.text();
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

std::string experiment_json(const std::vector<ExperimentReport>& reports, const std::vector<CostRow>& cost) {
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
                                   {"measured", p.measured},
                                   {"passes", p.passes},
                                   {"reason", reason_of(p.id, f.model, f.shown)}});
      }
    }
    json["experiments"].push_back(std::move(one));
  }
  if (!cost.empty()) {
    json["cost"] = Json::array();
    for (const CostRow& row : cost)
      json["cost"].push_back({{"model", row.model},
                              {"motion", row.motion},
                              {"ns_per_step", row.ns},
                              {"quartiles_ns", {row.low, row.high}}});
  }
  return json.dump(2) + "\n";
}

std::string experiment_page(std::span<const ExperimentReport> reports, const std::vector<CostRow>& cost,
                            const std::vector<std::string>& models) {
  std::string text =
      "# The classic friction experiments\n\n"
      "Written by `bristle experiment all --markdown tools/EXPERIMENTS.md`; not edited by hand. Each cell is "
      "measured by\n`bristle experiment NAME` with its default parameters: **yes** where the number meets "
      "the criterion given below the table.\nModels: [rivals](libraries/rivals/README.md), "
      "[brush](../core/MODEL.md).\n\n## The table\n";
  for_each_group(reports, [&](std::span<const ExperimentReport> group, const std::vector<std::string>& of) {
    text += "\n| experiment | phenomenon |";
    for (const std::string& model : of) text += fmt::format(" {} |", model_title(model));
    text += "\n|---|---|";
    for (std::size_t i = 0; i < of.size(); ++i) text += "---|";
    text += '\n';
    for (const ExperimentReport& report : group) {
      for (const Phenomenon& p : report.experiment->phenomena) {
        text += fmt::format("| {} | {}{} |", report.experiment->name, p.title,
                            p.unit.empty() ? "" : ", " + p.unit);
        for (const std::string& model : of)
          text += cell(find(report.result, p.id, model), "**yes**", "**no**") + "|";
        text += '\n';
      }
    }
  });
  text += cost_page(cost, models);
  text +=
      "\n## What was measured, and why\n\nReasons are given for brushes and beds, and for models that differ "
      "from most others; `--json` has all.\n";
  for (const ExperimentReport& report : reports) {
    text +=
        fmt::format("\n### {}\n\n{}.\n\n", report.experiment->name, capitalised(report.experiment->title));
    for (const Phenomenon& p : report.experiment->phenomena) {
      text += fmt::format("- **{}.** {}. Measured: {}{}; yes: {}.\n", p.title, capitalised(p.literature),
                          p.measured, p.unit.empty() ? "" : ", " + p.unit, p.passes);
      text += reasons(report.result, p, report.models);
    }
  }
  return text;
}

}  // namespace cli
