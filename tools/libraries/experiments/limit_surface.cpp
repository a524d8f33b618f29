// Experiment on the limit surface of a disc: the force and torque with which it resists sliding and spinning
// together, at every ratio of the two.
#include <algorithm>
#include <cmath>
#include <memory>
#include <variant>

#include <bristle/extended_patches.hpp>

#include "tools/libraries/experiments/experiment.hpp"
#include "tools/libraries/experiments/subject.hpp"
#include "tools/libraries/rivals/coulomb_disc.hpp"
#include "tools/libraries/rivals/rival_grid.hpp"

namespace cli {
namespace {

using rivals::SpinForce;
using rivals::Wrench;

/// Disc of infinite or other brushes with an outline.
struct BrushDisc {
  // Batch behind a pointer. `patches` refers to it, and must still find it when this object is moved.
  std::unique_ptr<bristle::PatchBatch> batch = std::make_unique<bristle::PatchBatch>();
  bristle::ExtendedPatches patches{*batch};
  bristle::ExtendedMotion motion;

  BrushDisc(std::string_view model, const Settings& s, double radius_m) {
    const auto rings = static_cast<int>(s.number("rings"));
    motion.id = patches.add(brush_material(model, s), brush_options(model, s),
                            bristle::Outline::disc(radius_m, bristle::Pressure::uniform, rings));
    batch->warm_up();
  }
  SpinForce step(rivals::Pair displacement, double angle, double dt_s, double load_n) {
    motion.displacement[0] = displacement.x;
    motion.displacement[1] = displacement.y;
    motion.displacement[2] = angle;
    motion.normal_load = load_n;
    bristle::ExtendedResponse r;
    patches.step(dt_s, {&motion, 1}, {&r, 1});
    return {{{r.end[0], r.end[1]}, r.end[2]}, {{r.mean[0], r.mean[1]}, r.mean[2]}};
  }
};

/// Disc under uniform pressure: a rival model in every cell of a grid, or a brush.
using Disc = std::variant<rivals::RivalGrid, BrushDisc>;

Disc disc_of(std::string_view model, const Settings& s, double radius_m) {
  if (is_brush(model)) return BrushDisc(model, s, radius_m);
  return rivals::RivalGrid(rival_for(model, s),
                           rivals::disc_cells(static_cast<int>(s.number("cells_across")), radius_m));
}

/// Returns mean force and torque of a disc in steady motion at the ratio eps = v / (omega R) of sliding to
/// spinning speed.
Wrench steady(const std::string& model, const Settings& s, double eps) {
  const double radius = s.number("radius"), load = s.number("load");
  Disc disc = disc_of(model, s, radius);
  // Path (m) of the disc's fastest point in a step. The odd factor keeps the snaps of the bristles from
  // coinciding with the steps.
  const double step = 0.37 * s.number("presliding");
  const double dt = step / s.number("velocity");
  const bool slides_alone = std::isinf(eps);
  const double slide = slides_alone ? step : step * eps / (1.0 + eps);
  const double turn = slides_alone ? 0.0 : step / (1.0 + eps) / radius;
  const auto settle = std::lround(s.number("settling") / 0.37),
             measure = std::lround(s.number("path") / 0.37);
  Wrench mean;
  for (long k = -settle; k < measure; ++k) {
    const Wrench w = std::visit(
        [&](auto& contact) {
          return contact.step({slide, 0.0}, turn, dt, load).mean;
        },
        disc);
    if (k < 0) continue;
    const double share = 1.0 / static_cast<double>(measure);
    mean.force = mean.force - share * w.force;
    mean.torque -= share * w.torque;
  }
  return mean;
}

void run_limit_surface(ExperimentRun& run) {
  const Settings& s = run.settings;
  const double radius = s.number("radius");
  // Divides by friction at the same speed, not by the kinetic coefficient, because some models depend on
  // speed.
  const double friction = steady(run.model, s, INFINITY).force.x;
  double worst = 0.0;
  const std::vector<double>& ratios = s.numbers("ratios");
  for (std::size_t i = 0; i < ratios.size(); ++i) {
    const Wrench w = steady(run.model, s, ratios[i]);
    const rivals::DiscFriction limit = rivals::coulomb_disc(ratios[i]);
    const double force = w.force.x / friction, torque = w.torque / (friction * radius);
    worst = std::max({worst, std::fabs(force - limit.force), std::fabs(torque - limit.torque)});
    run.add("limit", {ratios[i], force, w.force.y / friction, torque, limit.force, limit.torque});
    run.progress(static_cast<double>(i + 1) / static_cast<double>(ratios.size()));
  }
  run.add("limit_surface", 100.0 * worst, worst < 0.01);
  const double slow = 0.1;
  const double eased = steady(run.model, s, slow).force.x / friction / rivals::coulomb_disc(slow).force;
  run.add("spin_eases", eased, std::fabs(eased - 1.0) < 0.1);
}

}  // namespace

Experiment limit_surface_experiment() {
  return {"limit-surface",
          "a disc that slides and spins steadily, at every ratio of the two",
          "Force and torque of all models but rate and state lie on one closed surface",
          common_parameters({{"damping", 0.0}, {"viscous", 0.0}, {"bristles", 14400}}) +
              std::vector<Parameter>{
                  whole_parameter("cells_across", 21, "cells along a diameter: rivals", 1, 1000),
                  whole_parameter("rings", 6, "rings of cells: brush", 1, 32),
                  number_parameter("radius", 0.02, "m", "of the disc", 1e-6, 10.0),
                  number_parameter("velocity", 0.1, "m/s", "of the disc's fastest point", 1e-9, 1e3),
                  list_parameter("ratios", {0.0, 0.05, 0.1, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 5.0}, "",
                                 "velocities of the centre over omega R", 0.0, 1e6),
                  number_parameter("settling", 40.0, "",
                                   "path of the fastest point before measuring, mean snap lengths", 1.0, 1e6),
                  number_parameter("path", 25.0, "", "path of the fastest point measured, mean snap lengths",
                                   1.0, 1e7)},
          {{"limit_surface", "friction and torque share one limit surface",
            "force and torque of a sliding, spinning disc lie on one closed surface (Goyal, Ruina, "
            "Papadopoulos, Wear 143, 1991; closed form: Farkas, Bartels, Unger, Wolf, PRL 90, 2003)",
            "largest error of force over mu N and of torque over mu N R, over all ratios", "%", "below 1 %"},
           {"spin_eases", "what spins slides easier",
            "its force is proportional to velocity, F = mu N v / (omega R)",
            "force at v = 0.1 omega R, over that of the closed form", "", "within 10 % of 1"}},
          {"v_over_omegaR", "force_over_friction", "aside_over_friction", "torque_over_friction_R",
           "force_in_theory", "torque_in_theory"},
          &run_limit_surface};
}

}  // namespace cli
