#include "tools/fitting/mean_brush.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace cli {
namespace {

using bristle::SnapLaw;
using bristle::SnapLength;
using bristle::SnapRule;

// Lengths below are in units of the mean snap length.
constexpr double negligible_mass = 1e-6;  // of a layer's load: bristles that may be left out or put elsewhere
constexpr int load_layers = 12;           // where the load varies
constexpr std::size_t population = 2048;  // of the keep rule

/// Survival and partial first moment of a law on equidistant nodes, linear in between: error below 2e-4, 2e-5
/// where most of the law lies.
class LawTable {
 public:
  explicit LawTable(const SnapLength& law) {
    const double mean = law.mean();
    per_length_ = std::clamp(std::ceil(24.0 / law.cv()), 64.0, 512.0);
    reach_ = std::min(law.longest() / mean, 64.0);
    const auto cells = static_cast<std::size_t>(reach_ * per_length_) + 2;
    nodes_.reserve(cells + 1);
    for (std::size_t i = 0; i <= cells; ++i) {
      const double x = static_cast<double>(i) / per_length_ * mean;
      nodes_.push_back({law.survival(x), law.partial_moment(1, x) / mean});
    }
    nodes_.back() = {0.0, 1.0};
  }
  struct Value {
    double survival, first;
  };
  Value at(double x) const noexcept {
    const double place = x * per_length_;
    const auto i = static_cast<std::size_t>(place);
    if (!(place < static_cast<double>(nodes_.size() - 1))) return {0.0, 1.0};
    const double share = place - static_cast<double>(i);
    const Value &a = nodes_[i], &b = nodes_[i + 1];
    return {a.survival + share * (b.survival - a.survival), a.first + share * (b.first - a.first)};
  }
  double reach() const noexcept { return reach_; }
  double step() const noexcept { return 1.0 / per_length_; }

 private:
  double per_length_, reach_;
  std::vector<Value> nodes_;
};

/// Path after which a long slide has forgotten how it began, to 1e-4: waves of the renewal equation die out
/// as exp(-2 pi^2 spread^2 x), slower where the density of the law jumps, and no bristle is older than the
/// longest length.
double forgetting_path(const SnapLength& law, double reach, double residual) {
  const double waves = law.law() == SnapLaw::uniform ? 25.0 : 9.2;
  return 2.0 * residual + std::min(reach + waves / (19.7 * law.cv() * law.cv()), 400.0);
}

/// Longest piece of path taken at once: a small part of the width of the law.
double fitting_stride(const SnapLength& law) { return std::clamp(law.cv() / 5.0, 1.0 / 64, 1.0 / 16); }

/// Bristles that snapped, were renewed or came into contact at one place. On one axis all of them are bent
/// alike, and those are left whose snap length is above the farthest they have been bent beyond the residual,
/// and that were not renewed.
struct Cohort {
  double root;    // where they are, or would be, straight
  double begin;   // where the first of them was born: a cohort spans a stride at most
  double weight;  // load that they carried when they were born, less what was renewed
  double reach;   // farthest they have been bent since, beyond the residual
  LawTable::Value at_reach;
  double snaps_seen;  // Layer::snaps_per_bristle_ up to which renewals are taken out of the weight
  double mass() const noexcept { return weight * at_reach.survival; }
};

/// Of the material, in mean snap lengths.
struct LayerLaw {
  const LawTable* law;
  double residual, renewal;
  double stride, forgetting;
};

/// A part of the brush that carries load together: bristles between two loads, the last in being the first
/// out.
class Layer {
 public:
  explicit Layer(const LayerLaw& law) : law_(law) {}

  /// Load that the layer is to carry from now on.
  void set_load(double load, double x) {
    if (load > load_) {
      if (load - load_ > 1e-3 * load) run_ = 0.0;
      add(load - load_, x, x, x, snaps_per_bristle_);
    } else if (load < load_) {
      for (Cohort& c : cohorts_) c.weight *= load / load_;
      waiting_ *= load / load_;
      if (load == 0.0) cohorts_.clear();
    }
    load_ = load;
  }

  /// Moves from x by d.
  void move(double x, double d) {
    if (d == 0.0) return;
    if (load_ == 0.0) return;
    if ((d > 0.0) != (direction_ > 0.0)) {
      direction_ = d > 0.0 ? 1.0 : -1.0;
      run_ = 0.0;
    }
    double left = std::fabs(d);
    const double explicitly = std::min(left, std::max(law_.forgetting - run_, 0.0));
    if (explicitly > 0.0) {
      const double pieces = std::ceil(explicitly / law_.stride);
      for (double i = 0.0; i < pieces; ++i) {
        slide(x + direction_ * explicitly * (i / pieces), x + direction_ * explicitly * ((i + 1.0) / pieces));
      }
      run_ += explicitly;
      left -= explicitly;
    }
    if (left > 0.0) {  // steady sliding: the brush stays as it is and is carried along
      for (Cohort& c : cohorts_) {
        c.root += direction_ * left;
        c.begin += direction_ * left;
      }
      waiting_place_ += direction_ * left;
    }
  }

  double force(double x) const noexcept {
    double sum = 0.0;
    for (const Cohort& c : cohorts_) sum += c.mass() * (x - c.root);
    return sum;
  }

 private:
  double reach_at(const Cohort& c, double x) const noexcept {
    return std::max(std::fabs(x - c.root) - law_.residual, c.reach);
  }
  /// Share of the piece that ends at x1 in which the cohort is bent along the motion beyond the residual.
  double exposed(const Cohort& c, double x1, double way) const noexcept {
    return std::clamp((direction_ * (x1 - c.root) - law_.residual) / way, 0.0, 1.0);
  }

  /// Snaps per bristle in a piece: by the law alone, and from that with bristles that are renewed before they
  /// could snap. Second order in the piece.
  double snaps_in(double x1, double way) const noexcept {
    double alone = 0.0, exposed_sum = 0.0;
    for (const Cohort& c : cohorts_) {
      const double reach = reach_at(c, x1);
      if (reach == c.reach) continue;
      const double lost = c.weight * (c.at_reach.survival - law_.law->at(reach).survival);
      alone += lost;
      exposed_sum += lost * exposed(c, x1, way);
    }
    alone /= load_;
    return alone * std::exp(-0.5 * law_.renewal * exposed_sum / load_);
  }

  // From x0 to x1, a stride at most: bristles whose length is passed snap where they reach it, others are
  // renewed evenly along the piece. All of them are born again where that happens, bent by the residual.
  void slide(double x0, double x1) {
    const double way = std::fabs(x1 - x0), snaps = law_.renewal > 0.0 ? snaps_in(x1, way) : 0.0;
    const double before = snaps_per_bristle_;
    snaps_per_bristle_ += snaps;
    double mass = waiting_, moment = waiting_ * waiting_place_;
    for (Cohort& c : cohorts_) {
      const double reach = reach_at(c, x1);
      double half = 1.0;  // not renewed up to the middle of the piece
      if (snaps > 0.0) {
        const double share = exposed(c, x1, way);
        const double seen = share < 1.0 ? share * snaps : snaps_per_bristle_ - c.snaps_seen;
        c.snaps_seen = snaps_per_bristle_;
        half = share > 0.0 ? std::exp(-0.5 * law_.renewal * seen) : 1.0;
        const double renewed =
            c.weight * (1.0 - half) * (c.at_reach.survival + half * law_.law->at(reach).survival);
        mass += renewed;
        moment += renewed * (x1 - 0.5 * direction_ * way * share);
      }
      if (reach > c.reach) {
        const LawTable::Value now = law_.law->at(reach);
        const double snapped = half * c.weight * (c.at_reach.survival - now.survival);
        mass += snapped;
        moment += snapped * (c.root + direction_ * law_.residual) +
                  half * direction_ * c.weight * (now.first - c.at_reach.first);
        c.reach = reach;
        c.at_reach = now;
      }
      c.weight *= half * half;
    }
    const double least = negligible_mass * load_;
    if (++pieces_ % 8 == 0) {
      std::erase_if(cohorts_, [&](const Cohort& c) {
        if (c.mass() > least) return false;
        mass += c.mass();
        moment += c.mass() * x1;
        return true;
      });
    }
    waiting_ = mass;
    waiting_place_ = mass > 0.0 ? moment / mass : x1;
    if (mass > 0.1 * least) {
      const double place = std::clamp(waiting_place_, std::min(x0, x1), std::max(x0, x1));
      add(mass, place, place - direction_ * law_.residual, x0, before + snaps * std::fabs(place - x0) / way);
      waiting_ = 0.0;
    }
  }

  // Bristles born at x. They join the cohort born last where it stays narrow.
  void add(double mass, double x, double root, double begin, double seen) {
    if (mass <= 0.0) return;
    if (!cohorts_.empty()) {
      Cohort& last = cohorts_.back();
      if (std::fabs(x - last.begin) <= law_.stride && std::fabs(root - last.root) <= law_.stride &&
          last.reach <= law_.stride && last.at_reach.survival > 0.5) {
        // Those that joined have been bent less, by a stride at most: counted as if they had been as far.
        const double there = last.mass();
        last.root = (there * last.root + mass * root) / (there + mass);
        last.snaps_seen = (there * last.snaps_seen + mass * seen) / (there + mass);
        last.weight += mass / last.at_reach.survival;
        return;
      }
    }
    if (cohorts_.size() >= most_) merge();
    cohorts_.push_back({root, begin, mass, 0.0, {1.0, 0.0}, seen});
  }

  // Cohorts of nearly one root and reach become one, so that many small loops stay cheap.
  void merge() {
    const auto cell = [this](double length) { return std::floor(length / law_.stride); };
    std::sort(cohorts_.begin(), cohorts_.end(), [&](const Cohort& a, const Cohort& b) {
      const double pa = cell(a.root), pb = cell(b.root);
      return pa != pb ? pa < pb : a.reach < b.reach;
    });
    std::vector<Cohort> merged;
    for (const Cohort& c : cohorts_) {
      if (!merged.empty() && cell(merged.back().root) == cell(c.root) &&
          c.reach - merged.back().reach <= law_.stride) {
        Cohort& m = merged.back();
        const double a = m.mass(), b = c.mass(), both = a + b;
        m.root = (a * m.root + b * c.root) / both;
        m.reach = (a * m.reach + b * c.reach) / both;
        m.snaps_seen = (a * m.snaps_seen + b * c.snaps_seen) / both;
        m.at_reach = law_.law->at(m.reach);
        m.weight = both / std::max(m.at_reach.survival, 1e-300);
      } else {
        merged.push_back(c);
      }
    }
    if (merged.size() > most_ / 2) most_ = 2 * merged.size();
    cohorts_ = std::move(merged);
  }

  LayerLaw law_;
  std::vector<Cohort> cohorts_;
  std::size_t most_ = 1024;
  double load_ = 0.0;
  double direction_ = 1.0, run_ = 0.0;
  unsigned pieces_ = 0;
  double snaps_per_bristle_ = 0.0;              // since the beginning
  double waiting_ = 0.0, waiting_place_ = 0.0;  // too few to be a cohort yet
};

std::vector<double> redraw_force(const std::vector<PathPoint>& path, const SnapLength& law, Rubbing rubbing,
                                 StartState start) {
  const LawTable table(law);
  const double mean = law.mean(), residual = rubbing.residual_length / mean;
  const double forgetting = forgetting_path(law, table.reach(), residual);
  const auto extremes =
      std::minmax_element(path.begin(), path.end(), [](auto& a, auto& b) { return a.load < b.load; });
  const double lowest = extremes.first->load, highest = extremes.second->load;
  // One layer for the load that is always there, the others for what comes and goes.
  std::vector<double> floors{0.0};
  const double varying = highest - lowest;
  if (varying > 0.0) {
    for (int i = 0; i < load_layers; ++i) floors.push_back(lowest + varying * i / load_layers);
  }
  if (floors.size() > 1 && floors[1] == 0.0) floors.erase(floors.begin());
  std::vector<Layer> layers(
      floors.size(), Layer({&table, residual, rubbing.shared_renewal, fitting_stride(law), forgetting}));
  const auto set_load = [&](double load, double x) {
    for (std::size_t i = 0; i < layers.size(); ++i) {
      const double top = i + 1 < floors.size() ? floors[i + 1] : highest;
      layers[i].set_load(std::clamp(load, floors[i], top) - floors[i], x);
    }
  };

  const double origin = path.front().x;
  double x = 0.0;
  if (start != StartState::straight) {
    x = start == StartState::forward ? -forgetting : forgetting;
    set_load(path.front().load, x);
    for (Layer& layer : layers) layer.move(x, -x);
    x = 0.0;
  }
  const double per_newton = mean / kinetic_deflection(law, SnapRule::redraw, rubbing);
  std::vector<double> forces;
  for (const PathPoint& point : path) {
    const double next = (point.x - origin) / mean;
    set_load(point.load, x);
    double sum = 0.0;
    for (Layer& layer : layers) {
      layer.move(x, next - x);
      if (point.wanted) sum += layer.force(next);
    }
    x = next;
    if (point.wanted) forces.push_back(sum * per_newton);
  }
  return forces;
}

/// Path after which the phases of bristles that keep their lengths are spread evenly. (Jumps in the density
/// of a law leave waves that die out slowly: hence more than smooth laws need.)
double kept_forgetting_path(const SnapLength& law) { return std::min(15.0 + 4.0 / law.cv(), 400.0); }

/// The keep rule: representatives in the order in which load brings them into contact.
class KeptBristles {
 public:
  KeptBristles(const SnapLength& law, double most_load)
      : most_load_(most_load), forgetting_(kept_forgetting_path(law)) {
    // Two additive sequences (powers of the plastic number): every prefix covers length and phase evenly.
    for (std::size_t i = 0; i < population; ++i) {
      const double k = static_cast<double>(i) + 0.5;
      length_.push_back(law.quantile(part(0.7548776662466927 * k)) / law.mean());
      phase_.push_back(part(0.5698402909980532 * k));
    }
    bent_.assign(population, 0.0);
  }

  void set_load(double load) {
    const double now = most_load_ > 0.0 ? load / most_load_ * static_cast<double>(population) : 0.0;
    for (auto i = static_cast<std::size_t>(std::ceil(active_)); static_cast<double>(i) < now; ++i)
      bent_[i] = 0.0;
    active_ = now;
  }

  void move(double d) {
    if (d == 0.0) return;
    const double e = d > 0.0 ? 1.0 : -1.0, way = std::fabs(d);
    if (e != direction_) {
      direction_ = e;
      run_ = 0.0;
    }
    run_ += way;
    const bool forgotten = run_ > forgetting_;
    const auto count = static_cast<std::size_t>(std::ceil(active_));
    for (std::size_t i = 0; i < count; ++i) {
      const double length = length_[i];
      if (forgotten) {
        bent_[i] = e * phase_[i] * length;
        continue;
      }
      const double to = e * bent_[i] + way;
      bent_[i] = e * (to > length ? to - length * std::floor(to / length) : to);
    }
  }

  double force() const noexcept {
    double sum = 0.0;
    const auto whole = static_cast<std::size_t>(active_);
    for (std::size_t i = 0; i < whole; ++i) sum += bent_[i];
    if (whole < population) sum += (active_ - static_cast<double>(whole)) * bent_[whole];
    return sum * most_load_ / static_cast<double>(population);
  }

 private:
  static double part(double value) noexcept { return value - std::floor(value); }

  double most_load_, forgetting_;
  std::vector<double> length_, phase_, bent_;
  double active_ = 0.0, direction_ = 0.0, run_ = 0.0;
};

std::vector<double> keep_force(const std::vector<PathPoint>& path, const SnapLength& law, StartState start) {
  const double mean = law.mean();
  double most = 0.0;
  for (const PathPoint& point : path) most = std::max(most, point.load);
  KeptBristles brush(law, most);
  if (start != StartState::straight) {
    brush.set_load(path.front().load);
    for (int i = 0; i < 2; ++i)
      brush.move((start == StartState::forward ? 1.0 : -1.0) * kept_forgetting_path(law));
  }
  std::vector<double> forces;
  double x = path.front().x;
  for (const PathPoint& point : path) {
    brush.set_load(point.load);
    brush.move((point.x - x) / mean);
    x = point.x;
    if (point.wanted) forces.push_back(2.0 * brush.force());
  }
  return forces;
}

}  // namespace

double kinetic_deflection(const SnapLength& law, SnapRule rule, Rubbing rubbing) {
  // Of a material whose friction coefficient is that deflection.
  return bristle::Material{}
      .with_bristle_stiffness(1.0)
      .with_normal_stiffness(1e6)
      .with_asperity_height_deviation(1e-6)
      .with_snap_length(law)
      .with_snap_rule(rule)
      .with_residual_length(rubbing.residual_length)
      .with_shared_renewal(rule == SnapRule::keep ? 0.0 : rubbing.shared_renewal)
      .kinetic_coefficient();
}

std::vector<double> mean_brush_force(const std::vector<PathPoint>& path, const SnapLength& law, SnapRule rule,
                                     StartState start, Rubbing rubbing) {
  return rule == SnapRule::redraw ? redraw_force(path, law, rubbing, start) : keep_force(path, law, start);
}

}  // namespace cli
