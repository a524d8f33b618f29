// Binds the calling thread to one core together with a thread that never rests, for the lifetime of this
// object, so that the system must preempt both. Linux.
#pragma once

#include <sched.h>

#include <atomic>
#include <thread>

namespace bristle_test {

class SharedCore {
 public:
  SharedCore() {
    sched_getaffinity(0, sizeof before_, &before_);
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(sched_getcpu(), &one);
    sched_setaffinity(0, sizeof one, &one);
    rival_ = std::thread([this] {  // keeps a core busy; inherits the caller's binding to it
      while (!stop_) {
      }
    });
  }
  ~SharedCore() {
    stop_ = true;
    rival_.join();
    sched_setaffinity(0, sizeof before_, &before_);
  }
  SharedCore(const SharedCore&) = delete;
  SharedCore& operator=(const SharedCore&) = delete;

 private:
  cpu_set_t before_;
  std::atomic<bool> stop_{false};
  std::thread rival_;
};

}  // namespace bristle_test
