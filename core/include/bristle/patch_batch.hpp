// Many contact patches, stepped together against a deadline.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "bristle/export.hpp"
#include "bristle/material.hpp"
#include "bristle/patch.hpp"
#include "bristle/span.hpp"

namespace bristle {

struct BuildSignature;

struct BatchOptions {
  int threads = 1;            ///< threads that may step, the caller included; 0 = one per core
  const char* isa = nullptr;  ///< "scalar", "sse2", "avx2", ...; null = BRISTLE_ISA or the best here
  bool eager = false;         ///< visit every bristle in every step: the same bits, slower; for comparison
  int servo_core = -1;        ///< workers keep off this core; -1 = they run where the system puts them

  BatchOptions& with_threads(int count) {
    threads = count;
    return *this;
  }
  BatchOptions& with_isa(const char* name) {
    isa = name;
    return *this;
  }
  BatchOptions& with_eager(bool value) {
    eager = value;
    return *this;
  }
  /// Workers are bound to the other cores of this process (numbered from 0, as in sched_setaffinity). For a
  /// loop that steps once a millisecond on a thread of its own core: a worker that sleeps between ticks is
  /// often woken on the core of the thread that waits for it, and then takes no work. Bind the stepping
  /// thread to `core` yourself. oneTBB shares its workers with the host and among batches; those that have
  /// worked here stay off the servo cores of all batches. Where the system does not allow it, they work
  /// unbound: see PatchBatch::unbound_workers. Bits do not depend on it, and with one thread it means
  /// nothing. The cores of the process are those of the thread that makes the batch, or, if it is bound to a
  /// single core, those that the process had when the library was loaded.
  BatchOptions& with_servo_core(int core) {
    servo_core = core;
    return *this;
  }
};

/// What a step did as a whole.
struct StepReport {
  Status status = Status::ok;          ///< all responses' flags together
  std::uint32_t patches_stepped = 0;   ///< motions that were carried out
  std::uint32_t tasks = 0;             ///< pieces of work; 1 = all on the calling thread, 0 = refused
  std::uint32_t threads = 0;           ///< threads that took a piece of work, the caller included
  std::uint64_t bristles_visited = 0;  ///< bristles that a kernel looked at
};

/// Contact patches of the brush model.
///
/// Thread rule: one thread, the stepping thread, calls step, move, force, reset, find_force, set_detail,
/// info, stored_energy, state_hash, read_bristles, state_size, save_state, restore_state and patch_count. One
/// other thread (or the same one) may call add, remove and set_material at the same time; an id is valid at
/// once, the change takes effect at the stepping thread's next call. threads() and isa() may be called by
/// anyone. A batch that was moved from may only be destroyed or assigned to. All memory is taken and freed by
/// the thread that calls add, remove, set_material, warm_up or the constructor and destructor.
class BRISTLE_API PatchBatch {
 public:
  /// Throws bristle::Error on a bad option, an instruction set that this machine or build lacks, or a library
  /// that these headers do not belong to (see build_check.hpp).
  explicit PatchBatch(const BatchOptions& options = {});
  PatchBatch(const BatchOptions& options, const BuildSignature& headers);
  ~PatchBatch();
  PatchBatch(PatchBatch&&) noexcept;
  PatchBatch& operator=(PatchBatch&&) noexcept;

  /// A new patch, out of contact (load 0), all deflections zero. Throws bristle::Error.
  PatchId add(const Material& material, const PatchOptions& options = {});
  /// Throws bristle::Error when there is no such patch.
  void remove(PatchId id);
  /// Changes the material from the next step on. Deflections and the weight w stay; bristles then
  /// beyond their snap length snap at once and are counted. Throws bristle::Error.
  void set_material(PatchId id, const Material& material);

  /// Call on the stepping thread before the loop: takes every change that waits and spends every
  /// allocation, the workers' included.
  void warm_up();

  /// Moves patches by their displacement over dt_s (s). out[i] answers in[i]; out must be as long as
  /// in, else everything is Status::bad_input. A patch not named rests under its last load. Never
  /// throws, allocates, locks, or waits for anything but its own workers.
  StepReport step(double dt_s, Span<const Motion> in, Span<Response> out) noexcept;

  /// @name For programs with few patches: set motions one by one, step, read forces.
  ///@{
  void move(PatchId id, double dx_m, double dy_m, double normal_load_n) noexcept;  ///< for the next step
  StepReport step(double dt_s) noexcept;                                           ///< takes what move() set
  /// Of the last step(dt_s) that moved the patch; Status::unknown_id where there is none, as after a reset or
  /// restore_state.
  Response force(PatchId id) const noexcept;
  ///@}

  /// Makes a patch what `add` made it: out of contact, all deflections zero, no draw made; with another seed
  /// and key, what `add` would make with them, to the bit. False when there is no such patch. A new seed
  /// costs a quantile of the snap-length law for every bristle, else a reset costs a pass over the bristles'
  /// memory. What energy the bristles held is forgotten. For the stepping thread; does not allocate.
  bool reset(PatchId id) noexcept;
  bool reset(PatchId id, std::uint32_t seed, std::uint64_t key) noexcept;

  /// The response to a trial motion, state unchanged: what step would give. For implicit solvers.
  Response find_force(double dt_s, const Motion& motion) noexcept;

  /// The patch goes on with `bristles` representatives (1 to its n) of weight zeta_max / bristles, from now
  /// on: less work and a noisier force, or back again. Forces stay as they are, at rest and in sliding;
  /// nothing snaps. The energy that the change takes (or, negative, brings) is in the next `contact_loss`.
  /// Costs 3 to 5 ns for each bristle that stays (fewer) or that comes back (more), once. Neither throws nor
  /// allocates. Status::unknown_id or bad_input: nothing changed. See core/MODEL.md,
  /// "Detail".
  Status set_detail(PatchId id, std::uint32_t bristles) noexcept;

  /// An unknown id gives zeros, here and below.
  PatchInfo info(PatchId id) const noexcept;
  /// Elastic energy w sigma0 / 2 sum |z|^2 of the bristles in contact, J.
  double stored_energy(PatchId id) const noexcept;
  /// Hash of deflections, block displacements, snap lengths, draw counters, active count, weight, overload
  /// factor and material, in bristle order. Equal on every instruction set, worker count and batch
  /// composition.
  std::uint64_t state_hash(PatchId id) const noexcept;
  std::uint64_t state_hash() const noexcept;  ///< over all patches in slot order

  /// Deflections (m) and snap lengths (m) of the first bristles, as many as the spans hold (equal
  /// lengths, or empty for a column not wanted). Bristles out of contact read 0. Returns how many.
  std::size_t read_bristles(PatchId id, Span<double> zx, Span<double> zy, Span<double> delta) const noexcept;

  /// Bytes that save_state writes now.
  std::size_t state_size() const noexcept;
  /// Writes the state of all patches; returns the bytes written, 0 when `to` is too small.
  std::size_t save_state(Span<std::byte> to) const noexcept;
  /// Restores what save_state wrote into a batch with the same patches (added in the same order, same
  /// materials and options; seeds and keys come from the state). Throws bristle::Error, state unchanged, when
  /// it does not fit.
  void restore_state(Span<const std::byte> from);

  std::size_t patch_count() const noexcept;
  int threads() const noexcept;
  /// Workers that should keep off the servo core and could not be bound, so far. May be called by anyone.
  int unbound_workers() const noexcept;
  const char* isa() const noexcept;  ///< instruction set in use; lives for ever

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

/// Instruction sets of this build, best first, and whether this machine runs them.
struct IsaInfo {
  const char* name;
  bool usable;
};
BRISTLE_API Span<const IsaInfo> instruction_sets() noexcept;

}  // namespace bristle

#include "bristle/build_check.hpp"
