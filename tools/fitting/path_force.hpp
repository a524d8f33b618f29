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
  double x = 0.0;      ///< m
  double load = 0.0;   ///< N
  bool wanted = true;  ///< the force here is wanted; else a place passed on the way (a turning point)
};

/// How the bristles stand at the first point.
enum class StartState : unsigned char {
  straight,  ///< set down there
  forward,   ///< after a long slide towards +x
  backward   ///< after a long slide towards -x
};

/// What a population that keeps its lengths knows of the way that it came.
enum class Memory : unsigned char {
  forgotten,  ///< a long slide spreads its phases evenly: no place is met again as it was
  whole       ///< all: where they were straight together they are so again
};

/// What lies before the record, and what of it counts.
struct Past {
  StartState start = StartState::straight;
  Memory memory = Memory::forgotten;
  friend bool operator==(const Past&, const Past&) = default;
};

/// What shapes the elastic force; lengths are shares of the presliding length.
struct BrushShape {
  bristle::SnapLaw law = bristle::SnapLaw::lognormal;
  bristle::SnapRule rule = bristle::SnapRule::redraw;
  double spread = 0.3;
  double residual_share = 0.0;  ///< keep: not used
  double shared_renewal = 0.0;  ///< keep: not used
  friend bool operator==(const BrushShape&, const BrushShape&) = default;

  /// A material of this shape whose friction is that of one bristle stiffness and one bristle per newton.
  bristle::Material material(double presliding_length_m) const;
};

/// How finely the force is computed.
enum class Detail : unsigned char {
  search,  ///< redraw: within 0.2 % rms; keep: 512 bristles
  finish   ///< redraw: within 0.05 % rms; keep: 2048 bristles
};

/// Computes forces along one path. Keeps the brushes that it made: a shape that was asked for lately costs no
/// table of its law again. For one thread.
class PathForce {
 public:
  explicit PathForce(const std::vector<PathPoint>& path);
  ~PathForce();
  PathForce(const PathForce&) = delete;
  PathForce& operator=(const PathForce&) = delete;

  /// Elastic friction (positive along the motion) at every wanted point, N, for a kinetic coefficient of 1.
  std::vector<double> find(const BrushShape& shape, double presliding_length_m, Past past, Detail detail);

 private:
  struct Infinite;
  Infinite& infinite(const BrushShape& shape, Detail detail);

  const std::vector<PathPoint>& path_;
  double most_load_ = 0.0;
  std::list<std::unique_ptr<Infinite>> made_;  // the last used first
};

/// The same for bristles that keep their lengths.
std::vector<double> kept_force(const std::vector<PathPoint>& path, const BrushShape& shape,
                               double presliding_length_m, Past past, Detail detail);

}  // namespace cli
