#include "core/patches/patch_state.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <new>

#include "core/common/hashing.hpp"
#include "core/patches/population.hpp"
#include "core/common/range_check.hpp"

namespace bristle::detail {
namespace {

constexpr std::size_t column_alignment = 64;
constexpr double highest_energy = 1e300;  // J: what overflows reads as this; sums of a few stay finite

/// As static_cast does, without its long division of the usual case.
double to_double(Int128 x) noexcept {
  const auto low = static_cast<std::int64_t>(x);
  return low == x ? static_cast<double>(low) : static_cast<double>(x);
}

double to_lengths(std::int64_t fixed) noexcept { return static_cast<double>(fixed) * length_per_fixed; }

/// Weight times fixed-point displacement of the tail, rounded: a function of state alone.
Int128 weighted(double count, std::int64_t fixed) noexcept {
  const double x = count * static_cast<double>(fixed);
  if (std::abs(x) < 9e18) return std::llrint(x);
  return static_cast<Int128>(x);  // whole at this size
}

/// Bristles that the tail block counts for.
double tail_weight(const PatchState& p) noexcept {
  const double fraction = p.is_double() ? p.fraction : static_cast<double>(static_cast<float>(p.fraction));
  return static_cast<double>(p.whole - p.full_blocks() * block_size) + fraction;
}

/// Columns of bristles [from, to) of one block read "out of contact" again.
template <class T>
void forget_typed(PatchState& p, std::uint32_t from, std::uint32_t to) noexcept {
  if (p.draw == nullptr) return;  // keep: the length never changed
  auto* delta = static_cast<T*>(p.delta);
  const auto* first = static_cast<const T*>(p.first);
  for (std::uint32_t i = from; i < to; ++i) delta[i] = first[i];
}

/// Shortest first snap length of block b, scaled, rounded down.
template <class T>
float shortest_first(const PatchState& p, std::uint32_t b) noexcept {
  const auto* first = static_cast<const T*>(p.first);
  const std::uint32_t end = std::min((b + 1) * block_size, p.bristles);
  const T least = *std::min_element(first + b * block_size, first + end);
  return static_cast<float>(least) * (1.0f - 1e-6f);
}

/// First snap lengths of the patch's seed, and what blocks know of them. Neither throws nor allocates.
template <class T>
void fill_first(PatchState& p) noexcept {
  fill_first_lengths(*p.material, p.options.sampling, p.options.seed,
                     Span<T>(static_cast<T*>(p.first), p.padded()));
  for (std::uint32_t b = 0; b < p.block_count; ++b) p.blocks[b].shortest = shortest_first<T>(p, b);
}

void fill_first_any(PatchState& p) noexcept {
  if (p.is_double())
    fill_first<double>(p);
  else
    fill_first<float>(p);
}

/// Columns of redraw as at the beginning: the first lengths, no draw made.
void begin_draws(PatchState& p) noexcept {
  if (p.draw == nullptr) return;
  std::memcpy(p.delta, p.first, p.padded() * (p.is_double() ? sizeof(double) : sizeof(float)));
  fill_draw_states(p.options.seed, Span<std::uint32_t>(p.draw, p.padded()));
}

template <class T>
void scale_bristle(PatchState& p, std::uint32_t i, double factor) noexcept {
  auto* zx = static_cast<T*>(p.zx);
  auto* zy = static_cast<T*>(p.zy);
  zx[i] = static_cast<T>(static_cast<double>(zx[i]) * factor);
  if (zy != nullptr) zy[i] = static_cast<T>(static_cast<double>(zy[i]) * factor);
}

void scale_any(PatchState& p, std::uint32_t i, double factor) noexcept {
  if (p.is_double())
    scale_bristle<double>(p, i, factor);
  else
    scale_bristle<float>(p, i, factor);
}

/// Fewer bristles: the last leave with their energy, the new last one counts by its fraction.
double shed_contacts(PatchState& p, std::uint32_t whole, double fraction, bool energy) noexcept {
  const std::uint32_t old_blocks = p.active_blocks();
  const std::uint32_t old_full = p.full_blocks();
  const std::uint32_t old_contact = p.in_contact();
  const std::uint32_t edge = whole / block_size;  // the block in which the contact ends
  double squares = 0.0;
  if (energy)
    for (std::uint32_t b = edge; b < old_blocks; ++b) squares += p.block_squares(b);
  for (std::uint32_t b = edge; b < old_full; ++b) p.book_block(b, -1);

  // Written down under the old count first, so that displacement and stored deflection are one.
  if (edge < old_blocks) p.rewrite_block(edge);
  p.whole = whole;
  p.fraction = fraction;
  const bool edge_stays = p.in_contact() > edge * block_size;
  for (std::uint32_t b = edge_stays ? edge + 1 : edge; b < old_blocks; ++b) p.enter_block(b);
  if (edge_stays) {
    p.forget_bristles(p.in_contact(), std::min(old_contact, (edge + 1) * block_size));
    p.rewrite_block(edge);
    if (energy) squares -= p.block_squares(edge);
  }
  return squares;
}

/// More bristles: the last one's deflection shrinks as its weight grows, so that no force changes; new
/// ones start straight.
double admit_contacts(PatchState& p, std::uint32_t whole, double fraction, bool energy) noexcept {
  const std::uint32_t old_blocks = p.active_blocks();
  const std::uint32_t old_full = p.full_blocks();
  const bool had_tail = p.has_tail();
  double squares = 0.0;
  if (had_tail) {
    const std::uint32_t edge = old_full;
    p.rewrite_block(edge);
    if (energy) squares = p.block_squares(edge);
    if (p.fraction > 0.0) scale_any(p, p.whole, p.fraction / (whole > p.whole ? 1.0 : fraction));
  }
  p.whole = whole;
  p.fraction = fraction;
  if (had_tail) {
    p.rewrite_block(old_full);
    if (energy) squares -= p.block_squares(old_full);
  }
  for (std::uint32_t b = old_blocks; b < p.active_blocks(); ++b) p.enter_block(b);
  for (std::uint32_t b = old_full; b < p.full_blocks(); ++b) p.book_block(b, +1);
  return squares;
}

/// Scales every deflection (load above the maximum rising further).
void scale_all(PatchState& p, double factor) noexcept {
  const std::uint32_t blocks = p.active_blocks();
  for (std::uint32_t b = 0; b < blocks; ++b) {
    const bool full = b < p.full_blocks();
    if (full) p.book_block(b, -1);
    p.rewrite_block(b);
    const std::uint32_t end = std::min((b + 1) * block_size, p.in_contact());
    for (std::uint32_t i = b * block_size; i < end; ++i) scale_any(p, i, factor);
    p.rewrite_block(b);
    if (full) p.book_block(b, +1);
  }
}

double all_squares(const PatchState& p) noexcept {
  double squares = 0.0;
  for (std::uint32_t b = 0; b < p.active_blocks(); ++b) squares += p.block_squares(b);
  return squares;
}

/// Unit in which the sum of delta^2 of a block's snaps fits 62 bits with room, as a power of two.
double energy_unit(double length, double longest, bool literal) noexcept {
  // The literal rule squares what a bristle reached before it was reset.
  const double path = length + 2.0 * longest;
  const double most = 4.0 * block_size * path * (literal ? path : longest);
  int exponent = 0;
  std::frexp(most, &exponent);
  return std::ldexp(1.0, std::clamp(61 - exponent, -1020, 60));
}

}  // namespace

void PatchState::Free::operator()(std::byte* memory) const noexcept {
  ::operator delete[](memory, std::align_val_t{column_alignment});
}

template <>
const KernelSet<float>& PatchState::set<float>() const noexcept {
  return kernels->f32;
}
template <>
const KernelSet<double>& PatchState::set<double>() const noexcept {
  return kernels->f64;
}

void PatchState::rewrite_block(std::uint32_t b) noexcept {
  if (is_double())
    set<double>().rewrite(view<double>(), b, position);
  else
    set<float>().rewrite(view<float>(), b, position);
}

void PatchState::enter_block(std::uint32_t b) noexcept {
  Block& block = blocks[b];
  block.zero = 1;
  // Straight bristles hold until the shortest of them is reached.
  block.reach = block.shortest * (1.0f - 1e-5f);
  for (int axis = 0; axis < 2; ++axis) {
    block.position[axis] = block.anchor[axis] = position[axis];
    block.stored[axis] = 0;
  }
}

void PatchState::book_block(std::uint32_t b, int sign) noexcept {
  for (int axis = 0; axis < 2; ++axis) {
    stored[axis] += sign * static_cast<Int128>(blocks[b].stored[axis]);
    offset[axis] += sign * static_cast<Int128>(difference(position[axis], blocks[b].position[axis]));
  }
}

double PatchState::moved_since(const Block& block, int axis) const noexcept {
  return to_lengths(difference(position[axis], block.position[axis]));
}

double PatchState::deflection_sum(int axis) const noexcept {
  Int128 sum = stored[axis] + Int128{block_size} * offset[axis];
  if (has_tail()) {
    const Block& tail = blocks[full_blocks()];
    sum += tail.stored[axis] + weighted(tail_weight(*this), difference(position[axis], tail.position[axis]));
  }
  return to_double(sum) * length_per_fixed;
}

double PatchState::joules_per_square() const noexcept {
  const CompiledMaterial& m = *material;
  return 0.5 * m.material.bristle_stiffness * weight * overload * m.metres_per_length * m.metres_per_length;
}

void PatchState::forget_bristles(std::uint32_t from, std::uint32_t to) noexcept {
  if (is_double())
    forget_typed<double>(*this, from, to);
  else
    forget_typed<float>(*this, from, to);
}

void PatchState::forget_upper_bounds() noexcept {
  bound.reach = -1.0;
  for (std::uint32_t g = 0; g < group_count; ++g) groups[g].reach = -1.0;
}

void PatchState::forget_bounds() noexcept {
  for (std::uint32_t b = 0; b < block_count; ++b) blocks[b].reach = -1.0f;
  forget_upper_bounds();
}

double PatchState::block_squares(std::uint32_t b) const noexcept {
  return is_double() ? set<double>().squares(view<double>(), b, position)
                     : set<float>().squares(view<float>(), b, position);
}

std::unique_ptr<PatchState> make_patch(std::shared_ptr<const CompiledMaterial> material,
                                       const PatchOptions& options, const KernelTable& kernels,
                                       double weight) {
  constexpr const char* where = "PatchOptions";
  require_within(where, "max_normal_load", options.max_normal_load, 1e-15, highest_load, "N");
  if (options.axes != 1 && options.axes != 2) refuse(where, "axes", options.axes, "1 or 2");
  if (options.bristles > max_bristles_per_patch)
    refuse(where, "bristles", options.bristles, "0 (automatic) to 67108864");
  auto patch = std::make_unique<PatchState>();
  PatchState& p = *patch;
  p.options = options;
  p.material = std::move(material);
  p.kernels = &kernels;
  const Material& m = p.material->material;

  const double zeta_max = m.bristles_in_contact(options.max_normal_load);
  p.bristles = options.bristles;
  if (p.bristles == 0) p.bristles = static_cast<std::uint32_t>(std::clamp(std::ceil(zeta_max), 1.0, 4096.0));
  p.options.bristles = p.bristles;
  p.first_seed = options.seed;
  p.full_weight = p.weight = weight > 0.0 ? weight : zeta_max / p.bristles;
  p.detail = p.bristles;

  const bool literal = options.step_rule == StepRule::literal;
  const bool redraw = p.material->redraw;
  const Rule rule =
      literal ? (redraw ? rule_literal_redraw : rule_literal_keep) : (redraw ? rule_redraw : rule_keep);
  p.variant = variant_index(options.axes, rule, !literal && has(options.outputs, Outputs::mean),
                            literal || has(options.outputs, Outputs::energy));
  const bool built =
      p.is_double() ? kernels.f64.step[p.variant] != nullptr : kernels.f32.step[p.variant] != nullptr;
  if (!built)
    throw Error(
        "PatchOptions: this build of bristle has no kernel for the features asked for; build it with "
        "BRISTLE_MINIMAL=OFF" +
        std::string(p.is_double() ? " and BRISTLE_WITH_DOUBLE=ON" : ""));

  // One allocation: blocks and groups first, then the columns this variant needs, rows padded to 16.
  const std::size_t rows = p.padded();
  const std::size_t number = p.is_double() ? sizeof(double) : sizeof(float);
  p.block_count = static_cast<std::uint32_t>((rows + block_size - 1) / block_size);
  p.group_count = (p.block_count + blocks_per_group - 1) / blocks_per_group;
  std::size_t size = 0;
  const auto reserve = [&size](std::size_t bytes) {
    const std::size_t at = size;
    size += (bytes + column_alignment - 1) / column_alignment * column_alignment;
    return at;
  };
  const std::size_t blocks_at = reserve(p.block_count * sizeof(Block));
  const std::size_t groups_at = reserve(p.group_count * sizeof(Reach));
  const std::size_t zx_at = reserve(rows * number);
  const std::size_t zy_at = options.axes == 2 ? reserve(rows * number) : 0;
  const std::size_t delta_at = reserve(rows * number);
  const std::size_t first_at = redraw ? reserve(rows * number) : delta_at;
  const std::size_t draw_at = redraw ? reserve(rows * sizeof(std::uint32_t)) : 0;
  p.storage.reset(static_cast<std::byte*>(::operator new[](size, std::align_val_t{column_alignment})));
  p.storage_bytes = size;
  std::byte* base = p.storage.get();
  std::memset(base, 0, size);
  p.blocks = reinterpret_cast<Block*>(base + blocks_at);
  p.groups = reinterpret_cast<Reach*>(base + groups_at);
  p.zx = base + zx_at;
  p.zy = options.axes == 2 ? base + zy_at : nullptr;
  p.delta = base + delta_at;
  p.first = base + first_at;
  p.draw = redraw ? reinterpret_cast<std::uint32_t*>(base + draw_at) : nullptr;

  fill_first_any(p);
  begin_draws(p);
  for (std::uint32_t b = 0; b < p.block_count; ++b) p.enter_block(b);
  p.forget_upper_bounds();
  return patch;
}

void change_seed(PatchState& p, std::uint32_t seed) noexcept {
  if (p.options.seed == seed) return;
  p.options.seed = seed;
  fill_first_any(p);
}

ContactCount count_contacts(double zeta, double weight, std::uint32_t detail) noexcept {
  double active = zeta / weight;
  const double all = detail;
  double overload = 1.0;
  // The maximum itself is no overload, whatever rounding made of zeta / w.
  if (active > all * (1.0 + 1e-14)) overload = active / all;
  active = std::min(active, all);
  const double whole = std::floor(active);
  double fraction = active - whole;
  if (fraction < 1e-30) fraction = 0.0;  // below what a float weight can be
  return {active, overload, fraction, static_cast<std::uint32_t>(whole)};
}

void reset_patch(PatchState& p, std::uint32_t seed, std::uint64_t key) noexcept {
  static_cast<PatchContact&>(p) = PatchContact{};
  p.weight = p.full_weight;
  p.detail = p.bristles;
  p.options.key = key;
  change_seed(p, seed);
  begin_draws(p);
  const std::size_t bytes = p.padded() * (p.is_double() ? sizeof(double) : sizeof(float));
  std::memset(p.zx, 0, bytes);
  if (p.zy != nullptr) std::memset(p.zy, 0, bytes);
  for (std::uint32_t b = 0; b < p.block_count; ++b) p.enter_block(b);
  p.forget_upper_bounds();
  p.tracks = true;
}

double apply_load(PatchState& p, double normal_load_n) noexcept {
  if (normal_load_n == p.normal_load) return 0.0;
  const bool energy = has(p.options.outputs, Outputs::energy);
  p.normal_load = normal_load_n;
  p.zeta = p.material->material.bristles_in_contact(normal_load_n);
  const auto [active, overload, fraction, whole] = count_contacts(p.zeta, p.weight, p.detail);

  if (active != p.active || overload != p.overload) p.forget_upper_bounds();
  const double joules = p.joules_per_square();
  double loss = 0.0;
  if (active < p.active)
    loss = joules * shed_contacts(p, whole, fraction, energy);
  else if (active > p.active)
    loss = joules * admit_contacts(p, whole, fraction, energy);
  p.active = active;
  if (overload != p.overload) {
    const double before = energy ? p.joules_per_square() * all_squares(p) : 0.0;
    if (overload > p.overload) scale_all(p, p.overload / overload);
    p.overload = overload;
    if (energy) loss += before - p.joules_per_square() * all_squares(p);
  }
  return loss;
}

bool is_good_motion(const PatchState& patch, const Motion& motion) noexcept {
  const bool finite = std::isfinite(motion.displacement[0]) && std::isfinite(motion.displacement[1]) &&
                      motion.normal_load >= 0.0 && motion.normal_load <= highest_load;
  if (!finite) return false;
  // A motion along an axis that the patch lacks would be lost without a word.
  const bool planar = patch.options.axes == 1;
  if (planar && motion.displacement[1] != 0.0) return false;
  if (motion.has_velocity)
    return std::isfinite(motion.velocity[0]) && std::isfinite(motion.velocity[1]) &&
           !(planar && motion.velocity[1] != 0.0);
  return true;
}

PatchStep begin_step(PatchState& p, const Motion& motion, double dt_s, bool commit) noexcept {
  PatchStep step{};
  if (commit) step.contact_loss = apply_load(p, motion.normal_load);
  for (int axis = 0; axis < 2; ++axis) {
    step.displacement[axis] = motion.displacement[axis];
    // Clamped so that its square is finite, whatever the step length (a denormal one reads as 0 here).
    const double v =
        motion.has_velocity ? motion.velocity[axis] : motion.displacement[axis] / std::max(dt_s, 1e-300);
    step.velocity[axis] = std::clamp(v, -1e150, 1e150);
  }
  const CompiledMaterial& m = *p.material;
  Advance& a = step.advance;
  a.commit = commit ? 1 : 0;
  for (int axis = 0; axis < 2; ++axis) a.from[axis] = a.to[axis] = p.position[axis];

  // Clamped so that squares and sums stay finite: no snap length is near.
  constexpr double farthest = 1e290;
  double d[2];
  for (int axis = 0; axis < 2; ++axis)
    d[axis] = std::clamp(motion.displacement[axis] * m.lengths_per_metre, -farthest, farthest);
  const bool literal = p.options.step_rule == StepRule::literal;
  const double largest = std::max(std::abs(d[0]), std::abs(d[1]));
  if (literal && largest > far_length) {
    // The literal rule forgets how far it went: this far already resets every bristle.
    for (double& x : d) x *= far_length / largest;
  } else if (largest > far_length) {
    const double rx = d[0] / largest;
    const double ry = d[1] / largest;
    const double norm = std::sqrt(rx * rx + ry * ry);
    a.direction[0] = rx / norm;
    a.direction[1] = ry / norm;
    a.length = largest * norm;
    a.all = 1;
    // Redraw that ends in law needs no remainder: float holds the step as long as its square.
    a.far = p.draw == nullptr || m.law.stationary_from > far_length || a.length > 0x1p60 ? 1 : 0;
    Hasher hasher;
    hasher.add(d[0]);
    hasher.add(d[1]);
    // The state too: equal steps must not repeat themselves, nor patches one another.
    hasher.add(std::uint64_t{p.options.seed});
    for (int axis = 0; axis < 2; ++axis) {
      hasher.add(static_cast<std::uint64_t>(p.stored[axis]));
      hasher.add(static_cast<std::uint64_t>(p.blocks[0].stored[axis]));
    }
    a.phase_key = hasher.value();
    step.moves = true;
  }
  if (!a.all && largest > 0.0) {
    double moved[2];
    for (int axis = 0; axis < 2; ++axis) {
      const std::int64_t fixed = std::llrint(d[axis] * fixed_per_length);
      a.to[axis] = static_cast<std::int64_t>(static_cast<std::uint64_t>(p.position[axis]) +
                                             static_cast<std::uint64_t>(fixed));
      moved[axis] = to_lengths(fixed);
    }
    a.length = std::sqrt(moved[0] * moved[0] + moved[1] * moved[1]);
    step.moves = a.length > 0.0;
    if (step.moves) {
      a.direction[0] = moved[0] / a.length;
      a.direction[1] = moved[1] / a.length;
    }
    if (m.in_phase && !p.is_double() && !literal) a.far = 1;
  }
  a.energy_unit = 1.0;
  if (step.moves && (literal || has(p.options.outputs, Outputs::energy)))
    a.energy_unit = energy_unit(a.length, m.longest, literal);
  a.skip = p.skips && !a.all ? 1 : 0;
  a.track = a.skip && p.tracks ? 1 : 0;
  return step;
}

bool holds_still(const PatchState& p, const PatchStep& step) noexcept {
  if (p.bound.reach < 0.0 || !step.advance.skip) return false;
  const double x = to_lengths(difference(step.advance.to[0], p.bound.anchor[0]));
  const double y = to_lengths(difference(step.advance.to[1], p.bound.anchor[1]));
  return std::sqrt(x * x + y * y) < p.bound.reach;
}

void run_blocks(const PatchState& p, const PatchStep& step, std::uint32_t first, std::uint32_t last,
                Totals& totals) noexcept {
  if (p.is_double())
    p.set<double>().step[p.variant](p.view<double>(), step.advance, first, last, totals);
  else
    p.set<float>().step[p.variant](p.view<float>(), step.advance, first, last, totals);
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

namespace {

/// After a step that visited blocks: how far the patch may go before one must be visited again.
void renew_bound(PatchState& p, const Totals& t) noexcept {
  // Bounds cost a square root per bristle: at a fortieth of the blocks rewritten they saved nearly all
  // visits, at a quarter they cost more than they saved.
  if (t.blocks_visited > 0) p.tracks = 8 * t.blocks_rewritten < p.active_blocks();
  const std::uint32_t groups = (p.active_blocks() + blocks_per_group - 1) / blocks_per_group;
  double reach = 1e300;
  for (std::uint32_t g = 0; g < groups && reach >= 0.0; ++g) {
    if (p.groups[g].reach < 0.0) {
      reach = -1.0;
      break;
    }
    const double x = to_lengths(difference(p.position[0], p.groups[g].anchor[0]));
    const double y = to_lengths(difference(p.position[1], p.groups[g].anchor[1]));
    reach = std::min(reach, p.groups[g].reach - std::sqrt(x * x + y * y));
  }
  p.bound.reach = reach;
  p.bound.anchor[0] = p.position[0];
  p.bound.anchor[1] = p.position[1];
}

/// Damper and lubricant of the whole patch at the step's velocity, N s/m.
double find_damping(const PatchState& p, const PatchStep& step) noexcept {
  const Material& m = p.material->material;
  if (m.bristle_damping == 0.0) return m.viscous_friction;
  const double speed = std::sqrt(step.velocity[0] * step.velocity[0] + step.velocity[1] * step.velocity[1]);
  return p.zeta * m.damping_at(speed) + m.viscous_friction;
}

}  // namespace

void finish_step(PatchState& p, const PatchStep& step, const Totals& t, Response& out) noexcept {
  const CompiledMaterial& m = *p.material;
  const Advance& a = step.advance;
  const bool literal = p.options.step_rule == StepRule::literal;
  const bool mean = has(p.options.outputs, Outputs::mean);
  const bool energy = has(p.options.outputs, Outputs::energy);
  const Int128 full = p.full_blocks();
  const bool has_tail = p.has_tail();
  const double tail_count = has_tail ? tail_weight(p) : 0.0;

  // Sums of deflections at the end of the step and, twice, over the step; fixed point, exact. An axis at a
  // time, so that its 128-bit sums stay in registers.
  double end_sum[2] = {0.0, 0.0};
  double twice_mean_sum[2] = {0.0, 0.0};
  for (int axis = 0; axis < p.options.axes; ++axis) {
    const std::int64_t moved = difference(a.to[axis], a.from[axis]);
    const Int128 offset = p.offset[axis] + full * moved + t.offset[axis];
    const Int128 stored = p.stored[axis] + t.stored[axis];
    Int128 end = stored + Int128{block_size} * offset;
    Int128 twice_mean = 0;
    if (mean)
      twice_mean =
          2 * p.stored[axis] + Int128{block_size} * (2 * p.offset[axis] + full * moved) + t.twice_mean[axis];
    if (has_tail && t.tail_snapped) {
      end += t.tail_stored[axis];
      twice_mean += t.tail_twice_mean[axis];
    } else if (has_tail) {
      const Block& tail = p.blocks[p.full_blocks()];
      const Int128 p1 = weighted(tail_count, difference(a.to[axis], tail.position[axis]));
      end += tail.stored[axis] + p1;
      if (mean)
        twice_mean += 2 * static_cast<Int128>(tail.stored[axis]) +
                      weighted(tail_count, difference(a.from[axis], tail.position[axis])) + p1;
    }
    end_sum[axis] = to_double(end);
    twice_mean_sum[axis] = to_double(twice_mean);
    if (a.commit) {
      p.stored[axis] = stored;
      p.offset[axis] = offset;
      p.position[axis] = a.to[axis];
    }
  }

  if (a.commit && step.ran) renew_bound(p, t);

  const double newtons_per_length =
      m.material.bristle_stiffness * p.weight * p.overload * m.metres_per_length * length_per_fixed;
  const double damping = p.normal_load > 0.0 ? find_damping(p, step) : 0.0;

  out.status = p.overload > 1.0 ? Status::overload : Status::ok;
  double work = 0.0;
  for (int axis = 0; axis < 2; ++axis) {
    // 0 - x: no negative zero for a patch at rest.
    out.damper[axis] = 0.0 - damping * step.velocity[axis];
    out.elastic[axis] = 0.0 - newtons_per_length * end_sum[axis];
    out.end[axis] = out.elastic[axis] + out.damper[axis];
    if (mean)
      out.mean[axis] =
          literal ? out.end[axis] : 0.0 - 0.5 * newtons_per_length * twice_mean_sum[axis] + out.damper[axis];
    work -= std::clamp(out.damper[axis] * step.displacement[axis], -highest_energy, highest_energy);
  }
  out.stiffness = p.zeta * m.material.bristle_stiffness;
  out.damping = damping;
  out.force_limit = m.peak_coefficient * p.normal_load;
  if (energy) {
    const double joules = p.joules_per_square();
    out.dissipated =
        std::min(joules * (to_double(t.squares) / a.energy_unit), highest_energy) + p.pending_dissipated;
    out.contact_loss = step.contact_loss + p.pending_loss;
    out.damper_work = work;
    out.snaps = t.snaps + p.pending_snaps;
  }
  if (a.commit) {
    p.pending_dissipated = p.pending_loss = 0.0;
    p.pending_snaps = 0;
  }
}

void find_block_sums(PatchState& p) noexcept {
  for (int axis = 0; axis < 2; ++axis) p.stored[axis] = p.offset[axis] = 0;
  for (std::uint32_t b = 0; b < p.block_count; ++b) {
    if (b >= p.active_blocks()) p.enter_block(b);
    if (b < p.active_blocks()) p.blocks[b].zero = 0;
    if (b < p.full_blocks()) p.book_block(b, +1);
  }
}

void copy_patch(const PatchState& from, PatchState& to) noexcept {
  // Everything but the storage, then the columns, then the pointers into them.
  auto storage = std::move(to.storage);
  const std::size_t capacity = to.storage_bytes;
  to.options = from.options;
  // Not owned: the copy must not be the one to free a material, on the stepping thread.
  to.material = {std::shared_ptr<const void>(), from.material.get()};
  to.full_weight = from.full_weight;
  to.bristles = from.bristles;
  to.block_count = from.block_count;
  to.group_count = from.group_count;
  to.variant = from.variant;
  to.kernels = from.kernels;
  static_cast<PatchContact&>(to) = from;
  to.skips = from.skips;
  to.tracks = from.tracks;
  to.bound = from.bound;
  std::memcpy(storage.get(), from.storage.get(), std::min(from.storage_bytes, capacity));
  std::byte* const base = storage.get();
  const std::byte* const old = from.storage.get();
  const auto moved = [base, old](auto* pointer) -> decltype(pointer) {
    if (pointer == nullptr) return nullptr;
    return reinterpret_cast<decltype(pointer)>(base + (reinterpret_cast<const std::byte*>(pointer) - old));
  };
  to.zx = base + (static_cast<const std::byte*>(from.zx) - old);
  to.zy = from.zy == nullptr ? nullptr : base + (static_cast<const std::byte*>(from.zy) - old);
  to.delta = base + (static_cast<const std::byte*>(from.delta) - old);
  to.first = base + (static_cast<const std::byte*>(from.first) - old);
  to.draw = moved(from.draw);
  to.blocks = moved(from.blocks);
  to.groups = moved(from.groups);
  to.storage = std::move(storage);
  to.storage_bytes = capacity;
}

namespace {

template <class T>
void take_over_columns(PatchState& to, PatchState& from, bool same_law) noexcept {
  const double ratio = from.material->metres_per_length * to.material->lengths_per_metre;  // power of two
  auto* zx = static_cast<T*>(to.zx);
  auto* zy = static_cast<T*>(to.zy);
  auto* delta = static_cast<T*>(to.delta);
  const auto* old_x = static_cast<const T*>(from.zx);
  const auto* old_y = static_cast<const T*>(from.zy);
  const auto* old_delta = static_cast<const T*>(from.delta);
  const std::uint32_t contact = from.in_contact();
  const double joules = to.joules_per_square();
  for (std::uint32_t i = 0; i < contact; ++i) {
    zx[i] = static_cast<T>(static_cast<double>(old_x[i]) * ratio);
    if (zy != nullptr) zy[i] = static_cast<T>(static_cast<double>(old_y[i]) * ratio);
    if (same_law && to.draw != nullptr && from.draw != nullptr) delta[i] = old_delta[i];
    const double x = static_cast<double>(zx[i]);
    const double y = zy == nullptr ? 0.0 : static_cast<double>(zy[i]);
    const auto limit = static_cast<double>(delta[i]);
    if (x * x + y * y > limit * limit) {
      const double w = i < from.whole ? 1.0 : from.fraction;
      zx[i] = T(0);
      if (zy != nullptr) zy[i] = T(0);
      to.pending_dissipated += joules * w * (x * x + y * y);
      ++to.pending_snaps;
    }
  }
}

}  // namespace

void take_over(PatchState& to, PatchState& from) noexcept {
  // A patch that was reset since: its bristles are those of its own seed.
  to.options.key = from.options.key;
  if (to.options.seed != from.options.seed) {
    change_seed(to, from.options.seed);
    begin_draws(to);
  }
  for (std::uint32_t b = 0; b < from.active_blocks(); ++b) from.rewrite_block(b);
  const bool same_law = to.material->material.snap_length == from.material->material.snap_length;
  to.pending_snaps = from.pending_snaps;
  to.pending_dissipated = from.pending_dissipated;
  to.pending_loss = from.pending_loss;
  to.overload = from.overload;
  to.weight = from.weight;
  to.detail = from.detail;
  if (to.is_double())
    take_over_columns<double>(to, from, same_law);
  else
    take_over_columns<float>(to, from, same_law);
  if (to.draw != nullptr && from.draw != nullptr)
    std::memcpy(to.draw, from.draw, std::size_t{from.bristles} * sizeof(std::uint32_t));
  to.whole = from.whole;
  to.fraction = from.fraction;
  to.active = from.active;
  to.last_step = from.last_step;
  to.skips = from.skips;
  for (std::uint32_t b = 0; b < to.active_blocks(); ++b) {
    to.blocks[b].zero = 0;
    to.rewrite_block(b);
    if (b < to.full_blocks()) to.book_block(b, +1);
  }
  // The same load may now mean another number of bristles.
  const double load = from.normal_load;
  to.normal_load = -1.0;
  to.pending_loss += apply_load(to, load);
}

double find_stored_energy(const PatchState& p) noexcept { return p.joules_per_square() * all_squares(p); }

namespace {

template <class T>
void read_typed(const PatchState& p, std::size_t count, Span<double> zx, Span<double> zy,
                Span<double> delta) noexcept {
  const double metres = p.material->metres_per_length;
  const std::uint32_t contact = p.in_contact();
  const T* const columns[2] = {static_cast<const T*>(p.zx), static_cast<const T*>(p.zy)};
  const Span<double> wanted[2] = {zx, zy};
  for (std::size_t i = 0; i < count; ++i) {
    const Block& block = p.blocks[i / block_size];
    const bool in = i < contact;
    for (int axis = 0; axis < 2; ++axis) {
      if (wanted[axis].empty()) continue;
      const T* z = columns[axis];
      const double stored = z == nullptr || block.zero ? 0.0 : static_cast<double>(z[i]);
      const double moved = p.moved_since(block, axis);
      wanted[axis][i] = in ? (stored + moved) * metres : 0.0;
    }
    if (!delta.empty()) {
      const auto* lengths = static_cast<const T*>(in && !block.zero ? p.delta : p.first);
      delta[i] = static_cast<double>(lengths[i]) * metres;
    }
  }
}

}  // namespace

void read_columns(const PatchState& p, std::size_t count, Span<double> zx, Span<double> zy,
                  Span<double> delta) noexcept {
  if (p.is_double())
    read_typed<double>(p, count, zx, zy, delta);
  else
    read_typed<float>(p, count, zx, zy, delta);
}

void write_refusal(const PatchOptions* options, Status status, Response& out) noexcept {
  out.status = status;
  for (int axis = 0; axis < 2; ++axis) {
    out.end[axis] = out.elastic[axis] = out.damper[axis] = 0.0;
    if (options == nullptr || has(options->outputs, Outputs::mean)) out.mean[axis] = 0.0;
  }
  out.stiffness = out.damping = out.force_limit = 0.0;
  if (options == nullptr || has(options->outputs, Outputs::energy)) {
    out.dissipated = out.contact_loss = out.damper_work = 0.0;
    out.snaps = 0;
  }
}

}  // namespace bristle::detail
