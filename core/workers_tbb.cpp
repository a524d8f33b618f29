// The only file that names TBB.
#include <atomic>
#include <optional>
#include <thread>

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/partitioner.h>
#include <oneapi/tbb/task_arena.h>

#include "workers.hpp"

#if defined(__SANITIZE_THREAD__)
// TBB is not built for the thread sanitizer: tell it of the fork and the join. The tags are global because a
// worker must not read anything, not even the address of a tag, before it has acquired the fork.
extern "C" void __tsan_acquire(void*);
extern "C" void __tsan_release(void*);
static char fork_tag, join_tag;
#else
#define __tsan_acquire(address)
#define __tsan_release(address)
#endif

namespace bristle::detail {

struct Workers::Impl {
  // TBB runs no more threads than cores unless told so; tests ask for more.
  std::optional<tbb::global_control> more_threads;
  tbb::task_arena arena;

  explicit Impl(int threads) : arena(threads) {
    if (threads > tbb::this_task_arena::max_concurrency())
      more_threads.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
    arena.initialize();
  }
};

Workers::Workers(int threads)
    : count_(threads > 0 ? threads : static_cast<int>(std::thread::hardware_concurrency())) {
  if (count_ < 1) count_ = 1;
  if (count_ > 1) impl_ = std::make_unique<Impl>(count_);
}

Workers::~Workers() = default;

void Workers::run(int tasks, void (*task)(void*, int), void* context) noexcept {
  if (!impl_ || tasks <= 1) {
    for (int i = 0; i < tasks; ++i) task(context, i);
    return;
  }
  // Made before the fork and read by reference, by index: what a worker reads in our code was written before.
  const auto body = [task, context](int i) {
    __tsan_acquire(&fork_tag);
    task(context, i);
    __tsan_release(&join_tag);
  };
  __tsan_release(&fork_tag);
  impl_->arena.execute([&] {
    // Isolated: a thread that waits here must not pick up a host's unrelated work.
    tbb::this_task_arena::isolate([&] { tbb::parallel_for(0, tasks, body, tbb::simple_partitioner{}); });
  });
  __tsan_acquire(&join_tag);
}

void Workers::warm_up() noexcept {
  if (!impl_) return;
  // Measured: 34 allocations in the first 100 loops, then none.
  std::atomic<int> done{0};
  const auto spin = [](void* counter, int) {
    static_cast<std::atomic<int>*>(counter)->fetch_add(1, std::memory_order_relaxed);
  };
  for (int i = 0; i < 300; ++i) run(64, spin, &done);
}

}  // namespace bristle::detail
