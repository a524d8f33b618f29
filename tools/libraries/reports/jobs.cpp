#include "tools/libraries/reports/jobs.hpp"

#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace cli {
namespace {

/// Exception that ends a job because a job on another thread has failed. It has no message, because the
/// failed job's is reported.
struct Abandoned {};

}  // namespace

void run_jobs(std::size_t count, std::size_t threads,
              const std::function<void(std::size_t index, const std::function<void()>& check)>& job) {
  std::atomic<std::size_t> next{0};
  std::atomic<bool> failed{false};
  std::mutex mutex;
  std::exception_ptr failure;
  const auto work = [&] {
    try {
      const std::function<void()> check = [&] {
        if (failed.load(std::memory_order_relaxed)) throw Abandoned();
      };
      for (std::size_t i; (i = next++) < count;) {
        check();
        job(i, check);
      }
    } catch (const Abandoned&) {
    } catch (...) {
      const std::lock_guard lock(mutex);
      if (!failure) failure = std::current_exception();
      failed = true;
    }
  };
  std::vector<std::thread> helpers;
  try {
    for (std::size_t t = 1; t < threads; ++t) helpers.emplace_back(work);
  } catch (const std::exception&) {
    // Continues with the threads made so far if the system has no more, or no memory for them.
  }
  work();
  for (std::thread& helper : helpers) helper.join();
  if (failure) std::rethrow_exception(failure);
}

}  // namespace cli
