#include "tools/fitting/path_force.hpp"

#include <algorithm>

#include <bristle/patch_batch.hpp>

#include "tools/scene/snap_law.hpp"

namespace cli {
namespace {

using bristle::SnapRule;

/// The brush is computed at this length and the path scaled to it, so that one material serves all lengths.
constexpr double unit_length = 1e-5;  // m
/// Longer than any law remembers (core/patches/COHORTS.md: 1,260 lengths at a spread of 2).
constexpr double long_slide = 3000.0;  // presliding lengths
constexpr std::size_t most_made = 8;

}  // namespace

bristle::Material BrushShape::material(double length) const {
  bristle::Material m;
  const double share = rule == SnapRule::keep ? 0.0 : residual_share;
  m.bristle_stiffness = 1.0;
  m.asperity_height_deviation = 1e-6;
  m.normal_stiffness = 1e6;
  m.snap_length = make_snap_length(law, (1.0 - share) * length, spread);
  m.snap_rule = rule;
  m.residual_length = share * length;
  m.shared_renewal = rule == SnapRule::keep ? 0.0 : shared_renewal;
  return m;
}

/// A batch of one patch.
struct PathForce::Infinite {
  BrushShape shape;
  Detail detail;
  double kinetic;
  bristle::PatchBatch batch;
  bristle::PatchId patch;

  Infinite(const BrushShape& s, Detail d, double most_load) : shape(s), detail(d) {
    const bristle::Material material = shape.material(unit_length);
    kinetic = material.kinetic_coefficient();
    patch = batch.add(material, bristle::PatchOptions{}
                                    .with_axes(1)
                                    .with_max_normal_load(most_load)
                                    .with_population(bristle::Population::infinite)
                                    .with_resolution(d == Detail::search ? 8.0 : 16.0)
                                    .with_cohorts(d == Detail::search ? 96 : 256));
    batch.warm_up();
  }

  /// Friction by the body after a step, N, for a kinetic coefficient of 1.
  double step(double displacement, double load) {
    bristle::Motion motion;
    motion.id = patch;
    motion.displacement[0] = displacement;
    motion.normal_load = load;
    bristle::Response response;
    batch.step(1.0, {&motion, 1}, {&response, 1});
    return -response.elastic[0] / kinetic;
  }
};

PathForce::PathForce(const std::vector<PathPoint>& path) : path_(path) {
  for (const PathPoint& point : path) most_load_ = std::max(most_load_, point.load);
}
PathForce::~PathForce() = default;

PathForce::Infinite& PathForce::infinite(const BrushShape& shape, Detail detail) {
  const auto found = std::find_if(made_.begin(), made_.end(), [&](const auto& brush) {
    return brush->shape == shape && brush->detail == detail;
  });
  if (found != made_.end()) {
    made_.splice(made_.begin(), made_, found);
    made_.front()->batch.reset(made_.front()->patch);
  } else {
    if (made_.size() == most_made) made_.pop_back();
    made_.push_front(std::make_unique<Infinite>(shape, detail, most_load_));
  }
  return *made_.front();
}

std::vector<double> PathForce::find(const BrushShape& shape, double length, Past past, Detail detail) {
  if (shape.rule == SnapRule::keep) return kept_force(path_, shape, length, past, detail);
  Infinite& brush = infinite(shape, detail);
  if (past.start != StartState::straight) {
    const double way = past.start == StartState::forward ? long_slide : -long_slide;
    brush.step(way * unit_length, path_.front().load);
  }
  std::vector<double> forces;
  forces.reserve(path_.size());
  double x = path_.front().x;
  for (const PathPoint& point : path_) {
    const double force = brush.step((point.x - x) * (unit_length / length), point.load);
    x = point.x;
    if (point.wanted) forces.push_back(force);
  }
  return forces;
}

}  // namespace cli
