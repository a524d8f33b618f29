// The expected force of a brush along a measured path: infinitely many bristles on one axis, no random draws.
// Smooth in the parameters of the snap length, which a brush of finitely many bristles is not: what fitting
// needs.
#pragma once

#include <vector>

#include <bristle/material.hpp>

namespace cli {

/// A place of the path. Between points the motion is straight; the load of a point acts at its end.
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

/// What a snap leaves and whom it renews (core/MODEL.md; fields of Material).
struct Rubbing {
  double residual_length = 0.0;  ///< m
  double shared_renewal = 0.0;
};

/// Mean deflection in steady sliding, m.
double kinetic_deflection(const bristle::SnapLength& law, bristle::SnapRule rule, Rubbing rubbing);

/// Elastic friction (positive along the motion) at every wanted point, N, for a kinetic coefficient of 1: the
/// mean deflection over that of steady sliding, times the load. redraw: cohorts along the path.
/// keep: a stratified population; after a long slide its phases are spread evenly, so that it does not return
/// to its origin in step, which no measured surface does. It knows no rubbing.
std::vector<double> mean_brush_force(const std::vector<PathPoint>& path, const bristle::SnapLength& law,
                                     bristle::SnapRule rule, StartState start, Rubbing rubbing = {});

}  // namespace cli
