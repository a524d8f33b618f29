// A straight step so long that it forgets how it began: the state at its end is known, and no piece of the
// path is taken. Renewal theory says what it did on the way.
#include <algorithm>
#include <cmath>

#include "core/materials/elementary.hpp"
#include "core/patches/cohorts/cohorts.hpp"

namespace bristle::detail {
namespace {

constexpr double gauss = 0.57735026918962576;  // abscissa of two points on [-1, 1]

struct Survival {
  double left, moment, square;  ///< S(x), E[delta; delta < x], E[delta^2; delta < x]
};
Survival survival_at(const SurvivalTable& table, double x) noexcept {
  if (x <= table.sure) return {1.0, 0.0, 0.0};
  x = std::min(x, table.end);
  const std::size_t k = (bits_of(x + survival_offset) >> survival_shift) - survival_first;
  const SurvivalCell& cell = table.cells[k];
  const double left = cell.survival + cell.slope * (x - cell.start);
  const double snapped = cell.survival - left;
  return {left, cell.moment + snapped * 0.5 * (cell.start + x),
          table.squares[k] + snapped * (cell.start * cell.start + cell.start * x + x * x) / 3.0};
}

/// How much longer a piece is for each length of distance, so that so many cohorts are enough: pieces of a
/// wide law grow with the age of what was born in them.
double find_growth(double piece, double farthest, double room) noexcept {
  double growth = 0.0;
  if (farthest / piece <= room) return growth;
  for (growth = 0.02; growth < 1.0; growth *= 1.2) {
    const double even = 1.0 / growth;  // pieces before they grow
    if (even + log(std::max(farthest * growth / piece, 1.0)) / growth <= room) break;
  }
  return growth;
}

struct Node {
  double age;    ///< path since birth
  double share;  ///< of the bristles, not yet over their sum
  Survival at;
};

/// The bristles between two ages, at their mean age: exact where the law has corners.
Node find_band(const SurvivalTable& table, double begin, double end) noexcept {
  const Survival a = survival_at(table, begin);
  const Survival b = survival_at(table, end);
  const double share = end * b.left - begin * a.left + (b.moment - a.moment);
  const double first = 0.5 * (end * end * b.left - begin * begin * a.left + (b.square - a.square));
  const double age = std::clamp(first / share, begin, end);
  return {age, share, survival_at(table, age)};
}

/// Cohorts of steady sliding: two for a pair of pieces, at the abscissae of Gauss; one for each where the law
/// has corners. Returns how many.
std::uint32_t find_nodes(const Cohorts& r, const SurvivalTable& table, Node* nodes) noexcept {
  const double room = 0.75 * r.capacity;
  const double growth = find_growth(r.law.piece, std::min(table.end, r.law.forget), room - 2.0);
  std::uint32_t count = 0;
  double begin = 0.0;
  const auto add = [&](const Node& node) {
    if (!(node.at.left > 0.0) || !(node.share > r.law.negligible * table.mean)) return false;
    nodes[count++] = node;
    return true;
  };
  const auto at_age = [&](double age, double piece) {
    const Survival at = survival_at(table, age);
    return Node{age, piece * at.left, at};
  };
  for (bool more = true; more && count + 2 <= r.capacity && begin < table.end;) {
    const double piece = std::max(r.law.piece, growth * begin);
    if (table.smooth) {
      more = add(at_age(begin + piece * (1.0 - gauss), piece)) &&
             add(at_age(begin + piece * (1.0 + gauss), piece));
      begin += 2.0 * piece;
    } else {
      more = add(find_band(table, begin, std::min(begin + piece, table.end)));
      begin += piece;
    }
  }
  return count;
}

/// What one cohort does until its bristles have snapped once, and from then on: sums over the path.
struct Passage {
  double path;         ///< mean path to the first snap
  double half_square;  ///< half the mean of its square
};
Passage find_passage(const SurvivalTable& table, double residual, double reach, double along,
                     double across2) noexcept {
  const Survival at = survival_at(table, reach);
  const double mean = (table.mean - at.moment) / at.left;
  const double variance = std::max((table.square - at.square) / at.left - mean * mean, 0.0);
  const double length = mean + residual;
  const double least = 0.25 * length * length;
  const double square = std::max(length * length - across2, least);
  const double root = std::sqrt(square) - 0.5 * variance * across2 / (square * std::sqrt(square));
  const double path = std::max(root - along, 0.0);
  const double squares = length * length + variance - across2 - 2.0 * along * root + along * along;
  return {path, 0.5 * std::max(squares, path * path)};
}

/// Path integral, energy and snaps of the way: the first snap of each cohort, then a renewal process.
void add_passages(const Cohorts& r, const SurvivalTable& table, const CohortState& s, const double* rows,
                  const CohortMove& a, CohortTotals& t) noexcept {
  const double mean = table.mean;
  const double force = 0.5 * table.square / mean;
  const double transient = force * force - table.cube / (3.0 * mean);  // of the path integral of the age
  for (std::uint32_t i = 0; i < s.count; ++i) {
    const double mass = mass_of(rows, i);
    const double zx = a.from[0] - entry(rows, i, cohort_x);
    const double zy = a.from[1] - entry(rows, i, cohort_y);
    const double along = zx * a.direction[0] + zy * a.direction[1];
    const double across2 = std::max(zx * zx + zy * zy - along * along, 0.0);
    const Passage first = find_passage(table, r.law.residual, entry(rows, i, cohort_reach), along, across2);
    const double after = a.length - first.path;
    const double renewed = after * (r.law.residual + force) + transient;
    t.integral[0] += mass * (zx * first.path + a.direction[0] * (first.half_square + renewed));
    t.integral[1] += mass * (zy * first.path + a.direction[1] * (first.half_square + renewed));
    t.snapped += mass * (after / mean + force / mean);
  }
}

double squares_at(const CohortState& s, const double* rows, const double (&at)[2]) noexcept {
  double sum = s.spread;
  for (std::uint32_t i = 0; i < s.count; ++i) {
    const double zx = at[0] - entry(rows, i, cohort_x);
    const double zy = at[1] - entry(rows, i, cohort_y);
    sum += mass_of(rows, i) * (zx * zx + zy * zy);
  }
  return sum;
}

/// Whole masses; what rounding leaves over is born last.
void write_nodes(const Cohorts& r, const Node* nodes, std::uint32_t count, const CohortMove& a,
                 CohortState& s, double* rows) noexcept {
  double all = 0.0;
  for (std::uint32_t k = 0; k < count; ++k) all += nodes[k].share;
  const std::uint32_t before = s.count;
  double missing = s.mass;
  std::uint32_t i = 0;
  // The last born first: it takes what is missing in the end.
  for (std::uint32_t k = 0; k < count; ++k) {
    const double mass = std::floor(s.mass * (nodes[k].share / all));
    if (mass == 0.0) continue;
    missing -= mass;
    for (int axis = 0; axis < 2; ++axis)
      entry(rows, i, axis == 0 ? cohort_x : cohort_y) =
          a.to[axis] - (nodes[k].age + r.law.residual) * a.direction[axis];
    entry(rows, i, cohort_reach) = std::max(nodes[k].age + reach_margin, r.law.sure);
    entry(rows, i, cohort_left) = nodes[k].at.left;
    entry(rows, i, cohort_moment) = nodes[k].at.moment;
    entry(rows, i, cohort_fresh) = fresh_mass(mass, nodes[k].at.left);
    entry(rows, i, cohort_low) = 0.0;
    entry(rows, i, cohort_high) = s.mass;
    ++i;
  }
  entry(rows, 0, cohort_fresh) = fresh_mass(mass_of(rows, 0) + missing, entry(rows, 0, cohort_left));
  s.count = i;
  for (; i < before; ++i) clear_lane(rows, i);
}

}  // namespace

bool is_forgetful(const Cohorts& r, const CohortMove& move) noexcept {
  return move.length >= r.law.forget && r.law.renewal == 0.0;
}

void slide_far(const Cohorts& r, CohortState& s, double* rows, const CohortMove& a,
               CohortTotals& t) noexcept {
  const SurvivalTable& table = r.material->survival();
  Node nodes[most_cohorts];
  const std::uint32_t count = find_nodes(r, table, nodes);
  double stored = 0.0;
  if (a.books) {
    add_passages(r, table, s, rows, a, t);
    stored = squares_at(s, rows, a.from);
  }
  write_nodes(r, nodes, count, a, s, rows);
  // Ranks are mixed through and through.
  s.layered = 0;
  s.spread = 0.0;
  for (std::uint32_t& open : s.open) open = no_cohort;
  find_moment(s, rows);
  s.slack = -1.0;
  ++t.pieces;
  if (a.books)
    t.lost += 2.0 * (t.integral[0] * a.direction[0] + t.integral[1] * a.direction[1]) +
              (stored - squares_at(s, rows, a.to));
}

}  // namespace bristle::detail
