#include "core/patches/cohorts/fluctuation.hpp"

#include <algorithm>
#include <cmath>

#include "core/common/hashing.hpp"

namespace bristle::detail {

void set_fluctuation(Cohorts& r) noexcept {
  if (r.options.fluctuation == 0) return;
  r.noise = &cohort_noise;
  r.law.bristle = full_mass / r.options.fluctuation;
  Hasher hasher;
  hasher.add(std::uint64_t{r.options.seed} + 0x6E6F697365u);
  hasher.add(r.options.key);
  r.law.draw_key = hasher.value();
}

void scatter(const Cohorts& r, CohortState& s, double* rows, const CohortMove& move,
             CohortTotals& t) noexcept {
  const double before = squares_at(s, rows, move.to, 0.0);
  // Assigns n bristles at random, cohort by cohort. Each bristle that is not assigned yet joins the cohort
  // with the probability mean / mean_left: expected mass of this cohort over that of all cohorts left.
  double left = s.mass;
  double mean_left = s.mass;
  const std::uint64_t pass = s.draws++;
  for (std::uint32_t i = 0; i < s.count; ++i) {
    const double mean = mass_of(rows, i);
    const double chance = i + 1 < s.count ? std::min(mean / mean_left, 1.0) : 1.0;
    const double mass = r.noise->leave(r.law, pass, i, left, chance);
    entry(rows, i, cohort_fresh) = mass > 0.0 ? fresh_mass(mass, entry(rows, i, cohort_left)) : 0.0;
    left -= mass;
    mean_left -= mean;
  }
  remove_empty(s, rows, move.times.births);
  find_moment(s, rows);
  t.lost += before - squares_at(s, rows, move.to, 0.0);
}

double carried_deflection(const Cohorts& r, const CohortMove& move, int axis) noexcept {
  return r.material->kinetic * move.direction[axis];
}

void draw_cut(Cohorts& r, double* kept) noexcept {
  double drawn[most_cohorts];
  const std::uint64_t pass = r.draws++;
  double variance = 0.0;
  double excess = 0.0;
  for (std::uint32_t i = 0; i < r.count; ++i) {
    const double mass = mass_of(r.rows, i);
    const double lost = mass - kept[i];
    drawn[i] = lost > 0.0 ? mass - r.noise->leave(r.law, pass, i, mass, lost / mass) : kept[i];
    excess += drawn[i] - kept[i];
    variance += lost > 0.0 ? kept[i] * (lost / mass) : 0.0;
  }
  if (variance == 0.0) return;
  // Corrects the independently sampled losses so that their sum is the expected one: each cohort takes a
  // share of the excess in proportion to its variance. If a cohort cannot take its whole share, the rest goes
  // to the next cohort.
  const double share = excess / variance;
  double owed = 0.0;
  for (int turn = 0; turn < 2; ++turn)
    for (std::uint32_t i = 0; i < r.count; ++i) {
      const double mass = mass_of(r.rows, i);
      const double lost = mass - kept[i];
      if (turn == 0) {
        const double back = lost > 0.0 ? share * (kept[i] * (lost / mass)) : 0.0;
        owed -= kept[i];
        kept[i] = std::clamp(std::floor(drawn[i] - back + 0.5), 0.0, mass);
        owed += kept[i];
      } else if (owed != 0.0) {
        const double given = std::clamp(kept[i] - owed, 0.0, mass);
        owed -= kept[i] - given;
        kept[i] = given;
      }
    }
}

double draw_kept(Cohorts& r, std::uint32_t i, double mass, double mean_kept) noexcept {
  const double kept = mass - r.noise->leave(r.law, r.draws++, i, mass, (mass - mean_kept) / mass);
  entry(r.rows, i, cohort_fresh) = kept > 0.0 ? fresh_mass(kept, entry(r.rows, i, cohort_left)) : 0.0;
  return kept;
}

}  // namespace bristle::detail
