// Steps bristles that keep their snap lengths (SnapRule::keep) along a measured path. Lengths and phases are
// spread evenly instead of at random, so that the force is smooth in the fitted parameters.
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "tools/libraries/fitting/path_force.hpp"
#include "tools/libraries/scene/snap_law.hpp"

namespace cli {
namespace {

using bristle::SnapLength;

// Longest step, in mean snap lengths. The snaps of a step are counted in 32 bits, so longer ones are
// shortened.
constexpr double longest_way = 1e9;
// Shortest step, in mean snap lengths. Shorter ones are added up first, because single precision would round
// them away.
constexpr double shortest_way = 1e-4;

double part(double value) { return value - std::floor(value); }

/// Path, in mean snap lengths, over which a long slide in one direction makes bristles forget their phases:
/// where forgetting begins, and where it is complete.
struct Forgetting {
  double begins, ends;
  explicit Forgetting(const SnapLength& law)
      : begins(5.0 + 2.0 / law.cv()), ends(std::min(15.0 + 4.0 / law.cv(), 400.0)) {}
  /// Returns how far bristles have forgotten their phases after a slide of length `run`, smooth from 0 to 1,
  /// as a share of the shift that each bristle has in the end (below its snap length).
  double share(double run) const {
    const double u = std::clamp((run - begins) / (ends - begins), 0.0, 1.0);
    return u * u * (3.0 - 2.0 * u);
  }
};

/// Bristles that keep their snap lengths, in the order in which a rising load brings them into contact.
/// Lengths are in mean snap lengths.
class KeptBristles {
 public:
  KeptBristles(const SnapLength& law, std::size_t count, double most_load)
      : most_load_(most_load), forgetting_(law) {
    // Samples snap lengths and phases by additive sequences (powers of the plastic number). The first k
    // bristles then cover both evenly, whatever k is.
    for (std::size_t i = 0; i < count; ++i) {
      const double k = static_cast<double>(i) + 0.5;
      length_.push_back(static_cast<float>(law.quantile(part(0.7548776662466927 * k)) / law.mean()));
      per_length_.push_back(1.0f / length_.back());
      own_way_.push_back(static_cast<float>(part(0.5698402909980532 * k)) * length_.back());
    }
    bent_.assign(count, 0.0f);
  }

  void set_load(double load) {
    const auto all = static_cast<double>(bent_.size());
    const double now = most_load_ > 0.0 ? load / most_load_ * all : 0.0;
    for (auto i = static_cast<std::size_t>(std::ceil(active_)); static_cast<double>(i) < now; ++i)
      bent_[i] = 0.0f;
    active_ = now;
  }

  /// Sets the bristles to their state after a slide in the direction `e` (1 or -1), so long that its start is
  /// forgotten.
  void slide(double e) {
    direction_ = e;
    run_ = forgetting_.ends;
    for (std::size_t i = 0; i < bent_.size(); ++i) bent_[i] = static_cast<float>(e) * own_way_[i];
  }

  void move(double step) {
    waiting_ += step;
    if (std::fabs(waiting_) < shortest_way) return;
    const double d = waiting_;
    waiting_ = 0.0;
    const double e = d > 0.0 ? 1.0 : -1.0;
    if (e != direction_) {
      direction_ = e;
      run_ = 0.0;
    }
    const double before = run_;
    run_ += std::fabs(d);
    // Shifts phases twice as far in backward slides. Equal shifts in both directions would cancel.
    const double spread = forgetting_.share(run_) - forgetting_.share(before);
    advance(static_cast<float>(e), static_cast<float>(std::min(std::fabs(d), longest_way)),
            static_cast<float>(e > 0.0 ? spread : 2.0 * spread));
  }

  double force() const {
    double sum = 0.0;
    const auto whole = std::min(static_cast<std::size_t>(active_), bent_.size());
    float eight[8] = {};
    std::size_t i = 0;
    for (; i + 8 <= whole; i += 8)
      for (std::size_t k = 0; k < 8; ++k) eight[k] += bent_[i + k];
    for (const float part_sum : eight) sum += static_cast<double>(part_sum);
    for (; i < whole; ++i) sum += static_cast<double>(bent_[i]);
    if (whole < bent_.size())
      sum += (active_ - static_cast<double>(whole)) * static_cast<double>(bent_[whole]);
    return (sum + active_ * waiting_) * most_load_ / static_cast<double>(bent_.size());
  }

 private:
  /// Advances all bristles by the path `way`. A bristle bent against the motion does not snap before it is
  /// straight: its negative number of whole lengths is cut to 0.
  void advance(float e, float way, float spread) {
    const auto count = static_cast<std::size_t>(std::ceil(active_));
    float* bent = bent_.data();
    const float *length = length_.data(), *per_length = per_length_.data(), *own = own_way_.data();
    for (std::size_t i = 0; i < count; ++i) {
      const float to = e * bent[i] + way + spread * own[i];
      const auto snaps = static_cast<float>(static_cast<std::int32_t>(to * per_length[i]));
      bent[i] = e * (to - snaps * length[i]);
    }
  }

  double most_load_;
  Forgetting forgetting_;
  std::vector<float> length_, per_length_, own_way_, bent_;
  double active_ = 0.0, direction_ = 0.0, run_ = 0.0, waiting_ = 0.0;
};

}  // namespace

std::vector<double> kept_force(const std::vector<PathPoint>& path, const BrushShape& shape, double length,
                               const Past& past, Detail detail, bool everywhere) {
  const SnapLength law = make_snap_length(shape.law, length, shape.spread);
  double most = 0.0;
  for (const PathPoint& point : path) most = std::max(most, point.load);
  const KeptBristles fresh(law, detail == Detail::search ? 512 : 2048, most);
  KeptBristles brush = fresh;
  const auto begin = [&](StartState start, const PathPoint& at) {
    brush = fresh;
    if (start == StartState::straight) return;
    brush.set_load(at.load);
    brush.slide(start == StartState::forward ? 1.0 : -1.0);
  };
  begin(past.start, path.front());
  std::vector<double> forces;
  forces.reserve(path.size());
  double x = path.front().x;
  std::size_t part = 0;
  for (const PathPoint& point : path) {
    if (point.begins) {
      begin(past.of_part(++part), point);
      x = point.x;
    }
    brush.set_load(point.load);
    brush.move((point.x - x) / length);
    x = point.x;
    if (point.wanted || everywhere) forces.push_back(2.0 * brush.force());
  }
  return forces;
}

}  // namespace cli
