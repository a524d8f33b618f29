// A friction model under test whose contact has an extent, behind one interface: a rival model in every cell
// of a grid, or a brush with an outline.
#pragma once

#include <memory>
#include <string_view>
#include <variant>
#include <vector>

#include <bristle/extended_patches.hpp>

#include "tools/libraries/experiments/settings.hpp"
#include "tools/libraries/rivals/lugre_grid.hpp"
#include "tools/libraries/rivals/rival_grid.hpp"

namespace cli {

class SpinSubject {
 public:
  /// Makes the friction model of this name for a disc of this radius (m) under uniform pressure, with
  /// parameters from spin_parameters(). Throws bristle::Error.
  SpinSubject(std::string_view model, const Settings& settings, double radius_m);

  /// Moves the contact's centre by `displacement` (m) and turns the body by `angle` (rad, at most half a
  /// turn), both at constant speed. Returns the force and torque on the moving body about the centre.
  rivals::SpinForce step(rivals::Pair displacement, double angle, double dt_s, double load_n);

 private:
  struct Brush {
    // Batch behind a pointer. `patches` refers to it, and must still find it when this object is moved.
    std::unique_ptr<bristle::PatchBatch> batch;
    bristle::ExtendedPatches patches;
    bristle::PatchId id;

    rivals::SpinForce step(rivals::Pair displacement, double angle, double dt_s, double load_n);
  };

  std::variant<rivals::RivalGrid, rivals::LuGreGrid, Brush> contact_;
};

/// Returns the parameters by which the disc is divided into cells: cells along a diameter for rival models,
/// rings of cells for the brush.
std::vector<Parameter> spin_parameters();

}  // namespace cli
