#include "tools/products/virtual_room/overlay.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tools/libraries/reports/numbers.hpp"
#include "tools/products/virtual_room/compared.hpp"
#include "tools/products/virtual_room/quantity_text.hpp"

namespace room {

namespace {

using Eigen::Vector3f;

void label_arrows(const Pen& pen, const Layout& layout, const Snapshot& room, const Camera& camera,
                  const RoomMeasures& measures, const Eigen::Matrix3f& tilt) {
  const ForceArrows arrows = place_arrows(room, measures);
  const auto label = [&](const Vector3f& from, const Vector3f& to, const double(&force)[3], ImU32 colour,
                         const char* name, float drop) {
    float x, y, x0, y0;
    if (!camera.find_pixel(layout.picture.scene, tilt * to, x, y)) return;
    if (!camera.find_pixel(layout.picture.scene, tilt * from, x0, y0)) return;
    const std::string text = fmt::format("{} {:.2f} N", name, to_vector(force).norm());
    // Puts the label ahead of the arrow, or behind it if the magnifying glass or the line of text below it is
    // ahead.
    const Picture& p = layout.picture;
    const float wide = pen.size(pen.fonts.bold, text).x + 25 * layout.scale;
    const float glass = 1.8f * p.glass_radius;
    bool right = x >= x0;
    if (p.glass_radius > 0 && y < p.glass_y + p.glass_radius + 60 * layout.scale) {
      if (right ? p.glass_x > x && x + wide > p.glass_x - glass
                : p.glass_x < x && x - wide < p.glass_x + glass) {
        right = !right;
        x = x0;
      }
    }
    pen.tag(x + (right ? 10 : -10) * layout.scale, y + drop * layout.scale, right ? 0.0f : 1.0f, colour, text,
            pen.fonts.bold);
  };
  if (arrows.friction)
    label(arrows.friction_from, arrows.friction_to, room.friction, colours::friction, "friction", 8);
  if (arrows.applied)
    label(arrows.applied_to, arrows.applied_from, room.applied, colours::applied, "applied", -8);
}

void label_floor(const Pen& pen, const Layout& layout, const Camera& camera, const RoomMeasures& measures,
                 const Eigen::Matrix3f& tilt, float lowest) {
  const auto wide = static_cast<float>(measures.width / 2), end = static_cast<float>(measures.length / 2);
  // Draws the scale of lengths on that side of the floor which is nearer to the eye.
  const float side = camera.eye().y() <= 0 ? -wide - 0.014f : wide + 0.014f;
  for (float x = -std::floor(end * 10) / 10; x <= end + 1e-4f; x += 0.1f) {
    float px, py;
    if (!camera.find_pixel(layout.picture.scene, tilt * Vector3f(x, side, 0), px, py)) continue;
    if (!layout.picture.scene.holds(px, py) || py > lowest) continue;
    const int centimetres = static_cast<int>(std::lround(100 * x));
    const std::string text = centimetres == 0 ? "0 cm" : fmt::format("{}", centimetres);
    pen.write_small(px, py - 0.5f * pen.fonts.small->FontSize, 0.5f, IM_COL32(150, 160, 175, 220), text);
  }
}

// Returns the text behind a block's name: how far it creeps, or the highest friction of its contact.
std::string says_of(const Snapshot& room, const Figures& figures) {
  const auto& [moved, strength, beside] = figures;
  if (!scene_of(room.settings.compare).driven) {
    const bool walks = room.settings.compare == Comparison::ratchet;
    if (!std::isfinite(moved))
      return room.time >= 6.5 ? ": settles again" : walks ? " is tapped" : " settles";
    if (std::abs(moved) < 1e-8) return ": crept < 0.01 µm";
    return (walks ? ": walked " : ": crept ") + with_unit(moved, "m");
  }
  if (!(strength > 0)) return "";
  if (room.settings.compare == Comparison::rubbing)
    return beside > 0 ? fmt::format(": {:.2f} N, {:.2f} x the first", strength, beside) : "";
  return fmt::format(": {:.2f} N after {:g} s", strength, beside);
}

// Labels each compared block with its name and its measured creep or highest friction.
void label_compared(const Pen& pen, const Layout& layout, const Snapshot& room, const Camera& camera,
                    const RoomMeasures& measures, const Eigen::Matrix3f& tilt) {
  if (room.compared == 0) return;
  const ComparedScene& scene = scene_of(room.settings.compare);
  // Stacks the labels of blocks above each other if they are long (blocks on a carriage) or the window is
  // narrow.
  const bool narrow = scene.driven || layout.picture.scene.width < 700 * layout.scale;
  // Puts a label beside a block, shifted by `off` (m) so that no label covers another.
  const auto label = [&](std::size_t which, const Vector3f& block, const Vector3f& off, float anchor,
                         const std::string& text, ImU32 colour) {
    float x, y;
    if (!camera.find_pixel(layout.picture.scene, tilt * (block + off), x, y)) return;
    if (narrow) {  // stacks the labels in a free corner of the picture
      const Area& s = layout.picture.scene;
      const bool at_right = layout.picture.glass_radius > 0 && layout.picture.glass_x < s.x + 0.5f * s.width;
      x = at_right ? s.x + s.width - 12 * layout.scale : s.x + 12 * layout.scale;
      y = layout.picture.scene.y + (14.0f + 24.0f * static_cast<float>(which)) * layout.scale;
      anchor = at_right ? 1.0f : 0.0f;
    }
    pen.tag(x, y, anchor, colour, fmt::format("{}{}", scene.names[which], text), pen.fonts.bold);
  };
  const auto half = static_cast<float>(0.5 * measures.block[0]), high = static_cast<float>(measures.block[2]);
  const Vector3f above(0, 0, 0.9f * high), right(1.15f * half, 0, 0.2f * high),
      below(1.15f * half, -0.3f * half, -0.4f * high);
  label(0, to_vector(room.block_position), right, 0.0f, says_of(room, room), colours::friction);
  for (std::size_t i = 0; i < std::min(room.compared, most_compared); ++i) {
    Vector3f at = to_vector(room.beside[i].position);
    at.y() += aside_of(i);
    label(i + 1, at, i == 0 ? above : below, 0.0f, says_of(room, room.beside[i]),
          scene.driven ? compared_colour(i) : colours::text);
  }
}

// Draws and labels the slope, the angle of the floor to the horizontal, at the room's open lower edge, unless
// that is below the height `lowest`.
void label_slope(const Pen& pen, const Layout& layout, const Snapshot& room, const Camera& camera,
                 const RoomMeasures& measures, const Eigen::Matrix3f& tilt, float lowest) {
  const double slope = room.settings.slope;
  if (std::abs(slope) < 1e-4) return;
  const float wide = static_cast<float>(measures.width / 2);
  const float side = camera.eye().y() <= 0 ? -wide : wide;
  const float down = slope > 0 ? 1.0f : -1.0f;
  const Vector3f foot = tilt * Vector3f(down * static_cast<float>(measures.length / 2), side, -0.012f);
  const float reach = 0.26f;
  ImVec2 points[17];
  int count = 0;
  float px, py;
  if (!camera.find_pixel(layout.picture.scene, foot, px, py) || py > lowest) return;
  const ImVec2 corner{px, py};
  if (!camera.find_pixel(layout.picture.scene, foot - Vector3f(down * reach, 0, 0), px, py)) return;
  pen.draw.AddLine(corner, {px, py}, colours::faint_text, 1.2f * pen.scale);
  for (int i = 0; i <= 16; ++i) {
    const float a = static_cast<float>(std::abs(slope)) * static_cast<float>(i) / 16;
    const Vector3f at = foot + 0.85f * reach * Vector3f(-down * std::cos(a), 0, std::sin(a));
    if (camera.find_pixel(layout.picture.scene, at, px, py)) points[count++] = {px, py};
  }
  pen.draw.AddPolyline(points, count, colours::text, 0, 1.5f * pen.scale);
  if (count) {
    const ImVec2 m = points[count / 2];
    const std::string text = fmt::format("{:.1f}°", std::abs(slope) * 180 / 3.14159265358979);
    pen.tag(m.x - down * 8 * pen.scale, m.y, slope > 0 ? 1.0f : 0.0f, colours::text, text, pen.fonts.bold);
  }
}

// Position (0 to 1) and colour of a stop of a colour scale.
struct Stop {
  float at;
  ImU32 colour;
};
// Colours of hairs by bending, and by age from 10 ms to 100 s, as they appear: square roots of the shader's,
// under the light on the hairs.
constexpr Stop by_bending[] = {{0, IM_COL32(111, 172, 211, 255)},
                               {0.4f, IM_COL32(90, 211, 202, 255)},
                               {0.75f, IM_COL32(247, 222, 123, 255)},
                               {1, IM_COL32(243, 123, 90, 255)}};
constexpr Stop by_age[] = {{0, IM_COL32(246, 231, 127, 255)},
                           {0.5f, IM_COL32(102, 180, 165, 255)},
                           {1, IM_COL32(102, 72, 165, 255)}};

template <std::size_t count>
void draw_scale(const Pen& pen, float x, float y, float width, const Stop (&stops)[count]) {
  for (std::size_t i = 0; i + 1 < count; ++i) {
    const Stop &from = stops[i], &to = stops[i + 1];
    pen.draw.AddRectFilledMultiColor({x + width * from.at, y}, {x + width * to.at, y + 5 * pen.scale},
                                     from.colour, to.colour, to.colour, from.colour);
  }
}

void draw_glass_rim(const Pen& pen, const Layout& layout, const Snapshot& room, const BristleGlass& glass,
                    const Camera& camera, const Eigen::Matrix3f& tilt) {
  const Picture& p = layout.picture;
  if (p.glass_radius < 1) return;
  const ImVec2 centre{p.glass_x, p.glass_y};
  const ImU32 rim = IM_COL32(176, 186, 200, 255);
  for (std::size_t i = 0; i < room.contacts && i < most_contacts; ++i) {
    if (room.contact[i].key != room.bristles.key || room.bristles.key == 0) continue;
    float px, py;
    if (!camera.find_pixel(p.scene, tilt * to_vector(room.contact[i].point), px, py)) continue;
    const float dx = px - centre.x, dy = py - centre.y, away = std::sqrt(dx * dx + dy * dy);
    if (away < p.glass_radius + 8) continue;
    const float rx = dx / away, ry = dy / away, small = 9 * pen.scale;
    pen.draw.AddLine({centre.x + rx * (p.glass_radius + 2), centre.y + ry * (p.glass_radius + 2)},
                     {px - rx * small, py - ry * small}, IM_COL32(176, 186, 200, 150), 1.5f * pen.scale);
    pen.draw.AddCircle({px, py}, small, rim, 32, 1.8f * pen.scale);
  }
  pen.draw.AddCircle(centre, p.glass_radius + 1.5f * pen.scale, IM_COL32(10, 12, 15, 255), 96, 6 * pen.scale);
  pen.draw.AddCircle(centre, p.glass_radius, rim, 96, 2.5f * pen.scale);

  float y = centre.y + p.glass_radius + 8 * pen.scale;
  if (glass.hairs().empty()) {
    const bool brush = room.settings.model == FrictionModel::brush;
    pen.write(centre.x, centre.y - 8 * pen.scale, 0.5f, colours::text,
              brush ? "no contact" : "this model has no bristles", pen.fonts.text);
    return;
  }
  // Says below the magnifying glass how many bristles it shows; uses fewer words if there is little room.
  const std::string total = room.settings.infinite ? "infinitely many" : cli::count_text(room.bristles.total);
  std::string shown =
      glass.shows_cohorts()
          ? fmt::format("{} cohorts, each bent alike{}", glass.hairs().size(), glass.by_age ? ", by age" : "")
          : fmt::format("{} of {} bristles{}", cli::count_text(glass.hairs().size()), total,
                        glass.by_age ? " by age" : " in this patch");
  const Area& scene = layout.picture.scene;
  const float reach = 0.5f * pen.small_width(shown) + 10 * pen.scale;
  if (centre.x + reach > scene.x + scene.width || centre.x - reach < scene.x) {
    shown = glass.shows_cohorts() ? fmt::format("{} cohorts", glass.hairs().size())
                                  : fmt::format("{} bristles of {}", cli::count_text(glass.hairs().size()),
                                                cli::count_text(room.bristles.total));
  }
  const float half = std::max(0.5f * pen.small_width(shown),
                              0.45f * p.glass_radius + 7 * pen.scale + pen.small_width("straight")) +
                     8 * pen.scale;
  pen.draw.AddRectFilled({centre.x - half, y - 4 * pen.scale},
                         {centre.x + half, y + 2 * pen.fonts.small->FontSize + 11 * pen.scale},
                         colours::plate, 5 * pen.scale);
  pen.write_small(centre.x, y, 0.5f, colours::text, shown);
  y += pen.fonts.small->FontSize + 5 * pen.scale;
  const float wide = 0.9f * p.glass_radius;
  const float left = centre.x - 0.5f * wide, right = centre.x + 0.5f * wide;
  if (glass.by_age)
    draw_scale(pen, left, y + 5 * pen.scale, wide, by_age);
  else
    draw_scale(pen, left, y + 5 * pen.scale, wide, by_bending);
  pen.write_small(left - 7 * pen.scale, y, 1, colours::faint_text, glass.by_age ? "10 ms" : "straight");
  pen.write_small(right + 7 * pen.scale, y, 0, colours::faint_text,
                  glass.by_age                                     ? "100 s"
                  : room.settings.rule == bristle::SnapRule::slide ? "slides"
                                                                   : "snaps");
}

}  // namespace

/// Returns the scene's title: one line that says what it shows.
static const char* title_of(const Snapshot& room) {
  switch (room.settings.compare) {
    case Comparison::none:
      return "Push the block: it springs back from a small push, and slides after a large one";
    case Comparison::models:
      return "The same slope, the same taps: which block stays where it is?";
    case Comparison::rubbing:
      return "Both rub to and fro: one stays as it is, the other grips harder and harder";
    case Comparison::rest:
      return "The longer a block rests, the harder it is to move, if its contact ages";
    case Comparison::ratchet:
      return "The same taps to and fro: on a nap the block walks the easier way";
  }
  return "";
}

void draw_overlay(const Layout& layout, const Fonts& fonts, const Snapshot& room, const BristleGlass& glass,
                  const Camera& camera, const RoomMeasures& measures, const OverlayWords& words) {
  ImDrawList& draw = *ImGui::GetBackgroundDrawList();
  const Pen pen{draw, fonts, layout.scale};
  const Eigen::Matrix3f tilt = room_tilt(room.settings.slope);
  const Area& s = layout.picture.scene;
  draw.PushClipRect({s.x, s.y}, {s.x + s.width, s.y + s.height});
  label_arrows(pen, layout, room, camera, measures, tilt);
  label_compared(pen, layout, room, camera, measures, tilt);
  draw_glass_rim(pen, layout, room, glass, camera, tilt);
  if (!words.rates.empty())
    pen.tag(s.x + s.width - 12 * layout.scale, s.y + s.height - 12 * layout.scale, 1.0f,
            words.rates_are_low ? colours::warning : colours::faint_text, words.rates, fonts.small);
  float y = s.y + s.height - 38 * layout.scale;  // leaves a small line below for the rates
  const auto say = [&](const std::string& line, ImU32 colour) {
    if (line.empty()) return;
    const float wide = s.width - 32 * layout.scale;
    const float high = fonts.text->CalcTextSizeA(fonts.text->FontSize, 1e4f, wide, line.c_str()).y;
    pen.tag(s.x + 16 * layout.scale, y - 0.5f * (high - fonts.text->FontSize), 0, colour, line, fonts.text,
            wide);
    y -= high + 13 * layout.scale;
  };
  say(words.title.empty() ? title_of(room) : words.title, colours::text);
  say(words.notice, colours::text);
  say(room.message, colours::warning);
  say(words.warning, colours::warning);
  const float lowest = y + 10 * layout.scale;  // only labels above those lines
  label_floor(pen, layout, camera, measures, tilt, lowest);
  label_slope(pen, layout, room, camera, measures, tilt, lowest);
  draw.PopClipRect();
}

}  // namespace room
