#include "core/materials/slow_wave.hpp"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

#include "core/materials/elementary.hpp"
#include "core/materials/law_at.hpp"
#include "core/materials/turn.hpp"

namespace bristle::detail {
namespace {

// A complex number. std::complex is not used, because it multiplies and divides by functions of the
// compiler's library, whose bits differ between compilers.
struct Complex {
  double re = 0.0, im = 0.0;
};
Complex operator+(Complex a, Complex b) { return {a.re + b.re, a.im + b.im}; }
Complex operator-(Complex a, Complex b) { return {a.re - b.re, a.im - b.im}; }
Complex operator*(double a, Complex b) { return {a * b.re, a * b.im}; }
Complex operator*(Complex a, Complex b) { return {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re}; }
double squared(Complex a) { return a.re * a.re + a.im * a.im; }
Complex operator/(Complex a, Complex b) { return (1.0 / squared(b)) * (a * Complex{b.re, -b.im}); }

/// Cell of the tabulated survival function S of a law (S(x) is the share of lengths above x), on which S is
/// linear; lengths in mean snap lengths.
struct SurvivalCell {
  double survival;  ///< value of S at `start`
  double slope;     ///< slope of S in the cell, never above 0
  double start;     ///< snap length at the beginning of the cell
};

/// Returns the k-th node of the table. Cells widen: a cell at the length x is some (x + 1/16) / 128 wide.
double node(std::size_t k) {
  constexpr std::size_t per_octave = 128;
  const double in_octave = static_cast<double>(k % per_octave) / per_octave;
  return (1.0 + in_octave) * static_cast<double>(std::size_t{1} << k / per_octave) / 16.0 - 1.0 / 16.0;
}

/// Returns S at the nodes of the table. The last entry is 0, at the first node beyond the longest length.
std::vector<double> survival_at_nodes(const SnapLength& law, double longest) {
  std::vector<double> lengths;
  while (node(lengths.size() + 1) < longest) lengths.push_back(node(lengths.size() + 1) * law.mean());
  std::vector<LawAt> at(lengths.size());
  read_law(law, {lengths.data(), lengths.size()}, {at.data(), at.size()});
  std::vector<double> survival{1.0};
  for (const LawAt& a : at) survival.push_back(a.survival);
  survival.push_back(0.0);
  return survival;
}

/// Returns local means of S for a law given as a table: S at each node averaged over the hat function that
/// falls to 0 at both neighbours. The tabulated law then has the mean of the law, and E[delta^2] within a
/// sixth of a cell's square. An atom (one length with a probability) spreads over two cells; S taken at the
/// nodes would put it in the middle of one, up to half a cell away.
std::vector<double> mean_survival_at_nodes(const SnapLength& law, double longest) {
  const double metres = law.mean();
  // Returns E[(x - delta)^2; delta < x], whose second derivative by x is 2 (1 - S).
  const auto squares = [&](double x) {
    const auto moment = [&](int k) { return law.partial_moment(k, x * metres); };
    return x * x * moment(0) - 2.0 * x * (moment(1) / metres) + moment(2) / metres / metres;
  };
  std::vector<double> survival{1.0};
  double here = squares(node(1)), slope = here / node(1);
  for (std::size_t k = 1; node(k - 1) < longest; ++k) {
    const double next = squares(node(k + 1));
    const double next_slope = (next - here) / (node(k + 1) - node(k));
    survival.push_back(1.0 - (next_slope - slope) / (node(k + 1) - node(k - 1)));
    here = next;
    slope = next_slope;
  }
  survival.push_back(0.0);
  return survival;
}

/// Tabulates S. The last cell is the end of the table.
std::vector<SurvivalCell> make_cells(const SnapLength& law) {
  const bool tabulated = law.law() == SnapLaw::table;
  double longest = law.longest() / law.mean();
  // Begins a cell at the shortest and at the longest of uniform lengths, where S has corners that a line
  // would cut.
  const double shortest = law.law() == SnapLaw::uniform ? law.first_parameter() / law.mean() : 0.0;
  const std::vector<double> at_node =
      tabulated ? mean_survival_at_nodes(law, longest) : survival_at_nodes(law, longest);
  if (tabulated) longest = node(at_node.size() - 1);
  std::vector<SurvivalCell> cells;
  double survival = 1.0;
  for (std::size_t k = 0; survival > 0.0; ++k) {
    const double start = shortest > node(k) && shortest < node(k + 1) ? shortest : node(k);
    const double after = std::min(at_node[k + 1], survival);
    const double end = std::min(node(k + 1), longest);
    cells.push_back({survival, (after - survival) / (end - start), start});
    survival = after;
    if (survival == 0.0) cells.push_back({0.0, 0.0, end});
  }
  return cells;
}

/// Values by which roots of p(s) = 1 are found: 1 - p(s) and its derivative, with p(s) the Laplace transform
/// of the density p(x) of snap lengths. The derivative is the integral of x p(x) exp(-s x).
struct Transform {
  Complex missing, slope;
};

/// Computes the Transform at s. The density is constant in a cell, so each integral is a difference of values
/// at the ends of the cell. `at(k)`: exp(-s x) at the start x of cell k.
template <class At>
Transform transform(const std::vector<SurvivalCell>& cells, Complex s, At&& at) {
  const Complex over = Complex{1.0, 0.0} / s;
  Complex share, first;
  Complex value = at(std::size_t{0});
  Complex moment = over * value;  // (x + 1/s) exp(-s x), x the start of the cell
  for (std::size_t k = 0; k + 1 < cells.size(); ++k) {
    const double density = -cells[k].slope;
    const Complex next = at(k + 1);
    const Complex next_moment = (Complex{cells[k + 1].start, 0.0} + over) * next;
    share = share + density * (value - next);
    first = first + density * (moment - next_moment);
    value = next;
    moment = next_moment;
  }
  return {Complex{1.0, 0.0} - over * share, over * first};
}

Transform transform_at(const std::vector<SurvivalCell>& cells, Complex s) {
  return transform(cells, s, [&](std::size_t k) -> Complex {
    const double x = cells[k].start;
    const Turn turn = turn_by(-s.im * x);
    const double size = exp(-s.re * x);
    return {size * turn.cosine, size * turn.sine};
  });
}

struct Candidate {
  double decay;
  Complex s;
};

/// Lists candidates for the roots s of p(s) = 1 with negative real part, the most slowly decaying wave first.
/// p(s) = E[exp(-s delta)] for the random snap length delta. A candidate is the result of one Newton step
/// from a frequency at which p comes near to 1.
std::vector<Candidate> find_candidates(const std::vector<SurvivalCell>& cells) {
  constexpr int most_steps = 8192;
  const double step = std::min(0.05, 0.3 / cells.back().start), first = 2.0;
  std::vector<Turn> at(cells.size()), by(cells.size());
  for (std::size_t k = 0; k < cells.size(); ++k) {
    at[k] = turn_by(-first * cells[k].start);
    by[k] = turn_by(-step * cells[k].start);
  }
  std::vector<Candidate> candidates;
  Transform last[2];
  for (int i = 0; i < most_steps && first + step * i < 150.0; ++i) {
    const double frequency = first + step * i;
    const Transform now = transform(cells, {0.0, frequency}, [&](std::size_t k) -> Complex {
      return {at[k].cosine, at[k].sine};
    });
    for (std::size_t k = 0; k < cells.size(); ++k) at[k] = at[k] * by[k];
    const double middle = squared(last[1].missing);
    if (i >= 2 && middle < 1.0 && middle <= squared(last[0].missing) && middle < squared(now.missing)) {
      const Complex s = Complex{0.0, frequency - step} - last[1].missing / last[1].slope;
      if (s.re < 0.0) candidates.push_back({-s.re, s});
    }
    last[0] = last[1];
    last[1] = now;
  }
  std::sort(candidates.begin(), candidates.end(),
            [](const Candidate& a, const Candidate& b) { return a.decay < b.decay; });
  return candidates;
}

}  // namespace

SlowWave find_slow_wave(const SnapLength& law) {
  const std::vector<SurvivalCell> cells = make_cells(law);
  SlowWave slowest{std::numeric_limits<double>::infinity(), 0.0};
  std::vector<Candidate> candidates = find_candidates(cells);
  if (candidates.size() > 4) candidates.resize(4);
  for (const Candidate& candidate : candidates) {
    Complex s = candidate.s;
    for (int i = 0; i < 12; ++i) {
      const Transform f = transform_at(cells, s);
      const Complex change = f.missing / f.slope;
      s = s - change;
      if (!(squared(change) > 1e-20 * squared(s))) break;
    }
    // Rejects roots that are no decaying waves, such as s = 0 (steady sliding), at which Newton's method may
    // end.
    if (s.re < 0.0 && magnitude(s.im) > 1.0 && -s.re < slowest.decay) slowest = {-s.re, magnitude(s.im)};
  }
  return slowest;
}

double find_finest_piece(const SnapLength& law) {
  constexpr double per_square = 19.739208802178716;  // 2 pi^2
  constexpr double full_turn = 6.283185307179586;
  double finest = std::min(1.0, law.cv() / 0.25);
  if (law.law() != SnapLaw::table && law.law() != SnapLaw::uniform) return finest;
  // Shortens the longest piece for a table of lengths under which waves of the force decay slowly: the more
  // slowly, the shorter. (The square root is the spread of a lognormal law whose waves decay as slowly.) A
  // piece must also resolve one wave.
  const SlowWave slow = law.law() == SnapLaw::table ? find_slow_wave(law) : SlowWave{0.0, 0.0};
  if (slow.frequency > 0.0) {
    finest = std::min(finest, square_root(slow.decay / per_square) / 0.34);
    finest = std::min(finest, 0.6 * full_turn / slow.frequency);
  }
  // Keeps default pieces shorter than half the length that a tenth of the bristles do not exceed. Otherwise
  // many short bristles would snap within one piece.
  finest = std::min(finest, 3.75 * law.quantile(0.1) / law.mean());
  return std::max(finest, 1.0 / 16);
}

}  // namespace bristle::detail
