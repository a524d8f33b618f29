// Steps with shared renewal (core/patches/RUBBING.md), in which a snap makes other bristles start afresh. A
// step is cut into pieces; for each the kernels foresee the snaps, make the renewals, and move all bristles.
#include <algorithm>
#include <cmath>

#include "core/common/assert.hpp"
#include "core/common/hashing.hpp"
#include "core/materials/elementary.hpp"
#include "core/patches/representatives/representatives.hpp"

namespace bristle::detail {
namespace {

constexpr double straight = 0x1p-12;  // sine of the largest angle at which a slide counts as straight

// Sine of the largest angle by which a slide may turn, within a mean snap length or a step, and still count
// as the same slide.
constexpr double gentle = 0.4;
// Largest share of young bristles (new in contact) for which they are stepped separately from the others. If
// more are young, all bristles are stepped together.
constexpr double most_young = 0.25;
// Least path, as a share of a piece, on which stepping young bristles separately is worth its cost.
constexpr double least_apart = 0.05;
/// Number of bristles of a patch at which the error of the longest pieces equals the random noise of its
/// force. Patches with more bristles have less noise and take shorter pieces.
constexpr double even_bristles = 6000.0;
/// Number of snaps expected on that part of a long step along which bristles are stepped; along the remaining
/// steady slide they are dragged. With 8, at most one step in 3000 has no snap there.
constexpr double snaps_followed = 8;

/// Finds the number y of renewals per bristle in a piece in which a bristle would snap `snaps` times without
/// renewals. Renewals prevent snaps: they leave the share (1 - exp(-y)) / y. Of the bristles that restart, by
/// snap or renewal, the share `again` snaps once more in the piece. All these snaps together cause y.
double find_selections(double renewal, double snaps, double again) noexcept {
  const double x = renewal * snaps * (1.0 + again) / std::max(1.0 - renewal * again, 0.5);
  double y = x;
  for (int i = 0; i < 4; ++i) {  // Newton's method, from the right, for the convex y^2 = x (1 - exp(-y))
    const double stay = exp(-y);
    y -= (y * y - x * (1.0 - stay)) / (2.0 * y - x * stay);
  }
  return y;
}

/// Returns the share of restarted bristles that snap again within the same piece (RenewalLaw::again).
/// `length`: length of the piece, in mean snap lengths.
double share_again(const RenewalLaw& law, double length) noexcept {
  const double at = std::min(length / law.again_reach, 1.0) * law.again_knots;
  const int k = std::min(static_cast<int>(at), law.again_knots - 1);
  return law.again[k] + (law.again[k + 1] - law.again[k]) * (at - k);
}

template <class T>
std::uint64_t renewal_key(const Representatives<T>& r) noexcept {
  Hasher hasher;
  hasher.add(std::uint64_t{r.options.seed} + 0x7265u);
  hasher.add(r.options.key);
  return hasher.value();
}

/// Counts the bristles that the next piece of path would bend beyond their snap length, from which the
/// renewals of the piece follow.
template <class T>
std::uint64_t foresee(const Patch& p, const PatchStep& step) noexcept {
  const Representatives<T>& r = representatives<T>(p);
  return r.kernels->foresee[r.ages()][p.axes - 1][r.redraws()](r.view(), step.kernel, 0, r.active_blocks());
}

/// Returns the fixed-point unit of sums over renewals. `energy_unit` keeps path x longest length below 2^51;
/// a renewal adds at most twice that, which kernels/renew.hpp sums in coarse units of 2^40.
double selection_unit(const KernelStep& a) noexcept { return a.energy_unit * 0x1p37; }

/// Renews as many bristles, selected at random: each slips and starts afresh, before the next piece of path
/// is stepped.
template <class T>
void select_and_renew(Patch& p, const PatchStep& step, double selections) noexcept {
  if (!(selections > 0.0)) return;
  const Representatives<T>& r = representatives<T>(p);
  const KernelStep& a = step.kernel;
  const Renewal renewal{a, renewal_key(r), r.shared->selections, static_cast<std::uint64_t>(selections),
                        selection_unit(a)};
  RenewalTotals totals{};
  r.kernels->renew[r.ages()][p.axes - 1][r.redraws()](r.view(), renewal, 0, r.active_blocks(), totals);
  PieceSums& walked = r.shared->walked;
  r.shared->selections += renewal.selections;
  r.shared->due += p.material().material.shared_renewal * static_cast<double>(totals.snaps) - selections;
  for (int axis = 0; axis < p.axes; ++axis) {
    p.sum[axis] += totals.stored[axis];
    walked.twice_integral[axis] += to_double(totals.twice_integral[axis]) / renewal.unit * fixed_per_length;
  }
  walked.squares += to_double(totals.squares) / renewal.unit;
  walked.changed |= totals.renewed > 0;
  walked.snaps += totals.snaps;
  if (totals.tail_changed) note_tail<T>(p);
}

/// Makes the renewals of the next piece: those that its foreseen snaps will cause, and those that earlier
/// snaps caused and that are not made yet. A piece without a snap makes none. Returns the number of bristles
/// that the piece would bend beyond their snap length.
template <class T>
std::uint64_t renew(Patch& p, const PatchStep& step) noexcept {
  Representatives<T>& r = representatives<T>(p);
  const KernelStep& a = step.kernel;
  const std::uint64_t beyond = foresee<T>(p, step);
  if (beyond == 0) return 0;
  const double kappa = p.material().material.shared_renewal;
  const double count = r.in_contact();
  double lengths = a.length * r.shared->inverse_mean;
  if (r.ages()) lengths /= mean_growth(r, age_per_length(p.material().material, a));
  const double again = share_again(p.material().renewal(), lengths);
  const double foreseen = count * find_selections(kappa, static_cast<double>(beyond) / count, again);
  select_and_renew<T>(p, step, std::floor(r.shared->due + foreseen));
  return beyond;
}

/// Returns `run`, the length of the present slide, shortened for a rest or a change of speed since its last
/// step. Both change the friction of ageing bristles, so the patch is further from steady sliding than a
/// slide of the length `run`; the relative change of friction tells by how much (shortened_run()).
template <class T>
double run_of_aged(const Patch& p, const KernelStep& a, double run, double path) noexcept {
  const Representatives<T>& r = representatives<T>(p);
  const Material& m = p.material().material;
  const double before = r.shared->run_ageing;
  const double now = r.shared->walked.per_length;
  if (run == 0.0) return 0.0;
  if (!(before > 0.0 && now > 0.0)) return 0.0;
  const double waited = (a.start - r.shared->run_until) / m.ageing_time - before * std::max(path, 0.0);
  const double waiting = log1p(std::max(waited, 0.0) * r.shared->inverse_mean / before);
  const double change = m.ageing_strength * (waiting + std::abs(log(now / before)));
  return shortened_run(run, r.shared->walked.forget, change);
}

/// Finds the length of the slide that a step continues (0 = a new slide begins), and whether the step leaves
/// the line of the slide at a corner. A step on the line continues the slide even if the patch left the line
/// in between without a snap; a corner must lie where the slide ended. With ageing every corner begins a new
/// slide.
template <class T>
double find_run(const Patch& p, const KernelStep& a, bool& has_corner) noexcept {
  const Representatives<T>& r = representatives<T>(p);
  if (r.shared->run == 0.0) return 0.0;
  const double(&e)[2] = r.shared->direction;
  const double x = to_lengths(difference(p.position[0], r.shared->slid_to[0]));
  const double y = to_lengths(difference(p.position[1], r.shared->slid_to[1]));
  if (!(a.direction[0] * e[0] + a.direction[1] * e[1] > 0.0)) return 0.0;
  const double sine = std::abs(a.direction[0] * e[1] - a.direction[1] * e[0]);
  if (sine > straight) {
    has_corner = !r.ages() && sine <= gentle * std::min(a.length * r.shared->inverse_mean, 1.0) &&
                 std::max(std::abs(x), std::abs(y)) * r.shared->inverse_mean <= straight;
    return has_corner ? std::min(r.shared->run, r.shared->walked.forget) : 0.0;
  }
  if (std::abs(x * e[1] - y * e[0]) * r.shared->inverse_mean > straight) return 0.0;
  const double path = x * e[0] + y * e[1];
  const double run = std::clamp(r.shared->run + path, 0.0, r.shared->walked.forget);
  return r.ages() ? run_of_aged<T>(p, a, run, path) : run;
}

/// Stores length, direction and end of the slide after a step in which a bristle snapped, for the next step
/// to continue.
template <class T>
void note_run(Patch& p, const double (&direction)[2]) noexcept {
  Representatives<T>& r = representatives<T>(p);
  r.shared->run = std::min(r.shared->walked.run + r.shared->walked.length, r.shared->walked.forget);
  r.shared->young_run = std::min(r.shared->walked.young_run + r.shared->walked.length, r.shared->run);
  if (r.shared->young_run == r.shared->run) r.shared->forget_young();
  r.shared->run_ageing = r.shared->walked.per_length;
  r.shared->run_until = r.shared->walked.until;
  for (int axis = 0; axis < 2; ++axis) {
    if (r.shared->walked.run == 0.0 || r.shared->walked.has_corner)
      r.shared->direction[axis] = direction[axis];
    r.shared->slid_to[axis] = p.position[axis];
  }
}

/// Rewrites the deflections of block b relative to the patch's present position.
template <class T>
void write_down(Patch& p, std::uint32_t b) noexcept {
  const Representatives<T>& r = representatives<T>(p);
  const bool full = b < r.full_blocks();
  if (full) book_block<T>(p, b, -1);
  r.kernels->rewrite(r.view(), b, p.position);
  if (full) book_block<T>(p, b, +1);
  r.groups[b / blocks_per_group].reach = 0.0;
  p.known = Bound::none;
  note_tail<T>(p);
}

/// Drags the blocks [begin, end) round a corner of the path without stepping them, and then `length` along
/// the step's direction, up to the step's last piece. `before`: direction before the corner. Adds to the sums
/// by how much the deflections then differ from steady sliding.
template <class T>
void drag_round(Patch& p, const PatchStep& step, const double (&before)[2], double length,
                std::uint32_t begin, std::uint32_t end) noexcept {
  if (!(length > 0.0) || begin == end) return;
  const Representatives<T>& r = representatives<T>(p);
  const KernelStep& a = step.kernel;
  for (std::uint32_t b = begin; b < end; ++b)
    if (r.blocks[b].zero) write_down<T>(p, b);
  const Corner corner{{p.position[0], p.position[1]},
                      {a.direction[0], a.direction[1]},
                      {before[0], before[1]},
                      length,
                      a.residual,
                      a.energy_unit};
  const bool sums_lag = has(p.outputs, Outputs::mean) || has(p.outputs, Outputs::energy);
  RenewalTotals totals{};
  r.kernels->drag[sums_lag](r.view(), corner, begin, end, totals);
  PieceSums& walked = r.shared->walked;
  for (int axis = 0; axis < 2; ++axis) {
    const double twice_integral = to_double(totals.twice_integral[axis]) / corner.unit;
    p.sum[axis] += totals.stored[axis];
    walked.twice_integral[axis] += twice_integral * fixed_per_length;
    walked.lag += twice_integral * a.direction[axis];
  }
  walked.changed = true;
  if (totals.tail_changed) note_tail<T>(p);
  p.known = Bound::none;
}

/// Updates the state and adds to the step's sums after the kernels have stepped one piece.
template <class T>
void finish_sums(Patch& p, const KernelStep& a, const Totals& t) noexcept {
  const Representatives<T>& r = representatives<T>(p);
  StepSums sums;
  finish_kernel<T>(p, a, t, sums);
  r.shared->due += p.material().material.shared_renewal * static_cast<double>(t.snaps);
  PieceSums& walked = r.shared->walked;
  for (int axis = 0; axis < p.axes; ++axis) walked.twice_integral[axis] += sums.twice_mean[axis] * a.length;
  walked.squares += to_double(t.squares) / a.energy_unit;
  walked.snaps += t.snaps;
  walked.visited += t.visited;
}

/// Returns the number of the first block that has a young bristle (one that came into contact during the
/// present slide). Returns the number of blocks in contact if there is none.
template <class T>
std::uint32_t first_young_block(const Representatives<T>& r) noexcept {
  return std::min(r.shared->young_from / block_size, r.active_blocks());
}

/// Runs the kernels over all blocks for one piece of path, on the calling thread.
template <class T>
Totals run_all_blocks(const Patch& p, const PatchStep& step) noexcept {
  Totals totals{};
  run_blocks<T>(p, step, 0, representatives<T>(p).active_blocks(), totals);
  return totals;
}

/// Makes a patch that consists of the blocks of `p` from number `begin` on, and shares their columns, so that
/// these blocks can be stepped alone. `record` becomes its record: a copy of p's, with pointers moved to
/// these blocks.
template <class T>
Patch part_from(const Patch& p, std::uint32_t begin, Representatives<T>& record) noexcept {
  record = representatives<T>(p);
  const std::uint32_t first = begin * block_size;
  record.bristles -= first;
  record.whole -= first;
  record.blocks += begin;
  record.zx += first;
  record.first += first;
  record.delta += first;
  if (record.zy != nullptr) record.zy += first;
  if (record.random != nullptr) record.random += first;
  Patch part = p;
  part.record = &record;
  part.whole = record.full_blocks() * block_size;
  part.sum[0] = part.sum[1] = 0;
  for (std::uint32_t b = 0; b < record.full_blocks(); ++b) book_block<T>(part, b, +1);
  return part;
}

/// Steps the blocks from number `begin` on, those with young bristles, by `length` along the step's
/// direction, in one piece. The patch's other blocks are not stepped and the patch has not moved, so it then
/// shifts the stored positions of these blocks back. Renews at the rate of steady sliding, because most snaps
/// happen in the other blocks; leaves `due` unchanged.
template <class T>
void follow_apart(Patch& p, const PatchStep& step, double length, std::uint32_t begin) noexcept {
  Representatives<T> record;
  Patch young = part_from<T>(p, begin, record);
  const Int128 before[2] = {young.sum[0], young.sum[1]};
  PatchStep apart = step;
  KernelStep& a = apart.kernel;
  for (int axis = 0; axis < 2; ++axis) {
    a.from[axis] = p.position[axis];
    a.to[axis] = sum_of(a.from[axis], std::llrint(step.kernel.direction[axis] * length * fixed_per_length));
  }
  find_direction(a);
  a.skips_blocks = 0;
  prepare_kernel<T>(young, apart);
  // Makes the unit of integrals over renewals grow with the length of the piece, whose square may exceed the
  // square of every snap length.
  int lengths = 0;
  std::frexp(a.length * record.shared->inverse_mean, &lengths);
  a.energy_unit = std::ldexp(a.energy_unit, -std::max(lengths, 0));
  const double kappa = p.material().material.shared_renewal;
  const double due = record.shared->due;
  select_and_renew<T>(young, apart,
                      std::floor(kappa * record.shared->steady_snaps * record.in_contact() * a.length));
  finish_sums<T>(young, a, run_all_blocks<T>(young, apart));
  record.shared->due = due;
  for (int axis = 0; axis < 2; ++axis) {
    for (std::uint32_t b = 0; b < record.active_blocks(); ++b)
      record.blocks[b].position[axis] =
          sum_of(record.blocks[b].position[axis], difference(a.from[axis], a.to[axis]));
    p.sum[axis] += young.sum[axis] - before[axis];
  }
  for (std::uint32_t b = 0; b < record.active_blocks(); ++b) record.blocks[b].reach = 0.0f;
  forget_upper_bounds<T>(p);
  note_tail<T>(p);
  PieceSums& walked = record.shared->walked;
  walked.apart =
      a.length * (static_cast<double>(young.whole) + young.part) / (static_cast<double>(p.whole) + p.part);
  walked.changed = true;
}

/// Drags the bristles along the steady part of a slide's path without stepping them, up to its last piece,
/// which ends at `path`. Turns them round a corner if the path has one, and steps young bristles as far as
/// they need it.
template <class T>
void drag_on(Patch& p, const PatchStep& step, bool after_corner, double path) noexcept {
  const Representatives<T>& r = representatives<T>(p);
  const PieceSums& walked = r.shared->walked;
  const double length = walked.length - path;
  const std::uint32_t begin = first_young_block(r), end = r.active_blocks();
  double needed = begin < end ? std::clamp(walked.forget - walked.young_run - path, 0.0, length) : 0.0;
  if (needed < least_apart * r.shared->piece) needed = 0.0;
  if (walked.has_corner) {
    const double(&before)[2] = after_corner ? step.kernel.direction : r.shared->direction;
    drag_round<T>(p, step, before, length, 0, begin);
    drag_round<T>(p, step, before, length - needed, begin, end);
  }
  if (needed > 0.0) follow_apart<T>(p, step, needed, begin);
}

/// Returns the length of the part of a step's path along which every bristle must be stepped (on what remains
/// they are dragged): as much as the slide lacks to be steady. It is at least so long that its end does not
/// depend on its start, and that several snaps are expected on it (snaps_followed), which matters in a patch
/// of few bristles.
template <class T>
double path_followed(const Representatives<T>& r, double length) noexcept {
  const double some = std::max(r.shared->goes_on, snaps_followed / (r.shared->steady_snaps * r.in_contact()));
  const double forget = r.shared->walked.forget;
  const double followed = std::min({length, forget, std::max(forget - r.shared->walked.run, some)});
  // Steps the bristles along the whole path unless it pays to drag them. Dragging them round a corner costs
  // as much as stepping them along the path `goes_on`.
  const bool pays = !r.shared->walked.has_corner || length - followed > r.shared->goes_on;
  return pays ? followed : length;
}

}  // namespace

double shortened_run(double run, double forget, double share) noexcept {
  // Natural logarithm of 1000: along `forget` a disturbance decays to a thousandth.
  constexpr double per_forget = 6.907755278982137;
  if (run == 0.0) return 0.0;
  const double unsteady = std::min(exp(-per_forget * (run / forget)) + share, 1.0);
  return std::clamp(forget * (-log(unsteady) / per_forget), 0.0, run);
}

template <class T>
void note_young(Representatives<T>& r, double active, std::uint32_t whole) noexcept {
  SharedRenewal& shared = *r.shared;
  if (r.in_contact() <= shared.young_from) shared.forget_young();
  if (!(r.active > active)) return;
  const double share = 1.0 - active / r.active;
  if (r.ages()) {
    shared.run = shortened_run(shared.run, shared.forget, share);
    return;
  }
  if (shared.young_from == RenewalState::none_young) {
    shared.young_from = whole;
    shared.young_run = shared.run;
  }
  shared.young_run = shortened_run(shared.young_run, shared.forget, share);
  if (r.in_contact() - shared.young_from <= most_young * r.in_contact()) return;
  shared.run = shared.young_run;
  shared.forget_young();
}

template <class T>
void plan_pieces(Representatives<T>& r) noexcept {
  const CompiledMaterial& m = *r.material;
  const double mean = m.material.snap_length.mean() * m.lengths_per_metre;
  const RenewalLaw& law = m.renewal();
  r.shared->piece = longest_piece * std::min(1.0, 2.0 / m.material.shared_renewal) * mean;
  // Adds twice the residual, the path along which bristles that are bent against the motion must unbend
  // before they snap.
  r.shared->forget = std::min((law.forget + 1.0) * mean + 2.0 * m.residual, far_length / 2.0);
  r.shared->goes_on = longest_piece * mean;
  r.shared->inverse_mean = 1.0 / mean;
  r.shared->steady_bend = m.kinetic;
  r.shared->steady_snaps = m.snap_rate;
}

template <class T>
void step_pieces(Patch& p, PatchStep& step) noexcept {
  Representatives<T>& r = representatives<T>(p);
  const KernelStep whole = step.kernel;
  BRISTLE_ASSERT(whole.stores);
  r.shared->walked = PieceSums{};
  r.shared->walked.length = whole.length;
  r.shared->walked.duration = whole.duration;
  r.shared->walked.until = whole.start + whole.duration;
  for (int axis = 0; axis < 2; ++axis) r.shared->walked.from[axis] = whole.from[axis];
  r.shared->walked.forget = r.shared->forget;
  if (r.ages()) {
    r.shared->walked.per_length = age_per_length(p.material().material, whole);
    r.shared->walked.forget = std::min(r.shared->forget * mean_growth(r, r.shared->walked.per_length),
                                       r.shared->forget * largest_ageing_factor(p.material().material));
  }
  if (r.in_contact() == 0) {
    prepare_kernel<T>(p, step);
    return;
  }
  r.shared->walked.run = find_run<T>(p, whole, r.shared->walked.has_corner);
  r.shared->walked.young_run =
      std::clamp(r.shared->young_run + r.shared->walked.run - r.shared->run, 0.0, r.shared->walked.run);
  const double followed = path_followed(r, whole.length);
  // Makes pieces shorter in patches of many bristles: the error falls with the square of the piece, and
  // should not exceed the noise, which falls with the root of the number of bristles. Pieces keep their full
  // length if bristles are dragged round a corner (drag_round()), because the last piece must follow the
  // corner.
  const bool bends = r.shared->walked.has_corner && followed < whole.length;
  const double even = bends ? 1.0 : std::min(even_bristles / r.bristles, 1.0);
  const double piece = r.shared->piece * square_root(square_root(even));
  const double pieces = std::max(std::ceil(followed / piece * (1.0 - 1e-12)), 1.0);
  if (pieces <= 1.0 && followed == whole.length) {
    prepare_kernel<T>(p, step);
    renew<T>(p, step);
    return;
  }
  KernelStep& a = step.kernel;
  a.snaps_all = 0;
  a.skips_blocks = p.skips ? 1 : 0;
  for (int axis = 0; axis < 2; ++axis) a.to[axis] = whole.from[axis];
  double path = 0.0;
  for (double k = 1.0;; k += 1.0) {
    const double before = path;
    path = k <= pieces ? followed * (k / pieces) : std::min(path + piece, whole.length);
    const bool arrives = path >= whole.length;
    for (int axis = 0; axis < 2; ++axis) {
      a.from[axis] = a.to[axis];
      a.to[axis] =
          arrives ? whole.to[axis]
                  : sum_of(whole.from[axis], std::llrint(whole.direction[axis] * path * fixed_per_length));
    }
    a.duration = whole.duration * ((path - before) / whole.length);
    a.rounding = rounding_of_times(step.ends, k);
    find_direction(a);
    prepare_kernel<T>(p, step);
    if (k >= pieces && path < whole.length) drag_on<T>(p, step, k > 1.0, path);
    const std::uint64_t beyond = renew<T>(p, step);
    // Drags the patch only after a bristle has snapped. Until the first snap the patch does not slide, and
    // its bristles still bend further.
    if (arrives || (k >= pieces && (beyond > 0 || r.shared->walked.changed))) {
      r.shared->walked.dragged = whole.length - path;
      return;
    }
    finish_piece<T>(p, a, run_all_blocks<T>(p, step));
    a.start += a.duration;
  }
}

namespace {

/// Rewrites blocks whose stored position lies far behind the patch, where precision would suffer. A renewal
/// does not move a block: where every bristle is renewed before it snaps, as with one bristle in contact, the
/// block would fall behind without end. Ages stay.
template <class T>
void bring_along(Patch& p) noexcept {
  Representatives<T>& r = representatives<T>(p);
  const double farthest = 2.0 * longest_bend(r);
  for (std::uint32_t b = 0; b < r.active_blocks(); ++b) {
    const double x = to_lengths(difference(p.position[0], r.blocks[b].position[0]));
    const double y = to_lengths(difference(p.position[1], r.blocks[b].position[1]));
    if (std::max(std::abs(x), std::abs(y)) <= farthest) continue;
    write_down<T>(p, b);
  }
}

}  // namespace

template <class T>
void finish_piece(Patch& p, const KernelStep& a, const Totals& t) noexcept {
  Representatives<T>& r = representatives<T>(p);
  finish_sums<T>(p, a, t);
  r.shared->walked.changed |= t.blocks_rewritten > 0;
  find_new_bound<T>(p, t);
  bring_along<T>(p);
  BRISTLE_ASSERT(sums_agree<T>(p));
}

namespace {

/// Returns twice the mean sum of deflections over a step without any snap. It has the same bits as
/// bend_without_snap(), so that cutting a step into pieces changes none.
template <class T>
double unsnapped_mean(const Patch& p, int axis) noexcept {
  const std::int64_t from = representatives<T>(p).shared->walked.from[axis];
  Int128 twice_mean = 2 * p.sum[axis] - Int128{p.whole} * difference(p.position[axis], from), end = 0;
  add_last_block(p, axis, from, p.position[axis], true, end, twice_mean);
  return to_double(twice_mean);
}

/// Returns the number of snaps to report for a path on which bristles are dragged without being stepped: a
/// whole number whose mean over many steps is exact.
template <class T>
std::uint64_t snaps_dragged(const Representatives<T>& r, double dragged) noexcept {
  const double share =
      static_cast<double>(renewal_key(r) + r.shared->selections * 0x9E3779B97F4A7C15u) * 0x1p-64;
  const double rate = r.ages() ? r.aged->steady_snaps : r.shared->steady_snaps;
  const double snaps = std::floor(dragged * rate * r.in_contact() + share);
  return snaps < 9e18 ? static_cast<std::uint64_t>(snaps) : std::uint64_t{9000000000000000000u};
}

}  // namespace

template <class T>
void finish_walk(Patch& p, const double (&direction)[2], StepSums& sums) noexcept {
  const Representatives<T>& r = representatives<T>(p);
  const PieceSums& walked = r.shared->walked;
  if (walked.changed) note_run<T>(p, direction);
  double steady_bend = r.shared->steady_bend;
  if (r.ages() && walked.dragged > 0.0) {
    find_steady_sliding(r, walked.per_length);
    steady_bend = r.aged->steady_bend;
    // Advances the time at which blocks were last rewritten by the time of the dragged path, so that bristles
    // do not age on it. In steady sliding their ages stay the same on average.
    for (std::uint32_t b = 0; b < r.active_blocks(); ++b)
      r.since[b] += walked.duration * (walked.dragged / walked.length);
  }
  // Adds the part of the path on which bristles were dragged to the sums; on it they have the mean deflection
  // of steady sliding.
  const double weight = static_cast<double>(r.whole) + static_cast<double>(static_cast<T>(r.fraction));
  const double share = (walked.dragged - walked.apart) / walked.length;
  const double steady = 2.0 * weight * steady_bend;
  for (int axis = 0; axis < p.axes; ++axis) {
    sums.end[axis] = deflection_sum(p, axis) * fixed_per_length;
    sums.twice_mean[axis] =
        walked.twice_integral[axis] / walked.length + direction[axis] * (steady * share) * fixed_per_length;
    if (!walked.changed) sums.twice_mean[axis] = unsnapped_mean<T>(p, axis);
  }
  sums.visited = walked.visited;
  if (!has(p.outputs, Outputs::energy)) return;
  // Shortens the dragged path, as far as energy and snaps are concerned, where deflections lag behind a
  // corner of the path. Bristles are bent less along the motion there, so they dissipate less and snap less
  // often.
  const double dragged =
      walked.dragged > 0.0 ? std::max(walked.dragged - walked.apart + walked.lag / steady, 0.0) : 0.0;
  const double squares = walked.squares + steady * dragged;
  sums.dissipated = std::min(joules_per_square<T>(p) * squares, highest_energy);
  sums.snaps = walked.snaps;
  if (walked.dragged > 0.0) sums.snaps += snaps_dragged(r, dragged);
}

BRISTLE_INSTANTIATE(plan_pieces, step_pieces, finish_piece, note_young, finish_walk)

}  // namespace bristle::detail
