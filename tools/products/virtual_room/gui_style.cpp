#include "tools/products/virtual_room/gui_style.hpp"

#include <cmath>
#include <filesystem>
#include <initializer_list>
#include <string>

namespace room {

namespace {

ImVec4 rgba(ImU32 c, float alpha = 1.0f) {
  ImVec4 v = ImGui::ColorConvertU32ToFloat4(c);
  v.w *= alpha;
  return v;
}

ImFont* load(std::initializer_list<const char*> files, float pixels) {
  // Ranges of characters that are loaded from the fonts: Latin, Greek, dashes, arrows, super- and subscripts,
  // mathematics.
  static const ImWchar ranges[] = {0x20,   0xff,   0x370,  0x3ff,  0x2010, 0x2027, 0x2070,
                                   0x2099, 0x2190, 0x2193, 0x2200, 0x2265, 0};
  ImGuiIO& io = ImGui::GetIO();
  for (const char* file : files) {
    if (std::filesystem::exists(file)) return io.Fonts->AddFontFromFileTTF(file, pixels, nullptr, ranges);
  }
  ImFontConfig config;
  config.SizePixels = pixels;
  return io.Fonts->AddFontDefault(&config);
}

void set_colours(ImGuiStyle& style) {
  const auto set = [&](ImGuiCol which, ImU32 colour, float alpha = 1.0f) {
    style.Colors[which] = rgba(colour, alpha);
  };
  ImGui::StyleColorsDark(&style);
  set(ImGuiCol_Text, colours::text);
  set(ImGuiCol_TextDisabled, colours::faint_text);
  set(ImGuiCol_WindowBg, colours::panel);
  set(ImGuiCol_PopupBg, colours::raised);
  set(ImGuiCol_Border, colours::line);
  set(ImGuiCol_FrameBg, IM_COL32(39, 44, 52, 255));
  set(ImGuiCol_FrameBgHovered, IM_COL32(50, 56, 66, 255));
  set(ImGuiCol_FrameBgActive, IM_COL32(58, 65, 77, 255));
  set(ImGuiCol_SliderGrab, IM_COL32(84, 98, 118, 255));
  set(ImGuiCol_SliderGrabActive, colours::accent);
  set(ImGuiCol_Button, IM_COL32(44, 50, 59, 255));
  set(ImGuiCol_ButtonHovered, IM_COL32(58, 66, 78, 255));
  set(ImGuiCol_ButtonActive, IM_COL32(72, 82, 97, 255));
  set(ImGuiCol_CheckMark, colours::accent);
  set(ImGuiCol_NavHighlight, colours::accent);
  set(ImGuiCol_Header, IM_COL32(39, 44, 52, 255));
  set(ImGuiCol_HeaderHovered, IM_COL32(50, 56, 66, 255));
  set(ImGuiCol_HeaderActive, IM_COL32(58, 65, 77, 255));
  set(ImGuiCol_Separator, colours::line);
  set(ImGuiCol_ScrollbarBg, colours::panel);
  set(ImGuiCol_ScrollbarGrab, IM_COL32(58, 65, 76, 255));
}

}  // namespace

void Pen::write(float x, float y, float anchor, ImU32 colour, const std::string& text,
                const ImFont* font) const {
  const float left = std::round(x - anchor * size(font, text).x);
  draw.AddText(font, font->FontSize, {left, std::round(y)}, colour, text.c_str());
}

void Pen::tag(float x, float y, float anchor, ImU32 colour, const std::string& text, const ImFont* font,
              float wrap) const {
  const ImVec2 s = size(font, text, wrap);
  const float pad = 5 * scale, left = std::round(x - anchor * s.x), top = std::round(y - 0.5f * s.y);
  draw.AddRectFilled({left - pad, top - 0.5f * pad}, {left + s.x + pad, top + s.y + 0.5f * pad},
                     colours::plate, 4 * scale);
  draw.AddText(font, font->FontSize, {left, top}, colour, text.c_str(), nullptr, wrap);
}

Fonts set_style(float scale) {
  ImGuiStyle style;
  style.WindowRounding = 0;
  style.WindowBorderSize = 0;
  style.FrameRounding = 4;
  style.GrabRounding = 4;
  style.GrabMinSize = 9;
  style.FramePadding = ImVec2(7, 3);
  style.ItemSpacing = ImVec2(7, 4);
  style.WindowPadding = ImVec2(14, 12);
  style.ScrollbarSize = 9;
  set_colours(style);
  style.ScaleAllSizes(scale);
  ImGui::GetStyle() = style;

  ImGui::GetIO().Fonts->Clear();
  const std::string roboto = "/usr/share/fonts/truetype/roboto/unhinted/RobotoTTF/";
  const std::string dejavu = "/usr/share/fonts/truetype/dejavu/";
  const std::string regular[] = {roboto + "Roboto-Regular.ttf", dejavu + "DejaVuSans.ttf"};
  const std::string bold[] = {roboto + "Roboto-Medium.ttf", dejavu + "DejaVuSans-Bold.ttf"};
  Fonts fonts;
  fonts.text = load({regular[0].c_str(), regular[1].c_str()}, std::round(15 * scale));
  fonts.small = load({regular[0].c_str(), regular[1].c_str()}, std::round(13 * scale));
  fonts.bold = load({bold[0].c_str(), bold[1].c_str()}, std::round(15 * scale));
  return fonts;
}

}  // namespace room
