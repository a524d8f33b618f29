#include "tools/virtual_room/room_view.hpp"

#include <backends/imgui_impl_opengl3.h>
#include <epoxy/gl.h>
#include <imgui.h>

namespace room {

RoomView::RoomView(const RoomMeasures& measures, int samples, float scale)
    : measures_(measures), renderer_(measures, samples), scale_(scale) {
  IMGUI_CHECKVERSION();
  ImGui::CreateContext();
  ImGui::GetIO().IniFilename = nullptr;  // nothing is left in the person's folder
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
  times_.add(static_cast<double>(point.step_time));
}

void RoomView::forget() {
  history_.clear();
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
}

Wishes RoomView::draw(const Snapshot& room, int width, int height, float elapsed, std::uint32_t target) {
  layout_ = make_layout(width, height, scale_, panels, glass_shown);
  glass_.update(room, room.paused ? 0.0f : elapsed);

  ImGui_ImplOpenGL3_NewFrame();
  ImGui::NewFrame();
  Wishes wishes;
  draw_overlay(layout_, fonts_, room, glass_, camera, measures_, notice);
  draw_settings(layout_, fonts_, room, gui, wishes);
  draw_bar(layout_, fonts_, room, wishes);
  draw_plots(layout_, fonts_, room, history_, times_, gui, elapsed);
  ImGui::Render();

  renderer_.draw(room, glass_, camera, layout_.picture, target);
  glViewport(0, 0, width, height);
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
  return wishes;
}

}  // namespace room
