// The conditions of a measurement (machine, commit, compiler). Without them its figures mean little.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace cli {

struct Conditions {
  std::string version;  ///< version of the measured library
  std::string commit;
  std::string flags;  ///< name of the compiler, and the flags of the build
  std::string cpu;
  int cores = 1;
  std::string time;  ///< time of the measurement, UTC, as 2026-01-31T12:00:00Z
};

Conditions conditions();
nlohmann::ordered_json to_json(const Conditions& conditions);

/// Returns the conditions of a measurement, and the instruction set of the kernels, as two lines of text.
std::string measured_with(const Conditions& conditions, const std::string& isa);

}  // namespace cli
