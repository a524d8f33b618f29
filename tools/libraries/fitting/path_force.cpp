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
constexpr double far_slide = 3000.0;    // slide before a record by the rule slide, in presliding lengths
constexpr std::size_t most_made = 8;
constexpr double same_load = 0.05;  // relative change of load below which a slide goes on being steady
// Mean step, in presliding lengths, beyond which a path does not show the course of presliding, so that less
// accuracy suffices.
constexpr double far_step = 2.0;
constexpr double constant_load = 0.01;  // relative change below which a load counts as constant

/// Path along which a brush must slide in one direction until its friction is steady to 0.3 %, as the renewal
/// equation of a lognormal law gives it.
struct SteadyPath {
  double after_reversal;  ///< after a reversal out of steady sliding
  double anyway;          ///< after first loading, or from any other state
};
/// Returns the paths in presliding lengths. Bristles of nearly equal lengths (small spread s) snap together
/// along many lengths; under a large spread the longest bristles decide. Only the rule redraw needs them.
SteadyPath steady_path(const BrushShape& shape) {
  const double s = std::max(shape.spread, 0.05), longest = 36.0 * s * s * s;
  return {4.0 + 0.08 / (s * s) + longest, 4.0 + 0.27 / (s * s) + longest};
}

/// Returns whether the path goes on in one direction, under the load of the point `at`, from the point before
/// it for at least this distance.
bool goes_on(const std::vector<PathPoint>& path, std::size_t at, double distance) {
  double gone = 0.0;
  for (std::size_t i = at; i < path.size() && !path[i].begins && std::fabs(gone) <= distance; ++i) {
    const double dx = path[i].x - path[i - 1].x;
    if (dx * gone < 0.0 || std::fabs(path[i].load - path[at].load) > constant_load * path[at].load)
      return false;
    gone += dx;
  }
  return std::fabs(gone) > distance;
}

/// Returns the accuracy of a brush: by the rule redraw the pieces of path per mean snap length, by the rule
/// slide the strata. `far`: whether the brush takes far steps.
double accuracy_of(const BrushShape& shape, Detail detail, bool far) {
  if (shape.rule == SnapRule::slide) return detail == Detail::search ? 32.0 : 64.0;
  if (far) return 4.0;
  return detail == Detail::search ? 6.0 : detail == Detail::refine ? 8.0 : 16.0;
}

/// How the friction at a point of a path is found.
enum class Way : unsigned char {
  step,           ///< the brush is stepped
  slides,         ///< the brush slides steadily, and its friction is known
  after_reversal  ///< as in every stroke between two steady slides under one load
};
struct PlannedPoint {
  Way way = Way::step;
  double slid = 0.0;  // signed path since the last reversal or change of load, m
  // Steady slide that the brush is stepped by first (m, signed; 0: none), and its load (N).
  double slide_first = 0.0, slide_load = 0.0;
};

/// Plans how friction is found along a path on one axis. `steady` in m.
std::vector<PlannedPoint> plan(const std::vector<PathPoint>& path, const Past& past,
                               const SteadyPath& steady) {
  std::vector<PlannedPoint> points(path.size());
  double slid = 0.0, load = 0.0;
  Way way = Way::step;
  std::size_t part = 0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const bool begins = i == 0 || path[i].begins;
    const double dx = begins ? 0.0 : path[i].x - path[i - 1].x;
    const bool reverses = dx * slid<0.0, other_load = std::fabs(path[i].load - load)> same_load * load;
    if (begins) {
      const StartState start = past.of_part(i == 0 ? 0 : ++part);
      slid = start == StartState::straight  ? 0.0
             : start == StartState::forward ? 2.0 * steady.anyway
                                            : -2.0 * steady.anyway;
      load = path[i].load;
      way = Way::step;
    } else if (reverses || other_load) {
      const bool slides = way == Way::slides;
      way = slides && reverses && !other_load && goes_on(path, i, steady.after_reversal) ? Way::after_reversal
                                                                                         : Way::step;
      if (slides && way == Way::step) {
        points[i].slide_first = std::copysign(steady.anyway, slid);
        points[i].slide_load = load;
      }
      slid = 0.0;
      load = path[i].load;
    }
    slid += dx;
    const double enough = way == Way::after_reversal ? steady.after_reversal : steady.anyway;
    if (way == Way::slides || std::fabs(slid) > enough) {
      way = Way::slides;
      load = path[i].load;
    }
    points[i].way = way;
    points[i].slid = slid;
  }
  return points;
}

/// Returns the mean move (m) between points to which the brush is stepped.
double mean_step(const std::vector<PathPoint>& path, const std::vector<PlannedPoint>& points) {
  double travel = 0.0, steps = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    if (points[i].way != Way::step || path[i].begins) continue;
    travel += std::hypot(path[i].x - path[i - 1].x, path[i].y - path[i - 1].y);
    steps += 1.0;
  }
  return travel / std::max(steps, 1.0);
}

}  // namespace

Move slide_before(const std::vector<PathPoint>& path, std::size_t first, unsigned axes, StartState start,
                  double distance) {
  if (start == StartState::straight) return {0.0, 0.0};
  if (start == StartState::backward) distance = -distance;
  if (axes == 1) return {distance, 0.0};
  std::size_t end = first + 1;
  while (end < path.size() && !path[end].begins) ++end;
  const auto way = [&](std::size_t i) { return Move{path[i].x - path[first].x, path[i].y - path[first].y}; };
  const auto far = [&](std::size_t i) { return std::hypot(way(i).x, way(i).y); };
  double range = 0.0;
  for (std::size_t i = first; i < end; ++i) range = std::max(range, far(i));
  for (std::size_t i = first; i < end; ++i)
    if (far(i) > 0.01 * range) return {distance * way(i).x / far(i), distance * way(i).y / far(i)};
  return {distance, 0.0};
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
  double accuracy;   // accuracy_of
  double most_load;  // N
  bristle::Material material;
  bristle::PatchBatch batch;
  bristle::PatchId patch;

  Brush(const BrushShape& s, double its_accuracy, unsigned axes, double load)
      : shape(s), accuracy(its_accuracy), most_load(load), material(s.material(unit_length)) {
    bristle::PatchOptions options;
    options.with_axes(static_cast<int>(axes)).with_max_normal_load(most_load);
    if (s.rule == SnapRule::slide)
      options.with_bristles(static_cast<std::uint32_t>(accuracy));
    else
      // Takes double precision, because the search compares forces of parameters that hardly differ.
      options.with_population(bristle::Population::infinite)
          .with_precision(BRISTLE_WITH_DOUBLE ? bristle::Precision::double_ : bristle::Precision::single)
          .with_resolution(accuracy);
    patch = batch.add(material, options);
    batch.warm_up();
  }

  /// Returns the friction over that in steady sliding, along the motion, after a path (m) since a reversal
  /// out of steady sliding. The first call computes it up to the next steady slide, by steps, and leaves
  /// the brush in another state.
  double after_reversal(double path, const SteadyPath& steady) {
    const double step_length = std::clamp(0.1 * shape.spread, 0.01, 0.05) * unit_length;
    if (reversed_.empty()) {
      const double sliding = material.kinetic_coefficient() * most_load;
      step(-steady.anyway * unit_length, 0.0, most_load, 0.0);
      reversed_.push_back(-1.0);
      while (static_cast<double>(reversed_.size() - 1) * step_length <= steady.after_reversal * unit_length)
        reversed_.push_back(step(step_length, 0.0, most_load, 0.0).x / sliding);
    }
    const double place = path / step_length;
    const std::size_t i = std::min(static_cast<std::size_t>(place), reversed_.size() - 2);
    return std::lerp(reversed_[i], reversed_[i + 1], place - static_cast<double>(i));
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

 private:
  std::vector<double> reversed_;  // friction in steps of path after a reversal; empty: not computed yet
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

PathForce::Brush& PathForce::brush_of(const BrushShape& shape, double accuracy) {
  const auto found = std::find_if(made_.begin(), made_.end(), [&](const auto& brush) {
    return brush->shape == shape && brush->accuracy == accuracy;
  });
  if (found != made_.end()) {
    made_.splice(made_.begin(), made_, found);
    made_.front()->batch.reset(made_.front()->patch);
  } else {
    if (made_.size() == most_made) made_.pop_back();
    made_.push_front(std::make_unique<Brush>(shape, accuracy, axes_, most_load_));
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
  const double scale = lever * unit_length / length;  // path of the brush over that of the record
  const bool planned_ahead = axes_ == 1 && shape.rule == SnapRule::redraw;
  const SteadyPath steady = steady_path(shape);
  const double unit = length / lever;
  const std::vector<PlannedPoint> points =
      planned_ahead ? plan(path_, past, {steady.after_reversal * unit, steady.anyway * unit})
                    : std::vector<PlannedPoint>(path_.size());
  const bool far = mean_step(path_, points) > far_step * unit;
  Brush& brush = brush_of(shape, accuracy_of(shape, detail, far));
  const double kinetic = brush.material.kinetic_coefficient();
  std::vector<double> forces, across;
  forces.reserve(axes_ * path_.size());
  const double far_before = (shape.rule == SnapRule::redraw ? steady.anyway : far_slide) * unit_length;
  std::size_t part = 0;
  PathPoint at = path_.front();
  for (std::size_t i = 0; i < path_.size(); ++i) {
    const PathPoint& point = path_[i];
    const PlannedPoint& planned = points[i];
    if (i == 0 || point.begins) {
      const StartState start = past.of_part(i == 0 ? 0 : ++part);
      brush.batch.reset(brush.patch);
      if (start != StartState::straight && !planned_ahead) {
        const Move slide = slide_before(path_, i, axes_, start, far_before);
        brush.step(slide.x, slide.y, point.load, 0.0);
      }
      at = point;
    }
    if (planned.slide_first != 0.0) brush.step(planned.slide_first * scale, 0.0, planned.slide_load, 0.0);
    const double slid = planned.slid * scale;
    Brush::Force force{};
    if (planned.way == Way::step)
      force = brush.step((point.x - at.x) * scale, (point.y - at.y) * scale, point.load, point.t - at.t);
    else
      force.x = std::copysign(kinetic * point.load, slid);
    if (planned.way == Way::after_reversal) force.x *= brush.after_reversal(std::fabs(slid), steady);
    at = point;
    if (!point.wanted && !everywhere) continue;
    forces.push_back(force.x / kinetic);
    if (axes_ == 2) across.push_back(force.y / kinetic);
  }
  forces.insert(forces.end(), across.begin(), across.end());
  return forces;
}

}  // namespace cli
