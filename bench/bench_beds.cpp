// Compares beds with what their users have otherwise (plain_beds.hpp, tools/libraries/rivals), in one run.
// Each row times a bed and one alternative (its rival). Both are stepped alternately in blocks, so that
// whatever slows the machine slows both. `ratio` is the rival's time over the bed's, as the median over the
// blocks. `error` and `rival_error` are the errors of force and torque in per cent of mu N and mu N R, where
// a closed or converged answer exists.
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <bristle/bed.hpp>

#include "bench/plain_beds.hpp"
#include "bench/timing.hpp"
#include "measured_scene.hpp"
#include "suites.hpp"
#ifdef BRISTLE_HAS_RIVALS
#include "tools/libraries/rivals/coulomb_disc.hpp"
#include "tools/libraries/rivals/rival_grid.hpp"
#endif

namespace bristle_bench {

namespace {

using bristle::BedMaterial;
using bristle::BedMotion;
using bristle::BedPressure;
using bristle::BedResponse;
using bristle::BedShape;

/// Batch of equal beds (a bed is the contact of an elastic body), with the motion of each.
struct Beds {
  bristle::BedBatch batch;
  std::vector<BedMotion> in;
  std::vector<BedResponse> out;

  Beds(const BedMaterial& material, const BedShape& shape, double load, std::size_t n = 1)
      : batch(BatchOptions().with_threads(1)), in(n), out(n) {
    bristle::BedOptions options;
    options.max_normal_load = load;
    for (BedMotion& motion : in) {
      motion.id = batch.add(material, shape, options);
      motion.normal_load = load;
    }
  }
  const BedResponse& step() {
    batch.step({in.data(), in.size()}, {out.data(), out.size()});
    return out.front();
  }
};

using Step = std::function<void()>;

struct Figures {
  double size = 0.0, rival_size = 0.0;    ///< number of bristles or cells of the bed, and of its rival
  double error = 0.0, rival_error = 0.0;  ///< errors of force and torque of both, per cent of the limits
};

/// Adds a benchmark that times a bed and its rival alternately. `make` sets the functions that step the two,
/// and returns their sizes and errors.
void add_pair(const std::string& name, const std::string& label,
              std::function<Figures(Step& ours, Step& rival)> make) {
  add_benchmark("beds/" + name, [=](benchmark::State& state) {
    Step ours, rival;
    const Figures figures = make(ours, rival);
    const auto block_of = [](const Step& step) {
      return static_cast<std::uint64_t>(std::max(1.0, 20.0 * 2e-4 / time_of(step, 20)));
    };
    const std::uint64_t our_block = block_of(ours), rival_block = block_of(rival);
    std::vector<double> our_us, their_us, ratios;
    for (auto _ : state) {
      our_us.push_back(1e6 * time_of(ours, our_block) / static_cast<double>(our_block));
      their_us.push_back(1e6 * time_of(rival, rival_block) / static_cast<double>(rival_block));
      ratios.push_back(their_us.back() / our_us.back());
    }
    state.counters["us"] = cli::quantile(our_us, 0.5);
    state.counters["rival_us"] = cli::quantile(their_us, 0.5);
    state.counters["ratio"] = cli::quantile(ratios, 0.5);
    state.counters["size"] = figures.size;
    state.counters["rival_size"] = figures.rival_size;
    state.counters["error"] = figures.error;
    state.counters["rival_error"] = figures.rival_error;
    state.SetLabel(label);
  });
}

// Benchmarks of a disc that slides and spins.

#ifdef BRISTLE_HAS_RIVALS
constexpr double disc_radius = 0.01, disc_friction = 0.7, disc_load = 3.0, disc_limit = 1e-6;

std::shared_ptr<Beds> disc_bed(int rings, int around) {
  return std::make_shared<Beds>(BedMaterial(disc_friction).with_presliding(disc_limit),
                                BedShape::disc(disc_radius, BedPressure::uniform, rings, around), disc_load);
}

/// Sets a motion of the disc, about half slide and half spin, in which its rim moves by about `path` times
/// `disc_limit`, the deflection at which bristles slide.
void move_disc(Beds& bed, double path) {
  bed.in[0].displacement[0] = 0.45 * path * disc_limit;
  bed.in[0].displacement[1] = 0.2 * path * disc_limit;
  bed.in[0].spin = 0.5 * path * disc_limit / disc_radius;
}

void register_discs() {
  add_pair("disc/147/over/lugre_21_euler", "the limit surface, slide and spin", [](Step& ours, Step& rival) {
    rivals::Surface surface;
    surface.kinetic_coefficient = surface.static_coefficient = disc_friction;
    surface.stiffness = disc_friction * disc_load / disc_limit;
    surface.damping = surface.viscous_friction = 0.0;
    const auto make_grid = [=] {
      return std::make_shared<rivals::LuGreGrid>(surface, rivals::disc_cells(21, disc_radius),
                                                 rivals::LuGreGrid::StepRule::euler);
    };
    Figures figures;
    for (const double eps : {0.0, 0.1, 0.4, 0.75, 1.0, 1.2, 2.0, 5.0}) {
      const rivals::DiscFriction limit = rivals::coulomb_disc(eps);
      auto bed = disc_bed(7, 21);
      auto grid = make_grid();
      BedMotion& m = bed->in[0];
      const double direction = 0.37;
      m.displacement[0] = 0.3 * disc_limit * eps / (1.0 + eps) * std::cos(direction);
      m.displacement[1] = 0.3 * disc_limit * eps / (1.0 + eps) * std::sin(direction);
      m.spin = 0.3 * disc_limit / (1.0 + eps) / disc_radius;
      rivals::SpinForce theirs;
      for (int i = 0; i < 400; ++i) {
        bed->step();
        theirs = grid->step({m.displacement[0], m.displacement[1]}, m.spin, tick, disc_load);
      }
      const double force = disc_friction * disc_load;
      const auto worst = [&](double x, double y, double torque) {
        return 100.0 * std::max(std::abs(std::hypot(x, y) / force - limit.force),
                                std::abs(std::abs(torque) / (force * disc_radius) - limit.torque));
      };
      figures.error =
          std::max(figures.error, worst(bed->out[0].force[0], bed->out[0].force[1], bed->out[0].torque));
      figures.rival_error =
          std::max(figures.rival_error, worst(theirs.end.force.x, theirs.end.force.y, theirs.end.torque));
    }
    auto bed = disc_bed(7, 21);
    auto grid = make_grid();
    move_disc(*bed, 0.3);
    figures.size = 147.0;
    figures.rival_size = static_cast<double>(grid->cells());
    ours = [=] { benchmark::DoNotOptimize(bed->step().torque); };
    const BedMotion m = bed->in[0];
    rival = [=] {
      benchmark::DoNotOptimize(
          grid->step({m.displacement[0], m.displacement[1]}, m.spin, tick, disc_load).end.torque);
    };
    return figures;
  });
}
#endif

// Benchmarks of a rolling ellipse, beside the loop FASTSIM.

constexpr double ellipse_a = 8e-3, ellipse_b = 4e-3, ellipse_load = 82e3, ellipse_friction = 0.3;
constexpr double ellipse_flexibility[3] = {4.937e-14, 5.152e-14, 4.090e-14};
/// Converged force and moment of a rolling ellipse over their limits (tests/data/ellipse_steady.csv), at
/// creep y -6.25e-4 and spin 0.625 /m.
constexpr double ellipse_fy = -0.64179, ellipse_mz = -0.27112;

double ellipse_error(double fy, double mz) {
  const double limit = ellipse_friction * ellipse_load;
  return 100.0 * std::max(std::abs(fy / limit - ellipse_fy),
                          std::abs(mz / (limit * std::sqrt(ellipse_a * ellipse_b)) - ellipse_mz));
}

void register_ellipses() {
  for (const int n : {24, 200, 800})
    add_pair(
        "ellipse/24x16/over/fastsim_" + std::to_string(n),
        "steady rolling: a step of 1/32 contact length, a solution", [=](Step& ours, Step& rival) {
          auto bed = std::make_shared<Beds>(
              BedMaterial(ellipse_friction)
                  .with_flexibility(ellipse_flexibility[0], ellipse_flexibility[1], ellipse_flexibility[2]),
              BedShape::ellipse(ellipse_a, ellipse_b, BedPressure::parabolic).rolling(24, 16), ellipse_load);
          const double step = ellipse_a / 16.0;
          bed->in[0].displacement[1] = -6.25e-4 * step;
          bed->in[0].spin = 0.625 * step;
          bed->in[0].rolled[0] = step;
          for (int i = 0; i < 100; ++i) bed->step();
          auto solver = std::make_shared<bristle::plain::Fastsim>(
              n, n, ellipse_a, ellipse_b, ellipse_flexibility, ellipse_friction, ellipse_load);
          const bristle::plain::Wrench w = solver->solve(0.0, -6.25e-4, 0.625);
          ours = [=] { benchmark::DoNotOptimize(bed->step().torque); };
          rival = [=] { benchmark::DoNotOptimize(solver->solve(0.0, -6.25e-4, 0.625).torque); };
          return Figures{384.0, 1.0 * n * n, ellipse_error(bed->out[0].force[1], bed->out[0].torque),
                         ellipse_error(w.force[1], w.torque)};
        });
}

// Benchmarks of beds of rows in a batch: spheres that are slid, wheels that roll.

void register_rows() {
  struct Row {
    const char* name;
    BedShape shape;
    double rolled;
  };
  for (const Row& row :
       {Row{"slide_32", BedShape::sphere_row(32, 1e-3), 0.0}, Row{"roll_32", BedShape::wheel_row(0.1), 5e-3}})
    add_benchmark(std::string("beds/row/") + row.name, [row](benchmark::State& state) {
      constexpr std::size_t rows = 1000;
      Beds beds(BedMaterial(0.8).with_presliding(1e-3), row.shape, 10.0, rows);
      for (BedMotion& m : beds.in) {
        m.displacement[0] = 1e-5;
        m.displacement[1] = 2e-5;
        m.rolled[0] = row.rolled;
      }
      for (int i = 0; i < 100; ++i) beds.step();
      measure(state, 32 * rows, 0.0, [&] { benchmark::DoNotOptimize(beds.step().force[0]); });
      state.SetLabel("1,000 rows of 32 in a batch, one thread");
    });
}

}  // namespace

void register_beds() {
  if (!bristle::plain::plain_loops_run_here()) return;
#ifdef BRISTLE_HAS_RIVALS
  register_discs();
#endif
  register_ellipses();
  register_rows();
}

}  // namespace bristle_bench
