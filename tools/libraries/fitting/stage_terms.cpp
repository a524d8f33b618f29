// Fits a compliance of the stage between measured position and contact, and a delay of the force sensor (a
// low-pass); both make the force lag behind the position.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "tools/libraries/fitting/fitter.hpp"

namespace cli {
namespace {

constexpr double told_apart = 12.0;  // gain in twice the log likelihood that decides between delay and
                                     // compliance

/// Values from which fits start: delay over sampling interval, or the stage's share of the compliance.
constexpr std::array<double, 2> shares(bool delayed) {
  return delayed ? std::array{0.5, 5.0} : std::array{0.15, 0.5};
}
constexpr int rounds = 2;  // number of successive fits; each deflects the stage by the force of the fit
                           // before

}  // namespace

/// Fits with the stage deflected by the fitted force: the noise of the measured force would shake the
/// contact.
FitPoint Fitter::minimise_bent(FitPoint point) {
  for (int i = 0; i < rounds; ++i) {
    assume(model_, point);
    model_.set_stage_force(model_.force_on_stage(point.values));
    point = minimise(model_, point);
  }
  return point;
}

/// Returns a sentence saying that the record hardly distinguishes the delay or compliance of `taken` from
/// that of `other`.
std::string Fitter::alike(const FitPoint& taken, const FitPoint& other) const {
  const auto text = [](const FitPoint& p) {
    const double delay = p.values[fit_delay], compliance = p.values[fit_compliance];
    return contains(p.free, fit_delay) ? fmt::format("a delay of the force of {:.3g} ms", 1e3 * delay)
                                       : fmt::format("a stage that bends by {:.3g} um/N", 1e6 * compliance);
  };
  return fmt::format(
      "the record hardly tells {} from {} (presliding length then {:.3g} um instead of {:.3g} um): the first "
      "is taken; other speeds tell a delay, other loads a stage",
      text(taken), text(other), 1e6 * other.values[fit_length], 1e6 * taken.values[fit_length]);
}

/// Adds sensor delay, stage compliance, or both where they lower the residuals enough to justify them.
FitPoint Fitter::add_stage_terms(const FitPoint& core) {
  const auto explain = [&](FitParameter p, const std::string& why) { why_[p] = why; };
  if (options_.delay) explain(fit_delay, "held");
  if (options_.compliance) explain(fit_compliance, "held");
  if (options_.compliance) explain(fit_softening, "not looked for beside a compliance that is held");
  if (options_.rule == bristle::SnapRule::keep || options_.for_prediction) {
    for (const FitParameter p : {fit_delay, fit_compliance, fit_softening})
      if (why_[p].empty())
        explain(p, options_.for_prediction ? "not looked for" : "not looked for with the rule keep");
    return core;
  }
  const Eigen::VectorXd measured = Eigen::Map<const Eigen::VectorXd>(data_.force.data(), samples());
  const auto start_with = [&](FitPoint from, bool delayed, double share) {
    if (delayed) {
      from.free.push_back(fit_delay);
      from.values[fit_delay] = std::clamp(share * data_.sample_time, 1.1 * model_.lowest(fit_delay),
                                          0.9 * model_.highest(fit_delay));
    } else {
      // Splits the total compliance between stage and bristles; the total stays the same.
      const double whole = from.values[fit_length] / (from.values[fit_kinetic] * data_.mean_load);
      from.free.push_back(fit_compliance);
      from.values[fit_compliance] = std::clamp(0.5 * share * whole, 1.1 * model_.lowest(fit_compliance),
                                               0.9 * model_.highest(fit_compliance));
      from.values[fit_length] = std::max((1.0 - share) * from.values[fit_length], model_.lowest(fit_length));
    }
    return from;
  };
  const auto minimum = [&](const FitPoint& start) {
    assume(model_, start);
    const bool bent = contains(start.free, fit_compliance) || contains(start.free, fit_softening);
    if (bent) model_.set_stage_force(measured);
    const FitPoint point = minimise(model_, start);
    return bent ? minimise_bent(point) : point;
  };
  const auto best_of = [&](const FitPoint& from, bool delayed) {
    FitPoint best;
    best.sum_of_squares = std::numeric_limits<double>::infinity();
    for (const double share : shares(delayed)) {
      const FitPoint point = minimum(start_with(from, delayed, share));
      if (better(point, best)) best = point;
    }
    return best;
  };
  const bool may_delay = !options_.delay && two_ways(),
             may_bend = !options_.compliance && contains(core.free, fit_length);
  std::vector<FitValues> starts;
  for (const bool delayed : {true, false})
    for (const double share : shares(delayed))
      if (delayed ? may_delay : may_bend) starts.push_back(start_with(core, delayed, share).values);
  const bool worth_it = promises(core, starts);
  std::vector<FitPoint> candidates;
  if (worth_it && may_delay) candidates.push_back(best_of(core, true));
  if (worth_it && may_bend) candidates.push_back(best_of(core, false));
  if (candidates.size() == 2)
    candidates.push_back(best_of(better(candidates[0], candidates[1]) ? candidates[0] : candidates[1],
                                 !better(candidates[0], candidates[1])));
  FitPoint best = core;
  for (const FitPoint& candidate : candidates) {
    if (justified(candidate, best)) best = candidate;
  }
  // Tries a stage that is stiffer in one direction than in the other. Bristles are symmetric and cannot
  // imitate that.
  const bool may_soften =
      !options_.compliance && data_.axes == 1 && two_ways() && contains(core.free, fit_length);
  std::vector<FitValues> softer(2, best.values);
  for (std::size_t i = 0; i < softer.size(); ++i)
    softer[i][fit_softening] = (i ? -0.01 : 0.01) * model_.scale(best.values, fit_softening);
  if (may_soften && promises(best, softer)) {
    for (FitPoint point : {core, best}) {
      point.free.push_back(fit_softening);
      point = minimum(point);
      if (justified(point, best)) best = point;
    }
  }
  // Notes if the other one of delay and compliance would fit as closely and also be justified.
  const bool one = contains(best.free, fit_delay) != contains(best.free, fit_compliance);
  if (one && candidates.size() == 3) {
    const FitPoint& other = candidates[contains(best.free, fit_delay) ? 1 : 0];
    const double count = samples_that_count(best);
    const double gain = count * std::log(other.sum_of_squares / std::max(best.sum_of_squares, 1e-300));
    if (gain < told_apart && criterion(other, count) < criterion(core, count))
      stage_note_ = alike(best, other);
  }
  for (const FitParameter p : {fit_delay, fit_compliance, fit_softening}) {
    if (!contains(best.free, p) && why_[p].empty())
      explain(p, p == fit_delay && !two_ways() ? "the motion has one direction only" : lacking(p));
  }
  return best;
}

}  // namespace cli
