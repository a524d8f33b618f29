#include "tools/libraries/experiments/spin_subject.hpp"

#include <utility>

#include "tools/libraries/experiments/subject.hpp"

namespace cli {
namespace {

using rivals::Pair;
using rivals::SpinForce;

rivals::PressedCells grid_of(ContactArea area, int across) {
  if (area.shape == ContactArea::Shape::disc) return rivals::disc_cells(across, area.half_m);
  return rivals::rectangle_cells(across, across, 2.0 * area.half_m, 2.0 * area.half_m);
}

bristle::Outline outline_of(ContactArea area, int rings) {
  using bristle::Outline;
  using bristle::Pressure;
  if (area.shape == ContactArea::Shape::disc) return Outline::disc(area.half_m, Pressure::uniform, rings);
  return Outline::rectangle(area.half_m, area.half_m, Pressure::uniform, 2 * rings, 2 * rings);
}

}  // namespace

SpinSubject::SpinSubject(std::string_view model, const Settings& settings, ContactArea area)
    : contact_([&]() -> decltype(contact_) {
        if (is_brush(model)) {
          auto batch = std::make_unique<bristle::PatchBatch>();
          bristle::ExtendedPatches patches(*batch);
          const auto rings = static_cast<int>(settings.number("rings"));
          const bristle::PatchId id = patches.add(brush_material(model, settings),
                                                  brush_options(model, settings), outline_of(area, rings));
          batch->warm_up();
          return Brush{std::move(batch), std::move(patches), id};
        }
        rivals::PressedCells cells = grid_of(area, static_cast<int>(settings.number("cells_across")));
        if (model == "lugre") return rivals::LuGreGrid(rival_surface(settings), std::move(cells));
        return rivals::RivalGrid(rival_for(model, settings), std::move(cells));
      }()) {}

SpinForce SpinSubject::step(Pair displacement, double angle, double dt_s, double load_n) {
  return std::visit([&](auto& contact) { return contact.step(displacement, angle, dt_s, load_n); }, contact_);
}

SpinForce SpinSubject::Brush::step(Pair displacement, double angle, double dt_s, double load_n) {
  bristle::ExtendedMotion motion;
  motion.id = id;
  motion.displacement[0] = displacement.x;
  motion.displacement[1] = displacement.y;
  motion.displacement[2] = angle;
  motion.normal_load = load_n;
  bristle::ExtendedResponse r;
  patches.step(dt_s, {&motion, 1}, {&r, 1});
  return {{{r.end[0], r.end[1]}, r.end[2]}, {{r.mean[0], r.mean[1]}, r.mean[2]}};
}

std::vector<Parameter> spin_parameters(int across, int rings) {
  return {
      whole_parameter("cells_across", across, "cells along a diameter or side: rivals", 1, 1000),
      whole_parameter("rings", rings, "rings of cells in a disc, half the cells along a side: brush", 1, 32)};
}

}  // namespace cli
