// Contact patches with an extent: they resist spin, and slide more easily while they spin.
//
// A contact patch is a point. An extended patch is an outline (outline.hpp) whose cells are patches of a
// PatchBatch, of any material and contact model; every cell follows its own path while the outline slides and
// turns. A step takes displacement, spin and load, and gives force and torque about the centre.
//
//     bristle::PatchBatch batch;
//     bristle::ExtendedPatches pads(batch);
//     const auto pad = pads.add(material, options, bristle::Outline::disc(5e-3, bristle::Pressure::hertz));
//     pads.step(dt, {&motion, 1}, {&response, 1});
//
// Axes are those of the surface that the patch lies on (body B). Displacements and forces are given in them;
// the outline belongs to the moving body (A) and turns in them by the spin. Deflections of bristles never
// turn, so no step rotates any state. Equations and limits: core/MODEL.md, section 29.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "bristle/export.hpp"
#include "bristle/material.hpp"
#include "bristle/outline.hpp"
#include "bristle/patch.hpp"
#include "bristle/patch_batch.hpp"
#include "bristle/span.hpp"

namespace bristle {

/// Input of one extended patch for one step. A step refuses values that a Motion may not have, and a spin of
/// more than half a turn, which needs several steps.
struct ExtendedMotion {
  PatchId id;
  /// Motion of the moving body against the surface in this step: displacement of the outline's centre (m, m)
  /// and turn about the normal (rad).
  double displacement[3] = {0.0, 0.0, 0.0};
  double normal_load = 0.0;       ///< load on the whole patch, N, 0 to 1e15
  std::uint8_t has_velocity = 0;  ///< whether `velocity` is given (not 0); if not, it is displacement / dt
  /// Velocity of the outline's centre (m/s, m/s) and spin (rad/s), used for the forces in `damper` only.
  double velocity[3] = {0.0, 0.0, 0.0};
};

/// Output of one extended patch for one step, ON the moving body: force, then torque about the outline's
/// centre (N, N, N m), as in Response. Output fields that the patch does not compute are not written.
struct ExtendedResponse {
  PatchId id;
  Status status = Status::ok;
  std::uint32_t reserved = 0;  ///< padding with a value, so that responses may be compared by memcmp
  double end[3] = {0.0, 0.0, 0.0};
  double elastic[3] = {0.0, 0.0, 0.0};
  double damper[3] = {0.0, 0.0, 0.0};
  /// Force and torque averaged over the step. -(mean . displacement), with the spin as third component, is
  /// exactly the energy put in.
  double mean[3] = {0.0, 0.0, 0.0};

  /// Stiffness of sticking cells (N/m, N, N m): end(d + e) ~ end(d) - stiffness e; symmetric, positive
  /// semidefinite. Leaves out that cells turn while they bear force, which would add the sum of position .
  /// force to the last element.
  double stiffness[3][3] = {};
  double damping[3][3] = {};  ///< N s/m, N s, N m s: as `stiffness`, from Response::damping of the cells
  double force_limit = 0.0;   ///< highest elastic force at first loading, summed over the cells, N
  /// Highest elastic torque at first loading by a pure turn about the centre, N m.
  double torque_limit = 0.0;
  /// Dissipated energy, J, summed over the cells; see Response. The next two fields are sums over the cells
  /// too.
  double dissipated = 0.0;
  double contact_loss = 0.0;
  double damper_work = 0.0;
  std::uint64_t snaps = 0;  ///< number of snaps in all cells; an estimate where one jump skips a long path
};

/// Present state of an extended patch.
struct ExtendedInfo {
  std::uint32_t cells = 0;
  double scale = 0.0;  ///< scale of the outline's given size, from set_scale and growth with the load
  double along[2] = {1.0, 0.0};  ///< the outline's x axis in the axes of the surface, a unit vector
  double normal_load = 0.0;      ///< load of the last step, N
  double max_normal_load = 0.0;  ///< load up to which forces are not scaled, N
  std::uint64_t memory_bytes = 0;
  const char* kernel = "";  ///< name of the kernel variant that steps the patch's cells
};

/// Extended patches over a batch. Several such objects, and point patches, may share one batch.
///
/// Options of a patch are for the whole outline: `max_normal_load` and `bristles` are shared among the cells
/// by weight (every cell has at least one bristle); 0 bristles stays automatic for each cell.
/// The material's viscous friction, a number of the patch, is shared alike. Cells have seeds of
/// their own. A patch whose only cell is its centre is, to the bit, the patch that PatchBatch::add would make
/// with the same options. Outlines of more cells need two axes.
///
/// Thread rule: that of PatchBatch; all cells of an outline change at once.
///
/// The batch must outlive this object, and must not be moved. Nothing allocates but the constructor, the
/// destructor, add, remove, set_material and restore_state. Step cells by this object, or by PatchBatch::step
/// with write_motions; calls that read a patch are allowed.
class BRISTLE_API ExtendedPatches {
 public:
  explicit ExtendedPatches(PatchBatch& batch);
  /// Removes all extended patches of this object from the batch.
  ~ExtendedPatches();
  ExtendedPatches(ExtendedPatches&&) noexcept;
  ExtendedPatches& operator=(ExtendedPatches&&) noexcept;

  /// Adds a patch, out of contact, not turned. Its id is valid in this object, not in the batch. Throws
  /// bristle::Error for options that the batch refuses, for an outline with no or too many cells, and for
  /// cells whose weights do not sum to 1 (to 1e-9).
  PatchId add(const Material& material, const PatchOptions& options, const Outline& outline);
  /// Removes a patch and its cells. Throws bristle::Error if there is no such patch.
  void remove(PatchId id);
  /// Changes the material of all cells, as PatchBatch::set_material.
  void set_material(PatchId id, const Material& material);

  /// Sets the size of the outline as a factor (0 to 1e6) on its given size, from the next step on.
  /// Deflections stay: only the positions of the cells scale. Returns false, and changes nothing, for another
  /// number or an unknown id.
  bool set_scale(PatchId id, double scale) noexcept;

  /// Steps outlines, as PatchBatch::step does patches: out[i] is the response to in[i].
  StepReport step(double dt_s, Span<const ExtendedMotion> in, Span<ExtendedResponse> out) noexcept;
  /// Returns the response that step would give to a trial motion, without changing the state. For implicit
  /// solvers.
  ExtendedResponse find_force(double dt_s, const ExtendedMotion& motion) noexcept;

  /// @name Calls for stepping cells together with other patches of the batch, or for solving for their
  /// motions.
  ///@{
  /// Returns the number of cells of a patch, 0 for an unknown id.
  std::size_t cell_count(PatchId id) const noexcept;
  /// Returns the patches of the batch behind the cells, in the order of the outline. The span is valid until
  /// the next call that the stepping thread makes.
  Span<const PatchId> cell_patches(PatchId id) const noexcept;
  /// Writes position and share of the load of each cell as it stands after a further turn by `spin` (rad)
  /// under this load, as many cells as fit. Positions are in the axes of the surface, m. Returns the number
  /// written.
  std::size_t read_cells(PatchId id, double spin, double normal_load_n, Span<PatchCell> out) const noexcept;
  /// Writes the motions of the cells of all patches that `in` names, one patch after the other, as many
  /// patches as fit. Unknown ids get no motions. Unused entries of `cells` name no patch. Returns the number
  /// written.
  std::size_t write_motions(Span<const ExtendedMotion> in, Span<Motion> cells) const noexcept;
  /// Adds up the cells' responses to responses of the extended patches, and turns the outlines. Call it after
  /// PatchBatch::step of the motions that write_motions wrote for the same `in`. Returns the flags of all
  /// responses, combined.
  Status read_responses(Span<const ExtendedMotion> in, Span<const Response> cells,
                        Span<ExtendedResponse> out) noexcept;
  ///@}

  /// Resets the cells as PatchBatch::reset does, and the outline's turn and scale to their initial values.
  bool reset(PatchId id) noexcept;
  bool reset(PatchId id, std::uint32_t seed, std::uint64_t key) noexcept;

  ExtendedInfo info(PatchId id) const noexcept;     ///< state of a patch; zeros for an unknown id
  double stored_energy(PatchId id) const noexcept;  ///< elastic energy of a patch, J
  /// Returns a hash of a patch's cells, turn and scale; for a point, the hash of its patch.
  std::uint64_t state_hash(PatchId id) const noexcept;
  /// Returns a hash of all extended patches, in the order of their slots.
  std::uint64_t state_hash() const noexcept;

  /// Save and restore the state of the outlines and of the whole batch, as the functions of PatchBatch of the
  /// same names do for patches. PatchBatch::restore_state refuses a state that was saved here.
  std::size_t state_size() const noexcept;
  std::size_t save_state(Span<std::byte> to) const noexcept;
  void restore_state(Span<const std::byte> from);

  std::size_t patch_count() const noexcept;
  PatchBatch& batch() const noexcept;

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace bristle
