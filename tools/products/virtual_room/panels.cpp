#include "tools/products/virtual_room/panels.hpp"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>  // for the numbers of keys
#include <fmt/format.h>

#include <algorithm>
#include <cfloat>
#include <cmath>

#include "tools/libraries/reports/numbers.hpp"
#include "tools/libraries/scene/snap_law.hpp"
#include "tools/products/virtual_room/compared.hpp"
#include "tools/products/virtual_room/parameters.hpp"
#include "tools/products/virtual_room/presets.hpp"
#include "tools/products/virtual_room/quantity_text.hpp"

namespace room {

namespace {

constexpr double pi = 3.14159265358979;

struct Panel {
  const Fonts& fonts;
  float scale;
  bool changed = false;

  void heading(const char* text) const {
    ImGui::Dummy(ImVec2(0, 3 * scale));
    ImGui::PushFont(fonts.bold);
    ImGui::TextUnformatted(text);
    ImGui::PopFont();
  }

  // Draws a label and a slider, which shows `value` / `unit_size` and the unit. If `works` is false the
  // slider is grey, and its tip says that it has no effect now.
  void slider(const char* label, double& value, double unit_size, double low, double high, const char* format,
              bool logarithmic, const char* says, bool works = true) {
    double shown = value / unit_size;
    ImGui::BeginDisabled(!works);
    begin_row(label, nullptr);
    const ImGuiSliderFlags flags =
        ImGuiSliderFlags_AlwaysClamp | (logarithmic ? ImGuiSliderFlags_Logarithmic : 0);
    if (ImGui::SliderScalar("##value", ImGuiDataType_Double, &shown, &low, &high, format, flags)) {
      // Ignores the number "nan" typed into a slider, because std::clamp would let it pass.
      if (std::isfinite(shown)) {
        value = std::clamp(shown, low, high) * unit_size;
        changed = true;
      }
    }
    ImGui::PopID();
    ImGui::EndDisabled();
    explain_row(works ? says : fmt::format("{}\n(nothing here depends on it now)", says).c_str());
  }

  // Shows a tip while the pointer is over the label or the control of a row of the panel.
  void explain_row(const char* says) const {
    const ImVec2 low = ImGui::GetItemRectMin(), high = ImGui::GetItemRectMax();
    if (ImGui::IsAnyItemActive() || !ImGui::IsWindowHovered(ImGuiHoveredFlags_AllowWhenBlockedByActiveItem))
      return;
    const float left = ImGui::GetWindowPos().x;
    if (ImGui::IsMouseHoveringRect(ImVec2(left, low.y), ImVec2(high.x, high.y))) tip(says);
  }
  void tip(const char* says) const {
    ImGui::BeginTooltip();
    ImGui::PushTextWrapPos(300 * scale);
    ImGui::TextUnformatted(says);
    ImGui::PopTextWrapPos();
    ImGui::EndTooltip();
  }

  void begin_row(const char* label, const char* says) const {
    ImGui::PushID(label);
    ImGui::AlignTextToFramePadding();
    ImGui::TextUnformatted(label);
    if (says && ImGui::IsItemHovered()) ImGui::SetTooltip("%s", says);
    ImGui::SameLine(112 * scale);
    ImGui::SetNextItemWidth(-FLT_MIN);
  }

  void readout(const char* label, const std::string& value, ImU32 colour = colours::text) const {
    ImGui::PushFont(fonts.small);
    ImGui::TextDisabled("%s", label);
    const float place = ImGui::GetContentRegionMax().x - ImGui::CalcTextSize(value.c_str()).x;
    const float label_end = ImGui::GetItemRectMax().x - ImGui::GetWindowPos().x;
    // Starts a new line if the panel is too narrow for label and control in one.
    if (place > label_end + 4 * scale)
      ImGui::SameLine(place);
    else
      ImGui::SetCursorPosX(place);
    ImGui::PushStyleColor(ImGuiCol_Text, colour);
    ImGui::TextUnformatted(value.c_str());
    ImGui::PopStyleColor();
    ImGui::PopFont();
  }

  // Draws buttons in one row, as wide as the panel, each with the same margin beside its text. Returns the
  // index of the pressed button, or -1.
  int choice(const char* const* names, const char* const* says, int count, int chosen) const {
    const float gap = 4 * scale;
    float margins = ImGui::GetContentRegionAvail().x - gap * static_cast<float>(count - 1);
    for (int i = 0; i < count; ++i) margins -= ImGui::CalcTextSize(names[i]).x;
    const float margin = margins / static_cast<float>(count);
    ImGui::PushStyleVar(ImGuiStyleVar_FramePadding, ImVec2(0, ImGui::GetStyle().FramePadding.y));
    int pressed = -1;
    for (int i = 0; i < count; ++i) {
      if (i) ImGui::SameLine(0, gap);
      const bool on = i == chosen;
      if (on) {
        ImGui::PushStyleColor(ImGuiCol_Button, IM_COL32(28, 98, 152, 255));
        ImGui::PushStyleColor(ImGuiCol_ButtonHovered, IM_COL32(34, 112, 172, 255));
      }
      if (ImGui::Button(names[i], ImVec2(ImGui::CalcTextSize(names[i]).x + margin, 0))) pressed = i;
      if (on) ImGui::PopStyleColor(2);
      if (says && says[i] && ImGui::IsItemHovered()) ImGui::SetTooltip("%s", says[i]);
    }
    ImGui::PopStyleVar();
    return pressed;
  }
};

// Returns the sum of a number over the contacts between block and floor.
double on_floor(const Snapshot& room, double ContactView::*number) {
  double sum = 0;
  for (std::size_t i = 0; i < room.contacts && i < most_contacts; ++i) {
    if (room.contact[i].between == Between::block_floor) sum += room.contact[i].*number;
  }
  return sum;
}

bool begin_panel(const char* name, const Area& area, bool scrolls = false) {
  ImGui::SetNextWindowPos(ImVec2(area.x, area.y));
  ImGui::SetNextWindowSize(ImVec2(area.width, area.height));
  ImGuiWindowFlags flags = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                           ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoBringToFrontOnFocus;
  if (scrolls) flags &= ~ImGuiWindowFlags_NoScrollbar;
  return ImGui::Begin(name, nullptr, flags);
}

// Draws a heading under which controls can be folded away. At first they are. Returns whether they are folded
// now.
bool folded(const Panel& panel, const char* label) {
  ImGui::Dummy(ImVec2(0, 3 * panel.scale));
  return !ImGui::CollapsingHeader(label);
}

void surface_in_detail(Panel& panel, const Snapshot& room, Settings& s, double load);

void surface(Panel& panel, const Snapshot& room, Settings& s) {
  const Effective works(s);
  panel.heading("Surface");
  const double load = on_floor(room, &ContactView::load);
  double ratio = std::clamp(s.peak / std::max(s.kinetic, 1e-9), 1.01, 2.0);
  const double kinetic_before = s.kinetic, ratio_before = ratio;
  panel.slider("kinetic µ", s.kinetic, 1, 0.01, 1.5, "%.3f", false, "friction over load in slow sliding");
  panel.slider("peak / kinetic", ratio, 1, 1.01, 2.0, "%.2f", false,
               "highest friction at first loading over that in sliding", works.peak && s.nap == 1.0);
  if (s.kinetic != kinetic_before || ratio != ratio_before) s.peak = s.kinetic * ratio;
  panel.slider("bristle length", s.presliding_length, 1e-6, 1,
               1e6 * range_of(&Settings::presliding_length).max, "%.0f µm", true,
               "presliding length: the mean deflection at which a bristle snaps", works.peak);
  panel.readout("peak", fmt::format("µ {:.3f} × {:.2f} N = {:.2f} N", room.peak_coefficient, load,
                                    room.peak_coefficient * load));
  panel.readout("kinetic friction", fmt::format("µ {:.3f} × {:.2f} N = {:.2f} N", room.kinetic_coefficient,
                                                load, room.kinetic_coefficient * load));
  if (!folded(panel, "More of the surface")) surface_in_detail(panel, room, s, load);
}

void surface_in_detail(Panel& panel, const Snapshot& room, Settings& s, double load) {
  const Effective works(s);
  // Shows the contact's stiffness as the paper defines it, K = zeta sigma0 of all bristles in contact. It is
  // inversely proportional to the presliding length.
  if (load > 0 && room.stiffness_per_newton > 0 && room.settings.presliding_length > 0) {
    const double times_length = room.stiffness_per_newton * load * room.settings.presliding_length;
    double stiffness = times_length / s.presliding_length;
    const double before = stiffness;
    panel.slider("stiffness ζσ₀", stiffness, 1, times_length / range_of(&Settings::presliding_length).max,
                 times_length / 1e-6, "%.0f N/m", true,
                 "of all bristles together while they stick: moves with the bristle length", works.peak);
    if (stiffness != before) {
      const SettingRange& range = range_of(&Settings::presliding_length);
      s.presliding_length = std::clamp(times_length / stiffness, range.min, range.max);
    }
  }
  panel.slider("damping", s.damping_per_newton, 1, 0, 10, "%.2f s/m", false,
               "of all bristles, over the load, while they stick", works.damping);
  panel.slider("lubrication", s.viscous_friction, 1, 0, 20, "%.2f N s/m", false,
               "viscous friction of the whole patch");
  panel.slider("Stribeck speed", s.stribeck_velocity, 1e-3, 0.01, 1000, "%.2f mm/s", true,
               "above it the dampers of the bristles fade", works.stribeck);
  ImGui::BeginDisabled(!works.bristles);
  panel.begin_row("after a snap", "or at the snap length: redraw, keep, slide");
  ImGui::PopID();
  static constexpr const char* rules_say[] = {"another bristle with another snap length",
                                              "the same snap length again",
                                              "no snap: the bristle slides, bent by its snap length"};
  if (const int rule = panel.choice(cli::snap_rule_names, rules_say, 3, static_cast<int>(s.rule));
      rule >= 0) {
    s.rule = static_cast<bristle::SnapRule>(rule);
    panel.changed = true;
  }
  ImGui::EndDisabled();
  panel.slider("nap", s.nap, 1, 0.2, 5.0, "%.2f", true,
               "friction to the right over that to the left, with bristles that slide: velvet, skis, scales",
               works.bristles);
  panel.slider("left by a snap", s.residual_share, 0.01, 0.0, 95.0, "%.0f %%", false,
               "share of the bristle length that a snap leaves bent along the motion; 0: the paper's law",
               works.bristles);
  panel.slider(
      "others renewed", s.shared_renewal, 1, 0.0, 8.0, "%.2f", false,
      "other bristles that re-form with each snap: rubbed contacts do not harden; 0: the paper's law",
      works.bristles);
  panel.slider("grows at rest", s.growth_per_decade, 0.01, 0.0, 20.0, "%.1f %%", false,
               "static friction over kinetic, for ten times the rest; sliding friction falls by half of that "
               "for ten times the speed; 0: it does not age",
               works.bristles);
  panel.slider(
      "ages from", s.ageing_time, 1e-3, 1, 1e5, "%.0f ms", true,
      "rest from which on friction grows; it falls with speed where a bristle lives longer than this",
      works.ageing_time);
  if (works.bristles && room.bristle_stiffness > 0)
    panel.readout("bristles ζ × stiffness σ₀",
                  fmt::format("{:.0f} × {}", room.stiffness_per_newton / room.bristle_stiffness * load,
                              with_unit(room.bristle_stiffness, "N/m")));
}

// Shows how much of the deadline the ticks of the histogram take, and the longest as a mark.
void deadline_bar(const Panel& panel, const TimeHistogram& times, const LoopStatistics& loop) {
  const auto of_deadline = [&](double time) {
    const double part = time / loop.deadline;
    return std::isfinite(part) && part > 0 ? part : 0.0;
  };
  const double p99 = times.within(0.99);
  const double used = of_deadline(p99), worst = of_deadline(times.within(1.0));
  // Colours the computing time by the deadline only if the clock is real. Other runs have no deadline.
  const bool paced = loop.period_p50 > 0;
  const ImU32 colour = !paced       ? colours::text
                       : used >= 1  ? colours::bad
                       : used > 0.7 ? colours::warning
                                    : colours::good;
  const ImVec2 at = ImGui::GetCursorScreenPos();
  const float wide = ImGui::GetContentRegionAvail().x, high = 9 * panel.scale;
  ImDrawList& draw = *ImGui::GetWindowDrawList();
  draw.AddRectFilled(at, {at.x + wide, at.y + high}, IM_COL32(39, 44, 52, 255), 3);
  draw.AddRectFilled(at, {at.x + wide * static_cast<float>(std::clamp(used, 0.004, 1.0)), at.y + high},
                     colour, 3);
  const float mark = at.x + wide * static_cast<float>(std::clamp(worst, 0.0, 1.0));
  draw.AddLine({mark, at.y - 1}, {mark, at.y + high + 1}, paced && worst >= 1 ? colours::bad : colours::text,
               1.5f);
  ImGui::Dummy(ImVec2(wide, high + 2));
  panel.readout(
      "99 % of ticks within",
      fmt::format("{} of {}: {:.0f} %", with_unit(p99, "s"), with_unit(loop.deadline, "s"), 100 * used),
      used >= 0.7 ? colour : colours::text);
}

// Ends a menu of the toolbar. The key Esc closes it.
void end_menu() {
  if (ImGui::IsKeyPressed(ImGui::GetKeyIndex(ImGuiKey_Escape), false)) ImGui::CloseCurrentPopup();
  ImGui::EndPopup();
}

void bristles(Panel& panel, const Snapshot& room, const TimeHistogram& times, Settings& s) {
  panel.heading("Bristles");
  static constexpr const char* populations[] = {"a number", "infinitely many"};
  static constexpr const char* meanings[] = {"representatives, each with its own bend and snap length",
                                             "the limit of ever more bristles: no noise"};
  if (const int chosen = panel.choice(populations, meanings, 2, s.infinite ? 1 : 0); chosen >= 0) {
    s.infinite = chosen == 1;
    panel.changed = true;
  }
  ImGui::BeginDisabled(s.infinite || s.model != FrictionModel::brush);
  panel.begin_row("in a patch", "representatives of each patch under the block");
  static constexpr std::uint32_t low = fewest_bristles, high = most_bristles;
  const std::string shown = cli::count_text(s.bristles);
  std::uint32_t value = s.bristles;
  if (ImGui::SliderScalar("##value", ImGuiDataType_U32, &value, &low, &high, "%u",
                          ImGuiSliderFlags_Logarithmic | ImGuiSliderFlags_AlwaysClamp)) {
    s.bristles = std::clamp(value, low, high);
    panel.changed = true;
  }
  ImGui::PopID();
  ImGui::EndDisabled();
  panel.readout("in all patches",
                room.settings.infinite ? "infinitely many" : cli::count_text(room.bristles_total));
  deadline_bar(panel, times, room.loop);
}

void hand(Panel& panel, const Snapshot& room, Settings& s) {
  panel.slider("spring", s.hand_stiffness, 1, 20, 2000, "%.0f N/m", true, "between the hand and the tool");
  panel.slider("damper", s.hand_damping, 1, 0, 20, "%.1f N s/m", false, "beside the spring");
  const Effective works(s);
  panel.slider("pad radius", s.pad_radius, 1e-3, 0, 20, "%.1f mm", false,
               "the tool's contact is a disc: it holds a block against a turn. 0: a point. A fingertip: 8 mm",
               works.pad);
  panel.slider("pad µ", s.pad_friction, 1, 0, 2, "%.2f", false,
               "kinetic friction of the tool; 0: that of the floor. A dry fingertip: about 1");
  for (std::size_t i = 0; i < room.contacts && i < most_contacts; ++i) {
    const ContactView& c = room.contact[i];
    if (!(c.torque_limit > 0)) continue;
    panel.readout(
        "moment held, and the highest",
        fmt::format("{} of {}", with_unit(std::abs(c.torque), "N m"), with_unit(c.torque_limit, "N m")));
  }
}

void loop_table(const Panel& panel, const LoopStatistics& loop) {
  if (folded(panel, "Haptic loop since the start")) return;
  panel.readout("computing p50 / max", with_unit(loop.p50, "s") + " / " + with_unit(loop.max, "s"));
  panel.readout("period p50 / p99", loop.period_p50 > 0 ? with_unit(loop.period_p50, "s") + " / " +
                                                              with_unit(loop.period_p99, "s")
                                                        : "not paced");
  panel.readout("late by this program", cli::count_text(loop.late_ours),
                loop.late_ours ? colours::bad : colours::good);
  panel.readout("late by the machine", cli::count_text(loop.late_machine),
                loop.late_machine ? colours::warning : colours::text);
}

}  // namespace

float fitting_scale(float wanted, int width, int height) {
  const float fits = std::min(static_cast<float>(width) / 640, static_cast<float>(height) / 480);
  return std::clamp(std::min(wanted, std::floor(4 * fits) / 4), 0.75f, 4.0f);
}

Layout make_layout(int width, int height, float scale, bool panels, bool glass, bool glass_left) {
  Layout layout;
  layout.scale = scale;
  const auto w = static_cast<float>(width), h = static_cast<float>(height);
  const float left =
      panels ? std::min(std::round(std::clamp(0.36f * w, 240 * scale, 312 * scale)), 0.5f * w) : 0;
  // Makes the bar of buttons as high as its rows need, which are one, two or three depending on its width.
  const float bar = (w - left) / scale;
  const float above = panels ? std::round((bar >= 880 ? 46 : bar >= 500 ? 76 : 106) * scale) : 0;
  const float below =
      panels ? std::min(std::round(std::clamp(0.26f * h, 150 * scale, 300 * scale)), 0.5f * h) : 0;
  layout.picture.width = width;
  layout.picture.height = height;
  layout.picture.scene = {left, above, std::max(w - left, 1.0f), std::max(h - above - below, 1.0f)};
  layout.settings = {0, 0, left, h};
  layout.bar = {left, 0, w - left, above};
  layout.plots = {left, h - below, w - left, below};
  if (glass) {
    const Area& s = layout.picture.scene;
    layout.picture.glass_radius = std::floor(0.215f * std::min(s.width, s.height));
    const float inset = layout.picture.glass_radius + 26 * scale;
    layout.picture.glass_x = std::round(glass_left ? s.x + inset : s.x + s.width - inset);
    layout.picture.glass_y = std::round(s.y + layout.picture.glass_radius + 20 * scale);
  }
  return layout;
}

void SettingsUndo::note(const Settings& before, bool changed, bool active) {
  if (changed && !changing_) {
    before_.push_back(before);
    if (before_.size() > most) before_.pop_front();
  }
  changing_ = active && (changing_ || changed);
}

bool SettingsUndo::undo(Settings& settings) {
  changing_ = false;
  if (before_.empty()) return false;
  settings = before_.back();
  before_.pop_back();
  return true;
}

Effective::Effective(const Settings& s)
    : peak(s.model != FrictionModel::coulomb),
      bristles(s.model == FrictionModel::brush),
      damping(s.model != FrictionModel::coulomb),
      stribeck(s.model == FrictionModel::lugre ||
               (s.model == FrictionModel::brush && s.damping_per_newton > 0.0)),
      ageing_time(s.model == FrictionModel::brush && s.growth_per_decade > 0.0),
      pad(s.model == FrictionModel::brush) {}

int preset_of(const Settings& settings) {
  for (std::size_t i = 0; i < presets.size(); ++i) {
    Settings applied = settings;
    apply(presets[i], applied);
    if (applied == settings) return static_cast<int>(i);
  }
  return -1;
}

std::string deadline_warning(const TimeHistogram& times, const LoopStatistics& loop) {
  const double p99 = times.within(0.99);
  const bool known = loop.period_p50 > 0 && static_cast<double>(times.total()) * loop.deadline >= 1.0;
  if (!known || !(p99 > loop.deadline)) return "";
  return fmt::format("Misses the deadline of {} here: 99 % of ticks take up to {}",
                     with_unit(loop.deadline, "s"), with_unit(p99, "s"));
}

void draw_settings(const Layout& layout, const Fonts& fonts, const Snapshot& room, const TimeHistogram& times,
                   GuiState& state, Wishes& wishes) {
  if (layout.settings.width < 1) return;
  begin_panel("settings", layout.settings, true);
  Panel panel{fonts, layout.scale};
  Settings& s = state.settings;
  const Settings before = s;

  static constexpr const char* models[] = {"Brush", "LuGre", "Coulomb"};
  static constexpr const char* says[] = {"bristles that stick, bend and snap: at rest it holds",
                                         "one mean deflection: creeps under a wavering load",
                                         "stick or slip, no presliding"};
  panel.heading("Friction model");
  if (const int model = panel.choice(models, says, 3, static_cast<int>(s.model)); model >= 0) {
    s.model = static_cast<FrictionModel>(model);
    panel.changed = true;
  }
  const char* names[presets.size()];
  const char* sources[presets.size()];
  for (std::size_t i = 0; i < presets.size(); ++i) {
    names[i] = presets[i].name;
    sources[i] = source_of(presets[i]);
  }
  if (const int preset = panel.choice(names, sources, static_cast<int>(presets.size()), preset_of(s));
      preset >= 0) {
    apply(presets[static_cast<std::size_t>(preset)], s);
    panel.changed = true;
  }
  bool undone = false;
  static constexpr const char* back_labels[] = {"Defaults", "Undo"};
  static constexpr const char* back_says[] = {"all settings as they were at the beginning",
                                              "Ctrl+Z: as before the last change"};
  const int back = panel.choice(back_labels, back_says, 2, -1);
  if (back == 0) {
    s = state.beginning;
    panel.changed = true;
  } else if (back == 1 && state.undo.undo(s)) {
    undone = panel.changed = true;
  }
  surface(panel, room, s);
  bristles(panel, room, times, s);

  panel.heading("Block and floor");
  panel.slider("mass", s.mass, 1, 0.02, 5, "%.3f kg", true, "of the block");
  panel.slider("extra load", s.extra_load, 1, 0, 20, "%.1f N", false,
               "pressed down on the block beside its weight");
  panel.slider("slope", s.slope, pi / 180, 0, 40, "%.1f°", false, "of the whole room, down to the right");
  panel.slider("tapping", s.tapping, 1, 0, 5, "%.2f N", false,
               "a disturbance along the slope, against drift");

  if (!folded(panel, "Hand")) hand(panel, room, s);

  loop_table(panel, room.loop);
  wishes.settings = wishes.settings || panel.changed;
  if (!undone) state.undo.note(before, !(s == before), ImGui::IsAnyItemActive());
  ImGui::End();
}

void draw_scrubber(const Layout& layout, GuiState& state) {
  if (!(state.back_most_s > 0)) return;
  const Area& a = layout.picture.scene;
  ImGui::SetNextWindowPos(ImVec2(a.x + 0.5f * a.width, a.y + 8 * layout.scale), ImGuiCond_Always,
                          ImVec2(0.5f, 0.0f));
  ImGui::SetNextWindowSize(ImVec2(std::min(0.5f * a.width, 420 * layout.scale), 0));
  ImGui::SetNextWindowBgAlpha(0.85f);
  ImGui::Begin("back", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings);
  float at = 0.0f - state.back_s;  // 0 minus x, since -x might be -0 and be shown so
  ImGui::SetNextItemWidth(-FLT_MIN);
  if (ImGui::SliderFloat("##back", &at, -state.back_most_s, 0.0f, "%.1f s: look back",
                         ImGuiSliderFlags_AlwaysClamp))
    state.back_s = std::isfinite(at) ? std::clamp(-at, 0.0f, state.back_most_s) : 0.0f;
  ImGui::End();
}

void draw_help(const Layout& layout, const Fonts& fonts) {
  static constexpr const char* lines[][2] = {
      {"left drag", "pull the tool by its spring; with Shift ten times finer"},
      {"wheel while dragging", "height of the hand; with Ctrl its press"},
      {"arrow keys", "push along the floor, with Shift ten times slower; Esc lets go"},
      {"Q, W", "turn the block on the floor by a torsion spring, left and right; Esc lets go"},
      {"L", "slow pull: see the peak"},
      {"right drag, middle drag, wheel", "turn, move, zoom the view; V: as at first"},
      {"space, full stop",
       "pause or run, one tick; paused, [ and ] go back and forth through the last minute"},
      {"Tab", "the panels by keys: Tab and arrows from one to the next, Enter or space; Esc leaves"},
      {"T", "a tour of 20 seconds"},
      {"- and =", "slow motion to 1 : 100, and back"},
      {"R", "reset the block"},
      {"1, 2, 3", "brush, LuGre, Coulomb"},
      {"K", "blocks compared: models, rubbing, slide-hold-slide, ratchet, and back"},
      {"Ctrl+Z", "undo the last change of the settings"},
      {"C, P", "record, replay"},
      {"E, S",
       "plots as CSV; settings and material (not where the block is) as scripts: drop one here to load it"},
      {"F12", "picture of the window"},
      {"A", "bristles coloured by age or by bending"},
      {"G, H, F1", "glass, panels, this page"},
      {"Ctrl+click on a slider", "type a value"}};
  const Area& a = layout.picture.scene;
  ImGui::SetNextWindowPos(ImVec2(a.x + 0.5f * a.width, a.y + 0.5f * a.height), ImGuiCond_Always,
                          ImVec2(0.5f, 0.5f));
  ImGui::SetNextWindowSize(ImVec2(std::min(a.width - 8 * layout.scale, 560 * layout.scale), 0));
  ImGui::SetNextWindowBgAlpha(0.94f);
  ImGui::Begin("help", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                   ImGuiWindowFlags_NoInputs | ImGuiWindowFlags_NoNav);
  ImGui::TextUnformatted("Keys and mouse");
  ImGui::SameLine();
  ImGui::TextDisabled("F1 or Esc closes this page");
  ImGui::Separator();
  ImGui::PushFont(fonts.small);
  if (ImGui::BeginTable("keys", 2)) {
    ImGui::TableSetupColumn("key", ImGuiTableColumnFlags_WidthStretch, 0.34f);
    ImGui::TableSetupColumn("does", ImGuiTableColumnFlags_WidthStretch, 0.66f);
    for (const auto& line : lines) {
      ImGui::TableNextRow();
      ImGui::TableNextColumn();
      ImGui::TextWrapped("%s", line[0]);
      ImGui::TableNextColumn();
      ImGui::TextWrapped("%s", line[1]);
    }
    ImGui::EndTable();
  }
  ImGui::PopFont();
  ImGui::End();
}

void draw_bar(const Layout& layout, const Fonts& fonts, const Snapshot& room, const GuiState& state,
              Wishes& wishes) {
  if (layout.bar.height < 1) return;
  begin_panel("bar", layout.bar);
  const float scale = layout.scale;
  const float room_for_time = 120 * scale;
  bool first = true;
  const auto button = [&](const char* label, const char* says, float gap = 5) {
    // Starts a new row of buttons if the next one does not fit into this row.
    const float wide = ImGui::CalcTextSize(label, nullptr, true).x + 2 * ImGui::GetStyle().FramePadding.x;
    if (!first) {
      const float end = ImGui::GetItemRectMax().x - ImGui::GetWindowPos().x + gap * scale + wide;
      const bool in_first_row = ImGui::GetItemRectMin().y < layout.bar.y + 30 * scale;
      if (end < layout.bar.width - 14 * scale - (in_first_row ? room_for_time : 0))
        ImGui::SameLine(0, gap * scale);
    }
    first = false;
    const bool pressed = ImGui::Button(label);
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", says);
    return pressed;
  };
  const auto key = [&](int number, const char* label, const char* says, float gap = 5) {
    if (button(label, says, gap)) wishes.key = number;
  };
  key(GLFW_KEY_SPACE, room.paused ? "Run###pause" : "Pause###pause", "space");
  key(GLFW_KEY_PERIOD, "Step", "full stop: one tick while it pauses");
  const std::string speed = fmt::format("{:g} x###speed", room.speed);
  if (button(speed.c_str(), "slow motion: minus slower, equals sign faster")) {
    wishes.full_speed = room.speed <= 0.011;
    if (!wishes.full_speed) wishes.key = GLFW_KEY_MINUS;
  }
  key(GLFW_KEY_R, "Reset", "R: the block back to the middle");
  key(GLFW_KEY_L, "Slow pull", "L: from rest, a hand draws slowly until the block has broken away");
  if (room.recording) ImGui::PushStyleColor(ImGuiCol_Button, IM_COL32(150, 36, 30, 255));
  key(GLFW_KEY_C, room.recording ? "Stop###record" : "Record###record",
      "C: hand and forces as CSV, in files of their own; begins with a reset", 10);
  if (room.recording) ImGui::PopStyleColor();
  key(GLFW_KEY_P, "Replay", "P: the hand of the recording again, to the same bits");
  if (button("Save",
             "a picture, the plots or the settings, into the working folder; not where the block is and how "
             "bristles bend",
             10))
    ImGui::OpenPopup("save");
  if (ImGui::BeginPopup("save")) {
    if (ImGui::MenuItem("Picture of the window, PNG", "F12")) wishes.key = GLFW_KEY_F12;
    if (ImGui::MenuItem("What the plots show, CSV", "E")) wishes.key = GLFW_KEY_E;
    if (ImGui::MenuItem("Settings, without where the block is, and the material: TOML for 'Load'", "S"))
      wishes.key = GLFW_KEY_S;
    end_menu();
  }
  if (button("Load", "settings or a material of a file in the working folder")) {
    wishes.list_files = true;
    ImGui::OpenPopup("files");
  }
  if (ImGui::BeginPopup("files")) {
    if (state.files.empty()) ImGui::TextUnformatted("no .toml file in the working folder");
    for (const std::string& file : state.files) {
      if (ImGui::MenuItem(file.c_str())) wishes.load = file;
    }
    end_menu();
  }
  key(GLFW_KEY_G, "Glass", "G: the magnifying glass", 10);
  key(GLFW_KEY_V, "View", "V: the view of the beginning");
  const bool compares = room.compared > 0;
  if (compares) ImGui::PushStyleColor(ImGuiCol_Button, IM_COL32(28, 98, 152, 255));
  if (button("Compare",
             "K: blocks beside each other: models, rubbing, slide-hold-slide, ratchet, and back")) {
    ImGui::OpenPopup("scenes");
  }
  if (compares) ImGui::PopStyleColor();
  if (ImGui::BeginPopup("scenes")) {
    if (ImGui::MenuItem("Tour")) wishes.key = GLFW_KEY_T;
    if (ImGui::IsItemHovered())
      ImGui::SetTooltip("T: 20 seconds: a push that holds, one that breaks away, and the other models");
    for (std::size_t i = 0; i < compared_scenes.size(); ++i) {
      const auto which = static_cast<Comparison>(i);
      if (ImGui::MenuItem(compared_scenes[i].name, nullptr, room.settings.compare == which))
        wishes.scene = which;
      if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", compared_scenes[i].says);
    }
    end_menu();
  }
  key(GLFW_KEY_F1, "Help", "F1: keys and mouse");

  const std::string time = fmt::format("{:.2f} s", room.time);
  const char* what = room.device_lost ? "device lost"
                     : room.paused    ? "paused"
                     : room.recording ? "recording"
                                      : "";
  const ImU32 colour = room.device_lost || room.recording ? colours::bad : colours::warning;
  const float wide = ImGui::CalcTextSize(time.c_str()).x;
  const float right = ImGui::GetContentRegionMax().x, top = ImGui::GetStyle().WindowPadding.y + 3 * scale;
  if (*what) {
    ImGui::SetCursorPos({right - std::max(wide, 60 * scale) - ImGui::CalcTextSize(what).x - 12 * scale, top});
    ImGui::PushStyleColor(ImGuiCol_Text, colour);
    ImGui::TextUnformatted(what);
    ImGui::PopStyleColor();
  }
  ImGui::SetCursorPos({right - std::max(wide, 60 * scale), top});
  ImGui::PushFont(fonts.bold);
  ImGui::TextUnformatted(time.c_str());
  ImGui::PopFont();
  ImGui::End();
}

void draw_plots(const Layout& layout, const Fonts& fonts, const Snapshot& room, const History& history,
                const TimeHistogram& times, GuiState& state, float elapsed) {
  if (layout.plots.height < 1) return;
  begin_panel("plots", layout.plots);
  const Pen pen{*ImGui::GetWindowDrawList(), fonts, layout.scale};
  const float gap = 12 * layout.scale;
  const Area& p = layout.plots;
  // Leaves out the plot of computing times in a narrow window. The panel shows their figures anyway.
  const bool two = p.width < 720 * layout.scale;
  const float inner = p.width - (two ? 3 : 4) * gap, high = p.height - 1.7f * gap, top = p.y + gap;
  const float share[] = {two ? 0.52f : 0.40f, two ? 0.48f : 0.32f};
  const Area first{p.x + gap, top, share[0] * inner, high};
  const Area second{first.x + first.width + gap, top, share[1] * inner, high};
  const Area third{second.x + second.width + gap, top, 0.28f * inner, high};
  const double load = on_floor(room, &ContactView::load);
  FrictionLevels levels{room.kinetic_coefficient * load, room.peak_coefficient * load};
  FrictionLevels over_time = levels;
  if (room.settings.growth_per_decade > 0 && room.settings.model == FrictionModel::brush) {
    // Sets the peak level to the sum of the friction limits of the floor's patches. They grow while bristles
    // rest, and the plot over time draws them as a curve.
    levels.peak = on_floor(room, &ContactView::limit);
    over_time.peak = 0;
  }
  const ShownBeside beside{scene_of(room.settings.compare), std::min(room.compared, most_compared)};
  // Plots a longer time in the scene that compares rests, so that a whole sequence of rests is visible.
  const float seconds =
      room.settings.compare == Comparison::rest ? 2.5f * state.plot_seconds : state.plot_seconds;
  plot_force_over_time(pen, first, history, seconds, over_time, beside, state.ranges, elapsed);
  plot_hysteresis(pen, second, history, state.first_bending, seconds, room.presliding_length, levels, beside,
                  state.ranges, elapsed);
  if (!two) plot_deadline(pen, third, times, room.loop.deadline);
  ImGui::End();
}

}  // namespace room
