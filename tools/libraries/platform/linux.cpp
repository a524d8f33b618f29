// The services of Linux beyond POSIX.
#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <fstream>
#include <limits>

#include "tools/libraries/platform/platform.hpp"

namespace cli::platform {

std::filesystem::path program_folder() {
  std::error_code none;
  return std::filesystem::read_symlink("/proc/self/exe", none).parent_path();
}

std::string cpu_model() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    const auto colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown";
}

std::uint64_t free_memory() {
  std::uint64_t bytes = std::numeric_limits<std::uint64_t>::max();
  std::ifstream machine("/proc/meminfo");
  for (std::string line; std::getline(machine, line);) {
    unsigned long long kilobytes = 0;
    if (std::sscanf(line.c_str(), "MemAvailable: %llu kB", &kilobytes) == 1) bytes = kilobytes << 10;
  }
  struct rlimit limit;
  std::uint64_t pages = 0;
  if (::getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY &&
      std::ifstream("/proc/self/statm") >> pages) {
    const std::uint64_t taken = pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
    bytes = std::min<std::uint64_t>(bytes, limit.rlim_cur > taken ? limit.rlim_cur - taken : 0);
  }
  return bytes;
}

void LockedFile::flush() noexcept { ::fdatasync(file_); }

void sleep_until(std::int64_t ns, bool (*stop)() noexcept) noexcept {
  constexpr std::int64_t second_ns = 1'000'000'000;
  timespec point{};
  point.tv_sec = static_cast<std::time_t>(ns / second_ns);
  point.tv_nsec = static_cast<long>(ns % second_ns);
  while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &point, nullptr) == EINTR && !stop()) {
  }
}

double stolen_now() {
  // Format of the first line of /proc/stat: "cpu  user nice system idle iowait irq softirq steal ...", in
  // clock ticks of the system.
  std::ifstream stat("/proc/stat");
  std::string label;
  double ticks = 0.0;
  stat >> label;
  for (int field = 0; field < 8; ++field) stat >> ticks;
  const long per_second = ::sysconf(_SC_CLK_TCK);
  return stat && label == "cpu" && per_second > 0 ? ticks / static_cast<double>(per_second) : 0.0;
}

QueueClock::QueueClock() noexcept : file_(::open("/proc/thread-self/schedstat", O_RDONLY | O_CLOEXEC)) {}

QueueClock::~QueueClock() {
  if (file_ >= 0) ::close(file_);
}

double QueueClock::now() const noexcept {
  // Format of the thread's schedstat file: "ns run on a core, ns waiting for a core, number of time slices".
  char text[64];
  const ssize_t length = file_ >= 0 ? ::pread(file_, text, sizeof text, 0) : 0;
  if (length <= 0) return 0.0;
  const char* const end = text + length;
  const char* const space = std::find(static_cast<const char*>(text), end, ' ');
  std::uint64_t ns = 0;
  if (space != end) std::from_chars(space + 1, end, ns);
  return 1e-9 * static_cast<double>(ns);
}

}  // namespace cli::platform
