// Experiment on a wheel that rolls and creeps sideways. Measures force, aligning moment, the slipping parts
// of the contact, the relaxation length, and whether a standing wheel creeps under a side force.
#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include <bristle/bed.hpp>

#include "tools/libraries/experiments/experiment.hpp"
#include "tools/libraries/rivals/wheels.hpp"

namespace cli {
namespace {

using rivals::Wheel;
using Answer = rivals::WheelForce;

/// Wheel whose contact is a bed (a row of bristles under a pressure).
struct BedWheel : Wheel {
  bristle::BedBatch beds;
  bristle::BedMotion motion;
  explicit BedWheel(const Wheel& wheel) : Wheel(wheel) {
    bristle::BedOptions options;
    options.max_normal_load = motion.normal_load = load;
    motion.id = beds.add(bristle::BedMaterial(limit / load).with_slip_stiffness(stiffness, stiffness),
                         bristle::BedShape::wheel_row(half, bristle::BedPressure::parabolic, cells), options);
  }
  void move(double aside, double rolled) {
    motion.displacement[1] = aside;
    motion.rolled[0] = rolled;
  }
  Answer step(double aside, double rolled, double) {
    move(aside, rolled);
    bristle::BedResponse out;
    beds.step({&motion, 1}, {&out, 1});
    return {-out.force[1], out.torque};
  }
};

template <class Model>
Answer attempt(const Model& model, double aside, double rolled, double dt) {
  Model copy = model;
  return copy.step(aside, rolled, dt);
}
Answer attempt(BedWheel& model, double aside, double rolled, double) {
  model.move(aside, rolled);
  const bristle::BedResponse out = model.beds.find_force(model.motion);
  return {-out.force[1], out.torque};
}

std::vector<rivals::Traction> tractions_of(const BedWheel& model) {
  std::vector<bristle::BedBristle> bristles(model.beds.info(model.motion.id).bristles);
  model.beds.read_bristles(model.motion.id, {bristles.data(), bristles.size()});
  std::sort(bristles.begin(), bristles.end(),
            [](const auto& a, const auto& b) { return a.position[0] > b.position[0]; });
  // Deflection (m) at the contact's highest traction. Dividing by it turns tractions into shares of that
  // maximum.
  const double largest = 1.5 * model.limit / model.stiffness * model.half;
  std::vector<rivals::Traction> rows;
  for (const bristle::BedBristle& b : bristles)
    if (b.stiffness > 0.0)
      rows.push_back({b.position[0] / model.half, b.deflection[1] / largest, b.limit / largest});
  return rows;
}
const std::vector<rivals::Traction>& tractions_of(const rivals::Fastsim& model) { return model.tractions; }
template <class Model>
std::vector<rivals::Traction> tractions_of(const Model&) {
  return {};
}

/// Returns the relaxation length: the distance rolled, in half contact lengths, after which the force of a
/// small creepage reaches 1 - 1/e of its steady value.
template <class Model>
double relaxation(const Wheel& wheel, double per_step) {
  const double creepage = 0.01 * wheel.full_slip(), step = 1e-3 * wheel.half, dt = 1e-3 * step / per_step;
  Model model{wheel};
  double steady = 0.0, length = 0.0;
  for (int k = 0; k < 40; ++k) steady = model.step(creepage * wheel.half, wheel.half, 1e3 * dt).force;
  for (Model fresh{wheel}; fresh.step(creepage * step, step, dt).force < (1.0 - std::exp(-1.0)) * steady;)
    length += 1e-3;
  return length;
}

/// Returns how far (m) a standing wheel creeps in each cycle of a side force, not counting the first cycle.
template <class Model>
double creep_at_rest(const Wheel& wheel, int cycles) {
  constexpr int steps = 50;
  constexpr double dt = 0.02;
  Model model{wheel};
  double path = 0.0, first = 0.0;
  for (int k = 0; k < cycles * steps; ++k) {
    const double force = wheel.limit * (0.3 + 0.2 * std::sin(2.0 * M_PI * (k + 1) / steps));
    double low = -wheel.half, high = wheel.half;
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (low + high);
      (attempt(model, middle, 0.0, dt).force < force ? low : high) = middle;
    }
    model.step(high, 0.0, dt);
    path += high;
    if (k + 1 == steps) first = path;
  }
  return (path - first) / (cycles - 1);
}

template <class Model>
void examine(ExperimentRun& run, const Wheel& wheel) {
  const double rolled = wheel.half, dt = rolled / run.number("speed");
  double worst_force = 0.0, worst_moment = 0.0;
  for (const double at : run.settings.numbers("creepages")) {
    Model model{wheel};
    Answer answer;
    for (int k = 0; k < 40; ++k) answer = model.step(at * wheel.full_slip() * rolled, rolled, dt);
    const double left = std::max(1.0 - at, 0.0), force = answer.force / wheel.limit;
    const double moment = answer.moment / (wheel.limit * wheel.half);
    worst_force = std::max(worst_force, std::fabs(force - (1.0 - left * left * left)));
    worst_moment = std::max(worst_moment, std::fabs(moment - at * left * left * left));
    run.add("curve", {at, force, moment});
    for (const rivals::Traction& t : tractions_of(model))
      run.add(fmt::format("traction_{:g}", at), {t[0], t[1], t[2]});
  }
  run.add("creep_force", 100.0 * worst_force, worst_force < 0.01);
  const double share = worst_moment * 256.0 / 27.0;
  run.add("creep_moment", 100.0 * share, share < 0.05);
  const double length = relaxation<Model>(wheel, run.number("speed") * dt),
               theory = 2.0 - 2.0 / std::sqrt(M_E);
  run.add("relaxation_length", length, std::fabs(length / theory - 1.0) < 0.05);
  const double creep = creep_at_rest<Model>(wheel, 6);
  run.add("stands", 1e6 * creep, std::fabs(creep) < 1e-9);
}

void run_creep_curve(ExperimentRun& run) {
  const Settings& s = run.settings;
  Wheel wheel;
  wheel.load = s.number("load");
  wheel.limit = s.number("friction") * wheel.load;
  wheel.half = s.number("half_length");
  wheel.stiffness = s.number("slip_stiffness");
  wheel.low_speed = s.number("low_speed");
  wheel.cells = static_cast<int>(s.number("cells"));
  if (run.model == "coulomb_wheel") examine<rivals::CoulombWheel>(run, wheel);
  if (run.model == "slip_formula") examine<rivals::SlipFormula>(run, wheel);
  if (run.model == "lugre_tyre") examine<rivals::LuGreTyre>(run, wheel);
  if (run.model == "fastsim") examine<rivals::Fastsim>(run, wheel);
  if (run.model == "bed") examine<BedWheel>(run, wheel);
}

}  // namespace

Experiment creep_curve_experiment() {
  return {
      "creep-curve",
      "a wheel that rolls and creeps sideways: force, aligning moment, regions that slip, and standing",
      "The bed has the force and moment of a tyre's tread, builds them up over a distance, and stands still "
      "at rest",
      {number_parameter("load", 4000.0, "N", "on the wheel", 1.0, 1e6),
       number_parameter("friction", 0.92, "", "coefficient", 0.01, 10.0),
       number_parameter("half_length", 0.0765, "m", "of the contact, whose pressure is parabolic", 1e-4, 1.0),
       number_parameter("slip_stiffness", 58.8e3, "N", "force per unit creepage", 1.0, 1e9),
       number_parameter("speed", 10.0, "m/s", "of rolling", 1e-3, 100.0),
       number_parameter("low_speed", 0.1, "m/s", "below which slip is taken over this: slip_formula, fastsim",
                        1e-9, 10.0),
       whole_parameter("cells", 32, "along the contact: fastsim, bed", 2, 1024),
       list_parameter("creepages",
                      {0.02, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.2, 1.5},
                      "", "over that at which all of the contact slips", 1e-3, 100.0)},
      {{"creep_force", "the creep curve of a tyre's tread",
        "bristles under a parabolic pressure pull with 3 s - 3 s^2 + s^3 (Pacejka, Tire and Vehicle "
        "Dynamics)",
        "largest difference from it, over friction", "%", "below 1 %"},
       {"creep_moment", "its aligning moment",
        "the trailing part slips first: s (1 - s)^3 over friction and half length (likewise)",
        "largest difference from it, over the highest moment", "%", "below 5 %"},
       {"relaxation_length", "force that rises over a distance",
        "the contact must be rolled through: 1 - 1/e of the force after 0.787 half lengths (likewise)",
        "that distance, over half the length", "", "within 5 % of 0.787"},
       {"stands", "a wheel that stands under a wavering force",
        "below break-away bodies at rest return to where they were (as in drift)",
        "path that a wheel that does not roll creeps in a cycle of 0.1 to 0.5 of its friction", "um",
        "below 1e-3"}},
      {"s_or_x_over_half", "force_or_traction", "moment_or_bound"},
      &run_creep_curve,
      {{"coulomb_wheel", "Coulomb wheel"},
       {"slip_formula", "slip formula"},
       {"lugre_tyre", "LuGre tyre"},
       {"fastsim", "FASTSIM"},
       {"bed", "bed"}}};
}

}  // namespace cli
