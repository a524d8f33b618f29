// Steps a patch of bristles that slide at their limit, and changes its load, material and number of strata.
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/common/assert.hpp"
#include "core/patches/sliders/sliders.hpp"

namespace bristle::detail {
namespace {

/// Returns, for a bristle that begins to stick now, a time of its last slide: so early that the next step
/// does not treat it as one that has just slid.
double held_since(double now) noexcept { return now - 4.0 * rounding_of_times(now, 1.0) - 1e-12; }

template <class T>
SlideView<T> view_of(const Patch& p) noexcept {
  const Sliders<T>& r = sliders<T>(p);
  return {r.zx,
          r.zy,
          r.limit,
          r.per_limit,
          r.weight,
          r.since,
          r.blocks,
          r.rows(),
          static_cast<T>(limit_share<T>(p)),
          static_cast<T>(r.kinetic_share())};
}

/// Returns bristle i's present limit, scaled: grown by ageing since its last slide, or kinetic if sliding.
template <class T>
double limit_now(const Patch& p, std::uint32_t i) noexcept {
  const Sliders<T>& r = sliders<T>(p);
  const double limit = static_cast<double>(r.limit[i]) * limit_share<T>(p);
  if (r.since == nullptr) return limit;
  const double now = time_of(p);
  if (!(r.since[i] < now - rounding_of_times(now, 1.0))) return limit * r.kinetic_share();
  return limit * p.material().material.ageing_factor(now - r.since[i]);
}

/// Reduces deflections that exceed limits which have fallen with the load: the tips of these bristles slide
/// although the patch does not move.
template <class T>
void take_back(Patch& p) noexcept {
  const Sliders<T>& r = sliders<T>(p);
  constexpr double inside = 1.0 - 4.0 * std::numeric_limits<T>::epsilon();
  const double now = time_of(p);
  rewrite_all<T>(p, [&](std::uint32_t i, double(&z)[2]) {
    const double bent = std::sqrt(z[0] * z[0] + z[1] * z[1]);
    if (!(bent > limit_now<T>(p, i))) return;
    const double left = static_cast<double>(r.limit[i]) * limit_share<T>(p) * r.kinetic_share() * inside;
    for (double& x : z) x *= left / bent;
    if (r.since != nullptr) r.since[i] = now;
  });
}

/// Sets the patch's stiffness to that of `zeta` bristles and scales deflections so that no force changes.
template <class T>
void change_stiffness(Patch& p, double zeta) noexcept {
  Sliders<T>& r = sliders<T>(p);
  const double factor = r.stiff_zeta / zeta;
  rewrite_all<T>(p, [factor](std::uint32_t, double(&z)[2]) {
    for (double& x : z) x *= factor;
  });
  r.stiff_zeta = zeta;
}

/// Moves the centre of limits that differ to and fro, after the load has changed by `gain` bristles.
template <class T>
void move_centre(Patch& p, double gain) noexcept {
  const Sliders<T>& r = sliders<T>(p);
  const double share = r.lay.lean * gain / r.stiff_zeta;
  if (share == 0.0) return;
  rewrite_all<T>(p, [&](std::uint32_t i, double(&z)[2]) { z[0] -= share * static_cast<double>(r.limit[i]); });
}

/// Softens a patch that is stiffer than its load implies, as it is after a fall of the load. The energy that
/// sliding frees stretches the bristles at unchanged forces, until the stiffness is that of the load. Returns
/// the energy that this took, J.
template <class T>
double soften(Patch& p, double dissipated) noexcept {
  Sliders<T>& r = sliders<T>(p);
  const double stored = 0.5 * joules_per_square<T>(r) * sum_of_squares<T>(p);
  if (!(stored > 0.0)) return 0.0;
  const double least = limit_share<T>(p);
  const double wanted = stored / (stored + r.lay.least_loss() * dissipated);
  // Ends the softening if the wanted stiffness is below that of the load, or above it only by rounding.
  const bool ends = wanted <= least * (1.0 + 1e-9);
  change_stiffness<T>(p, ends ? p.zeta : r.stiff_zeta * wanted);
  note_sliders<T>(p);
  return std::min(0.5 * joules_per_square<T>(r) * sum_of_squares<T>(p) - stored, dissipated);
}

}  // namespace

template <class T, class Change>
void rewrite_all(Patch& p, Change&& change) noexcept {
  const Sliders<T>& r = sliders<T>(p);
  for (std::uint32_t i = 0; i < r.rows(); ++i) {
    double z[2] = {deflection<T>(p, i, 0), deflection<T>(p, i, 1)};
    change(i, z);
    r.zx[i] = static_cast<T>(z[0]);
    if (r.zy != nullptr) r.zy[i] = static_cast<T>(z[1]);
  }
  for (std::uint32_t b = 0; b < r.active_blocks(); ++b)
    for (int axis = 0; axis < 2; ++axis) r.blocks[b].position[axis] = p.position[axis];
}

template <class T>
void note_sliders(Patch& p) noexcept {
  Sliders<T>& r = sliders<T>(p);
  const CompiledMaterial& m = p.material();
  r.largest_work = r.rows();
  p.part = 0.0;
  p.part_sum[0] = p.part_sum[1] = 0;
  for (std::uint32_t b = 0; b < r.active_blocks(); ++b) {
    SlideBlock& block = r.blocks[b];
    block.weight = 0.0;
    double stored[2] = {0.0, 0.0};
    const std::uint32_t end = std::min((b + 1) * block_size, r.bristles);
    for (std::uint32_t i = b * block_size; i < end; ++i) {
      const auto w = static_cast<double>(r.weight[i]);
      block.weight += w;
      stored[0] += w * static_cast<double>(r.zx[i]);
      if (r.zy != nullptr) stored[1] += w * static_cast<double>(r.zy[i]);
    }
    block.reach = -1.0;
    p.part += block.weight;
    for (int axis = 0; axis < p.axes; ++axis) {
      block.stored[axis] = std::llrint(stored[axis] * fixed_per_length);
      p.part_sum[axis] +=
          block.stored[axis] + static_cast<std::int64_t>(weighted(
                                   block.weight, difference(p.position[axis], block.position[axis])));
    }
  }
  for (int axis = 0; axis < 2; ++axis) p.part_position[axis] = p.position[axis];
  p.bound.reach = no_reach;
  if (!(p.zeta > 0.0)) p.part = 0.0;
  p.newtons_per_unit = m.material.bristle_stiffness * r.stiff_zeta * m.metres_per_length * length_per_fixed;
  note_contact(p);
  p.stiffness = r.stiff_zeta * m.material.bristle_stiffness * r.lay.stiffest;
  p.renews = r.stiff_zeta > p.zeta;  // a step, even a trial, makes a stiff patch softer
}

template <class T>
double sum_of_squares(const Patch& p) noexcept {
  const Sliders<T>& r = sliders<T>(p);
  double sum = 0.0;
  for (std::uint32_t i = 0; i < r.bristles; ++i) {
    const double x = deflection<T>(p, i, 0) + centre_of<T>(p, i), y = deflection<T>(p, i, 1);
    sum += static_cast<double>(r.weight[i]) * (x * x + r.lay.energy * y * y);
  }
  return sum;
}

template <class T>
void straighten(Patch& p) noexcept {
  Sliders<T>& r = sliders<T>(p);
  r.stiff_zeta = 0.0;
  rewrite_all<T>(p, [&p](std::uint32_t i, double(&z)[2]) {
    z[0] = 0.0 - centre_of<T>(p, i);
    z[1] = 0.0;
  });
  if (r.since != nullptr) std::fill_n(r.since, r.rows(), held_since(time_of(p)));
}

template <class T>
double apply_slider_load(Patch& p, double normal_load_n) noexcept {
  Sliders<T>& r = sliders<T>(p);
  const auto energy = [&p, &r] { return 0.5 * joules_per_square<T>(r) * sum_of_squares<T>(p); };
  const double before = has(p.outputs, Outputs::energy) ? energy() : 0.0;
  const double zeta = p.material().material.bristles_in_contact(normal_load_n);
  const double gain = zeta - p.zeta;
  p.normal_load = normal_load_n;
  p.zeta = zeta;
  p.overload = std::max(zeta / (r.full_weight * r.bristles), 1.0);
  if (p.overload < 1.0 + 1e-14) p.overload = 1.0;
  if (zeta == 0.0 || r.stiff_zeta == 0.0) {
    straighten<T>(p);
    r.stiff_zeta = zeta;
  } else {
    const bool stiffens = zeta > r.stiff_zeta;
    if (stiffens) change_stiffness<T>(p, zeta);
    move_centre<T>(p, gain);
    if (!stiffens) take_back<T>(p);
  }
  note_sliders<T>(p);
  return has(p.outputs, Outputs::energy) ? before - energy() : 0.0;
}

template <class T>
std::uint32_t prepare_sliders(Patch& p, PatchStep& step) noexcept {
  Advance& a = step.advance;
  const Material& m = p.material().material;
  a.ageing_strength = m.ageing_strength;
  a.ageing_rate = 1.0 / m.ageing_time;
  a.ageing_form = m.ageing_form == AgeingForm::saturating ? 1 : 0;
  return sliders<T>(p).active_blocks();
}

template <class T>
void run_sliders(const Patch& p, const PatchStep& step, std::uint32_t first, std::uint32_t last,
                 Totals& totals) noexcept {
  const Sliders<T>& r = sliders<T>(p);
  const bool softens = r.stiff_zeta > p.zeta;  // softening needs the dissipated energy
  const int wanted =
      (has(p.outputs, Outputs::mean) ? 1 : 0) | (has(p.outputs, Outputs::energy) || softens ? 2 : 0);
  const auto kernel =
      r.since != nullptr ? r.kernels->slide_aged[p.axes - 1] : r.kernels->slide[p.axes - 1][wanted];
  kernel(view_of<T>(p), step.advance, first, last, totals);
}

template <class T>
void finish_sliders(Patch& p, const PatchStep& step, const Totals& t, StepSums& sums) noexcept {
  const Advance& a = step.advance;
  Sliders<T>& r = sliders<T>(p);
  sums.visited = t.visited;
  if (t.blocks_rewritten == 0) {
    hold(p, a, sums);
    if (!a.commit) return;
    double reach = std::numeric_limits<double>::max();
    for (std::uint32_t b = 0; b < r.active_blocks(); ++b) reach = std::min(reach, r.blocks[b].reach);
    // Shortens the bound, because the kernel rounds positions to float, here and when a bristle next slides.
    p.bound = {{p.position[0], p.position[1]}, std::max(reach * (1.0 - 1e-6), 0.0)};
    return;
  }
  for (int axis = 0; axis < p.axes; ++axis) {
    sums.end[axis] = to_double(t.stored[axis]);
    sums.twice_mean[axis] = to_double(t.twice_mean[axis]);
  }
  sums.dissipated =
      std::min(joules_per_square<T>(r) * to_double(t.squares) * length_per_fixed * std::max(a.length, 1.0),
               highest_energy);
  sums.snaps = t.snaps;
  if (!a.commit) return;
  for (int axis = 0; axis < 2; ++axis) {
    p.position[axis] = p.part_position[axis] = a.to[axis];
    p.part_sum[axis] = static_cast<std::int64_t>(t.stored[axis]);
  }
  p.bound.reach = no_reach;
  if (r.stiff_zeta > p.zeta) {
    const double unit = p.newtons_per_unit;
    sums.dissipated -= soften<T>(p, sums.dissipated);
    // Converts the sums to the new unit of force. The force at the end of this step is then the one that a
    // next step at rest returns.
    for (int axis = 0; axis < p.axes; ++axis) {
      sums.end[axis] = static_cast<double>(p.part_sum[axis]);
      sums.twice_mean[axis] = sums.twice_mean[axis] * (unit / p.newtons_per_unit);
    }
  }
}

template <class T>
void advance_sliders(Patch& p, PatchStep& step, StepSums& sums) noexcept {
  Totals totals{};
  run_sliders<T>(p, step, 0, prepare_sliders<T>(p, step), totals);
  finish_sliders<T>(p, step, totals, sums);
}

template <class T>
void take_over_sliders(Patch& to, Patch& from) noexcept {
  Sliders<T>& r = sliders<T>(to);
  const Sliders<T>& old = sliders<T>(from);
  r.options.seed = old.options.seed;
  const double ratio = from.material().metres_per_length * to.material().lengths_per_metre;  // ratio of the
                                                                                             // two units of
                                                                                             // length, a
                                                                                             // power of two
  const double now = time_of(to);
  for (std::uint32_t i = 0; i < r.rows(); ++i) {
    // Moves the centre of the limits: it is a share of the limit, which differs between the two materials.
    const double centre = r.lay.lean * limit_share<T>(from) * static_cast<double>(r.limit[i]);
    r.zx[i] = static_cast<T>((deflection<T>(from, i, 0) + centre_of<T>(from, i)) * ratio - centre);
    if (r.zy != nullptr) r.zy[i] = static_cast<T>(deflection<T>(from, i, 1) * ratio);
    if (r.since == nullptr) continue;
    r.since[i] = old.since != nullptr ? old.since[i] : held_since(now);
  }
  for (std::uint32_t b = 0; b < r.active_blocks(); ++b)
    for (int axis = 0; axis < 2; ++axis) r.blocks[b].position[axis] = to.position[axis];
  // Applies the load again, because under the new material it may bring another number of bristles into
  // contact. Bristles bent beyond their new limits slide.
  const Material& m = to.material().material;
  to.normal_load = from.normal_load;
  to.zeta = m.bristles_in_contact(from.normal_load);
  r.stiff_zeta = to.zeta / limit_share<T>(from);
  const double before = sum_of_squares<T>(to);
  // Counts the change of stored energy as lost: strata of another law weigh equal deflections differently.
  if (has(to.outputs, Outputs::energy))
    to.pending_loss += 0.5 * joules_per_square<T>(r) * (sum_of_squares<T>(from) * ratio * ratio - before);
  take_back<T>(to);
  to.pending_dissipated += 0.5 * joules_per_square<T>(r) * std::max(before - sum_of_squares<T>(to), 0.0);
  to.pending_loss += apply_slider_load<T>(to, from.normal_load);
}

BRISTLE_INSTANTIATE(note_sliders, sum_of_squares, straighten, apply_slider_load, prepare_sliders, run_sliders,
                    finish_sliders, advance_sliders, take_over_sliders)

}  // namespace bristle::detail
