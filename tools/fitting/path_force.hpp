// Computes the expected force of a brush along a measured path, without noise and smooth in the parameters,
// as fitting needs it. The library's infinite brush steps along the path; for bristles that keep their
// lengths, which it does not have, a stratified population stands in.
#pragma once

#include <list>
#include <memory>
#include <vector>

#include <bristle/material.hpp>

namespace cli {

/// Point of a path. Motion between points is straight; the load of a point acts on the segment that ends
/// there.
struct PathPoint {
  double x = 0.0;       ///< m, position
  double load = 0.0;    ///< N, normal load
  bool wanted = true;   ///< whether the caller wants the force at this point; if not, it is a turning point
  double t = 0.0;       ///< s, time of the point, needed for contacts that age
  double y = 0.0;       ///< m, second coordinate, in the plane only
  bool begins = false;  ///< whether a new record begins here, with no memory of the one before
};

/// State of the bristles at the first point.
enum class StartState : unsigned char {
  straight,  ///< bristles are straight, as when the contact has just been made
  forward,   ///< bristles are in the state after a long slide towards +x (in the plane, along the first
             ///< motion)
  backward   ///< state after a long slide towards -x; in the plane, against the first motion
};

/// Memory that bristles which keep their snap lengths have of their phases.
enum class Memory : unsigned char {
  forgotten,  ///< phases of bristles become evenly spread in a long slide, so that no earlier state recurs

  /// Bristles keep phases for ever; those that were straight together are so again at the same place.
  whole
};

/// State before the record.
struct Past {
  StartState start = StartState::straight;
  Memory memory = Memory::forgotten;
  /// s, time for which straight bristles rest before the record; they age.
  double rested = 0.0;
  /// m/s, speed of a slide before the record; 0: too fast for bristles to age.
  double speed = 0.0;
  std::vector<StartState> later = {};  ///< starting states of the second and later records; none: straight
                                       ///< bristles
  StartState of_part(std::size_t part) const {
    return part == 0 ? start : part <= later.size() ? later[part - 1] : StartState::straight;
  }
  friend bool operator==(const Past&, const Past&) = default;
};

/// Shape of the brush's elastic force; lengths are shares of the presliding length.
struct BrushShape {
  bristle::SnapLaw law = bristle::SnapLaw::lognormal;
  bristle::SnapRule rule = bristle::SnapRule::redraw;
  double spread = 0.3;
  /// Share of the presliding length that a snap leaves. This and the members below are for redraw only.
  double residual_share = 0.0;
  double shared_renewal = 0.0;
  bristle::AgeingForm ageing_form = bristle::AgeingForm::logarithmic;
  double ageing_strength = 0.0;
  double ageing_time = 1.0;  ///< s, time from which snap lengths grow

  /// Mean snap length of bristles of the frame's age over that of new ones.
  double growth = 1.0;
  std::vector<double> quantiles = {};  ///< quantiles of the snap lengths over their mean, for SnapLaw::table
  friend bool operator==(const BrushShape&, const BrushShape&) = default;

  /// Returns a material of this shape with a bristle stiffness of 1 N/m and one bristle per newton.
  bristle::Material material(double presliding_length_m) const;
};

/// Resolution at which the force is computed.
enum class Detail : unsigned char {
  search,  ///< redraw: error 0.2 % rms at most; keep: 512 bristles; slide: 32 strata
  finish   ///< redraw: error 0.05 % rms at most; keep: 2048 bristles; slide: 64 strata
};

/// Ring of a turning contact, on which all points move equally far.
struct Ring {
  double lever = 1.0;  ///< radius of the ring over the radius of the record's path and force
  double share = 1.0;  ///< share of the load that the ring carries
};
/// Returns the rings of a contact: for one that slides as a whole, a single ring of lever 1; for a disc under
/// even pressure, rings at Gauss points, which give stiffness and sliding friction exactly.
std::vector<Ring> rings_of(bool disc, Detail detail);

/// Computes forces along one path. Caches its last brushes, so that a recent shape needs no new table of its
/// law of snap lengths. For one thread.
class PathForce {
 public:
  explicit PathForce(const std::vector<PathPoint>& path, unsigned axes = 1, bool disc = false);
  ~PathForce();
  PathForce(const PathForce&) = delete;
  PathForce& operator=(const PathForce&) = delete;

  /// Returns the elastic friction (N, positive along the motion) at every wanted point, for a kinetic
  /// coefficient of 1 at `kinetic_speed` (m/s; 0: too fast to age). In the plane, all x, then all y. For a
  /// disc, torque over radius.
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
  std::list<std::unique_ptr<Brush>> made_;  // brushes computed so far, the most recently used first
};

/// Returns the force along the path for bristles that keep their snap lengths.
std::vector<double> kept_force(const std::vector<PathPoint>& path, const BrushShape& shape,
                               double presliding_length_m, Past past, Detail detail);

}  // namespace cli
