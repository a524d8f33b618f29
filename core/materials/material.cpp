// Material: range checks and the closed forms of sections 2.2 and 2.3 of the paper.
#include "bristle/material.hpp"

#include "core/common/check_fields.hpp"
#include "core/materials/elementary.hpp"
#include "core/materials/steady_sliding.hpp"
#include "core/materials/virgin_curve.hpp"

namespace bristle {

namespace {

// Largest share of bristles that may be shorter than 1/64 of the mean length, for SnapRule::keep with shared
// renewal. Short bristles snap most often and renew the others. With more of them, the shortest bristle of
// the sample, not the material, would decide how many are renewed.
constexpr double short_length = 1.0 / 64, short_share = 1e-4;

}  // namespace

void Material::validate() const {
  detail::require_fields("Material", *this);
  const bool slides = snap_rule == SnapRule::slide;
  if (!slides && drop != 0.0)
    detail::refuse("Material", "drop", drop, "0 with snap_rule redraw or keep; snap_rule slide takes it");
  if (slides && (residual_length != 0.0 || shared_renewal != 0.0))
    detail::refuse("Material", residual_length != 0.0 ? "residual_length" : "shared_renewal",
                   residual_length != 0.0 ? residual_length : shared_renewal,
                   "0 with snap_rule slide: nothing snaps");
  detail::require_within("Material", "residual_length", residual_length, 0.0,
                         largest_residual * snap_length.mean(), "m; at most 64 mean snap lengths");
  if (snap_rule == SnapRule::keep && shared_renewal != 0.0 &&
      1.0 - snap_length.survival(short_length * snap_length.mean()) > short_share) {
    detail::refuse(
        "Material", "shared_renewal", shared_renewal,
        "0 with snap_rule keep and a snap_length of which more than 1e-4 is shorter than a 64th of "
        "its mean; take snap_rule redraw, or lengths farther from 0");
  }
}

void Material::validate_for_representatives() const {
  validate();
  if (snap_rule == SnapRule::redraw && snap_length.cv() > widest_redraw_cv)
    detail::refuse("Material", "snap_length.cv", snap_length.cv(),
                   "0 to " + detail::number_text(widest_redraw_cv) +
                       " with snap_rule redraw and representatives; snap_rule keep takes every law");
}

double Material::kinetic_coefficient() const {
  // Computes the mean deflection of sliding. With SnapRule::keep a bristle of length delta is on average bent
  // by delta / 2. With SnapRule::redraw bristles have a length in proportion to it, so the mean is m2 / (2
  // m1).
  const double mean = snap_length.mean();
  if (snap_rule == SnapRule::slide)
    return bristle_stiffness * (1.0 - drop) * mean / (normal_stiffness * asperity_height_deviation);
  const double beyond = shared_renewal != 0.0
                            ? mean * detail::kinetic_deflection(snap_length, snap_rule, shared_renewal)
                        : snap_rule == SnapRule::keep ? 0.5 * mean
                                                      : 0.5 * snap_length.moment(2) / mean;
  return bristle_stiffness * (residual_length + beyond) / (normal_stiffness * asperity_height_deviation);
}

double Material::kinetic_coefficient(double speed_m_per_s) const {
  if (speed_m_per_s != speed_m_per_s)
    detail::refuse("Material::kinetic_coefficient", "speed_m_per_s", speed_m_per_s, "any number");
  if (ageing_strength == 0.0 || snap_rule == SnapRule::slide) return kinetic_coefficient();
  const detail::SteadySliding sliding = detail::find_steady_sliding(snap_length, snap_rule, shared_renewal,
                                                                    detail::ageing_at(*this, speed_m_per_s));
  return bristle_stiffness * (residual_length + snap_length.mean() * sliding.deflection) /
         (normal_stiffness * asperity_height_deviation);
}

double Material::peak_coefficient() const {
  if (snap_rule == SnapRule::slide) return peak_coefficient(0.0);
  const double beyond = detail::peak_deflection(snap_length, snap_rule, shared_renewal);
  const double force = residual_length == 0.0
                           ? bristle_stiffness * snap_length.mean() * beyond
                           : bristle_stiffness * (residual_length + snap_length.mean() * beyond);
  return force / (normal_stiffness * asperity_height_deviation);
}

double Material::peak_coefficient(double stuck_s) const {
  if (snap_rule == SnapRule::slide)
    return bristle_stiffness * snap_length.mean() *
           detail::slide_peak(snap_length, drop, ageing_factor(stuck_s)).force /
           (normal_stiffness * asperity_height_deviation);
  const double residual =
      bristle_stiffness * residual_length / (normal_stiffness * asperity_height_deviation);
  return residual + ageing_factor(stuck_s) * (peak_coefficient() - residual);
}

double Material::snap_rate() const {
  if (snap_rule == SnapRule::slide) return 0.0;
  const double per_mean = shared_renewal != 0.0
                              ? detail::find_steady_sliding(snap_length, snap_rule, shared_renewal).snap_rate
                              : detail::snap_rate_without_renewal(snap_length, snap_rule);
  return per_mean / snap_length.mean();
}

double Material::ageing_factor(double age_s) const noexcept {
  if (ageing_strength == 0.0 || !(age_s > 0.0)) return 1.0;
  const double a = age_s / ageing_time;
  return 1.0 +
         ageing_strength * (ageing_form == AgeingForm::saturating ? -detail::expm1(-a) : detail::log1p(a));
}

double Material::damping_at(double speed_m_per_s) const noexcept {
  if (!(stribeck_velocity > 0.0) || bristle_damping == 0.0) return 0.0;
  const double u = detail::magnitude(speed_m_per_s) / stribeck_velocity;
  return bristle_damping * detail::exp(damper_decay == DamperDecay::gaussian ? -u * u : -u);
}

double Material::strengthening_at(double speed_m_per_s) const noexcept {
  if (speed_strengthening == 0.0) return 0.0;
  return speed_strengthening * detail::asinh(0.5 * detail::magnitude(speed_m_per_s) / strengthening_speed);
}

double Material::strengthening_damping(double speed_m_per_s) const noexcept {
  if (speed_strengthening == 0.0) return 0.0;
  const double x = 0.5 * detail::magnitude(speed_m_per_s) / strengthening_speed;
  return 0.5 * speed_strengthening / strengthening_speed * (x < 1e-8 ? 1.0 : detail::asinh(x) / x);
}

double Material::steady_force(double speed_m_per_s, double normal_load_n) const {
  if (!(normal_load_n > 0.0)) return 0.0;  // without contact there is no force, and no lubricant term
  const double speed = detail::magnitude(speed_m_per_s);
  const double dampers = bristles_in_contact(normal_load_n) * damping_at(speed) * speed;
  return kinetic_coefficient(speed) * normal_load_n + dampers + viscous_friction * speed +
         strengthening_at(speed) * normal_load_n;
}

double virgin_deflection(const SnapLength& law, SnapRule rule, double x_over_mean) {
  Material material;
  material.snap_length = law;
  material.snap_rule = rule;
  return virgin_deflection(material, x_over_mean);
}

double virgin_deflection(const Material& material, double x_over_mean) {
  const double x = detail::magnitude(x_over_mean);
  if (!(x <= 1e6)) detail::refuse("virgin_deflection", "x_over_mean", x_over_mean, "-1e6 to 1e6");
  if (material.snap_rule == SnapRule::slide) {
    const double f = detail::slide_curve(material.snap_length, material.drop, 1.0, x);
    return x_over_mean < 0.0 ? -f : f;
  }
  const double residual = material.residual_length / material.snap_length.mean();
  // Follows the displacement up to the residual length, since no bristle snaps there; beyond it the virgin
  // curve begins.
  const double f = x <= residual ? x
                                 : residual + detail::virgin_curve(material.snap_length, material.snap_rule,
                                                                   material.shared_renewal, x - residual);
  return x_over_mean < 0.0 ? -f : f;
}

bool operator==(const Material& x, const Material& y) noexcept { return detail::same_fields(x, y); }

}  // namespace bristle
