// An independent model of the brush with residual and shared renewal, without noise: it cuts a path into
// small pieces and tracks, for each piece, the share of all bristles that were last straight there. It uses
// nothing of bristle.
//
// A piece stores its share of bristles, their largest deflection so far, and the position where they began.
// Nothing is merged or left out, so a path of n pieces costs n^2 / 2 look-ups in a table of the law. An atom
// of the law (one length with a probability) counts as the limit of narrow groups: some of its bristles are
// renewed before they snap.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace bristle_test {

/// A patch's bristles, as one group for each piece of the past path. Lengths are in mean snap
/// lengths.
class SmallPieces {
 public:
  /// Makes straight bristles. `quantiles`: snap lengths below which shares 0, 1/(n-1), ..., 1 of them lie.
  SmallPieces(const std::vector<double>& quantiles, double residual, double renewal)
      : residual_(residual), renewal_(renewal), groups_{Group{}} {
    const std::size_t count = static_cast<std::size_t>(quantiles.back() * per_length) + 2;
    std::size_t node = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const double x = static_cast<double>(i) / per_length;
      while (node < quantiles.size() && quantiles[node] <= x) ++node;
      const double last = static_cast<double>(quantiles.size() - 1);
      if (node == 0)
        left_.push_back(1.0);
      else if (node == quantiles.size())
        left_.push_back(0.0);
      else
        left_.push_back(1.0 - (static_cast<double>(node) - 1.0 +
                               (x - quantiles[node - 1]) / (quantiles[node] - quantiles[node - 1])) /
                                  last);
    }
    left_.push_back(0.0);
  }

  /// Moves the body by (dx, dy), cut into pieces of at most `piece` mean snap lengths.
  void step(double dx, double dy, double piece) {
    const double path = std::hypot(dx, dy);
    const int pieces = static_cast<int>(std::ceil(path / piece));
    for (int k = 0; k < pieces; ++k) small_step(dx / path, dy / path, path / pieces);
  }

  double x() const { return mean(&Group::x); }
  double y() const { return mean(&Group::y); }

 private:
  struct Group {
    double x = 0.0, y = 0.0;  ///< deflection of the group's bristles, which were last straight in one piece
    double farthest = 0.0;    ///< largest deflection of these bristles so far, beyond the residual
    double share = 1.0;       ///< share of all bristles that were last straight here, less those renewed
    double left = 1.0;        ///< share of these bristles that have not snapped
  };

  double survival(double x) const {
    const double at = std::min(x * per_length, static_cast<double>(left_.size() - 2));
    const std::size_t i = static_cast<std::size_t>(at);
    return left_[i] + (at - static_cast<double>(i)) * (left_[i + 1] - left_[i]);
  }
  double mean(double Group::*value) const {
    double sum = 0.0;
    for (const Group& g : groups_) sum += g.share * g.left * (g.*value);
    return sum;
  }

  void small_step(double ex, double ey, double h) {
    double snapped = 0.0;
    for (Group& g : groups_) {
      g.x += h * ex;
      g.y += h * ey;
      const double bent = std::sqrt(g.x * g.x + g.y * g.y) - residual_;
      if (bent <= g.farthest) continue;
      g.farthest = bent;
      const double left = survival(bent);
      snapped += g.share * (g.left - left);
      g.left = left;
    }
    // Iterates the number of renewals per bristle: a bristle that is renewed may not snap and renew others.
    double draws = renewal_ * snapped;
    for (int i = 0; draws > 1e-9 && i < 20; ++i) draws = renewal_ * snapped * -std::expm1(-draws) / draws;
    const double kept = std::exp(-draws);
    double born = snapped;
    if (renewal_ > 0.0)
      for (Group& g : groups_) {
        if (g.x * ex + g.y * ey <= residual_) continue;
        born += (1.0 - kept) * g.share * g.left;
        g.share *= kept;
      }
    groups_.erase(std::remove_if(groups_.begin(), groups_.end(),
                                 [](const Group& g) { return g.share * g.left < 1e-13; }),
                  groups_.end());
    if (born > 0.0) {
      const double middle = residual_ + 0.5 * h;
      groups_.push_back({middle * ex, middle * ey, 0.5 * h, born, 1.0});
    }
  }

  static constexpr double per_length = 8192.0;
  double residual_, renewal_;
  std::vector<double> left_;  ///< survival function of the snap length (share of longer ones), a table
  std::vector<Group> groups_;
};

}  // namespace bristle_test
