// Ten thousand contacts of springs that slide at their limit, on paths as hands, engines and discrete
// elements make them. They are stepped as a group of a batch, as patches, and by a plain loop over the same
// springs. For `bristle capacity`.
#pragma once

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include <bristle/patch_batch.hpp>

#include "bench/plain_loops.hpp"

namespace bristle_bench {

enum class LanePath { bend, corners, strokes, tremor, ripple, rest };
constexpr const char* lane_path_names[] = {"bend", "corners", "strokes", "tremor", "ripple", "rest"};
constexpr LanePath lane_paths[] = {LanePath::bend,   LanePath::corners, LanePath::strokes,
                                   LanePath::tremor, LanePath::ripple,  LanePath::rest};

/// Motions of the contacts, a tenth of a mean limit in each step. All contacts move along one path, each a
/// step behind its neighbour, so a step reads a stretch of three long columns.
class LaneMotions {
 public:
  static constexpr std::size_t contacts = 10000, period = 512;

  LaneMotions(LanePath path, double mean_limit_m) {
    std::mt19937 random;
    double angle = 0.3;
    for (std::size_t k = 0; k < contacts + period; ++k) {
      const auto t = static_cast<double>(k);
      if (path != LanePath::corners)
        angle += path == LanePath::strokes ? 0.0 : 0.02;
      else if (random() % 20 == 0)
        angle += random() % 2 == 0 ? 0.5 * pi : -0.5 * pi;
      double x = std::cos(angle), y = std::sin(angle);
      if (path == LanePath::strokes && k / 30 % 2 == 1) x = -x, y = -y;
      if (path == LanePath::tremor) x = 0.3 * x + std::sin(0.9 * t), y = 0.3 * y + 0.7 * std::cos(1.1 * t);
      const double length = path == LanePath::rest ? 0.0 : 0.1 * mean_limit_m;
      x_.push_back(length * x);
      y_.push_back(length * y);
      load_.push_back(path == LanePath::ripple ? 1.0 + 0.01 * std::sin(0.7 * t) : 1.0);
    }
  }
  void next() { at_ = (at_ + 1) % period; }
  const double* x() const { return x_.data() + at_; }
  const double* y() const { return y_.data() + at_; }
  const double* load() const { return load_.data() + at_; }

 private:
  static constexpr double pi = 3.141592653589793;
  std::vector<double> x_, y_, load_;
  std::size_t at_ = 0;
};

/// The material and options that equal the plain loop: limits evenly spread on 0.5 to 1.5 of the mean, a
/// stiffness of 1 N/m per newton.
inline bristle::Material lane_material(double mean_limit_m) {
  bristle::Material m;
  m.bristle_stiffness = 1.0;
  m.normal_stiffness = 1e6;
  m.asperity_height_deviation = 1e-6;
  m.bristle_damping = m.viscous_friction = m.residual_length = m.shared_renewal = 0.0;
  m.snap_length = bristle::SnapLength::uniform(0.5 * mean_limit_m, 1.5 * mean_limit_m);
  m.snap_rule = bristle::SnapRule::slide;
  return m;
}
inline bristle::PatchOptions lane_options(std::uint32_t springs) {
  return bristle::PatchOptions{}.with_bristles(springs).with_max_normal_load(1.01);
}

/// Steps the contacts as a group.
class LaneGroup {
 public:
  LaneGroup(std::uint32_t springs, LanePath path, const bristle::BatchOptions& options)
      : motions_(path, mean_limit_m), batch_(options) {
    step_.group = batch_.add_group(lane_material(mean_limit_m), lane_options(springs), LaneMotions::contacts);
    step_.end[0] = fx_;
    step_.end[1] = fy_;
    batch_.warm_up();
    for (int k = 0; k < 60; ++k) step();
  }
  double step() {
    motions_.next();
    step_.displacement[0] = {motions_.x(), LaneMotions::contacts};
    step_.displacement[1] = {motions_.y(), LaneMotions::contacts};
    step_.normal_load = {motions_.load(), LaneMotions::contacts};
    batch_.step(1e-3, step_);
    return fx_[0];
  }
  static constexpr double mean_limit_m = 1e-5;

 private:
  LaneMotions motions_;
  bristle::PatchBatch batch_;
  bristle::GroupStep step_;
  std::vector<double> fx_ = std::vector<double>(LaneMotions::contacts), fy_ = fx_;
};

/// Steps the contacts as patches. The time includes writing the motions.
class LanePatches {
 public:
  LanePatches(std::uint32_t springs, LanePath path, const bristle::BatchOptions& options)
      : path_(path, LaneGroup::mean_limit_m), batch_(options) {
    for (bristle::Motion& motion : motions_)
      motion.id = batch_.add(lane_material(LaneGroup::mean_limit_m), lane_options(springs));
    batch_.warm_up();
    for (int k = 0; k < 60; ++k) step();
  }
  double step() {
    path_.next();
    for (std::size_t i = 0; i < LaneMotions::contacts; ++i) {
      motions_[i].displacement[0] = path_.x()[i];
      motions_[i].displacement[1] = path_.y()[i];
      motions_[i].normal_load = path_.load()[i];
    }
    batch_.step(1e-3, motions_, responses_);
    return responses_[0].end[0];
  }

 private:
  LaneMotions path_;
  bristle::PatchBatch batch_;
  std::vector<bristle::Motion> motions_ = std::vector<bristle::Motion>(LaneMotions::contacts);
  std::vector<bristle::Response> responses_ = std::vector<bristle::Response>(LaneMotions::contacts);
};

/// Steps the contacts by the plain loop, which stands for what a user would write.
class LanePlain {
 public:
  LanePlain(std::uint32_t springs, LanePath path)
      : motions_(path, LaneGroup::mean_limit_m),
        loop_(LaneMotions::contacts, springs, LaneGroup::mean_limit_m) {
    for (int k = 0; k < 60; ++k) step();
  }
  double step() {
    motions_.next();
    loop_.step(motions_.x(), motions_.y(), motions_.load(), fx_.data(), fy_.data());
    return fx_[0];
  }

 private:
  LaneMotions motions_;
  bristle::plain::LanesLoop loop_;
  std::vector<double> fx_ = std::vector<double>(LaneMotions::contacts), fy_ = fx_;
};

}  // namespace bristle_bench
