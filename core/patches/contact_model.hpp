// The one interface between a patch and the code that computes its friction: a table of operations for each
// contact model and number type. Batch, keyed patches, coupling and the C interface know patches, not
// bristles.
// To add a model, write a record over PatchRecord with its list of columns (columns.hpp) and a table of
// operations, and name it in make_patch.cpp. tests/test_contact_model.cpp has a small model from end to end.
// Unless said otherwise an operation belongs to the stepping thread, runs in the kernels' floating-point
// mode, and neither throws, allocates nor locks.
#pragma once

#include <cstddef>
#include <cstdint>

#include "bristle/span.hpp"
#include "core/common/little_endian.hpp"
#include "core/patches/travel.hpp"

namespace bristle::detail {

/// Operations of a step that is shared among threads. `prepare` returns the number of blocks of 256 bristles;
/// `run` steps a range of them, on any thread, into sums of its own; `finish` gets the sums over all ranges.
struct SharedStep {
  std::uint32_t (*prepare)(Patch&, PatchStep&) noexcept;
  void (*run)(const Patch&, const PatchStep&, std::uint32_t first, std::uint32_t last, Totals&) noexcept;
  void (*finish)(Patch&, const PatchStep&, const Totals&, StepSums&) noexcept;
};

class LanePool;

struct ContactModel {
  const char* name;  ///< name of the contact model, which is hashed into the signature of saved states

  /// Changes the normal load, N, >= 0: bristles come into contact or leave it. Returns the elastic energy
  /// that the patch loses by this, J (0 where the patch computes no energy).
  double (*apply_load)(Patch&, double normal_load_n) noexcept = nullptr;

  /// Steps a patch that moves, on one thread, and fills the sums over the bristles. A trial step
  /// (PatchStep::kernel.stores is 0) must change no state; for patches where it would (needs_copy()) the
  /// caller steps a copy instead.
  void (*step_bristles)(Patch&, PatchStep&, StepSums&) noexcept = nullptr;

  /// Operations that divide a step among several threads; null: one thread takes the whole step.
  const SharedStep* shared = nullptr;

  /// Assigns a lane to a patch of a model whose state is kept in blocks of sixteen contacts
  /// (lanes/lane_block.hpp). Blocks step their patches themselves, so such a model has no apply_load,
  /// step_bristles and copy. Null: the state is in the patch's record. For the adding thread. Throws
  /// std::bad_alloc.
  void (*take_lane)(Patch&, LanePool&) = nullptr;

  /// Resets the patch to its initial state: out of contact, with a new seed of random numbers and a new key.
  void (*reset)(Patch&, std::uint32_t seed, std::uint64_t key) noexcept;
  /// Moves the state of a patch to a patch of another material with the same options, when the material is
  /// changed in use. Bristles that are bent too far for the new material snap, and are counted.
  void (*take_over)(Patch& to, Patch& from) noexcept;
  /// Copies a patch into memory of at least PatchRecord::bytes, aligned to 64 bytes, so that find_force() can
  /// try a load on the copy. The copy owns nothing.
  void (*copy)(const Patch& from, Patch& to, std::byte* memory) noexcept = nullptr;

  // --- reading
  double (*stored_energy)(const Patch&) noexcept;  ///< elastic energy of the bristles in contact, J

  /// Returns a hash of all values on which the patch's future depends. Leaves out caches, sums and padding,
  /// which may differ between equal patches.
  std::uint64_t (*hash)(const Patch&) noexcept;
  void (*describe)(const Patch&, PatchInfo&) noexcept;
  /// Writes deflections and snap lengths of the first `count` bristles, m. Columns whose span is empty are
  /// left out.
  void (*read_bristles)(const Patch&, std::size_t count, Span<double> zx, Span<double> zy,
                        Span<double> delta) noexcept;

  // The functions below are for the saved state of the contact model. Its bytes follow those that all models
  // share (saved_state.hpp).

  /// Returns a hash of the options and material with which a saved state must agree.
  std::uint64_t (*signature)(const Patch&) noexcept;
  /// Writes the state. The number of bytes depends on options and material alone, so a buffer's size can be
  /// known before.
  void (*save)(const Patch&, ByteWriter&) noexcept;
  /// Checks the bytes of a saved state before it is restored. Returns null, or the name of a value that no
  /// patch can have. `contact`: the saved part that all models share; of its record only seed, remainder and
  /// times are valid.
  const char* (*find_fault)(const Patch&, const Patch& contact, ByteReader) noexcept;
  /// Restores the model's own state from bytes in which find_fault found nothing. The caller has restored the
  /// part that all models share.
  void (*restore)(Patch&, std::uint32_t seed, ByteReader from) noexcept;
};

/// Number of blocks in a group, for which one bound on snapping is kept. Every thread's range begins at a
/// multiple of it, so that no group is divided between threads.
constexpr std::uint32_t blocks_per_range = blocks_per_group;

/// Makes a patch out of contact, of the contact model that its options need. The caller owns its record and
/// frees it by release(). `weight`: physical bristles per representative, 0 = automatic. For the adding
/// thread. Throws bristle::Error.
Patch make_patch(std::shared_ptr<const CompiledMaterial> material, const PatchOptions& options,
                 const KernelTable& kernels, double weight = 0.0);

/// Kind of bristles, by what they do at their snap length (SnapRule). `infinite`: infinitely many bristles,
/// which redraw their lengths.
enum class BristleKind : unsigned { keep, redraw, slide, infinite };
/// Returns the name of a patch's kernel, for PatchInfo. `features`: bits of what the patch has beyond its
/// kind, in the order of the table in make_patch.cpp. Does not allocate after name_kernels(), which makes all
/// names.
const char* kernel_name(const Patch& p, BristleKind kind, unsigned features, bool in_double) noexcept;
void name_kernels();

/// Adds the sums of one range of blocks (`part`) to the sums of the whole step.
void add_totals(Totals& sum, const Totals& part) noexcept;

}  // namespace bristle::detail
