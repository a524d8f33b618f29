// Work for several threads.
#pragma once

#include <cstddef>
#include <functional>

namespace cli {

/// Calls `job` with 0 to count - 1, each once and in any order, on so many threads, the caller's included; on
/// fewer where the system has no more. What one of them throws ends all of it and is thrown here: a long job
/// calls `check` now and then, which throws where another has failed.
void run_jobs(std::size_t count, std::size_t threads,
              const std::function<void(std::size_t index, const std::function<void()>& check)>& job);

}  // namespace cli
