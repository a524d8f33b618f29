// Times the library and plain friction loops alternately, so that other programs slow all of them alike.
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bench/plain_loops.hpp"
#include "bench/timing.hpp"

#include "tools/libraries/capacity/capacity.hpp"
#include "tools/libraries/capacity/subject.hpp"

namespace cli {
namespace {

double sink = 0.0;

double seconds_of(Contestant& contestant, std::uint64_t steps) {
  return bristle_bench::time_of([&] { sink = sink + contestant.step(); }, steps);
}

}  // namespace

std::vector<ComparisonRow> compare(std::vector<Contestant> contestants, const std::string& regime,
                                   std::uint64_t bristles, std::uint64_t rounds) {
  std::vector<std::uint64_t> steps;
  for (Contestant& c : contestants) {
    seconds_of(c, 3);  // runs some steps first, which warms caches and branch predictors
    const double once = seconds_of(c, 4) / 4.0;
    steps.push_back(static_cast<std::uint64_t>(std::clamp(200e-6 / std::max(once, 1e-9), 1.0, 1e5)));
  }
  for (std::uint64_t round = 0; round < rounds; ++round) {
    for (std::size_t i = 0; i < contestants.size(); ++i) {
      // Begins each round with another loop, so that no loop always runs after the same one and finds its
      // data in the cache.
      const std::size_t c = (i + round) % contestants.size();
      contestants[c].ns.push_back(1e9 * seconds_of(contestants[c], steps[c]) /
                                  static_cast<double>(steps[c] * bristles));
    }
  }
  std::vector<ComparisonRow> rows;
  for (const Contestant& c : contestants) {
    std::vector<double> ratios;
    for (std::uint64_t round = 0; round < rounds; ++round)
      ratios.push_back(c.ns[round] / contestants[0].ns[round]);
    rows.push_back({regime, c.name, bristles, quartiles(c.ns), quartiles(ratios)});
  }
  return rows;
}

Contestant bristle_kernel(const CapacityCase& what, std::uint64_t n, const std::string& isa) {
  auto subject = std::make_shared<CapacitySubject>(what, n, isa);
  return {"bristle: " + what.kernel_name(),
          [subject] {
            subject->step();
            return 0.0;
          },
          {}};
}

namespace {

Contestant plain_loop(const char* name, const CapacityCase& what, std::uint64_t n,
                      bristle::plain::Style style) {
  bristle::plain::PlainOptions options;
  options.bristles = n;
  options.mean_snap_length_m = mean_snap_length_m;
  options.axes = what.axes;
  options.rule =
      what.rule == bristle::SnapRule::keep ? bristle::plain::Rule::keep : bristle::plain::Rule::redraw;
  options.mean = has(what.outputs, bristle::Outputs::mean);
  options.style = style;
  auto loop = std::make_shared<bristle::plain::PlainLoop>(options);
  for (int i = 0; i < 20; ++i) loop->step(1.28 * mean_snap_length_m, 0.96 * mean_snap_length_m);
  const double d = step_length(what.regime) * mean_snap_length_m;
  return {name, [loop, d] { return loop->step(0.8 * d, 0.6 * d).end[0]; }, {}};
}

}  // namespace

Contestant stream_loop(const CapacityCase& what, std::uint64_t n) {
  const bool redraw = what.rule == bristle::SnapRule::redraw;
  const int read = redraw ? 4 : 3;
  const int written = what.regime == Regime::presliding ? 0 : redraw ? 4 : 2;
  auto loop = std::make_shared<bristle::plain::StreamLoop>(n, read, written);
  return {"streaming the same bytes", [loop] { return loop->step(); }, {}};
}

std::vector<ComparisonRow> compare_loops(const CapacityOptions& options) {
  using bristle::Outputs;
  using bristle::SnapRule;
  using bristle::plain::Style;
  CapacityCase presliding, sliding, redraw;
  presliding.regime = Regime::presliding;
  sliding.outputs = redraw.outputs = Outputs::mean;
  redraw.regime = Regime::one_snap;
  redraw.rule = SnapRule::redraw;

  const std::uint64_t rounds = options.quick ? 15 : 61;
  std::vector<ComparisonRow> rows;
  for (const std::uint64_t n : {900u, 14'400u, 230'400u}) {
    if (options.quick && n > 14'400) continue;
    for (const CapacityCase& what : {presliding, sliding, redraw}) {
      std::vector<Contestant> contestants;
      contestants.push_back(bristle_kernel(what, n, options.isa));
      contestants.push_back(plain_loop("plain arrays, one loop", what, n, Style::one_loop));
      contestants.push_back(plain_loop("plain arrays, in chunks", what, n, Style::chunked));
      contestants.push_back(stream_loop(what, n));
      for (ComparisonRow& row : compare(std::move(contestants), to_string(what.regime), n, rounds))
        rows.push_back(std::move(row));
    }
  }
  return rows;
}

}  // namespace cli
