#include "tools/reports/conditions.hpp"

#include <ctime>
#include <fstream>
#include <thread>

#include <fmt/format.h>

#include <bristle/version.hpp>

namespace cli {
namespace {

std::string cpu_model() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    const auto colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  return "unknown";
}

std::string utc_now() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text;
}

}  // namespace

Conditions conditions() {
  return {bristle::library_version(),
          BRISTLE_GIT_COMMIT,
          BRISTLE_BUILD_FLAGS,
          cpu_model(),
          static_cast<int>(std::thread::hardware_concurrency()),
          utc_now()};
}

nlohmann::ordered_json to_json(const Conditions& c) {
  return {{"version", c.version}, {"commit", c.commit}, {"flags", c.flags},
          {"cpu", c.cpu},         {"cores", c.cores},   {"time", c.time}};
}

std::string measured_with(const Conditions& c, const std::string& isa) {
  return fmt::format("bristle {}, commit {}, {}, {} kernels\n{}, {} cores", c.version, c.commit, c.flags, isa,
                     c.cpu, c.cores);
}

}  // namespace cli
