// Runs independent jobs on several threads.
#pragma once

#include <cstddef>
#include <functional>

namespace cli {

/// Calls `job` once with each index from 0 to count - 1, in any order, on `threads` threads including the
/// caller's; on fewer if the system has no more. An exception in one call ends the others and is thrown here.
/// A long job should call `check` now and then: it throws once another call has failed.
void run_jobs(std::size_t count, std::size_t threads,
              const std::function<void(std::size_t index, const std::function<void()>& check)>& job);

}  // namespace cli
