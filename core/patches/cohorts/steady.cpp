// Makes a straight step that is so long that its start is forgotten. It ends in steady sliding, and renewal
// theory gives the sums along its path, so no piece of the path need be computed.
#include <algorithm>
#include <cmath>

#include "core/materials/elementary.hpp"
#include "core/patches/cohorts/cohorts.hpp"

namespace bristle::detail {
namespace {

constexpr double gauss = 0.57735026918962576;  // places of the two Gauss points on [-1, 1]: -gauss and gauss

/// Finds by how much pieces of path must grow with their distance behind the patch, so that `room` cohorts
/// reach to the distance `farthest`. Under a wide law that is far, so distant pieces must be longer.
double find_growth(double piece, double farthest, double room) noexcept {
  double growth = 0.0;
  if (farthest / piece <= room) return growth;
  for (growth = 0.02; growth < 1.0; growth *= 1.2) {
    // Number of pieces next to the patch that have the first length; pieces behind them grow.
    const double even = 1.0 / growth;
    if (even + log(std::max(farthest * growth / piece, 1.0)) / growth <= room) break;
  }
  return growth;
}

struct Node {
  double age;    ///< path of the patch since these bristles were last straight, scaled
  double share;  ///< number of bristles in this cohort, relative to the sum over all cohorts
  double reach;  ///< reach R, the deflection over g, the growth of snap lengths by ageing
  Survival at;   ///< survival S of the law and its moments, at the snap length `reach`
};

/// Distribution of the bristles' deflections in steady sliding at the speed of a move.
struct SteadyLaw {
  const SurvivalTable& table;
  const Material& material;
  double per_length;  ///< time per scaled length of path, s; 0 where the material does not age
  double end;         ///< path after which every bristle that was straight at its start has snapped

  double reach_at(double path) const noexcept {
    return per_length > 0.0 ? path / material.ageing_factor(path * per_length) : path;
  }
};
SteadyLaw find_steady_law(const Cohorts& r, const CohortTimes& times) noexcept {
  SteadyLaw law{r.material->survival(), r.material->material, 0.0, 0.0};
  law.end = law.table.end;
  if (times.births == nullptr) return law;
  law.per_length = times.per_length;
  // Iterates from below to the solution, which no iterate passes, because the growth of snap lengths is
  // concave in time.
  for (double before = 0.0; law.end > before * (1.0 + 1e-9);) {
    before = law.end;
    law.end = law.table.end * law.material.ageing_factor(law.end * law.per_length);
  }
  return law;
}

/// Makes one cohort of the bristles that were last straight between the paths `begin` and `end` ago, at their
/// mean age. Exact even if the law has corners; growth by ageing is taken as linear in between.
Node find_band(const SteadyLaw& law, double begin, double end) noexcept {
  const double first_reach = law.reach_at(begin);
  const double last_reach = std::min(law.reach_at(end), law.table.end);
  const Survival a = survival_at(law.table, first_reach);
  const Survival b = survival_at(law.table, last_reach);
  const double share = last_reach * b.left - first_reach * a.left + (b.moment - a.moment);
  const double first =
      0.5 * (last_reach * last_reach * b.left - first_reach * first_reach * a.left + (b.square - a.square));
  const double reach = std::clamp(first / share, first_reach, last_reach);
  if (law.per_length == 0.0) return {reach, share, reach, survival_at(law.table, reach)};
  const double stretch = (end - begin) / (last_reach - first_reach);
  const double age = begin + stretch * (reach - first_reach);
  return {age, stretch * share, law.reach_at(age), survival_at(law.table, law.reach_at(age))};
}

/// Lists the cohorts of steady sliding: two for each pair of pieces, at Gauss points, or one for each piece
/// if the law's survival function has corners. Returns their number.
std::uint32_t find_nodes(const Cohorts& r, const SteadyLaw& law, Node* nodes) noexcept {
  const SurvivalTable& table = law.table;
  const double room = 0.75 * r.capacity;
  const double longest = std::min(table.end, r.law.forget) * (law.end / table.end);
  const double growth = find_growth(r.law.piece, longest, room - 2.0);
  std::uint32_t count = 0;
  double begin = 0.0;
  const auto add = [&](const Node& node) {
    if (!(node.at.left > 0.0) || !(node.share > r.law.negligible * table.mean)) return false;
    nodes[count++] = node;
    return true;
  };
  const auto at_age = [&](double age, double piece) {
    const double reach = law.reach_at(age);
    const Survival at = survival_at(table, reach);
    return Node{age, piece * at.left, reach, at};
  };
  for (bool more = true; more && count + 2 <= r.capacity && begin < law.end;) {
    const double piece = std::max(r.law.piece, growth * begin);
    if (table.smooth) {
      more = add(at_age(begin + piece * (1.0 - gauss), piece)) &&
             add(at_age(begin + piece * (1.0 + gauss), piece));
      begin += 2.0 * piece;
    } else {
      more = add(find_band(law, begin, std::min(begin + piece, law.end)));
      begin += piece;
    }
  }
  return count;
}

/// Path of the patch until a bristle of a cohort snaps, as two means over the bristles of the cohort.
struct Passage {
  double path;         ///< mean of the path to the snap over the bristles
  double half_square;  ///< half the mean square of the path to the snap over the bristles
};
Passage find_passage(const SurvivalTable& table, double residual, double reach, double along, double across2,
                     double strength) noexcept {
  const Survival at = survival_at(table, reach);
  const double mean = (table.mean - at.moment) / at.left;
  const double variance =
      std::max((table.square - at.square) / at.left - mean * mean, 0.0) * (strength * strength);
  const double length = mean * strength + residual;
  const double least = 0.25 * length * length;
  const double square = std::max(length * length - across2, least);
  const double root = std::sqrt(square) - 0.5 * variance * across2 / (square * std::sqrt(square));
  const double path = std::max(root - along, 0.0);
  const double squares = length * length + variance - across2 - 2.0 * along * root + along * along;
  return {path, 0.5 * std::max(squares, path * path)};
}

/// Finds the path to the snap for a cohort that ages while it moves. Its age depends on that path, so
/// find_passage() is iterated four times.
Passage find_aged_passage(const SteadyLaw& law, double residual, double reach, double along, double across2,
                          double age) noexcept {
  Passage passage{0.0, 0.0};
  for (int i = 0; i < 4; ++i)
    passage = find_passage(law.table, residual, reach, along, across2,
                           law.material.ageing_factor(age + passage.path * law.per_length));
  return passage;
}

/// Constants of steady sliding as a renewal process: the mean path between snaps, the mean deflection beyond
/// the residual (`force`), and `transient`. Along a path that begins with a snap, that deflection has the
/// integral path x force + `transient` if the path is long.
struct Renewals {
  double mean, force, transient;
};
Renewals find_renewals(const SteadyLaw& law, const Node* nodes, std::uint32_t count) noexcept {
  double mean = law.table.mean;
  double square = law.table.square;
  double cube = law.table.cube;
  if (law.per_length > 0.0) {
    mean = square = cube = 0.0;
    for (std::uint32_t k = 0; k < count; ++k) {
      mean += nodes[k].share;
      square += 2.0 * nodes[k].share * nodes[k].age;
      cube += 3.0 * nodes[k].share * nodes[k].age * nodes[k].age;
    }
  }
  const double force = 0.5 * square / mean;
  return {mean, force, force * force - cube / (3.0 * mean)};  // Renewals::transient
}

/// Adds the path integral of the deflection, and the snaps, of a long step: the bristles of each cohort snap
/// once, and from then on follow a renewal process.
void add_passages(const Cohorts& r, const SteadyLaw& law, const Renewals& renewals, const CohortState& s,
                  const double* rows, const CohortMove& a, CohortTotals& t) noexcept {
  const auto [mean, force, transient] = renewals;
  for (std::uint32_t i = 0; i < s.count; ++i) {
    const double mass = mass_of(rows, i);
    const double zx = a.from[0] - entry(rows, i, cohort_x);
    const double zy = a.from[1] - entry(rows, i, cohort_y);
    const double along = zx * a.direction[0] + zy * a.direction[1];
    const double across2 = std::max(zx * zx + zy * zy - along * along, 0.0);
    const double reach = entry(rows, i, cohort_reach);
    const Passage first =
        law.per_length > 0.0
            ? find_aged_passage(law, r.law.residual, reach, along, across2, a.times.now - a.times.births[i])
            : find_passage(law.table, r.law.residual, reach, along, across2, 1.0);
    const double after = a.length - first.path;
    const double renewed = after * (r.law.residual + force) + transient;
    t.integral[0] += mass * (zx * first.path + a.direction[0] * (first.half_square + renewed));
    t.integral[1] += mass * (zy * first.path + a.direction[1] * (first.half_square + renewed));
    t.snapped += mass * (after / mean + force / mean);
  }
}

/// Writes the cohorts of steady sliding at the end of a step. Their masses are rounded to whole numbers.
void write_nodes(const Cohorts& r, const Node* nodes, std::uint32_t count, const CohortMove& a,
                 CohortState& s, double* rows) noexcept {
  double all = 0.0;
  for (std::uint32_t k = 0; k < count; ++k) all += nodes[k].share;
  const std::uint32_t before = s.count;
  double missing = s.mass;
  std::uint32_t i = 0;
  const auto write = [&](std::uint32_t k, double mass) {
    missing -= mass;
    for (int axis = 0; axis < 2; ++axis)
      entry(rows, i, axis == 0 ? cohort_x : cohort_y) =
          a.to[axis] - (nodes[k].age + r.law.residual) * a.direction[axis];
    entry(rows, i, cohort_reach) = std::max(nodes[k].reach + reach_margin, r.law.sure);
    if (a.times.births != nullptr)
      a.times.births[i] = a.times.now + (a.length - nodes[k].age) * a.times.per_length;
    entry(rows, i, cohort_left) = nodes[k].at.left;
    entry(rows, i, cohort_moment) = nodes[k].at.moment;
    entry(rows, i, cohort_fresh) = fresh_mass(mass, nodes[k].at.left);
    entry(rows, i, cohort_low) = 0.0;
    entry(rows, i, cohort_high) = s.mass;
    ++i;
  };
  // Writes the youngest cohort first, because row 0 takes the rounding remainder of all masses.
  for (std::uint32_t k = 0; k < count; ++k)
    if (const double mass = std::floor(s.mass * (nodes[k].share / all)); mass > 0.0) write(k, mass);
  // Puts a mass of few units, which cannot be divided among all cohorts, into one cohort at the mean age of
  // bristles.
  if (i == 0) write(count / 2, s.mass);
  entry(rows, 0, cohort_fresh) = fresh_mass(mass_of(rows, 0) + missing, entry(rows, 0, cohort_left));
  s.count = i;
  for (; i < before; ++i) clear_lane(rows, i);
}

/// Finds nu, the snaps per bristle and length of steady sliding. Without renewal it is one over the mean snap
/// length. With it, (1 + kappa) nu times the integral of S(r) exp(-kappa nu r) over r is 1, with S the
/// survival function and r the bend beyond the residual.
double find_rate(double kappa, const Node* nodes, std::uint32_t count) noexcept {
  double all = 0.0;
  for (std::uint32_t k = 0; k < count; ++k) all += nodes[k].share;
  double rate = 1.0 / ((1.0 + kappa) * all);
  // Approaches the root from below by Newton's method. No iterate passes it, because the sum is concave.
  for (int i = 0; kappa > 0.0 && i < 8; ++i) {
    double sum = 0.0;
    double slope = 0.0;
    for (std::uint32_t k = 0; k < count; ++k) {
      const double drawn = kappa * rate * nodes[k].age;
      const double left = nodes[k].share * exp(-drawn);
      sum += left;
      slope += left * (1.0 - drawn);
    }
    const double step = (1.0 / (1.0 + kappa) - rate * sum) / slope;
    rate += step;
    if (step < 1e-9 * rate) break;
  }
  return rate;
}

}  // namespace

bool needs_pieces(const Cohorts& r, const CohortMove& move) noexcept {
  return move.books && (r.law.renewal > 0.0 || move.length < r.follow);
}

double find_snap_rate(const Cohorts& r, const CohortTimes& times) noexcept {
  Node nodes[most_cohorts];
  const std::uint32_t count = find_nodes(r, find_steady_law(r, times), nodes);
  return find_rate(r.law.renewal, nodes, count);
}

void slide_far(const Cohorts& r, CohortState& s, double* rows, const CohortMove& a,
               CohortTotals& t) noexcept {
  Node nodes[most_cohorts];
  const SteadyLaw law = find_steady_law(r, a.times);
  const std::uint32_t count = find_nodes(r, law, nodes);
  if (const double kappa = r.law.renewal; kappa > 0.0) {
    const double hazard = kappa * (law.per_length > 0.0 ? find_rate(kappa, nodes, count) : r.law.snap_rate);
    for (std::uint32_t k = 0; k < count; ++k) nodes[k].share *= exp(-hazard * nodes[k].age);
  }
  double stored = 0.0;
  if (a.books) {
    if (!needs_pieces(r, a)) {
      add_passages(r, law, find_renewals(law, nodes, count), s, rows, a, t);
      t.lost += 2.0 * (t.integral[0] * a.direction[0] + t.integral[1] * a.direction[1]);
    }
    stored = squares_at(s, rows, needs_pieces(r, a) ? a.to : a.from, s.spread);
  }
  write_nodes(r, nodes, count, a, s, rows);
  // Gives all cohorts all ranks (the order in which bristles came into contact), because a slide this long
  // mixes old and new bristles.
  s.layered = 0;
  s.spread = 0.0;
  for (std::uint32_t& open : s.open) open = no_cohort;
  find_moment(s, rows);
  s.slack = -1.0;
  ++t.pieces;
  if (a.books) t.lost += stored - squares_at(s, rows, a.to, s.spread);
}

}  // namespace bristle::detail
