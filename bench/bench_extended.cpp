// Compares extended patches that slide and spin with a grid of LuGre cells in one run: error against time.
//
// Each row times a disc of the infinite brush, cut into rings of cells, and a LuGre grid (its rival). Both
// are moved alternately, in blocks of steps, so that whatever slows the machine slows both; `ratio` is the
// median over the blocks of the rival's time over the brush's. `error` and `rival_error` are the largest
// errors of force over mu N and torque over mu N R, per cent, against the closed form of the limit surface,
// over eleven ratios of slide and spin and four directions.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <bristle/extended_patches.hpp>

#include "measured_scene.hpp"
#include "suites.hpp"
#include "tools/libraries/rivals/coulomb_disc.hpp"
#include "tools/libraries/rivals/lugre_grid.hpp"

namespace bristle_bench {

namespace {

using bristle::Population;
using rivals::LuGreGrid;
using rivals::Pair;
using rivals::Wrench;

constexpr double radius = 2000.0 * dbar;
constexpr double load_n = 900.0;

/// Disc of brush cells whose snap lengths are lognormal with a coefficient of variation of 0.3.
class BrushDisc {
 public:
  BrushDisc(int rings, int around, Population population, std::uint32_t bristles, double resolution)
      : batch_(BatchOptions{}.with_threads(1)), patches_(batch_) {
    const PatchOptions options = plain_options(bristles, 2, Precision::single, Outputs::end)
                                     .with_max_normal_load(load_n)
                                     .with_population(population)
                                     .with_resolution(resolution);
    motion_.id = patches_.add(plain_material(SnapLength::lognormal(dbar, 0.3), SnapRule::redraw), options,
                              bristle::Outline::disc(radius, bristle::Pressure::uniform, rings, around));
    motion_.normal_load = load_n;
    batch_.warm_up();
  }

  Wrench step(Pair displacement, double angle) {
    motion_.displacement[0] = displacement.x;
    motion_.displacement[1] = displacement.y;
    motion_.displacement[2] = angle;
    patches_.step(tick, {&motion_, 1}, {&response_, 1});
    return {{response_.end[0], response_.end[1]}, response_.end[2]};
  }
  std::size_t cells() const { return patches_.cell_count(motion_.id); }
  /// Returns the friction of pure sliding, m2 / (2 m1) of the law's moments, at 1 N/m per bristle.
  static double friction() { return 0.5 * 1.09 * dbar * load_n; }

 private:
  PatchBatch batch_;
  bristle::ExtendedPatches patches_;
  bristle::ExtendedMotion motion_;
  bristle::ExtendedResponse response_;
};

/// Disc of dry LuGre cells with the brush's friction and stiffness.
class LuGreDisc {
 public:
  LuGreDisc(int across, LuGreGrid::StepRule rule)
      : grid_(surface(), rivals::disc_cells(across, radius), rule) {}

  Wrench step(Pair displacement, double angle) { return grid_.step(displacement, angle, tick, load_n).end; }
  std::size_t cells() const { return grid_.cells(); }
  static double friction() { return BrushDisc::friction(); }

 private:
  static rivals::Surface surface() {
    rivals::Surface s;
    s.kinetic_coefficient = s.static_coefficient = friction() / load_n;
    // Stiffness of the whole disc, N/m, equal to that of the brush, whose bristles have 1 N/m each.
    s.stiffness = load_n;
    s.damping = s.viscous_friction = 0.0;
    return s;
  }

  LuGreGrid grid_;
};

/// Motion of a step that slides and spins, in which the disc's fastest point moves by the path `way`.
struct SlideAndSpin {
  Pair slide;
  double turn = 0.0;
};
SlideAndSpin slide_and_spin(double eps, double way, double direction) {
  const double slide = way * eps / (1.0 + eps);
  return {{slide * std::cos(direction), slide * std::sin(direction)}, way / (1.0 + eps) / radius};
}

/// Returns the largest error against the limit surface, per cent of mu N and mu N R.
template <class Disc, class Make>
double limit_error(const Make& make) {
  double worst = 0.0;
  for (const double eps : {0.0, 0.05, 0.1, 0.25, 0.4, 0.5, 0.75, 1.0, 1.2, 2.0, 5.0}) {
    const rivals::DiscFriction limit = rivals::coulomb_disc(eps);
    for (const double direction : {0.0, 0.37, 0.8, 1.3}) {
      std::unique_ptr<Disc> disc = make();
      const SlideAndSpin motion = slide_and_spin(eps, 0.37 * dbar, direction);
      Wrench mean;
      constexpr int settle = 100, measured = 60;
      for (int k = -settle; k < measured; ++k) {
        const Wrench w = disc->step(motion.slide, motion.turn);
        if (k < 0) continue;
        mean.force = mean.force - (1.0 / measured) * w.force;
        mean.torque -= w.torque / measured;
      }
      const double along = mean.force.x * std::cos(direction) + mean.force.y * std::sin(direction);
      worst = std::max({worst, std::fabs(along / Disc::friction() - limit.force),
                        std::fabs(mean.torque / (Disc::friction() * radius) - limit.torque)});
    }
  }
  return 100.0 * worst;
}

struct Ours {
  const char* name;
  int rings, around;  ///< number of rings, and of cells in each; 0 cells: three times the number of rings
  Population population;
  std::uint32_t bristles;  ///< number of representatives in the whole disc
  double resolution;       ///< resolution of the infinite brush in each cell
};
constexpr Ours ours[] = {{"infinite_3_rings", 3, 0, Population::infinite, 900, 2.0},
                         {"infinite_4_rings", 4, 0, Population::infinite, 900, 4.0},
                         {"infinite_6_rings_of_13", 6, 13, Population::infinite, 900, 4.0},
                         {"infinite_6_rings", 6, 0, Population::infinite, 900, 4.0},
                         {"infinite_8_rings", 8, 0, Population::infinite, 900, 8.0},
                         {"900_bristles_4_rings", 4, 0, Population::representatives, 900, 0.0},
                         {"14400_bristles_6_rings", 6, 0, Population::representatives, 14400, 0.0}};
struct Theirs {
  const char* name;
  int across;
  LuGreGrid::StepRule rule;
};
constexpr Theirs theirs[] = {{"lugre_21_exact", 21, LuGreGrid::StepRule::exact},
                             {"lugre_21_euler", 21, LuGreGrid::StepRule::euler},
                             {"lugre_14_exact", 14, LuGreGrid::StepRule::exact},
                             {"lugre_14_euler", 14, LuGreGrid::StepRule::euler}};

/// Regime of motion of a disc: its fastest point moves by `way` per step. In sticking regimes every other
/// step goes back.
struct SpinRegime {
  const char* name;
  const char* label;
  double way;  ///< path of the disc's fastest point in a step, in mean snap lengths
  double eps;
  bool there_and_back;
};
constexpr SpinRegime spin_regimes[] = {{"slide", "rim 0.5 dbar a step, v = 0.5 omega R", 0.5, 0.5, false},
                                       {"far", "rim 10 dbar a step, v = 0.5 omega R", 10.0, 0.5, false},
                                       {"stick", "rim +-0.003 dbar in turn", 0.003, 0.5, true}};

template <class Disc>
class Moved {
 public:
  Moved(std::unique_ptr<Disc> disc, const SpinRegime& regime) : disc_(std::move(disc)), regime_(regime) {
    const SlideAndSpin slide = slide_and_spin(regime.eps, 0.37 * dbar, 0.3);
    for (int i = 0; i < 100; ++i) disc_->step(slide.slide, slide.turn);
    motion_ = slide_and_spin(regime.eps, regime.way * dbar, 0.3);
    time(50);
  }

  /// Runs `steps` steps. Returns the mean time of one step, ns.
  double time(int steps) {
    const auto start = std::chrono::steady_clock::now();
    for (int i = 0; i < steps; ++i) {
      const double sign = regime_.there_and_back && i % 2 == 1 ? -1.0 : 1.0;
      benchmark::DoNotOptimize(disc_->step(sign * motion_.slide, sign * motion_.turn));
    }
    const std::chrono::duration<double, std::nano> elapsed = std::chrono::steady_clock::now() - start;
    return elapsed.count() / steps;
  }
  std::size_t cells() const { return disc_->cells(); }

 private:
  std::unique_ptr<Disc> disc_;
  SpinRegime regime_;
  SlideAndSpin motion_;
};

std::unique_ptr<BrushDisc> make_ours(const Ours& o) {
  return std::make_unique<BrushDisc>(o.rings, o.around, o.population, o.bristles, o.resolution);
}
std::unique_ptr<LuGreDisc> make_theirs(const Theirs& t) {
  return std::make_unique<LuGreDisc>(t.across, t.rule);
}

/// Returns the error of the model called `name`; `find` computes it at the first call, later calls reuse it.
double error_of(const char* name, double (*find)(const void*), const void* what) {
  static std::map<std::string, double> known;
  const auto found = known.find(name);
  return found != known.end() ? found->second : known[name] = find(what);
}

void add_pair(const SpinRegime& regime, const Ours& o, const Theirs& t) {
  const std::string name = std::string("extended/") + regime.name + '/' + o.name + "/over/" + t.name;
  add_benchmark(name, [=](benchmark::State& state) {
    const double error = error_of(
        o.name,
        [](const void* what) {
          return limit_error<BrushDisc>([&] { return make_ours(*static_cast<const Ours*>(what)); });
        },
        &o);
    const double rival_error = error_of(
        t.name,
        [](const void* what) {
          return limit_error<LuGreDisc>([&] { return make_theirs(*static_cast<const Theirs*>(what)); });
        },
        &t);
    Moved<BrushDisc> brush(make_ours(o), regime);
    Moved<LuGreDisc> lugre(make_theirs(t), regime);
    std::vector<double> our_ns, their_ns, ratios;
    constexpr int block = 20;
    for (auto _ : state) {
      const double a = brush.time(block), b = lugre.time(block);
      our_ns.push_back(a);
      their_ns.push_back(b);
      ratios.push_back(b / a);
    }
    state.counters["us"] = 1e-3 * median(our_ns);
    state.counters["rival_us"] = 1e-3 * median(their_ns);
    state.counters["ratio"] = median(ratios);
    state.counters["cells"] = static_cast<double>(brush.cells());
    state.counters["rival_cells"] = static_cast<double>(lugre.cells());
    state.counters["error"] = error;
    state.counters["rival_error"] = rival_error;
    state.SetLabel(regime.label);
  });
}

}  // namespace

void register_extended() {
  for (const SpinRegime& regime : spin_regimes) {
    for (const Ours& o : ours) {
      for (const Theirs& t : theirs) add_pair(regime, o, t);
    }
  }
}

}  // namespace bristle_bench
