// A steady slide along a path that turns slowly: no piece of the path is taken (core/patches/COHORTS.md,
// "Glides").
#pragma once

#include "core/patches/travel.hpp"

namespace bristle::detail {

struct Cohorts;
struct CohortState;

/// Record of the path behind a patch. Lengths are scaled.
struct Course {
  double direction[2] = {0.0, 0.0};  ///< of the last step
  double length = 0.0;               ///< of the last step; 0: nothing is known
  double node[2] = {0.0, 0.0};       ///< direction of the step in whose middle the turn was measured last
  double way = 0.0;                  ///< from there to where the patch is
  double curve = 0.0;                ///< turn of the path by its length, smoothed, 1/length
  std::uint32_t known = 0;           ///< 0: `curve` was not measured yet
};

/// A steady slide whose rows stay as they were when it began, carried along: the cohorts are those rows,
/// turned as the path turned and bent as its curvature has changed since.
struct Glide : Course {
  std::uint32_t on = 0;
  double from[2] = {0.0, 0.0};  ///< tangent of the path when it began
  double from_curve = 0.0;
  // Means over the rows: deflection along `from`, deflection across it, and square of the deflection along it
  // less l_r^2. `squares`: change of the mean |z|^2 with the curvature, first and second order.
  double along = 0.0, across = 0.0, square = 0.0;
  double chord_share = 0.0;  ///< Cohorts::chord_share over the length of the mean deflection
  double squares[2] = {0.0, 0.0};
};

/// Extends a course by a step. Returns false, with nothing changed, where the path turned too much.
bool go_on(const Cohorts& r, const double (&direction)[2], double length, Course& c) noexcept;
void begin_course(const double (&direction)[2], double length, Course& c) noexcept;

/// Returns by how much this mean deflection falls short of steady sliding, scaled; 0 within the error that a
/// glide may keep. Under a law with groups or atoms the force swings as one cohort after the other snaps, and
/// carrying the patch would keep the momentary force.
double find_lack(const Cohorts& r, double along, double across, double curve) noexcept;

/// Takes a step if the patch glides; false = it does not, and nothing has changed.
bool try_glide(Patch& p, const Advance& a, StepSums& sums) noexcept;
/// ContactModel::renew_bound: goes on with a glide, or finds that nothing snaps.
Bound renew_cohort_bound(Patch& p, const Travel& t, StepSums& sums) noexcept;
/// Computes the numbers of a glide that follow from its rows.
void find_glide_means(const Patch& p, Glide& g) noexcept;
/// Writes the shared part's sum of deflections for a patch that glides.
void note_glide(Patch& p) noexcept;
/// Finds the deflection of cohort i, scaled, whether the patch glides or not.
void find_deflection(const Patch& p, std::uint32_t i, double (&z)[2]) noexcept;
/// Returns by how much the mean of |z|^2 exceeds that of the stored rows, because the curvature changed since
/// the glide began.
double glide_squares(const Cohorts& r) noexcept;
/// Carries a copy of the state and rows of a gliding patch, as stored when the glide began, to its present
/// cohorts.
void write_glide(const Patch& p, CohortState& s, double* rows) noexcept;
/// Writes the glide into the patch's own state and rows, and ends it. Does nothing if the patch does not
/// glide.
void end_glide(Patch& p) noexcept;

}  // namespace bristle::detail
