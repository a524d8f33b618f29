#include "tools/reports/line_chart.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include <fmt/format.h>

#include "tools/reports/table.hpp"

namespace cli {
namespace {

constexpr int width = 900, left = 90, right = 20, top = 30, bottom = 50;

/// Range of an axis and places of its ticks.
struct Axis {
  double low = 0.0, high = 1.0, step = 1.0;
  double from, to;  // pixels

  Axis(const std::vector<ChartSeries>& series, bool of_x, double from_px, double to_px)
      : from(from_px), to(to_px) {
    bool any = false;
    for (const ChartSeries& s : series) {
      for (const double value : of_x ? s.x : s.y) {
        if (!std::isfinite(value)) continue;
        low = any ? std::min(low, value) : value;
        high = any ? std::max(high, value) : value;
        any = true;
      }
    }
    if (!(high > low)) {
      const double room = std::max(std::fabs(low), 1e-12);
      low -= 0.5 * room;
      high += 0.5 * room;
    }
    const double rough = (high - low) / 6.0, ten = std::pow(10.0, std::floor(std::log10(rough)));
    step = ten * (rough / ten > 5.0 ? 10.0 : rough / ten > 2.0 ? 5.0 : rough / ten > 1.0 ? 2.0 : 1.0);
    if (!of_x) {
      low -= 0.04 * (high - low);
      high += 0.04 * (high - low);
    }
  }
  double at(double value) const { return from + (value - low) / (high - low) * (to - from); }
  std::vector<double> ticks() const {
    std::vector<double> all;
    for (double k = std::ceil(low / step); k * step <= high + 1e-9 * step; k += 1.0) all.push_back(k * step);
    return all;
  }
};

void add_curve(std::string& svg, const ChartSeries& s, const Axis& x, const Axis& y) {
  const auto out = std::back_inserter(svg);
  if (s.dots) {
    for (std::size_t i = 0; i < s.x.size(); ++i) {
      if (std::isfinite(s.x[i]) && std::isfinite(s.y[i]))
        fmt::format_to(out, "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"1.5\" fill=\"{}\"/>", x.at(s.x[i]),
                       y.at(s.y[i]), s.colour);
    }
    return;
  }
  bool open = false;
  for (std::size_t i = 0; i < s.x.size(); ++i) {
    const bool there = std::isfinite(s.x[i]) && std::isfinite(s.y[i]);
    if (there && !open)
      fmt::format_to(out, "<polyline fill=\"none\" stroke=\"{}\" stroke-width=\"1.2\" points=\"", s.colour);
    if (there) fmt::format_to(out, "{:.1f},{:.1f} ", x.at(s.x[i]), y.at(s.y[i]));
    if (!there && open) svg += "\"/>\n";
    open = there;
  }
  if (open) svg += "\"/>\n";
}

}  // namespace

std::string chart_svg(const Chart& chart) {
  const Axis x(chart.series, true, left, width - right), y(chart.series, false, chart.height - bottom, top);
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" "
      "font-family=\"sans-serif\" font-size=\"13\" fill=\"#333\">\n<rect width=\"{0}\" height=\"{1}\" "
      "fill=\"#fff\"/>\n",
      width, chart.height);
  const auto out = std::back_inserter(svg);
  const int floor = chart.height - bottom;
  for (const double tick : x.ticks())
    fmt::format_to(out,
                   "<line x1=\"{0:.1f}\" y1=\"{1}\" x2=\"{0:.1f}\" y2=\"{2}\" stroke=\"#e4e4e4\"/><text "
                   "x=\"{0:.1f}\" y=\"{3}\" text-anchor=\"middle\">{4:.4g}</text>\n",
                   x.at(tick), top, floor, floor + 18, std::fabs(tick) < 1e-9 * x.step ? 0.0 : tick);
  for (const double tick : y.ticks())
    fmt::format_to(out,
                   "<line x1=\"{0}\" y1=\"{1:.1f}\" x2=\"{2}\" y2=\"{1:.1f}\" stroke=\"#e4e4e4\"/><text "
                   "x=\"{3}\" y=\"{4:.1f}\" text-anchor=\"end\">{5:.4g}</text>\n",
                   left, y.at(tick), width - right, left - 6, y.at(tick) + 4,
                   std::fabs(tick) < 1e-9 * y.step ? 0.0 : tick);
  for (const ChartSeries& s : chart.series) add_curve(svg, s, x, y);
  fmt::format_to(out, "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n",
                 (left + width - right) / 2, chart.height - 12, escape_html(chart.x_title));
  fmt::format_to(out, "<text transform=\"translate(18,{}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
                 (top + floor) / 2, escape_html(chart.y_title));
  int place = left;
  for (const ChartSeries& s : chart.series) {
    if (s.name.empty()) continue;
    fmt::format_to(
        out,
        "<rect x=\"{}\" y=\"10\" width=\"14\" height=\"6\" fill=\"{}\"/><text x=\"{}\" y=\"18\">{}</text>\n",
        place, s.colour, place + 20, escape_html(s.name));
    place += 50 + 8 * static_cast<int>(s.name.size());
  }
  return svg + "</svg>\n";
}

}  // namespace cli
