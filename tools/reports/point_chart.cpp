#include "tools/reports/point_chart.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include <fmt/format.h>

#include "tools/reports/table.hpp"

namespace cli {
namespace {

// Units of the view box. A phone shows 360 of its pixels for them, a desk twice as many.
constexpr double width = 480, height = 340, left = 58, right = 12, top = 44, bottom = 44;

/// A logarithmic axis, a little wider than what is on it.
struct LogAxis {
  double low = 0.0, high = 0.0;  // powers of ten
  double from = 0.0, to = 0.0;
  bool any = false;

  void take(double value) {
    if (!(value > 0.0) || !std::isfinite(value)) return;
    const double power = std::log10(value);
    low = any ? std::min(low, power) : power;
    high = any ? std::max(high, power) : power;
    any = true;
  }
  void widen() {
    const double room = std::max(0.06 * (high - low), 0.08);
    low -= room;
    high += room;
  }
  double at(double value) const { return from + (std::log10(value) - low) / (high - low) * (to - from); }

  /// Few enough to read: 1, 2 and 5 of each power of ten where there is room, else only some powers.
  std::vector<double> ticks() const {
    std::vector<double> all;
    const double span = high - low;
    const int every = span > 12.0 ? 3 : span > 6.0 ? 2 : 1;
    for (int power = static_cast<int>(std::floor(low)); power <= high; ++power) {
      if (power % every != 0) continue;
      for (const double times : {1.0, 2.0, 5.0}) {
        if (times > 1.0 && span > 2.2) continue;
        const double value = times * std::pow(10.0, power), place = std::log10(value);
        if (place >= low && place <= high) all.push_back(value);
      }
    }
    return all;
  }
};

std::string tick_text(double value) {
  if (value >= 1e15 || value < 1e-6) return fmt::format("{:.0e}", value);
  if (value >= 1e9) return fmt::format("{:.3g} G", value * 1e-9);
  if (value >= 1e6) return fmt::format("{:.3g} M", value * 1e-6);
  if (value >= 1e4) return fmt::format("{:.3g} k", value * 1e-3);
  return fmt::format("{:.6g}", value);
}

bool drawn(const ChartPoint& p) { return p.x > 0.0 && p.y > 0.0 && std::isfinite(p.x) && std::isfinite(p.y); }

std::string mark_svg(PointSeries::Mark mark, double x, double y, const std::string& colour) {
  switch (mark) {
    case PointSeries::Mark::ring:
      return fmt::format(
          "<circle class=\"mark\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"7\" fill=\"none\" stroke=\"{}\" "
          "stroke-width=\"2.5\"/>",
          x, y, colour);
    case PointSeries::Mark::diamond:
      return fmt::format("<path class=\"mark\" d=\"M{:.1f} {:.1f}l5 5l-5 5l-5 -5z\" fill=\"{}\"/>", x,
                         y - 5.0, colour);
    case PointSeries::Mark::square:
      return fmt::format(
          "<rect class=\"mark\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"8\" height=\"8\" fill=\"{}\"/>", x - 4.0,
          y - 4.0, colour);
    case PointSeries::Mark::dot:
      break;
  }
  return fmt::format("<circle class=\"mark\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3.6\" fill=\"{}\"/>", x, y,
                     colour);
}

/// Text of a point or a cell: in place of title and key, so that it is never cut off.
std::string saying(const std::string& says, bool opaque) {
  std::string text =
      opaque ? fmt::format("<rect width=\"{}\" height=\"{}\" fill=\"#fff\"/>", width, top) : "";
  double line = opaque ? 13.0 : 31.0;  // of a map below its title
  for (const std::string& part : broken_lines(says, 56)) {
    text += fmt::format("<text x=\"4\" y=\"{}\">{}</text>", line, escape_html(part));
    line += 14.0;
  }
  return "<g class=\"says\">" + text + "</g>";
}

std::string frame(const std::string& title) {
  return fmt::format(
      "<svg class=\"chart\" viewBox=\"0 0 {} {}\" role=\"img\">\n<title>{}</title>\n<text x=\"4\" "
      "y=\"14\" class=\"chart-title\">{}</text>\n",
      width, height, escape_html(title), escape_html(title));
}

std::string axes_svg(const LogAxis& x, const LogAxis& y, const std::string& x_title,
                     const std::string& y_title) {
  std::string svg;
  const auto out = std::back_inserter(svg);
  for (const double tick : x.ticks())
    fmt::format_to(
        out,
        "<path class=\"grid\" d=\"M{0:.1f} {1}V{2}\"/><text class=\"tick\" x=\"{0:.1f}\" y=\"{3}\" "
        "text-anchor=\"middle\">{4}</text>\n",
        x.at(tick), top, height - bottom, height - bottom + 14, tick_text(tick));
  for (const double tick : y.ticks())
    fmt::format_to(
        out,
        "<path class=\"grid\" d=\"M{0} {1:.1f}H{2}\"/><text class=\"tick\" x=\"{3}\" y=\"{4:.1f}\" "
        "text-anchor=\"end\">{5}</text>\n",
        left, y.at(tick), width - right, left - 4, y.at(tick) + 4, tick_text(tick));
  fmt::format_to(out, "<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\">{} (log scale)</text>\n",
                 0.5 * (left + width - right), height - 8, escape_html(x_title));
  fmt::format_to(
      out,
      "<text transform=\"translate(12,{:.1f}) rotate(-90)\" text-anchor=\"middle\">{} (log scale)</text>\n",
      0.5 * (top + height - bottom), escape_html(y_title));
  return svg;
}

std::string key_svg(const std::vector<PointSeries>& series) {
  std::string svg = "<g class=\"key\">";
  double place = 4.0;
  for (const PointSeries& s : series) {
    if (s.name.empty() || std::none_of(s.points.begin(), s.points.end(), drawn)) continue;
    svg += mark_svg(s.mark, place + 6.0, 31.0, s.colour);
    svg += fmt::format("<text x=\"{:.1f}\" y=\"35\">{}</text>", place + 16.0, escape_html(s.name));
    place += 30.0 + 6.6 * static_cast<double>(width_of(s.name));
  }
  return svg + "</g>\n";
}

void fit_to_frame(LogAxis& x, LogAxis& y) {
  x.widen();
  y.widen();
  x.from = left;
  x.to = width - right;
  y.from = height - bottom;
  y.to = top;
}

}  // namespace

std::string point_chart_svg(const PointChart& chart) {
  LogAxis x, y;
  for (const PointSeries& s : chart.series) {
    for (const ChartPoint& p : s.points) {
      if (!drawn(p)) continue;
      x.take(p.x);
      y.take(p.y);
    }
  }
  if (!x.any) return "";
  for (const GuideLine& guide : chart.guides) (guide.upright ? x : y).take(guide.at);
  fit_to_frame(x, y);
  std::string svg = frame(chart.title) + axes_svg(x, y, chart.x_title, chart.y_title) + key_svg(chart.series);
  const auto out = std::back_inserter(svg);
  for (const GuideLine& guide : chart.guides) {
    if (!(guide.at > 0.0) || !std::isfinite(guide.at)) continue;
    const double at = (guide.upright ? x : y).at(guide.at);
    if (guide.upright)
      fmt::format_to(out,
                     "<path class=\"guide\" d=\"M{0:.1f} {1}V{2}\"/><text x=\"{3:.1f}\" y=\"{4}\" "
                     "text-anchor=\"end\">{5}</text>\n",
                     at, top, height - bottom, at - 4.0, top + 12.0, escape_html(guide.says));
    else
      fmt::format_to(out,
                     "<path class=\"guide\" d=\"M{0} {1:.1f}H{2}\"/><text x=\"{3}\" y=\"{4:.1f}\" "
                     "text-anchor=\"end\">{5}</text>\n",
                     left, at, width - right, width - right - 2.0, at - 4.0, escape_html(guide.says));
  }
  for (const PointSeries& s : chart.series) {
    if (s.line) {
      std::string path;
      for (const ChartPoint& p : s.points)
        if (drawn(p)) path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : "L", x.at(p.x), y.at(p.y));
      if (!path.empty())
        fmt::format_to(out, "<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\"/>\n", path,
                       s.colour);
    }
    for (const ChartPoint& p : s.points) {
      if (!drawn(p)) continue;
      fmt::format_to(out,
                     "<g class=\"point\" tabindex=\"0\"><circle cx=\"{0:.1f}\" cy=\"{1:.1f}\" r=\"9\" "
                     "fill=\"transparent\"/>{2}{3}</g>\n",
                     x.at(p.x), y.at(p.y), mark_svg(s.mark, x.at(p.x), y.at(p.y), s.colour),
                     saying(p.says, true));
    }
  }
  return svg + "</svg>\n";
}

std::string map_chart_svg(const MapChart& chart, const std::vector<std::string>& colours) {
  if (chart.xs.empty() || chart.ys.empty() || chart.cells.empty()) return "";
  LogAxis x, y;
  for (const double value : chart.xs) x.take(value);
  for (const double value : chart.ys) y.take(value);
  if (!x.any || !y.any) return "";
  fit_to_frame(x, y);
  const double cell_width = (width - right - left) / static_cast<double>(chart.xs.size()) * 0.92,
               cell_height = (height - bottom - top) / static_cast<double>(chart.ys.size()) * 0.92;
  std::string svg = frame(chart.title) + axes_svg(x, y, chart.x_title, chart.y_title);
  for (const MapCellMark& cell : chart.cells) {
    const double at_x = chart.xs[cell.column], at_y = chart.ys[cell.row];
    if (!(at_x > 0.0) || !(at_y > 0.0)) continue;
    svg += fmt::format(
        "<g class=\"point\"><rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" "
        "fill=\"{}\"/>{}</g>\n",
        x.at(at_x) - 0.5 * cell_width, y.at(at_y) - 0.5 * cell_height, cell_width, cell_height,
        colours[cell.kind], saying(cell.says, false));
  }
  return svg + "</svg>\n";
}

}  // namespace cli
