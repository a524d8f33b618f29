#include "core/materials/survival_table.hpp"

#include <algorithm>

#include "core/materials/elementary.hpp"
#include "core/materials/kernel_law.hpp"
#include "core/materials/law_at.hpp"
#include "core/materials/slow_wave.hpp"

namespace bristle::detail {
namespace {

/// Share of a patch's bristles that is half a unit of mass. Masses are whole numbers, so a smaller share is
/// rounded to none.
constexpr double negligible_share = 0x1p-47;

constexpr double farthest_end = 2048.0;  // longest end of a table, mean snap lengths; less than unused_reach

double node(std::size_t k) { return from_bits((survival_first + k) << survival_shift) - survival_offset; }

/// Returns the length at which the survival table ends: the longest length that representatives sample. For a
/// lognormal law whose longer bristles carry more than 1e-5 of the force it ends later.
double find_end(const SnapLength& law) {
  double end = law.longest();
  if (law.law() != SnapLaw::lognormal) return end;
  const double squares = law.moment(2);
  while (squares - law.partial_moment(2, end) > 1e-5 * squares && end < farthest_end * law.mean())
    end *= 1.25;
  return end;
}

/// Finds the deflection beyond which bristles carry a given share of the force of steady sliding. That force
/// is in proportion to the integral of x S(x) over the deflection x. (The integral of S alone would neglect
/// the few longest bristles, which carry most of the force under a wide law.)
double find_tail(const SurvivalTable& table, double share) {
  double carried = 0.0;
  for (std::size_t k = table.cells.size() - 1; k-- > 0;) {
    const SurvivalCell& cell = table.cells[k];
    const double end = table.cells[k + 1].start;
    const double middle = 0.5 * (cell.start + end);
    carried += (end - cell.start) * middle * (cell.survival + cell.slope * (middle - cell.start));
    if (carried > share * 0.5 * table.square) return cell.start;
  }
  return 0.0;
}

/// Waves of the force after bristles began to slide together and snap in step: the path after which they have
/// decayed, and the longest piece of path that resolves them.
/// Waves of lognormal, normal and exponential laws decay nearly as exp(-2 pi^2 cv^2 x / mean) or faster, and
/// are followed until 1e-4 of them is left. A law whose density jumps, or that has several groups of lengths,
/// may have slower and shorter waves than its spread suggests. Its slowest wave is computed, and followed
/// until 6e-6 of it is left.
struct Waves {
  double path;
  double finest;  ///< SurvivalTable::finest, from the waves
};
Waves find_waves(const SurvivalTable& table, const SnapLength& law) {
  constexpr double per_square = 19.739208802178716;  // 2 pi^2
  constexpr double full_turn = 6.283185307179586;
  const double narrow = table.mean / (19.7 * square(law.cv()));
  Waves waves{9.2 * narrow, std::min(1.0, law.cv() / 0.25)};
  if (table.smooth) return waves;
  // Longest path, in mean snap lengths, after which waves count as decayed. Groups of bristles of equal
  // length would snap in step for ever.
  constexpr double farthest = 1e5;
  const SlowWave slow = find_slow_wave(table.cells, table.mean);
  waves.path = std::min(std::max(25.0 * narrow, 12.0 / slow.decay), farthest * table.mean);
  // Shortens the longest piece of path for a table of lengths under which waves of the force decay slowly:
  // the more slowly, the shorter. (The square root is the spread of a lognormal law whose waves decay as
  // slowly.) A piece must also resolve one wave.
  if (law.law() == SnapLaw::table && slow.frequency > 0.0) {
    waves.finest = std::min(waves.finest, square_root(slow.decay * table.mean / per_square) / 0.34);
    waves.finest = std::min(waves.finest, 0.6 * full_turn / (slow.frequency * table.mean));
  }
  // Keeps default pieces shorter than half the length that a tenth of the bristles do not exceed. Otherwise
  // many short bristles would snap within one piece.
  waves.finest = std::min(waves.finest, 3.75 * law.quantile(0.1) / law.mean());
  waves.finest = std::max(waves.finest, 1.0 / 16);
  return waves;
}

/// Returns the path after which a long slide does not depend on how it began: its waves have decayed, and
/// bristles left from before it carry at most the share `little` of the force. The longest length of those
/// bristles counts twice, because a bristle bent against the slide first unbends along a path as long as its
/// deflection.
double find_forgetting_path(const SurvivalTable& table, double waves, double little) {
  const double tail = find_tail(table, little);
  return std::max(tail + waves, 2.0 * tail);
}

/// Returns the survival function S at the nodes of the table. The last entry is 0, at the first node beyond
/// the longest length.
std::vector<double> survival_at_nodes(const SnapLength& law, double metres, double longest) {
  std::vector<double> lengths;
  while (node(lengths.size() + 1) < longest) lengths.push_back(node(lengths.size() + 1) * metres);
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
std::vector<double> mean_survival_at_nodes(const SnapLength& law, double metres, double longest) {
  // Returns E[(x - delta)^2; delta < x], whose second derivative by x is 2 (1 - S), S the survival function.
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

/// Returns the survival function S at the first cell that starts at `start` or later.
double survival_from(const SurvivalTable& table, double start) {
  const auto cell = std::find_if(table.cells.begin(), table.cells.end(),
                                 [start](const SurvivalCell& c) { return c.start >= start; });
  return cell->survival;
}

}  // namespace

SurvivalTable make_survival_table(const SnapLength& law, double per_metre) {
  SurvivalTable table;
  const double metres = 1.0 / per_metre;
  double longest = find_end(law) * per_metre;
  const bool tabulated = law.law() == SnapLaw::table, even = law.law() == SnapLaw::uniform;
  table.smooth = !even && !tabulated;
  const double shortest = even ? law.first_parameter() * per_metre : 0.0;
  const std::vector<double> survival_at_node =
      tabulated ? mean_survival_at_nodes(law, metres, longest) : survival_at_nodes(law, metres, longest);
  if (tabulated) longest = node(survival_at_node.size() - 1);
  double survival = 1.0;
  for (std::size_t k = 0;; ++k) {
    // Begins a cell at the shortest and at the longest length, where S has corners that a line would cut. The
    // cell of a length still follows from its bits, because no length below the shortest (CohortLaw::sure) or
    // above the longest is looked up.
    const double start = shortest > node(k) && shortest < node(k + 1) ? shortest : node(k);
    const double next = std::min(node(k + 1), longest);
    double after = std::min(survival_at_node[k + 1], survival);
    if (start == shortest) table.sure = shortest;
    if (1.0 - after < negligible_share) {
      after = 1.0;
      table.sure = next;
    }
    const double width = next - start;
    table.cells.push_back({survival, (after - survival) / width, table.mean, start});
    table.squares.push_back(table.square);
    table.mean += (survival - after) * 0.5 * (start + next);
    table.square += (survival - after) * (start * start + start * next + next * next) / 3.0;
    table.cube += (survival - after) * (start + next) * (start * start + next * next) / 4.0;
    survival = after;
    table.end = next;
    if (survival == 0.0) break;
  }
  table.cells.push_back({0.0, 0.0, table.mean, table.end});
  table.squares.push_back(table.square);
  const Waves waves = find_waves(table, law);
  table.finest = waves.finest;
  table.forget = find_forgetting_path(table, waves.path, 3e-4);
  // Allows less error for `follow` than for `forget`, because the errors of to-and-fro strokes add up.
  table.follow = find_forgetting_path(table, waves.path, 1e-6);
  table.weak = survival_from(table, find_tail(table, 1e-4));
  return table;
}

const SurvivalTable& CompiledMaterial::survival() const {
  std::call_once(survival_made_,
                 [this] { survival_ = make_survival_table(material.snap_length, lengths_per_metre); });
  return survival_;
}

}  // namespace bristle::detail
