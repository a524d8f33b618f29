#include "tools/libraries/rivals/elasto_plastic.hpp"

#include <algorithm>

#include "tools/libraries/rivals/relaxation.hpp"

namespace rivals {
namespace {

constexpr double pi = 3.14159265358979323846;
// Largest number of pieces into which a step is cut, which bounds its cost. They cover a path of fifty steady
// deflections, after which sliding is steady.
constexpr int most_pieces = 800;

struct Band {
  double elastic, steady;  // deflections at break-away (zba) and in steady sliding (zss), m

  double plasticity(double size) const noexcept {
    if (size <= elastic) return 0.0;
    if (size >= steady) return 1.0;
    return 0.5 + 0.5 * std::sin(pi * (size - 0.5 * (steady + elastic)) / (steady - elastic));
  }
  // Returns the length of the next piece of path: a distance over which alpha |z| / zss hardly changes. It is
  // longer where alpha nears 1, because z approaches zss slowly there.
  double piece(double size) const noexcept {
    const double left = (steady - size) / (steady - elastic);
    if (left > 0.5) return 0.0625 * (steady - elastic);
    const double steepness = std::max(std::sin(pi * left), (steady - elastic) / steady);
    return 0.0625 * (steady - elastic) / steepness;
  }
};

Pair shortened(Pair z, double longest) noexcept {
  const double size = length(z);
  return size > longest ? (longest / size) * z : z;
}

}  // namespace

Force ElastoPlastic::step(Pair displacement, double dt_s, double load_n) noexcept {
  if (!(load_n > 0.0)) {
    z = {};
    return {};
  }
  const Surface& s = surface;
  const Pair v = (1.0 / dt_s) * displacement;
  const double path = length(displacement);
  Pair mean = z;
  const Pair start = z;
  double alpha = 0.0;
  const double steady = s.stribeck_force(path / dt_s, load_n) / s.stiffness;
  const Band band{std::min(elastic_share * s.static_coefficient * load_n / s.stiffness, 0.99 * steady),
                  steady};
  if (path > 0.0) {
    const Pair e = (1.0 / path) * displacement;
    Pair sum;  // integral of the deflection z over the path of the step
    double rest = path;
    for (int pieces = 0; rest > 0.0; ++pieces) {
      const double back = -dot(z, e);
      const double size = length(z);
      double piece = rest;
      if (back > 1e-12 * steady) {
        piece = std::min(rest, back);  // because a bristle unloads elastically at any deflection
        sum = sum + piece * (z + 0.5 * piece * e);
        z = z + piece * e;
      } else if (size < band.elastic * (1.0 - 1e-12)) {
        piece = std::min(rest, std::max(path_to_limit(z, e, band.elastic), 1e-12 * band.elastic));
        sum = sum + piece * (z + 0.5 * piece * e);
        z = z + piece * e;
      } else {
        double a = band.plasticity(size);
        // Whether the deflection z points along the motion; otherwise z shrinks while it turns.
        const bool aligned = -back > (1.0 - 1e-9) * size;
        if ((a > 1.0 - 1e-9 && aligned) || pieces > most_pieces) {
          a = 1.0;
        } else {
          piece = std::min(rest, band.piece(size));
          // Takes alpha in the middle of the piece and holds it over the piece, which makes the error second
          // order.
          const Pair half = relax(z, (steady / std::max(a, 1e-12)) * e, 0.5 * piece * a / steady).end;
          a = band.plasticity(length(half));
        }
        if (a > 0.0) {
          const Relaxed r = relax(z, (steady / a) * e, piece * a / steady);
          sum = sum + piece * r.mean;
          z = size < steady ? shortened(r.end, steady) : r.end;
        } else {
          sum = sum + piece * (z + 0.5 * piece * e);
          z = z + piece * e;
        }
      }
      rest -= piece;
    }
    mean = (1.0 / path) * sum;
    if (dot(z, e) >= 0.0) alpha = band.plasticity(length(z));
  }
  const Pair mean_rate = (1.0 / dt_s) * (z - start);
  const Pair end_rate = v - (alpha * path / dt_s / steady) * z;
  return {s.bristle_force(z, end_rate, v), s.bristle_force(mean, mean_rate, v)};
}

}  // namespace rivals
