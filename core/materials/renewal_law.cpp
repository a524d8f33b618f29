#include "core/materials/renewal_law.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <vector>

#include "core/materials/elementary.hpp"
#include "core/materials/kernel_law.hpp"

namespace bristle::detail {
namespace {

constexpr int per_mean = 32;  ///< number of cells in a mean snap length
/// Longest path that the search returns, in mean snap lengths, even if bristles of the law forget their start
/// more slowly.
constexpr int reach = 40;
constexpr int cells = per_mean * reach;
/// Relative difference of the mean deflection from that of steady sliding, below which a slide counts as
/// steady.
constexpr double near_steady = 1e-3;
constexpr int classes = 64;  ///< number of classes of snap length for bristles of SnapRule::keep

/// Simulation of a slide that begins with straight bristles, by which the path to steady sliding is measured.
/// It stores how many bristles (relative to all) are in each cell of deflection, and moves them on by one
/// cell per step.
class Slide {
 public:
  explicit Slide(const Material& m) : renewal_(m.shared_renewal), redraw_(m.snap_rule == SnapRule::redraw) {
    const double mean = m.snap_length.mean();
    if (redraw_) {
      bristles_.assign(1, std::vector<double>(cells + 1, 0.0));
      bristles_[0][0] = 1.0;
      std::vector<double> survival;
      for (int k = 0; k <= cells; ++k)
        survival.push_back(m.snap_length.survival(mean * k / static_cast<double>(per_mean)));
      for (std::size_t k = 0; k < cells; ++k)
        snapping_.push_back(survival[k] > 0.0 ? 1.0 - survival[k + 1] / survival[k] : 0.0);
      return;
    }
    for (int j = 0; j < classes; ++j) {
      const double d = m.snap_length.quantile((j + 0.5) / classes) / mean * per_mean;
      const auto last = static_cast<std::size_t>(std::clamp(std::floor(d + 0.5), 1.0, double{cells}));
      bristles_.emplace_back(last, 0.0);
      bristles_.back()[0] = 1.0 / classes;
    }
  }

  /// Moves all bristles on by a cell of deflection, lets those snap that do, and returns the mean deflection
  /// after that.
  double step() {
    double snapped = 0.0;
    std::vector<double> born(bristles_.size(), 0.0);
    for (std::size_t j = 0; j < bristles_.size(); ++j) {
      std::vector<double>& bristles = bristles_[j];
      // Last cell of deflection that bristles can have reached after `steps_` steps.
      const std::size_t reached = std::min(steps_, bristles.size() - 1);
      for (std::size_t k = reached + 1; k-- > 0;) {
        double lost = k + 1 == bristles.size() ? bristles[k] : 0.0;
        if (k + 1 < bristles.size()) {
          if (redraw_) lost = bristles[k] * snapping_[k];
          bristles[k + 1] = bristles[k] - lost;
        }
        born[j] += lost;
      }
      snapped += born[j];
    }
    ++steps_;
    const double stay = exp(-renewal_ * snapped);
    double bend = 0.0;
    for (std::size_t j = 0; j < bristles_.size(); ++j) {
      std::vector<double>& bristles = bristles_[j];
      const std::size_t end = std::min(steps_ + 1, bristles.size());
      bristles[0] = born[j];
      for (std::size_t k = 1; k < end; ++k) {
        bristles[0] += bristles[k] * (1.0 - stay);
        bristles[k] *= stay;
        bend += bristles[k] * static_cast<double>(k);
      }
    }
    return bend / per_mean;
  }

 private:
  double renewal_;
  bool redraw_;
  std::vector<std::vector<double>> bristles_;
  /// Probability, for each cell, that a bristle in it snaps before the next cell.
  std::vector<double> snapping_;
  std::size_t steps_ = 0;
};

double find_forget(const Material& m) {
  Slide slide(m);
  std::vector<double> bend;
  for (int k = 0; k < cells; ++k) bend.push_back(slide.step());
  const double end = bend.back();
  int last_off = 0;
  for (int k = 0; k < cells; ++k)
    if (std::abs(bend[static_cast<std::size_t>(k)] - end) > near_steady * end) last_off = k + 1;
  return (last_off + 1.0) / per_mean;
}

/// Inputs and result of one call of find_forget(). Results are remembered, because a search takes
/// milliseconds and many materials differ only in their stiffness.
struct Known {
  SnapLaw law;
  SnapRule rule;
  double first, second, renewal;
  double forget;  ///< result of find_forget(); 0 = not yet computed

  bool fits(const Material& m) const noexcept {
    const SnapLength& length = m.snap_length;
    return forget > 0.0 && law == length.law() && rule == m.snap_rule && first == length.first_parameter() &&
           second == length.second_parameter() && renewal == m.shared_renewal;
  }
};

/// Returns the result of find_forget(), if possible from memory: each thread remembers its last 32 materials.
/// Memory per thread needs no lock (a fork could leave one locked), and plain data let the library be
/// unloaded. A material with a table as law is not remembered.
double recall_forget(const Material& m) {
  thread_local Known known[32] = {};
  thread_local std::size_t next = 0;
  // Searches afresh for a law that is a table, because Known stores only two parameters of a law.
  if (m.snap_length.law() == SnapLaw::table) return find_forget(m);
  for (const Known& k : known)
    if (k.fits(m)) return k.forget;
  const double forget = find_forget(m);
  known[next++ % std::size(known)] = {
      m.snap_length.law(), m.snap_rule, m.snap_length.first_parameter(), m.snap_length.second_parameter(),
      m.shared_renewal,    forget};
  return forget;
}

}  // namespace

RenewalLaw find_renewal_law(const Material& m) {
  const double mean = m.snap_length.mean();
  RenewalLaw law;
  law.forget = recall_forget(m);
  // Averages 1 - S over the path, S being the survival function. The result is the share of bristles that
  // snap within the path if they begin at even distances along it.
  constexpr int parts = 8;
  double sum = 0.0;
  for (int k = 1; k <= law.again_knots; ++k) {
    const double knot = law.again_reach / law.again_knots;
    for (int i = 0; i < parts; ++i)
      sum += (1.0 - m.snap_length.survival(mean * knot * (k - 1 + (i + 0.5) / parts))) / parts;
    law.again[k] = sum / k;
  }
  return law;
}

const RenewalLaw& CompiledMaterial::renewal() const {
  std::call_once(renewal_made_, [this] { renewal_ = find_renewal_law(material); });
  return renewal_;
}

}  // namespace bristle::detail
