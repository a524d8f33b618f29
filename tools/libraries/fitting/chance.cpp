// Simulates single bristles along a measured path, to find how much a fit varies because the bristles of a
// contact are a random sample of their law.
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "tools/libraries/fitting/solve.hpp"

namespace cli {
namespace {

// Number of simulated bristles, by which a variance is known within 6 %.
constexpr int simulated = 500;
// Number of snap lengths, evenly spread over the law, from which bristles sample theirs.
constexpr int sampled_lengths = 4096;
// Longest move between two samples that is simulated as a whole, in mean snap lengths: by its end bristles
// have forgotten its beginning.
constexpr double longest_move = 10.0;
// Number of samples, evenly spread over the record, that stand for all where there are more.
constexpr Eigen::Index summed_samples = 4000;
// Longest step, in mean snap lengths, of bristles that renew each other.
constexpr double shared_step = 0.2;

/// Bristles that bend and snap independently of each other, except for shared renewal. A snap leaves the
/// residual deflection. They have no lengths before the first straighten().
class RandomBristles {
 public:
  RandomBristles(const bristle::Material& material, const std::vector<Ring>& rings)
      : material_(material), length_(material.snap_length.mean()) {
    for (int i = 0; i < sampled_lengths; ++i)
      strengths_.push_back(material.residual_length +
                           material.snap_length.quantile((i + 0.5) / sampled_lengths));
    double share = 0.0;
    std::size_t ring = 0;
    for (std::size_t i = 0; i < all_.size(); ++i) {
      while (ring + 1 < rings.size() && rank_of(i) > share + rings[ring].share) share += rings[ring++].share;
      all_[i].lever = rings[ring].lever;
    }
    std::shuffle(all_.begin(), all_.end(), random_);
  }

  /// Straightens all bristles, which then have random snap lengths.
  void straighten() {
    for (Bristle& b : all_) b = {0.0, 0.0, sampled(), b.lever};
  }
  /// Straightens the bristles that do not touch under a share of the highest load.
  void lift_beyond(double share) {
    for (std::size_t i = all_.size(); i > 0 && rank_of(i - 1) > share; --i)
      all_[i - 1] = {0.0, 0.0, sampled(), all_[i - 1].lever};
  }

  void move(double dx, double dy) {
    const double whole = std::hypot(dx, dy), path = std::min(whole, longest_move * length_);
    if (!(path > 0.0)) return;
    const int steps =
        material_.shared_renewal > 0.0 ? 1 + static_cast<int>(path / (shared_step * length_)) : 1;
    for (int step = 0; step < steps; ++step) move_straight(dx / whole, dy / whole, path / steps);
  }

  /// Adds to column i of `sums` the deflection of bristle i times its lever, `factor` and the weights of the
  /// axes.
  void add_to(Eigen::MatrixXd& sums, double factor, const Eigen::VectorXd& of_x,
              const Eigen::VectorXd& of_y) const {
    for (std::size_t i = 0; i < all_.size(); ++i) {
      const Bristle& b = all_[i];
      auto sum = sums.col(static_cast<Eigen::Index>(i));
      sum += factor * b.lever * b.x * of_x;
      if (of_y.size() > 0) sum += factor * b.lever * b.y * of_y;
    }
  }

 private:
  struct Bristle {
    double x = 0.0, y = 0.0;  // deflection, m
    double strength = 0.0;    // deflection at which it snaps, m
    double lever = 1.0;       // path of the bristle over that of the record
  };
  double rank_of(std::size_t i) const { return (static_cast<double>(i) + 0.5) / simulated; }
  double flat() { return std::uniform_real_distribution<double>(0.0, 1.0)(random_); }
  double sampled() { return strengths_[random_() % sampled_lengths]; }
  /// Gives a bristle the residual deflection and a fresh length, and moves it on by the path `left`.
  void renew(Bristle& b, double ex, double ey, double left) {
    const double bent = material_.residual_length + left;
    b = {bent * ex, bent * ey, sampled(), b.lever};
  }

  void move_straight(double ex, double ey, double path) {
    double snaps = 0.0;
    for (Bristle& b : all_) {
      double left = b.lever * path;
      b.x += left * ex;
      b.y += left * ey;
      while (b.x * b.x + b.y * b.y > b.strength * b.strength) {
        const double along = b.x * ex + b.y * ey, across = b.x * ey - b.y * ex;
        left = std::min(left, along - std::sqrt(std::max(b.strength * b.strength - across * across, 0.0)));
        renew(b, ex, ey, left);
        snaps += 1.0;
      }
    }
    selected_ += material_.shared_renewal * snaps;
    for (; selected_ >= 1.0; selected_ -= 1.0) {
      Bristle& b = all_[static_cast<std::size_t>(flat() * simulated)];
      const double left = b.lever * path * flat();
      if (b.x * ex + b.y * ey - left > material_.residual_length) renew(b, ex, ey, left);
    }
  }

  const bristle::Material& material_;
  double length_;
  std::mt19937_64 random_{1};
  std::vector<double> strengths_;  // deflections at which bristles snap, in ascending order
  std::vector<Bristle> all_ = std::vector<Bristle>(simulated);
  double selected_ = 0.0;  // number of renewals due to earlier snaps and not yet made, below one
};

}  // namespace

Eigen::MatrixXd covariance_of_one_bristle(const FitModel& model, const FitPoint& point,
                                          const Eigen::MatrixXd& jacobian, double most_load) {
  const FitData& data = model.data();
  const auto samples = static_cast<Eigen::Index>(data.samples());
  const bristle::Material material = model.unit_material(point.values);
  const double force = point.values[fit_kinetic] * most_load / material.kinetic_coefficient();
  RandomBristles bristles(material, rings_of(data.columns.disc, Detail::search));
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(jacobian.cols(), simulated);
  const Eigen::Index every = 1 + samples / summed_samples;
  Eigen::Index sample = 0;
  std::size_t part = 0;
  for (std::size_t i = 0; i < data.path.size(); ++i) {
    const PathPoint& here = data.path[i];
    if (i == 0 || here.begins) {
      bristles.straighten();
      const Move slide = slide_before(data.path, i, data.axes, point.past.of_part(i == 0 ? 0 : ++part),
                                      longest_move * material.snap_length.mean());
      bristles.move(slide.x, slide.y);
    } else {
      bristles.move(here.x - data.path[i - 1].x, here.y - data.path[i - 1].y);
    }
    bristles.lift_beyond(here.load / most_load);
    if (!here.wanted) continue;
    if (sample % every == 0)
      bristles.add_to(
          sums, static_cast<double>(every) * force, jacobian.row(sample).transpose(),
          data.axes == 2 ? Eigen::VectorXd(jacobian.row(sample + samples).transpose()) : Eigen::VectorXd());
    ++sample;
  }
  sums.colwise() -= sums.rowwise().mean().eval();
  const Eigen::MatrixXd normal = inverse_normal_matrix(jacobian);
  return normal * (sums * sums.transpose() / (simulated - 1.0)) * normal;
}

}  // namespace cli
