// Drawn snap lengths have the law of the material, by its moments and its survival function, over all 2^23
// numbers that a draw can give.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include "core/materials/kernel_law.hpp"

namespace bristle_test::test_drawn_lengths {

using namespace bristle;

namespace {

/// Returns the length at share u of a piecewise linear table (kernels/cells.hpp), found by arithmetic:
/// sixteen cells for each octave of the distance from the nearer end, with the cells of the upper half after
/// those of the lower.
double length_at(const std::vector<double>& table, double u, bool single) {
  constexpr int half = 23 * 16;
  const double w = std::min(u, 1.0 - u);
  int exponent = 0;
  const double mantissa = std::frexp(w, &exponent);  // w as mantissa in [1/2, 1) times a power of two
  const int cell = (exponent + 23) * 16 + static_cast<int>((2.0 * mantissa - 1.0) * 16.0);
  const auto at = static_cast<std::size_t>(cell + (u > 0.5 ? half : 0));
  if (!single) return table.at(2 * half + 2 * at) + table.at(2 * half + 2 * at + 1) * w;
  float line[2];
  std::memcpy(line, &table.at(at), sizeof line);
  return static_cast<double>(line[0]) + static_cast<double>(line[1]) * w;
}

struct Sums {
  double moment[3] = {0.0, 0.0, 0.0};
  double distance = 0.0;  ///< largest distance between the distribution functions of drawn lengths and law
  double shortest = 1e9, longest = 0.0;
};
Sums sum_draws(const detail::CompiledMaterial& m, const std::vector<double>& table, bool single) {
  constexpr int draws = 1 << 23;
  Sums sums;
  for (int h = 0; h < draws; ++h) {
    // Takes the outermost 4096 of the random shares (the numbers from 0 to 1 that select a length) at either
    // end, and of the others every 64th with weight 64.
    const bool outer = h < 4096 || h >= draws - 4096;
    constexpr int pace = 64;
    if (!outer && h % pace != pace / 2) continue;
    const double weight = outer ? 1.0 / draws : static_cast<double>(pace) / draws;
    const double share = outer ? h + 0.5 : h;
    const double length = length_at(table, share / draws, single) * m.metres_per_length;
    double power = weight;
    for (double& moment : sums.moment) {
      moment += power;
      power *= length;
    }
    const double below = 1.0 - m.material.snap_length.survival(length);
    sums.distance = std::max(sums.distance, std::abs(below - share / draws));
    sums.shortest = std::min(sums.shortest, length);
    sums.longest = std::max(sums.longest, length);
  }
  return sums;
}

}  // namespace

TEST_CASE("Lengths are drawn with the mean and the mean square of the law, to 1e-6", "[draws]") {
  const double mean = 10e-6;
  struct Law {
    SnapLength law;
    double mean, mean_square;  // mean and mean square of the law in closed form
  };
  std::vector<Law> laws;
  for (const double cv : {0.1, 0.3, 0.4, 0.7, 1.0, 1.25})
    laws.push_back({SnapLength::lognormal(mean, cv), mean, mean * mean * (1.0 + cv * cv)});
  // The normal law is cut at 0, five deviations below its mean: the cut removes 3e-7 of the law and moves its
  // moments by 2e-6 of a deviation.
  const double density = 1.4867195147342979e-06, kept = 1.0 - 2.8665157187919391e-07;
  const double cut_mean = mean + 2e-6 * density / kept;
  laws.push_back({SnapLength::normal(mean, 2e-6), cut_mean, mean * cut_mean + 4e-12});
  for (const Law& law : laws) {
    const auto m = detail::compile_material(Material{}.with_snap_length(law.law));
    m->make_sampling_tables();
    for (const bool single : {true, false}) {
      INFO(to_string(law.law.law()) << ", cv " << law.law.cv() << (single ? ", single" : ", double"));
      const Sums sums = sum_draws(*m, m->table, single);
      CHECK(sums.moment[0] == Approx(1.0).epsilon(1e-12));
      CHECK(sums.moment[1] == Approx(law.mean).epsilon(1e-6));
      CHECK(sums.moment[2] == Approx(law.mean_square).epsilon(1e-6));
      CHECK(sums.distance < 1.5e-4);
      CHECK(sums.shortest > 0.0);
      CHECK(sums.longest <= law.law.longest() * (1.0 + 1e-6));
    }
  }
}

TEST_CASE("Bristles met in a jump have lengths in proportion to how long they are", "[draws]") {
  for (const double cv : {0.3, 0.4}) {
    const auto m = detail::compile_material(Material{}.with_snap_length(SnapLength::lognormal(10e-6, cv)));
    m->make_sampling_tables();
    INFO("cv " << cv);
    // Moments of the length-biased law (density times length over the mean): m2 / m1 and m3 / m1.
    const Sums sums = sum_draws(*m, m->biased_table, true);
    const double growth = 1.0 + cv * cv;
    CHECK(sums.moment[1] == Approx(10e-6 * growth).epsilon(1e-6));
    CHECK(sums.moment[2] == Approx(100e-12 * growth * growth * growth).epsilon(1e-5));
  }
}

}  // namespace bristle_test::test_drawn_lengths
