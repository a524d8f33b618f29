// What other systems with POSIX, such as macOS, do without.
#include <unistd.h>

#include <chrono>
#include <limits>
#include <thread>

#include "tools/libraries/platform/platform.hpp"

namespace cli::platform {

std::filesystem::path program_folder() { return {}; }

std::string cpu_model() { return "unknown"; }

std::uint64_t free_memory() { return std::numeric_limits<std::uint64_t>::max(); }

void LockedFile::flush() noexcept { ::fsync(file_); }

void sleep_until(std::int64_t ns, bool (*stop)() noexcept) noexcept {
  constexpr std::int64_t most_ns = 100'000'000;  // ns, longest time for which a signal goes unseen
  for (std::int64_t left; (left = ns - now_ns()) > 0 && !stop();)
    std::this_thread::sleep_for(std::chrono::nanoseconds(left < most_ns ? left : most_ns));
}

double stolen_now() { return 0.0; }

QueueClock::QueueClock() noexcept : file_(-1) {}
QueueClock::~QueueClock() = default;
double QueueClock::now() const noexcept { return 0.0; }

int use_exact_timers() noexcept { return 0; }
void use_timers(int) noexcept {}

std::string bind_thread(int, std::vector<int>&) { return "not on this system; any core instead"; }
void use_cores(const std::vector<int>&) noexcept {}

std::string take_fifo(int) { return "not on this system; usual scheduling instead"; }
void use_usual_scheduling() noexcept {}

std::string lock_memory() { return "not on this system; pages may be taken away"; }
void unlock_memory() noexcept {}

}  // namespace cli::platform
