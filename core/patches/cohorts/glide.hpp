// A glide: a steady slide along a path that turns slowly, stepped without pieces (core/patches/COHORTS.md,
// "Glides").
#pragma once

#include "core/patches/travel.hpp"

namespace bristle::detail {

struct Cohorts;
struct CohortState;

/// The recent course of a patch's path: direction and curvature. Lengths are scaled.
struct Course {
  double direction[2] = {0.0, 0.0};  ///< direction of the last step
  double length = 0.0;               ///< length of the last step; 0: nothing is known
  double node[2] = {0.0, 0.0};       ///< direction of the step in whose middle the turn was last measured
  double way = 0.0;                  ///< path from that middle to the patch
  double curve = 0.0;                ///< turn of the path per length, smoothed, 1/length
  std::uint32_t known = 0;           ///< 0: `curve` was not measured yet
};

/// A steady slide with the rows stored at its start. The present cohorts are those rows, turned as the path
/// has turned and bent as its curvature has changed since.
struct Glide : Course {
  std::uint32_t on = 0;
  double from[2] = {0.0, 0.0};  ///< tangent of the path at the start of the glide
  double from_curve = 0.0;
  // Means over the rows: deflection along `from`, deflection across it, and square of the deflection along it
  // less l_r^2. `squares`: change of the mean |z|^2 with the curvature, first and second order.
  double along = 0.0, across = 0.0, square = 0.0;
  double chord_share = 0.0;  ///< Cohorts::chord_share over the length of the mean deflection
  double squares[2] = {0.0, 0.0};
};

/// Extends a course by a step. Returns false, with nothing changed, if the path turned too much.
bool go_on(const Cohorts& r, const double (&direction)[2], double length, Course& c) noexcept;
void begin_course(const double (&direction)[2], double length, Course& c) noexcept;

/// Returns by how much this mean deflection falls short of steady sliding, scaled; 0 within the error that a
/// glide may keep. Under a law with groups or atoms the force swings as one cohort after the other snaps, and
/// a glide would freeze it at a momentary value.
double find_lack(const Cohorts& r, double along, double across, double curve) noexcept;

/// Takes a step if the patch glides; else returns false and changes nothing.
bool try_glide(Patch& p, const Advance& a, StepSums& sums) noexcept;
/// Implements ContactModel::renew_bound: continues a glide, or finds that nothing snaps.
Bound renew_cohort_bound(Patch& p, const Travel& t, StepSums& sums) noexcept;
/// Computes the means of a glide from its rows.
void find_glide_means(const Patch& p, Glide& g) noexcept;
/// Writes the shared part's sum of deflections for a patch that glides.
void note_glide(Patch& p) noexcept;
/// Finds the deflection of cohort i, scaled, whether the patch glides or not.
void find_deflection(const Patch& p, std::uint32_t i, double (&z)[2]) noexcept;
/// Returns by how much the mean of |z|^2 exceeds that of the stored rows, because the curvature has changed
/// since the glide began.
double glide_squares(const Cohorts& r) noexcept;
/// Carries a copy of the state and rows of a gliding patch, as stored when the glide began, to its present
/// cohorts.
void write_glide(const Patch& p, CohortState& s, double* rows) noexcept;
/// Writes the glide into the patch's own state and rows, and ends it. Does nothing if the patch does not
/// glide.
void end_glide(Patch& p) noexcept;

}  // namespace bristle::detail
