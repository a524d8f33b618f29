// The threads that share a step, by oneTBB. No other file includes oneTBB.
#include <atomic>
#include <cstdint>
#include <optional>
#include <thread>
#include <vector>

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/partitioner.h>
#include <oneapi/tbb/task_arena.h>

#include "core/runtime/workers.hpp"

#if defined(__SANITIZE_THREAD__)
// Reports the fork and the join of a step to the thread sanitizer, which cannot see them inside TBB because
// TBB is not built for it. The tags are global, because a worker must not read even the address of a tag
// before it has acquired the fork.
extern "C" void __tsan_acquire(void*);
extern "C" void __tsan_release(void*);
static char fork_tag, join_tag;
#else
#define __tsan_acquire(address)
#define __tsan_release(address)
#endif

namespace bristle::detail {

namespace {

/// Tasks assigned to one thread that nobody has begun. The thread itself takes them from the front, other
/// threads steal them from the back.
class alignas(64) Share {
 public:
  void fill(int first, int last) noexcept { range_.store(pack(first, last), std::memory_order_relaxed); }
  /// Takes the next task from this share, the front one if the share is the thread's `own`; -1 if none is
  /// left.
  int take(bool own) noexcept {
    std::uint64_t range = range_.load(std::memory_order_relaxed);
    for (;;) {
      const int first = static_cast<int>(range & 0xFFFFFFFFu), last = static_cast<int>(range >> 32);
      if (first >= last) return -1;
      const std::uint64_t remaining = own ? pack(first + 1, last) : pack(first, last - 1);
      if (range_.compare_exchange_weak(range, remaining, std::memory_order_relaxed))
        return own ? first : last - 1;
    }
  }

 private:
  static std::uint64_t pack(int first, int last) noexcept {
    return static_cast<std::uint64_t>(first) | static_cast<std::uint64_t>(last) << 32;
  }
  std::atomic<std::uint64_t> range_{0};
};

}  // namespace

struct Workers::Impl {
  // Raises TBB's limit of one thread per core, because tests ask for more threads than cores.
  std::optional<tbb::global_control> more_threads;
  tbb::task_arena arena;
  std::vector<Share> shares;  ///< tasks left for each thread, by its slot in the arena

  explicit Impl(int threads) : arena(threads), shares(static_cast<std::size_t>(threads)) {
    if (threads > tbb::this_task_arena::max_concurrency())
      more_threads.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
    arena.initialize();
  }

  void share_out(int tasks) noexcept {
    const auto n = static_cast<std::int64_t>(shares.size());
    for (std::int64_t k = 0; k < n; ++k)
      shares[static_cast<std::size_t>(k)].fill(static_cast<int>(tasks * k / n),
                                               static_cast<int>(tasks * (k + 1) / n));
  }
  /// Takes the next task for the thread in this slot: one of its own, else one of another thread that nobody
  /// has begun; -1 if none is left.
  int next_task(std::size_t slot) noexcept {
    for (std::size_t k = 0; k < shares.size(); ++k) {
      const int task = shares[(slot + k) % shares.size()].take(k == 0);
      if (task >= 0) return task;
    }
    return -1;
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
  impl_->share_out(tasks);
  // Makes the loop's body before the fork and passes it by reference, so that workers read only memory of
  // this library that was written before the fork. The thread sanitizer would report other reads.
  const auto body = [task, context, impl = impl_.get()](int) {
    __tsan_acquire(&fork_tag);
    const int index = tbb::this_task_arena::current_thread_index();
    const auto slot = static_cast<std::size_t>(index < 0 ? 0 : index);
    for (int i = impl->next_task(slot); i >= 0; i = impl->next_task(slot)) task(context, i);
    __tsan_release(&join_tag);
  };
  __tsan_release(&fork_tag);
  impl_->arena.execute([&] {
    // Isolates the loop. Otherwise a thread that waits here might pick up unrelated work of the host program.
    tbb::this_task_arena::isolate([&] { tbb::parallel_for(0, count_, body, tbb::simple_partitioner{}); });
  });
  __tsan_acquire(&join_tag);
}

void Workers::warm_up() noexcept {
  if (!impl_) return;
  // Runs more than 100 empty loops, because oneTBB allocates memory in its first 100 loops.
  std::atomic<int> done{0};
  const auto spin = [](void* counter, int) {
    static_cast<std::atomic<int>*>(counter)->fetch_add(1, std::memory_order_relaxed);
  };
  for (int i = 0; i < 300; ++i) run(64, spin, &done);
}

}  // namespace bristle::detail
