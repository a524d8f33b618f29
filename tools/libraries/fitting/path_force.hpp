// Computes the expected friction of a brush along a measured path, free of noise and smooth in the
// parameters, as a fit needs it. By the snap rule the library's infinite brush (redraw) or strata (slide)
// step along the path. Redraw on one axis is stepped only where its friction is not known from a stroke
// before.
#pragma once

#include <list>
#include <memory>
#include <vector>

#include <bristle/material.hpp>

namespace cli {

/// Point of a measured path. The motion between points is straight, and the load of a point acts from the
/// previous point to this one.
struct PathPoint {
  double x = 0.0;       ///< position, m
  double load = 0.0;    ///< normal load, N
  bool wanted = true;   ///< whether the force is wanted here: false for reversals and samples held out
  double t = 0.0;       ///< time of the point, s
  double y = 0.0;       ///< second coordinate, m, for motion in the plane
  bool begins = false;  ///< whether a new record begins here, with a brush that forgot the last one
};

/// State of the bristles at the first point of a path.
enum class StartState : unsigned char {
  straight,  ///< bristles are straight, as in a contact just made
  forward,   ///< state after a long slide towards +x (in the plane, along the record's first motion)
  backward   ///< state after a long slide towards -x (in the plane, against the first motion)
};

struct Move {
  double x, y;  // m
};
/// Returns the slide over `distance` (m) to the state at the start of the record that begins at the point
/// `first` of a path; none for straight bristles. On one axis it is along x, in the plane along the
/// record's first motion.
Move slide_before(const std::vector<PathPoint>& path, std::size_t first, unsigned axes, StartState start,
                  double distance);

/// State of the bristles before the first sample of each record.
struct Past {
  StartState start = StartState::straight;
  std::vector<StartState> later = {};  ///< starting states of the second and later joined records; those not
                                       ///< listed start straight
  StartState of_part(std::size_t part) const {
    return part == 0 ? start : part <= later.size() ? later[part - 1] : StartState::straight;
  }
  friend bool operator==(const Past&, const Past&) = default;
};

/// Shape of a brush's elastic force. Its lengths are shares of the presliding length.
struct BrushShape {
  bristle::SnapLaw law = bristle::SnapLaw::lognormal;
  bristle::SnapRule rule = bristle::SnapRule::redraw;
  double spread = 0.3;
  /// Share of the presliding length that a snap leaves (residual). Residual and shared renewal need the rule
  /// redraw.
  double residual_share = 0.0;
  double shared_renewal = 0.0;
  std::vector<double> quantiles = {};  ///< quantiles of snap lengths over their mean, for SnapLaw::table
  friend bool operator==(const BrushShape&, const BrushShape&) = default;

  /// Returns a material of this shape, with bristles of 1 N/m and one bristle per newton.
  bristle::Material material(double presliding_length_m) const;
};

/// Accuracy with which friction along a path is computed: less to search, more for the final fit. A path of
/// far steps, which does not show the course of presliding, is computed less accurately.
enum class Detail : unsigned char {
  search,  ///< redraw: error 0.4 % rms at most; slide: 32 strata
  refine,  ///< redraw: error 0.2 % rms at most; slide: 64 strata
  finish   ///< redraw: error 0.05 % rms at most; slide: as refine
};

/// Ring of a turning contact: all its points move equally far.
struct Ring {
  double lever = 1.0;  ///< radius of the ring over the radius of the record's path and force
  double share = 1.0;  ///< share of the load that the ring bears
};
/// Returns the rings into which a contact is cut. A contact that slides as a whole is one ring of lever 1. A
/// turning disc under even pressure is cut into rings at Gauss points, by which its stiffness and sliding
/// friction are exact.
std::vector<Ring> rings_of(bool disc, Detail detail);

/// Computes friction along one path. Caches the latest brushes, so that a shape that is used again needs no
/// new table of its law of snap lengths. For one thread.
class PathForce {
 public:
  explicit PathForce(const std::vector<PathPoint>& path, unsigned axes = 1, bool disc = false);
  ~PathForce();
  PathForce(const PathForce&) = delete;
  PathForce& operator=(const PathForce&) = delete;

  /// Returns the elastic friction (N, positive along the motion) for a kinetic coefficient of 1, at each
  /// point that asks for it, or at every point (`everywhere`). In the plane, all x, then all y components;
  /// for a disc, torque over radius.
  std::vector<double> find(const BrushShape& shape, double presliding_length_m, const Past& past,
                           Detail detail, bool everywhere = false);

 private:
  struct Brush;
  Brush& brush_of(const BrushShape& shape, double accuracy);
  std::vector<double> of_ring(double lever, const BrushShape& shape, double presliding_length_m,
                              const Past& past, Detail detail, bool everywhere);

  const std::vector<PathPoint>& path_;
  unsigned axes_;
  bool disc_;
  double most_load_ = 0.0;
  std::list<std::unique_ptr<Brush>> made_;  // cache of brushes, the most recently used first
};

}  // namespace cli
