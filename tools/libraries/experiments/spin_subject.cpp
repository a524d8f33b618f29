#include "tools/libraries/experiments/spin_subject.hpp"

#include <utility>

#include "tools/libraries/experiments/subject.hpp"

namespace cli {
namespace {

using rivals::Pair;
using rivals::SpinForce;

}  // namespace

SpinSubject::SpinSubject(std::string_view model, const Settings& settings, double radius_m)
    : contact_([&]() -> decltype(contact_) {
        if (is_brush(model)) {
          auto batch = std::make_unique<bristle::PatchBatch>();
          bristle::ExtendedPatches patches(*batch);
          const auto rings = static_cast<int>(settings.number("rings"));
          const bristle::PatchId id =
              patches.add(brush_material(model, settings), brush_options(model, settings),
                          bristle::Outline::disc(radius_m, bristle::Pressure::uniform, rings));
          batch->warm_up();
          return Brush{std::move(batch), std::move(patches), id};
        }
        rivals::PressedCells cells =
            rivals::disc_cells(static_cast<int>(settings.number("cells_across")), radius_m);
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

std::vector<Parameter> spin_parameters() {
  return {whole_parameter("cells_across", 21, "cells along a diameter: rivals", 1, 1000),
          whole_parameter("rings", 6, "rings of cells: brush", 1, 32)};
}

}  // namespace cli
