// The threads among which a step is shared: oneTBB's (workers_tbb.cpp), or only the calling thread
// (workers_serial.cpp).
#pragma once

#include <memory>

namespace bristle::detail {

/// Returns an address that identifies the calling thread. WebAssembly's library has no std::thread.
inline const void* this_thread() noexcept {
  static thread_local char mark;
  return &mark;
}

class Workers {
 public:
  /// Makes a team of `threads` >= 1 threads, counting the caller; 0 means one per core.
  explicit Workers(int threads);
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  int count() const noexcept { return count_; }
  /// Calls task(context, i) once for each i in [0, tasks), on any of the threads, and returns when all are
  /// done. The caller takes part. Tasks must not throw. May be called within a task of the host program: the
  /// caller takes on none of the host's other tasks (isolated).
  void run(int tasks, void (*task)(void* context, int index), void* context) noexcept;
  /// Starts the threads and makes their library's allocations, so that no later step allocates.
  void warm_up() noexcept;

 private:
  int count_;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace bristle::detail
