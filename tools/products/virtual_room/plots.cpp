#include "tools/products/virtual_room/plots.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <iterator>
#include <string>

#include "tools/products/virtual_room/quantity_text.hpp"

namespace room {

namespace {

constexpr ImU32 plot_ground = IM_COL32(15, 17, 21, 255);

struct Axis {
  double low = 0, high = 1;
  double at(double value) const { return (value - low) / (high - low); }
};

// Returns the thickness of curves in pixels, which grows with the display scale.
float stroke(const Pen& pen) { return 1.5f * pen.fonts.small->FontSize / 13; }

// Frame of a plot with ticks and title; it maps values to pixels.
class Frame {
 public:
  Frame(const Pen& pen, const Area& area, const char* title, Axis x, Axis y) : pen_(pen), x_(x), y_(y) {
    const float line = pen.fonts.small->FontSize;
    inner_ = {area.x + 3.1f * line, area.y + 1.7f * line, std::max(area.width - 3.9f * line, 20.0f),
              height_in(pen, area)};
    pen_.draw.AddRectFilled({inner_.x, inner_.y}, {inner_.x + inner_.width, inner_.y + inner_.height},
                            plot_ground, 2);
    pen_.draw.AddText(pen.fonts.bold, pen.fonts.small->FontSize * 1.06f, {area.x + 0.2f * line, area.y},
                      colours::text, title);
    pen_.draw.PushClipRect({area.x, area.y}, {area.x + area.width, area.y + area.height}, true);
  }
  ~Frame() { pen_.draw.PopClipRect(); }
  // Returns the height inside the frame of a plot in this area, pixels.
  static float height_in(const Pen& pen, const Area& area) {
    return std::max(area.height - 3.0f * pen.fonts.small->FontSize, 20.0f);
  }
  Frame(const Frame&) = delete;
  Frame& operator=(const Frame&) = delete;

  ImVec2 at(double x, double y) const {
    return {inner_.x + inner_.width * static_cast<float>(x_.at(x)),
            inner_.y + inner_.height * (1 - static_cast<float>(y_.at(y)))};
  }
  const Area& inner() const { return inner_; }
  void clip() const {
    pen_.draw.PushClipRect({inner_.x, inner_.y}, {inner_.x + inner_.width, inner_.y + inner_.height}, true);
  }
  void unclip() const { pen_.draw.PopClipRect(); }

  // Draws a line of the grid at a value of the axis, and the value's text beside the frame.
  void line_x(double value, const std::string& text) const {
    const float x = at(value, y_.low).x, below = inner_.y + inner_.height;
    pen_.draw.AddLine({x, inner_.y}, {x, below}, colours::faint_line);
    pen_.write_small(x, below + 2, 0.5f, colours::faint_text, text);
  }
  void line_y(double value, const std::string& text, ImU32 colour = colours::faint_line) const {
    const float y = at(x_.low, value).y;
    pen_.draw.AddLine({inner_.x, y}, {inner_.x + inner_.width, y}, colour);
    pen_.write_small(inner_.x - 5, y - 0.5f * pen_.fonts.small->FontSize, 1.0f, colours::faint_text, text);
  }
  void grid_x(double scale, int wanted, double offset = 0.0) const {
    const double step = find_step((x_.high - x_.low) / scale, wanted) * scale;
    const double low = x_.low - offset, high = x_.high - offset;
    for (double v = std::ceil(low / step) * step; v <= high + 1e-9 * step; v += step)
      line_x(offset + v, number(v / scale, step / scale));
  }
  void grid_y(int wanted) const {
    const double step = find_step(y_.high - y_.low, wanted);
    for (double v = std::ceil(y_.low / step) * step; v <= y_.high + 1e-9 * step; v += step) {
      const bool zero = std::abs(v) < 1e-9 * step;
      line_y(v, number(v, step), zero ? IM_COL32(88, 96, 110, 255) : colours::faint_line);
    }
  }
  void dashed(double y, ImU32 colour, float dash = 5) const {
    const float py = at(x_.low, y).y;
    for (float x = inner_.x; x < inner_.x + inner_.width; x += dash + 4)
      pen_.draw.AddLine({x, py}, {x + dash, py}, colour);
  }
  // Draws a ring at a value of the plot, if it is within the range, and labels it at the plot's upper edge.
  void mark(double x, double y, ImU32 colour, const std::string& text) const {
    const ImVec2 p = at(x, y);
    const float size = pen_.fonts.small->FontSize, radius = 0.3f * size;
    const float wide = pen_.small_width(text);
    if (y <= y_.high) pen_.draw.AddCircle(p, radius, colour, 16, 1.2f * stroke(pen_));
    const bool left = p.x - wide - 2 * radius > inner_.x;
    pen_.write_small(left ? p.x - 2 * radius : p.x + 2 * radius, inner_.y + 1, left ? 1.0f : 0.0f, colour,
                     text);
  }

 private:
  static double find_step(double span, int wanted) {
    const double rough = span / std::max(wanted, 1);
    const double power = std::pow(10.0, std::floor(std::log10(std::max(rough, 1e-300))));
    const double r = rough / power;
    return power * (r <= 1 ? 1 : r <= 2 ? 2 : r <= 5 ? 5 : 10);
  }
  static std::string number(double v, double step) {
    const int decimals = std::max(0, static_cast<int>(-std::floor(std::log10(step) + 1e-9)));
    return fmt::format("{:.{}f}", std::abs(v) < 1e-9 * step ? 0.0 : v, decimals);
  }

  const Pen& pen_;
  Axis x_, y_;
  Area inner_;
};

// Entry of a legend, drawn as a short line in a curve's colour and the curve's name.
struct LegendEntry {
  std::string text;
  ImU32 colour;
};

float width_of(const Pen& pen, const LegendEntry& entry) {
  const float line = pen.fonts.small->FontSize;
  return pen.small_width(entry.text) + 1.7f * line;
}

// Returns the longest of some titles that fits above the plot beside `taken` pixels of a legend. The titles
// are ordered by length, the longest first; if none fits, returns the last.
std::string title_for(const Pen& pen, const Area& area, float taken,
                      std::initializer_list<std::string> titles) {
  const float line = pen.fonts.small->FontSize;
  for (const std::string& title : titles) {
    if (pen.fonts.bold->CalcTextSizeA(1.06f * line, 1e4f, 0, title.c_str()).x + taken <
        area.width - 1.4f * line)
      return title;
  }
  return *(titles.end() - 1);
}

// Draws a legend to the right of the title, where it covers no curve.
void draw_legend(const Pen& pen, const Frame& frame, const Area& area,
                 const std::vector<LegendEntry>& entries) {
  const float line = pen.fonts.small->FontSize, middle = area.y + 0.55f * line;
  float x = frame.inner().x + frame.inner().width;
  for (std::size_t i = entries.size(); i-- > 0;) {
    x -= width_of(pen, entries[i]);
    pen.draw.AddLine({x + 0.3f * line, middle}, {x + 1.2f * line, middle}, entries[i].colour,
                     1.7f * stroke(pen));
    pen.write_small(x + 1.5f * line, area.y, 0, colours::text, entries[i].text);
  }
}

// Returns the index, from `first` on, of the point with the highest friction, in either direction.
std::size_t find_peak(const History& history, std::size_t first) {
  std::size_t peak = first;
  for (std::size_t i = first; i < history.size(); ++i) {
    if (std::abs(history[i].friction) > std::abs(history[peak].friction)) peak = i;
  }
  return peak;
}

void draw_levels(const Frame& frame, FrictionLevels levels) {
  for (const double side : {1.0, -1.0}) {
    if (levels.kinetic > 0) frame.dashed(side * levels.kinetic, IM_COL32(255, 133, 64, 130));
    if (levels.peak > 0) frame.dashed(side * levels.peak, IM_COL32(226, 230, 236, 110), 2);
  }
}

// Draws a curve by its least and greatest value in each column of pixels, so that the time does not depend on
// the number of points.
template <class Value>
void draw_curve(const Pen& pen, const Frame& frame, const History& history, std::size_t first, ImU32 colour,
                float thickness, Value value) {
  const Area& in = frame.inner();
  ImVec2 last{};
  bool any = false;
  std::size_t i = first;
  while (i < history.size()) {
    const float column = std::floor(frame.at(history[i].time, 0).x);
    double low = value(history[i]), high = low, end = low;
    for (; i < history.size() && std::floor(frame.at(history[i].time, 0).x) == column; ++i) {
      end = value(history[i]);
      low = std::min(low, end);
      high = std::max(high, end);
    }
    const float x = column + 0.5f;
    const ImVec2 top{x, frame.at(0, high).y}, bottom{x, frame.at(0, low).y}, at{x, frame.at(0, end).y};
    if (any) pen.draw.AddLine(last, bottom.y - last.y < last.y - top.y ? bottom : top, colour, thickness);
    if (bottom.y - top.y > 1) pen.draw.AddLine(top, bottom, colour, thickness);
    last = at;
    any = true;
  }
  if (any && last.x < in.x + in.width + 1) pen.draw.AddCircleFilled(last, 1.8f * thickness, colour);
}

// Share of a plot's height, at its bottom, that is kept for the bars of snaps.
constexpr double snaps_share = 0.18;

// Draws the snaps per millisecond as bars in the strip below the curves.
void draw_snaps(const Pen& pen, const Frame& frame, const History& history, std::size_t first,
                float seconds) {
  const Area& in = frame.inner();
  const float low = in.y + in.height, high = static_cast<float>(snaps_share) * in.height - 2;
  pen.draw.AddLine({in.x, low - high - 1}, {in.x + in.width, low - high - 1}, colours::line);
  std::vector<float> columns(static_cast<std::size_t>(in.width) + 1, 0.0f);
  for (std::size_t i = first; i < history.size(); ++i) {
    const float x = frame.at(static_cast<double>(history[i].time), 0).x - in.x;
    if (x >= 0 && x < in.width) columns[static_cast<std::size_t>(x)] += history[i].snaps;
  }
  const float most = *std::max_element(columns.begin(), columns.end());
  if (!(most > 0) || !std::isfinite(most)) return;
  for (std::size_t k = 0; k < columns.size(); ++k) {
    if (!(columns[k] > 0)) continue;
    const float x = in.x + static_cast<float>(k);
    pen.draw.AddRectFilled({x, low - std::max(1.0f, high * columns[k] / most)}, {x + 1, low},
                           (colours::snaps & 0x00ffffffu) | 0x90000000u);
  }
  const double per_ms =
      static_cast<double>(most) * static_cast<double>(in.width) / (1e3 * static_cast<double>(seconds));
  std::string text = fmt::format("snaps/ms, up to {:.{}f}", per_ms, per_ms < 10 ? 1 : 0);
  if (per_ms >= 1e5) text = fmt::format("snaps/ms, up to {:.1e}", per_ms);
  const float line = pen.fonts.small->FontSize;
  if (high < 1.1f * line) return;  // no room for this label within the strip
  const float wide = pen.small_width(text);
  pen.draw.AddRectFilled({in.x + 2, low - high}, {in.x + 6 + wide, low - high + 1.1f * line}, plot_ground);
  pen.write_small(in.x + 4, low - high, 0, colours::snaps, text);
}

// Returns the place in a plot for a small inset plot, in one of its corners (0 to 3: lower right, upper left,
// upper right, lower left).
Area corner_of(const Area& in, int corner) {
  const float wide = 0.41f * in.width, high = 0.44f * in.height, gap = 3;
  const bool right = corner == 0 || corner == 2, upper = corner == 1 || corner == 2;
  return {right ? in.x + in.width - wide - gap : in.x + gap,
          upper ? in.y + gap : in.y + in.height - high - gap, wide, high};
}

// Draws an inset plot of friction over displacement in the first bending since the reset.
void draw_inset(const Pen& pen, const FirstBending& bending, const Area& box) {
  const float line = pen.fonts.small->FontSize;
  pen.draw.AddRectFilled({box.x, box.y}, {box.x + box.width, box.y + box.height}, IM_COL32(24, 28, 34, 240),
                         2);
  pen.draw.AddRect({box.x, box.y}, {box.x + box.width, box.y + box.height}, colours::line, 2);
  float x_low = 0, x_high = 0, y_low = 0, y_high = 0;
  for (std::size_t i = 0; i < bending.size(); ++i) {
    x_low = std::min(x_low, bending[i].first);
    x_high = std::max(x_high, bending[i].first);
    y_low = std::min(y_low, bending[i].second);
    y_high = std::max(y_high, bending[i].second);
  }
  const Area curve{box.x + 4, box.y + 1.5f * line, box.width - 8, box.height - 1.5f * line - 4};
  const auto at = [&](std::size_t i) -> ImVec2 {
    return {curve.x + curve.width * (bending[i].first - x_low) / std::max(x_high - x_low, 1e-9f),
            curve.y + curve.height * (1 - (bending[i].second - y_low) / std::max(y_high - y_low, 1e-6f))};
  };
  for (std::size_t i = 1; i < bending.size(); ++i)
    pen.draw.AddLine(at(i - 1), at(i), colours::friction, stroke(pen));
  const float most = std::abs(y_low) > y_high ? y_low : y_high;
  pen.write_small(box.x + 4, box.y + 1, 0, colours::faint_text,
                  fmt::format("{} {:.2f} N", box.width > 10 * line ? "first bending, to" : "first:",
                              static_cast<double>(most)));
}

}  // namespace

void FollowingRange::follow(double data_low, double data_high, double least_span, float elapsed) {
  const double middle = 0.5 * (data_low + data_high);
  const double half = std::max(0.5 * least_span, 0.56 * (data_high - data_low));
  const double wanted_low = middle - half, wanted_high = middle + half;
  if (!set) {
    low = wanted_low;
    high = wanted_high;
    set = true;
    return;
  }
  const double ease = 1 - std::exp(-1.5 * static_cast<double>(elapsed));
  low = wanted_low < low ? wanted_low : low + ease * (wanted_low - low);
  high = wanted_high > high ? wanted_high : high + ease * (wanted_high - high);
}

ValueRange range_of_most(std::vector<float>& values, double sure) {
  if (values.empty()) return {};
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  const double low = static_cast<double>(*least), high = static_cast<double>(*most);
  const std::size_t cut = values.size() / 200;
  const auto at = [&](std::size_t i) {
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(i), values.end());
    return static_cast<double>(values[i]);
  };
  const double usual_low = at(cut), usual_high = at(values.size() - 1 - cut);
  return {std::min(usual_low, std::max(low, -sure)), std::max(usual_high, std::min(high, sure))};
}

AxisText length_axis(double low, double high) {
  const double span = high - low, farthest = std::max(std::abs(low), std::abs(high));
  AxisText axis;
  axis.scale = span >= 0.9e-3 ? 1e-3 : span >= 0.9e-6 ? 1e-6 : 1e-9;
  axis.unit = axis.scale == 1e-3 ? "mm" : axis.scale == 1e-6 ? "µm" : "nm";
  // Gives an axis an offset ("µm from 249 mm") if its numbers would otherwise have more than four digits.
  const bool small_steps = axis.scale < 1e-3 && farthest > 2000 * axis.scale;
  if (!(farthest > 50 * span || small_steps) || !std::isfinite(farthest) || !(span > 0)) return axis;
  const double grain = std::pow(10.0, std::ceil(std::log10(span)));
  axis.offset = std::floor(low / grain) * grain;
  if (axis.offset == 0.0) return axis;
  const int decimals = std::max(0, static_cast<int>(std::lround(-3.0 - std::log10(grain))));
  axis.unit += fmt::format(" from {:.{}f} mm", 1e3 * axis.offset, decimals);
  return axis;
}

void plot_force_over_time(const Pen& pen, const Area& area, const History& history, float seconds,
                          FrictionLevels levels, const ShownBeside& beside, PlotRanges& ranges,
                          float elapsed) {
  const std::size_t first = history.first_of_last(seconds);
  // Number of ticks that are averaged to one point of the hysteresis curve.
  constexpr std::size_t together = 16;
  std::vector<float> values;
  values.reserve(2 * (history.size() - first) / together + 2);
  for (std::size_t i = first; i + together <= history.size(); i += together) {
    float friction = 0, applied = 0, others[most_compared] = {};
    for (std::size_t j = i; j < i + together; ++j) {
      friction -= history[j].friction / together;
      applied += history[j].applied / together;
      for (std::size_t k = 0; k < beside.curves(); ++k) others[k] -= history[j].beside_friction[k] / together;
    }
    values.push_back(friction);
    values.push_back(applied);
    if (!(levels.peak > 0)) values.push_back(history[i].holds);
    for (std::size_t k = 0; k < beside.curves(); ++k) values.push_back(others[k]);
  }
  const ValueRange most = range_of_most(values, 1.3 * levels.peak);
  ranges.force.follow(std::min(-0.05, most.low), std::max({0.2, 1.1 * levels.peak, most.high}), 0.1, elapsed);
  const double end = history.size() ? std::max(history.newest().time, seconds) : seconds;
  std::vector<LegendEntry> entries = {{"friction", colours::friction}, {"applied", colours::applied}};
  // Names the first block if a carriage moves all blocks, since there is no hand force to draw then.
  if (beside.scene.driven) entries = {{beside.scene.names[0], colours::friction}};
  float legend = 0;
  for (const LegendEntry& entry : entries) legend += width_of(pen, entry);
  const std::string title =
      title_for(pen, area, legend,
                {"Force along the motion, N, over time, s", "Force, N, over time, s", "N over s", "N"});
  // Extends the range below the curves by the strip of the bars, and above them by the line for the peak's
  // label.
  const double label_share =
      std::min(0.4, 1.4 * static_cast<double>(pen.fonts.small->FontSize / Frame::height_in(pen, area)));
  const double span = (ranges.force.high - ranges.force.low) / (1 - snaps_share - label_share);
  const Frame frame(pen, area, title.c_str(), {end - seconds, end},
                    {ranges.force.low - snaps_share * span, ranges.force.high + label_share * span});
  frame.grid_x(1, area.width < 260 ? 3 : 5);
  frame.grid_y(4);
  frame.clip();
  draw_levels(frame, levels);
  draw_snaps(pen, frame, history, first, seconds);  // below the curves, which reach there in impacts
  if (!(levels.peak > 0))
    draw_curve(pen, frame, history, first, IM_COL32(226, 230, 236, 110), 0.7f * stroke(pen),
               [](const PlotPoint& p) { return p.holds; });
  for (std::size_t k = beside.curves(); k-- > 0;)
    draw_curve(pen, frame, history, first, compared_colour(k), 0.8f * stroke(pen),
               [k](const PlotPoint& p) { return -p.beside_friction[k]; });
  if (!beside.scene.driven)
    draw_curve(pen, frame, history, first, colours::applied, stroke(pen),
               [](const PlotPoint& p) { return p.applied; });
  draw_curve(pen, frame, history, first, colours::friction, stroke(pen),
             [](const PlotPoint& p) { return -p.friction; });
  if (history.size() > first) {
    const PlotPoint& peak = history[find_peak(history, first)];
    const double height = static_cast<double>(-peak.friction);
    if (std::abs(height) > 0.05)
      frame.mark(static_cast<double>(peak.time), height, colours::text,
                 fmt::format("{:.2f} N", std::abs(height)));
  }
  frame.unclip();
  draw_legend(pen, frame, area, entries);
}

void plot_hysteresis(const Pen& pen, const Area& area, const History& history,
                     const FirstBending& first_bending, float seconds, double presliding_length,
                     FrictionLevels levels, const ShownBeside& beside, PlotRanges& ranges, float elapsed) {
  const std::size_t first = history.first_of_last(seconds);
  double x_low = 0, x_high = 0;
  std::vector<float> values;
  values.reserve(history.size() - first);
  for (std::size_t i = first; i < history.size(); ++i) {
    const double x = static_cast<double>(history[i].displacement);
    if (i == first) x_low = x_high = x;
    x_low = std::min(x_low, x);
    x_high = std::max(x_high, x);
    values.push_back(-history[i].friction);
    for (std::size_t k = 0; k < beside.curves(); ++k) values.push_back(-history[i].beside_friction[k]);
  }
  ranges.displacement.follow(x_low, x_high, std::max(1e-8, 0.5 * presliding_length), elapsed);
  const ValueRange most = range_of_most(values, 1.3 * levels.peak);
  ranges.loop_force.follow(most.low, most.high, 0.1, elapsed);
  const FollowingRange& r = ranges.displacement;
  const AxisText axis = length_axis(r.low, r.high);
  const std::string title =
      title_for(pen, area, 0,
                {fmt::format("Friction, N, over displacement, {}", axis.unit),
                 fmt::format("Friction, N, over {}", axis.unit), fmt::format("N over {}", axis.unit)});
  const Frame frame(pen, area, title.c_str(), {r.low, r.high},
                    {ranges.loop_force.low, ranges.loop_force.high});
  frame.grid_x(axis.scale, area.width < 260 ? 2 : 4, axis.offset);
  frame.grid_y(4);
  frame.clip();
  draw_levels(frame, levels);
  // Whether a curve runs through each corner of the plot, where an inset would cover it.
  bool taken[4] = {false, false, false, false};
  const auto take = [&](const ImVec2& p) {
    for (int corner = 0; corner < 4; ++corner) {
      const Area box = corner_of(frame.inner(), corner);
      taken[corner] = taken[corner] || (p.x > box.x - 4 && p.x < box.x + box.width + 4 && p.y > box.y - 4 &&
                                        p.y < box.y + box.height + 4);
    }
  };
  const auto loop = [&](ImU32 colour, auto x_of, auto y_of) {
    ImVec2 last = frame.at(x_of(history[first]), y_of(history[first]));
    for (std::size_t i = first + 1; i < history.size(); ++i) {
      const ImVec2 next = frame.at(x_of(history[i]), y_of(history[i]));
      const float dx = next.x - last.x, dy = next.y - last.y;
      if (dx * dx + dy * dy < 0.8f && i + 1 < history.size()) continue;
      const float age = (history.newest().time - history[i].time) / seconds;
      pen.draw.AddLine(last, next, (colour & 0x00ffffffu) | (static_cast<ImU32>(255 - 200 * age) << 24),
                       stroke(pen));
      take(next);
      last = next;
    }
    return last;
  };
  if (history.size()) {
    for (std::size_t k = beside.curves(); k-- > 0;)
      loop(
          compared_colour(k), [k](const PlotPoint& p) { return p.beside_displacement[k]; },
          [k](const PlotPoint& p) { return -p.beside_friction[k]; });
    const ImVec2 last = loop(
        colours::friction, [](const PlotPoint& p) { return p.displacement; },
        [](const PlotPoint& p) { return -p.friction; });
    pen.draw.AddCircleFilled(last, 2.3f * stroke(pen), colours::text);
  }
  const float line = pen.fonts.small->FontSize;
  const bool has_room = frame.inner().width >= 15 * line && frame.inner().height >= 7.5f * line;
  const auto* const free = std::find(std::begin(taken), std::end(taken), false);
  if (has_room && first_bending.size() >= 3 && free != std::end(taken))
    draw_inset(pen, first_bending, corner_of(frame.inner(), static_cast<int>(free - std::begin(taken))));
  frame.unclip();
}

void plot_deadline(const Pen& pen, const Area& area, const TimeHistogram& times, double deadline_s) {
  // Range of the axis of computing times, as powers of ten: from 1 us to 100 ms.
  constexpr double decades_low = -6.0, decades_high = -1.0;
  double most = 1;
  for (int i = 0; i < TimeHistogram::classes; ++i) most = std::max(most, static_cast<double>(times.count(i)));
  const double high = std::ceil(std::log10(most) + 0.3);
  const std::string text = fmt::format("99 % within {}", with_unit(times.within(0.99), "s"));
  const float taken = pen.small_width(text);
  const std::string title =
      title_for(pen, area, taken, {"Ticks by computing time", "Ticks by time", "Ticks"});
  const Frame frame(pen, area, title.c_str(), {decades_low, decades_high}, {0, high});
  static constexpr const char* names[] = {"1 µs", "", "100 µs", "", "10 ms", ""};
  for (int d = 0; d < 6; ++d) frame.line_x(decades_low + d, names[d]);
  static constexpr const char* counts[] = {"1", "10", "100", "1k", "10k", "100k", "1M", "10M", "100M"};
  for (int d = 0; d <= std::min(static_cast<int>(high), 8); ++d) frame.line_y(d, counts[d]);
  frame.clip();
  for (int i = 0; i < TimeHistogram::classes; ++i) {
    if (!times.count(i)) continue;
    const double begin = TimeHistogram::begin_of(i), end = TimeHistogram::begin_of(i + 1);
    const ImU32 colour = begin >= deadline_s      ? colours::bad
                         : end > 0.7 * deadline_s ? colours::warning
                                                  : colours::good;
    // Draws a visible bar also for a class with a single tick, although the logarithm of one is zero.
    const double bar = std::max(0.15, std::log10(static_cast<double>(times.count(i))));
    const ImVec2 top = frame.at(std::log10(begin), bar), foot = frame.at(std::log10(end), 0);
    pen.draw.AddRectFilled({top.x + 0.5f, top.y}, {foot.x - 0.5f, foot.y}, colour);
  }
  const float line = frame.at(std::log10(deadline_s), 0).x;
  pen.draw.AddLine({line, frame.inner().y}, {line, frame.inner().y + frame.inner().height}, colours::bad,
                   1.3f * stroke(pen));
  frame.unclip();
  pen.write_small(line + 4, frame.inner().y + 2, 0, colours::bad, "deadline");
  pen.write_small(frame.inner().x + frame.inner().width, area.y, 1.0f, colours::faint_text, text);
}

}  // namespace room
