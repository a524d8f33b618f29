#include "core/materials/aged_law.hpp"

#include <algorithm>
#include <vector>

#include "core/materials/elementary.hpp"
#include "core/materials/virgin_curve.hpp"

namespace bristle::detail {
namespace {

/// Makes a normal law, cut at 0, that has this mean and nearly this coefficient of variation. Cutting raises
/// the mean and lowers the variation, so the uncut law gets a smaller mean, and `cv` times the ratio uncut /
/// cut of the variation of `law`.
SnapLength normal_of(const SnapLength& law, double mean, double cv) {
  const double spread = law.second_parameter() / law.first_parameter() * (cv / law.cv());
  const double raised = SnapLength::normal(1.0, std::min(spread, 1.0)).mean();
  return SnapLength::normal(mean / raised, std::min(spread, 1.0) * mean / raised);
}

/// Makes a table law of aged snap lengths: from the aged values of a table, or from 33 aged quantiles of a
/// uniform law with straight lines between them (error of the peak below 1e-4: test_ageing_law).
SnapLength table_of(const SnapLength& law, const PathAgeing& ageing) {
  std::vector<double> quantiles;
  if (law.law() == SnapLaw::table) {
    for (const double q : law.table_values()) quantiles.push_back(q / law.mean());
  } else {
    constexpr int cells = 32;
    const double low = law.first_parameter() / law.mean(), high = law.second_parameter() / law.mean();
    for (int i = 0; i <= cells; ++i) quantiles.push_back(low + (high - low) * i / cells);
  }
  for (double& q : quantiles) q = aged_length(q, ageing);
  return SnapLength::table({quantiles.data(), quantiles.size()});
}

}  // namespace

SnapLength aged_law(const SnapLength& law, const PathAgeing& ageing) {
  const AgedMoments m = find_aged_moments(law, ageing);
  switch (law.law()) {
    case SnapLaw::normal:
      return law.cv() == 0.0 ? SnapLength::single(m.mean) : normal_of(law, m.mean, m.cv);
    case SnapLaw::lognormal:
      return SnapLength::lognormal(m.mean, std::min(m.cv, 3.0));
    case SnapLaw::exponential:
      return SnapLength::exponential(m.mean);
    case SnapLaw::uniform:
    case SnapLaw::table:
      return table_of(law, ageing);
    default:
      return SnapLength::single(m.mean);
  }
}

double aged_peak(const SnapLength& law, SnapRule rule, double shared_renewal, const PathAgeing& ageing) {
  const SnapLength aged = aged_law(law, ageing);
  return aged.mean() * peak_deflection(aged, rule, shared_renewal);
}

double kinetic_fall(const SnapLength& law, SnapRule rule, double shared_renewal, double residual,
                    const PathAgeing& ageing) {
  // Relative change of speed by which a derivative is taken as a central difference; its relative error is
  // then 1e-7.
  constexpr double step = 1e-3;
  const auto force = [&](double factor) {
    PathAgeing other = ageing;
    other.path *= factor;
    return residual + find_steady_sliding(law, rule, shared_renewal, other).deflection;
  };
  return log(force(1.0 - step) / force(1.0 + step)) / log((1.0 + step) / (1.0 - step));
}

}  // namespace bristle::detail
