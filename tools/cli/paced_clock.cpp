#include "tools/cli/paced_clock.hpp"

#include <cerrno>
#include <cmath>
#include <csignal>
#include <ctime>

namespace cli {
namespace {

constexpr std::int64_t second_ns = 1'000'000'000;

volatile std::sig_atomic_t stop = 0;

std::int64_t now_ns() noexcept {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * second_ns + now.tv_nsec;
}

void sleep_until(std::int64_t ns) noexcept {
  timespec point{};
  point.tv_sec = static_cast<std::time_t>(ns / second_ns);
  point.tv_nsec = static_cast<long>(ns % second_ns);
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &point, nullptr) == EINTR && !stop) {
  }
}

}  // namespace

PacedClock::PacedClock(double period_s, double busy_wait_s)
    : period_ns_(std::llround(period_s * 1e9)), busy_wait_ns_(std::llround(busy_wait_s * 1e9)) {}

void PacedClock::start() noexcept { due_ns_ = now_ns(); }

std::uint64_t PacedClock::wait() noexcept {
  const std::int64_t next = due_ns_ + period_ns_;
  const std::int64_t passed_before = now_ns() - next;
  const std::int64_t left_out = passed_before > 0 ? passed_before / period_ns_ + 1 : 0;
  due_ns_ = next + left_out * period_ns_;
  sleep_until(due_ns_ - busy_wait_ns_);
  while (now_ns() < due_ns_ && !stop) {
  }
  return static_cast<std::uint64_t>(left_out);
}

StopOnSignal::StopOnSignal() noexcept {
  stop = 0;
  struct sigaction action {};
  action.sa_handler = [](int) { stop = 1; };
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

StopOnSignal::~StopOnSignal() {
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
}

bool stop_requested() noexcept { return stop != 0; }

}  // namespace cli
