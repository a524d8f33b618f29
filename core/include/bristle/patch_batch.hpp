// Many contact patches, stepped together against a deadline.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "bristle/export.hpp"
#include "bristle/material.hpp"
#include "bristle/patch.hpp"
#include "bristle/patch_group.hpp"
#include "bristle/set_field.hpp"
#include "bristle/span.hpp"

namespace bristle {

struct BuildSignature;
namespace detail {
struct BatchAccess;
}  // namespace detail

struct BatchOptions {
  int threads = 1;  ///< number of threads that may step, the caller included; `automatic`: one per core
  /// Instruction set of the kernels: "scalar", "sse2", "avx2", ...; null: that of the environment variable
  /// BRISTLE_ISA, or the best available.
  const char* isa = nullptr;

  BatchOptions& with_threads(int count) { return detail::set(*this, threads, count); }
  BatchOptions& with_isa(const char* name) { return detail::set(*this, isa, name); }
};

/// Returns the population that Population::automatic means for this material and these options; returns any
/// other population unchanged.
BRISTLE_API Population choose_population(const Material& material, const PatchOptions& options) noexcept;

/// Report on a step as a whole, over all its patches.
struct StepReport {
  Status status = Status::ok;         ///< flags of all responses, combined
  std::uint32_t patches_stepped = 0;  ///< number of motions that were executed
  /// Number of pieces into which the step's work was divided for the threads. 1: all done on the calling
  /// thread; 0: step refused.
  std::uint32_t tasks = 0;
  std::uint32_t threads = 0;           ///< number of threads that took a piece of work, the caller included
  std::uint64_t bristles_visited = 0;  ///< number of bristles that a kernel visited
};

/// Contact patches of the brush model.
///
/// Thread rule. Beds, joints and matchers (BedBatch, KeyedBeds, JointFriction, ContactMatcher) have one side:
/// one thread at a time makes all calls, also those that add. To add while a step runs, fill a second batch.
/// A batch of patches, and all that is made over it (KeyedPatches, ExtendedPatches), has two sides:
/// - The adding thread calls add, add_group, remove, set_material, and makes and destroys what is over it.
/// - The stepping thread makes all other calls: step, reset, find_force, strengthening_damping,
///   ages, info, stored_energy, state_hash, read_bristles, state_size, save_state, restore_state,
///   patch_count, warm_up, and all calls of KeyedPatches and ExtendedPatches that the adding thread does not
///   make.
/// The two may be one thread, or two that work at the same time; on either side one call at a time. An id is
/// valid at once; the next call of the stepping side, const or not, applies all waiting changes, so two
/// readers need a lock as two writers do. Each change takes time then: spread hundreds of adds over steps.
/// Any thread may call threads() and isa(). Builds with BRISTLE_ASSERTS stop at two calls at once on one
/// side.
///
/// A batch that was moved from may only be destroyed or assigned to. All memory is allocated and freed by the
/// adding thread, and by the constructor, the destructor, warm_up and restore_state.
class BRISTLE_API PatchBatch {
 public:
  /// Makes an empty batch. Throws bristle::Error for a bad option, an instruction set that this machine or
  /// build lacks, or a library that does not belong to these headers (see build_check.hpp).
  explicit PatchBatch(const BatchOptions& options = {});
  PatchBatch(const BatchOptions& options, const BuildSignature& headers);
  ~PatchBatch();
  PatchBatch(PatchBatch&&) noexcept;
  PatchBatch& operator=(PatchBatch&&) noexcept;

  /// Adds a patch, out of contact (load 0), all deflections zero. Throws bristle::Error.
  PatchId add(const Material& material, const PatchOptions& options = {});
  /// Adds `contacts` patches at once, out of contact, to be moved by plain arrays (GroupStep). Contact i has
  /// the seed options.seed + i and the key options.key + i. Their bits are those of patches added one by one.
  /// Throws bristle::Error, also for 0 contacts and more than max_group_size.
  PatchGroup add_group(const Material& material, const PatchOptions& options, std::size_t contacts);
  /// Removes a patch or a group. Throws bristle::Error if there is no such patch or group, and for a single
  /// patch of a group.
  void remove(PatchId id);
  void remove(const PatchGroup& group);
  /// Changes the material. Deflections and the weight w stay; bristles beyond their new snap length snap at
  /// once, and the next response counts them. Throws bristle::Error, also for a change from or to
  /// SnapRule::slide, and for one patch of a group.
  void set_material(PatchId id, const Material& material);
  void set_material(const PatchGroup& group, const Material& material);

  /// Applies all waiting changes and makes all allocations, those of the workers included, so that no later
  /// step allocates. Call it on the stepping thread before the loop.
  void warm_up();

  /// Moves patches by their displacement over dt_s (s). out[i] is the response to in[i]; out must be as long
  /// as in, otherwise every status is Status::bad_input. A patch that no motion names rests under its last
  /// load. A step never throws, allocates or locks, and waits only for its own workers.
  ///
  /// `groups`: groups that move in the same step, before the patches. A contact that is named twice keeps its
  /// first motion (Status::repeated_id). A group that does not exist, or whose arrays are of another length
  /// or whose indices lie beyond it, stays as it is: nothing but its `status` is written, which becomes
  /// Status::unknown_id or bad_input, as does the report's.
  StepReport step(double dt_s, Span<const Motion> in, Span<Response> out,
                  Span<const GroupStep> groups = {}) noexcept;
  StepReport step(double dt_s, const GroupStep& group) noexcept { return step(dt_s, {}, {}, {&group, 1}); }

  /// Returns a patch to the state in which `add` made it: out of contact, all deflections zero, no random
  /// number used. With another seed and key, the result is, to the bit, what `add` would make with them.
  /// False if there is no such patch. A new seed costs one quantile of the snap-length law per bristle;
  /// otherwise a reset costs one pass over the bristles' memory. The energy stored in the bristles is
  /// dropped. For the stepping thread; does not allocate.
  bool reset(PatchId id) noexcept;
  bool reset(PatchId id, std::uint32_t seed, std::uint64_t key) noexcept;

  /// Returns the response that step would give to a trial motion, without changing the state. For implicit
  /// solvers.
  Response find_force(double dt_s, const Motion& motion) noexcept;
  StepReport find_force(double dt_s, const GroupStep& group) noexcept;

  /// Returns the part of Response::damping, in N s/m, that comes from strengthening with speed, under a load
  /// and at a slip speed; 0 for a material that does not strengthen. This friction hardly depends on the
  /// speed and stops a body within a step, so implicit solvers (as in coupling.hpp) must evaluate it at the
  /// speed that they find.
  double strengthening_damping(PatchId id, double normal_load_n, double speed_m_per_s) const noexcept;
  /// Whether the contact ages or has a drop or a lay. Its force limit may then be far above the force at
  /// which it slides.
  bool ages(PatchId id) const noexcept;

  /// Returns state and memory use. For an unknown id, this function and those below return zeros.
  PatchInfo info(PatchId id) const noexcept;
  /// Returns the elastic energy of the bristles in contact, J.
  double stored_energy(PatchId id) const noexcept;
  /// Returns a hash of the state (deflections, snap lengths, states of random numbers, bristles in contact,
  /// weight, overload) and of the material. Equal on every instruction set, worker count and batch
  /// composition.
  std::uint64_t state_hash(PatchId id) const noexcept;
  std::uint64_t state_hash() const noexcept;  ///< hash over all patches in slot order

  /// Writes deflections (m) and snap lengths (m) of the first bristles, as many as fit into the spans. The
  /// spans have equal length; one may be empty if its column is not needed. For a patch with a lay pass both
  /// deflections or none, otherwise no bristle is written. The deflection of a bristle out of contact is 0.
  /// Population::infinite fills the spans: each cohort appears in proportion to its share of the bristles.
  /// Returns the number of bristles written.
  std::size_t read_bristles(PatchId id, Span<double> zx, Span<double> zy, Span<double> delta) const noexcept;

  /// Returns the number of bytes that save_state writes now.
  std::size_t state_size() const noexcept;
  /// Writes the state of all patches; returns the bytes written, 0 if `to` is too small.
  std::size_t save_state(Span<std::byte> to) const noexcept;
  /// Restores what save_state wrote into a batch with the same patches (added in the same order, same
  /// materials, options and seeds; keys, and seeds that reset has set, come from the state). If it does not
  /// fit, throws bristle::Error and leaves the state unchanged.
  void restore_state(Span<const std::byte> from);

  std::size_t patch_count() const noexcept;
  int threads() const noexcept;
  const char* isa() const noexcept;  ///< instruction set in use; lives for ever

  struct Impl;

 private:
  friend struct detail::BatchAccess;
  std::unique_ptr<Impl> impl_;
};

/// Instruction sets of this build, best first, and whether this machine supports them.
struct IsaInfo {
  const char* name;
  bool usable;
};
BRISTLE_API Span<const IsaInfo> instruction_sets() noexcept;

}  // namespace bristle

#include "bristle/build_check.hpp"
