#include "tools/libraries/run/paced_clock.hpp"

#include <atomic>
#include <cmath>
#include <csignal>

#include "tools/libraries/platform/platform.hpp"

namespace cli {
namespace {

constexpr std::int64_t second_ns = 1'000'000'000;

constexpr std::int64_t same_signal_ns = second_ns / 2;

std::atomic<std::int64_t> first_signal_ns{0};  // time of the first stop signal, ns; 0: none yet
static_assert(std::atomic<std::int64_t>::is_always_lock_free, "a signal handler may use no other");

// Handles a stop signal such as Ctrl-C. Calls only functions that are allowed in a signal handler.
void on_signal(int signal) {
  const std::int64_t now = platform::now_ns();
  std::int64_t first = 0;
  if (first_signal_ns.compare_exchange_strong(first, now) || now - first <= same_signal_ns) return;
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

}  // namespace

PacedClock::PacedClock(double period_s, double busy_wait_s)
    : period_ns_(std::llround(period_s * 1e9)), busy_wait_ns_(std::llround(busy_wait_s * 1e9)) {}

void PacedClock::start() noexcept { due_ns_ = platform::now_ns(); }

std::uint64_t PacedClock::wait() noexcept {
  const std::int64_t next = due_ns_ + period_ns_;
  const std::int64_t passed_before = platform::now_ns() - next;
  const std::int64_t left_out = passed_before > 0 ? passed_before / period_ns_ + 1 : 0;
  due_ns_ = next + left_out * period_ns_;
  platform::sleep_until(due_ns_ - busy_wait_ns_, &stop_requested);
  while (platform::now_ns() < due_ns_ && !stop_requested()) {
  }
  return static_cast<std::uint64_t>(left_out);
}

void stop_on_signals() noexcept { platform::on_stop_signals(&on_signal); }

bool stop_requested() noexcept { return first_signal_ns != 0; }

}  // namespace cli
