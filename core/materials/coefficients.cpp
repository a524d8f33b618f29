// Virgin curves (force at first loading, all deflections zero), their peak, and the way from the
// coefficients that people know to bristle parameters and back.
//
// Lengths here are in units of the mean snap length. G(x) = P(delta <= x), S = 1 - G,
// M1(x) = E[delta; delta < x].
//   keep:   f(x) = E[x mod delta] = x - sum over k >= 1 of M1(x / k)
//   redraw: f(x) = x S(x) + integral over 0 < t <= x of f(x - t) dG(t)      (renewal equation)
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "bristle/material.hpp"
#include "core/common/range_check.hpp"
#include "core/materials/elementary.hpp"

namespace bristle {

namespace {

double whole_part(double x) noexcept { return std::floor(x); }

/// A law in units of its mean.
struct UnitLaw {
  const SnapLength& law;
  double mean;

  explicit UnitLaw(const SnapLength& snap_length) noexcept : law(snap_length), mean(snap_length.mean()) {}

  double survival(double x) const { return law.survival(x * mean); }
  double partial_moment(int k, double x) const {
    return law.partial_moment(k, x * mean) / (k == 0 ? 1.0 : k == 1 ? mean : mean * mean);
  }
  /// f(x) as long as no bristle has snapped twice, for both rules; the limit from the left at an atom.
  double first_pass(double x) const { return x - partial_moment(1, x); }
};

// ---------------------------------------------------------------------------------------------------
// keep

/// Sum of 1/k^2 over k > n.
double tail_of_inverse_squares(double n) noexcept {
  double sum = 0.0;
  while (n < 32.0) {
    n += 1.0;
    sum += 1.0 / (n * n);
  }
  // Euler-Maclaurin at the half-integer; the first term left out is 1e-17.
  const double w = 1.0 / (n + 0.5);
  const double w2 = w * w;
  return sum + w * (1.0 - w2 * (1.0 / 12 - w2 * (7.0 / 240 - w2 * (31.0 / 1344))));
}

/// E[x mod delta] for delta uniform on [a, b]; an atom where a = b. At a tie of an atom the limit from
/// the left (a) instead of 0 if `from_left`.
double uniform_remainder(double a, double b, double x, bool from_left) noexcept {
  if (a == b) {
    const double rest = x - whole_part(x / a) * a;
    return from_left && rest <= 0.0 && x > 0.0 ? a : std::max(rest, 0.0);
  }
  // The first k0 terms M1(x/k) are the whole mean, those above k1 are zero.
  const double k0 = whole_part(x / b);
  const double k1 = a > 0.0 ? whole_part(x / a) : detail::infinity;
  double inverse_squares, atoms_below = 0.0;
  if (k1 - k0 < 64.0) {
    inverse_squares = 0.0;
    for (double k = k0 + 1.0; k <= k1; k += 1.0) inverse_squares += 1.0 / (k * k);
    atoms_below = a * a * (k1 - k0);
  } else if (a > 0.0 && k1 < 1e15) {
    inverse_squares = tail_of_inverse_squares(k0) - tail_of_inverse_squares(k1);
    atoms_below = a * a * (k1 - k0);
  } else {
    inverse_squares = tail_of_inverse_squares(k0);
    if (a > 0.0) atoms_below = a * x;  // k1 a = x to rounding
  }
  return x - k0 * 0.5 * (a + b) - (x * x * inverse_squares - atoms_below) / (2.0 * (b - a));
}

/// Interval outside which the smooth laws hold less than 1e-18 of their first moment.
void effective_support(const UnitLaw& unit, double& low, double& high) noexcept {
  const double a = unit.law.first_parameter() / unit.mean, b = unit.law.second_parameter();
  low = 0.0;
  high = 45.0;  // exponential
  if (unit.law.law() == SnapLaw::normal) {
    low = std::max(a - 9.0 * b / unit.mean, 0.0);
    high = a + 9.0 * b / unit.mean;
  } else if (unit.law.law() == SnapLaw::lognormal) {
    const double s2 = detail::log1p(b * b), s = detail::square_root(s2);
    low = detail::exp(0.5 * s2 - 9.0 * s);
    high = detail::exp(0.5 * s2 + 9.0 * s);
  }
}

/// E[x mod delta] of a law with a smooth density: the sum term by term for 100 terms, the rest by its
/// integral, which is E[(x - kappa delta)+], and two Euler-Maclaurin corrections.
double smooth_remainder(const UnitLaw& unit, double x) {
  constexpr double direct_terms = 100.0;
  double low, high;
  effective_support(unit, low, high);
  double k = whole_part(x / high);
  const double last = k + direct_terms;
  double sum = k;  // each of these terms is the whole mean, 1
  double before = 1.0, term = 1.0;
  for (k += 1.0; k <= last; k += 1.0) {
    if (x < low * k) return x - sum;
    before = term;
    term = unit.partial_moment(1, x / k);
    sum += term;
  }
  const double kappa = last + 0.5;
  const double share = 1.0 - unit.survival(x / kappa);
  const double rest = x * share - kappa * unit.partial_moment(1, x / kappa);
  // First and third difference about kappa stand for the derivatives.
  const double next = unit.partial_moment(1, x / (last + 1.0)),
               after = unit.partial_moment(1, x / (last + 2.0));
  const double difference = next - term, third = after - 3.0 * next + 3.0 * term - before;
  return x - (sum + std::max(rest, 0.0) + difference / 24.0 - third * (17.0 / 5760));
}

double keep_deflection(const SnapLength& law, double x, bool from_left) {
  const double mean = law.mean();
  switch (law.law()) {
    case SnapLaw::single:
      return uniform_remainder(1.0, 1.0, x, from_left);
    case SnapLaw::uniform:
      return uniform_remainder(law.first_parameter() / mean, law.second_parameter() / mean, x, from_left);
    case SnapLaw::table: {
      const Span<const double> q = law.table_values();
      double sum = 0.0;
      for (std::size_t i = 0; i + 1 < q.size(); ++i) {
        sum += uniform_remainder(q[i] / mean, q[i + 1] / mean, x, from_left);
      }
      return sum / static_cast<double>(q.size() - 1);
    }
    default:
      return smooth_remainder(UnitLaw(law), x);
  }
}

// ---------------------------------------------------------------------------------------------------
// redraw

struct Atom {
  double length, mass;
};

/// Atoms of a table: runs of equal values.
std::vector<Atom> find_atoms(const SnapLength& law) {
  std::vector<Atom> atoms;
  const Span<const double> q = law.table_values();
  const double mean = law.mean();
  for (std::size_t i = 0; i + 1 < q.size(); ++i) {
    if (q[i] != q[i + 1]) continue;
    const double length = q[i] / mean, mass = 1.0 / static_cast<double>(q.size() - 1);
    if (!atoms.empty() && atoms.back().length == length) {
      atoms.back().mass += mass;
    } else {
      atoms.push_back({length, mass});
    }
  }
  return atoms;
}

/// f of the redraw rule on equidistant nodes: limits from the left and from the right, which differ
/// only for laws with atoms.
struct VirginGrid {
  double step = 0.0;
  std::vector<double> left, right;
};

/// The renewal equation with f linear between nodes, integrated exactly against dG over each cell.
/// Error O(step^2). Atoms are moved to their nearest nodes.
VirginGrid solve_renewal(const UnitLaw& unit, const std::vector<Atom>& atoms, double step, int cells) {
  const std::size_t n = static_cast<std::size_t>(cells);
  // The law on the nodes: mass and first moment of the part without atoms, mass of the atoms.
  std::vector<double> mass(n + 1, 0.0), first(n + 1, 0.0), survival(n + 1, 0.0), atom_mass(n + 1, 0.0);
  for (std::size_t i = 0; i <= n; ++i) {
    const double x = static_cast<double>(i) * step;
    mass[i] = unit.partial_moment(0, x);
    first[i] = unit.partial_moment(1, x);
    for (const Atom& atom : atoms) {
      if (atom.length < x) {
        mass[i] -= atom.mass;
        first[i] -= atom.mass * atom.length;
      }
    }
  }
  std::vector<std::size_t> atom_nodes;
  for (const Atom& atom : atoms) {
    const double node = whole_part(atom.length / step + 0.5);
    if (node > static_cast<double>(n)) continue;
    const std::size_t j = static_cast<std::size_t>(node);
    if (atom_mass[j] == 0.0) atom_nodes.push_back(j);
    atom_mass[j] += atom.mass;
  }
  double atoms_below = 0.0;
  for (std::size_t i = 0; i <= n; ++i) {  // P(delta >= node)
    survival[i] = atoms.empty() ? unit.survival(static_cast<double>(i) * step)
                                : std::max(1.0 - mass[i] - atoms_below, 0.0);
    atoms_below += atom_mass[i];
  }
  // near[j], far[j]: what cell j = [node j, node j + 1] gives to f at its near end, x - node j, and at
  // its far end. weight[j] = all that node j gives.
  std::vector<double> weight(n + 1, 0.0), far(n + 1, 0.0);
  std::size_t begin = n + 1, end = 0;
  for (std::size_t j = 0; j < n; ++j) {
    const double cell = mass[j + 1] - mass[j];
    if (!(cell > 1e-30)) continue;  // nothing, and too little to divide by
    const double share = (first[j + 1] - first[j]) / (cell * step) - static_cast<double>(j);
    far[j] = cell * std::min(std::max(share, 0.0), 1.0);
    weight[j] += cell - far[j];
    weight[j + 1] += far[j];
    begin = std::min(begin, j);
    end = j + 2;
  }
  begin = std::max<std::size_t>(begin, 1);

  VirginGrid grid;
  grid.step = step;
  grid.left.assign(n + 1, 0.0);
  grid.right.assign(n + 1, 0.0);
  std::vector<double> jump(n + 1, 0.0);
  std::vector<std::size_t> jump_nodes;
  const double implicit = 1.0 - weight[0] - atom_mass[0];
  for (std::size_t i = 1; i <= n; ++i) {
    // Four sums side by side hide the latency of the additions.
    const std::size_t stop = std::min(end, i);
    double part[4] = {0.0, 0.0, 0.0, 0.0};
    std::size_t j = begin;
    const double* f = grid.left.data() + i;
    for (; j + 4 <= stop; j += 4) {
      const double* w = weight.data() + j;
      const double* g = f - j;
      part[0] += w[0] * g[0];
      part[1] += w[1] * g[-1];
      part[2] += w[2] * g[-2];
      part[3] += w[3] * g[-3];
    }
    for (; j < stop; ++j) part[0] += weight[j] * f[-static_cast<std::ptrdiff_t>(j)];
    double sum = (part[0] + part[1]) + (part[2] + part[3]);
    for (const std::size_t node : jump_nodes) sum += far[i - node - 1] * jump[node];
    double jump_here = 0.0;
    for (const std::size_t node : atom_nodes) {
      if (node == 0 || node > i) continue;
      sum += atom_mass[node] * grid.left[i - node];
      jump_here += atom_mass[node] * jump[i - node];
    }
    const double x = static_cast<double>(i) * step;
    grid.left[i] = (sum + x * survival[i]) / implicit;
    if (i > 0) jump_here -= x * atom_mass[i];
    jump[i] = jump_here / (1.0 - atom_mass[0]);
    grid.right[i] = grid.left[i] + jump[i];
    if (jump_here != 0.0) jump_nodes.push_back(i);
  }
  return grid;
}

/// Two grids, extrapolated: error O(step^4) where f is smooth. Returns the nodes of the finer one.
VirginGrid solve_renewal_extrapolated(const UnitLaw& unit, const std::vector<Atom>& atoms, double fine_step,
                                      int fine_cells) {
  const VirginGrid coarse = solve_renewal(unit, atoms, 2.0 * fine_step, fine_cells / 2);
  VirginGrid fine = solve_renewal(unit, atoms, fine_step, fine_cells);
  const auto extrapolate = [](const std::vector<double>& rough, std::vector<double>& good) {
    double before = 0.0;
    for (std::size_t i = 1; i < rough.size(); ++i) {
      const double correction = (good[2 * i] - rough[i]) / 3.0;
      good[2 * i - 1] += 0.5 * (before + correction);
      good[2 * i] += correction;
      before = correction;
    }
  };
  extrapolate(coarse.left, fine.left);
  extrapolate(coarse.right, fine.right);
  return fine;
}

/// Largest step for an error below 1e-6: a part of the width of the law, finer where its density jumps.
double resolving_step(const SnapLength& law) noexcept {
  const bool has_jumps = law.law() == SnapLaw::uniform || law.law() == SnapLaw::table;
  return has_jumps ? std::min(1.0 / 1024, law.cv() / 256) : std::min(1.0 / 512, law.cv() / 32);
}

/// Step not above `largest` at which the atoms lie nearest to the nodes of a grid of twice the step.
double step_for_atoms(const std::vector<Atom>& atoms, double largest) noexcept {
  double best = largest, best_misfit = detail::infinity;
  const int start = static_cast<int>(1.0 / largest);
  for (int i = 0; i < 2000; ++i) {
    // The first atom on a node exactly, the others by trial.
    const double count = whole_part(0.5 * atoms.back().length * (start + 0.5 * i)) + 1.0;
    const double step = 0.5 * atoms.back().length / count;
    double misfit = 0.0;
    for (const Atom& atom : atoms) {
      const double node = 0.5 * atom.length / step;
      misfit = std::max(misfit, detail::magnitude(node - whole_part(node + 0.5)));
    }
    if (misfit < 0.9 * best_misfit) {
      best = step;
      best_misfit = misfit;
    }
  }
  return best;
}

double kinetic_deflection(const SnapLength& law, SnapRule rule) {
  if (rule == SnapRule::keep) return 0.5;
  return 0.5 * (1.0 + law.cv() * law.cv());
}

double redraw_deflection(const SnapLength& law, double x) {
  if (law.law() == SnapLaw::single) return uniform_remainder(1.0, 1.0, x, false);
  if (law.law() == SnapLaw::exponential) return -detail::expm1(-x);  // z = min(age, x), both memoryless
  // The waves of a law without atoms die out as exp(-2 pi^2 cv^2 x), 3e-9 here, unless its tail is heavy.
  const bool light_tail = law.law() == SnapLaw::uniform || law.law() == SnapLaw::normal ||
                          (law.law() == SnapLaw::lognormal && law.cv() <= 0.5);
  if (light_tail && x > 40.0 + 1.0 / (law.cv() * law.cv())) return kinetic_deflection(law, SnapRule::redraw);
  const UnitLaw unit(law);
  const std::vector<Atom> atoms = find_atoms(law);
  // Work is cells times those of them that the law reaches. Beyond x of about 100 the step grows to bound
  // it (a second or so), and the error of wide lognormal laws and of tables with it.
  constexpr double most_work = 2e9;
  const double reach = std::min(law.longest() / law.mean(), x);
  double step = std::max(resolving_step(law), detail::square_root(x * reach / most_work));
  if (atoms.empty()) {
    const int half_cells = static_cast<int>(x / (2.0 * step)) + 1;
    step = x / (2.0 * half_cells);
    return solve_renewal_extrapolated(unit, atoms, step, 2 * half_cells).left.back();
  }
  step = step_for_atoms(atoms, step);
  const int cells = 2 * (static_cast<int>(x / (2.0 * step)) + 2);
  const VirginGrid grid = solve_renewal_extrapolated(unit, atoms, step, cells);
  const std::size_t i = static_cast<std::size_t>(x / step);
  const double share = x / step - static_cast<double>(i);
  return grid.right[i] * (1.0 - share) + grid.left[i + 1] * share;
}

// ---------------------------------------------------------------------------------------------------
// peaks

/// Golden section steps: where f is smooth the square of the place counts, at a kink the place itself.
constexpr int smooth_iterations = 22, kink_iterations = 60;

/// Maximum of f on [low, high], where it has one hump: golden section.
template <class Function>
double maximum_between(const Function& f, double low, double high, int iterations) {
  constexpr double golden = 0.6180339887498949;
  double x1 = high - golden * (high - low), x2 = low + golden * (high - low);
  double f1 = f(x1), f2 = f(x2);
  for (int i = 0; i < iterations; ++i) {
    if (f1 < f2) {
      low = x1;
      x1 = x2;
      f1 = f2;
      f2 = f(x2 = low + golden * (high - low));
    } else {
      high = x2;
      x2 = x1;
      f2 = f1;
      f1 = f(x1 = high - golden * (high - low));
    }
  }
  return std::max(f1, f2);
}

/// Maximum of f over ascending points, then within the two intervals beside the best of them.
template <class Function>
double maximum_over(const Function& f, const std::vector<double>& points, int iterations) {
  std::size_t best = 0;
  double peak = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double value = f(points[i]);
    if (value <= peak) continue;
    peak = value;
    best = i;
  }
  const double low = points[best > 0 ? best - 1 : 0];
  const double high = points[std::min(best + 1, points.size() - 1)];
  return std::max(peak, maximum_between(f, low, high, iterations));
}

/// Peak of x - M1(x), and where it lies: the peak of laws so narrow that nothing snaps twice before it.
void find_first_pass_peak(const UnitLaw& unit, double& peak, double& place) {
  const SnapLength& law = unit.law;
  peak = place = 0.0;
  const auto consider = [&](double x) {
    const double value = unit.first_pass(x);
    if (value > peak) {
      peak = value;
      place = x;
    }
  };
  if (law.law() == SnapLaw::uniform) {
    // The slope is 1 up to min, then 1 - x / (max - min).
    consider(std::max(law.first_parameter(), law.second_parameter() - law.first_parameter()) / unit.mean);
  } else if (law.law() == SnapLaw::table) {
    const Span<const double> q = law.table_values();
    for (std::size_t i = 0; i + 1 < q.size(); ++i) {
      const double a = q[i] / unit.mean, b = q[i + 1] / unit.mean;
      consider(std::min(std::max(a, (b - a) * static_cast<double>(q.size() - 1)), b));
      consider(b);
    }
  } else {
    // One hump, a few deviations below the mean.
    const double low = std::max(1.0 - 10.0 * law.cv(), 0.0), high = 1.0 + 2.0 * law.cv();
    peak = maximum_between([&](double x) { return unit.first_pass(x); }, low, high, 40);
    place = high;
    for (int i = 0; i < 64; ++i) {  // the place only roughly, from above
      const double x = low + (high - low) * i / 64.0;
      if (unit.first_pass(x) > peak * (1.0 - 1e-3)) place = x;
    }
  }
}

double keep_peak(const SnapLength& law) {
  const auto f = [&](double x) { return keep_deflection(law, x, true); };
  std::vector<double> points;
  int iterations = kink_iterations;
  if (law.law() == SnapLaw::table) {
    const double mean = law.mean();
    const Span<const double> q = law.table_values();
    for (const double value : q) points.push_back(value / mean);
    const double end = std::max(2.0 * law.longest() / mean, 3.0);
    for (double x = 1e-2; x < end; x *= 1.02) points.push_back(x);
    std::sort(points.begin(), points.end());
  } else if (law.law() == SnapLaw::uniform) {
    const double a = law.first_parameter() / law.mean();
    for (int i = 0; i <= 400; ++i) points.push_back(a + (3.0 - a) * i / 400.0);
  } else {
    // The wider a lognormal law, the farther out its (ever lower) peak: 115 mean lengths at cv = 3.
    const double end = law.cv() < 0.65 ? 2.5 : law.cv() < 1.1 ? 8.0 : 500.0;
    for (double x = 0.4; x < end; x *= 1.06) points.push_back(x);
    iterations = smooth_iterations;
  }
  return maximum_over(f, points, iterations);
}

/// Largest value on a grid. Where f is smooth the parabola through the best three nodes.
double grid_peak(const VirginGrid& grid, bool smooth) {
  double peak = 0.0;
  std::size_t best = 0;
  for (std::size_t i = 0; i < grid.left.size(); ++i) {
    const double value = std::max(grid.left[i], grid.right[i]);
    if (value <= peak) continue;
    peak = value;
    best = i;
  }
  if (!smooth || best == 0 || best + 1 >= grid.left.size()) return peak;
  const double before = grid.left[best - 1], after = grid.left[best + 1];
  const double bend = 2.0 * peak - before - after;
  return bend > 0.0 ? peak + detail::square(after - before) / (8.0 * bend) : peak;
}

double redraw_peak(const SnapLength& law) {
  constexpr int most_cells = 8192;
  const UnitLaw unit(law);
  const std::vector<Atom> atoms = find_atoms(law);
  const auto peak_up_to = [&](double end) {
    double step = std::max(resolving_step(law), end / most_cells);
    if (!atoms.empty()) step = step_for_atoms(atoms, step);
    const int cells = 2 * (static_cast<int>(end / (2.0 * step)) + 2);
    return grid_peak(solve_renewal_extrapolated(unit, atoms, step, cells), law.law() != SnapLaw::table);
  };
  // A law wider than these has its only or highest hump within two mean lengths; a table may not.
  double peak = peak_up_to(2.0);
  const double longest = law.longest() / law.mean();
  if (law.law() == SnapLaw::table && longest > 1.5) peak = std::max(peak, peak_up_to(1.5 * longest));
  return peak;
}

/// Supremum of the virgin curve.
double peak_deflection(const SnapLength& law, SnapRule rule) {
  if (law.law() == SnapLaw::single) return 1.0;
  if (law.law() == SnapLaw::exponential && rule == SnapRule::redraw) return 1.0;  // 1 - exp(-x)
  if (law.cv() < 0.25 || law.law() == SnapLaw::uniform) {
    const UnitLaw unit(law);
    double peak, place;
    find_first_pass_peak(unit, peak, place);
    if (unit.partial_moment(0, 0.5 * place) < 1e-10) return peak;
  }
  // Curves without a hump rise to the kinetic value.
  const double peak = rule == SnapRule::keep ? keep_peak(law) : redraw_peak(law);
  return std::max(peak, kinetic_deflection(law, rule));
}

// ---------------------------------------------------------------------------------------------------
// coefficients to parameters

/// A family of laws of one mean, from `single` (spread 0) on.
struct Family {
  SnapLaw law;
  SnapRule rule;

  /// Largest spread up to which peak / kinetic falls.
  double widest() const noexcept {
    switch (law) {
      // keep: until the minimum is 0.
      case SnapLaw::uniform:
        return rule == SnapRule::redraw ? widest_falling_uniform : 0.5773502691896257;
      case SnapLaw::normal:
        return 1.0;
      case SnapLaw::lognormal:
        return 3.0;
      default:
        return 0.0;
    }
  }

  SnapLength make(double mean_m, double spread) const {
    switch (law) {
      case SnapLaw::uniform: {
        const double half = 1.7320508075688772 * spread * mean_m;
        return SnapLength::uniform(std::max(mean_m - half, 0.0), mean_m + half);
      }
      case SnapLaw::normal: {
        // Cutting at 0 raises the mean: ask for less.
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

  double ratio(double spread) const {
    const SnapLength unit = make(1.0, spread);
    return peak_deflection(unit, rule) / kinetic_deflection(unit, rule);
  }

  // For w = max - min from 2/3 to 1 the peak is 5 w / 8 + 1 / (2 w) - 1/2 and the kinetic value (1 + w^2/12)
  // / 2; their ratio is least, 1.15302, at w = 0.969609. Wider laws up to w = 2 stay between 1.153 and 1.159.
  static constexpr double widest_falling_uniform = 0.27990193654;
};

const char* rule_name(SnapRule rule) noexcept { return rule == SnapRule::keep ? "keep" : "redraw"; }

/// The spread at which peak / kinetic is `wanted`; the smallest where there are several.
double solve_spread(const Family& family, double wanted) {
  double low = 0.0, high = family.widest();
  double low_excess = 2.0 - wanted, high_excess = family.ratio(high) - wanted;
  if (low_excess <= 0.0) return 0.0;
  // Bisection and the secant in turn: the ratio is flat at both ends of some families.
  for (int i = 0; i < 80 && high - low > 1e-13 * high; ++i) {
    double middle = 0.5 * (low + high);
    if (i % 2 == 1 && high_excess < -1e-7) {
      middle = low + (high - low) * low_excess / (low_excess - high_excess);
      const double margin = 1e-3 * (high - low);
      middle = std::min(std::max(middle, low + margin), high - margin);
    }
    const double excess = family.ratio(middle) - wanted;
    if (excess > 0.0) {
      low = middle;
      low_excess = excess;
      if (excess < 1e-10) break;
    } else {
      high = middle;
      high_excess = excess;
      if (excess < 0.0 && excess > -1e-10) break;
    }
  }
  return low_excess < -high_excess ? low : high;
}

}  // namespace

double virgin_deflection(const SnapLength& law, SnapRule rule, double x_over_mean) {
  const double x = detail::magnitude(x_over_mean);
  if (!(x <= 1e6)) detail::refuse("virgin_deflection", "x_over_mean", x_over_mean, "-1e6 to 1e6");
  if (x == 0.0) return 0.0;
  const double f = rule == SnapRule::keep ? keep_deflection(law, x, false) : redraw_deflection(law, x);
  return x_over_mean < 0.0 ? -f : f;
}

double Material::peak_coefficient() const {
  return bristle_stiffness * snap_length.mean() * peak_deflection(snap_length, snap_rule) /
         (normal_stiffness * asperity_height_deviation);
}

Material Material::from_coefficients(const Coefficients& c) {
  using detail::require_within;
  const char* const where = "Coefficients";
  require_within(where, "kinetic", c.kinetic, 1e-9, 1e6);
  require_within(where, "peak", c.peak, 1e-9, 2e6);
  require_within(where, "presliding_length", c.presliding_length, 1e-12, 1e3, "m");
  require_within(where, "bristles_per_newton", c.bristles_per_newton, 1e-6, 1e15, "1/N");
  require_within(where, "damping_per_newton", c.damping_per_newton, 0.0, 1e15, "s/m");
  require_within(where, "viscous_friction", c.viscous_friction, 0.0, 1e15, "N s/m");
  require_within(where, "stribeck_velocity", c.stribeck_velocity, 0.0, 1e15, "m/s");
  if (c.rule != SnapRule::redraw && c.rule != SnapRule::keep) {
    detail::refuse(where, "rule", static_cast<int>(c.rule), "redraw (0) or keep (1)");
  }
  if (c.damper_decay != DamperDecay::exponential && c.damper_decay != DamperDecay::gaussian) {
    detail::refuse(where, "damper_decay", static_cast<int>(c.damper_decay),
                   "exponential (0) or gaussian (1)");
  }
  if (static_cast<int>(c.law) > static_cast<int>(SnapLaw::exponential)) {
    throw Error("Coefficients: law = " + std::string(to_string(c.law)) +
                "; allowed are single, uniform, normal, lognormal, exponential: coefficients do not "
                "determine a table");
  }

  const Family family{c.law, c.rule};
  const double ratio = c.peak / c.kinetic;
  const std::string family_text = std::string("law ") + to_string(c.law) + ", rule " + rule_name(c.rule);
  double spread = 0.0;
  if (family.widest() == 0.0) {
    const double only = family.ratio(0.0);
    if (!(detail::magnitude(ratio - only) <= 1e-3)) {
      detail::refuse(where, "peak / kinetic", ratio,
                     detail::number_text(only) + " (" + family_text + ", which has no spread to choose)");
    }
  } else {
    // Ratios a rounding outside the range count as its ends.
    constexpr double rounding = 1e-9;
    const double lowest = family.ratio(family.widest());
    if (!(ratio >= lowest - rounding && ratio <= 2.0 + rounding)) {
      detail::refuse(where, "peak / kinetic", ratio,
                     detail::number_text(lowest) + " to 2 (" + family_text + ")");
    }
    spread = solve_spread(family, std::min(std::max(ratio, lowest), 2.0));
  }

  Material material;
  material.snap_length = family.make(c.presliding_length, spread);
  material.snap_rule = c.rule;
  material.asperity_height_deviation = 1e-6;  // suits most industrial surfaces (paper, section 2.3)
  material.normal_stiffness = 1.0 / (c.bristles_per_newton * material.asperity_height_deviation);
  material.bristle_stiffness = 1.0;
  material.bristle_stiffness = c.kinetic / material.kinetic_coefficient();
  material.bristle_damping = c.damping_per_newton / c.bristles_per_newton;
  material.viscous_friction = c.viscous_friction;
  material.stribeck_velocity = c.stribeck_velocity;
  material.damper_decay = c.damper_decay;
  material.validate();
  return material;
}

Coefficients Material::coefficients() const {
  validate();
  Coefficients c;
  c.kinetic = kinetic_coefficient();
  c.peak = peak_coefficient();
  c.presliding_length = snap_length.mean();
  c.bristles_per_newton = bristles_in_contact(1.0);
  c.law = snap_length.law();
  c.rule = snap_rule;
  c.damping_per_newton = bristle_damping * c.bristles_per_newton;
  c.viscous_friction = viscous_friction;
  c.stribeck_velocity = stribeck_velocity;
  c.damper_decay = damper_decay;
  return c;
}

}  // namespace bristle
