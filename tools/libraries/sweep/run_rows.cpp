// Runs rows of a parameter study on several threads of this machine.
#include <algorithm>
#include <mutex>
#include <thread>

#include "tools/libraries/reports/jobs.hpp"
#include "tools/libraries/sweep/sweep.hpp"

namespace cli {

void run_rows(const Study& study, const std::vector<std::uint64_t>& indices, int threads,
              const std::string& isa, const RowDone& done, const StepCheck& check) {
  const auto wanted = static_cast<std::size_t>(
      threads > 0 ? threads : std::max(1, static_cast<int>(std::thread::hardware_concurrency())));
  std::mutex mutex;
  run_jobs(indices.size(), std::min(wanted, indices.size()),
           [&](std::size_t i, const std::function<void()>& no_other_failed) {
             const StepCheck both = [&] {
               no_other_failed();
               if (check) check();
             };
             both();
             const std::string row = study.run_row(indices[i], isa, both);
             const std::lock_guard lock(mutex);
             done(row);
           });
}

}  // namespace cli
