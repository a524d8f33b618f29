// The contact model of the paper: n representative bristles, each with a deflection and a snap length
// (core/MODEL.md, sections 3 to 12). One record per number type; kernels/ moves the bristles.
#pragma once

#include <cstdint>

#include "bristle/config.hpp"
#include "core/patches/columns.hpp"
#include "core/patches/contact_model.hpp"
#include "core/patches/instantiate.hpp"

namespace bristle::detail {

/// Number of representatives in contact at a load.
struct ContactCount {
  double active = 0.0;    ///< zeta / w, number of representatives in contact, at most `detail`
  double overload = 1.0;  ///< zeta / (detail w) if above 1: the factor by which the force is scaled under
                          ///< overload
  double fraction = 0.0;  ///< share by which the last bristle in contact counts
  std::uint32_t whole = 0;
};
ContactCount count_contacts(double zeta, double weight, std::uint32_t detail) noexcept;

/// Numbers that change with load and detail. Saved unchanged; `position`, `zeta` and `overload` are in Patch.
struct RepresentativeCount {
  double active = 0.0;
  double fraction = 0.0;
  double weight = 0.0;       ///< w = zeta_max / detail, physical bristles per representative
  std::uint32_t detail = 0;  ///< number of representatives in use, at most n
  std::uint32_t whole = 0;
};

/// State of shared renewal. Saved and hashed if the material has shared renewal.
struct RenewalState {
  double due = 0.0;         ///< draws still owed: kappa for each snap so far, less the draws made
  std::uint64_t draws = 0;  ///< number of draws so far, which is the number of the next draw

  // The slide, straight or gently bent, to which the last step with a snap belongs. Steps without a snap do
  // not change these numbers.
  /// length of the slide, at most `forget`; shorter where a rising load added many bristles; 0 = none
  double run = 0.0;
  /// Length of a slide after which a whole patch would be as far from steady sliding as this patch is, whose
  /// young bristles entered late (shortened_run()). Young bristles are the few that a rising load brought
  /// into contact during the slide: those from number `young_from` on.
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
  // State of the patch at the end of its last slide; run_ageing and run_until serve bristles that age.
  double run_ageing = 0.0;           ///< AgedSliding::per_length of the slide
  double run_until = 0.0;            ///< the patch's time at the end of the slide, s
  double direction[2] = {0.0, 0.0};  ///< direction of the slide since its last bend, a unit vector
  std::int64_t slid_to[2] = {0, 0};  ///< patch position at the end of the slide
};

/// Constants of sliding at one speed for ageing bristles, for long steps (ageing.cpp). A cache: they follow
/// from the material and `per_length`.
struct AgedSliding {
  KernelLaw law{};              ///< law of the fresh snap length, with constants of jumps for aged lengths
  double per_length = -1.0;     ///< age gained per length, in units of the ageing time; < 0: not computed
  double largest_growth = 1.0;  ///< aged over fresh length of the longest bristle
  double steady_at = -1.0;      ///< value of `per_length` for which the next two fields were computed
  double steady_bend = 0.0;     ///< mean deflection in steady sliding under shared renewal, scaled
  double steady_snaps = 0.0;    ///< snaps of a bristle per scaled length
};

/// Sums and numbers of one step under shared renewal, over its pieces. The patch is carried along a path if
/// its bristles' lengths |z| stay unchanged, as in steady sliding on average.
struct PieceSums {
  double length = 0.0;                 ///< length of the step, scaled
  double until = 0.0, duration = 0.0;  ///< time at the end of the step, and its duration, s
  double forget = 0.0;                 ///< path after which a straight slide at this speed is steady
  double per_length = 0.0;             ///< AgedSliding::per_length of the step, with ageing
  double carried = 0.0;                ///< part of `length` along which the patch is carried, scaled
  double run = 0.0;                    ///< length of the slide that the step continues, scaled
  double young_run = 0.0;              ///< length of the slide that its young bristles continue
  double apart = 0.0;  ///< path on which young bristles are followed separately, times their share of the
                       ///< weight; a part of `carried`
  double lag = 0.0;    ///< energy that bristles carried round a corner dissipate, less that of steady
                       ///< sliding (so below 0), in the unit of `squares`
  double twice_integral[2] = {0.0, 0.0};  ///< twice the path integral of the sum of deflections, in units of
                                          ///< StepSums x scaled length
  double squares = 0.0;                   ///< energy dissipated, as a sum of scaled squared deflections
  std::uint64_t snaps = 0, visited = 0;
  std::int64_t from[2] = {0, 0};  ///< patch position at the start of the step
  bool changed = false;           ///< whether a bristle snapped, was renewed or was carried round a corner
  bool turns = false;             ///< whether the step continues a slide in another direction than before
};

/// Shared renewal of a patch: its state, scaled constants of the material, and the sums of the step under
/// way.
struct SharedRenewal : RenewalState {
  double piece = 0.0;         ///< longest piece of path that is taken at once, scaled
  double inverse_mean = 0.0;  ///< one over the mean snap length, scaled
  double forget = 0.0;        ///< path after which a straight slide is steady, scaled
  double goes_on = 0.0;       ///< shortest path on which bristles are followed one by one in a step of a
                              ///< steady slide, scaled
  double steady_bend = 0.0;   ///< mean deflection in steady sliding, scaled
  double steady_snaps = 0.0;  ///< snaps of a bristle per scaled length of steady sliding
  PieceSums walked;
};

/// Longest piece of a step under shared renewal, in mean snap lengths; shorter where kappa is above 2
/// (core/patches/RUBBING.md).
constexpr double longest_piece = 0.25;

template <class T>
struct Representatives : PatchRecord, RepresentativeCount {
  using Number = T;

  std::uint32_t bristles = 0;  ///< n, number of representatives
  std::uint32_t block_count = 0;
  std::uint32_t group_count = 0;
  int variant = 0;  ///< index of the step kernel in KernelSet::step
  const KernelSet<T>* kernels = nullptr;

  Block* blocks = nullptr;
  Reach* groups = nullptr;
  T* zx = nullptr;
  T* zy = nullptr;  ///< deflections along y; null if the patch has one axis

  // Deflections at which bristles snap, residual + snap length, in scaled lengths.
  T* first = nullptr;               ///< deflections at which bristles snap the first time
  T* delta = nullptr;               ///< deflections at which bristles snap the next time; equals `first` with
                                    ///< SnapRule::keep
  std::uint32_t* draw = nullptr;    ///< states of the bristles' random draws; null with SnapRule::keep
  SharedRenewal* shared = nullptr;  ///< a single entry; null without shared renewal

  // Columns of ages (PatchView), null without ageing.
  T* age = nullptr;
  double* since = nullptr;
  AgedSliding* aged = nullptr;  ///< constants of ageing bristles, a single entry; null without ageing

  /// Visits every column in the order in which columns are laid out, saved and hashed.
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
    visit(r.draw, ColumnRule{"draw", redrawn, Filler::draw_state, true});
    // Lists no saved column for shared renewal, because its state is saved and hashed by other functions.
    visit(r.shared, ColumnRule{"shared", r.renews() ? 1u : 0u, Filler::cache, false});
    visit(r.age, ColumnRule{"age", r.ages() ? rows : 0, Filler::age, true});
    visit(r.since, ColumnRule{"since", r.ages() ? r.block_count : 0, Filler::block, false});
    visit(r.aged, ColumnRule{"aged", r.ages() ? 1u : 0u, Filler::cache, false});
  }
  /// Sets pointers that depend on others after the columns were placed: with SnapRule::keep the present snap
  /// lengths are the first ones.
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
            draw,
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

/// Rewrites block b with its deflections at the patch's present position.
template <class T>
void rewrite_block(const Patch& p, std::uint32_t b) noexcept;
/// Initialises block b, all of whose bristles are out of contact or straight.
template <class T>
void enter_block(const Patch& p, std::uint32_t b) noexcept;
/// Adds the deflections of block b to the sum over full blocks (`sign` +1), or subtracts them (-1).
template <class T>
void book_block(Patch& p, std::uint32_t b, int sign) noexcept;
/// Returns the sum of weight x |z|^2 over the bristles of block b in contact, scaled.
template <class T>
double block_squares(const Patch& p, std::uint32_t b) noexcept;
template <class T>
double all_squares(const Patch& p) noexcept;
/// Returns the energy of a unit of weight x scaled |z|^2, J.
template <class T>
double joules_per_square(const Patch& p) noexcept;
/// Resets bristles of one block, [from, to), which are out of contact, to their first snap lengths.
template <class T>
void forget_bristles(Representatives<T>& r, std::uint32_t from, std::uint32_t to) noexcept;
/// Recomputes the bounds of groups and patch after a block changed outside a step.
template <class T>
void forget_upper_bounds(Patch& p) noexcept;
/// Returns the displacement of a block since its last rewrite, scaled.
inline double moved_since(const Patch& p, const Block& block, int axis) noexcept {
  return to_lengths(difference(p.position[axis], block.position[axis]));
}
/// Updates the shared part after a change of the number in contact, the weight or the tail block (the last,
/// partly filled one): sums over the tail, unit of force, response at rest.
template <class T>
void note_count(Patch& p) noexcept;
/// Updates the sums over the tail block in the shared part after the block was rewritten.
template <class T>
void note_tail(Patch& p) noexcept;

// ----------------------------------------------------------------------------- ageing (ageing.cpp)

constexpr double oldest_bristle = 1e30;  ///< largest possible age of a bristle, in units of the ageing time

/// Returns the largest growth g of a snap length by ageing.
double largest_ageing_factor(const Material& material) noexcept;
/// Returns the longest deflection that a bristle can have.
template <class T>
double longest_bend(const Representatives<T>& r) noexcept {
  const double growth = r.ages() ? largest_ageing_factor(r.material->material) : 1.0;
  return r.material->residual + r.material->longest * growth;
}
/// Returns the age that bristles of block b have gained since its last rewrite, in units of the ageing time.
template <class T>
double aged_since(const Patch& p, std::uint32_t b) noexcept;
/// Rewrites the ages of block b to the present time. Bristles out of contact get age 0.
template <class T>
void write_ages(const Patch& p, std::uint32_t b) noexcept;
/// Returns the deflection at which bristle i snaps. Its stored age must be up to date.
template <class T>
double limit_now(const Representatives<T>& r, std::uint32_t i) noexcept;
/// Sets AgedSliding of a patch that has not slid yet.
template <class T>
void begin_ageing(const Representatives<T>& r) noexcept;
/// Fills the constants of ageing for the kernels of a step.
template <class T>
void prepare_ageing(const Patch& p, Advance& advance) noexcept;
/// Returns the age gained per length in a step, in units of the ageing time.
double age_per_length(const Material& material, const Advance& advance) noexcept;
/// Returns the mean path from snap to snap in steady sliding, over the mean path without ageing; both without
/// renewal.
template <class T>
double mean_growth(const Representatives<T>& r, double per_length) noexcept;
/// Finds mean deflection and snap rate of steady sliding under shared renewal at one speed, for AgedSliding.
template <class T>
void find_steady_sliding(const Representatives<T>& r, double per_length) noexcept;

// ----------------------------------------------------- population, load, step, detail, material, state

/// Fills the first snap lengths of the patch's seed, and the bounds of blocks that depend on them.
template <class T>
void fill_first(Representatives<T>& r) noexcept;
/// Resets the columns: straight bristles with their first lengths and first random states.
template <class T>
void fill_columns(Representatives<T>& r) noexcept;
/// Sets the first snap lengths of another seed; deflections and draw states stay.
template <class T>
void change_seed(Representatives<T>& r, std::uint32_t seed) noexcept;

template <class T>
double apply_load(Patch& p, double normal_load_n) noexcept;

template <class T>
void advance(Patch& p, PatchStep& step, StepSums& sums) noexcept;
template <class T>
std::uint32_t prepare(Patch& p, PatchStep& step) noexcept;
template <class T>
void run_blocks(const Patch& p, const PatchStep& step, std::uint32_t first, std::uint32_t last,
                Totals& totals) noexcept;
template <class T>
void finish(Patch& p, const PatchStep& step, const Totals& totals, StepSums& sums) noexcept;

/// Updates the state and the sums of deflections after the kernels of a step or a piece; energy, snaps and
/// bounds are left to the caller.
template <class T>
void finish_kernel(Patch& p, const Advance& advance, const Totals& totals, StepSums& sums) noexcept;
/// Fills the kernels' constants for a step or a piece of it.
template <class T>
void prepare_kernel(const Patch& p, PatchStep& step) noexcept;
/// Finds, after a step that visited blocks, the patch's bound: how far it may move before a block must be
/// visited again.
template <class T>
void renew_bound(Patch& p, const Totals& totals) noexcept;
/// Whether the stored sum of deflections over full blocks equals the sum over its blocks.
template <class T>
bool sums_agree(const Patch& p) noexcept;

// Shared renewal (renewal.cpp). `advance_pieces` steps all pieces but the last, whose renewals it makes and
// which it leaves in `step`; `finish_piece` ends a piece; `finish_walk` gives the sums over all pieces.
template <class T>
void plan_pieces(Representatives<T>& r) noexcept;
template <class T>
void advance_pieces(Patch& p, PatchStep& step) noexcept;
void add_totals(RenewalTotals& sum, const RenewalTotals& part) noexcept;
/// Returns the length that a slide counts as after the share `share` of its deflections was disturbed.
/// Undisturbed deflections are within 1e-3 of steady sliding after the path `forget`; a disturbance decays
/// exponentially with the path.
double shortened_run(double run, double forget, double share) noexcept;
template <class T>
void finish_piece(Patch& p, const Advance& advance, const Totals& totals) noexcept;
/// Updates the young bristles after bristles came into contact or left it. `active`, `whole`: number in
/// contact before the change, and those of them that counted fully.
template <class T>
void note_young(Representatives<T>& r, double active, std::uint32_t whole) noexcept;
template <class T>
void finish_walk(Patch& p, const double (&direction)[2], StepSums& sums) noexcept;

template <class T>
Status set_detail(Patch& p, std::uint32_t bristles) noexcept;
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

/// Makes a patch of representatives. Throws bristle::Error.
Patch make_representatives(std::shared_ptr<const CompiledMaterial> material, const PatchOptions& options,
                           const KernelTable& kernels, double weight);
/// Makes the names of the kernel variants. The first batch calls it, so that asking for a name allocates
/// nothing.
void name_kernels();

}  // namespace bristle::detail
