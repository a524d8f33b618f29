#include "tools/libraries/fitting/path_force.hpp"

#include <algorithm>
#include <cmath>

#include <bristle/outline.hpp>
#include <bristle/patch_batch.hpp>

#include "tools/libraries/scene/snap_law.hpp"

namespace cli {
namespace {

using bristle::SnapRule;

/// Presliding length (m) of every computed brush. The path is scaled to it instead, so that one material
/// serves all presliding lengths.
constexpr double unit_length = 1e-5;  // m

constexpr double shortest_step = 1e-9;  // shortest duration of a step, s
constexpr std::size_t most_made = 8;
constexpr double same_load = 0.05;  // relative change of load below which a slide goes on being steady

/// Returns the path, in presliding lengths, along which a brush must slide in one direction until its
/// friction is steady to 1e-3. Of a slide before a record no more than this path need be computed. Bristles
/// of nearly equal lengths (small spread s) snap together along some 0.4 / s^2 lengths; under a large spread
/// the longest bristles decide.
double steady_path(const BrushShape& shape) {
  const double s = std::max(shape.spread, 0.05);
  return shape.rule == SnapRule::redraw ? 10.0 + 0.4 / (s * s) + 20.0 * s * s * s : 1e300;
}

}  // namespace

Direction first_direction(const std::vector<PathPoint>& path, unsigned axes) {
  if (axes == 1) return {1.0, 0.0};
  double range = 0.0;
  for (const PathPoint& p : path)
    range = std::max(range, std::hypot(p.x - path.front().x, p.y - path.front().y));
  for (const PathPoint& p : path) {
    const double x = p.x - path.front().x, y = p.y - path.front().y, distance = std::hypot(x, y);
    if (distance > 0.01 * range) return {x / distance, y / distance};
  }
  return {1.0, 0.0};
}

bristle::Material BrushShape::material(double length) const {
  bristle::Material m;
  const bool redraws = rule == SnapRule::redraw;
  const double share = redraws ? residual_share : 0.0;
  m.bristle_stiffness = 1.0;
  m.asperity_height_deviation = 1e-6;
  m.normal_stiffness = 1e6;
  const double mean = (1.0 - share) * length;
  if (law == bristle::SnapLaw::table) {
    std::vector<double> lengths = quantiles;
    for (double& l : lengths) l *= mean;
    m.snap_length = bristle::SnapLength::table({lengths.data(), lengths.size()});
  } else {
    m.snap_length = make_snap_length(law, mean, spread);
  }
  m.snap_rule = rule;
  m.residual_length = std::min(share * length, bristle::largest_residual * mean);
  m.shared_renewal = redraws ? shared_renewal : 0.0;
  return m;
}

/// Brush whose force is computed along a path: a single patch in a batch of its own.
struct PathForce::Brush {
  BrushShape shape;
  Detail detail;
  bristle::Material material;
  bristle::PatchBatch batch;
  bristle::PatchId patch;

  Brush(const BrushShape& s, Detail d, unsigned axes, double most_load)
      : shape(s), detail(d), material(s.material(unit_length)) {
    bristle::PatchOptions options;
    options.with_axes(static_cast<int>(axes)).with_max_normal_load(most_load);
    if (s.rule == SnapRule::slide)
      options.with_bristles(d == Detail::search ? 32 : 64);
    else
      // Takes double precision, because the search compares forces of parameters that hardly differ.
      options.with_population(bristle::Population::infinite)
          .with_precision(BRISTLE_WITH_DOUBLE ? bristle::Precision::double_ : bristle::Precision::single)
          .with_resolution(d == Detail::search || d == Detail::refine ? 8.0 : 16.0);
    patch = batch.add(material, options);
    batch.warm_up();
  }

  struct Force {
    double x, y;
  };
  /// Steps the brush and returns its friction (N, by the body), for bristles of 1 N/m and one bristle per
  /// newton.
  Force step(double dx, double dy, double load, double dt) {
    bristle::Motion motion;
    motion.id = patch;
    motion.displacement[0] = dx;
    motion.displacement[1] = dy;
    motion.normal_load = load;
    bristle::Response response;
    batch.step(std::max(dt, shortest_step), {&motion, 1}, {&response, 1});
    return {-response.elastic[0], -response.elastic[1]};
  }
};

std::vector<Ring> rings_of(bool disc, Detail detail) {
  if (!disc) return {Ring{}};
  const int count = detail == Detail::search ? 4 : 8, around = 3;
  std::vector<Ring> rings;
  for (const bristle::PatchCell& cell :
       bristle::Outline::disc(1.0, bristle::Pressure::uniform, count, around).cells) {
    const double lever = std::hypot(cell.position[0], cell.position[1]);
    if (rings.empty() || lever > 1.000001 * rings.back().lever)
      rings.push_back({lever, cell.weight});
    else
      rings.back().share += cell.weight;
  }
  return rings;
}

PathForce::PathForce(const std::vector<PathPoint>& path, unsigned axes, bool disc)
    : path_(path), axes_(axes), disc_(disc) {
  for (const PathPoint& point : path) most_load_ = std::max(most_load_, point.load);
}
PathForce::~PathForce() = default;

PathForce::Brush& PathForce::brush_of(const BrushShape& shape, Detail detail) {
  const auto found = std::find_if(made_.begin(), made_.end(), [&](const auto& brush) {
    return brush->shape == shape && brush->detail == detail;
  });
  if (found != made_.end()) {
    made_.splice(made_.begin(), made_, found);
    made_.front()->batch.reset(made_.front()->patch);
  } else {
    if (made_.size() == most_made) made_.pop_back();
    made_.push_front(std::make_unique<Brush>(shape, detail, axes_, most_load_));
  }
  return *made_.front();
}

std::vector<double> PathForce::find(const BrushShape& shape, double length, const Past& past, Detail detail,
                                    bool everywhere) {
  std::vector<double> sum;
  for (const Ring& ring : rings_of(disc_, detail)) {
    const std::vector<double> forces = of_ring(ring.lever, shape, length, past, detail, everywhere);
    sum.resize(forces.size(), 0.0);
    for (std::size_t i = 0; i < forces.size(); ++i) sum[i] += ring.share * ring.lever * forces[i];
  }
  return sum;
}

std::vector<double> PathForce::of_ring(double lever, const BrushShape& shape, double length, const Past& past,
                                       Detail detail, bool everywhere) {
  Brush& brush = brush_of(shape, detail);
  const double scale = lever * unit_length / length, kinetic = brush.material.kinetic_coefficient();
  const double steady = steady_path(shape) * unit_length, slide = std::min(steady, 3000.0 * unit_length);
  std::vector<double> forces, across;
  forces.reserve(axes_ * path_.size());
  // Signed path since the last reversal or change of load. A slide on one axis that is longer than `steady`
  // is not stepped further, because its force, and the state that it leaves, are known.
  double slid = 0.0, slid_load = 0.0;
  bool skips = false;
  const auto settle = [&] {
    if (skips) brush.step(std::copysign(steady, slid), 0.0, slid_load, 0.0);
    skips = false;
  };
  const auto begin = [&](StartState start, const PathPoint& at) {
    slid = 0.0;
    slid_load = at.load;
    skips = false;
    if (start == StartState::straight) return;
    const Direction e = first_direction(path_, axes_);
    const double distance = start == StartState::forward ? slide : -slide;
    brush.step(distance * e.x, distance * e.y, at.load, 0.0);
  };
  begin(past.start, path_.front());
  PathPoint at = path_.front();
  std::size_t part = 0;
  for (const PathPoint& point : path_) {
    if (point.begins) {
      brush.batch.reset(brush.patch);
      begin(past.of_part(++part), point);
      at = point;
    }
    const double dx = (point.x - at.x) * scale, dy = (point.y - at.y) * scale;
    const bool reverses =
        dx * slid<0.0, other_load = std::fabs(point.load - slid_load)> same_load * slid_load;
    if (reverses || other_load) {
      settle();
      slid = 0.0;
      slid_load = point.load;
    }
    slid += dx;
    Brush::Force force{};
    if (axes_ == 1 && std::fabs(slid) > steady) {
      skips = true;
      slid_load = point.load;
      force.x = std::copysign(kinetic * point.load, slid);
    } else {
      force = brush.step(dx, dy, point.load, point.t - at.t);
    }
    at = point;
    if (!point.wanted && !everywhere) continue;
    forces.push_back(force.x / kinetic);
    if (axes_ == 2) across.push_back(force.y / kinetic);
  }
  forces.insert(forces.end(), across.begin(), across.end());
  return forces;
}

}  // namespace cli
