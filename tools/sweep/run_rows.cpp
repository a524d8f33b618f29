// Rows on threads of this machine.
#include <algorithm>
#include <mutex>
#include <thread>

#include <fmt/format.h>

#include "tools/files/user_error.hpp"
#include "tools/reports/jobs.hpp"
#include "tools/sweep/sweep.hpp"

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

Shard parse_shard(const std::string& text) {
  Shard shard;
  if (text.empty()) return shard;
  char end = 0;
  unsigned long long part = 0, parts = 0;
  const int read = std::sscanf(text.c_str(), "%llu/%llu%c", &part, &parts, &end);
  if (read != 2 || part < 1 || parts < 1 || part > parts || parts > 1'000'000 || text[0] == '-')
    throw UserError(fmt::format("--shard is '{}'; allowed: i/N with i from 1 to N, e.g. 3/16", text));
  shard.part = part;
  shard.parts = parts;
  return shard;
}

std::vector<std::uint64_t> rows_to_do(const Study& study, const Shard& shard, const SweepRows& rows) {
  std::vector<std::uint64_t> indices;
  for (std::uint64_t i = shard.part - 1; i < study.rows(); i += shard.parts)
    if (i >= rows.rows.size() || rows.rows[i].empty()) indices.push_back(i);
  return indices;
}

}  // namespace cli
