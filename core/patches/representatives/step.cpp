// Steps a patch of representatives: prepares the constants of the kernels, and takes sums and bounds from
// them.
#include <algorithm>
#include <cmath>

#include "core/common/assert.hpp"
#include "core/common/hashing.hpp"
#include "core/patches/representatives/representatives.hpp"

namespace bristle::detail {
namespace {

/// Returns the fixed-point unit of energies: a power of two with which the sum of squared deflections over
/// all snaps of a block fits into 62 bits.
double energy_unit(double length, double longest) noexcept {
  // Limits the sum over a block's snaps, in which each bristle adds at most path x longest snap length.
  const double path = length + 2.0 * longest;
  const double most = 4.0 * block_size * path * longest;
  int exponent = 0;
  std::frexp(most, &exponent);
  return std::ldexp(1.0, std::clamp(61 - exponent, -1020, 60));
}

/// Returns the key of the random numbers that put bristles between two snaps after a jump. It depends on
/// the state, so that successive equal steps, and equal patches in different states, get different random
/// numbers.
template <class T>
std::uint64_t phase_key(const Patch& p, const double (&scaled)[2]) noexcept {
  const Representatives<T>& r = representatives<T>(p);
  Hasher hasher;
  hasher.add(scaled[0]);
  hasher.add(scaled[1]);
  hasher.add(std::uint64_t{r.options.seed});
  for (int axis = 0; axis < 2; ++axis) {
    std::uint64_t stored = 0;
    for (std::uint32_t b = 0; b < r.full_blocks(); ++b)
      stored += static_cast<std::uint64_t>(r.blocks[b].stored[axis]);
    hasher.add(stored);
    hasher.add(static_cast<std::uint64_t>(r.blocks[0].stored[axis]));
  }
  return hasher.value();
}

}  // namespace

template <class T>
bool sums_agree(const Patch& p) noexcept {
  const Representatives<T>& r = representatives<T>(p);
  Patch counted = p;
  counted.sum[0] = counted.sum[1] = 0;
  for (std::uint32_t b = 0; b < r.full_blocks(); ++b) book_block<T>(counted, b, +1);
  return counted.sum[0] == p.sum[0] && counted.sum[1] == p.sum[1];
}

template <class T>
void find_new_bound(Patch& p, const Totals& t) noexcept {
  const Representatives<T>& r = representatives<T>(p);
  // Recomputes bounds on snapping only while few blocks change. Bounds cost a square root per bristle. They
  // save nearly all visits if a fortieth of the blocks is rewritten, and cost more than they save at a
  // quarter.
  if (t.blocks_visited > 0) p.tracks = 8 * t.blocks_rewritten < r.active_blocks();
  const std::uint32_t groups = (r.active_blocks() + blocks_per_group - 1) / blocks_per_group;
  double reach = 1e300;
  p.known = Bound::none;
  for (std::uint32_t g = 0; g < groups; ++g) {
    if (!(r.groups[g].reach > 0.0)) return;
    const double x = to_lengths(difference(p.position[0], r.groups[g].anchor[0]));
    const double y = to_lengths(difference(p.position[1], r.groups[g].anchor[1]));
    reach = std::min(reach, r.groups[g].reach - std::sqrt(x * x + y * y));
  }
  note_bound(p, {{p.position[0], p.position[1]}, reach});
}

template <class T>
void prepare_kernel(const Patch& p, PatchStep& step) noexcept {
  const Representatives<T>& r = representatives<T>(p);
  const CompiledMaterial& m = p.material();
  KernelStep& a = step.kernel;
  a.residual = m.residual;
  if (a.snaps_all) {
    // Uses double precision only if the path left after a bristle's last snap is needed (under the stationary
    // law it is not), or if the square of the step overflows a float.
    a.in_double = !r.redraws() || m.law.stationary_from > far_length || a.length > 0x1p60 ? 1 : 0;
    a.phase_key = phase_key<T>(p, step.scaled);
  } else if (m.single_length && sizeof(T) < sizeof(double)) {
    a.in_double = 1;
  }
  if (p.ages) prepare_ageing<T>(p, a);
  // Sets a unit of energy also if nobody asks for energies, because kernels with a residual compute them
  // anyway.
  if (p.renews || p.ages || m.residual > 0.0 || has(p.outputs, Outputs::energy)) {
    const double longest = p.ages ? m.longest * largest_ageing_factor(m.material) : m.longest;
    a.energy_unit = energy_unit(a.length, longest + 2.0 * m.residual);
  }
  a.finds_bounds = a.skips_blocks && p.tracks ? 1 : 0;
}

template <class T>
std::uint32_t prepare(Patch& p, PatchStep& step) noexcept {
  if (p.renews)
    step_pieces<T>(p, step);
  else
    prepare_kernel<T>(p, step);
  return representatives<T>(p).active_blocks();
}

template <class T>
void run_blocks(const Patch& p, const PatchStep& step, std::uint32_t first, std::uint32_t last,
                Totals& totals) noexcept {
  const Representatives<T>& r = representatives<T>(p);
  r.kernels->step[r.variant](r.view(), step.kernel, first, last, totals);
}

template <class T>
void finish_kernel(Patch& p, const KernelStep& a, const Totals& t, StepSums& sums) noexcept {
  const bool mean = has(p.outputs, Outputs::mean);
  // Computes the sum of deflections at the end of the step, and twice its mean over the step, exactly in
  // fixed point. Takes one axis at a time, so that 128-bit sums stay in registers.
  for (int axis = 0; axis < p.axes; ++axis) {
    const Int128 moved = Int128{p.whole} * difference(a.to[axis], a.from[axis]);
    const Int128 whole = p.sum[axis] + moved + t.stored[axis] + Int128{block_size} * t.offset[axis];
    Int128 end = whole;
    Int128 twice_mean = 0;
    if (mean) twice_mean = 2 * p.sum[axis] + moved + t.twice_mean[axis];
    if (p.part > 0.0 && t.tail_snapped) {
      end += t.tail_stored[axis];
      twice_mean += t.tail_twice_mean[axis];
    } else {
      add_last_block(p, axis, a.from[axis], a.to[axis], mean, end, twice_mean);
    }
    sums.end[axis] = to_double(end);
    sums.twice_mean[axis] = to_double(twice_mean);
    if (a.stores) {
      p.sum[axis] = whole;
      p.position[axis] = a.to[axis];
    }
  }
  if (a.stores && t.tail_snapped) note_tail<T>(p);
}

template <class T>
void finish(Patch& p, const PatchStep& step, const Totals& t, StepSums& sums) noexcept {
  const KernelStep& a = step.kernel;
  if (p.renews) {
    finish_piece<T>(p, a, t);
    finish_walk<T>(p, a.direction, sums);
    return;
  }
  finish_kernel<T>(p, a, t, sums);
  if (has(p.outputs, Outputs::energy)) {
    sums.dissipated =
        std::min(joules_per_square<T>(p) * (to_double(t.squares) / a.energy_unit), highest_energy);
    sums.snaps = t.snaps;
  }
  sums.visited = t.visited;
  if (!a.stores) return;
  BRISTLE_ASSERT(sums_agree<T>(p));
  find_new_bound<T>(p, t);
}

template <class T>
void step_bristles(Patch& p, PatchStep& step, StepSums& sums) noexcept {
  Totals totals{};
  run_blocks<T>(p, step, 0, prepare<T>(p, step), totals);
  finish<T>(p, step, totals, sums);
}

void add_totals(Totals& sum, const Totals& part) noexcept {
  for (int axis = 0; axis < 2; ++axis) {
    sum.stored[axis] += part.stored[axis];
    sum.offset[axis] += part.offset[axis];
    sum.twice_mean[axis] += part.twice_mean[axis];
  }
  sum.squares += part.squares;
  sum.snaps += part.snaps;
  sum.visited += part.visited;
  sum.blocks_visited += part.blocks_visited;
  sum.blocks_rewritten += part.blocks_rewritten;
  if (part.tail_snapped) {
    for (int axis = 0; axis < 2; ++axis) {
      sum.tail_stored[axis] = part.tail_stored[axis];
      sum.tail_twice_mean[axis] = part.tail_twice_mean[axis];
    }
    sum.tail_snapped = 1;
  }
}

BRISTLE_INSTANTIATE(sums_agree, find_new_bound, prepare_kernel, finish_kernel, prepare, run_blocks, finish,
                    step_bristles)

}  // namespace bristle::detail
