// The thread rule, checked where asserts are on: one call at a time on each side of a batch. The stepping
// side has its readers too; the adding side may be another thread, but one only.
#pragma once

#include "core/common/assert.hpp"

#if BRISTLE_ASSERTS
#include <atomic>
#endif

namespace bristle::detail {

#if BRISTLE_ASSERTS
class SteppingSide {
 public:
  void enter() noexcept {
    const bool another_call_is_under_way = busy_.exchange(true, std::memory_order_acquire);
    BRISTLE_ASSERT(!another_call_is_under_way &&
                   "two threads use one batch at once: thread rule, patch_batch.hpp");
  }
  void leave() noexcept { busy_.store(false, std::memory_order_release); }

 private:
  std::atomic<bool> busy_{false};
};
#else
class SteppingSide {
 public:
  void enter() noexcept {}
  void leave() noexcept {}
};
#endif

/// For the length of one call.
class SteppingCall {
 public:
  explicit SteppingCall(SteppingSide& side) noexcept : side_(side) { side_.enter(); }
  ~SteppingCall() { side_.leave(); }
  SteppingCall(const SteppingCall&) = delete;
  SteppingCall& operator=(const SteppingCall&) = delete;

 private:
  SteppingSide& side_;
};

}  // namespace bristle::detail
