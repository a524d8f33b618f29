// The cores that workers may run on: those of the process, less the servo cores of all living batches.
//
// oneTBB shares its workers among batches, so each worker is kept off the servo cores of all of them,
// whichever batch it works for.
#pragma once

#include <sched.h>

#include <cstddef>
#include <cstdint>

namespace bristle::detail {

/// Returns `cores` less all servo cores or, if none is left, less `own` alone; empty if that leaves none
/// either.
inline cpu_set_t worker_cores(const cpu_set_t& cores, const cpu_set_t& servo_cores, int own) noexcept {
  cpu_set_t left;
  CPU_XOR(&left, &cores, &servo_cores);
  CPU_AND(&left, &left, &cores);
  if (CPU_COUNT(&left) > 0) return left;
  left = cores;
  CPU_CLR(static_cast<std::size_t>(own), &left);
  return left;
}

/// Returns the cores that the calling thread may use. If it is bound to one core, returns those of the thread
/// that loaded the library instead, because a single core is a servo thread's own and not all that the host
/// allows.
cpu_set_t process_cores() noexcept;

/// The servo core of a batch, for as long as the batch lives.
class ServoCore {
 public:
  explicit ServoCore(int core) noexcept;
  ~ServoCore();
  ServoCore(const ServoCore&) = delete;
  ServoCore& operator=(const ServoCore&) = delete;

  /// Binds the calling worker to its cores, unless that was done. Returns false if no core is left for it or
  /// the system refuses; repeated calls for the same batch and cores then return true.
  bool keep_worker_off() const noexcept;

 private:
  const int core_;
  const std::uint64_t batch_;  ///< number that identifies the batch
  const cpu_set_t cores_;
};

}  // namespace bristle::detail
