// Decides when a step is shared among threads, and into pieces of what size it is cut; runs the pieces.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "bristle/deadline_monitor.hpp"
#include "bristle/patch.hpp"
#include "core/runtime/workers.hpp"

namespace bristle::detail {

/// Constants that decide when a step is shared, measured by `bristle_bench --benchmark_filter='^threads/'`.
/// bench/README.md has figures.
struct Sharing {
  /// Least number of bristles to visit for which sharing pays when steps follow each other at once. Workers
  /// are then awake and start within a microsecond (measured break-even below 20,000 bristles).
  std::uint64_t parallel_from = 20000;
  /// Least number of bristles to visit for which sharing pays after a pause, as between the ticks of a servo
  /// loop. A sleeping worker starts after 30 us, in which the calling thread steps some 100,000 bristles
  /// alone (measured break-even 200,000).
  std::uint64_t parallel_from_paused = 200000;
  /// Time since the last shared step, s, after which workers count as asleep. They spin for some 10 us.
  double awake = 20e-6;
  /// Least size of a piece of work that a thread takes at a time, in bristles.
  std::uint64_t smallest_piece = 8192;
  /// Fixed cost of stepping a patch, expressed as a number of bristles; those that it visits are added.
  std::uint64_t patch_overhead = 280;
};

/// Returns the default constants, or those in the environment variable BRISTLE_SHARING
/// ("parallel_from,smallest_piece,patch_overhead"), with which they are measured. Ignores a variable in
/// another form. The constants change times, never results.
inline Sharing chosen_sharing() noexcept {
  const char* const text = std::getenv("BRISTLE_SHARING");
  unsigned long long from = 0, piece = 0, patch = 0;
  char more = 0;
  if (text == nullptr || std::sscanf(text, "%llu,%llu,%llu%c", &from, &piece, &patch, &more) != 3) return {};
  if (piece == 0 || patch == 0) return {};
  return {from, from, 0.0, piece, patch};
}

/// Pause in which steps are not shared, begun when workers have made the caller wait. If the system takes a
/// worker off its core within a piece, nobody can take over that piece, and the caller waits until the worker
/// is back: up to tens of milliseconds. Other programs then want the cores, and sharing would lose more than
/// it gains.
class Retreat {
 public:
  /// Returns whether steps may be shared again. Call it once for each step that is worth sharing: it counts
  /// the steps of the pause.
  bool is_over() noexcept {
    if (steps_alone_ == 0) return true;
    --steps_alone_;
    return false;
  }
  /// Judges a shared step by how long the caller worked and how long it then waited for other threads, s. A
  /// wait that exceeds the work by more than `grace` begins a pause.
  void judge(double worked, double waited) noexcept {
    if (waited > worked + grace) {
      steps_alone_ = length_;
      length_ = std::min(4 * length_, longest);
      good_ = 0;
    } else if (++good_ >= longest) {
      length_ = first;
    }
  }

  /// Lengths of the first and of the longest pause, in steps. A pause that soon follows another is longer
  /// than that.
  static constexpr std::uint32_t first = 32, longest = 8192;

  /// Longest wait that counts as harmless, s. When threads take equal pieces nobody waits longer than for the
  /// last piece.
  static constexpr double grace = 200e-6;

 private:
  std::uint32_t steps_alone_ = 0;
  std::uint32_t length_ = first;
  std::uint32_t good_ = 0;  ///< number of shared steps since the last pause
};

/// The threads of one batch, and what it knows of their delays. Costs are numbers of bristles of a patch that
/// take as long as the work.
class SharedWork {
 public:
  /// As Workers::Workers().
  explicit SharedWork(int threads) : workers(threads) {}

  Workers workers;
  const Sharing constants = chosen_sharing();

  /// Does the work of a step of this cost: by shared() if sharing it among threads pays, otherwise by
  /// alone().
  template <class Alone, class Shared>
  [[gnu::always_inline]] void step(std::uint64_t cost, const Alone& alone, const Shared& shared) noexcept {
    const bool sizable = workers.count() > 1 && cost >= constants.parallel_from;
    if (sizable && pays(cost))
      shared();
    else
      alone();
    if (sizable) last_sizable_step_ = DeadlineMonitor::wall_now();  // workers are awake after such a step
  }
  /// Steps the items [0, count), whose costs add up to `cost`, by go(first, last), on any thread: all at once
  /// or, if sharing them pays, in pieces of about equal cost. Writes tasks and threads into the report.
  template <class CostOf, class Go>
  void step_items(std::size_t count, std::uint64_t cost, const CostOf& cost_of, const Go& go,
                  StepReport& report) noexcept {
    constexpr int most_tasks = 256;
    report.tasks = report.threads = 1;
    const auto share = [&] {
      struct {
        const Go& go;
        std::size_t ends[most_tasks + 1] = {0};
      } pieces{go};
      const std::uint64_t piece = std::max(piece_of(cost), cost / (most_tasks - 1) + 1);
      std::uint64_t taken = 0;
      int tasks = 0;
      for (std::size_t i = 0; i < count; ++i) {
        taken += cost_of(i);
        if (taken < piece && i + 1 < count) continue;
        pieces.ends[++tasks] = i + 1;
        taken = 0;
      }
      run(
          tasks,
          [](void* context, int task) {
            const auto& p = *static_cast<decltype(pieces)*>(context);
            p.go(p.ends[task], p.ends[task + 1]);
          },
          &pieces);
      report.tasks = static_cast<std::uint32_t>(tasks);
      report.threads = static_cast<std::uint32_t>(std::min(tasks, workers.count()));
    };
    step(
        cost, [&] { go(std::size_t{0}, count); }, share);
  }
  /// Returns the cost of the pieces into which a step of this cost is cut.
  std::uint64_t piece_of(std::uint64_t cost) const noexcept {
    return std::max(cost / (static_cast<std::uint64_t>(workers.count()) * 4), constants.smallest_piece);
  }
  /// Runs task(context, i) for each i in [0, tasks), as Workers::run(), and judges how long the caller
  /// waited.
  void run(int tasks, void (*task)(void* context, int index), void* context) noexcept {
    const double start = DeadlineMonitor::wall_now();
    Run run{task, context, this_thread(), start};
    workers.run(
        tasks,
        [](void* self, int index) {
          Run& r = *static_cast<Run*>(self);
          r.task(r.context, index);
          if (this_thread() == r.caller) r.callers_end = DeadlineMonitor::wall_now();
        },
        &run);
    retreat_.judge(run.callers_end - start, DeadlineMonitor::wall_now() - run.callers_end);
  }

 private:
  /// Returns whether a sizable step is worth sharing. Counts the steps of a Retreat.
  bool pays(std::uint64_t cost) noexcept {
    const bool awake = DeadlineMonitor::wall_now() - last_sizable_step_ < constants.awake;
    return (cost >= constants.parallel_from_paused || awake) && retreat_.is_over();
  }

  struct Run {
    void (*task)(void* context, int index);
    void* context;
    const void* caller;
    double callers_end;  ///< time when the caller's last task was done, s
  };

  Retreat retreat_;
  double last_sizable_step_ = -1.0;  ///< time at the end of the last step that may have been worth sharing, s
};

}  // namespace bristle::detail
