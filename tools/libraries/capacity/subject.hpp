// Patches in steady motion, whose steps the command `bristle capacity` times.
#pragma once

#include <cstdint>
#include <string>

#include <bristle/patch_batch.hpp>

#include "bench/steady_scene.hpp"

#include "tools/libraries/capacity/capacity.hpp"

namespace cli {

constexpr double mean_snap_length_m = 10e-6;
constexpr double capacity_dt_s = 1e-3;

class CapacitySubject {
 public:
  /// Makes patches and settles them in the motion of `what`; `bristles` counts patches if they are infinite.
  /// Throws UserError if the machine lacks the instruction set.
  CapacitySubject(const CapacityCase& what, std::uint64_t bristles, const std::string& isa);

  /// Runs one step of the steady motion, for callers that time it themselves.
  void step() noexcept { scene_.step(); }

  std::uint64_t bristles() const noexcept { return scene_.bristles(); }
  const char* isa() const noexcept { return scene_.batch().isa(); }
  std::uint64_t state_hash() const noexcept { return scene_.batch().state_hash(); }
  bristle::PatchInfo info() const noexcept { return scene_.info(); }

 private:
  bristle_bench::SteadyScene scene_;
};

/// Times at most `steps` successive steps, without pauses between them. From the step `at_least` on it stops
/// as soon as so many steps exceeded the deadline (s) that the 99th percentile of all `steps` would exceed it
/// too.
StepTimes time_steps(CapacitySubject& subject, std::uint64_t steps, std::uint64_t at_least = UINT64_MAX,
                     double deadline_s = 1e-3);

}  // namespace cli
