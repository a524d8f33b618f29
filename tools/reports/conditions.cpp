#include "tools/reports/conditions.hpp"

#include <cmath>
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

std::string time_text(double seconds) {
  const struct {
    double scale;
    const char* unit;
  } units[] = {{1.0, "s"}, {1e3, "ms"}, {1e6, "us"}, {1e9, "ns"}};
  for (const auto& unit : units) {
    const double value = seconds * unit.scale;
    if (std::fabs(value) < 0.9995 && unit.scale < 1e9) continue;
    return fmt::format("{:.{}f} {}", value, value < 9.995 ? 2 : value < 99.95 ? 1 : 0, unit.unit);
  }
  return "0 ns";
}

std::string count_text(unsigned long long count) {
  const std::string digits = std::to_string(count);
  std::string text;
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && (digits.size() - i) % 3 == 0) text += ',';
    text += digits[i];
  }
  return text;
}

}  // namespace cli
