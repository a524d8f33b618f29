// Keeps the steps of a batch within a time budget by leaving out bristles, and restores them when time
// allows.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "bristle/export.hpp"
#include "bristle/patch_batch.hpp"
#include "bristle/set_field.hpp"

namespace bristle {

/// One change of detail: the call PatchBatch::set_detail(patch, bristles) before step `step`, counted from 0.
struct DetailDecision {
  std::uint64_t step = 0;
  PatchId patch;
  std::uint32_t bristles = 0;
};

struct LoadShedderOptions {
  double budget_s = 0.5e-3;   ///< s, time budget of one step; 1e-9 to 1e3
  double shed_above = 0.95;   ///< share of the budget above which bristles are left out
  double shed_to = 0.75;      ///< share of the budget that a step may take after bristles are left out
  double restore_to = 0.85;   ///< share of the budget that a step may take after bristles are restored
  int late_steps = 1;         ///< number of steps in a row above `shed_above` before bristles are left out
  int wait_steps = 100;       ///< number of steps between two restorations; more after one that had to be
                              ///< undone
  double rate_s = 0.0;        ///< s, first estimate of the step time per bristle visited; 0 = unknown
  double change_s = 6e-9;     ///< s, one-off cost of a restored bristle: see PatchBatch::set_detail
  std::size_t record = 4096;  ///< number of decisions remembered until clear_decisions

  LoadShedderOptions& with_budget(double seconds) { return detail::set(*this, budget_s, seconds); }
  LoadShedderOptions& with_late_steps(int steps) { return detail::set(*this, late_steps, steps); }
  LoadShedderOptions& with_wait_steps(int steps) { return detail::set(*this, wait_steps, steps); }
  LoadShedderOptions& with_rate(double seconds_per_bristle) {
    return detail::set(*this, rate_s, seconds_per_bristle);
  }
  LoadShedderOptions& with_record(std::size_t decisions) { return detail::set(*this, record, decisions); }
};

/// Report on the bristles that are left out at present, and their effect.
struct ShedReport {
  std::uint32_t patches = 0;   ///< number of patches that use fewer representatives or pieces than they have
  std::uint64_t bristles = 0;  ///< number of representatives and pieces left out
  double least_share = 1.0;    ///< share of its representatives or pieces that the most reduced patch keeps
  double noise_growth = 1.0;   ///< growth of the force fluctuation in sliding of the patch that keeps the
                               ///< least share of its representatives: share^-1/2
  double rate_s = 0.0;         ///< s, estimated step time per bristle visited, if each patch counts
                               ///< as 280 bristles more; 0 = unknown
  std::uint64_t late_steps = 0;      ///< number of steps so far that took more than the budget
  std::uint64_t decisions = 0;       ///< number of changes of detail so far
  std::uint64_t decisions_lost = 0;  ///< number of decisions missing from the record, because it was full
  double error_growth = 1.0;  ///< growth of the error of the infinite brush that keeps the least share of its
                              ///< pieces: share^-2
  std::uint32_t at_least = 0;  ///< number of patches at the least number of bristles or pieces that they
                               ///< may use; if all patches are, late steps stay late
};

/// Sheds load when steps would exceed their time budget: patches, lowest priority first, use fewer
/// representatives of larger weight, and get them back when time allows. Forces stay continuous but fluctuate
/// more (`sliding_noise`). An infinite brush uses fewer pieces of path instead: its force gets no noise, but
/// its error grows (ShedReport::error_growth). Without such an object nothing is shed.
///
/// Decisions are recorded, up to LoadShedderOptions::record. A run that applies the record
/// (`apply_decisions`) instead of reading a clock gives the same bits.
///
/// In each step, call `before_step` (optional: it predicts a late step once the time per bristle is known),
/// step the batch, and call `after_step` with the time of the step.
/// Call both on the stepping thread; they do not allocate, lock or throw. A time that includes a preemption
/// does not measure work: if one thread steps, pass its CPU time (DeadlineMonitor::cpu_now).
class BRISTLE_API LoadShedder {
 public:
  /// Throws bristle::Error.
  explicit LoadShedder(const LoadShedderOptions& options = {});
  ~LoadShedder();
  LoadShedder(LoadShedder&&) noexcept;
  LoadShedder& operator=(LoadShedder&&) noexcept;

  /// Allows the patch to be reduced to `least_bristles` (at least 1; with the default, under full load, the
  /// force fluctuates by some 8 % rms in sliding: redraw, lognormal, cv 0.3), before patches of higher
  /// priority; patches of equal priority are reduced by the same share. An infinite brush keeps
  /// `least_bristles` pieces or half of its own, whichever is fewer, and at least 4, because at 1 or 2 pieces
  /// its energy does not balance. So 8 pieces, the default, can become 4, and 4 stay. Allocates. Throws
  /// bristle::Error.
  void add(PatchId patch, int priority = 0, std::uint32_t least_bristles = 64);
  /// Removes a patch from the shedder: its number of representatives stays as it is.
  void remove(PatchId patch) noexcept;

  /// Sheds load if a step with these motions would take too long. Returns the number of patches changed.
  int before_step(PatchBatch& batch, Span<const Motion> in) noexcept;
  /// Updates the estimate from a step, sheds if the step was too long, and restores bristles if time allows.
  /// Returns the number of patches changed. A time that is not a positive number is ignored.
  int after_step(PatchBatch& batch, Span<const Motion> in, double step_time_s,
                 const StepReport& report) noexcept;

  Span<const DetailDecision> decisions() const noexcept;  ///< decisions since clear_decisions, oldest first
  void clear_decisions() noexcept;
  std::uint64_t steps() const noexcept;  ///< number of after_step calls so far
  ShedReport report(const PatchBatch& batch) const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Replays the decisions at the head of `decisions` that belong before step `step`, and returns their number.
/// Call it before every step with the remaining decisions. Ids must be those of the recorded run: add patches
/// in the same order.
BRISTLE_API std::size_t apply_decisions(PatchBatch& batch, Span<const DetailDecision> decisions,
                                        std::uint64_t step) noexcept;

/// Returns the relative standard deviation of the elastic force of one patch in steady sliding with `active`
/// representatives in contact, without residual length and shared renewal: c active^-1/2, where c follows
/// from the moments of the snap length (core/MODEL.md, section 4); 0 for SnapRule::slide.
BRISTLE_API double sliding_noise(const Material& material, double active) noexcept;

}  // namespace bristle
