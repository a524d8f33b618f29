// Makes discs that slide and spin, of infinite brushes and of LuGre elements, to compare their times
// (`bristle capacity --targets`).
#include <memory>

#include <bristle/extended_patches.hpp>

#include "tools/libraries/capacity/subject.hpp"
#include "tools/libraries/rivals/rival_grid.hpp"

namespace cli {
namespace {

constexpr double radius = 2000.0 * mean_snap_length_m;
constexpr double load_n = 900.0;
constexpr double kinetic_coefficient = 0.4;
constexpr int settling_steps = 100;

/// Motion of a disc in a step: displacement of its centre along x (m), and turn (rad).
struct Motion {
  double slide, turn;
};
Motion motion_of(double path) {
  const double rim = path * mean_snap_length_m / 1.5;
  return {0.5 * rim, rim / radius};
}

class BrushDisc {
 public:
  explicit BrushDisc(const std::string& isa)
      : batch_(bristle::BatchOptions{}.with_isa(isa.empty() ? nullptr : isa.c_str())), patches_(batch_) {
    const bristle::Material material = bristle::Material::from_coefficients(
        bristle::Coefficients{}.with_kinetic(kinetic_coefficient).with_presliding_length(mean_snap_length_m));
    motion_.id = patches_.add(material,
                              bristle::PatchOptions{}
                                  .with_max_normal_load(load_n)
                                  .with_axes(2)
                                  .with_population(bristle::Population::infinite)
                                  .with_resolution(4.0),
                              bristle::Outline::disc(radius, bristle::Pressure::uniform, 6, 13));
    motion_.normal_load = load_n;
    batch_.warm_up();
  }

  double step(Motion by) {
    motion_.displacement[0] = by.slide;
    motion_.displacement[2] = by.turn;
    patches_.step(capacity_dt_s, {&motion_, 1}, {&response_, 1});
    return response_.end[2];
  }

 private:
  bristle::PatchBatch batch_;
  bristle::ExtendedPatches patches_;
  bristle::ExtendedMotion motion_;
  bristle::ExtendedResponse response_;
};

class LuGreDisc {
 public:
  LuGreDisc() : grid_(surface(), rivals::disc_cells(21, radius)) {}

  double step(Motion by) { return grid_.step({by.slide, 0.0}, by.turn, capacity_dt_s, load_n).end.torque; }

 private:
  /// Returns a surface without lubricant or Stribeck curve. This saves each cell of the LuGre disc, a rival,
  /// an exponential function, so that the comparison favours the rival.
  static rivals::Surface surface() {
    rivals::Surface s;
    s.kinetic_coefficient = s.static_coefficient = kinetic_coefficient;
    s.stiffness = 2.0 * kinetic_coefficient * load_n / mean_snap_length_m;
    s.damping = s.viscous_friction = 0.0;
    return s;
  }

  rivals::LuGreGrid grid_;
};

template <class Disc>
Contestant contestant(const char* name, std::shared_ptr<Disc> disc, double path, bool there_and_back) {
  for (int i = 0; i < settling_steps; ++i) disc->step(motion_of(0.37));
  return {name,
          [disc, by = motion_of(path), there_and_back, back = false]() mutable {
            const double sign = there_and_back && back ? -1.0 : 1.0;
            back = !back;
            return disc->step({sign * by.slide, sign * by.turn});
          },
          {}};
}

}  // namespace

Contestant brush_disc(double path, bool there_and_back, const std::string& isa) {
  return contestant("bristle: disc, infinite brush", std::make_shared<BrushDisc>(isa), path, there_and_back);
}

Contestant lugre_disc(double path, bool there_and_back) {
  return contestant("LuGre, 21 x 21", std::make_shared<LuGreDisc>(), path, there_and_back);
}

}  // namespace cli
