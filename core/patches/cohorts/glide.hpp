// A glide: a steady slide along a path that turns slowly, whose force is calculated from means over the
// cohorts without visiting them (core/patches/COHORTS.md, "Glides").
#pragma once

#include "core/patches/travel.hpp"

namespace bristle::detail {

struct Cohorts;
struct CohortState;

/// The recent path of a patch: its direction and curvature. Lengths are scaled.
struct Course {
  double direction[2] = {0.0, 0.0};  ///< direction of the last step
  double length = 0.0;               ///< length of the last step; 0 = no step is known
  double node[2] = {0.0, 0.0};       ///< direction of the step in whose middle the turning of the path was
                                     ///< last measured
  double way = 0.0;                  ///< length of path from the middle of that step to the present position
  double curve = 0.0;                ///< smoothed curvature of the path: its turn per scaled length
  std::uint32_t known = 0;           ///< whether `curve` has been measured
};

/// A steady slide whose cohorts are stored as they were at its start. The present cohorts are these, turned
/// as the path has turned and bent as its curvature has changed since.
struct Glide : Course {
  std::uint32_t on = 0;
  double from[2] = {0.0, 0.0};  ///< tangent of the path at the start of the glide, a unit vector
  double from_curve = 0.0;
  // Means over the stored cohorts: deflection along `from`, deflection across `from`, and square of the
  // deflection along it less l_r^2. `squares`: how the mean |z|^2 changes with the curvature, to first and
  // second order.
  double along = 0.0, across = 0.0, square = 0.0;
  double chord_share = 0.0;  ///< Cohorts::chord_share over the magnitude of the mean deflection, for the
                             ///< angle from the last step to the tangent of the path
  double squares[2] = {0.0, 0.0};
};

/// Adds a step to a course. Returns false, and changes nothing, if the path turned too much for a glide.
bool go_on(const Cohorts& r, const double (&direction)[2], double length, Course& c) noexcept;
void begin_course(const double (&direction)[2], double length, Course& c) noexcept;

/// Returns by how much the mean deflection (along and across the path) falls short of steady sliding, scaled;
/// 0 within the error that a glide may keep. Under a law with groups of lengths or atoms the force swings as
/// one cohort after the other snaps, and a glide would freeze it at a momentary value.
double find_lack(const Cohorts& r, double along, double across, double curve) noexcept;

/// Makes a step as a glide if the patch may glide along it; otherwise returns false and changes nothing.
bool try_glide(Patch& p, const Advance& a, StepSums& sums) noexcept;
/// Continues a glide, or finds that no bristle snaps (ContactModel::renew_bound).
Bound renew_cohort_bound(Patch& p, const Travel& t, StepSums& sums) noexcept;
/// Computes the means over the stored cohorts of a glide.
void find_glide_means(const Patch& p, Glide& g) noexcept;
/// Updates Patch::sum, the sum of deflections, of a patch that glides.
void note_glide(Patch& p) noexcept;
/// Finds the deflection of cohort i, scaled, whether the patch glides or not.
void find_deflection(const Patch& p, std::uint32_t i, double (&z)[2]) noexcept;
/// Returns by how much the mean of |z|^2 exceeds its value at the start of the glide, because of a changed
/// curvature.
double glide_squares(const Cohorts& r) noexcept;
/// Turns and bends a copy of the state and cohorts of a gliding patch, which are stored as they were at its
/// start, to those at present.
void write_glide(const Patch& p, CohortState& s, double* rows) noexcept;
/// Writes the present cohorts into the patch's own state, and ends the glide. Does nothing if the patch does
/// not glide.
void end_glide(Patch& p) noexcept;

}  // namespace bristle::detail
