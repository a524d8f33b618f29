// A wheel whose contact is a bed (a row of bristles under a pressure), and functions that run and inspect
// this and other models of wheels.
#pragma once

#include <algorithm>
#include <vector>

#include <bristle/bed.hpp>

#include "tools/libraries/rivals/wheels.hpp"

namespace cli {

struct BedWheel : rivals::Wheel {
  bristle::BedBatch beds;
  bristle::BedMotion motion;
  explicit BedWheel(const rivals::Wheel& wheel) : rivals::Wheel(wheel) {
    bristle::BedOptions options;
    options.max_normal_load = motion.normal_load = load;
    motion.id = beds.add(bristle::BedMaterial(limit / load).with_slip_stiffness(stiffness, stiffness),
                         bristle::BedShape::wheel_row(half, bristle::BedPressure::parabolic, cells), options);
  }
  void move(double aside, double rolled) {
    motion.displacement[1] = aside;
    motion.rolled[0] = rolled;
  }
  rivals::WheelForce step(double aside, double rolled, double) {
    move(aside, rolled);
    bristle::BedResponse out;
    beds.step({&motion, 1}, {&out, 1});
    return {-out.force[1], out.torque};
  }
};

template <class Model>
rivals::WheelForce attempt(const Model& model, double aside, double rolled, double dt) {
  Model copy = model;
  return copy.step(aside, rolled, dt);
}
inline rivals::WheelForce attempt(BedWheel& model, double aside, double rolled, double) {
  model.move(aside, rolled);
  const bristle::BedResponse out = model.beds.find_force(model.motion);
  return {-out.force[1], out.torque};
}

inline std::vector<rivals::Traction> tractions_of(const BedWheel& model) {
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
inline const std::vector<rivals::Traction>& tractions_of(const rivals::Fastsim& model) {
  return model.tractions;
}
template <class Model>
std::vector<rivals::Traction> tractions_of(const Model&) {
  return {};
}

}  // namespace cli
