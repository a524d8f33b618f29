// Contact with an extent under test, behind one interface: a rival in every cell of a grid, or a brush with
// an outline.
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

/// Shape and size of the contact area, which is under uniform pressure.
struct ContactArea {
  enum class Shape { disc, square } shape = Shape::disc;
  double half_m = 0.0;  ///< m, radius of the disc, or half a side of the square
};

class SpinSubject {
 public:
  /// Makes a model, one of model_names(), with the parameters of spin_parameters(). Throws bristle::Error.
  SpinSubject(std::string_view model, const Settings& settings, ContactArea area);

  /// Moves the centre by `displacement` (m) and turns the body by `angle` (rad, half a turn at most), both at
  /// constant speed, in dt_s. Returns the wrench on the moving body about the centre of the area.
  rivals::SpinForce step(rivals::Pair displacement, double angle, double dt_s, double load_n);

 private:
  struct Brush {
    std::unique_ptr<bristle::PatchBatch> batch;  // held by pointer, so that its address stays when this
                                                 // object moves
    bristle::ExtendedPatches patches;
    bristle::PatchId id;

    rivals::SpinForce step(rivals::Pair displacement, double angle, double dt_s, double load_n);
  };

  std::variant<rivals::RivalGrid, rivals::LuGreGrid, Brush> contact_;
};

/// Returns parameters that cut the area into cells: `across` for the rivals, `rings` for the brush (for a
/// square, twice as many cells along a side).
std::vector<Parameter> spin_parameters(int across = 21, int rings = 6);

}  // namespace cli
