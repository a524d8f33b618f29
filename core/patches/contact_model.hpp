// The one interface between a patch and the code that computes its friction: a table of operations, one for
// each contact model (and number type). Batch, keyed patches, load shedder, coupling, state files and the C
// interface know patches, not bristles. To add a model, write a record over PatchRecord with its list of
// columns (columns.hpp) and a table, and name it in make_patch.cpp. tests/test_contact_model.cpp has a small
// model from end to end. Unless said otherwise an operation belongs to the stepping thread, runs in the
// kernels' floating-point mode, and neither throws, allocates nor locks.
#pragma once

#include <cstddef>
#include <cstdint>

#include "bristle/span.hpp"
#include "core/common/little_endian.hpp"
#include "core/patches/travel.hpp"

namespace bristle::detail {

/// Operations of a step that several threads share. `prepare` returns the number of blocks; `run` steps a
/// range of them, on any thread, into Totals of its own; `finish` gets the sum of all Totals.
struct SharedStep {
  std::uint32_t (*prepare)(Patch&, PatchStep&) noexcept;
  void (*run)(const Patch&, const PatchStep&, std::uint32_t first, std::uint32_t last, Totals&) noexcept;
  void (*finish)(Patch&, const PatchStep&, const Totals&, StepSums&) noexcept;
};

struct ContactModel {
  const char* name;  ///< name of the model, a part of the signature of saved states

  /// Changes the load, N >= 0: bristles come into contact or leave it. Returns the elastic energy of those
  /// that left, J (0 where the patch computes no energy).
  double (*apply_load)(Patch&, double normal_load_n) noexcept;

  /// Advances a patch by a whole step in which it moves, on one thread. Fills the sums, and changes the state
  /// if the step is committed.
  void (*advance)(Patch&, PatchStep&, StepSums&) noexcept;

  /// Answers a motion that leaves Patch::bound if no bristle has to be stepped for it. Called for patches of
  /// two axes that neither damp nor age, when only the end force is asked for. If it returns Bound::glide,
  /// the state is as after `advance`, and the sums are filled. Null: the model has no such function.
  Bound (*renew_bound)(Patch&, const Travel&, StepSums&) noexcept = nullptr;
  const SharedStep* shared = nullptr;  ///< operations for several threads; null: one thread takes the whole
                                       ///< step

  /// Resets the patch to its initial state, with this seed and key.
  void (*reset)(Patch&, std::uint32_t seed, std::uint64_t key) noexcept;
  /// Moves the state of `from` into `to`, a patch of another material with the same options, and counts the
  /// snaps that the change causes.
  void (*take_over)(Patch& to, Patch& from) noexcept;
  /// Sets the number of representatives that stand for the patch, 1 to PatchRecord::options.bristles, without
  /// a change of force.
  Status (*set_detail)(Patch&, std::uint32_t bristles) noexcept;
  /// Copies a patch for trial loads into memory of at least PatchRecord::bytes, aligned to 64. The copy owns
  /// nothing.
  void (*copy)(const Patch& from, Patch& to, std::byte* memory) noexcept;

  // --- reading
  double (*stored_energy)(const Patch&) noexcept;  ///< J, elastic energy of the bristles in contact

  /// Hashes all that the patch's future depends on: no cache, no sums, no padding.
  std::uint64_t (*hash)(const Patch&) noexcept;
  void (*describe)(const Patch&, PatchInfo&) noexcept;
  /// Writes deflections and snap lengths of the first `count` bristles, m; empty spans are left out.
  void (*read_bristles)(const Patch&, std::size_t count, Span<double> zx, Span<double> zy,
                        Span<double> delta) noexcept;

  // --- saved state of the model, which follows that of the shared part (saved_state.hpp)
  std::uint64_t (*signature)(const Patch&) noexcept;  ///< hash of the options and material that a saved state
                                                      ///< must agree with
  /// Writes the state. The number of bytes depends on options and material alone.
  void (*save)(const Patch&, ByteWriter&) noexcept;
  /// Checks bytes of a saved state. `contact`: saved shared part of the patch. Returns null, or the name of a
  /// value that no patch can have.
  const char* (*find_fault)(const Patch&, const Patch& contact, ByteReader) noexcept;
  /// Restores the state from bytes in which find_fault found nothing. The shared part of the patch must be
  /// restored already.
  void (*restore)(Patch&, std::uint32_t seed, ByteReader from) noexcept;
};

/// Number of blocks of which the beginning of a task's range is a multiple, because bounds are kept by group
/// of blocks.
constexpr std::uint32_t blocks_per_range = blocks_per_group;

/// Makes a patch out of contact, bristle arrays filled; the caller owns the record (see release). `weight`:
/// bristles per representative, 0 = from material and options. For the adding thread. Throws bristle::Error.
Patch make_patch(std::shared_ptr<const CompiledMaterial> material, const PatchOptions& options,
                 const KernelTable& kernels, double weight = 0.0);

/// Adds the totals of one range to `sum`.
void add_totals(Totals& sum, const Totals& part) noexcept;

}  // namespace bristle::detail
