#include "tools/products/virtual_room/room_view.hpp"

#include <backends/imgui_impl_opengl3.h>
#include <epoxy/gl.h>
#include <fmt/format.h>
#include <imgui.h>

#include <cmath>

namespace room {

RoomView::RoomView(const RoomMeasures& measures, int samples, float scale)
    : measures_(measures), renderer_(measures, samples), scale_(scale) {
  IMGUI_CHECKVERSION();
  ImGui::CreateContext();
  ImGui::GetIO().IniFilename = nullptr;  // keeps ImGui from writing its file imgui.ini
  ImGui::GetIO().LogFilename = nullptr;
  ImGui_ImplOpenGL3_Init("#version 330 core");
  fonts_ = set_style(scale_);
}

RoomView::~RoomView() {
  ImGui_ImplOpenGL3_Shutdown();
  ImGui::DestroyContext();
}

void RoomView::add(const PlotPoint& point) {
  history_.add(point);
  gui.first_bending.add(point);
  times_.add(static_cast<double>(point.step_time));
}

void RoomView::forget() {
  history_.clear();
  gui.first_bending = {};
  times_.clear();
  gui.ranges = {};
}

void RoomView::follow(const Settings& in_force) {
  if (!ImGui::IsAnyItemActive()) gui.settings = in_force;
}

void RoomView::set_scale(float scale) {
  if (scale == scale_) return;
  scale_ = scale;
  fonts_ = set_style(scale_);
  ImGui_ImplOpenGL3_DestroyFontsTexture();
  ImGui_ImplOpenGL3_CreateFontsTexture();  // builds the fonts: a picture cannot begin without
}

// Moves the magnifying glass to the other side of the picture if the block comes behind it, unless the block
// would be hidden there too.
void RoomView::keep_glass_off_the_block(const Snapshot& room, int width, int height) {
  const Eigen::Vector3f block = to_vector(room.block_position);
  if (!block.allFinite()) return;
  const Eigen::Matrix3f tilt = room_tilt(room.settings.slope);
  const auto reach = static_cast<float>(0.5 * measures_.block[0]);
  const auto is_free = [&](const Layout& layout, float more = 1.0f) {
    const Picture& p = layout.picture;
    float x = 0, y = 0, top_x = 0, top_y = 0;
    if (!camera.find_pixel(p.scene, tilt * block, x, y) ||
        !camera.find_pixel(p.scene, tilt * (block + Eigen::Vector3f(0, 0, reach)), top_x, top_y)) {
      return true;
    }
    const float size = 1.3f * more * std::hypot(top_x - x, top_y - y);
    // Position, in pixels, of the lower edge of the text below the magnifying glass.
    const float below = p.glass_y + p.glass_radius + 45 * scale_;
    const bool in_words =
        std::abs(x - p.glass_x) < p.glass_radius + size && y > p.glass_y && y < below + size;
    return std::hypot(x - p.glass_x, y - p.glass_y) > p.glass_radius + size && !in_words;
  };
  // Keeps the magnifying glass on its side if it hides nothing there, unless it is at the left and there is
  // ample room at the right.
  if (is_free(layout_) && !(glass_left_ && is_free(make_layout(width, height, scale_, panels, true), 2.0f)))
    return;
  const Layout other = make_layout(width, height, scale_, panels, true, !glass_left_);
  if (!is_free(other)) return;
  glass_left_ = !glass_left_;
  layout_ = other;
}

Wishes RoomView::draw(const Snapshot& room, int width, int height, float elapsed, std::uint32_t target) {
  layout_ = make_layout(width, height, scale_, panels, glass_shown, glass_left_);
  if (glass_shown) keep_glass_off_the_block(room, width, height);
  glass_.update(room, room.paused ? 0.0f : elapsed);
  gui.first_bending.set_length(room.presliding_length);
  glass_.by_age = colours_by_age(room);

  ImGui_ImplOpenGL3_NewFrame();
  ImGui::NewFrame();
  Wishes wishes;
  OverlayWords words{title, notice, deadline_warning(times_, room.loop), "", gui.share < 0.9};
  if (gui.pictures > 0)
    words.rates =
        fmt::format("{:.2f} of real time, {:.2g} pictures a second", gui.share * room.speed, gui.pictures);
  draw_overlay(layout_, fonts_, room, glass_, camera, measures_, words);
  draw_settings(layout_, fonts_, room, times_, gui, wishes);
  draw_bar(layout_, fonts_, room, gui, wishes);
  if (room.paused) draw_scrubber(layout_, gui);
  if (help_shown) draw_help(layout_, fonts_);
  draw_plots(layout_, fonts_, room, history_, times_, gui, elapsed);
  ImGui::Render();

  renderer_.draw(room, glass_, camera, layout_.picture, target);
  glViewport(0, 0, width, height);
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
  return wishes;
}

}  // namespace room
