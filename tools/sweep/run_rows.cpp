// Rows on threads of this machine.
#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>

#include <fmt/format.h>

#include "tools/files/user_error.hpp"
#include "tools/sweep/sweep.hpp"

namespace cli {
namespace {

/// Raised where another thread has failed: says nothing by itself.
struct Abandoned {};

class Workers {
 public:
  Workers(const Study& study, const std::vector<std::uint64_t>& indices, const std::string& isa,
          const RowDone& done, const StepCheck& check)
      : study_(study), indices_(indices), isa_(isa), done_(done), check_(check) {}

  void run(std::size_t threads) {
    std::vector<std::thread> helpers;
    try {
      for (std::size_t t = 1; t < threads; ++t) helpers.emplace_back([this] { work(); });
    } catch (const std::exception&) {
      // The system has no more threads: those that there are do the work.
    }
    work();
    for (std::thread& helper : helpers) helper.join();
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  void work() {
    try {
      const StepCheck check = [this] {
        if (failed_.load(std::memory_order_relaxed)) throw Abandoned();
        if (check_) check_();
      };
      for (std::size_t i; (i = next_++) < indices_.size();) {
        check();
        const std::string row = study_.run_row(indices_[i], isa_, check);
        const std::lock_guard lock(mutex_);
        done_(row);
      }
    } catch (const Abandoned&) {
    } catch (...) {
      const std::lock_guard lock(mutex_);
      if (!failure_) failure_ = std::current_exception();
      failed_ = true;
    }
  }

  const Study& study_;
  const std::vector<std::uint64_t>& indices_;
  const std::string& isa_;
  const RowDone& done_;
  const StepCheck& check_;
  std::atomic<std::size_t> next_{0};
  std::atomic<bool> failed_{false};
  std::mutex mutex_;
  std::exception_ptr failure_;
};

}  // namespace

void run_rows(const Study& study, const std::vector<std::uint64_t>& indices, int threads,
              const std::string& isa, const RowDone& done, const StepCheck& check) {
  const auto wanted = static_cast<std::size_t>(
      threads > 0 ? threads : std::max(1, static_cast<int>(std::thread::hardware_concurrency())));
  Workers(study, indices, isa, done, check).run(std::min(wanted, indices.size()));
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
