// Virgin curves: force at first loading, all deflections zero, and their peak.
//
// Lengths here are in units of the mean snap length, deflections beyond the residual length: the curve of a
// material with a residual l_r is x up to l_r, then l_r + f(x - l_r). G(x) = P(delta <= x), S = 1 - G,
// M1(x) = E[delta; delta < x].
//   keep:   f(x) = E[x mod delta] = x - sum over k >= 1 of M1(x / k)
//   redraw: f(x) = x S(x) + integral over 0 < t <= x of f(x - t) dG(t)      (renewal equation)
// With shared renewal kappa, the share of bristles never renewed since the start falls as 1/E. Divided by
// that share, numbers of bristles do not fall by renewal, and a snap leaves 1 + kappa straight bristles, not
// one. This gives two linear renewal equations, for E and for F with f = F / E (core/MODEL.md, "Rubbing"):
//   redraw: E(x) = S(x) + (1 + kappa) integral of E(x - t) dG(t);   F has the source x S(x) instead of S(x)
//   keep:   E(x) = 1 + kappa integral of E(x - t) dH(t);            F has the source f of kappa = 0 instead
//           of 1; H(t) = sum over k >= 1 of G(t / k), the snaps of a bristle that keeps its length
// E and F grow as exp(lambda x), so they are solved times exp(-lambda x), which stays bounded.
#include "core/materials/virgin_curve.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "bristle/config.hpp"
#include "core/materials/elementary.hpp"
#include "core/materials/law_at.hpp"
#include "core/materials/slow_wave.hpp"
#include "core/materials/solve.hpp"
#include "core/materials/steady_sliding.hpp"

namespace bristle::detail {

namespace {

double whole_part(double x) noexcept { return std::floor(x); }

/// Snap-length law with lengths in units of its mean, the unit of all functions in this file.
struct UnitLaw {
  const SnapLength& law;
  double mean;

  explicit UnitLaw(const SnapLength& snap_length) noexcept : law(snap_length), mean(snap_length.mean()) {}

  double survival(double x) const { return law.survival(x * mean); }
  double partial_moment(int k, double x) const {
    return law.partial_moment(k, x * mean) / (k == 0 ? 1.0 : k == 1 ? mean : mean * mean);
  }
  /// Returns f(x), the mean deflection after the path x from rest, as long as no bristle has snapped twice;
  /// for both rules. At an atom (one length with a probability) it is the limit from the left.
  double first_pass(double x) const { return x - partial_moment(1, x); }
  /// Returns f(x), the mean deflection after the path x from rest, as long as no bristle has snapped twice,
  /// with shared renewal `renewal`.
  double first_pass(double x, double renewal) const {
    if (renewal == 0.0) return first_pass(x);
    const double snapped = partial_moment(0, x);
    return (x * (1.0 + renewal * snapped) - (1.0 + renewal) * partial_moment(1, x)) /
           (1.0 + renewal * snapped);
  }
};

// ------------------------------------------------------------------------------------------------ keep

/// Returns the sum of 1/k^2 over k > n, the tail of a series that is summed one by one up to n.
double tail_of_inverse_squares(double n) noexcept {
  double sum = 0.0;
  while (n < 32.0) {
    n += 1.0;
    sum += 1.0 / (n * n);
  }
  // Adds the remaining terms by the Euler-Maclaurin expansion at n + 1/2; the first term left out is below
  // 1e-15.
  const double w = 1.0 / (n + 0.5);
  const double w2 = w * w;
  return sum + w * (1.0 - w2 * (1.0 / 12 - w2 * (7.0 / 240 - w2 * (31.0 / 1344))));
}

/// Returns the expectation E[x mod delta] for snap lengths delta uniformly distributed on [a, b]; a = b is an
/// atom at a. Where x is a multiple of an atom the remainder jumps from a to 0: `from_left` asks for a.
double uniform_remainder(double a, double b, double x, bool from_left) noexcept {
  if (a == b) {
    const double remainder = x - whole_part(x / a) * a;
    return from_left && remainder <= 0.0 && x > 0.0 ? a : std::max(remainder, 0.0);
  }
  // Splits the sum over k of M1(x / k). Up to k0 each term equals the mean of delta, and above k1 each term
  // is zero.
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
    if (a > 0.0) atoms_below = a * x;  // k1 a equals x to rounding
  }
  return x - k0 * 0.5 * (a + b) - (x * x * inverse_squares - atoms_below) / (2.0 * (b - a));
}

/// Finds the interval of lengths outside which a smooth law has less than 1e-18 of its mean, so that sums can
/// leave the others out.
void effective_support(const UnitLaw& unit, double& low, double& high) noexcept {
  const double a = unit.law.first_parameter() / unit.mean, b = unit.law.second_parameter();
  low = 0.0;
  high = 45.0;  // upper end for an exponential law, in mean lengths
  if (unit.law.law() == SnapLaw::normal) {
    low = std::max(a - 9.0 * b / unit.mean, 0.0);
    high = a + 9.0 * b / unit.mean;
  } else if (unit.law.law() == SnapLaw::lognormal) {
    const double s2 = detail::log1p(b * b), s = detail::square_root(s2);
    low = detail::exp(0.5 * s2 - 9.0 * s);
    high = detail::exp(0.5 * s2 + 9.0 * s);
  }
}

/// Returns E[x mod delta] of a law with a smooth density. Sums 100 terms one by one; instead of the later
/// ones takes their integral over k, E[(x - kappa delta)+] with kappa = last k + 1/2, and two Euler-Maclaurin
/// corrections.
double smooth_remainder(const UnitLaw& unit, double x) {
  constexpr double direct_terms = 100.0;
  double low, high;
  effective_support(unit, low, high);
  double k = whole_part(x / high);
  const double last = k + direct_terms;
  double sum = k;  // sum of the first k terms, each of which is the whole mean, 1 (in mean lengths)
  double before = 1.0, term = 1.0;
  for (k += 1.0; k <= last; k += 1.0) {
    if (x < low * k) return x - sum;
    before = term;
    term = unit.partial_moment(1, x / k);
    sum += term;
  }
  const double kappa = last + 0.5;
  const double share = 1.0 - unit.survival(x / kappa);
  const double remainder = x * share - kappa * unit.partial_moment(1, x / kappa);
  // Replaces the derivatives in the corrections by first and third differences about k = kappa.
  const double next = unit.partial_moment(1, x / (last + 1.0)),
               after = unit.partial_moment(1, x / (last + 2.0));
  const double difference = next - term, third = after - 3.0 * next + 3.0 * term - before;
  return x - (sum + std::max(remainder, 0.0) + difference / 24.0 - third * (17.0 / 5760));
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
      for (std::size_t i = 0; i + 1 < q.size(); ++i)
        sum += uniform_remainder(q[i] / mean, q[i + 1] / mean, x, from_left);
      return sum / static_cast<double>(q.size() - 1);
    }
    default:
      return smooth_remainder(UnitLaw(law), x);
  }
}

// ---------------------------------------------------------------------------------------------- redraw

struct Atom {
  double length, probability;
};

/// Finds the atoms of a table (lengths that have a probability of their own): runs of equal values.
std::vector<Atom> find_atoms(const SnapLength& law) {
  std::vector<Atom> atoms;
  const Span<const double> q = law.table_values();
  const double mean = law.mean();
  for (std::size_t i = 0; i + 1 < q.size(); ++i) {
    if (q[i] != q[i + 1]) continue;
    const double length = q[i] / mean, probability = 1.0 / static_cast<double>(q.size() - 1);
    if (!atoms.empty() && atoms.back().length == length) {
      atoms.back().probability += probability;
    } else {
      atoms.push_back({length, probability});
    }
  }
  return atoms;
}

/// Values of f, the mean deflection in first loading with SnapRule::redraw, on equidistant nodes. The limits
/// from the left and from the right differ only for laws with atoms.
struct VirginGrid {
  double step = 0.0;
  std::vector<double> left, right;
};

/// Snap-length law on equidistant nodes, for the renewal equation: probability and first moment, up to each
/// node, of the part without atoms, and the probability of the atoms at each node.
struct LawOnGrid {
  double step = 0.0;
  std::vector<double> probability, first, survival, atom_probability;  ///< survival[i]: P(delta >= node i)
  std::vector<std::size_t> atom_nodes;
  std::size_t last() const noexcept { return probability.size() - 1; }
};

/// Moves atoms (lengths that have a probability) to their nearest nodes, and recomputes `survival` with them.
void add_atoms(const std::vector<Atom>& atoms, LawOnGrid& law) {
  law.atom_probability.assign(law.probability.size(), 0.0);
  if (atoms.empty()) return;
  for (const Atom& atom : atoms) {
    const double node = whole_part(atom.length / law.step + 0.5);
    if (node > static_cast<double>(law.last())) continue;
    const std::size_t j = static_cast<std::size_t>(node);
    if (law.atom_probability[j] == 0.0) law.atom_nodes.push_back(j);
    law.atom_probability[j] += atom.probability;
  }
  double atoms_below = 0.0;
  for (std::size_t i = 0; i < law.probability.size(); ++i) {
    law.survival[i] = std::max(1.0 - law.probability[i] - atoms_below, 0.0);
    atoms_below += law.atom_probability[i];
  }
}

LawOnGrid put_on_grid(const UnitLaw& unit, const std::vector<Atom>& atoms, double step, int cells) {
  const std::size_t n = static_cast<std::size_t>(cells);
  std::vector<double> lengths(n);
  for (std::size_t i = 0; i < n; ++i) lengths[i] = static_cast<double>(i + 1) * step * unit.mean;
  std::vector<LawAt> at(n);
  read_law(unit.law, {lengths.data(), n}, {at.data(), n});
  LawOnGrid law;
  law.step = step;
  law.probability.assign(n + 1, 0.0);
  law.first = law.probability;
  law.survival.assign(n + 1, unit.survival(0.0));
  for (std::size_t i = 1; i <= n; ++i) {
    law.probability[i] = at[i - 1].probability;
    law.first[i] = at[i - 1].first / unit.mean;
    law.survival[i] = at[i - 1].survival;
    for (const Atom& atom : atoms) {
      if (atom.length < static_cast<double>(i) * step) {
        law.probability[i] -= atom.probability;
        law.first[i] -= atom.probability * atom.length;
      }
    }
  }
  add_atoms(atoms, law);
  return law;
}

/// Makes the law on a grid of twice the step, by leaving out every other node. Extrapolating from the
/// solutions on both grids raises the order of the error.
LawOnGrid every_other_node(const LawOnGrid& fine, const std::vector<Atom>& atoms) {
  LawOnGrid law;
  law.step = 2.0 * fine.step;
  for (std::size_t i = 0; i <= fine.last(); i += 2) {
    law.probability.push_back(fine.probability[i]);
    law.first.push_back(fine.first[i]);
    law.survival.push_back(fine.survival[i]);
  }
  add_atoms(atoms, law);
  return law;
}

/// Weights of the nodes in a sum that gives the expectation of a function over a law, exact if the function
/// is linear between nodes. make_kernel() multiplies the law by `factor` and by `damping`, exp(-lambda x) at
/// the nodes (empty: by 1).
struct VolterraKernel {
  std::vector<double> weight;  ///< weight of each node, from the cells on both sides
  /// For each cell j, between nodes j and j + 1, the part of its probability that counts at node j + 1.
  std::vector<double> far;
  std::vector<double> atom_probability;
  std::vector<std::size_t> atom_nodes;
  std::size_t begin = 1, end = 0;  ///< range of the nodes that have a weight

  /// Whether the grid is too coarse for its equation to be solved, because too many bristles snap within the
  /// first cell.
  bool too_coarse() const noexcept { return !(weight[0] + atom_probability[0] < 0.5); }
};

VolterraKernel make_kernel(const LawOnGrid& law, double factor, const std::vector<double>& damping) {
  const std::size_t n = law.last();
  const auto damped = [&](std::size_t i) { return damping.empty() ? factor : factor * damping[i]; };
  VolterraKernel kernel;
  kernel.weight.assign(n + 1, 0.0);
  kernel.far = kernel.weight;
  kernel.begin = n + 1;
  for (std::size_t j = 0; j < n; ++j) {
    const double cell = law.probability[j + 1] - law.probability[j];
    if (!(cell > 1e-30)) continue;  // skips a cell whose probability is too small to divide by
    const double share = (law.first[j + 1] - law.first[j]) / (cell * law.step) - static_cast<double>(j);
    const double far = cell * std::min(std::max(share, 0.0), 1.0);
    kernel.far[j] = far * damped(j + 1);
    kernel.weight[j] += (cell - far) * damped(j);
    kernel.weight[j + 1] += kernel.far[j];
    kernel.begin = std::min(kernel.begin, j);
    kernel.end = j + 2;
  }
  kernel.begin = std::max<std::size_t>(kernel.begin, 1);
  kernel.atom_nodes = law.atom_nodes;
  kernel.atom_probability = law.atom_probability;
  for (const std::size_t node : kernel.atom_nodes) kernel.atom_probability[node] *= damped(node);
  return kernel;
}

/// Source term of a renewal equation at the nodes: its limit from the left, and its jump there. A source that
/// is not 0 at x = 0 jumps there.
struct Source {
  std::vector<double> left, jump;
};

/// Solves a renewal equation (see the beginning of this file) for a function f that is taken as linear
/// between nodes. The error is of order step^2.
VirginGrid solve_volterra(const VolterraKernel& kernel, const Source& source, double step) {
  const std::size_t n = kernel.weight.size() - 1;
  VirginGrid grid;
  grid.step = step;
  grid.left.assign(n + 1, 0.0);
  grid.right.assign(n + 1, 0.0);
  std::vector<double> jump(n + 1, 0.0);
  std::vector<std::size_t> jump_nodes;
  if (source.jump[0] != 0.0) {
    grid.right[0] = jump[0] = source.jump[0];
    jump_nodes.push_back(0);
  }
  const double implicit = 1.0 - kernel.weight[0] - kernel.atom_probability[0];
  for (std::size_t i = 1; i <= n; ++i) {
    // Adds up four sums side by side. Within one sum each addition waits for the one before.
    const std::size_t stop = std::min(kernel.end, i);
    double part[4] = {0.0, 0.0, 0.0, 0.0};
    std::size_t j = kernel.begin;
    const double* f = grid.left.data() + i;
    for (; j + 4 <= stop; j += 4) {
      const double* w = kernel.weight.data() + j;
      const double* g = f - j;
      part[0] += w[0] * g[0];
      part[1] += w[1] * g[-1];
      part[2] += w[2] * g[-2];
      part[3] += w[3] * g[-3];
    }
    for (; j < stop; ++j) part[0] += kernel.weight[j] * f[-static_cast<std::ptrdiff_t>(j)];
    double sum = (part[0] + part[1]) + (part[2] + part[3]);
    for (const std::size_t node : jump_nodes) sum += kernel.far[i - node - 1] * jump[node];
    double jump_here = 0.0;
    for (const std::size_t node : kernel.atom_nodes) {
      if (node == 0 || node > i) continue;
      sum += kernel.atom_probability[node] * grid.left[i - node];
      jump_here += kernel.atom_probability[node] * jump[i - node];
    }
    grid.left[i] = (sum + source.left[i]) / implicit;
    jump_here += source.jump[i];
    jump[i] = jump_here / (1.0 - kernel.atom_probability[0]);
    grid.right[i] = grid.left[i] + jump[i];
    if (jump_here != 0.0) jump_nodes.push_back(i);
  }
  return grid;
}

/// Renewal equations for a virgin curve. The curve is the solution `deflections` or, with shared renewal,
/// that solution divided by the solution `bristles`.
struct VolterraProblem {
  VolterraKernel kernel;
  Source deflections, bristles;
};

/// Sets up the equations of SnapRule::redraw, with the sources x S(x) (deflections) and S(x) (bristles). No
/// `damping`: without shared renewal, where the number of bristles stays.
VolterraProblem pose_redraw(const LawOnGrid& law, double renewal, const std::vector<double>& damping) {
  const std::size_t n = law.last();
  VolterraProblem problem;
  problem.kernel = make_kernel(law, 1.0 + renewal, damping);
  Source& deflections = problem.deflections;
  deflections.left.resize(n + 1);
  deflections.jump.resize(n + 1);
  for (std::size_t i = 0; i <= n; ++i) {
    const double x = static_cast<double>(i) * law.step;
    deflections.left[i] = x * law.survival[i];
    deflections.jump[i] = -(x * law.atom_probability[i]);
  }
  if (damping.empty()) return problem;
  Source& bristles = problem.bristles;
  bristles.left.assign(law.survival.begin(), law.survival.end());
  bristles.jump.resize(n + 1);
  for (std::size_t i = 0; i <= n; ++i) {
    bristles.left[i] *= damping[i];
    bristles.jump[i] = -law.atom_probability[i] * damping[i];
    deflections.left[i] *= damping[i];
    deflections.jump[i] *= damping[i];
  }
  bristles.left[0] = 0.0;
  bristles.jump[0] += 1.0;
  return problem;
}

/// Extrapolates the solutions on two grids to step 0, which leaves an error of order step^4 where f is
/// smooth. Overwrites the finer solution with the result.
void extrapolate_grids(const VirginGrid& coarse, VirginGrid& fine) {
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
}

/// Returns the largest grid step for an error below 1e-6: in proportion to the width of the law, and finer
/// where its density jumps.
double resolving_step(const SnapLength& law) noexcept {
  const bool has_jumps = law.law() == SnapLaw::uniform || law.law() == SnapLaw::table;
  return has_jumps ? std::min(1.0 / 1024, law.cv() / 256) : std::min(1.0 / 512, law.cv() / 32);
}

/// Returns a grid step, at most `largest`, for a law with atoms: all of them then lie close to nodes of the
/// grid of twice that step, so that placing them on nodes shifts them little.
double step_for_atoms(const std::vector<Atom>& atoms, double largest) noexcept {
  // Keeps the step `largest` if even the longest atom is shorter than half of it. A grid with nodes at such
  // atoms may need millions of cells, so they may lie up to half a step off a node.
  if (atoms.back().length < 0.5 * largest) return largest;
  double best = largest, best_misfit = detail::infinity;
  const int start = static_cast<int>(1.0 / largest);
  for (int i = 0; i < 2000; ++i) {
    // Puts the longest atom on a node. Of 2000 steps that do so, takes one with which the other atoms lie
    // close to nodes.
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

double paper_kinetic(const SnapLength& law, SnapRule rule) {
  if (rule == SnapRule::keep) return 0.5;
  return 0.5 * (1.0 + law.cv() * law.cv());
}

// ----------------------------------------------------------------------------------------------- peaks

/// Numbers of golden-section steps by which a peak is located. An error in its position changes its value to
/// second order where f is smooth, but to first order at a kink, which therefore needs more steps.
constexpr int smooth_iterations = 22, kink_iterations = 60;

/// Finds the maximum of f over ascending points, then refines it in the two intervals beside the best point.
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
  return std::max(peak, find_maximum(f, low, high, iterations).value);
}

/// Finds the peak of the virgin curve, and at which path it lies, on the part of the path where no bristle
/// has snapped twice. Narrow laws have their peak there.
void find_first_pass_peak(const UnitLaw& unit, double renewal, double& peak, double& position) {
  const SnapLength& law = unit.law;
  peak = position = 0.0;
  const auto consider = [&](double x) {
    const double value = unit.first_pass(x, renewal);
    if (value > peak) {
      peak = value;
      position = x;
    }
  };
  if (law.law() == SnapLaw::uniform) {
    const double low = law.first_parameter() / unit.mean, high = law.second_parameter() / unit.mean;
    if (renewal == 0.0) {
      // Uses the slope of the curve under a uniform law, which is 1 up to the shortest length, then 1 - x /
      // (max - min): the peak is where it is 0.
      consider(std::max(low, high - low));
    } else {
      consider(low);
      const double end = std::min(2.0 * low, high);
      for (int i = 1; i <= 256; ++i) consider(low + (end - low) * i / 256.0);
      const double width = (end - low) / 256.0;
      const auto f = [&](double x) { return unit.first_pass(x, renewal); };
      peak = std::max(
          peak, find_maximum(f, std::max(position - width, low), std::min(position + width, end), 30).value);
    }
  } else if (law.law() == SnapLaw::table) {
    const Span<const double> q = law.table_values();
    for (std::size_t i = 0; i + 1 < q.size(); ++i) {
      const double a = q[i] / unit.mean, b = q[i + 1] / unit.mean;
      consider(std::min(std::max(a, (b - a) * static_cast<double>(q.size() - 1)), b));
      consider(b);
    }
  } else {
    // Searches the peak in the one hump of the curve, from ten standard deviations below the mean length on.
    const double low = std::max(1.0 - 10.0 * law.cv(), 0.0), high = 1.0 + 2.0 * law.cv();
    peak = find_maximum([&](double x) { return unit.first_pass(x, renewal); }, low, high, 40).value;
    position = high;
    // Finds, to within 1/64 of the interval, the longest path at which the curve is still within 1e-3 of its
    // peak.
    for (int i = 0; i < 64; ++i) {
      const double x = low + (high - low) * i / 64.0;
      if (unit.first_pass(x, renewal) > peak * (1.0 - 1e-3)) position = x;
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
    // Searches farther under wider laws. The peak of a lognormal law comes later the wider the law is: at 115
    // mean lengths for cv = 3.
    const double end = law.cv() < 0.65 ? 2.5 : law.cv() < 1.1 ? 8.0 : 500.0;
    for (double x = 0.4; x < end; x *= 1.06) points.push_back(x);
    iterations = smooth_iterations;
  }
  return maximum_over(f, points, iterations);
}

/// Returns the highest value of a curve on a grid. Where the curve is smooth, that is the top of the parabola
/// through the best three nodes.
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

// --------------------------------------------------------------------------------------- shared renewal

/// Law of snap lengths, in cells of uniform density, for bristles that keep their lengths. Gives how often
/// they snap up to a path x, and two sums over these snaps: of where on the path they happen, and of the
/// deflections lost.
class DividedLaw {
 public:
  DividedLaw(const UnitLaw& unit, double cell, double end)
      : cell_(cell), last_(static_cast<std::size_t>(end / cell) + 1), at_(last_ + 1) {
    few_ = unit.partial_moment(0, shortest_that_counts);
    const double few_first = unit.partial_moment(1, shortest_that_counts);
    const auto moments = [&](double x) {
      return Moments{std::max(unit.partial_moment(0, x) - few_, 0.0),
                     std::max(unit.partial_moment(1, x) - few_first, 0.0),
                     {}};
    };
    shortest_ = shortest_that_counts;
    for (std::size_t i = 0; i <= last_; ++i) {
      const double x = static_cast<double>(i) * cell;
      at_[i] = moments(x);
      if (at_[i].probability < 1e-12) shortest_ = std::max(shortest_, x);
    }
    for (std::size_t i = 1; i <= last_; ++i) {
      const double x = static_cast<double>(i) * cell, start = std::max(x - cell, shortest_that_counts);
      at_[i].tail = at_[i - 1].tail;
      if (x <= shortest_) continue;
      // Integrates over a cell by Simpson's rule. The first 64 cells are divided into eight parts. Their
      // width is not small beside u, so 1/u^2 and 1/u^3 vary much within a cell.
      const int parts = i < 64 ? 8 : 1;
      const double part = (x - start) / parts;
      Moments low = i < 64 ? moments(start) : at_[i - 1];
      for (int k = 0; k < parts; ++k) {
        const double begin = start + k * part, middle = begin + 0.5 * part, stop = begin + part;
        const Moments high = k + 1 < parts ? moments(stop) : at_[i];
        const Moments between =
            i < 64 ? moments(middle)
                   : Moments{0.5 * (low.probability + high.probability), 0.5 * (low.first + high.first), {}};
        at_[i].tail.add(part / (6.0 * square(begin)), low, begin);
        at_[i].tail.add(part / (1.5 * square(middle)), between, middle);
        at_[i].tail.add(part / (6.0 * square(stop)), high, stop);
        low = high;
      }
    }
  }

  /// Sums over the numbers k = 1, 2, ... of a bristle's snaps: of G(x / k) (`count`), of k M1(x / k)
  /// (`position`) and of M1(x / k) (`lost`).
  struct Snaps {
    double count = 0.0, position = 0.0, lost = 0.0;

    template <class Moments>
    void add(double weight, const Moments& at, double length) {
      count += weight * at.probability;
      position += weight * at.first / length;
      lost += weight * at.first;
    }
  };
  Snaps snaps_up_to(double x) const {
    // Number of terms that are summed one by one. For larger k the sum is replaced by an integral over the
    // length u = x / k.
    constexpr double direct = 100.0;
    Snaps snaps;
    snaps.lost = x * few_;  // bristles too short to be counted add no deflection
    double k = 1.0;
    for (; k <= direct && x > shortest_ * k; k += 1.0) {
      const Cell at = find(x / k);
      const Moments &low = at_[at.index], &high = at_[at.index + 1];
      const double probability = high.probability - low.probability, share = at.over / cell_;
      // Computes M1(x / k), the part of the mean length from lengths below x / k, as for a uniform density in
      // its cell, plus a linear term that makes the value at the cell's end exact.
      const double first =
          low.first + share * (high.first - low.first) - 0.5 * probability * share * (cell_ - at.over);
      snaps.count += low.probability + probability * share;
      snaps.position += k * first;
      snaps.lost += first;
    }
    if (k <= direct) return snaps;
    const Cell at = find(x / (direct + 0.5));
    const Snaps &low = at_[at.index].tail, &high = at_[at.index + 1].tail;
    const double share = at.over / cell_;
    snaps.count += x * (low.count + share * (high.count - low.count));
    snaps.position += square(x) * (low.position + share * (high.position - low.position));
    snaps.lost += x * (low.lost + share * (high.lost - low.lost));
    return snaps;
  }

 private:
  struct Moments {
    double probability, first;
    Snaps tail;  /// < integrals over the length u, up to the cell's start, of G / u^2, M1 / u^3 and M1 / u^2
  };
  struct Cell {
    std::size_t index;
    double over;
  };
  Cell find(double length) const {
    const std::size_t i = std::min(static_cast<std::size_t>(length / cell_), last_ - 1);
    return {i, std::min(length - static_cast<double>(i) * cell_, cell_)};
  }

  double cell_;
  std::size_t last_;
  double shortest_ = 0.0, few_ = 0.0;
  std::vector<Moments> at_;
};

VolterraProblem pose_keep(const DividedLaw& divided, double renewal, double step,
                          const std::vector<double>& damping) {
  const std::size_t n = damping.size() - 1;
  LawOnGrid snaps;
  snaps.step = step;
  snaps.probability.assign(n + 1, 0.0);
  snaps.first = snaps.atom_probability = snaps.probability;
  VolterraProblem problem;
  problem.deflections = problem.bristles = {snaps.probability, snaps.probability};
  for (std::size_t i = 0; i <= n; ++i) {
    const double x = static_cast<double>(i) * step;
    const DividedLaw::Snaps at = divided.snaps_up_to(x);
    snaps.probability[i] = at.count;
    snaps.first[i] = at.position;
    problem.deflections.left[i] = (x - at.lost) * damping[i];
    problem.bristles.left[i] = damping[i];
  }
  problem.bristles.left[0] = 0.0;
  problem.bristles.jump[0] = 1.0;
  problem.kernel = make_kernel(snaps, renewal, damping);
  return problem;
}

/// Virgin curve that has no closed form, because bristles redraw their lengths or are renewed: data that do
/// not depend on the grid on which it is solved.
struct SolvedCurve {
  const SnapLength& law;
  SnapRule rule;
  double renewal;
  UnitLaw unit;
  std::vector<Atom> atoms;
  double growth = 0.0;  ///< SteadySliding::growth
  double kinetic;       ///< mean deflection of steady sliding

  SolvedCurve(const SnapLength& snap_length, SnapRule snap_rule, double shared_renewal)
      : law(snap_length),
        rule(snap_rule),
        renewal(shared_renewal),
        unit(snap_length),
        atoms(find_atoms(snap_length)),
        kinetic(paper_kinetic(snap_length, snap_rule)) {
    if (!renews()) return;
    const SteadySliding steady = find_steady_sliding(law, rule, renewal);
    growth = steady.growth;
    kinetic = steady.deflection;
  }

  bool renews() const noexcept { return renewal != 0.0; }

  /// Solves the curve on a grid of an even number of cells. Returns an empty grid if so many bristles snap
  /// within a cell that the curve has its kinetic value at once.
  VirginGrid solve_extrapolated(double step, int cells) const {
    const std::vector<double> damping = damping_at_nodes(step, cells);
    const std::vector<double> coarse_damping = damping_at_nodes(2.0 * step, cells / 2);
    if (rule == SnapRule::redraw) {
      const LawOnGrid nodes = put_on_grid(unit, atoms, step, cells);
      return extrapolated(pose_redraw(every_other_node(nodes, atoms), renewal, coarse_damping),
                          pose_redraw(nodes, renewal, damping), step);
    }
    const double end = std::min(step * (cells + 1), law.longest() / unit.mean + step);
    const DividedLaw divided(unit, std::max(std::min(0.25 * step, 1.0 / 1024), end / 16384), end);
    return extrapolated(pose_keep(divided, renewal, 2.0 * step, coarse_damping),
                        pose_keep(divided, renewal, step, damping), step);
  }

  /// Returns the grid step for this law. With shared renewal and without atoms it is twice as large, because
  /// extrapolation is more exact for smooth solutions.
  double usual_step() const { return (renews() && atoms.empty() ? 2.0 : 1.0) * resolving_step(law); }
  /// Returns a grid step with which the atoms or, under shared renewal, the shortest length of a uniform law
  /// lie on nodes.
  double fit_step(double largest) const {
    if (!atoms.empty()) return step_for_atoms(atoms, largest);
    if (!renews() || law.law() != SnapLaw::uniform) return largest;
    const double shortest = 0.5 * law.first_parameter() / unit.mean;
    return shortest > largest ? shortest / (whole_part(shortest / largest) + 1.0) : largest;
  }
  /// Whether the force has its steady value, to the last digit, after the path x. Before, it swings about
  /// this value while bristles that began to slide together still snap in step. Without renewal and under a
  /// law without atoms or heavy tail, the swings decay as exp(-2 pi^2 cv^2 x): beyond the path tested here
  /// they are below 3e-9.
  bool is_steady(double x) const {
    if (!(x > 40.0 + 1.0 / square(law.cv()) + (renews() ? 40.0 / growth : 0.0))) return false;
    if (renews())
      return law.law() != SnapLaw::table || rule == SnapRule::keep || x * find_slow_wave(law).decay > 40.0;
    return law.law() == SnapLaw::uniform || law.law() == SnapLaw::normal ||
           (law.law() == SnapLaw::lognormal && law.cv() <= 0.5);
  }

 private:
  /// Returns exp(-growth x) at the nodes; empty without shared renewal.
  std::vector<double> damping_at_nodes(double step, int cells) const {
    std::vector<double> damping(renews() ? static_cast<std::size_t>(cells) + 1 : 0);
    for (std::size_t i = 0; i < damping.size(); ++i)
      damping[i] = exp(-growth * step * static_cast<double>(i));
    return damping;
  }
  VirginGrid extrapolated(const VolterraProblem& coarse, const VolterraProblem& fine, double step) const {
    if (renews() && (coarse.kernel.too_coarse() || fine.kernel.too_coarse())) return {};
    VirginGrid grid = solve(fine, step);
    extrapolate_grids(solve(coarse, 2.0 * step), grid);
    return grid;
  }
  VirginGrid solve(const VolterraProblem& problem, double step) const {
    VirginGrid grid = solve_volterra(problem.kernel, problem.deflections, step);
    if (!renews()) return grid;
    const VirginGrid bristles = solve_volterra(problem.kernel, problem.bristles, step);
    for (std::size_t i = 1; i < grid.left.size(); ++i) {
      grid.left[i] /= bristles.left[i];
      grid.right[i] /= bristles.right[i];
    }
    return grid;
  }
};

/// Estimates the top of a kink in the cell after node i: where the lines through the two nodes on either side
/// cross; 0 if they do not cross within the cell.
double kink_in_cell(const VirginGrid& grid, std::size_t i) {
  if (i < 1 || i + 2 >= grid.left.size()) return 0.0;
  for (std::size_t k = i - 1; k <= i + 2; ++k)
    if (grid.left[k] != grid.right[k]) return 0.0;
  const double* f = grid.left.data() + i;
  const double rise = f[0] - f[-1], fall = f[1] - f[2];
  // Position of the crossing of the two lines, in cells from node i.
  const double position = (f[1] - f[0] + fall) / (rise + fall);
  return rise > 0.0 && fall > 0.0 && position > 0.0 && position < 1.0 ? f[0] + position * rise : 0.0;
}

double table_peak(const VirginGrid& grid) {
  double peak = grid_peak(grid, false);
  for (std::size_t i = 0; i < grid.left.size(); ++i)
    if (grid.left[i] > 0.99 * peak) peak = std::max(peak, kink_in_cell(grid, i));
  return peak;
}

/// Returns the highest value of the curve up to the path `end`, solved with at most `most_cells` cells.
double peak_up_to(const SolvedCurve& curve, double end, int most_cells) {
  const double step = curve.fit_step(std::max(curve.usual_step(), end / most_cells));
  const VirginGrid grid = curve.solve_extrapolated(step, 2 * (static_cast<int>(end / (2.0 * step)) + 2));
  const SnapLaw law = curve.law.law();
  if (law == SnapLaw::table) return curve.renews() ? table_peak(grid) : grid_peak(grid, false);
  return grid_peak(grid, !curve.renews() || law == SnapLaw::lognormal || law == SnapLaw::normal);
}

double solved_peak(const SolvedCurve& curve) {
  constexpr int most_cells = 8192;
  const SnapLength& law = curve.law;
  // Searches the first two mean lengths. There all laws except tables have their only or highest hump.
  double peak = std::max(curve.kinetic, peak_up_to(curve, 2.0, most_cells));
  const double longest = law.longest() / law.mean();
  if (law.law() == SnapLaw::table && longest > 1.5)
    peak = std::max(peak, peak_up_to(curve, 1.5 * longest, most_cells));
  // Searches a longer path on a coarser grid as well, because a wide law with SnapRule::keep has a distant,
  // flat peak.
  if (law.law() == SnapLaw::lognormal && curve.rule == SnapRule::keep && law.cv() > 0.6)
    peak = std::max(peak, peak_up_to(curve, law.cv() < 1.1 ? 8.0 : 20.0, 512));
  return peak;
}

double solved_deflection(const SolvedCurve& curve, double x) {
  if (curve.is_steady(x)) return curve.kinetic;
  // Largest number of operations: cells up to the path x times cells up to the longest length of the law.
  // Beyond x of about 100 the grid step grows to limit the time (about a second), at the cost of accuracy for
  // wide lognormal laws and tables.
  constexpr double most_work = 2e9;
  const SnapLength& law = curve.law;
  const double reach = curve.rule == SnapRule::keep ? x : std::min(law.longest() / law.mean(), x);
  double step = std::max(curve.usual_step(), square_root(x * reach / most_work));
  const bool has_corners = !curve.atoms.empty() ||
                           (curve.renews() && (law.law() == SnapLaw::uniform || law.law() == SnapLaw::table));
  step = has_corners ? curve.fit_step(step) : x / (2.0 * (static_cast<int>(x / (2.0 * step)) + 1));
  const VirginGrid grid = curve.solve_extrapolated(step, 2 * (static_cast<int>(x / (2.0 * step)) + 2));
  if (grid.left.empty()) return curve.kinetic;
  const std::size_t i = static_cast<std::size_t>(x / step);
  const double share = x / step - static_cast<double>(i);
  return grid.right[i] * (1.0 - share) + grid.left[i + 1] * share;
}

}  // namespace

double kinetic_deflection(const SnapLength& law, SnapRule rule, double shared_renewal) {
  if (shared_renewal == 0.0) return paper_kinetic(law, rule);
  return find_steady_sliding(law, rule, shared_renewal).deflection;
}

double peak_deflection(const SnapLength& law, SnapRule rule, double shared_renewal) {
  if (law.law() == SnapLaw::single) return 1.0;
  const bool renews = shared_renewal != 0.0;
  if (!renews && law.law() == SnapLaw::exponential && rule == SnapRule::redraw)
    return 1.0;  // 1 - exp(-x) has no peak
  // Takes the peak of a narrow law from the part of the path where no bristle has snapped twice.
  const bool narrow = law.cv() < 0.25 && !(renews && law.law() == SnapLaw::table);
  double first = 0.0;
  if (narrow || law.law() == SnapLaw::uniform) {
    const UnitLaw unit(law);
    double position;
    find_first_pass_peak(unit, shared_renewal, first, position);
    if (!(unit.partial_moment(0, 0.5 * position) < 1e-10)) first = 0.0;
  }
  if (!renews && first > 0.0) return first;
  // Returns at least the kinetic value, which a curve without a hump approaches from below.
  if (!renews && rule == SnapRule::keep) return std::max(keep_peak(law), paper_kinetic(law, rule));
  const SolvedCurve curve(law, rule, shared_renewal);
  if (narrow && first >= curve.kinetic) return first;
  return std::max(first, solved_peak(curve));
}

double virgin_curve(const SnapLength& law, SnapRule rule, double shared_renewal, double x) {
  if (law.law() == SnapLaw::single) return uniform_remainder(1.0, 1.0, x, false);
  if (shared_renewal == 0.0 && rule == SnapRule::keep) return keep_deflection(law, x, false);
  if (shared_renewal == 0.0 && law.law() == SnapLaw::exponential)
    // Returns the mean of min(r, x). The path r since the last snap is exponentially distributed, because
    // this law has no memory.
    return -expm1(-x);
  return solved_deflection(SolvedCurve(law, rule, shared_renewal), x);
}

double slide_curve(const SnapLength& law, double drop, double growth, double x) {
  const double length = x * law.mean() / growth;
  return x * law.survival(length) + (1.0 - drop) * law.partial_moment(1, length) / law.mean();
}

SlidePeak slide_peak(const SnapLength& law, double drop, double growth) {
  const double mean = law.mean();
  SlidePeak best{1.0 - drop, 0.0};  // value after a long path, when all bristles slide
  const auto try_at = [&](double length) {
    const double force = slide_curve(law, drop, growth, growth * length / mean);
    if (force > best.force) best = {force, length / mean * law.survival(length)};
    return force;
  };
  // Tries a path just below each length as well, because the force drops at the length itself if many
  // bristles have it.
  constexpr double before = 1.0 - 1e-12;
  constexpr int points = 256;
  const auto length_at = [&law](int k) {
    if (k >= points) return law.longest();
    return law.quantile(crowded_share((k + 0.5) / points));
  };
  int highest = 0;
  double most = 0.0;
  for (int k = 0; k <= points; ++k) {
    const double force = std::max(try_at(length_at(k) * before), try_at(length_at(k)));
    if (force <= most) continue;
    most = force;
    highest = k;
  }
  const double low = highest > 0 ? length_at(highest - 1) : 0.0;
  find_maximum(try_at, low, length_at(std::min(highest + 1, points)), kink_iterations);
  return best;
}

}  // namespace bristle::detail
