// Keeps the steps of a batch within a budget of time by leaving out bristles, and gives them back.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "bristle/export.hpp"
#include "bristle/patch_batch.hpp"

namespace bristle {

/// One change of detail: before step `step`, counted from 0, PatchBatch::set_detail(patch, bristles).
struct DetailDecision {
  std::uint64_t step = 0;
  PatchId patch;
  std::uint32_t bristles = 0;
};

struct LoadShedderOptions {
  double budget_s = 0.5e-3;   ///< s, for one step; 1e-9 to 1e3
  double shed_above = 0.95;   ///< share of the budget from which bristles are left out
  double shed_to = 0.75;      ///< share of the budget aimed at then
  double restore_to = 0.85;   ///< share of the budget that a step may take after bristles came back
  int late_steps = 1;         ///< steps in a row above `shed_above` before the first bristle goes
  int wait_steps = 100;       ///< steps between two gifts; longer while gifts had to be taken back
  double rate_s = 0.0;        ///< s per bristle visited, if known; else learnt from the steps
  double change_s = 6e-9;     ///< s per bristle that comes back, once: see PatchBatch::set_detail
  std::size_t record = 4096;  ///< decisions remembered until clear_decisions

  LoadShedderOptions& with_budget(double seconds) {
    budget_s = seconds;
    return *this;
  }
  LoadShedderOptions& with_late_steps(int steps) {
    late_steps = steps;
    return *this;
  }
  LoadShedderOptions& with_wait_steps(int steps) {
    wait_steps = steps;
    return *this;
  }
  LoadShedderOptions& with_rate(double seconds_per_bristle) {
    rate_s = seconds_per_bristle;
    return *this;
  }
  LoadShedderOptions& with_record(std::size_t decisions) {
    record = decisions;
    return *this;
  }
};

/// What is left out at present.
struct ShedReport {
  std::uint32_t patches = 0;         ///< patches with fewer representatives than they have
  std::uint64_t bristles = 0;        ///< representatives left out
  double least_share = 1.0;          ///< of its representatives, in the patch that gave most
  double noise_growth = 1.0;         ///< of the force's fluctuation in sliding there: least_share^-1/2
  double rate_s = 0.0;               ///< s per bristle, as learnt
  std::uint64_t late_steps = 0;      ///< steps that took more than the budget, so far
  std::uint64_t decisions = 0;       ///< changes of detail, so far
  std::uint64_t decisions_lost = 0;  ///< of these, not in the record: it was full
};

/// Sheds load where a budget per step would be missed: fewer representatives of larger weight, patches of the
/// lowest priority first, and takes it back when there is room. Forces stay continuous; they fluctuate more
/// (`sliding_noise`). Nothing is shed without such an object.
///
/// Every decision is recorded. A run that applies the record (`apply_decisions`) instead of asking a clock
/// gives the same bits.
///
/// Each step: `before_step` (optional: foresees a step that would be late, once the time per bristle is
/// known; some 50 ns for each motion), the step, `after_step` with the time it took. Called on the stepping
/// thread; neither allocates, locks nor throws. A time that includes a preemption is no measure of work: give
/// the thread's CPU time where one thread steps (DeadlineMonitor::cpu_now).
class BRISTLE_API LoadShedder {
 public:
  /// Throws bristle::Error.
  explicit LoadShedder(const LoadShedderOptions& options = {});
  ~LoadShedder();
  LoadShedder(LoadShedder&&) noexcept;
  LoadShedder& operator=(LoadShedder&&) noexcept;

  /// The patch may be shed down to `least_bristles` (at least 1; the default keeps the force within a few per
  /// cent), before those of higher priority; those of equal priority share alike. Allocates. Throws
  /// bristle::Error.
  void add(PatchId patch, int priority = 0, std::uint32_t least_bristles = 64);
  /// Forgets a patch: its detail stays as it is.
  void remove(PatchId patch) noexcept;

  /// Sheds if the motions of the next step would take too long. Returns how many details were changed.
  int before_step(PatchBatch& batch, Span<const Motion> in) noexcept;
  /// Learns from a step, sheds if it was too long, gives back if there is room. Returns how many details were
  /// changed. A time that is no positive number is left out of account.
  int after_step(PatchBatch& batch, Span<const Motion> in, double step_time_s,
                 const StepReport& report) noexcept;

  Span<const DetailDecision> decisions() const noexcept;  ///< since clear_decisions, oldest first
  void clear_decisions() noexcept;
  std::uint64_t steps() const noexcept;  ///< after_step calls so far
  ShedReport report(const PatchBatch& batch) const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Replay: applies the decisions at the head of `decisions` that belong before step `step`, and returns how
/// many those are. Call before every step with what is left. Ids must be those of the recorded run: patches
/// added in the same order.
BRISTLE_API std::size_t apply_decisions(PatchBatch& batch, Span<const DetailDecision> decisions,
                                        std::uint64_t step) noexcept;

/// Relative standard deviation of the elastic force of one patch in steady sliding with `active`
/// representatives in contact: c active^-1/2, c from the moments of the snap length (core/MODEL.md, section
/// 4).
BRISTLE_API double sliding_noise(const Material& material, double active) noexcept;

}  // namespace bristle
