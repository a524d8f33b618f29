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
#include "core/patches/patch_step.hpp"

namespace bristle::detail {

enum class LightStep {
  none,   ///< nothing has changed: `advance` has to do it
  holds,  ///< nothing snaps, nothing has changed: the caller carries the sums along
  done    ///< the state is what `advance` would leave, and `end` its sums
};

/// Values of Patch::bound.reach of a patch of which something may snap: nothing more is known, or its model
/// may take a step lightly.
constexpr double no_reach = -1.0;
constexpr double light_reach = -2.0;

struct ContactModel {
  const char* name;  ///< part of the signature of a saved state

  /// Changes the load, N >= 0: bristles enter and leave. Returns the elastic energy that left, J (0 and
  /// uncounted where the patch computes no energy).
  double (*apply_load)(Patch&, double normal_load_n) noexcept;

  /// Advances a patch by a whole step that moves, on one thread: gives the sums, and the state after it if
  /// the step is committed.
  void (*advance)(Patch&, PatchStep&, StepSums&) noexcept;

  // `advance` in three parts, for a patch that several threads share. `prepare` gives the number of ranges;
  // `run` is called once for each, on any thread, with Totals of its own; `finish` takes the sum of all.
  std::uint32_t (*prepare)(Patch&, PatchStep&) noexcept;
  void (*run)(const Patch&, const PatchStep&, std::uint32_t first, std::uint32_t last, Totals&) noexcept;
  void (*finish)(Patch&, const PatchStep&, const Totals&, StepSums&) noexcept;

  /// The patch as it was made with this seed and key.
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
  double (*stored_energy)(const Patch&) noexcept;  ///< J, of the bristles in contact
  /// Hashes all that the patch's future depends on: no cache, no sums, no padding.
  std::uint64_t (*hash)(const Patch&) noexcept;
  void (*describe)(const Patch&, PatchInfo&) noexcept;
  /// Deflections and snap lengths of the first `count` bristles, m; empty spans are left out.
  void (*read_bristles)(const Patch&, std::size_t count, Span<double> zx, Span<double> zy,
                        Span<double> delta) noexcept;

  // --- saved state: what the shared part does not save itself (saved_state.hpp)
  std::uint64_t (*signature)(const Patch&) noexcept;  ///< of options and material: what must agree
  std::size_t (*saved_size)(const Patch&) noexcept;   ///< a function of options and material alone
  void (*save)(const Patch&, ByteWriter&) noexcept;
  /// Checks bytes against the contact in the shared part. Returns null, or the name of a value that no patch
  /// can have.
  const char* (*find_fault)(const Patch&, const Patch& contact, ByteReader) noexcept;
  /// `from` was found without fault; the shared part is restored already.
  void (*restore)(Patch&, std::uint32_t seed, ByteReader from) noexcept;

  /// Takes a step that moves a patch of two axes, without ageing, for the end force alone, if that needs no
  /// look at its bristles. `moved`: the displacement, scaled. Null: never.
  LightStep (*step_lightly)(Patch&, const std::int64_t (&to)[2], const double (&moved)[2],
                            double (&end)[2]) noexcept = nullptr;
};

/// Ranges that a task takes at once are cut at multiples of this: bounds are kept by group of blocks.
constexpr std::uint32_t blocks_per_range = blocks_per_group;

/// A patch out of contact, with its columns filled; the caller owns the record (see release). `weight` 0 =
/// from the material and options. For the thread that adds patches. Throws bristle::Error.
Patch make_patch(std::shared_ptr<const CompiledMaterial> material, const PatchOptions& options,
                 const KernelTable& kernels, double weight = 0.0);

/// The shared part of a patch out of contact: what follows from its options and material.
Patch make_shared_part(PatchRecord& record, const ContactModel& model) noexcept;

/// Adds the totals of one range to those of others.
void add_totals(Totals& sum, const Totals& part) noexcept;

}  // namespace bristle::detail
