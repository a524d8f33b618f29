// The force of a brush along a measured path, as fitting needs it: expected, without noise, smooth in the
// parameters. The infinite brush of the library steps along the path; bristles that keep their lengths, which
// it does not have, are a stratified population of their own.
#pragma once

#include <list>
#include <memory>
#include <vector>

#include <bristle/material.hpp>

namespace cli {

/// A place of the path. Between points the motion is straight; the load of a point acts on the way to it.
struct PathPoint {
  double x = 0.0;       ///< m
  double load = 0.0;    ///< N
  bool wanted = true;   ///< the force here is wanted; else a place passed on the way (a turning point)
  double t = 0.0;       ///< s, for contacts that age
  double y = 0.0;       ///< m, of a record in the plane
  bool begins = false;  ///< a new record: nothing is remembered of what was before
};

/// State of the bristles at the first point.
enum class StartState : unsigned char {
  straight,  ///< set down there
  forward,   ///< after a long slide towards +x; in the plane along the first motion
  backward   ///< after a long slide towards -x; in the plane against the first motion
};

/// Memory of a population that keeps its lengths.
enum class Memory : unsigned char {
  forgotten,  ///< a long slide spreads its phases evenly: no place is met again as it was
  whole       ///< all: where they were straight together they are so again
};

/// Path before the record, and the part of it that counts.
struct Past {
  StartState start = StartState::straight;
  Memory memory = Memory::forgotten;
  double rested = 0.0;                 ///< s, of straight bristles that age
  double speed = 0.0;                  ///< m/s, of the slide before; 0: so fast that nothing ages
  std::vector<StartState> later = {};  ///< of the second record and of those after it; none: straight
  StartState of_part(std::size_t part) const {
    return part == 0 ? start : part <= later.size() ? later[part - 1] : StartState::straight;
  }
  friend bool operator==(const Past&, const Past&) = default;
};

/// Shape of the elastic force; lengths are shares of the presliding length.
struct BrushShape {
  bristle::SnapLaw law = bristle::SnapLaw::lognormal;
  bristle::SnapRule rule = bristle::SnapRule::redraw;
  double spread = 0.3;
  double residual_share = 0.0;  ///< redraw only, as all that follows
  double shared_renewal = 0.0;
  bristle::AgeingForm ageing_form = bristle::AgeingForm::logarithmic;
  double ageing_strength = 0.0;
  double ageing_time = 1.0;            ///< s
  double growth = 1.0;                 ///< of the mean snap length at the age at which lengths are given
  std::vector<double> quantiles = {};  ///< of SnapLaw::table, over their mean
  friend bool operator==(const BrushShape&, const BrushShape&) = default;

  /// A material of this shape whose friction is that of one bristle stiffness and one bristle per newton.
  bristle::Material material(double presliding_length_m) const;
};

/// Resolution at which the force is computed.
enum class Detail : unsigned char {
  search,  ///< redraw: within 0.2 % rms; keep: 512 bristles; slide: 32 strata
  finish   ///< redraw: within 0.05 % rms; keep: 2048 bristles; slide: 64 strata
};

/// Part of a contact that turns: everything on one radius goes the same way.
struct Ring {
  double lever = 1.0;  ///< its radius, over the one at which the record has way and force
  double share = 1.0;  ///< of the load
};
/// Rings of a contact; one that slides as a whole has a single ring of lever 1. A disc under an even
/// pressure: rings at Gauss's radii, for which stiffness and friction in sliding come out exact.
std::vector<Ring> rings_of(bool disc, Detail detail);

/// Computes forces along one path. Keeps the brushes that it made: a shape that was asked for lately costs no
/// table of its law again. For one thread.
class PathForce {
 public:
  explicit PathForce(const std::vector<PathPoint>& path, unsigned axes = 1, bool disc = false);
  ~PathForce();
  PathForce(const PathForce&) = delete;
  PathForce& operator=(const PathForce&) = delete;

  /// Elastic friction (positive along the motion) at every wanted point, N, for a kinetic coefficient of 1 at
  /// `kinetic_speed` (m/s; 0: so fast that nothing ages). In the plane first all x, then all y. Of a disc the
  /// torque over its radius.
  std::vector<double> find(const BrushShape& shape, double presliding_length_m, Past past, Detail detail,
                           double kinetic_speed = 0.0);

 private:
  struct Brush;
  Brush& brush_of(const BrushShape& shape, Detail detail);
  std::vector<double> of_ring(double lever, const BrushShape& shape, double presliding_length_m,
                              const Past& past, Detail detail, double kinetic_speed);

  const std::vector<PathPoint>& path_;
  unsigned axes_;
  bool disc_;
  double most_load_ = 0.0;
  std::list<std::unique_ptr<Brush>> made_;  // the last used first
};

/// Force along the path of bristles that keep their lengths.
std::vector<double> kept_force(const std::vector<PathPoint>& path, const BrushShape& shape,
                               double presliding_length_m, Past past, Detail detail);

}  // namespace cli
