// The threads that share a step: oneTBB's (workers_tbb.cpp) or the caller alone (workers_serial.cpp).
#pragma once

#include <memory>

namespace bristle::detail {

class Workers {
 public:
  /// Makes `threads` >= 1 workers, counting the caller; 0 = one per core.
  explicit Workers(int threads);
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  int count() const noexcept { return count_; }
  /// Calls task(context, i) once for each i in [0, tasks), on any thread, and returns when all are done. The
  /// caller takes part. Tasks do not throw. Safe inside a host's own task (isolated).
  void run(int tasks, void (*task)(void* context, int index), void* context) noexcept;
  /// Wakes the threads, so that their library makes its allocations in this call and not in a step.
  void warm_up() noexcept;

 private:
  int count_;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace bristle::detail
