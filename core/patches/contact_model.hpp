// The one seam between a patch and what computes its friction: a table of operations, one table per contact
// model (and number type). Batch, keyed patches, shedding, coupling, state files and the C interface know
// patches, not bristles.
//
// To add a model: a record over PatchRecord with its list of columns (columns.hpp), a table, and its name in
// make_patch.cpp. tests/test_contact_model.cpp has a small one from end to end.
//
// Unless said otherwise an operation belongs to the stepping thread, runs in the kernels' floating-point
// mode, and neither throws, allocates nor locks.
#pragma once

#include <cstddef>
#include <cstdint>

#include "bristle/span.hpp"
#include "core/common/little_endian.hpp"
#include "core/patches/travel.hpp"

namespace bristle::detail {

/// The operations of a step that several threads share. `prepare` gives the number of ranges; `run` is called
/// once for each, on any thread, with Totals of its own; `finish` takes the sum of all.
struct SharedStep {
  std::uint32_t (*prepare)(Patch&, PatchStep&) noexcept;
  void (*run)(const Patch&, const PatchStep&, std::uint32_t first, std::uint32_t last, Totals&) noexcept;
  void (*finish)(Patch&, const PatchStep&, const Totals&, StepSums&) noexcept;
};

struct ContactModel {
  const char* name;  ///< part of the signature of a saved state

  /// Changes the load, N >= 0: bristles enter and leave. Returns the elastic energy that left, J (0 where the
  /// patch computes no energy).
  double (*apply_load)(Patch&, double normal_load_n) noexcept;

  /// Advances a patch by a whole step that moves, on one thread: gives the sums, and the state after it if
  /// the step is committed.
  void (*advance)(Patch&, PatchStep&, StepSums&) noexcept;

  /// Answers a travel that leaves Patch::bound if no bristle has to be stepped for it. Called for patches of
  /// two axes that neither damp nor age, for the end force alone. Bound::glide: the state is what `advance`
  /// would leave, and the sums are filled. Null: the model has no such answer.
  Bound (*renew_bound)(Patch&, const Travel&, StepSums&) noexcept = nullptr;
  const SharedStep* shared = nullptr;  ///< null: one thread takes the whole step

  /// Resets the patch to its initial state, with this seed and key.
  void (*reset)(Patch&, std::uint32_t seed, std::uint64_t key) noexcept;
  /// Moves the state of `from` into `to`, made for another material with the same options; books the snaps
  /// that this causes.
  void (*take_over)(Patch& to, Patch& from) noexcept;
  /// Sets the number of representatives that stand for the patch, 1 to PatchRecord::options.bristles, without
  /// a change of force.
  Status (*set_detail)(Patch&, std::uint32_t bristles) noexcept;
  /// Copies a patch for trial loads into memory of at least PatchRecord::bytes, aligned to 64. The copy owns
  /// nothing.
  void (*copy)(const Patch& from, Patch& to, std::byte* memory) noexcept;

  // --- reading
  double (*stored_energy)(const Patch&) noexcept;  ///< J, energy of the bristles in contact
  /// Hashes all that the patch's future depends on: no cache, no sums, no padding.
  std::uint64_t (*hash)(const Patch&) noexcept;
  void (*describe)(const Patch&, PatchInfo&) noexcept;
  /// Writes deflections and snap lengths of the first `count` bristles, m; empty spans are left out.
  void (*read_bristles)(const Patch&, std::size_t count, Span<double> zx, Span<double> zy,
                        Span<double> delta) noexcept;

  // --- saved state: what the shared part does not save itself (saved_state.hpp)
  std::uint64_t (*signature)(const Patch&) noexcept;  ///< hash of the options and material that must agree
  std::size_t (*saved_size)(const Patch&) noexcept;   ///< number of bytes, a function of options and material
                                                      ///< alone
  void (*save)(const Patch&, ByteWriter&) noexcept;
  /// Checks bytes against the contact in the shared part. Returns null, or the name of a value that no patch
  /// can have.
  const char* (*find_fault)(const Patch&, const Patch& contact, ByteReader) noexcept;
  /// Restores the state from bytes in which find_fault found nothing. The shared part is restored already.
  void (*restore)(Patch&, std::uint32_t seed, ByteReader from) noexcept;
};

/// Ranges of a task begin at multiples of this number of blocks, because bounds are kept by group of blocks.
constexpr std::uint32_t blocks_per_range = blocks_per_group;

/// Makes a patch out of contact, with its columns filled; the caller owns the record (see release). `weight`
/// 0 = from the material and options. For the thread that adds patches. Throws bristle::Error.
Patch make_patch(std::shared_ptr<const CompiledMaterial> material, const PatchOptions& options,
                 const KernelTable& kernels, double weight = 0.0);

/// Adds the totals of one range to `sum`.
void add_totals(Totals& sum, const Totals& part) noexcept;

}  // namespace bristle::detail
