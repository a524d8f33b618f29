// Computes steady sliding of infinitely many bristles under shared renewal and ageing.
//
// In sliding a bristle is renewed at the rate lambda = kappa nu per path, so the deflections r of the
// bristles of one snap length d have a density in proportion to exp(-lambda r) on 0 to d. With w1 = integral
// over 0 to d of exp(-lambda r) and w2 = integral over 0 to d of r exp(-lambda r):
//   redraw: (1 + kappa) restarts per snap keep the number of bristles: E[exp(-lambda d)] = 1 / (1 + kappa);
//           mean deflection E[w2(d)] / E[w1(d)]
//   keep:   E[1 / (exp(lambda d) - 1)] = 1 / kappa; mean deflection E[w2(d) / w1(d)]
// With ageing, at a speed v, a bristle with the fresh length d snaps at l = d g(l / v), and l replaces d.
#include "core/materials/steady_sliding.hpp"

#include <algorithm>
#include <vector>

#include "core/common/assert.hpp"
#include "core/materials/elementary.hpp"
#include "core/materials/solve.hpp"

namespace bristle::detail {
namespace {

using Node = AgedNode;

/// Adds the nodes of Gauss's eight-point rule between the lengths `low` and `high`. `density(x)`: density of
/// the law at the length x.
template <class Density>
void add_panel(std::vector<Node>& nodes, double low, double high, const Density& density) {
  constexpr double point[] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363};
  constexpr double weight[] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745,
                               0.1012285362903763};
  const double middle = 0.5 * (low + high), half = 0.5 * (high - low);
  for (int i = 0; i < 4; ++i) {
    for (const double x : {middle - half * point[i], middle + half * point[i]})
      nodes.push_back({x, weight[i] * half * density(x)});
  }
}

/// Adds nodes over an interval in parts whose end is at most twice their beginning, because the integrand
/// varies with the logarithm of the length.
template <class Density>
void add_range(std::vector<Node>& nodes, double low, double high, const Density& density) {
  double start = low;
  while (start < high) {
    const double end = std::min(start < shortest_that_counts ? shortest_that_counts : 2.0 * start, high);
    add_panel(nodes, start, end, density);
    start = end;
  }
}

/// Adds nodes for a lognormal law by the trapezoidal rule in z, its standard normal variable. For smooth
/// integrands this rule is exact to rounding.
void add_lognormal(std::vector<Node>& nodes, double cv) {
  constexpr double step = 0.125;
  const double s = square_root(log1p(cv * cv));
  for (double z = -9.0; z <= 9.0 + 2.0 * s; z += step)
    nodes.push_back({exp(s * z - 0.5 * s * s), step * normal_density(z)});
}

void add_normal(std::vector<Node>& nodes, const SnapLength& law) {
  const double mean = law.first_parameter() / law.mean(), deviation = law.second_parameter() / law.mean();
  if (deviation < 1e-12 * mean) {  // stops where an interval of one standard deviation would have no width
    nodes.push_back({1.0, 1.0});
    return;
  }
  const double kept = normal_cdf(mean / deviation);
  const auto density = [&](double x) { return normal_density((x - mean) / deviation) / (deviation * kept); };
  double low = std::max(mean - 9.0 * deviation, 0.0);
  if (low == 0.0) {
    add_range(nodes, 0.0, deviation, density);
    low = deviation;
  }
  for (; low < mean + 9.0 * deviation; low += deviation) add_panel(nodes, low, low + deviation, density);
}

void add_table(std::vector<Node>& nodes, const SnapLength& law) {
  const Span<const double> q = law.table_values();
  const double share = 1.0 / static_cast<double>(q.size() - 1);
  for (std::size_t i = 0; i + 1 < q.size(); ++i) {
    const double low = q[i] / law.mean(), high = q[i + 1] / law.mean();
    if (low == high) {
      nodes.push_back({low, share});
    } else {
      add_range(nodes, low, high, [&](double) { return share / (high - low); });
    }
  }
}

std::vector<Node> spread_nodes(const SnapLength& law) {
  std::vector<Node> nodes;
  switch (law.law()) {
    case SnapLaw::single:
      nodes.push_back({1.0, 1.0});
      break;
    case SnapLaw::uniform: {
      const double low = law.first_parameter() / law.mean(), high = law.second_parameter() / law.mean();
      add_range(nodes, low, high, [&](double) { return 1.0 / (high - low); });
      break;
    }
    case SnapLaw::normal:
      add_normal(nodes, law);
      break;
    case SnapLaw::lognormal:
      add_lognormal(nodes, law.cv());
      break;
    case SnapLaw::exponential:
      add_range(nodes, 0.0, 45.0, [](double x) { return exp(-x); });
      break;
    case SnapLaw::table:
      add_table(nodes, law);
      break;
  }
  return nodes;
}

/// Returns the expectation, over the law, of a function of the length at which a bristle snaps.
template <class Function>
double expectation(Span<const Node> nodes, const Function& f) {
  double sum = 0.0;
  for (const Node& node : nodes) sum += node.share * f(node.aged);
  return sum;
}

/// Logarithm of the expectation E in the equation of steady sliding, and its derivative by `growth` (the rate
/// lambda), at one value of `growth`.
struct LogValue {
  double value, slope;
};

/// Computes log(E[exp(-growth d)]) and its derivative.
LogValue log_transform(Span<const Node> nodes, double growth) {
  double lost = 0.0, moment = 0.0;
  for (const Node& node : nodes) {
    const double snapped = expm1(-growth * node.aged);
    lost -= node.share * snapped;
    moment += node.share * node.aged * (1.0 + snapped);
  }
  return {log1p(-lost), -moment / (1.0 - lost)};
}

/// Computes log(E[1 / (exp(growth d) - 1)]) and its derivative, for the equation of steady sliding with
/// SnapRule::keep.
LogValue log_revolutions(Span<const Node> nodes, double growth) {
  double sum = 0.0, slope = 0.0;
  for (const Node& node : nodes) {
    const double rate = 1.0 / expm1(growth * node.aged);
    sum += node.share * rate;
    slope -= node.share * node.aged * rate * (1.0 + rate);
  }
  return {log(sum), slope / sum};
}

/// Solves the equation of steady sliding (core/MODEL.md, section 26) for the rate of renewal lambda. `mean`:
/// mean length at which bristles snap.
double solve_growth(Span<const Node> nodes, SnapRule rule, double kappa, double mean) {
  // Solves by Newton's method. Both logarithms fall with lambda and are convex, and by Jensen's inequality
  // they start above the target, so the iterates rise to the root and never pass it.
  const double target = rule == SnapRule::keep ? -log(kappa) : -log1p(kappa);
  return newton(log1p(kappa) / mean, [&](double growth) {
    const LogValue at =
        rule == SnapRule::keep ? log_revolutions(nodes, growth) : log_transform(nodes, growth);
    return (target - at.value) / at.slope;
  });
}

/// Returns the integral of exp(-growth r) over 0 to d: the path along which a bristle of length d is bent,
/// weighted by renewal.
double path_share(double growth, double d) { return growth == 0.0 ? d : -expm1(-growth * d) / growth; }

/// Returns the integral of r exp(-growth r) over 0 to d: the deflection r along the path on which a bristle
/// of length d is bent, weighted by renewal.
double deflection_share(double growth, double d) {
  const double t = growth * d;
  if (t < 0.35) return d * d * (1.0 - (1.0 + t) * exp_remainder(-t));
  return (1.0 - exp(-t) * (1.0 + t)) / (growth * growth);
}

std::vector<Node> aged_nodes(const SnapLength& law, SnapRule rule, const PathAgeing& ageing) {
  std::vector<Node> nodes = spread_nodes(law);
  if (rule == SnapRule::keep) {
    const auto too_short = [](const Node& node) { return node.length < shortest_that_counts; };
    nodes.erase(std::remove_if(nodes.begin(), nodes.end(), too_short), nodes.end());
  }
  for (Node& node : nodes) node.aged = aged_length(node.length, ageing);
  return nodes;
}

}  // namespace

double PathAgeing::factor(double run) const noexcept {
  if (strength == 0.0) return 1.0;
  const double a = run / path;
  return 1.0 + strength * (form == AgeingForm::saturating ? -expm1(-a) : log1p(a));
}

double PathAgeing::slope(double run) const noexcept {
  if (strength == 0.0) return 0.0;
  return form == AgeingForm::saturating ? strength / path * exp(-run / path) : strength / (path + run);
}

PathAgeing ageing_at(const Material& m, double speed_m_per_s) {
  const double speed = magnitude(speed_m_per_s);
  return {m.ageing_form, m.ageing_strength,
          (speed > slowest_sliding ? speed : slowest_sliding) * m.ageing_time / m.snap_length.mean()};
}

double aged_length(double length, const PathAgeing& ageing) noexcept {
  if (ageing.strength == 0.0) return length;
  // Starts Newton's method beyond the root, from where its iterates fall onto the root, since l - length g(l)
  // is convex. From `length` they could diverge, because the slope can be 0 there. No allowed strength of
  // ageing brings l to a thousand times the fresh length.
  constexpr double farthest = 1e3;
  const bool saturates = ageing.form == AgeingForm::saturating;
  const double start = length * (saturates ? 1.0 + ageing.strength : ageing.factor(farthest * length));
  return newton(start,
                [&](double l) { return (length * ageing.factor(l) - l) / (1.0 - length * ageing.slope(l)); });
}

AgedMoments find_aged_moments(const SnapLength& law, const PathAgeing& ageing) {
  const std::vector<Node> list = aged_nodes(law, SnapRule::redraw, ageing);
  const Span<const Node> nodes{list.data(), list.size()};
  const double mean = expectation(nodes, [](double l) { return l; });
  const double variance = expectation(nodes, [mean](double l) { return square(l - mean); });
  return {mean, square_root(variance) / mean};
}

SteadySliding find_steady_sliding(const SnapLength& law, SnapRule rule, double shared_renewal,
                                  const PathAgeing& ageing) {
  BRISTLE_ASSERT(shared_renewal >= 0.0 && ageing.path > 0.0);
  const std::vector<Node> nodes = aged_nodes(law, rule, ageing);
  const Span<const Node> span{nodes.data(), nodes.size()};
  const double mean = ageing.strength == 0.0 ? 1.0 : expectation(span, [](double l) { return l; });
  return find_steady_sliding(span, mean, rule, shared_renewal);
}

SteadySliding find_steady_sliding(Span<const Node> nodes, double mean, SnapRule rule,
                                  double shared_renewal) noexcept {
  // Shared renewal kappa up to which it is computed as 0. So small a kappa does not change the number of
  // bristles in double, and 1 / kappa^2 would overflow.
  constexpr double least_renewal = 1e-16;
  const bool renews = shared_renewal > least_renewal;
  const double growth = renews ? solve_growth(nodes, rule, shared_renewal, mean) : 0.0;
  const auto path = [&](double l) { return path_share(growth, l); };
  const auto bend = [&](double l) { return deflection_share(growth, l); };
  SteadySliding s;
  s.growth = growth;
  if (rule == SnapRule::keep) {
    s.deflection = expectation(nodes, [&](double l) { return bend(l) / path(l); });
    s.fresh = 1.0;
    s.snap_rate =
        growth == 0.0 ? expectation(nodes, [](double l) { return 1.0 / l; }) : growth / shared_renewal;
    return s;
  }
  const double kept = expectation(nodes, path);
  s.deflection = expectation(nodes, bend) / kept;
  s.fresh = 0.0;
  for (const Node& node : nodes) s.fresh += node.share * node.length * path(node.aged) / kept;
  s.snap_rate = growth == 0.0 ? 1.0 / kept : growth / shared_renewal;
  return s;
}

double snap_rate_without_renewal(const SnapLength& law, SnapRule rule) {
  return rule == SnapRule::redraw ? 1.0 : find_steady_sliding(law, rule, 0.0).snap_rate;
}

}  // namespace bristle::detail
