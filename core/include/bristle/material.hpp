// The friction material: the properties of two surfaces in contact, without the normal load.
#pragma once

#include "bristle/export.hpp"
#include "bristle/set_field.hpp"
#include "bristle/snap_length.hpp"

namespace bristle {

/// Largest coefficient of variation of the snap length that representatives accept with SnapRule::redraw.
/// Under a wider law they forget their past too slowly for long steps.
constexpr double widest_redraw_cv = 1.25;

/// Largest Material::residual_length, in mean snap lengths; also the largest Material::shared_renewal.
constexpr double largest_residual = 64.0;
constexpr double largest_renewal = 16.0;

/// Largest Material::drop.
constexpr double largest_drop = 0.95;

/// Behaviour of a bristle that is bent by its snap length. `redraw` and `keep` are two readings of the paper,
/// section 2.1.
enum class SnapRule : unsigned char {
  /// Samples a new snap length at each snap: the bristle "is then replaced by another bristle". The default.
  /// Representatives take laws with a coefficient of variation up to widest_redraw_cv.
  redraw,
  keep,  ///< every bristle keeps its snap length for ever: "delta of bristle lambda"
  /// Nothing snaps: a bristle slides, bent by its snap length, until the motion reverses (Maxwell slip,
  /// Iwan, Prandtl and Ishlinskii). Has no residual and no renewal; takes every law.
  slide
};

/// Decay of the bristle damper with speed (eq. 5).
enum class DamperDecay : unsigned char {
  exponential,  ///< exp(-|v|/vs), the reading of the paper's formula. The default.
  gaussian      ///< exp(-(v/vs)^2), the form of Canudas de Wit et al. that the paper cites.
};

/// Growth of a bristle's snap length with its age a, the time since it last snapped, was renewed or came into
/// contact (with SnapRule::slide: since it last slid). A bristle of age a has the snap length delta g(a).
/// Both forms of g are concave.
enum class AgeingForm : unsigned char {
  logarithmic,  ///< g = 1 + strength ln(1 + a / time): metals, rock, paper, polymers. The default.
  saturating    ///< g = 1 + strength (1 - exp(-a / time)): skin on glass
};

struct Ageing {
  AgeingForm form = AgeingForm::logarithmic;
  double strength = 0.0;  ///< factor (beta or gain) of the growth of snap lengths; 0 = no ageing
  double time = 1.0;      ///< cut-off time tau of the logarithm, or time constant of saturation, s

  static Ageing logarithmic(double beta, double cutoff_s) {
    return {AgeingForm::logarithmic, beta, cutoff_s};
  }
  static Ageing saturating(double gain, double time_s) { return {AgeingForm::saturating, gain, time_s}; }
};

/// Largest Material::ageing_strength. The two constants below it are the limits of Material::ageing_time, s.
constexpr double largest_ageing = 1.0;
constexpr double shortest_ageing_time = 1e-9;
constexpr double longest_ageing_time = 1e9;

/// Lowest speed, m/s, for which closed forms are evaluated (an atom's diameter in a century). Slower sliding
/// counts as this speed, because with logarithmic ageing friction has no bound as the speed falls to 0.
constexpr double slowest_sliding = 1e-19;

/// Value of Coefficients::kinetic_speed that means sliding so fast that no bristle ages.
constexpr double beyond_ageing = 0.0;

/// The usual coefficients of a pair of surfaces, from which Material::from_coefficients makes a material.
///
/// Ageing (struct Ageing) is given by its effects: friction falls with speed and grows at rest. The default
/// is none. By default a snap leaves a tenth of the presliding length and renews another bristle, so a
/// contact that is rubbed to and fro does not harden (core/MODEL.md, section 26). Coefficients::paper() has
/// no residual and no renewal.
///
/// With SnapRule::slide nothing snaps: residual_share and shared_renewal have no effect, `drop` gives the
/// peak, and growth_per_decade lets a bristle bear more the longer it has not slid.
struct Coefficients {
  double kinetic = 0.40;  ///< friction over normal load in sliding, see kinetic_speed

  /// Highest friction over normal load at first loading. 0: follows from `spread`. A peak equal to `kinetic`
  /// means that friction rises without a peak, and takes the least spread for that (some 0.4 for redrawn
  /// lognormal lengths).
  double peak = 0.46;
  double presliding_length = 10e-6;    ///< mean deflection at a snap, m: residual plus mean snap length
  double bristles_per_newton = 900.0;  ///< bristles in contact over normal load, 1/N: zeta / N of eq. (9)
  SnapLaw law = SnapLaw::lognormal;    ///< family of snap lengths; its spread is given or follows from `peak`
  SnapRule rule = SnapRule::redraw;
  double damping_per_newton = 0.0;  ///< damping coefficient of all bristles at rest over normal load, s/m
  double viscous_friction = 0.0;    ///< viscous friction of the lubricant (sigma2), N s/m
  double stribeck_velocity = 1e-3;  ///< speed vs at which bristle dampers have decayed to 1/e, m/s
  DamperDecay damper_decay = DamperDecay::exponential;
  double residual_share = 0.1;  ///< share of the presliding length that a snap leaves: l_r / (l_r + E[delta])
  double shared_renewal = 1.0;  ///< kappa, Material::shared_renewal
  double kinetic_speed = beyond_ageing;  ///< speed at which `kinetic` and `peak` apply, m/s

  /// Share of the kinetic friction that is lost per decade of speed: the slope at kinetic_speed. With
  /// beyond_ageing, the slope of slow sliding to first order: ln 10 beta times the share of friction beyond
  /// the residual.
  double fall_per_decade = 0.0;
  /// Growth of the static friction per decade of time at rest, over the kinetic friction, to first order:
  /// about twice fall_per_decade, and may be given instead (AgeingForm::logarithmic only).
  double growth_per_decade = 0.0;
  double ageing_time = 1.0;  ///< Material::ageing_time, s
  AgeingForm ageing_form = AgeingForm::logarithmic;
  double speed_strengthening = 0.0;   ///< Material::speed_strengthening; not part of `kinetic`
  double strengthening_speed = 1e-6;  ///< Material::strengthening_speed, m/s

  /// Standard deviation over mean of the snap length (for a normal law, before its cut at 0). 0: the smallest
  /// spread that gives `peak`. If both `spread` and `peak` are given, they must agree.
  double spread = 0.0;
  /// Share of its limit that a sliding bristle loses (Material::drop), for SnapRule::slide. 0: follows from
  /// `peak`. With this rule a `spread` of 0 means 0.3, whatever the peak (single and exponential laws have no
  /// free spread).
  double drop = 0.0;

  /// Returns the coefficients of Zhang and Phillips' paper: a snap leaves no residual and renews no other
  /// bristle. Rubbed to and fro by about its presliding length such a contact hardens.
  static Coefficients paper() { return Coefficients{}.with_residual_share(0.0).with_shared_renewal(0.0); }

  Coefficients& with_kinetic(double value) { return detail::set(*this, kinetic, value); }
  /// Sets the peak of friction over normal load at first loading; the spread of the snap lengths follows from
  /// it.
  Coefficients& with_peak(double value) {
    peak = value;
    spread = 0.0;
    return *this;
  }
  /// Sets the spread of the snap lengths (standard deviation over mean); the peak of friction follows from
  /// it.
  Coefficients& with_spread(double value) {
    spread = value;
    peak = 0.0;
    return *this;
  }
  /// Sets `drop`, the share of its limit that a bristle loses while it slides (SnapRule::slide); the peak
  /// follows from it.
  Coefficients& with_drop(double value) {
    drop = value;
    peak = 0.0;
    return *this;
  }
  Coefficients& with_presliding_length(double metres) {
    return detail::set(*this, presliding_length, metres);
  }
  Coefficients& with_bristles_per_newton(double value) {
    return detail::set(*this, bristles_per_newton, value);
  }
  Coefficients& with_law(SnapLaw value) { return detail::set(*this, law, value); }
  Coefficients& with_rule(SnapRule value) { return detail::set(*this, rule, value); }
  Coefficients& with_damping_per_newton(double value) {
    return detail::set(*this, damping_per_newton, value);
  }
  Coefficients& with_viscous_friction(double value) { return detail::set(*this, viscous_friction, value); }
  Coefficients& with_stribeck_velocity(double value) { return detail::set(*this, stribeck_velocity, value); }
  Coefficients& with_damper_decay(DamperDecay value) { return detail::set(*this, damper_decay, value); }
  Coefficients& with_residual_share(double value) { return detail::set(*this, residual_share, value); }
  Coefficients& with_shared_renewal(double value) { return detail::set(*this, shared_renewal, value); }
  Coefficients& with_kinetic_speed(double metres_per_second) {
    return detail::set(*this, kinetic_speed, metres_per_second);
  }
  Coefficients& with_fall_per_decade(double share) { return detail::set(*this, fall_per_decade, share); }
  Coefficients& with_growth_per_decade(double share) { return detail::set(*this, growth_per_decade, share); }
  Coefficients& with_ageing_time(double seconds) { return detail::set(*this, ageing_time, seconds); }
  Coefficients& with_ageing_form(AgeingForm value) { return detail::set(*this, ageing_form, value); }
  Coefficients& with_speed_strengthening(double per_e_fold, double speed_m_per_s) {
    speed_strengthening = per_e_fold;
    strengthening_speed = speed_m_per_s;
    return *this;
  }
};

/// Bristle parameters, SI units. Plain data; validate(), coefficients() and the calls that add or change
/// patches check it. The defaults are a surface with kinetic coefficient 0.4 at 900 bristles per newton.
struct BRISTLE_API Material {
  double bristle_stiffness = 82.05128205128205;  ///< tangential stiffness sigma0 of a bristle, N/m, >= 0
  double bristle_damping = 0.0;                  ///< damper sigma1 of a bristle at rest, N s/m, >= 0
  double viscous_friction = 0.0;                 ///< viscous friction sigma2 of lubricant, N s/m, >= 0
  double stribeck_velocity = 1e-3;               ///< decay speed vs of dampers, m/s, >= 0; 0 = no dampers
  double normal_stiffness = 1111.111111111111;   ///< normal stiffness sigma_perp of a bristle, N/m, > 0
  double asperity_height_deviation = 1e-6;       ///< deviation sigma of exponential heights (eq. 6), m, > 0
  SnapLength snap_length;                        ///< law of the snap length delta
  SnapRule snap_rule = SnapRule::redraw;
  DamperDecay damper_decay = DamperDecay::exponential;
  /// Residual length l_r, m, >= 0: a bristle snaps when it is bent by l_r + delta, and stays bent by l_r
  /// along the motion. At 0, the paper's value, a bristle is straight after a snap.
  double residual_length = 0.0;
  /// Shared renewal kappa, >= 0: mean number of bristles of the same patch that a snap renews, among those
  /// bent along the motion by more than l_r. 0 = none, as in the paper.
  double shared_renewal = 0.0;
  /// Form, strength (>= 0; 0 = none, as in the paper) and time (s) of the growth of snap lengths at rest: see
  /// struct Ageing.
  AgeingForm ageing_form = AgeingForm::logarithmic;
  double ageing_strength = 0.0;
  double ageing_time = 1.0;
  /// Friction of the whole patch that grows with speed v: a N asinh(v / (2 v*)) under the load N. The
  /// strengthening a >= 0 (0 = none) is friction over load per e-fold of speed; v* > 0 is in m/s.
  double speed_strengthening = 0.0;
  double strengthening_speed = 1e-6;
  /// SnapRule::slide, 0 to largest_drop: a sliding bristle bears only (1 - drop) of its snap length until it
  /// sticks again. It sticks after a step in which it does not slide, or at a reversal of the motion.
  double drop = 0.0;

  Material& with_bristle_stiffness(double newtons_per_metre) {
    return detail::set(*this, bristle_stiffness, newtons_per_metre);
  }
  Material& with_bristle_damping(double newton_seconds_per_metre) {
    return detail::set(*this, bristle_damping, newton_seconds_per_metre);
  }
  Material& with_viscous_friction(double newton_seconds_per_metre) {
    return detail::set(*this, viscous_friction, newton_seconds_per_metre);
  }
  Material& with_stribeck_velocity(double metres_per_second) {
    return detail::set(*this, stribeck_velocity, metres_per_second);
  }
  Material& with_normal_stiffness(double newtons_per_metre) {
    return detail::set(*this, normal_stiffness, newtons_per_metre);
  }
  Material& with_asperity_height_deviation(double metres) {
    return detail::set(*this, asperity_height_deviation, metres);
  }
  Material& with_snap_length(const SnapLength& law) { return detail::set(*this, snap_length, law); }
  Material& with_snap_rule(SnapRule rule) { return detail::set(*this, snap_rule, rule); }
  Material& with_damper_decay(DamperDecay decay) { return detail::set(*this, damper_decay, decay); }
  Material& with_residual_length(double metres) { return detail::set(*this, residual_length, metres); }
  Material& with_shared_renewal(double bristles_per_snap) {
    return detail::set(*this, shared_renewal, bristles_per_snap);
  }
  Material& with_drop(double share) { return detail::set(*this, drop, share); }
  Material& with_ageing(const Ageing& ageing) {
    ageing_form = ageing.form;
    ageing_strength = ageing.strength;
    ageing_time = ageing.time;
    return *this;
  }
  Material& with_speed_strengthening(double per_e_fold, double speed_m_per_s) {
    speed_strengthening = per_e_fold;
    strengthening_speed = speed_m_per_s;
    return *this;
  }

  /// Checks all parameters. Throws bristle::Error that names the first one out of range, its value and the
  /// range.
  void validate() const;
  /// Checks as validate(), and refuses what representatives cannot do: a law wider than widest_redraw_cv with
  /// SnapRule::redraw. PatchBatch::add throws the same error for representatives; a program that reads
  /// materials from a file calls this where it can name the line.
  void validate_for_representatives() const;

  /// Returns the number of bristles in contact, zeta = N / (sigma_perp sigma), eq. (9); it need not be whole.
  double bristles_in_contact(double normal_load_n) const noexcept {
    return normal_load_n / (normal_stiffness * asperity_height_deviation);
  }
  /// Returns the normal load N, in newtons, at which `in_contact` bristles are in contact: the inverse of
  /// bristles_in_contact().
  double load_on_bristles(double in_contact) const noexcept {
    return in_contact * (normal_stiffness * asperity_height_deviation);
  }
  /// Returns friction over normal load in slow steady sliding: sigma0 (l_r + b) / (sigma_perp sigma), where
  /// the mean deflection b beyond the residual is m1 / 2 for keep, m2 / (2 m1) for redraw, (1 - drop) m1 for
  /// slide (at every speed). Shared renewal lowers it by the equations of core/MODEL.md, which each call
  /// solves. With ageing this is the limit of fast sliding, in which nothing ages: the lowest value.
  double kinetic_coefficient() const;
  /// Returns kinetic friction over normal load at the speed v. With ageing a bristle's snap length grows
  /// while it is bent, to l = delta g(l / v); it snaps at l_r + l. The friction is that of the bristles
  /// alone, without dampers and strengthening with speed. Each call solves equations. A speed below
  /// slowest_sliding counts as slowest_sliding. Throws bristle::Error on NaN.
  double kinetic_coefficient(double speed_m_per_s) const;
  /// Returns the highest friction over normal load at first loading from rest with all deflections zero: the
  /// largest value of the virgin curve. Each call searches for it, so call it at set-up. With ageing this is
  /// the limit of fast loading, in which nothing ages: the lowest value.
  double peak_coefficient() const;
  /// Returns peak friction over normal load where every bristle has stuck for `stuck_s` seconds and is loaded
  /// fast. The part beyond the residual is then ageing_factor times that of peak_coefficient().
  /// (SnapRule::slide: only the part of bristles that stick grows.) Response::force_limit takes the longest
  /// time that any bristle of the patch can have stuck.
  double peak_coefficient(double stuck_s) const;
  /// Returns nu: snaps per bristle in contact and metre of slow steady sliding, 1/m: 0 for slide, 1 / m1 for
  /// redraw, E[1/delta] for keep (of lengths from m1 / 1024 on), fewer with shared renewal. Renewals are
  /// shared_renewal times as many. With ageing this is the limit of fast sliding: the highest value.
  double snap_rate() const;
  /// Returns the factor g by which ageing has lengthened the snap length of a bristle stuck for this time, s.
  double ageing_factor(double age_s) const noexcept;
  /// Returns a asinh(v / (2 v*)): the friction over normal load that strengthening with speed adds at this
  /// speed.
  double strengthening_at(double speed_m_per_s) const noexcept;
  /// Returns the friction coefficient that strengthening with speed adds, divided by the speed, s/m, as
  /// implicit solvers need it; highest at rest.
  double strengthening_damping(double speed_m_per_s) const noexcept;
  /// Returns sigma1(v), N s/m: damper of one bristle at speed |v|, eq. (5). Zero if vs = 0.
  double damping_at(double speed_m_per_s) const noexcept;
  /// Returns steady friction at constant speed, N: kinetic friction at that speed, dampers, viscous term
  /// (eqs. 3 to 5) and strengthening with speed, added up.
  double steady_force(double speed_m_per_s, double normal_load_n) const;

  /// Calculates bristle parameters from friction coefficients. Without Coefficients::spread, the spread is
  /// solved from peak / kinetic; a ratio that the law's family cannot reach throws bristle::Error with the
  /// reachable range.
  static Material from_coefficients(const Coefficients& coefficients);
  /// Calculates the coefficients, with peak and spread, from which from_coefficients gives a material of the
  /// same snap lengths and forces (of normal_stiffness and asperity_height_deviation only the product
  /// counts). For a table, from_coefficients refuses the result. Throws for an invalid material, and for
  /// ageing with SnapRule::slide that no coefficients determine. The result is for the speed
  /// given (Coefficients::kinetic_speed; for beyond_ageing with saturating ageing: one presliding length in
  /// the ageing time). Ageing comes as fall_per_decade.
  Coefficients coefficients(double kinetic_speed_m_per_s = beyond_ageing) const;

  friend BRISTLE_API bool operator==(const Material& x, const Material& y) noexcept;
  friend bool operator!=(const Material& x, const Material& y) noexcept { return !(x == y); }
};

/// Returns the virgin curve f(x): the mean deflection of the bristles at displacement x from rest with all
/// deflections zero, both in units of the mean snap length (keep: E[x mod delta]; redraw: renewal equation,
/// solved on a grid, error below 1e-6; slide: E[min(x, delta)]). Slow; call it at set-up.
BRISTLE_API double virgin_deflection(const SnapLength& law, SnapRule rule, double x_over_mean);
/// Returns the virgin deflection with residual length, shared renewal and drop, without ageing. Deflection
/// and displacement are in units of E[delta] (not of the presliding length). Error below 1e-5; 1e-3 near the
/// atoms of a table with keep and shared renewal.
BRISTLE_API double virgin_deflection(const Material& material, double x_over_mean);

}  // namespace bristle
