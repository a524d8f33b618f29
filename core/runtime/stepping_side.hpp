// Checks the thread rule (patch_batch.hpp) in builds with asserts: at any time at most one thread may be in a
// call of the adding kind, and one in a call of the stepping kind. A call may make further calls on its own
// thread.
#pragma once

#include "core/common/assert.hpp"
#include "core/runtime/workers.hpp"

#if BRISTLE_ASSERTS
#include <atomic>
#endif

namespace bristle::detail {

#if BRISTLE_ASSERTS
class SteppingSide {
 public:
  void enter() noexcept {
    const void* owner = owner_.load(std::memory_order_relaxed);
    const bool no_other_call_is_under_way =
        owner == this_thread() ||
        (owner == nullptr && owner_.compare_exchange_strong(owner, this_thread(), std::memory_order_acquire));
    BRISTLE_ASSERT(no_other_call_is_under_way &&
                   "two threads use one batch at once: thread rule, patch_batch.hpp");
    ++depth_;
  }
  void leave() noexcept {
    if (--depth_ == 0) owner_.store(nullptr, std::memory_order_release);
  }

 private:
  std::atomic<const void*> owner_{nullptr};  ///< thread whose call is under way on this side
  int depth_ = 0;                            ///< number of nested calls of that thread
};
#else
class SteppingSide {
 public:
  void enter() noexcept {}
  void leave() noexcept {}
};
#endif

/// Keeps one side of a batch (adding or stepping) busy for the length of a call, so that a second thread's
/// call is caught.
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
