// A glide: a steady slide of an infinite brush along a path that turns slowly. Its force follows from means
// over the cohorts, so a step visits no cohort (core/patches/COHORTS.md, "Glides").
#pragma once

#include "core/patches/travel.hpp"

namespace bristle::detail {

struct Cohorts;
struct CohortState;

/// Recent path of a patch, from which a glide is recognised: direction, curvature, and distances along it in
/// scaled lengths.
struct Course {
  double direction[2] = {0.0, 0.0};  ///< direction of the last step, a unit vector
  double length = 0.0;               ///< length of the last step; 0 = there is no last step
  /// Direction of that earlier step in whose middle the curvature of the path was last measured.
  double node[2] = {0.0, 0.0};
  double way = 0.0;         ///< path from where its turning was last measured to the present place
  double curve = 0.0;       ///< curvature of the path, smoothed: its turn per scaled length
  std::uint32_t known = 0;  ///< whether the curvature has been measured, 1 or 0
};

/// State of a glide. The stored cohorts are those at its start; the present ones follow from them by turning
/// with the path and bending with the change of its curvature.
struct Glide : Course {
  std::uint32_t on = 0;
  double from[2] = {0.0, 0.0};  ///< tangent of the path at the start of the glide, a unit vector
  double from_curve = 0.0;
  // Means over the cohorts at the start of the glide: deflection along the tangent `from` of the path,
  // deflection across it, and squared deflection along it less l_r^2, with l_r the residual length.
  // `squares`: change of the mean |z|^2 with the curvature, to first and second order.
  double along = 0.0, across = 0.0, square = 0.0;
  /// Factor that gives the angle between the last step, which is a chord, and the tangent of the path:
  /// Cohorts::chord_share over the mean deflection.
  double chord_share = 0.0;
  double squares[2] = {0.0, 0.0};
};

/// Adds a step to the recent path. If the step turns too much for a glide, returns false and changes nothing.
bool go_on(const Cohorts& r, const double (&direction)[2], double length, Course& c) noexcept;
void begin_course(const double (&direction)[2], double length, Course& c) noexcept;

/// Returns by how much the mean deflection (`along` and `across` the path) falls short of steady sliding,
/// scaled; 0 within the error that a glide may keep. A slide that falls short must not glide: under a law
/// with groups of nearly equal lengths the force swings as cohorts snap in turn, and a glide would freeze a
/// momentary force.
double find_lack(const Cohorts& r, double along, double across, double curve) noexcept;

/// Makes a step as a glide if it can; otherwise returns false and changes nothing.
bool try_glide(Patch& p, const Advance& a, StepSums& sums) noexcept;
/// Continues a glide by a step, or finds that no bristle snaps in the step (ContactModel::find_new_bound).
Bound find_cohort_bound(Patch& p, const Travel& t, StepSums& sums) noexcept;
/// Computes the means over the cohorts at the start of a glide, from which its force follows.
void find_glide_means(const Patch& p, Glide& g) noexcept;
/// Updates the patch's sum of deflections, from which its force follows, from the means of its glide.
void note_glide(Patch& p) noexcept;
/// Finds the deflection of cohort i, scaled, whether or not the patch glides.
void find_deflection(const Patch& p, std::uint32_t i, double (&z)[2]) noexcept;
/// Returns by how much the mean of |z|^2, with z the deflection, has changed since the start of a glide
/// because the path curves.
double glide_squares(const Cohorts& r) noexcept;
/// Turns and bends a copy of a gliding patch's cohorts, stored as at the start of the glide, to their present
/// state.
void write_glide(const Patch& p, CohortState& s, double* rows) noexcept;
/// Ends a glide: replaces the stored cohorts, those of its start, by the present ones. Does nothing if the
/// patch does not glide.
void end_glide(Patch& p) noexcept;

}  // namespace bristle::detail
