// The one interface between core and kernels: plain structs of raw pointers and a table of functions. Core
// includes this header and gets a table; kernels include it and fill one table for each instruction set.
// Nothing here needs the standard library, because an inline function shared between objects compiled for
// different instruction sets could bring wide instructions to a machine without them.
// Lengths inside kernels are *scaled*: divided by a power of two near the mean snap length (core/MODEL.md,
// section 9). Positions of a patch and sums over a block are fixed point, in units of 2^-44 scaled lengths.
// Sums over blocks are then exact integers, so that neither the order of blocks, nor the number of workers,
// nor whether a block was visited can change a bit.
#pragma once

#include <cstdint>

namespace bristle::detail {

__extension__ typedef __int128 Int128;

constexpr std::uint32_t block_size = 256;  ///< bristles of a block: 16 rows of 16 logical lanes
constexpr std::uint32_t lane_count = 16;   ///< logical lanes of a row, on every instruction set
constexpr std::uint32_t blocks_per_group = 64;
constexpr double fixed_per_length = 17592186044416.0;  ///< 2^44 fixed-point units per scaled length
constexpr double length_per_fixed = 1.0 / fixed_per_length;
/// Length of a step, scaled, above which it is called far. Every bristle snaps in a far step, and single
/// precision cannot represent the path left after its last snap.
constexpr double far_length = 4096.0;
/// Longest snap length, scaled: 1024 mean lengths of at most 1.415. A far step is more than twice as long, so
/// without ageing it snaps every bristle from any deflection.
constexpr double longest_scaled_length = 1449.0;
static_assert(far_length > 2.0 * longest_scaled_length);

/// Difference of successive random states of a bristle. It is odd, so a bristle passes through all 2^32
/// states.
constexpr std::uint32_t random_stride = 0x9E3779B9u;

/// State of 256 bristles whose stored deflections are rewritten together. The struct is one cache line.
struct alignas(64) Block {
  std::int64_t position[2];  ///< position of the patch at the last rewrite of this block, fixed point
  std::int64_t stored[2];    ///< sum of weight x stored deflection over the block, fixed point

  // Bound on snapping: no bristle of the block snaps while the patch stays within `reach` of `anchor`
  // (core/MODEL.md, section 10). A cache, not part of the state, and cleared when a state is restored. A
  // block of unknown reach is visited in every step.
  std::int64_t anchor[2];
  float reach;  ///< path from `anchor` within which no bristle snaps, scaled; 0 = unknown
  /// Least deflection at which a bristle of the block snaps first, scaled. It is the reach of a block without
  /// deflections.
  float shortest;
  /// 1 = all deflections of the block are zero. Its columns z and (redraw) delta then contain no valid
  /// numbers, so that a new contact need not write them.
  std::uint32_t zero;
};

/// Bound on snapping of a group of 64 blocks, or of the whole patch, as Block::reach is for one block.
struct Reach {
  std::int64_t anchor[2];
  double reach;  ///< path from `anchor` within which no bristle slides or snaps, scaled; none if not above 0
};

/// Families of snap-length laws, by KernelLaw::kind.
enum LawKind : std::int32_t { law_uniform, law_normal, law_lognormal, law_exponential, law_table };

/// Law of the snap length in scaled lengths, from which kernels sample for SnapRule::redraw. Built by
/// core/materials/kernel_law.cpp.
struct KernelLaw {
  std::int32_t kind;
  double location;           ///< uniform: lowest length. exponential: mean. (Other laws use `table`.)
  double scale;              ///< uniform: width of the range
  double shortest, longest;  ///< ends of the range to which every sampled length is clamped

  // Parameters of the length-biased law, which favours lengths in proportion to themselves; jumps to steady
  // sliding sample from it. Uniform law on [a, b]: a^2 and b^2 - a^2. Exponential law: the mean.
  double biased_location, biased_scale;
  /// Quantiles at the probabilities k / table_last (law_table), or lines in cells between quantiles
  /// (kernels/cells.hpp).
  const double* table;
  /// Quantiles of the length-biased law (normal, table), or lines in cells between them (lognormal).
  const double* biased_table;
  std::int32_t table_last, biased_last;

  // Constants of the sum of delta^2 over the snaps that a bristle jumps over, from which the dissipated
  // energy follows, by renewal-reward theory (core/MODEL.md, "Jumps"). m1 and m2 stand for E[delta] and
  // E[delta^2].
  double mean;                                  ///< m1
  double inverse_mean;                          ///< 1 / m1
  double squares_per_length;                    ///< m2 / m1: mean sum of delta^2 per distance jumped
  double squares_offset;                        ///< constant part of the sum of delta^2 over a jump's snaps
  double variance_per_length, variance_offset;  ///< variance of the sum of delta^2, given the distance jumped
  /// Squared coefficient of variation, cv^2. The expected number of snaps in a jump over the distance D is D
  /// / m1 + cv^2.
  double count_offset;

  // Constants for jumping over k snaps at once under a law of small spread, by a Cornish-Fisher expansion.
  double jump_from;           ///< path left in a step above which a bristle jumps over snaps
  double stationary_from;     ///< path left above which a jump ends in steady sliding; >= jump_from
  double deviation;           ///< standard deviation of the snap length delta
  double skewness, kurtosis;  ///< skewness and excess kurtosis of delta
  double square_mean;         ///< m2 = E[delta^2]
  /// Slope of the regression of delta^2 on delta: Cov(delta^2, delta) / Var(delta).
  double square_slope;
  /// Variance of delta^2 about its regression on delta: Var(delta^2) - square_slope^2 Var(delta).
  double square_residual;
};

/// Columns of the state of one patch, as kernels see them. Rows are padded to 16 bristles; padding has z = 0
/// and a valid delta, so that it may be computed with.
template <class T>
struct PatchView {
  T* zx;
  T* zy;  ///< deflections along y; null with one axis
  /// Deflection at which each bristle snaps: residual + snap length. Constant with SnapRule::keep.
  T* delta;
  std::uint32_t* random;  ///< states of the bristles' random numbers; null with SnapRule::keep
  /// Deflection at which each bristle snaps for the first time (with SnapRule::keep equal to delta).
  const T* first;
  Block* blocks;
  Reach* groups;
  std::uint32_t bristles;  ///< number of bristles allocated
  std::uint32_t whole;     ///< number of bristles that are fully in contact
  /// Weight of bristle number `whole`, the last in contact, which counts only in part; 0 = it is not in
  /// contact.
  T fraction;
  const KernelLaw* law;  ///< law of fresh snap lengths; null with SnapRule::keep

  // Columns for ageing, null without it. The present age of a bristle, in ageing times, is `age` + (now -
  // `since` of its block) / ageing_time.
  T* age;         ///< age at the last rewrite of the bristle's block, in units of Material::ageing_time
  double* since;  ///< time of the patch at the last rewrite of each block, s
};

/// Displacement of a patch in a step or in a piece of it: all that a step without snaps needs.
struct Travel {
  /// Position of the patch at the start and at the end, fixed point. In a far step both are equal, because
  /// its displacement does not fit.
  std::int64_t from[2], to[2];
  double direction[2];  ///< direction of the motion, a unit vector
  double length;        ///< length of the displacement, scaled, > 0
  /// Time of the patch (time_of()) at the beginning of the step, s; 0 without ageing.
  double start;
  double duration;  ///< duration of the step, s, > 0
  /// Time, s, by which the next step may seem to begin before the end of this one, because both times are
  /// rounded.
  double rounding;
  /// 1 for a far step, which is so long that every bristle snaps in it, except some that have aged. The
  /// position of the patch does not change in it.
  std::uint32_t snaps_all;
  std::uint32_t stores;  ///< 0 for a trial step (find_force), which leaves the state unchanged
};

/// Constants of one step of one patch, which all its blocks share.
struct KernelStep : Travel {
  double residual;  ///< deflection of a bristle after a snap, scaled; 0 without a residual
  /// Unit of Totals::squares: so many fixed-point units are one scaled length squared; a power of two.
  double energy_unit;
  /// Key of the random number that puts a bristle between two snaps, if the step is too long to compute its
  /// position.
  std::uint64_t phase_key;
  /// 1: the path left after a bristle's last snap is computed in double, because the step is long or the law
  /// is a single length.
  std::uint32_t in_double;
  std::uint32_t skips_blocks;  ///< 1: blocks whose bound is kept are not visited
  /// 1: bounds are recomputed also for visited blocks in which no bristle snapped, which saves later visits.
  std::uint32_t finds_bounds;

  // Constants of ageing, by which kernels compute ages. 0 where the material does not age:
  double ageing_rate;      ///< 1 / Material::ageing_time, 1/s
  double ageing_strength;  ///< strength of ageing, as Material::ageing_strength
  /// Ratio of aged to fresh snap length of the bristle that has been stuck longest, for long steps of
  /// SnapRule::redraw.
  double largest_growth;
  std::uint32_t ageing_form;  ///< form of ageing, 1: saturating, 0: logarithmic
};

/// Sums over the changed blocks of a range. They are integers, so the order of adding does not matter. Sums
/// of the last block (the tail) are kept apart, because the weight of its last bristle is a fraction.
struct Totals {
  Int128 stored[2];  ///< change of the sum of Block::stored, over full blocks
  /// Change, by rewriting blocks, of the sum over full blocks of Travel::to - Block::position. The sum over
  /// bristles changes by 256 times this.
  Int128 offset[2];
  /// Twice the mean deflection over the step, summed over full blocks with snaps, less its value if nothing
  /// had snapped: 2 stored + 256 (from + to - 2 position).
  Int128 twice_mean[2];
  /// Dissipated energy as a sum over snaps of weight x ((residual + delta)^2 - residual^2), in units of 1 /
  /// energy_unit.
  Int128 squares;
  std::uint64_t snaps;
  std::uint64_t visited;  ///< number of bristles visited
  std::uint32_t blocks_visited, blocks_rewritten;
  std::int64_t tail_stored[2];      ///< sum of deflections over the tail after the step, of a trial step too
  std::int64_t tail_twice_mean[2];  ///< twice the sum of the mean deflections of the tail over the step
  std::uint32_t tail_snapped;
};

/// Input for the renewals of a piece of path. Every snap of the piece renews some bristles, which are
/// selected at random before the blocks are stepped.
struct Renewal : KernelStep {
  std::uint64_t key;  ///< key of the patch's selections
  /// Number of the first selection, counted over the life of the patch. Equal numbers
  /// select equal bristles.
  std::uint64_t first_selection;
  std::uint64_t selections;
  double unit;  ///< fixed-point units of RenewalTotals::twice_integral and squares per scaled length squared
};

/// Corner in the path of a steady slide, round which bristles are dragged without being stepped
/// (core/patches/RUBBING.md).
struct Corner {
  std::int64_t at[2];   ///< position of the patch, fixed point; turning the bristles does not change it
  double direction[2];  ///< direction of the motion after the corner, a unit vector
  double before[2];     ///< direction of the motion before the corner, a unit vector
  double length;        ///< path along which the patch is dragged after the corner, scaled, > 0
  double residual;      ///< deflection of a bristle after a snap, scaled
  double unit;          ///< fixed-point units of RenewalTotals::twice_integral, as KernelStep::energy_unit
};

/// Changes that renewals make in a range of blocks. They are integers, as in Totals, so threads may share the
/// blocks.
struct RenewalTotals {
  Int128 stored[2];  ///< change of the sum of Block::stored, over full blocks
  /// Twice the path integral of weight x deflection, in 1 / unit: the part that the step kernels do not
  /// include.
  Int128 twice_integral[2];
  /// Energy of renewals as a sum of weight x (|z|^2 - residual^2) over the bristles that are renewed, and
  /// over their snaps before renewal, in 1 / unit.
  Int128 squares;
  std::uint64_t snaps;  ///< number of snaps of renewed bristles before their renewal
  std::uint64_t renewed;
  std::uint32_t tail_changed;
};

/// Returns the index in KernelSet::step of the step kernel with these features.
constexpr int variant_index(int axes, bool redraw, bool mean, bool energy, bool residual) {
  return (axes - 1) | (redraw ? 2 : 0) | (mean ? 4 : 0) | (energy ? 8 : 0) | (residual ? 16 : 0);
}
/// Returns the index of the kernel for bristles that age, which computes all outputs, with and without a
/// residual.
constexpr int aged_variant_index(int axes, bool redraw) { return 32 | (axes - 1) | (redraw ? 2 : 0); }
constexpr int variant_count = 36;

template <class T>
struct KernelSet {
  /// Advances the blocks [first, last) of a patch through a step or a piece of one, and adds to the totals.
  using Step = void (*)(const PatchView<T>&, const KernelStep&, std::uint32_t first, std::uint32_t last,
                        Totals&);
  Step step[variant_count];  ///< step kernels; null for a variant that this build lacks

  /// Counts the bristles of the blocks [first, last) whose deflection would exceed their snap length at the
  /// end of the step. Renewals follow from the count. Index: whether bristles age, axes - 1, redraw.
  using Foresee = std::uint64_t (*)(const PatchView<T>&, const KernelStep&, std::uint32_t first,
                                    std::uint32_t last);
  Foresee foresee[2][2][2];

  /// Makes the renewals of a piece in the blocks [first, last): selects bristles at random, and lets those
  /// slip that are bent along the motion by more than the residual. `first` must be the first block of a
  /// group. Index: as in `foresee`; null if this build has none.
  using Renew = void (*)(const PatchView<T>&, const Renewal&, std::uint32_t first, std::uint32_t last,
                         RenewalTotals&);
  Renew renew[2][2][2];

  /// Drags the blocks [first, last) of a patch along the path behind a corner without stepping them, and
  /// rewrites them at the patch's position. For patches with two axes and blocks none of which is marked as
  /// straight. Adds to `stored` the change of the full blocks' sums of present deflections. drag[1] also
  /// adds to `twice_integral`: twice the path integral of weight x (deflection along the motion less |z|).
  using Drag = void (*)(const PatchView<T>&, const Corner&, std::uint32_t first, std::uint32_t last,
                        RenewalTotals&);
  Drag drag[2];

  /// Rewrites block b for the position `at` of the patch: adds the displacement since the last rewrite to the
  /// deflections of bristles in contact, sets the others to 0, and recomputes the block's sums.
  void (*rewrite)(const PatchView<T>&, std::uint32_t b, const std::int64_t at[2]);
  /// Returns the sum of weight x squared deflection over the bristles of block b in contact, with the patch
  /// at `at`; scaled, in double, and in an order that is the same on every instruction set.
  double (*squares)(const PatchView<T>&, std::uint32_t b, const std::int64_t at[2]);
};

struct BedKernels;
struct JointKernels;
struct LaneTable;

struct KernelTable {
  const char* name;
  const LaneTable* lanes;      ///< table of lane_table.hpp
  const BedKernels* beds;      ///< table of bed_table.hpp; null in a build without beds
  const JointKernels* joints;  ///< table of joint_table.hpp; null in a build without joints
  KernelSet<float> f32;
  KernelSet<double> f64;  ///< kernels for double precision; all entries are null in a build without it
};

/// Instruction set of this build, with its kernels (kernel_entries(): best first). usable() asks CPU and
/// operating system whether they support it.
struct KernelEntry {
  const KernelTable* table;
  bool (*usable)();
};
const KernelEntry* kernel_entries(int* count) noexcept;

}  // namespace bristle::detail
