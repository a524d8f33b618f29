#include "tools/libraries/reports/conditions.hpp"

#include <ctime>
#include <thread>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <bristle/version.hpp>

#include "tools/libraries/platform/platform.hpp"

namespace cli {

Conditions conditions() {
  return {bristle::library_version(),
          BRISTLE_GIT_COMMIT,
          BRISTLE_BUILD_FLAGS,
          platform::cpu_model(),
          static_cast<int>(std::thread::hardware_concurrency()),
          fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)))};
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
