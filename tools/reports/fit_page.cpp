#include "tools/reports/fit_page.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "tools/reports/html_page.hpp"
#include "tools/reports/line_chart.hpp"
#include "tools/reports/numbers.hpp"
#include "tools/reports/report_tables.hpp"

namespace cli {
namespace {

constexpr const char *grey = "#999999", *blue = "#0072B2", *orange = "#D55E00";

/// Null, which stands for a number that is not finite, as such.
std::vector<double> numbers_of(const Json& values, double scale = 1.0) {
  std::vector<double> out;
  for (const Json& value : values)
    out.push_back(value.is_number() ? scale * value.get<double>() : std::numeric_limits<double>::quiet_NaN());
  return out;
}

void add_chart(HtmlPage& page, const Chart& chart, const std::string& caption) {
  page.picture(chart_svg(chart), "image/svg+xml", caption);
}

double range_of(const std::vector<double>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return values.empty() ? 0.0 : *high - *low;
}

/// Columns as the file has them, then as they were understood.
void add_reading(HtmlPage& page, const Json& report) {
  page.section("read", "What was read");
  std::vector<std::string> lines;
  for (const Json& line : report.at("data").at("understood")) lines.push_back(line.get<std::string>());
  page.list(lines);
  const Json& written = report.at("as_written");
  const Json& curves = report.at("curves");
  page.part("written", "As written in the file");
  if (written.size() > 1) {
    const std::vector<double> t = numbers_of(written.at(0).at("values"));
    for (std::size_t i = 1; i < written.size(); ++i) {
      const std::string name = text_of(written.at(i), "header");
      add_chart(page,
                {text_of(written.at(0), "header"),
                 name,
                 {{"", grey, false, t, numbers_of(written.at(i).at("values"))}},
                 200},
                name + " over " + text_of(written.at(0), "header") + ", as in the file");
    }
  }
  page.part("understood", "As understood");
  const std::vector<double> t = numbers_of(curves.at("t_s"));
  const struct {
    const char *key, *title;
    double scale;
  } shown[] = {{"x_m", "position  [mm]", 1e3},
               {"load_n", "load  [N]", 1.0},
               {"force_n", "friction, by the body  [N]", 1.0}};
  for (const auto& s : shown)
    add_chart(page,
              {"time  [s]", s.title, {{"", blue, false, t, numbers_of(curves.at(s.key), s.scale)}}, 200},
              std::string(s.title) + " over time, as the fit takes it");
}

void add_curves(HtmlPage& page, const Json& curves, const char* place_key, const char* force_key,
                const char* fit_key, const std::string& axis) {
  const std::vector<double> t = numbers_of(curves.at("t_s")), force = numbers_of(curves.at(force_key)),
                            fit = numbers_of(curves.at(fit_key));
  std::vector<double> x = numbers_of(curves.at(place_key));
  const bool short_way = range_of(x) < 1e-3;
  for (double& place : x) place *= short_way ? 1e6 : 1e3;
  std::vector<double> residual;
  for (std::size_t i = 0; i < force.size(); ++i) residual.push_back(force[i] - fit[i]);
  const std::string place = fmt::format("position {}  [{}]", axis, short_way ? "um" : "mm"),
                    friction = fmt::format("friction along {}  [N]", axis);
  add_chart(page, {place, friction, {{"measured", grey, true, x, force}, {"fit", blue, false, x, fit}}, 420},
            "Friction over displacement: measured and fit");
  add_chart(page,
            {"time  [s]", friction, {{"measured", grey, true, t, force}, {"fit", blue, false, t, fit}}, 300},
            "Friction over time: measured and fit");
  add_chart(page, {"time  [s]", "measured - fit  [N]", {{"", orange, true, t, residual}}, 220},
            "Residuals over time");
  add_chart(page, {place, "measured - fit  [N]", {{"", orange, true, x, residual}}, 220},
            "Residuals over displacement");
}

void add_parameters(HtmlPage& page, const Json& parameters) {
  page.section("parameters", "What the record determines");
  Table found({"<parameter", "value", "95 % from", "to", "<unit"});
  Table open({"<parameter", "left at", "<unit", "<why"});
  for (const auto& [name, p] : parameters.items()) {
    if (p.at("determined").get<bool>())
      found.add({name, number_text(p.at("value")), number_text(p.at("low")), number_text(p.at("high")),
                 text_of(p, "unit")});
    else
      open.add({name, number_text(p.at("value")), text_of(p, "unit"),
                p.contains("why") ? text_of(p, "why") : std::string()});
  }
  page.table(found);
  page.section("open", "What it does not determine");
  page.table(open);
}

}  // namespace

std::string fit_report_page(const Json& report, const std::string& record) {
  HtmlPage page;
  const Json &data = report.at("data"), &left = report.at("residuals");
  page.section("summary", "At a glance");
  page.list(
      {fmt::format("{} samples over {} s, {} reversals, {} mm travelled; mean load {} N",
                   number_text(data.at("samples")), number_text(data.at("length_s")),
                   number_text(data.at("reversals")), number_text(data.at("travelled_m"), 1e3),
                   number_text(data.at("mean_load_n"))),
       fmt::format("law {}, rule {}", text_of(report, "law"), text_of(report, "rule")),
       fmt::format(
           "the brush explains {} % of the force; residuals {} N rms; intervals count {} samples, whose "
           "errors are alike, as one",
           number_text(left.at("explained"), 100.0), number_text(left.at("rms_n")),
           number_text(left.at("correlated_samples")))});
  for (const Json& note : report.at("notes")) page.paragraph(note.get<std::string>());
  page.section("fit", "Data and fit");
  const Json& curves = report.at("curves");
  add_curves(page, curves, "x_m", "force_n", "fit_n", "x");
  if (curves.contains("y_m")) add_curves(page, curves, "y_m", "force_y_n", "fit_y_n", "y");
  add_parameters(page, report.at("parameters"));
  add_reading(page, report);
  const Json& c = report.at("conditions");
  return page.text("Friction of " + record, fmt::format("bristle fit, commit {}; page written {}",
                                                        text_of(c, "commit"), text_of(c, "time")));
}

}  // namespace cli
