// The state of one patch and what a step does to it, apart from the bristles' own motion (kernels/).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "bristle/patch.hpp"
#include "core/materials/kernel_law.hpp"
#include "core/kernel_table.hpp"

namespace bristle::detail {

constexpr double highest_load = 1e15;  ///< N, of a motion

/// What changes in a patch from step to step, apart from its columns. Copied and saved as one.
struct PatchContact {
  // --- contact
  double normal_load = 0.0;
  double weight = 0.0;       ///< w, physical bristles per representative: zeta_max / detail
  std::uint32_t detail = 0;  ///< representatives that stand for the patch, at most its n
  double zeta = 0.0;         ///< bristles in contact, physical
  double active = 0.0;       ///< representatives in contact
  double overload = 1.0;     ///< zeta / (detail w) where that is above 1
  std::uint32_t whole = 0;
  double fraction = 0.0;

  // --- motion, fixed point (kernel_table.hpp)
  std::int64_t position[2] = {0, 0};
  Int128 stored[2] = {0, 0};  ///< sum of Block::stored over full blocks
  Int128 offset[2] = {0, 0};  ///< sum of (position - Block::position) over full blocks

  // --- left over from a change of material or detail, booked with the next step
  double pending_dissipated = 0.0;  ///< J
  double pending_loss = 0.0;        ///< J
  std::uint64_t pending_snaps = 0;
};

/// Columns, counts and sums of one patch. Made and freed on the thread that adds patches; touched by
/// the stepping thread and its workers only.
struct PatchState : PatchContact {
  // --- what the patch is; fixed from its making
  PatchOptions options;
  std::shared_ptr<const CompiledMaterial> material;
  double full_weight = 0.0;      ///< w when all n representatives are in use
  std::uint32_t first_seed = 0;  ///< that it was added with; options.seed may change by a reset
  std::uint32_t bristles = 0;    ///< n
  std::uint32_t block_count = 0;
  std::uint32_t group_count = 0;
  int variant = 0;  ///< of the step kernel
  const KernelTable* kernels = nullptr;

  // --- columns, in one allocation
  struct Free {
    void operator()(std::byte* memory) const noexcept;
  };
  std::unique_ptr<std::byte[], Free> storage;
  std::size_t storage_bytes = 0;
  void* zx = nullptr;
  void* zy = nullptr;
  void* delta = nullptr;
  void* first = nullptr;  ///< == delta with keep
  std::uint32_t* draw = nullptr;
  Block* blocks = nullptr;
  Reach* groups = nullptr;

  // --- bounds: a cache, never part of the state (core/MODEL.md, section 10)
  Reach bound{{0, 0}, -1.0};  ///< no bristle snaps while the position stays within it
  bool skips = true;          ///< blocks whose bound holds are left out
  bool tracks = true;         ///< bounds are renewed: worth it while most visited blocks hold still

  std::uint64_t last_step = 0;   ///< number of the step that moved it last: finds repeated ids
  std::uint64_t split_step = 0;  ///< number of the step whose blocks went to several tasks

  bool is_double() const noexcept { return options.precision == Precision::double_; }
  std::uint32_t in_contact() const noexcept { return whole + (fraction > 0.0 ? 1u : 0u); }
  std::uint32_t full_blocks() const noexcept { return whole / block_size; }
  std::uint32_t active_blocks() const noexcept { return (in_contact() + block_size - 1) / block_size; }
  std::uint32_t padded() const noexcept { return (bristles + lane_count - 1) / lane_count * lane_count; }
  bool has_tail() const noexcept { return in_contact() > full_blocks() * block_size; }

  template <class T>
  PatchView<T> view() const noexcept {
    return {static_cast<T*>(zx),
            static_cast<T*>(zy),
            static_cast<T*>(delta),
            draw,
            static_cast<const T*>(first),
            blocks,
            groups,
            bristles,
            whole,
            static_cast<T>(fraction),
            draw != nullptr ? &material->law : nullptr};
  }
  template <class T>
  const KernelSet<T>& set() const noexcept;

  void rewrite_block(std::uint32_t b) noexcept;
  void enter_block(std::uint32_t b) noexcept;           ///< its bristles are out of contact, or straight
  void book_block(std::uint32_t b, int sign) noexcept;  ///< into the sums over full blocks, or out of them
  double moved_since(const Block& block, int axis) const noexcept;  ///< its last rewrite, scaled
  double deflection_sum(int axis) const noexcept;  ///< weighted, over the bristles in contact, scaled
  double joules_per_square() const noexcept;       ///< energy of a unit of |z|^2, scaled
  /// Bristles [from, to) of one block out of contact: their first snap lengths again.
  void forget_bristles(std::uint32_t from, std::uint32_t to) noexcept;
  void forget_upper_bounds() noexcept;  ///< of groups and patch: a block changed outside a step
  void forget_bounds() noexcept;        ///< every block is visited at the next step that moves
  double block_squares(std::uint32_t b) const noexcept;  ///< sum of weight |z|^2, scaled
};

/// Fixed-point difference of two positions, which wrap.
inline std::int64_t difference(std::int64_t to, std::int64_t from) noexcept {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(to) - static_cast<std::uint64_t>(from));
}

/// How many representatives a patch has in contact.
struct ContactCount {
  double active, overload, fraction;
  std::uint32_t whole;
};
ContactCount count_contacts(double zeta, double weight, std::uint32_t detail) noexcept;

/// A patch out of contact, with its columns filled. `weight` 0 = from the material and options.
/// Throws bristle::Error.
std::unique_ptr<PatchState> make_patch(std::shared_ptr<const CompiledMaterial> material,
                                       const PatchOptions& options, const KernelTable& kernels,
                                       double weight = 0.0);

/// First snap lengths of another seed; deflections and draws stay.
void change_seed(PatchState& patch, std::uint32_t seed) noexcept;
/// The patch as make_patch would make it with this seed and key. Costs the snap lengths of all bristles when
/// the seed changes.
void reset_patch(PatchState& patch, std::uint32_t seed, std::uint64_t key) noexcept;

/// Changes the load, N >= 0: bristles enter and leave. Returns the elastic energy that left, J (0 and
/// uncounted when the patch does not compute energy).
double apply_load(PatchState& patch, double normal_load_n) noexcept;

/// One step of one patch between its parts: begin, run kernels over all blocks in pieces, finish.
struct PatchStep {
  Advance advance;
  bool moves = false;         ///< false: no kernel need run
  bool ran = false;           ///< kernels ran, though perhaps no block was visited
  double contact_loss = 0.0;  ///< J
  double displacement[2];     ///< m
  double velocity[2];         ///< m/s, for dampers
};

/// Checks the motion; false = bad input.
bool is_good_motion(const PatchState& patch, const Motion& motion) noexcept;
/// Applies the load and prepares the kernels' input. `commit` false: state may not change, so the load
/// must be the present one.
PatchStep begin_step(PatchState& patch, const Motion& motion, double dt_s, bool commit) noexcept;
/// Whether the step ends within the patch's bound: then no block need be visited.
bool holds_still(const PatchState& patch, const PatchStep& step) noexcept;
/// Runs the kernel over blocks [first, last), `first` at the beginning of a group.
void run_blocks(const PatchState& patch, const PatchStep& step, std::uint32_t first, std::uint32_t last,
                Totals& totals) noexcept;
void add_totals(Totals& sum, const Totals& part) noexcept;
/// Books the totals (when committed) and writes the response.
void finish_step(PatchState& patch, const PatchStep& step, const Totals& totals, Response& out) noexcept;

/// After a patch out of contact got another contact, positions and sums of blocks, and columns: blocks in
/// contact are taken as written down, the others as straight, and the sums over blocks are made anew.
void find_block_sums(PatchState& patch) noexcept;

/// Copies state and columns of `from` into `to`, whose storage is at least as large.
void copy_patch(const PatchState& from, PatchState& to) noexcept;
/// Moves the state of a patch into one made for another material; counts the snaps this causes.
void take_over(PatchState& to, PatchState& from) noexcept;

/// Elastic energy of the bristles in contact, J.
double find_stored_energy(const PatchState& patch) noexcept;
/// Deflections and snap lengths of the first `count` bristles, m; empty spans are left out.
void read_columns(const PatchState& patch, std::size_t count, Span<double> zx, Span<double> zy,
                  Span<double> delta) noexcept;

/// Zero force and the given status.
void write_refusal(const PatchOptions* options, Status status, Response& out) noexcept;

}  // namespace bristle::detail
