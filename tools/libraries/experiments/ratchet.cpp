// Experiment: friction that depends on direction, and the drift of a block that is shaken to and fro.
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>

#include <bristle/patch_batch.hpp>

#include "tools/libraries/experiments/experiment.hpp"
#include "tools/libraries/rivals/cones.hpp"

namespace cli {
namespace {

using rivals::Pair;

/// Ground under a block, as a function from a displacement (m) to the friction force on the block (N).
/// `keeps` says whether the step is made or only tried.
using Ground = std::function<Pair(Pair displacement, bool keeps)>;

Ground make_ground(const std::string& model, const Settings& s) {
  const double friction = s.number("friction"), ratio = s.number("limit_ratio"), load = s.number("load");
  const double dt = s.number("dt");
  rivals::Cone cone;
  cone.coefficient = {friction, ratio * friction};
  cone.creep_velocity = s.number("creep_velocity");
  if (model == "ellipse")
    return [=](Pair d, bool) { return rivals::EllipticCone{cone}.step(d, dt, load).end; };
  if (model == "scaled") return [=](Pair d, bool) { return rivals::ScaledCone{cone}.step(d, dt, load).end; };
  bristle::Coefficients law;
  law.rule = bristle::SnapRule::slide;
  law.kinetic = law.peak = friction;
  law.presliding_length = s.number("presliding");
  bristle::Lay lay = bristle::Lay{}.with_limit_ratio(ratio);
  if (model == "nap") lay.with_to_over_fro(s.number("to_over_fro"));
  const auto batch = std::make_shared<bristle::PatchBatch>();
  bristle::Motion m;
  m.id =
      batch->add(bristle::Material::from_coefficients(law), bristle::PatchOptions{}
                                                                .with_max_normal_load(load)
                                                                .with_precision(bristle::Precision::double_)
                                                                .with_lay(lay));
  m.normal_load = load;
  return [=](Pair d, bool keeps) mutable {
    m.displacement[0] = d.x;
    m.displacement[1] = d.y;
    const auto r = take(*batch, m, keeps, dt);
    return Pair{r.end[0], r.end[1]};
  };
}

/// Returns friction force over load in steady sliding at an angle (rad) to the lay, the direction of the
/// surface's grain.
Pair slide(const std::string& model, const Settings& s, double angle) {
  const Ground ground = make_ground(model, s);
  const double far = 100.0 * s.number("presliding");
  const Pair friction = ground({far * std::cos(angle), far * std::sin(angle)}, true);
  return (-1.0 / s.number("load")) * friction;
}

void find_limits(ExperimentRun& run) {
  constexpr int angles = 180;
  Pair limit[angles];
  double least = 1.0;
  for (int k = 0; k < angles; ++k) {
    const double angle = 2.0 * M_PI * k / angles;
    limit[k] = slide(run.model, run.settings, angle);
    run.add("limit", {360.0 * k / angles, limit[k].x, limit[k].y});
  }
  for (int k = 0; k < angles; ++k) {
    const Pair e{std::cos(2.0 * M_PI * k / angles), std::sin(2.0 * M_PI * k / angles)};
    double most = 0.0;
    for (const Pair& other : limit) most = std::max(most, dot(other, e));
    least = std::min(least, dot(limit[k], e) / most);
  }
  run.add("dissipates_most", least, least > 0.999);
  const double ratio = limit[0].x / -limit[angles / 2].x;
  run.add("to_and_fro", ratio, std::fabs(ratio / run.number("to_over_fro") - 1.0) < 0.01);
}

/// Block on the ground that is free to move along the lay (the direction of the surface's grain). Its
/// equation of motion is solved implicitly.
struct Block {
  Ground ground;
  double mass, dt, most;  ///< mass of the block (kg), time step (s), upper bound of friction (N)
  double x = 0.0, v = 0.0;

  void step(double pull) {
    double low = v + dt * (pull - most) / mass, high = v + dt * (pull + most) / mass;
    for (int k = 0; k < 60; ++k) {
      const double middle = 0.5 * (low + high);
      const double next = v + dt * (pull + ground({dt * middle, 0.0}, false).x) / mass;
      (next > middle ? low : high) = middle;
    }
    v = 0.5 * (low + high);
    ground({dt * v, 0.0}, true);
    x += dt * v;
  }
};

Block make_block(const std::string& model, const Settings& s) {
  const double load = s.number("load");
  return {make_ground(model, s), load / 9.81, s.number("dt"), 2.0 * s.number("friction") * load};
}

void shake(ExperimentRun& run) {
  const double force = run.number("shaken") * run.number("friction") * run.number("load");
  const long per_cycle = std::max(1L, std::lround(1.0 / (run.number("frequency") * run.number("dt"))));
  const auto cycles = std::lround(run.number("cycles"));
  Block block = make_block(run.model, run.settings);
  double begin = 0.0;
  for (long k = 0; k <= (cycles + 1) * per_cycle; ++k) {
    if (k == per_cycle) begin = block.x;  // measures drift from the second cycle on: the first starts at rest
    const double phase = 2.0 * M_PI * static_cast<double>(k % per_cycle) / static_cast<double>(per_cycle);
    block.step(force * std::cos(phase));
    if (k % std::max(1L, per_cycle / 50) == 0)
      run.add("shaken", {static_cast<double>(k) * run.number("dt"), std::cos(phase), 1e3 * block.x});
  }
  const double drift = (block.x - begin) / static_cast<double>(cycles);
  run.add("ratchet", 1e3 * drift, drift < -0.1 * run.number("presliding"));
}

void hold(ExperimentRun& run) {
  Block block = make_block(run.model, run.settings);
  const double force = run.number("held") * run.number("friction") * run.number("load");
  const auto steps = std::lround(1.0 / run.number("dt"));
  double begin = 0.0;
  for (long k = 0; k < 2 * steps; ++k) {
    if (k == steps) begin = block.x;
    block.step(force * std::min(1.0, 2.0 * static_cast<double>(k) / static_cast<double>(steps)));
  }
  const double creep = 1e9 * (block.x - begin);
  run.add("holds_on_nap", creep, std::fabs(creep) < 1.0);
}

void run_ratchet(ExperimentRun& run) {
  find_limits(run);
  run.progress(0.3);
  shake(run);
  run.progress(0.8);
  hold(run);
}

}  // namespace

Experiment ratchet_experiment() {
  return {
      "ratchet",
      "a block on velvet: friction that depends on the direction, and a block that is shaken",
      {number_parameter("load", 2.5, "N", "normal load, the weight of the block", 1e-6, 1e6),
       number_parameter("friction", 0.4, "", "coefficient along the lay, the mean of to and fro", 1e-3, 10.0),
       number_parameter("limit_ratio", 0.4, "", "limit across over along", 0.01, 100.0),
       number_parameter("to_over_fro", 3.0, "", "limit with the lay over against it: nap", 0.01, 100.0),
       number_parameter("presliding", 20e-6, "m", "presliding length: brush, nap", 1e-9, 1.0),
       number_parameter("creep_velocity", 1e-5, "m/s", "full friction from this speed on: cones", 1e-9, 1.0),
       number_parameter("shaken", 0.9, "", "force of the shaking over friction along", 0.0, 2.0),
       number_parameter("frequency", 10.0, "1/s", "of the shaking", 1e-3, 1e3),
       whole_parameter("cycles", 20, "cycles of the shaking", 1, 1e5),
       number_parameter("held", 0.25, "", "steady force over friction along", 0.0, 2.0),
       number_parameter("dt", 5e-4, "s", "time step", 1e-6, 1e-2)},
      {{"dissipates_most", "it resists with the most power within its limits",
        "the force of a limit curve whose normal is the slip (Goyal, Ruina, Papadopoulos, Wear 143, 1991)",
        "least power of steady sliding over the highest of its own limits, all directions", "",
        "above 0.999"},
       {"to_and_fro", "with the nap and against it",
        "belly scales of snakes hold 1.3 times as much backwards as forwards (Hu et al., PNAS 106, 2009); "
        "hair and climbing skins more",
        "friction with the lay over friction against it", "", "within 1 % of to_over_fro"},
       {"ratchet", "a block that is shaken walks",
        "a force of mean 0 moves a body the way that resists less, as snakes and ears of grass creep",
        "way per cycle along the lay", "mm", "a tenth of the presliding length or more, against the lay"},
       {"holds_on_nap", "it rests under a steady force",
        "below its limit a contact does not creep (Dupont et al. 2002)",
        "creep in 1 s under a quarter of the friction along", "nm", "below 1 nm"}},
      {"angle[deg]_or_t[s]", "along_over_load_or_force", "across_over_load_or_x[mm]"},
      &run_ratchet,
      {{"ellipse", "MuJoCo cone"},
       {"scaled", "Bullet cone"},
       {"brush", "brush, elliptic"},
       {"nap", "brush, to and fro"}}};
}

}  // namespace cli
