// Steps a glide: a steady slide of an infinite brush along a path that turns slowly.
#include "core/patches/cohorts/glide.hpp"

#include <algorithm>
#include <cmath>

#include "core/patches/cohorts/cohorts.hpp"

namespace bristle::detail {
namespace {

constexpr double bend = 0x1p-10;  // largest angle between path and arc within a step of a glide, rad
// Largest angle, rad, between path and arc in a step that is longer than the path which bristles remember.
constexpr double long_bend = 1.0 / 32;

/// Shortest step, scaled, whose direction is trusted. Rounding of positions would turn a shorter one by more
/// than 2^-14.
constexpr double shortest_chord = 0x1p-30;

double cross(const double (&a)[2], const double (&b)[2]) noexcept { return a[0] * b[1] - a[1] * b[0]; }

/// Circular arc by which the end of a patch's path is described. Its tangent and curvature determine how
/// cohorts are bent.
struct Arc {
  double tangent[2];
  double curve;
};

/// Finds the arc that bends bristles as the last steps have bent them. Steps are chords of the path, so the
/// tangent at the end is the last chord turned by a small angle, c (h / 2 - h^2 / (12 f)) with the curvature
/// c, the length h of the chord and the mean deflection f, without residual. `chord_share`: factor of c h^2.
Arc find_arc(const Cohorts& r, const Course& c, double chord_share) noexcept {
  if (c.length >= r.long_step) return {{c.direction[0], c.direction[1]}, 0.0};
  const double turned = c.curve * c.length * (0.5 - c.length * chord_share);
  const double cosine2 = 1.0 - turned * turned;
  const double even = cosine2 < 1.0 ? std::sqrt(cosine2) : 1.0;  // computes no square root on a straight path
  return {{c.direction[0] * even - c.direction[1] * turned, c.direction[1] * even + c.direction[0] * turned},
          c.curve};
}

/// Calculates the mean deflection of the bristles in a glide whose path ends with a given arc, from which the
/// force follows.
void find_mean(const Glide& g, const Arc& arc, double (&z)[2]) noexcept {
  const double across = g.across - (arc.curve - g.from_curve) * (0.5 * g.square);
  z[0] = g.along * arc.tangent[0] - across * arc.tangent[1];
  z[1] = g.along * arc.tangent[1] + across * arc.tangent[0];
}

double squares_at(const Glide& g, const Arc& arc) noexcept {
  const double change = arc.curve - g.from_curve;
  return change * (change * g.squares[1] - g.squares[0]);
}

/// Rotation and bend that turn a deflection stored at the start of a glide into the one at the present end of
/// the path.
struct Turned {
  const Glide& g;
  const Arc arc;
  double residual_square;

  Turned(const Cohorts& r, const Glide& glide)
      : g(glide), arc(find_arc(r, glide, glide.chord_share)), residual_square(square(r.law.residual)) {}
  static double square(double x) noexcept { return x * x; }
  void operator()(double (&z)[2]) const noexcept {
    const double along = z[0] * g.from[0] + z[1] * g.from[1];
    const double across = z[1] * g.from[0] - z[0] * g.from[1] -
                          (arc.curve - g.from_curve) * 0.5 * (along * along - residual_square);
    z[0] = along * arc.tangent[0] - across * arc.tangent[1];
    z[1] = along * arc.tangent[1] + across * arc.tangent[0];
  }
};

void begin_glide(const Patch& p, const Cohorts& r, Glide& g) noexcept {
  double z[2];
  for (int axis = 0; axis < 2; ++axis) z[axis] = place(p, r, axis) - r.moment[axis] / r.mass;
  const Arc arc = find_arc(r, g, r.chord_share / std::sqrt(z[0] * z[0] + z[1] * z[1]));
  for (int axis = 0; axis < 2; ++axis) g.from[axis] = arc.tangent[axis];
  g.from_curve = arc.curve;
  g.on = 1;
  find_glide_means(p, g);
}

/// Moves the patch along one axis together with the base of its cohorts' places, so that deflections stay as
/// they are.
void move_along(Patch& p, Cohorts& r, int axis, std::int64_t to, std::int64_t sum) noexcept {
  r.base[axis] = sum_of(r.base[axis], difference(to, p.position[axis]));
  p.position[axis] = r.slid_to[axis] = p.part_position[axis] = to;
  p.part_sum[axis] = 0;
  p.sum[axis] = sum;
}

std::int64_t units_of(double mass_length) noexcept { return std::llrint(mass_length * sum_per_mass_length); }

}  // namespace

double find_lack(const Cohorts& r, double along, double across, double curve) noexcept {
  const double allowed = std::max(0.032 / (static_cast<double>(r.pieces) * r.pieces), 5e-4);
  const double bent = curve * r.memory;
  const double kinetic = r.material->kinetic;
  const double lack = kinetic - std::sqrt(along * along + across * across);
  return std::abs(lack) <= kinetic * (allowed + 0.5 * bent * bent) ? 0.0 : lack;
}

void begin_course(const double (&direction)[2], double length, Course& c) noexcept {
  for (int axis = 0; axis < 2; ++axis) c.direction[axis] = c.node[axis] = direction[axis];
  c.length = length;
  c.way = 0.5 * length;
  c.curve = 0.0;
  c.known = 0;
}

bool go_on(const Cohorts& r, const double (&direction)[2], double length, Course& c) noexcept {
  if (c.length == 0.0) return false;
  if (!(direction[0] * c.node[0] + direction[1] * c.node[1] > 0.5)) return false;
  if (length >= r.long_step) {
    if (!(std::abs(cross(c.direction, direction)) <= long_bend)) return false;
    begin_course(direction, length, c);
    c.known = 1;
    return true;
  }
  // Takes a path of steps of at least `long_step` as straight, because such steps do not show its curvature.
  const bool known = c.known != 0 && c.length < r.long_step;
  const double distance = c.way + 0.5 * length;
  const double turned = cross(c.node, direction);
  // Allows only a smaller turn right after a step of at least `long_step`. Bristles remember nothing from
  // before that straight step, so a turn at its end is a corner.
  if (!(std::abs(turned) <= (c.length < r.long_step ? 2.0 * long_bend : bend))) return false;
  if (length < shortest_chord) {
    c.way += length;
    return true;
  }
  if (known && !(std::abs(turned - c.curve * distance) <= bend)) return false;
  if (distance >= r.node_distance) {
    const double measured = turned / distance;
    const double x = distance * r.per_lag;
    // Share of a change of curvature that the force has followed after a distance x, in units of the force's
    // lag. It approximates 1 - exp(-x).
    const double share = known ? std::min(1.0, x / (1.0 + 0.6 * x)) : 1.0;
    const double curve = c.curve + (measured - c.curve) * share;
    if (!(std::abs(curve) <= r.highest_curve)) return false;
    c.curve = curve;
    c.known = 1;
    c.way = 0.5 * length;
    for (int axis = 0; axis < 2; ++axis) c.node[axis] = direction[axis];
  } else {
    c.known = known ? 1 : 0;
    c.way += length;
  }
  for (int axis = 0; axis < 2; ++axis) c.direction[axis] = direction[axis];
  c.length = length;
  return true;
}

void find_glide_means(const Patch& p, Glide& g) noexcept {
  const Cohorts& r = cohorts(p);
  const double at[2] = {place(p, r, 0), place(p, r, 1)};
  const double residual_square = r.law.residual * r.law.residual;
  double along = 0.0, across = 0.0, square = 0.0;
  double first = 0.0, second = 0.0;
  for (std::uint32_t i = 0; i < r.count; ++i) {
    const double mass = mass_of(r.rows, i);
    const double zx = at[0] - entry(r.rows, i, cohort_x);
    const double zy = at[1] - entry(r.rows, i, cohort_y);
    const double u = zx * g.from[0] + zy * g.from[1];
    const double w = zy * g.from[0] - zx * g.from[1];
    const double beyond = u * u - residual_square;
    along += mass * u;
    across += mass * w;
    square += mass * beyond;
    first += mass * (w * beyond);
    second += mass * (0.25 * beyond * beyond);
  }
  g.along = along / r.mass;
  g.across = across / r.mass;
  g.square = square / r.mass;
  g.chord_share = r.chord_share / std::sqrt(g.along * g.along + g.across * g.across);
  g.squares[0] = first / r.mass;
  g.squares[1] = second / r.mass;
}

bool try_glide(Patch& p, const Advance& a, StepSums& sums) noexcept {
  Cohorts& r = cohorts(p);
  if (!r.glides || !(r.run >= r.follow)) return false;
  if (p.position[0] != r.slid_to[0] || p.position[1] != r.slid_to[1]) return false;
  Course next = r.glide;
  if (!go_on(r, a.direction, a.length, next)) return false;

  Glide begun;
  if (r.glide.on == 0) {
    begun = r.glide;
    begin_glide(p, r, begun);
    if (!r.material->survival().smooth && find_lack(r, begun.along, begun.across, begun.from_curve) != 0.0)
      return false;
  }
  const Glide& g = r.glide.on != 0 ? r.glide : begun;
  const Arc arc = find_arc(r, next, g.chord_share);
  double z[2];
  find_mean(g, arc, z);
  std::int64_t end[2] = {units_of(r.mass * z[0]), p.axes == 2 ? units_of(r.mass * z[1]) : 0};
  double twice_mean[2] = {0.0, 0.0};
  const bool is_long = a.length >= r.long_step;
  for (int axis = 0; axis < p.axes; ++axis) {
    sums.end[axis] = static_cast<double>(end[axis]);
    twice_mean[axis] = (is_long ? sums.end[axis] : to_double(p.sum[axis])) + sums.end[axis];
    // Adds the force along a long step, which for most of its length equals the force at its end. Bristles
    // bent by u before a turn by the angle a stay bent by a u aside until they snap; integrated over the
    // step, that is a (u^2 - l_r^2) / 2.
    if (is_long)
      twice_mean[axis] -= (axis == 0 ? -arc.tangent[1] : arc.tangent[0]) * r.mass * sum_per_mass_length *
                          (cross(r.glide.direction, a.direction) * g.square / a.length);
    if (has(p.outputs, Outputs::mean)) sums.twice_mean[axis] = twice_mean[axis];
  }
  if (has(p.outputs, Outputs::energy)) {
    const double along =
        twice_mean[0] * a.direction[0] + (p.axes == 2 ? twice_mean[1] * a.direction[1] : 0.0);
    const double stored = r.mass * (squares_at(g, arc) - squares_at(g, find_arc(r, r.glide, g.chord_share)));
    const double length = std::min(a.length, 1e140);  // limits the path so that products stay finite
    const double lost = length * (along / sum_per_mass_length) - stored;
    sums.dissipated = std::min(joules_per_unit(p) * lost, highest_energy);
    const double snapped =
        std::min(r.mass * (length * r.law.snap_rate) / r.units_per_bristle() + r.snap_fraction, 9e18);
    const double whole = std::floor(snapped);
    sums.snaps = static_cast<std::uint64_t>(whole);
    if (a.commit != 0) r.snap_fraction = snapped - whole;
  }
  if (a.commit == 0) return true;
  if (r.glide.on == 0) r.glide = begun;
  static_cast<Course&>(r.glide) = next;
  for (int axis = 0; axis < 2; ++axis) {
    // Leaves position and places as they are in a far step (in which every bristle snaps), because fixed
    // point cannot store its displacement.
    move_along(p, r, axis, a.snaps_all != 0 ? p.position[axis] : a.to[axis], end[axis]);
  }
  p.known = Bound::glide;
  return true;
}

Bound find_cohort_bound(Patch& p, const Travel& t, StepSums& sums) noexcept {
  Cohorts& r = cohorts(p);
  Glide& g = r.glide;
  if (g.on != 0) {
    if (p.position[0] != r.slid_to[0] || p.position[1] != r.slid_to[1]) return Bound::none;
    if (!go_on(r, t.direction, t.length, g)) return Bound::none;
    double z[2];
    find_mean(g, find_arc(r, g, g.chord_share), z);
    for (int axis = 0; axis < 2; ++axis) {
      const std::int64_t sum = units_of(r.mass * z[axis]);
      move_along(p, r, axis, t.to[axis], sum);
      sums.end[axis] = static_cast<double>(sum);
    }
    return Bound::glide;
  }
  // Checks only the end of the step. A cohort's deflection is a convex function along a step, so a cohort
  // within its reach at both ends is within it all along.
  if (!r.glides || r.count == 0 || t.length > r.law.piece) return Bound::none;
  const double at[2] = {to_lengths(difference(t.to[0], r.base[0])),
                        to_lengths(difference(t.to[1], r.base[1]))};
  const double slack = r.kernels->find_slack(r.law, r, r.rows, at) - bound_margin;
  if (!(slack >= 0.0)) return Bound::none;
  if (slack > t.length) note_bound(p, {{t.to[0], t.to[1]}, slack});
  return Bound::ball;
}

void note_glide(Patch& p) noexcept {
  const Cohorts& r = cohorts(p);
  double z[2];
  find_mean(r.glide, find_arc(r, r.glide, r.glide.chord_share), z);
  for (int axis = 0; axis < p.axes; ++axis) p.sum[axis] = units_of(r.mass * z[axis]);
}

void find_deflection(const Patch& p, std::uint32_t i, double (&z)[2]) noexcept {
  const Cohorts& r = cohorts(p);
  z[0] = place(p, r, 0) - entry(r.rows, i, cohort_x);
  z[1] = place(p, r, 1) - entry(r.rows, i, cohort_y);
  if (r.glide.on != 0) Turned(r, r.glide)(z);
}

double glide_squares(const Cohorts& r) noexcept {
  return r.glide.on == 0 ? 0.0 : squares_at(r.glide, find_arc(r, r.glide, r.glide.chord_share));
}

void write_glide(const Patch& p, CohortState& s, double* rows) noexcept {
  const Cohorts& r = cohorts(p);
  const Turned turned(r, r.glide);
  const double at[2] = {place(p, r, 0), place(p, r, 1)};
  const auto turn = [&](double& x, double& y) {
    double z[2] = {at[0] - x, at[1] - y};
    turned(z);
    x = at[0] - z[0];
    y = at[1] - z[1];
  };
  for (std::uint32_t i = 0; i < s.count; ++i) turn(entry(rows, i, cohort_x), entry(rows, i, cohort_y));
  for (int k = 0; k < 2; ++k)
    if (s.open[k] != no_cohort) turn(s.begin[k][0], s.begin[k][1]);
  find_moment(s, rows);
}

void end_glide(Patch& p) noexcept {
  Cohorts& r = cohorts(p);
  if (r.glide.on == 0) return;
  write_glide(p, r, r.rows);
  r.glide.on = 0;
  for (int axis = 0; axis < p.axes; ++axis) p.sum[axis] = deflections_at(r, place(p, r, axis), axis);
}

}  // namespace bristle::detail
