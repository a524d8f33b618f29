// Runs work on several threads.
#pragma once

#include <cstddef>
#include <functional>

namespace cli {

/// Calls `job` with 0 to count - 1, each once and in any order, on `threads` threads including the caller's;
/// on fewer if the system has no more. An exception in one ends all, and is thrown here: a long job calls
/// `check` now and then, which throws if another has failed.
void run_jobs(std::size_t count, std::size_t threads,
              const std::function<void(std::size_t index, const std::function<void()>& check)>& job);

}  // namespace cli
