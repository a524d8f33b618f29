// A contact with an extent under test: a rival in every cell of a grid, or a brush with an outline, moved and
// asked in the same way.
#pragma once

#include <memory>
#include <string_view>
#include <variant>
#include <vector>

#include <bristle/extended_patches.hpp>

#include "tools/experiments/settings.hpp"
#include "tools/rivals/lugre_grid.hpp"
#include "tools/rivals/rival_grid.hpp"

namespace cli {

/// Shape of the contact, under uniform pressure.
struct ContactArea {
  enum class Shape { disc, square } shape = Shape::disc;
  double half_m = 0.0;  ///< radius, or half a side
};

class SpinSubject {
 public:
  /// `model` is one of model_names(). Reads the parameters of spin_parameters(). Throws bristle::Error.
  SpinSubject(std::string_view model, const Settings& settings, ContactArea area);

  /// Wrench on the moving body about the centre of the area. The centre moves by `displacement` (m) and the
  /// body turns by `angle` (rad, half a turn at most), both at constant speed, in dt_s.
  rivals::SpinForce step(rivals::Pair displacement, double angle, double dt_s, double load_n);

 private:
  struct Brush {
    std::unique_ptr<bristle::PatchBatch> batch;  // stays where it is
    bristle::ExtendedPatches patches;
    bristle::PatchId id;

    rivals::SpinForce step(rivals::Pair displacement, double angle, double dt_s, double load_n);
  };

  std::variant<rivals::RivalGrid, rivals::LuGreGrid, Brush> contact_;
};

/// Into how many cells the area is cut: `across` for the rivals, `rings` for the brush (of a square, twice as
/// many cells along a side).
std::vector<Parameter> spin_parameters(int across = 21, int rings = 6);

}  // namespace cli
