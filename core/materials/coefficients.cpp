// Converts friction coefficients (struct Coefficients) to bristle parameters (struct Material) and back.
#include <algorithm>
#include <string>

#include "bristle/material.hpp"
#include "core/common/check_fields.hpp"
#include "core/materials/aged_law.hpp"
#include "core/materials/elementary.hpp"
#include "core/materials/solve.hpp"
#include "core/materials/virgin_curve.hpp"

namespace bristle {

namespace {

constexpr double ln10 = 2.302585092994046;

/// Effect of ageing on friction that the caller asks for, as a fall with speed or a growth at rest. With the
/// law of snap lengths it determines the strength of ageing. Lengths are in mean snap lengths.
struct AgeingWish {
  AgeingForm form = AgeingForm::logarithmic;
  /// Wanted fall of kinetic friction per factor e of speed, over kinetic friction; 0 = the wanted `growth`
  /// determines the ageing.
  double fall = 0.0;
  double growth = 0.0;  ///< growth of static friction per factor e of rest, over kinetic friction
  double path = 0.0;    ///< sliding speed times ageing time; 0 = so fast that nothing ages

  bool any() const noexcept { return fall != 0.0 || growth != 0.0; }
  /// Whether the coefficients are for a speed at which bristles age, and not only for sliding too fast for
  /// ageing.
  bool at_speed() const noexcept { return any() && path != 0.0; }
};

/// Family of snap-length laws (such as all lognormal ones) of one mean, among which the spread selects;
/// spread 0 gives the single length.
struct Family {
  SnapLaw law;
  SnapRule rule;
  double residual = 0.0;  ///< residual length in mean snap lengths
  double renewal = 0.0;
  AgeingWish wish;

  bool of_paper() const noexcept { return residual == 0.0 && renewal == 0.0 && !wish.at_speed(); }

  /// Returns the largest spread of snap lengths that Material::validate allows. With SnapRule::keep and
  /// shared renewal it is smaller, because that rule may have only few short bristles.
  double widest_allowed() const noexcept {
    const bool few_short = rule == SnapRule::keep && renewal != 0.0;
    switch (law) {
      case SnapLaw::uniform:
        // Spread of a uniform law whose shortest length is 0: the root of 1/3.
        return few_short ? 0.568 : 0.5773502691896257;
      case SnapLaw::normal:
        return few_short ? 0.3 : 1.0;
      case SnapLaw::lognormal:
        return few_short ? 1.25 : 3.0;
      default:
        return 0.0;
    }
  }

  /// Returns the upper end of the interval in which a spread is searched. Up to it the ratio peak / kinetic
  /// falls with the spread, if possible to `wanted` or below, otherwise to its least value.
  double widest(double wanted) const {
    if (law == SnapLaw::lognormal && !of_paper() && ratio(0.6) <= wanted)
      return 0.6;  // a narrower law is enough, and is solved faster
    if (law != SnapLaw::uniform) return widest_allowed();
    if (of_paper()) return rule == SnapRule::redraw ? widest_falling_uniform : widest_allowed();
    return search_uniform(wanted);
  }

  SnapLength make(double mean_m, double spread) const {
    switch (law) {
      case SnapLaw::uniform: {
        const double half = 1.7320508075688772 * spread * mean_m;
        return SnapLength::uniform(std::max(mean_m - half, 0.0), mean_m + half);
      }
      case SnapLaw::normal: {
        // Lowers the mean of the uncut normal law by the factor by which cutting it at 0 raises the mean.
        const double raised = SnapLength::normal(1.0, spread).mean();
        return SnapLength::normal(mean_m / raised, spread * mean_m / raised);
      }
      case SnapLaw::lognormal:
        return SnapLength::lognormal(mean_m, spread);
      case SnapLaw::exponential:
        return SnapLength::exponential(mean_m);
      default:
        return SnapLength::single(mean_m);
    }
  }

  /// Returns the effect that ageing of this strength has on friction, relative, as AgeingWish names it: the
  /// fall with speed or the growth at rest.
  double effect(const SnapLength& unit, double strength) const {
    const detail::PathAgeing ageing{wish.form, strength, wish.path};
    if (wish.growth == 0.0 && wish.path != 0.0)
      return detail::kinetic_fall(unit, rule, renewal, residual, ageing);
    const detail::SteadySliding sliding =
        detail::find_steady_sliding(unit, rule, renewal, wish.path == 0.0 ? detail::PathAgeing{} : ageing);
    return strength * (wish.growth != 0.0 ? sliding.fresh : sliding.deflection) /
           (residual + sliding.deflection);
  }

  /// Returns the strength of ageing that has the wanted effect. If no allowed strength has it, returns the
  /// largest.
  double find_strength(const SnapLength& unit) const {
    if (!wish.any()) return 0.0;
    const double wanted = wish.growth != 0.0 ? wish.growth : wish.fall;
    const double highest_excess = effect(unit, largest_ageing) - wanted;
    if (wish.path == 0.0)  // the effect is proportional to the strength here
      return std::min(wanted / (highest_excess + wanted), 1.0) * largest_ageing;
    if (highest_excess <= 0.0) return largest_ageing;
    return detail::find_zero([&](double strength) { return effect(unit, strength) - wanted; }, 0.0,
                             largest_ageing, -wanted, highest_excess, {1e-14, 1e-12 * wanted});
  }

  double ratio(double spread) const {
    const SnapLength unit = make(1.0, spread);
    if (wish.at_speed()) {
      const detail::PathAgeing ageing{wish.form, find_strength(unit), wish.path};
      return (residual + detail::aged_peak(unit, rule, renewal, ageing)) /
             (residual + detail::find_steady_sliding(unit, rule, renewal, ageing).deflection);
    }
    const double peak = detail::peak_deflection(unit, rule, renewal);
    const double kinetic = detail::kinetic_deflection(unit, rule, renewal);
    return (residual + peak) / (residual + kinetic);
  }

  /// Searches a spread of a uniform law at which the ratio peak / kinetic is at most `wanted`; if there is
  /// none, returns the spread with the least ratio. Searches step by step, because its minima have no closed
  /// form.
  double search_uniform(double wanted) const {
    constexpr int points = 12;
    const double start = narrow_uniform, pace = (widest_allowed() - start) / points;
    int best = 0;
    double least = detail::infinity;
    for (int i = 0; i <= points; ++i) {
      const double value = ratio(start + i * pace);
      if (value <= wanted) return start + i * pace;
      if (value >= least) continue;
      least = value;
      best = i;
    }
    if (best == 0 || best == points) return start + best * pace;
    constexpr int iterations = 18;  // they leave an error of 1e-5
    return detail::find_maximum([&](double spread) { return -ratio(spread); }, start + (best - 1) * pace,
                                start + (best + 1) * pace, iterations)
        .at;
  }

  // Spread of the uniform law with the least ratio peak / kinetic, 1.15302. Its width w is 0.969609 means;
  // for w from 2/3 to 1 the peak is 5 w / 8 + 1 / (2 w) - 1/2, the kinetic value (1 + w^2/12) / 2. Wider
  // laws, up to w = 2, have ratios from 1.153 to 1.159, so a search need not go beyond.
  static constexpr double widest_falling_uniform = 0.27990193654;
  // Spread of a uniform law up to which peak / kinetic falls with the spread under any residual and renewal.
  // The peak then lies before any bristle snaps twice.
  static constexpr double narrow_uniform = 0.249;
};

/// Returns the least spread, at most `widest`, at which peak / kinetic is `wanted`. Every law wide enough for
/// its force to have no peak has the ratio 1; of these, too, it returns the least.
double solve_spread(const Family& family, double widest, double wanted) {
  const auto excess = [&](double spread) { return family.ratio(spread) - wanted; };
  const double highest = excess(0.0);
  if (highest <= 0.0) return 0.0;
  // Takes a wider tolerance where the virgin curve is solved on a grid, to 1e-7 only. Closed forms are exact.
  const detail::ZeroTolerance tolerance =
      family.of_paper() ? detail::ZeroTolerance{1e-13, 1e-10} : detail::ZeroTolerance{1e-9, 3e-8};
  return detail::find_zero(excess, 0.0, widest, highest, excess(widest), tolerance);
}

/// Describes the family of laws, the rule, residual and renewal, for the text of errors about peak / kinetic.
std::string describe(const Family& family, double residual_share) {
  std::string text = std::string("law ") + to_string(family.law) + ", rule " +
                     snap_rule_names[static_cast<std::size_t>(family.rule)];
  if (family.residual == 0.0 && family.renewal == 0.0) return text;
  return text + ", residual_share " + detail::number_text(residual_share) + ", shared_renewal " +
         detail::number_text(family.renewal);
}

/// Returns the end of errors about the peak if it is the default, of which a user who set only `kinetic` or
/// `spread` may not know; otherwise "".
std::string default_peak_text(const Coefficients& c, const char* advice) {
  if (c.peak != Coefficients{}.peak) return {};
  return "; " + detail::number_text(c.peak) + " is the default peak: " + advice;
}

/// Returns the end of errors about peak / kinetic, which names the peak.
std::string peak_text(const Coefficients& c) {
  const std::string text = default_peak_text(c, "set one that suits kinetic by with_peak()");
  return text.empty() ? "; peak is " + detail::number_text(c.peak) : text;
}

/// Returns the spread that gives the ratio peak / kinetic which the caller asks for. Throws an error with the
/// range of ratios if none does.
double find_spread(const Family& family, const Coefficients& c) {
  const double ratio = c.peak / c.kinetic;
  const char* const where = "Coefficients";
  const char* const what = "peak / kinetic";
  const double highest = family.ratio(0.0);
  if (family.widest_allowed() == 0.0) {
    if (detail::magnitude(ratio - highest) <= 1e-3) return 0.0;
    detail::refuse(where, what, ratio,
                   detail::number_text(highest) + " (" + describe(family, c.residual_share) +
                       ", which has no spread to choose)" + peak_text(c));
  }
  // Distance outside the reachable range up to which a ratio counts as the end of the range, because callers
  // round.
  constexpr double rounding = 1e-9;
  const double widest = family.widest(ratio), lowest = family.ratio(widest);
  if (!(ratio >= lowest - rounding && ratio <= highest + rounding))
    detail::refuse(where, what, ratio,
                   detail::number_text(lowest) + " to " + detail::number_text(highest) + " (" +
                       describe(family, c.residual_share) + ")" + peak_text(c));
  const double wanted = std::min(std::max(ratio, lowest), highest);
  return solve_spread(family, widest, wanted);
}

/// Returns the caller's spread. Throws if the family does not allow it.
double allowed_spread(const Family& family, const Coefficients& c) {
  constexpr double rounding = 1.0 + 1e-12;
  const double widest = family.widest_allowed();
  const double spread = c.spread <= widest * rounding ? std::min(c.spread, widest) : c.spread;
  detail::require_within("Coefficients", "spread", spread, 0.0, widest,
                         "(" + describe(family, c.residual_share) + ")");
  return spread;
}

/// Checks the caller's spread and returns it. Throws if it is too wide, or if a peak is given too and differs
/// from the peak of this spread.
double check_spread(const Family& family, const Coefficients& c) {
  if (family.widest_allowed() == 0.0)
    detail::refuse("Coefficients", "spread", c.spread,
                   "0 (" + describe(family, c.residual_share) + ", which has no spread to choose)");
  const double spread = allowed_spread(family, c);
  if (c.peak == 0.0) return spread;
  const double peak = c.kinetic * family.ratio(spread);
  if (detail::magnitude(c.peak - peak) > 1e-5 * peak)
    detail::refuse(
        "Coefficients", "peak", c.peak,
        detail::number_text(peak) + " beside spread = " + detail::number_text(c.spread) +
            " and kinetic = " + detail::number_text(c.kinetic) +
            ": leave out peak (0), which then follows, or spread (0), which is then solved from the peak" +
            default_peak_text(c, "with_spread() sets it to 0"));
  return spread;
}

void check_ageing(const Coefficients& c) {
  const char* const where = "Coefficients";
  if (c.fall_per_decade != 0.0 && c.growth_per_decade != 0.0)
    detail::refuse(where, "growth_per_decade", c.growth_per_decade,
                   "0 beside a fall_per_decade: one follows from the other; give one of the two");
  if (c.ageing_form == AgeingForm::logarithmic) return;
  if (c.growth_per_decade != 0.0)
    detail::refuse(
        where, "growth_per_decade", c.growth_per_decade,
        "0 with ageing_form saturating, which ends to grow; give fall_per_decade at a kinetic_speed");
  if (c.fall_per_decade != 0.0 && c.kinetic_speed == beyond_ageing)
    detail::refuse(where, "kinetic_speed", c.kinetic_speed,
                   "above 0 with ageing_form saturating and a fall_per_decade: friction falls near "
                   "presliding_length / ageing_time alone");
}

AgeingWish find_wish(const Coefficients& c) {
  AgeingWish wish;
  wish.form = c.ageing_form;
  wish.fall = c.fall_per_decade / ln10;
  wish.growth = c.growth_per_decade / ln10;
  if (c.kinetic_speed != beyond_ageing)
    wish.path = std::max(c.kinetic_speed, slowest_sliding) * c.ageing_time /
                (c.presliding_length * (1.0 - c.residual_share));
  return wish;
}

/// Returns the spread for SnapRule::slide: the caller's or, if that is 0, 0.3 for a family whose spread is
/// free.
double find_slide_spread(const Family& family, const Coefficients& c) {
  constexpr double usual_spread = 0.3;
  return c.spread == 0.0 ? std::min(usual_spread, family.widest_allowed()) : allowed_spread(family, c);
}

/// Returns the drop for SnapRule::slide: c.drop if it is set or no peak is given, otherwise the drop that
/// gives the ratio c.peak / c.kinetic. Throws if peak and drop disagree, or if no drop gives the ratio; the
/// error then has the range of ratios.
double find_drop(const SnapLength& unit, const std::string& name, const Coefficients& c) {
  const auto ratio = [&unit](double drop) {
    return detail::slide_peak(unit, drop, 1.0).force / (1.0 - drop);
  };
  detail::require_within("Coefficients", "drop", c.drop, 0.0, largest_drop);
  if (c.peak == 0.0) return c.drop;
  const double wanted = c.peak / c.kinetic;
  if (c.drop != 0.0) {
    const double peak = c.kinetic * ratio(c.drop);
    if (detail::magnitude(c.peak - peak) > 1e-5 * peak)
      detail::refuse(
          "Coefficients", "peak", c.peak,
          detail::number_text(peak) + " beside drop = " + detail::number_text(c.drop) +
              ": leave out peak (0), which then follows, or drop (0), which is then solved from the peak" +
              default_peak_text(c, "with_drop() sets it to 0"));
    return c.drop;
  }
  constexpr double rounding = 1e-9;
  if (!(wanted >= 1.0 - rounding && wanted <= ratio(largest_drop) * (1.0 + rounding)))
    detail::refuse("Coefficients", "peak / kinetic", wanted,
                   "1 to " + detail::number_text(ratio(largest_drop)) + " (" + name + ", drop at most " +
                       detail::number_text(largest_drop) + ")" + peak_text(c));
  if (wanted <= 1.0 + rounding) return 0.0;
  return detail::find_zero([&](double drop) { return ratio(drop) - wanted; }, 0.0, largest_drop, 1.0 - wanted,
                           ratio(largest_drop) - wanted, {1e-14});
}

/// Returns the strength of ageing for SnapRule::slide with which the peak grows by c.growth_per_decade (of
/// the kinetic friction) per decade of rest. Throws if no strength does that under this law and drop.
double find_slide_ageing(const SnapLength& unit, double drop, const Coefficients& c) {
  if (c.fall_per_decade != 0.0)
    detail::refuse("Coefficients", "fall_per_decade", c.fall_per_decade,
                   "0 with rule slide: a bristle that slides does not age; give growth_per_decade");
  if (c.growth_per_decade == 0.0) return 0.0;
  const double highest = ln10 * largest_ageing * detail::slide_peak(unit, drop, 1.0).slope / (1.0 - drop);
  if (!(c.growth_per_decade <= highest * (1.0 + 1e-9)))
    detail::refuse("Coefficients", "growth_per_decade", c.growth_per_decade,
                   "0 to " + detail::number_text(highest) + " (rule slide, drop " +
                       detail::number_text(drop) + "; without a drop no peak grows)");
  return std::min(c.growth_per_decade / highest, 1.0) * largest_ageing;
}

/// Calculates a material's friction coefficients at c.kinetic_speed: kinetic and peak, and the fall with
/// speed or, for SnapRule::slide, the growth at rest.
void find_friction(const Material& m, Coefficients& c) {
  c.kinetic = m.kinetic_coefficient();
  c.peak = m.peak_coefficient();
  c.drop = m.drop;
  if (m.ageing_strength == 0.0) return;
  if (m.snap_rule == SnapRule::slide) {
    c.growth_per_decade =
        ln10 * m.ageing_strength * detail::slide_peak(m.snap_length, m.drop, 1.0).slope / (1.0 - m.drop);
    if (c.growth_per_decade == 0.0 || m.ageing_form != AgeingForm::logarithmic)
      detail::refuse(
          "Material::coefficients", "ageing_strength", m.ageing_strength,
          "0 with snap_rule slide, unless it is logarithmic and a drop gives a peak that grows: no "
          "coefficients determine it");
    return;
  }
  const double mean = m.snap_length.mean(), residual = m.residual_length / mean;
  if (c.kinetic_speed == beyond_ageing) {
    const double deflection =
        detail::find_steady_sliding(m.snap_length, m.snap_rule, m.shared_renewal).deflection;
    c.fall_per_decade = ln10 * m.ageing_strength * deflection / (residual + deflection);
    return;
  }
  const detail::PathAgeing ageing = detail::ageing_at(m, c.kinetic_speed);
  c.kinetic = m.kinetic_coefficient(c.kinetic_speed);
  c.peak =
      m.bristle_stiffness *
      (m.residual_length + mean * detail::aged_peak(m.snap_length, m.snap_rule, m.shared_renewal, ageing)) /
      (m.normal_stiffness * m.asperity_height_deviation);
  c.fall_per_decade =
      ln10 * detail::kinetic_fall(m.snap_length, m.snap_rule, m.shared_renewal, residual, ageing);
}

/// Returns the spread of a law as Coefficients::spread means it, so that from_coefficients makes the same law
/// again.
double spread_of(const SnapLength& length) noexcept {
  switch (length.law()) {
    case SnapLaw::uniform:
    case SnapLaw::lognormal:
      return length.cv();
    case SnapLaw::normal:
      return length.second_parameter() / length.first_parameter();
    default:
      return 0.0;
  }
}

/// Checks that some allowed strength of ageing has the effect that the caller asks for, and throws an error
/// if none has.
void require_reached(const Coefficients& c, const Family& family, const SnapLength& unit) {
  const bool grows = c.growth_per_decade != 0.0;
  const double wanted = grows ? c.growth_per_decade : c.fall_per_decade;
  const double highest = ln10 * family.effect(unit, largest_ageing);
  if (wanted <= highest * (1.0 + 1e-9)) return;
  std::string text = "0 to " + detail::number_text(highest);
  if (c.kinetic_speed != beyond_ageing)
    text += " at kinetic_speed " + detail::number_text(c.kinetic_speed) + " m/s, ageing_time " +
            detail::number_text(c.ageing_time) + " s";
  detail::refuse("Coefficients", grows ? "growth_per_decade" : "fall_per_decade", wanted,
                 text + " (ageing_strength at most " + detail::number_text(largest_ageing) + ")");
}

}  // namespace

Material Material::from_coefficients(const Coefficients& c) {
  const char* const where = "Coefficients";
  detail::require_fields(where, c);
  const bool slides = c.rule == SnapRule::slide;
  if (!slides && c.drop != 0.0)
    detail::refuse(where, "drop", c.drop, "0 with rule redraw or keep; rule slide takes it");
  if ((c.spread == 0.0 && !slides) || c.peak != 0.0)
    detail::require_within(where, "peak", c.peak, 1e-9, 2e6, "(0 with a spread)");
  if (c.law == SnapLaw::table)
    throw Error(
        "Coefficients: law = table; allowed are single, uniform, normal, lognormal, exponential: "
        "coefficients "
        "do not determine a table; keep the Material, or give another law and its spread");
  if (c.law == SnapLaw::exponential && c.rule == SnapRule::keep && c.shared_renewal != 0.0)
    detail::refuse(where, "shared_renewal", c.shared_renewal,
                   "0 with law exponential and rule keep: its shortest bristles would renew all others");

  check_ageing(c);

  const double residual_share = slides ? 0.0 : c.residual_share;
  const double renewal = slides ? 0.0 : c.shared_renewal;
  const Family family{c.law, c.rule, residual_share / (1.0 - residual_share), renewal, find_wish(c)};
  const double spread = slides            ? find_slide_spread(family, c)
                        : c.spread != 0.0 ? check_spread(family, c)
                                          : find_spread(family, c);

  Material material;
  material.snap_length = family.make(c.presliding_length * (1.0 - residual_share), spread);
  material.residual_length = c.presliding_length * residual_share;
  material.shared_renewal = renewal;
  material.snap_rule = c.rule;
  // Height deviation of most industrial surfaces (paper, section 2.3), a free choice here: only its product
  // with the normal stiffness matters.
  material.asperity_height_deviation = 1e-6;
  material.normal_stiffness = 1.0 / (c.bristles_per_newton * material.asperity_height_deviation);
  material.bristle_stiffness = 1.0;
  material.ageing_form = c.ageing_form;
  material.ageing_time = c.ageing_time;
  if (slides) {
    const SnapLength unit = family.make(1.0, spread);
    material.drop = find_drop(unit, describe(family, 0.0), c);
    material.ageing_strength = find_slide_ageing(unit, material.drop, c);
  } else if (family.wish.any()) {
    const SnapLength unit = family.make(1.0, spread);
    require_reached(c, family, unit);
    material.ageing_strength = family.find_strength(unit);
  }
  material.bristle_stiffness =
      c.kinetic / (c.kinetic_speed == beyond_ageing ? material.kinetic_coefficient()
                                                    : material.kinetic_coefficient(c.kinetic_speed));
  material.bristle_damping = c.damping_per_newton / c.bristles_per_newton;
  material.viscous_friction = c.viscous_friction;
  material.stribeck_velocity = c.stribeck_velocity;
  material.damper_decay = c.damper_decay;
  material.speed_strengthening = c.speed_strengthening;
  material.strengthening_speed = c.strengthening_speed;
  material.validate();
  return material;
}

Coefficients Material::coefficients(double kinetic_speed_m_per_s) const {
  validate();
  detail::require_within("Material::coefficients", "kinetic_speed_m_per_s", kinetic_speed_m_per_s, 0.0, 1e15,
                         "m/s");
  Coefficients c;
  c.presliding_length = residual_length + snap_length.mean();
  c.kinetic_speed = kinetic_speed_m_per_s;
  if (ageing_strength != 0.0 && ageing_form == AgeingForm::saturating && c.kinetic_speed == beyond_ageing)
    c.kinetic_speed = c.presliding_length / ageing_time;
  find_friction(*this, c);
  c.residual_share = residual_length / c.presliding_length;
  c.shared_renewal = shared_renewal;
  c.bristles_per_newton = bristles_in_contact(1.0);
  c.law = snap_length.law();
  c.spread = spread_of(snap_length);
  c.rule = snap_rule;
  c.damping_per_newton = bristle_damping * c.bristles_per_newton;
  c.viscous_friction = viscous_friction;
  c.stribeck_velocity = stribeck_velocity;
  c.damper_decay = damper_decay;
  c.ageing_form = ageing_form;
  c.ageing_time = ageing_time;
  c.speed_strengthening = speed_strengthening;
  c.strengthening_speed = strengthening_speed;
  return c;
}

}  // namespace bristle
