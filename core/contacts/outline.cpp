#include "bristle/outline.hpp"

#include <cmath>
#include <cstddef>

#include "core/common/range_check.hpp"
#include "core/contacts/gauss.hpp"
#include "core/materials/turn.hpp"

namespace bristle {

namespace {

using detail::legendre_nodes;
using detail::Node;
using detail::Nodes;
using detail::pi;
using detail::Turn;

/// Returns the Gauss rule for the pressure of a cylinder, (1 - x^2)^1/2 on -1 to 1: Chebyshev polynomials of
/// the second kind.
Nodes cylinder_nodes(int n) {
  Nodes nodes;
  for (int k = 1; k <= n; ++k) {
    const Turn t = detail::turn_by(pi * k / (n + 1));
    nodes.push_back({t.cosine, 2.0 * t.sine * t.sine / (n + 1)});
  }
  return nodes;
}

/// Returns points and weights that integrate over r, the distance from the centre of a disc of radius 1,
/// weighted by the load at r. Rings of cells are set by them.
Nodes radial_density(Pressure pressure) {
  Nodes density = legendre_nodes(96);
  double sum = 0.0;
  for (Node& node : density) {
    const double s = 0.5 * (1.0 + node.at);
    if (pressure == Pressure::uniform) {
      node = {s, node.weight * s};
    } else {  // Hertz's load r (1 - r^2)^1/2 dr, which is smooth in s where r = 1 - s^2
      const double r = 1.0 - s * s;
      node = {r, node.weight * r * s * s * std::sqrt(2.0 - s * s)};
    }
    sum += node.weight;
  }
  for (Node& node : density) node.weight /= sum;
  return density;
}

/// Coefficients of the three-term recurrence of the polynomials that are orthogonal under a density
/// (Stieltjes). The zeros of these polynomials are the Gauss points for that density.
struct Recurrence {
  /// Coefficients of p[k + 1] = (x - a[k]) p[k] - b[k] p[k - 1] for the polynomial p[k] of degree k; b[0] is
  /// 0.
  std::vector<double> a, b;

  Recurrence(const Nodes& density, int n) {
    std::vector<double> before(density.size(), 0.0), now(density.size(), 1.0);
    double norm_before = 1.0;
    for (int k = 0; k < n; ++k) {
      double norm = 0.0, first = 0.0;
      for (std::size_t i = 0; i < density.size(); ++i) {
        const double share = density[i].weight * now[i] * now[i];
        norm += share;
        first += share * density[i].at;
      }
      a.push_back(first / norm);
      b.push_back(k == 0 ? 0.0 : norm / norm_before);
      norm_before = norm;
      for (std::size_t i = 0; i < density.size(); ++i) {
        const double next = (density[i].at - a.back()) * now[i] - b.back() * before[i];
        before[i] = now[i];
        now[i] = next;
      }
    }
  }

  /// Counts the zeros below x of the polynomial of the highest degree, by Sturm's sequence, so that bisection
  /// finds every zero.
  int zeros_below(double x) const {
    int count = 0;
    double ratio = 1.0;
    for (std::size_t k = 0; k < a.size(); ++k) {
      ratio = a[k] - x - (k == 0 ? 0.0 : b[k] / ratio);
      if (ratio == 0.0) ratio = 1e-300;
      count += ratio < 0.0;
    }
    return count;
  }
  double zero(int which) const {
    double low = 0.0, high = 1.0;
    for (int pass = 0; pass < 60; ++pass) {
      const double middle = 0.5 * (low + high);
      (zeros_below(middle) > which ? high : low) = middle;
    }
    return 0.5 * (low + high);
  }
  /// Returns the weight that the Gauss rule gives to its point x (Christoffel's number).
  double weight(double x) const {
    double before = 0.0, now = 1.0, norm = 1.0, sum = 1.0;
    for (std::size_t k = 0; k + 1 < a.size(); ++k) {
      const double next = (x - a[k]) * now - b[k] * before;
      before = now;
      now = next;
      norm *= b[k + 1];
      sum += now * now / norm;
    }
    return 1.0 / sum;
  }
};

Nodes radial_nodes(Pressure pressure, int rings) {
  const Recurrence recurrence(radial_density(pressure), rings);
  Nodes nodes;
  for (int i = 0; i < rings; ++i) {
    const double r = recurrence.zero(i);
    nodes.push_back({r, recurrence.weight(r)});
  }
  return nodes;
}

void require_half(const char* where, const char* name, double value) {
  detail::require_within(where, name, value, 0.0, 1e3, "m");
}

}  // namespace

Outline Outline::ellipse(double half_x_m, double half_y_m, Pressure pressure, int rings, int around) {
  require_half("Outline::ellipse", "half_x_m", half_x_m);
  require_half("Outline::ellipse", "half_y_m", half_y_m);
  detail::require_within("Outline::ellipse", "rings", rings, 1, 64);
  if (around == 0) around = rings == 1 ? 4 : 3 * rings;
  detail::require_within("Outline::ellipse", "around", around, 3, 256);
  Outline outline;
  if (half_x_m == 0.0 && half_y_m == 0.0) return outline;
  outline.cells.clear();
  int ring = 0;
  for (const Node& r : radial_nodes(pressure, rings)) {
    for (int k = 0; k < around; ++k) {
      // Turns each ring of cells by half the angle between two cells against the previous ring, which spreads
      // the cells more evenly over the disc.
      const Turn turn = detail::turn_by(pi * (2 * k + ring % 2) / around);
      outline.cells.push_back(
          {{half_x_m * r.at * turn.cosine, half_y_m * r.at * turn.sine}, r.weight / around});
    }
    ++ring;
  }
  return outline;
}

Outline Outline::rectangle(double half_x_m, double half_y_m, Pressure pressure, int nx, int ny) {
  require_half("Outline::rectangle", "half_x_m", half_x_m);
  require_half("Outline::rectangle", "half_y_m", half_y_m);
  detail::require_within("Outline::rectangle", "nx", nx, 1, 64);
  detail::require_within("Outline::rectangle", "ny", ny, 1, 64);
  Outline outline;
  if (half_x_m == 0.0 && half_y_m == 0.0) return outline;
  outline.cells.clear();
  const Nodes across = pressure == Pressure::hertz ? cylinder_nodes(nx) : legendre_nodes(nx);
  for (const Node& y : legendre_nodes(ny))
    for (const Node& x : across)
      outline.cells.push_back({{half_x_m * x.at, half_y_m * y.at}, x.weight * y.weight});
  return outline;
}

}  // namespace bristle
