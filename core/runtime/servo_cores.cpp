#include "core/runtime/servo_cores.hpp"

#include <atomic>

#include "core/common/assert.hpp"

namespace bristle::detail {
namespace {

cpu_set_t cores_of_this_thread() noexcept {
  cpu_set_t cores;
  CPU_ZERO(&cores);
  if (sched_getaffinity(0, sizeof cores, &cores) !=
      0)  // fails if the machine has more cores than a cpu_set_t; all cores of the set then count as usable
    for (std::size_t i = 0; i < CPU_SETSIZE; ++i) CPU_SET(i, &cores);
  return cores;
}

const cpu_set_t cores_at_load = cores_of_this_thread();

std::atomic<std::uint32_t> batches_on[CPU_SETSIZE];  ///< number of batches that have this core as servo core
std::atomic<std::uint32_t> changes{0};               ///< number of changes to `batches_on`

/// Cores to which a worker thread is bound, and the batch and the servo cores for which they were chosen.
struct Binding {
  std::uint64_t batch = 0;   ///< number of the last batch for which the worker worked; 0 = none
  std::uint32_t change = 0;  ///< value of `changes` when the worker last read the servo cores
  cpu_set_t servo_cores = {};
  cpu_set_t cores = {};  ///< cores to which the system was last asked to bind the worker
  bool bound = false;

  void read_servo_cores() noexcept {
    CPU_ZERO(&servo_cores);
    for (std::size_t i = 0; i < CPU_SETSIZE; ++i)
      if (batches_on[i].load(std::memory_order_relaxed) > 0) CPU_SET(i, &servo_cores);
  }
};
thread_local Binding binding;

std::uint64_t next_batch() noexcept {
  static std::atomic<std::uint64_t> last{0};
  return last.fetch_add(1, std::memory_order_relaxed) + 1;
}

}  // namespace

cpu_set_t process_cores() noexcept {
  const cpu_set_t cores = cores_of_this_thread();
  return CPU_COUNT(&cores) > 1 || CPU_COUNT(&cores_at_load) == 0 ? cores : cores_at_load;
}

ServoCore::ServoCore(int core) noexcept : core_(core), batch_(next_batch()), cores_(process_cores()) {
  BRISTLE_ASSERT(core >= 0 && core < CPU_SETSIZE);
  batches_on[core_].fetch_add(1, std::memory_order_relaxed);
  changes.fetch_add(1, std::memory_order_release);
}

ServoCore::~ServoCore() {
  BRISTLE_ASSERT(batches_on[core_].load(std::memory_order_relaxed) > 0);
  batches_on[core_].fetch_sub(1, std::memory_order_relaxed);
  changes.fetch_add(1, std::memory_order_release);
}

bool ServoCore::keep_worker_off() const noexcept {
  const std::uint32_t change = changes.load(std::memory_order_acquire);
  if (binding.batch == batch_ && binding.change == change) return true;
  if (binding.change != change) binding.read_servo_cores();
  const bool known = binding.batch == batch_;
  binding.batch = batch_;
  binding.change = change;
  const cpu_set_t wanted = worker_cores(cores_, binding.servo_cores, core_);
  if (CPU_EQUAL(&wanted, &binding.cores) && (binding.bound || known)) return true;
  binding.cores = wanted;
  binding.bound = CPU_COUNT(&wanted) > 0 && sched_setaffinity(0, sizeof wanted, &wanted) == 0;
  return binding.bound;
}

}  // namespace bristle::detail
