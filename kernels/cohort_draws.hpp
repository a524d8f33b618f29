// Random losses of a cohort (bristles last straight at one place) in a patch that fluctuates as n bristles.
// Each bristle leaves independently, so their number is binomial. Plain arithmetic, one draw for each cohort.
#pragma once

#include "core/cohort_table.hpp"
#include "scalar_lanes.hpp"

namespace bristle::detail {
namespace {

constexpr std::uint64_t golden = 0x9E3779B97F4A7C15u;  // multiplier of the hash, 2^64 / golden ratio

/// Returns the whole part of a number from 0 to 2^63. (floor would be a function call on the baseline, which
/// has no instruction for it.)
inline double whole_of(double x) { return static_cast<double>(static_cast<std::int64_t>(x)); }

/// Returns a number strictly between 0 and 1 from the upper 52 of 64 random bits.
inline double wide_share_of(std::uint64_t random) {
  return (static_cast<double>(random >> 12) + 0.5) * 0x1p-52;
}

/// Returns x^n for an integer n.
inline double whole_power(double x, std::uint64_t n) {
  double power = 1.0;
  for (; n > 0; n >>= 1, x *= x)
    if ((n & 1) != 0) power *= x;
  return power;
}

/// Samples a binomial number by summing its probabilities from 0 on, for means up to a dozen.
inline double draw_few(double share, double n, double chance) {
  const double odds = chance / (1.0 - chance);
  double term = whole_power(1.0 - chance, static_cast<std::uint64_t>(n));
  double sum = term;
  double k = 0.0;
  while (share > sum && k < n && term > 0.0) {
    term *= odds * ((n - k) / (k + 1.0));
    k += 1.0;
    sum += term;
  }
  return k;
}

/// Returns a random number, symmetric about 0, of variance 1 and within +-root(12): a sum of four 16-bit
/// numbers. The number is bounded, so that the binomial number needs no clipping, which would shift its mean.
inline double deviation_of(std::uint64_t random) {
  constexpr std::uint64_t low = 0xFFFF;
  const std::uint64_t sum = (random & low) + (random >> 16 & low) + (random >> 32 & low) + (random >> 48);
  return (static_cast<double>(sum) + 2.0) * (1.7320508075688772 / 65536.0) - 2.0 * 1.7320508075688772;
}

/// Returns a random number of bristles that leave, of n (a whole number), each with probability `chance`.
inline double draw_binomial(std::uint64_t random, double n, double chance) {
  const double other = 1.0 - chance;
  // Bound on n chance / (1 - chance), from which on the mean is at least root(12) standard deviations.
  constexpr double bound = 12.0;
  if (n * chance < bound * other) return draw_few(wide_share_of(random), n, chance);
  if (n * other < bound * chance) return n - draw_few(wide_share_of(random), n, other);
  // Subtracts 1/12 from the variance, because rounding to whole bristles adds as much.
  const double deviation = root(n * (chance * other) - 1.0 / 12.0) * deviation_of(random);
  return least(whole_of(most(n * chance + deviation + 0.5, 0.0)), n);
}

/// Returns a random mass that leaves a cohort (CohortNoise::leave). A bristle that the load holds in part
/// leaves as a whole or stays.
inline double leave(const CohortLaw& law, std::uint64_t pass, std::uint32_t number, double mass,
                    double chance) {
  if (!(chance > 0.0) || !(mass > 0.0)) return 0.0;
  if (chance >= 1.0) return mass;
  const std::uint64_t random = mix64(mix64(law.draw_key + pass * golden) + (number + 1) * golden);
  const double bristles = mass / law.bristle;
  const double whole = whole_of(bristles);
  double left = whole > 0.0 ? draw_binomial(random, whole, chance) : 0.0;
  if (bristles > whole && wide_share_of(mix64(random ^ golden)) < chance) left += bristles - whole;
  return least(whole_of(left * law.bristle + 0.5), mass);
}

/// Random losses of one pass over the cohorts: snaps, or the renewals that these cause.
class DrawnLosses {
 public:
  DrawnLosses(const CohortLaw& law, CohortState& s) : law_(law), s_(s), pass_(s.draws) {}
  /// Makes kappa draws (selections for renewal) for each snap, as for simulated bristles: their number
  /// follows from the snaps, and only the selected bristles are random. (An independent probability for each
  /// bristle would raise the variance by 13 %: core/decisions/009-shared-renewal.md.)
  DrawnLosses(const CohortLaw& law, CohortState& s, double hazard) : DrawnLosses(law, s) {
    const double wanted = hazard * (s.mass / law.bristle) + s.draws_due;
    draws_ = whole_of(most(wanted, 0.0));
    s.draws_due = wanted - draws_;
    weight_ = hazard * s.mass;
  }

  double kept_of(std::uint32_t i, double mass, double mean_kept) {
    if (!(mean_kept < mass)) return mass;
    s_.draws = pass_ + 1;
    return mass - leave(law_, pass_, i, mass, (mass - mean_kept) / mass);
  }

  /// Assigns a random number of the remaining draws (selections for renewal) to cohort i, by its share of the
  /// weight of the remaining cohorts. Returns the mass that cohort i keeps.
  double renewed_of(std::uint32_t i, double mass, double mean_kept) {
    s_.draws = pass_ + 1;
    const double weight = mass - mean_kept;
    if (!(weight > 0.0)) return mass;
    if (mass < law_.bristle) return kept_of(i, mass, mean_kept);  // a cohort with less mass than a bristle
    if (!(draws_ > 0.0)) return mass;
    const std::uint64_t random = mix64(mix64(law_.draw_key + pass_ * golden) + (i + 1) * golden);
    const double chance = least(weight / weight_, 1.0);
    const double drawn = chance < 1.0 ? draw_binomial(random, draws_, chance) : draws_;
    draws_ -= drawn;
    weight_ -= weight;
    return mass - least(whole_of(drawn * law_.bristle + 0.5), mass);
  }

  static double fresh_of(double, double kept, double left) { return (kept + 0.5) / left; }

 private:
  const CohortLaw& law_;
  CohortState& s_;
  std::uint64_t pass_;
  double draws_ = 0.0;   ///< number of draws (selections for renewal) not yet assigned to a cohort
  double weight_ = 0.0;  ///< mass of the cohorts that may still get draws
};

}  // namespace
}  // namespace bristle::detail
