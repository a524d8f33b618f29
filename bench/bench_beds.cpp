// Compares beds with what their users have otherwise (plain_beds.hpp, tools/libraries/rivals), in one run.
//
// Each row times a bed and one alternative (its rival), stepped alternately in blocks, so that whatever slows
// the machine slows both; `ratio` is the median over the blocks of the rival's time over the bed's. `error`
// and `rival_error` are the errors of force and torque, per cent of mu N and mu N R, where a closed or
// converged answer exists.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <bristle/bed.hpp>

#include "bench/plain_beds.hpp"
#include "measured_scene.hpp"
#include "suites.hpp"
#ifdef BRISTLE_HAS_RIVALS
#include "tools/libraries/rivals/coulomb_disc.hpp"
#include "tools/libraries/rivals/lugre_grid.hpp"
#endif

namespace bristle_bench {

namespace {

using bristle::BedMaterial;
using bristle::BedMotion;
using bristle::BedPressure;
using bristle::BedResponse;
using bristle::BedShape;

/// Batch of equal beds (contacts of elastic bodies), with the motion of each.
struct Beds {
  bristle::BedBatch batch;
  std::vector<BedMotion> in;
  std::vector<BedResponse> out;

  Beds(const BedMaterial& material, const BedShape& shape, double load, std::size_t n = 1, int threads = 1,
       bool all = false)
      : batch(BatchOptions().with_threads(threads)), in(n), out(n) {
    bristle::BedOptions options;
    options.max_normal_load = load;
    options.all_outputs = all;
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

double time_of(const Step& step, int steps) {
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < steps; ++i) step();
  const std::chrono::duration<double, std::nano> elapsed = std::chrono::steady_clock::now() - start;
  return elapsed.count() / steps;
}

struct Figures {
  double size = 0.0, rival_size = 0.0;    ///< number of bristles or cells of the bed, and of its rival
  double error = 0.0, rival_error = 0.0;  ///< errors of force and torque of both, per cent of the limits
};

/// Adds a benchmark of a bed beside its rival. `make` sets the functions that step the two, and returns their
/// sizes and errors. Reported times are those of a step divided by `per`.
void add_pair(const std::string& name, const std::string& label, double per,
              std::function<Figures(Step& ours, Step& rival)> make) {
  add_benchmark("beds/" + name, [=](benchmark::State& state) {
    Step ours, rival;
    const Figures figures = make(ours, rival);
    const auto blocks_of = [](const Step& step) {
      return std::max(1, static_cast<int>(2e5 / time_of(step, 20)));
    };
    const int our_block = blocks_of(ours), rival_block = blocks_of(rival);
    std::vector<double> our_ns, their_ns, ratios;
    for (auto _ : state) {
      our_ns.push_back(time_of(ours, our_block));
      their_ns.push_back(time_of(rival, rival_block));
      ratios.push_back(their_ns.back() / our_ns.back());
    }
    state.counters["us"] = 1e-3 * median(our_ns) / per;
    state.counters["rival_us"] = 1e-3 * median(their_ns) / per;
    state.counters["ratio"] = median(ratios);
    state.counters["size"] = figures.size;
    state.counters["rival_size"] = figures.rival_size;
    state.counters["error"] = figures.error;
    state.counters["rival_error"] = figures.rival_error;
    state.SetLabel(label);
  });
}

// ---- a disc that slides and spins

constexpr double disc_radius = 0.01, disc_friction = 0.7, disc_load = 3.0, disc_limit = 1e-6;

std::shared_ptr<Beds> disc_bed(int rings, int around) {
  return std::make_shared<Beds>(BedMaterial(disc_friction).with_presliding(disc_limit),
                                BedShape::disc(disc_radius, BedPressure::uniform, rings, around), disc_load);
}

/// Sets a motion, about half slide and half spin, in which the disc's rim moves by about `way` times
/// `disc_limit`, the deflection at which bristles slide.
void move_disc(Beds& bed, double way) {
  bed.in[0].displacement[0] = 0.45 * way * disc_limit;
  bed.in[0].displacement[1] = 0.2 * way * disc_limit;
  bed.in[0].spin = 0.5 * way * disc_limit / disc_radius;
}

void register_discs() {
  struct Grid {
    int rings, around, across;
  };
  for (const Grid grid : {Grid{7, 16, 12}, Grid{14, 32, 24}, Grid{28, 64, 48}})
    for (const double way : {0.01, 0.5}) {
      const std::string cells = std::to_string(grid.rings * grid.around);
      add_pair("disc/" + cells + "/over/plain/" + (way < 0.1 ? "slow" : "fast"),
               "slide and spin; ours over the plain loop is 1 / ratio", 1.0, [=](Step& ours, Step& rival) {
                 auto bed = disc_bed(grid.rings, grid.around);
                 auto loop = std::make_shared<bristle::plain::DiscLoop>(grid.across, disc_radius, disc_limit,
                                                                        disc_friction * disc_load);
                 move_disc(*bed, way);
                 ours = [=] { benchmark::DoNotOptimize(bed->step().torque); };
                 const BedMotion m = bed->in[0];
                 rival = [=] {
                   benchmark::DoNotOptimize(loop->step(m.displacement[0], m.displacement[1], m.spin).torque);
                 };
                 for (int i = 0; i < 2000; ++i) {
                   ours();
                   rival();
                 }
                 return Figures{grid.rings * grid.around * 1.0, static_cast<double>(loop->size()), 0.0, 0.0};
               });
    }
#ifdef BRISTLE_HAS_RIVALS
  add_pair(
      "disc/147/over/lugre_21_euler", "the limit surface, slide and spin", 1.0, [](Step& ours, Step& rival) {
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
#endif
}

// ---- a rolling ellipse beside FASTSIM

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
        "steady rolling: a step of 1/32 contact length, a solution", 1.0, [=](Step& ours, Step& rival) {
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

// ---- beds of rows (rolling wheels) in batches, and contacts of grains

/// Contacts between grains (granular matter), moved and loaded at random in every step.
struct Grains {
  static constexpr std::size_t n = 10000;
  static constexpr double friction = 0.5, radius = 1e-4, load = 1.0, presliding = 1e-6;
  Beds beds;
  bristle::plain::HistorySprings springs;
  std::vector<float> dx, dy, loads, fx, fy;
  std::mt19937 random{1};

  explicit Grains(bool all)
      : beds(BedMaterial(friction).with_presliding(presliding), BedShape::sphere_row(16, radius), load, n, 2,
             all),
        springs(n, friction, 1.5 * friction * load / presliding, load),
        dx(n),
        dy(n),
        loads(n, static_cast<float>(load)),
        fx(n),
        fy(n) {}
  void draw(bool load_changes) {
    std::uniform_real_distribution<float> uniform(-1.0f, 1.0f);
    for (std::size_t i = 0; i < n; ++i) {
      BedMotion& m = beds.in[i];
      dx[i] = 2e-7f * uniform(random);
      dy[i] = 2e-7f * uniform(random);
      if (load_changes) loads[i] = 0.5f + 0.45f * uniform(random);
      m.displacement[0] = static_cast<double>(dx[i]);
      m.displacement[1] = static_cast<double>(dy[i]);
      m.normal_load = static_cast<double>(loads[i]);
    }
  }
  void step_springs() { springs.step(dx.data(), dy.data(), loads.data(), fx.data(), fy.data()); }
};

/// Finds the energy that a contact gives out beyond what it took in, per cent of the latter. In each
/// cycle the tangential spring is bent under a large load and released under a small one, at which it is
/// softer.
void energy_made(Figures& figures) {
  const auto cycle = [](const std::function<double(double, double)>& force) {
    double given = 0.0, taken = 0.0, before = 0.0;
    const auto move = [&](double d, double load) {
      const double after = force(d, load), work = -0.5 * (before + after) * d;
      (work > 0.0 ? taken : given) += std::abs(work);
      before = after;
    };
    for (int i = 0; i < 50; ++i) {
      for (int k = 0; k < 40; ++k) move(2.5e-9, 1.0);
      move(0.0, 0.2);
      for (int k = 0; k < 40; ++k) move(-2.5e-9 * std::cbrt(5.0), 0.2);
      move(0.0, 1.0);
    }
    return 100.0 * std::max(0.0, given - taken) / taken;
  };
  Beds bed(BedMaterial(Grains::friction).with_presliding(Grains::presliding),
           BedShape::sphere_row(16, Grains::radius), Grains::load);
  figures.error = cycle([&](double d, double load) {
    bed.in[0].displacement[0] = d;
    bed.in[0].normal_load = load;
    return bed.step().force[0];
  });
  bristle::plain::HistorySprings spring(
      1, Grains::friction, 1.5 * Grains::friction * Grains::load / Grains::presliding, Grains::load);
  figures.rival_error = cycle([&](double d, double load) {
    const float x = static_cast<float>(d), y = 0.0f, n = static_cast<float>(load);
    float fx = 0.0f, fy = 0.0f;
    spring.step(&x, &y, &n, &fx, &fy);
    return static_cast<double>(fx);
  });
}

void register_grains() {
  for (const bool load_changes : {false, true})
    add_pair(std::string("grains/10000x16/over/spring/") + (load_changes ? "load_changes" : "load_held"),
             "10,000 grains, two threads, the spring on one; error: energy made in cycles of load", 1.0,
             [=](Step& ours, Step& rival) {
               auto grains = std::make_shared<Grains>(false);
               auto other = std::make_shared<Grains>(false);
               grains->draw(load_changes);
               other->draw(load_changes);
               for (int i = 0; i < 20; ++i) {
                 grains->beds.step();
                 other->step_springs();
                 grains->draw(load_changes);
               }
               // Prepares the loads of two alternating steps outside the timing.
               auto loads = std::make_shared<std::vector<BedMotion>>(grains->beds.in);
               if (load_changes) grains->draw(true);
               ours = [=] {
                 grains->beds.in.swap(*loads);
                 grains->beds.step();
               };
               rival = [=] {
                 other->step_springs();
                 benchmark::DoNotOptimize(other->fx.data());
               };
               Figures figures{16.0 * Grains::n, 1.0 * Grains::n, 0.0, 0.0};
               energy_made(figures);
               return figures;
             });
  struct Row {
    const char* name;
    BedShape shape;
    double rolled;
  };
  for (const Row& row :
       {Row{"slide_32", BedShape::sphere_row(32, 1e-3), 0.0}, Row{"roll_32", BedShape::wheel_row(0.1), 5e-3}})
    add_pair(std::string("row/") + row.name + "/over/spring", "1,000 rows in a batch, one thread; us a row",
             1000.0, [=](Step& ours, Step& rival) {
               auto beds =
                   std::make_shared<Beds>(BedMaterial(0.8).with_presliding(1e-3), row.shape, 10.0, 1000);
               for (BedMotion& m : beds->in) {
                 m.displacement[0] = 1e-5;
                 m.displacement[1] = 2e-5;
                 m.rolled[0] = row.rolled;
               }
               auto springs = std::make_shared<bristle::plain::HistorySprings>(1000, 0.8, 1e4, 10.0);
               auto x = std::make_shared<std::vector<float>>(1000, 1e-5f);
               auto n = std::make_shared<std::vector<float>>(1000, 10.0f);
               auto f = std::make_shared<std::vector<float>>(2000);
               ours = [=] { benchmark::DoNotOptimize(beds->step().force[0]); };
               rival = [=] {
                 springs->step(x->data(), x->data(), n->data(), f->data(), f->data() + 1000);
                 benchmark::DoNotOptimize(f->data());
               };
               for (int i = 0; i < 100; ++i) ours();
               return Figures{32.0, 1.0, 0.0, 0.0};
             });
}

}  // namespace

void register_beds() {
  if (!bristle::plain::plain_loops_run_here()) return;
  register_discs();
  register_ellipses();
  register_grains();
}

}  // namespace bristle_bench
