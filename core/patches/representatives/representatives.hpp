// The contact model of the paper: n representatives, simulated bristles that each stand for several, with a
// deflection and a snap length each (core/MODEL.md, sections 3 to 12). The kernels in kernels/ move them, in
// float or in double.
#pragma once

#include <cstdint>

#include "bristle/config.hpp"
#include "core/patches/columns.hpp"
#include "core/patches/contact_model.hpp"
#include "core/patches/instantiate.hpp"

namespace bristle::detail {

/// Number of representatives in contact under a load, and how much the last of them counts.
struct ContactCount {
  double active = 0.0;  ///< number of representatives in contact: zeta / w, but at most n
  /// Factor by which the load exceeds the largest number of bristles, and by which the force is scaled
  /// (overload); at least 1.
  double overload = 1.0;
  double fraction = 0.0;  ///< share, below 1, by which the last bristle in contact counts
  std::uint32_t whole = 0;
};
ContactCount count_contacts(double zeta, double weight, std::uint32_t bristles) noexcept;

/// Numbers of a patch of representatives that change with its load. All of them are saved.
struct RepresentativeCount {
  double active = 0.0;
  double fraction = 0.0;
  std::uint32_t whole = 0;
};

/// State of shared renewal, the effect by which a snap makes other bristles start afresh. Saved and hashed.
struct RenewalState {
  double due = 0.0;  ///< renewals still to be made: kappa for each snap so far, less the renewals made
  std::uint64_t selections = 0;  ///< number of selections for renewal so far

  /// Length of the present slide so far, scaled, at most `forget`; 0 = none. A slide is straight or gently
  /// bent, and was last continued by a step with a snap. Steps without a snap do not change the length; a
  /// rising load that adds bristles shortens it.
  double run = 0.0;
  /// Length of the slide as it counts for young bristles, which are farther from steady sliding
  /// (shortened_run()). Young are the few bristles that a rising load brought into contact during the slide:
  /// those from number `young_from` on.
  double young_run = 0.0;
  std::uint32_t young_from = none_young;
  static constexpr std::uint32_t none_young = 0xFFFFFFFFu;

  void forget_young() noexcept {
    young_run = 0.0;
    young_from = none_young;
  }
  void end_slide() noexcept {
    run = 0.0;
    forget_young();
  }
  // Data of the straight slide in progress, which is `run` long. Only bristles that age use the first two
  // fields.
  double run_ageing = 0.0;           ///< age gained per length in the slide (AgedSliding::per_length)
  double run_until = 0.0;            ///< time of the patch at the end of the slide, s
  double direction[2] = {0.0, 0.0};  ///< direction of the slide after its last corner, a unit vector
  std::int64_t slid_to[2] = {0, 0};  ///< position of the patch at the end of the slide
};

/// Constants of long steps at one sliding speed, for bristles that age (ageing.cpp). A cache that is not
/// saved: they follow from the material and the speed.
struct AgedSliding {
  KernelLaw law{};              ///< law of fresh snap lengths, with the constants of jumps of aged bristles
  double per_length = -1.0;     ///< age gained per scaled length, in ageing times; < 0: not computed
  double largest_growth = 1.0;  ///< factor by which ageing increases the longest snap length
  double steady_at = -1.0;    ///< value of `per_length` for which `steady_bend` and `steady_snaps` are valid
  double steady_bend = 0.0;   ///< mean deflection of steady sliding with shared renewal, scaled
  double steady_snaps = 0.0;  ///< snaps of a bristle per scaled length of steady sliding
};

/// Sums over the pieces into which a step with shared renewal is cut. Where the patch is dragged, its
/// bristles are not stepped: their |z| stay, as they do on average in steady sliding.
struct PieceSums {
  double length = 0.0;                 ///< length of the step, scaled
  double until = 0.0, duration = 0.0;  ///< time at the end of the step, and duration of the step, s
  double forget = 0.0;                 ///< path, scaled, after which a straight slide at this speed is steady
  double per_length = 0.0;             ///< age gained per scaled length in this step, in ageing times
  double dragged = 0.0;                ///< part of the step's path along which the patch is dragged, scaled
  double run = 0.0;                    ///< length of the slide that this step continues, scaled
  double young_run = 0.0;              ///< length of slide that this step's young bristles continue, scaled
  /// Path along which only the young bristles (new in contact) are stepped, times their share of the weight.
  /// It is included in `dragged`.
  double apart = 0.0;
  /// Correction of the dissipated energy for bristles that are dragged round a corner: their energy less that
  /// in steady sliding (negative), in the unit of `squares`.
  double lag = 0.0;
  /// Twice the integral of the sum of deflections along the path, in the unit of StepSums times scaled
  /// length. The mean force follows from it.
  double twice_integral[2] = {0.0, 0.0};
  double squares = 0.0;  ///< dissipated energy as a sum of squared deflections, scaled
  std::uint64_t snaps = 0, visited = 0;
  std::int64_t from[2] = {0, 0};  ///< position of the patch at the start of the step
  bool changed = false;           ///< whether a bristle snapped, was renewed, or was dragged round a corner
  bool has_corner = false;        ///< whether this step leaves the line of the slide that it continues
};

/// Shared renewal of a patch (each snap makes other bristles start afresh): its state, constants of the
/// material in scaled lengths, and sums of the step in progress.
struct SharedRenewal : RenewalState {
  double piece = 0.0;         ///< longest piece of path that is computed at once, scaled
  double inverse_mean = 0.0;  ///< one over the mean snap length, scaled
  double forget = 0.0;        ///< path after which a straight slide is steady, scaled
  /// Least path, scaled, along which every bristle is stepped, not dragged, in each step of a steady slide.
  double goes_on = 0.0;
  double steady_bend = 0.0;   ///< mean deflection of steady sliding, scaled
  double steady_snaps = 0.0;  ///< snaps of a bristle per scaled length of steady sliding
  PieceSums walked;
};

/// Longest piece of a step under shared renewal, in mean snap lengths. Pieces are shorter for a kappa
/// (bristles renewed for each snap) above 2 (core/patches/RUBBING.md).
constexpr double longest_piece = 0.25;

template <class T>
struct Representatives : PatchRecord, RepresentativeCount {
  using Number = T;

  std::uint32_t bristles = 0;  ///< n, number of representatives
  std::uint32_t block_count = 0;
  std::uint32_t group_count = 0;
  int variant = 0;  ///< index of the patch's step kernel in KernelSet::step
  const KernelSet<T>* kernels = nullptr;

  Block* blocks = nullptr;
  Reach* groups = nullptr;
  T* zx = nullptr;
  T* zy = nullptr;  ///< deflections along y; null if the patch has one axis

  // Columns of the deflections at which bristles snap, scaled: residual plus snap length.
  T* first = nullptr;  ///< deflections at which bristles snap for the first time, scaled
  /// Deflections at which bristles snap next, scaled; with SnapRule::keep the same column as `first`.
  T* delta = nullptr;
  std::uint32_t* random = nullptr;  ///< states of the bristles' random numbers; null with SnapRule::keep
  SharedRenewal* shared = nullptr;  ///< state of shared renewal, one entry; null for a material without it

  // Ages of bristles, and times at which blocks were last rewritten (PatchView); null without ageing.
  T* age = nullptr;
  double* since = nullptr;
  AgedSliding* aged = nullptr;  ///< constants of ageing bristles, one entry; null without ageing

  /// Visits every column (array) of the record, in the order in which columns are laid out, saved and hashed.
  template <class Self, class Visit>
  static void columns(Self& r, Visit&& visit) {
    const std::uint32_t rows = r.padded();
    const std::uint32_t redrawn = r.redraws() ? rows : 0;
    visit(r.blocks, ColumnRule{"blocks", r.block_count, Filler::block, false});
    visit(r.groups, ColumnRule{"groups", r.group_count, Filler::cache, false});
    visit(r.zx, ColumnRule{"zx", rows, Filler::zero, true});
    visit(r.zy, ColumnRule{"zy", r.options.axes == 2 ? rows : 0, Filler::zero, true});
    visit(r.first, ColumnRule{"first", rows, Filler::from_seed, !r.redraws()});
    visit(r.delta, ColumnRule{"delta", redrawn, Filler::first_length, true});
    visit(r.random, ColumnRule{"draw", redrawn, Filler::random_state, true});
    // Lists shared renewal as neither saved nor hashed here, because other functions save and hash its state.
    visit(r.shared, ColumnRule{"shared", r.renews() ? 1u : 0u, Filler::cache, false});
    visit(r.age, ColumnRule{"age", r.ages() ? rows : 0, Filler::age, true});
    visit(r.since, ColumnRule{"since", r.ages() ? r.block_count : 0, Filler::block, false});
    visit(r.aged, ColumnRule{"aged", r.ages() ? 1u : 0u, Filler::cache, false});
  }
  /// Points to the present snap lengths, after the columns were set. With SnapRule::keep the first snap
  /// lengths are the present ones, so both share a column.
  void find_lengths() noexcept {
    if (!redraws()) delta = first;
  }

  bool redraws() const noexcept { return material->redraw; }
  bool renews() const noexcept { return material->material.shared_renewal > 0.0; }
  bool ages() const noexcept { return material->material.ageing_strength > 0.0; }
  std::uint32_t in_contact() const noexcept { return whole + (fraction > 0.0 ? 1u : 0u); }
  std::uint32_t full_blocks() const noexcept { return whole / block_size; }
  std::uint32_t active_blocks() const noexcept { return (in_contact() + block_size - 1) / block_size; }
  std::uint32_t padded() const noexcept { return (bristles + lane_count - 1) / lane_count * lane_count; }
  bool has_tail() const noexcept { return in_contact() > full_blocks() * block_size; }

  PatchView<T> view() const noexcept {
    return {zx,
            zy,
            delta,
            random,
            first,
            blocks,
            groups,
            bristles,
            whole,
            static_cast<T>(fraction),
            !redraws()        ? nullptr
            : aged != nullptr ? &aged->law
                              : &material->law,
            age,
            since};
  }
};

template <class T>
Representatives<T>& representatives(const Patch& p) noexcept {
  return static_cast<Representatives<T>&>(*p.record);
}

// ------------------------------------------------------------------------------- blocks (blocks.cpp)

/// Rewrites the deflections of block b relative to the patch's present position, so that they are exact and
/// the block's displacement is 0.
template <class T>
void rewrite_block(const Patch& p, std::uint32_t b) noexcept;
/// Initialises block b, whose bristles are all straight: out of contact or just in contact.
template <class T>
void enter_block(const Patch& p, std::uint32_t b) noexcept;
/// Adds the deflections of block b to the patch's sum over full blocks (`sign` +1), or subtracts them (-1).
template <class T>
void book_block(Patch& p, std::uint32_t b, int sign) noexcept;
/// Returns the sum of weight x |z|^2, with z the scaled deflection, over the bristles of block b in contact.
template <class T>
double block_squares(const Patch& p, std::uint32_t b) noexcept;
template <class T>
double all_squares(const Patch& p) noexcept;
/// Returns the elastic energy, J, of a bristle of weight 1 with a deflection of one scaled length.
template <class T>
double joules_per_square(const Patch& p) noexcept;
/// Gives bristles [from, to) of one block their first snap lengths again. They are out of contact, and bring
/// no memory into their next contact.
template <class T>
void forget_bristles(Representatives<T>& r, std::uint32_t from, std::uint32_t to) noexcept;
/// Marks the bounds on snapping of patch and groups as unknown. Call it after anything but a step kernel has
/// changed blocks, or a step might skip a bristle that snaps.
template <class T>
void forget_upper_bounds(Patch& p) noexcept;
/// Returns the displacement of the patch since a block was last rewritten, scaled. Present deflections are
/// the stored ones plus this.
inline double moved_since(const Patch& p, const Block& block, int axis) noexcept {
  return to_lengths(difference(p.position[axis], block.position[axis]));
}
/// Updates the part of a patch that all contact models share (sums over the tail, unit of force, response at
/// rest). Call it after a change of the number in contact or of the tail, which is the last block, partly
/// filled.
template <class T>
void note_count(Patch& p) noexcept;
/// Updates the sums over the tail (the last block, partly filled). Call it after a rewrite of the tail.
template <class T>
void note_tail(Patch& p) noexcept;

// ----------------------------------------------------------------------------- ageing (ageing.cpp)

constexpr double oldest_bristle = 1e30;  ///< largest age of a bristle, in units of the material's ageing time

/// Returns the largest factor by which ageing can lengthen a snap length: that of the longest time.
double largest_ageing_factor(const Material& material) noexcept;
/// Returns an upper bound on the deflection of a bristle of the patch, scaled, against which saved
/// deflections are checked.
template <class T>
double longest_bend(const Representatives<T>& r) noexcept {
  const double growth = r.ages() ? largest_ageing_factor(r.material->material) : 1.0;
  return r.material->residual + r.material->longest * growth;
}
/// Returns by how much the bristles of block b have aged since the block was last rewritten, in ageing times.
template <class T>
double aged_since(const Patch& p, std::uint32_t b) noexcept;
/// Brings the stored ages of the bristles in block b up to the present time. A bristle out of contact gets
/// age 0.
template <class T>
void write_ages(const Patch& p, std::uint32_t b) noexcept;
/// Returns the deflection at which bristle i snaps now, scaled. Requires that stored ages are those of the
/// present time.
template <class T>
double limit_now(const Representatives<T>& r, std::uint32_t i) noexcept;
/// Marks the constants of long steps (AgedSliding) as unknown, for a patch that has not slid yet.
template <class T>
void begin_ageing(const Representatives<T>& r) noexcept;
/// Fills the constants of ageing that the kernels of a step need.
template <class T>
void prepare_ageing(const Patch& p, KernelStep& step) noexcept;
/// Returns the age that a bristle gains per scaled length of a step, in ageing times.
double age_per_length(const Material& material, const KernelStep& step) noexcept;
/// Returns the factor by which ageing lengthens the mean path from snap to snap in steady sliding at one
/// speed, without shared renewal.
template <class T>
double mean_growth(const Representatives<T>& r, double per_length) noexcept;
/// Calculates mean deflection and snap rate of steady sliding at one speed, for shared renewal with ageing.
template <class T>
void find_steady_sliding(const Representatives<T>& r, double per_length) noexcept;

// ----------------------------------------------------- population, load, step, material, state

/// Computes the first snap lengths that belong to the patch's seed, and the bounds of blocks that follow from
/// them.
template <class T>
void fill_first(Representatives<T>& r) noexcept;
/// Resets all columns: straight bristles with their first snap lengths and first random states.
template <class T>
void fill_columns(Representatives<T>& r) noexcept;
/// Sets the first snap lengths of another seed. Deflections and random states stay.
template <class T>
void change_seed(Representatives<T>& r, std::uint32_t seed) noexcept;

template <class T>
double apply_load(Patch& p, double normal_load_n) noexcept;

template <class T>
void step_bristles(Patch& p, PatchStep& step, StepSums& sums) noexcept;
template <class T>
std::uint32_t prepare(Patch& p, PatchStep& step) noexcept;
template <class T>
void run_blocks(const Patch& p, const PatchStep& step, std::uint32_t first, std::uint32_t last,
                Totals& totals) noexcept;
template <class T>
void finish(Patch& p, const PatchStep& step, const Totals& totals, StepSums& sums) noexcept;

/// Updates positions and sums of deflections after the kernels have made a step or a piece of one. Energy,
/// number of snaps and bounds are left to the caller.
template <class T>
void finish_kernel(Patch& p, const KernelStep& step, const Totals& totals, StepSums& sums) noexcept;
/// Sets the kernels' constants for a step or for a piece of one.
template <class T>
void prepare_kernel(const Patch& p, PatchStep& step) noexcept;
/// Computes, after a step that visited blocks, the bound of the patch: the distance within which it may move
/// before a block must be visited again.
template <class T>
void find_new_bound(Patch& p, const Totals& totals) noexcept;
/// Returns whether the stored sum of deflections over full blocks equals the sum recomputed from these
/// blocks, for asserts.
template <class T>
bool sums_agree(const Patch& p) noexcept;

// Functions of a step that is cut into pieces (shared renewal, renewal.cpp). `step_pieces` steps all
// pieces but the last, whose renewals it makes; `finish_piece` ends a piece; `finish_walk` gives the sums
// over all pieces.
template <class T>
void plan_pieces(Representatives<T>& r) noexcept;
template <class T>
void step_pieces(Patch& p, PatchStep& step) noexcept;
/// Returns how long a slide of the length `run` would be whose bristles are as far from steady sliding, after
/// a share of its deflections was disturbed. A disturbance decays exponentially along the path, to 1e-3 along
/// `forget`, as does the difference from steady sliding at the beginning of a slide.
double shortened_run(double run, double forget, double share) noexcept;
template <class T>
void finish_piece(Patch& p, const KernelStep& step, const Totals& totals) noexcept;
/// Updates, after a change of load, which bristles count as young (in contact since the present slide began).
/// `active`, `whole`: numbers in contact, and in contact with full weight, before the change.
template <class T>
void note_young(Representatives<T>& r, double active, std::uint32_t whole) noexcept;
template <class T>
void finish_walk(Patch& p, const double (&direction)[2], StepSums& sums) noexcept;

template <class T>
void take_over(Patch& to, Patch& from) noexcept;
template <class T>
void reset(Patch& p, std::uint32_t seed, std::uint64_t key) noexcept;
template <class T>
void copy_patch(const Patch& from, Patch& to, std::byte* memory) noexcept;

template <class T>
double find_stored_energy(const Patch& p) noexcept;
template <class T>
std::uint64_t hash_patch(const Patch& p) noexcept;
template <class T>
void describe(const Patch& p, PatchInfo& info) noexcept;
template <class T>
void read_bristles(const Patch& p, std::size_t count, Span<double> zx, Span<double> zy,
                   Span<double> delta) noexcept;
template <class T>
std::uint64_t signature(const Patch& p) noexcept;
template <class T>
void save(const Patch& p, ByteWriter& write) noexcept;
template <class T>
const char* find_fault(const Patch& p, const Patch& contact, ByteReader read) noexcept;
template <class T>
void restore(Patch& p, std::uint32_t seed, ByteReader read) noexcept;

/// Makes a patch of representatives, out of contact. Throws bristle::Error for options out of range.
Patch make_representatives(std::shared_ptr<const CompiledMaterial> material, const PatchOptions& options,
                           const KernelTable& kernels, double weight);

}  // namespace bristle::detail
