// Representatives that age (core/patches/AGEING.md): their ages between steps, and the constants with which
// long steps at one sliding speed are made at once.
#include <algorithm>

#include "core/materials/elementary.hpp"
#include "core/materials/steady_sliding.hpp"
#include "core/patches/representatives/representatives.hpp"

namespace bristle::detail {
namespace {

/// Path after which bristles of an exponential law that age slide steadily within 1e-3, in mean paths from
/// snap to snap, by the renewal equation. (Without ageing this law forgets at once.)
constexpr double memory_of_aged_exponential = 7.0;

/// Returns how a bristle ages along its path since it snapped, scaled, at one sliding speed.
PathAgeing ageing_along(const Material& m, double per_length) noexcept {
  return {m.ageing_form, m.ageing_strength, 1.0 / per_length};
}

/// Returns the path after which bristles that redraw their lengths slide steadily within 1e-3, in mean paths
/// from snap to snap. Ageing spreads these paths: bristles of narrow laws get out of phase sooner, and wide
/// laws get longer tails (core/patches/AGEING.md).
double lengths_to_steady(const CompiledMaterial& m) noexcept {
  const double cv = m.material.snap_length.cv();
  if (cv < 0.2) return 9.0;
  const bool memoryless = m.law.kind == law_exponential;
  const double fresh = memoryless ? memory_of_aged_exponential : m.law.jump_from * m.law.inverse_mean;
  return fresh * (1.05 + (cv < 0.4 ? 0.0 : 3.0 * m.material.ageing_strength));
}

/// Fills the constants of AgedSliding::law with which bristles jump over many snaps, for one sliding speed.
template <class T>
void find_jumps(const Representatives<T>& r, double per_length) noexcept {
  const CompiledMaterial& m = *r.material;
  AgedSliding& aged = *r.aged;
  if (aged.per_length == per_length) return;
  aged.per_length = per_length;
  const PathAgeing ageing = ageing_along(m.material, per_length);
  double moment[6] = {1.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  for (int k = 0; k < spread_size; ++k) {
    const double l = aged_length(m.spread[static_cast<std::size_t>(k)], ageing);
    double power = spread_weight(k);
    for (int n = 1; n < 6; ++n) moment[n] += power *= l;
  }
  aged.law.skewness = aged.law.kurtosis = 0.0;  // clears the values of another sliding speed
  fill_jump_sums(moment, aged.law);
  const double cv = aged.law.deviation * aged.law.inverse_mean;
  if (cv < 0.2) {
    fill_narrow_jumps(moment, cv, aged.law);
  } else {
    aged.law.jump_from = aged.law.stationary_from = lengths_to_steady(m) * aged.law.mean;
  }
  aged.largest_growth = aged_length(m.longest, ageing) / m.longest * (1.0 + 1e-6);
}

/// Returns the length of a step, scaled, from which on SnapRule::redraw jumps over snaps and needs constants
/// for that.
double jumps_from(const CompiledMaterial& m) noexcept {
  return m.law.kind == law_exponential ? memory_of_aged_exponential * m.law.mean : m.law.jump_from;
}

}  // namespace

double largest_ageing_factor(const Material& m) noexcept {
  const double most = m.ageing_form == AgeingForm::saturating ? 1.0 : log1p(2.0 * oldest_bristle);
  return 1.0 + m.ageing_strength * most;
}

template <class T>
double aged_since(const Patch& p, std::uint32_t b) noexcept {
  const Representatives<T>& r = representatives<T>(p);
  const double aged = (time_of(p) - r.since[b]) / p.material().material.ageing_time;
  return std::clamp(aged, 0.0, oldest_bristle);
}

template <class T>
void write_ages(const Patch& p, std::uint32_t b) noexcept {
  const Representatives<T>& r = representatives<T>(p);
  const auto aged = static_cast<T>(aged_since<T>(p, b));
  const std::uint32_t start = b * block_size;
  const std::uint32_t end = std::min(start + block_size, r.padded());
  const std::uint32_t contact = std::clamp(r.in_contact(), start, end);
  const bool straight = r.blocks[b].zero != 0;
  for (std::uint32_t i = start; i < contact; ++i)
    r.age[i] = std::min((straight ? T(0) : r.age[i]) + aged, static_cast<T>(oldest_bristle));
  std::fill(r.age + contact, r.age + end, T(0));
  r.since[b] = time_of(p);
}

template <class T>
double limit_now(const Representatives<T>& r, std::uint32_t i) noexcept {
  const auto fresh = static_cast<double>(r.delta[i]);
  if (r.age == nullptr) return fresh;
  const Material& m = r.material->material;
  const auto left = static_cast<double>(static_cast<T>(r.material->residual));
  return left + (fresh - left) * m.ageing_factor(static_cast<double>(r.age[i]) * m.ageing_time);
}

double age_per_length(const Material& m, const KernelStep& a) noexcept {
  return std::min(std::min(a.duration / m.ageing_time, oldest_bristle) / a.length, oldest_bristle);
}

template <class T>
void prepare_ageing(const Patch& p, KernelStep& a) noexcept {
  const Representatives<T>& r = representatives<T>(p);
  const Material& m = p.material().material;
  a.ageing_rate = 1.0 / m.ageing_time;
  a.ageing_strength = m.ageing_strength;
  a.ageing_form = m.ageing_form == AgeingForm::saturating ? 1 : 0;
  if (!r.redraws() || !(a.length > jumps_from(p.material()))) return;
  find_jumps(r, age_per_length(m, a));
  a.largest_growth = r.aged->largest_growth;
  if (!a.snaps_all) return;
  // Takes double precision also for far steps after which an old bristle, whose snap length has grown, may
  // not have snapped.
  const double longest = p.material().residual + p.material().longest * largest_ageing_factor(m);
  a.in_double =
      r.aged->law.stationary_from > far_length || a.length > 0x1p60 || 2.0 * longest > a.length ? 1 : 0;
}

template <class T>
void begin_ageing(const Representatives<T>& r) noexcept {
  AgedSliding& aged = *r.aged;
  aged = AgedSliding{};
  aged.law = r.material->law;
  // Lets bristles jump over snaps only in steps long enough for find_jumps(). Shorter steps have no moments
  // of the aged law, and need none: ageing lengthens the paths from snap to snap, so fewer snaps fit in.
  aged.law.jump_from = jumps_from(*r.material);
  aged.law.stationary_from = std::max(aged.law.stationary_from, aged.law.jump_from);
}

template <class T>
double mean_growth(const Representatives<T>& r, double per_length) noexcept {
  const CompiledMaterial& m = *r.material;
  const double mean = m.material.snap_length.mean() * m.lengths_per_metre;
  return aged_length(mean, ageing_along(m.material, per_length)) / mean;
}

template <class T>
void find_steady_sliding(const Representatives<T>& r, double per_length) noexcept {
  AgedSliding& aged = *r.aged;
  if (aged.steady_at == per_length) return;
  aged.steady_at = per_length;
  const CompiledMaterial& m = *r.material;
  const PathAgeing ageing = ageing_along(m.material, per_length);
  AgedNode nodes[spread_size];
  double mean = 0.0;
  for (int k = 0; k < spread_size; ++k) {
    const double length = m.spread[static_cast<std::size_t>(k)];
    nodes[k] = {length, spread_weight(k), aged_length(length, ageing)};
    mean += nodes[k].share * nodes[k].aged;
  }
  const SteadySliding steady = find_steady_sliding(
      {nodes, spread_size}, mean, r.redraws() ? SnapRule::redraw : SnapRule::keep, m.material.shared_renewal);
  aged.steady_bend = m.residual + steady.deflection;
  aged.steady_snaps = steady.snap_rate;
}

BRISTLE_INSTANTIATE(aged_since, write_ages, limit_now, begin_ageing, prepare_ageing, mean_growth,
                    find_steady_sliding)

}  // namespace bristle::detail
