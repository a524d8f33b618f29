// Fonts and colours of the virtual room's panels.
#pragma once

#include <cstddef>
#include <string>

#include <imgui.h>

namespace room {

namespace colours {
inline constexpr ImU32 panel = IM_COL32(22, 25, 30, 255), raised = IM_COL32(33, 37, 44, 255);
inline constexpr ImU32 text = IM_COL32(226, 230, 236, 255), faint_text = IM_COL32(148, 157, 170, 255);
inline constexpr ImU32 line = IM_COL32(52, 58, 68, 255), faint_line = IM_COL32(40, 45, 53, 255);
inline constexpr ImU32 friction = IM_COL32(255, 133, 64, 255), applied = IM_COL32(70, 178, 255, 255);
// Colours after Okabe and Ito, which also the colour-blind can tell apart.
inline constexpr ImU32 good = IM_COL32(36, 190, 145, 255), warning = IM_COL32(240, 228, 66, 255);
inline constexpr ImU32 bad = IM_COL32(236, 92, 52, 255), accent = IM_COL32(70, 178, 255, 255);
// Colours of the curves of compared blocks. The curve of the first block has the colour `friction`.
inline constexpr ImU32 beside[] = {IM_COL32(86, 180, 233, 255), IM_COL32(190, 196, 206, 255)};
inline constexpr ImU32 plate = IM_COL32(14, 16, 20, 205);  ///< ground behind text on the picture
inline constexpr ImU32 snaps = IM_COL32(240, 228, 66, 255);
}  // namespace colours
inline ImU32 compared_colour(std::size_t i) { return colours::beside[i == 0 ? 0 : 1]; }

struct Fonts {
  ImFont* text = nullptr;
  ImFont* small = nullptr;
  ImFont* bold = nullptr;
};

/// Draws text in the panels' fonts over a list of shapes.
struct Pen {
  ImDrawList& draw;
  const Fonts& fonts;
  float scale = 1;  ///< display scale

  ImVec2 size(const ImFont* font, const std::string& text, float wrap = 0) const {
    return font->CalcTextSizeA(font->FontSize, 1e4f, wrap, text.c_str());
  }
  float small_width(const std::string& text) const { return size(fonts.small, text).x; }
  /// Draws text with its upper edge at y. `anchor` says which part of it is at x: 0 left end, 0.5 middle, 1
  /// right end.
  void write(float x, float y, float anchor, ImU32 colour, const std::string& text, const ImFont* font) const;
  void write_small(float x, float y, float anchor, ImU32 colour, const std::string& text) const {
    write(x, y, anchor, colour, text, fonts.small);
  }
  /// Draws text on a dark plate. y is the middle of the text's height. A text wider than `wrap` takes several
  /// lines; 0: one line.
  void tag(float x, float y, float anchor, ImU32 colour, const std::string& text, const ImFont* font,
           float wrap = 0) const;
};

/// Sets the style of the current ImGui context for a display scale (1 = 96 dots an inch) and loads its fonts:
/// Roboto where it is installed, else DejaVu, else ImGui's own.
Fonts set_style(float scale);

}  // namespace room
