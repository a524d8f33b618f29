#include "core/materials/slow_wave.hpp"

#include <algorithm>
#include <cstddef>
#include <limits>

#include "core/materials/elementary.hpp"
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
std::vector<Candidate> find_candidates(const std::vector<SurvivalCell>& cells, double mean) {
  constexpr int most_steps = 8192;
  const double step = std::min(0.05 / mean, 0.3 / cells.back().start), first = 2.0 / mean;
  std::vector<Turn> at(cells.size()), by(cells.size());
  for (std::size_t k = 0; k < cells.size(); ++k) {
    at[k] = turn_by(-first * cells[k].start);
    by[k] = turn_by(-step * cells[k].start);
  }
  std::vector<Candidate> candidates;
  Transform last[2];
  for (int i = 0; i < most_steps && first + step * i < 150.0 / mean; ++i) {
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

SlowWave find_slow_wave(const std::vector<SurvivalCell>& cells, double mean) {
  SlowWave slowest{std::numeric_limits<double>::infinity(), 0.0};
  std::vector<Candidate> candidates = find_candidates(cells, mean);
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
    if (s.re < 0.0 && magnitude(s.im) * mean > 1.0 && -s.re < slowest.decay)
      slowest = {-s.re, magnitude(s.im)};
  }
  return slowest;
}

}  // namespace bristle::detail
