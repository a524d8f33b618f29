// Patches in steady motion, ready to be timed.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <bristle/patch_batch.hpp>

#include "tools/capacity/capacity.hpp"

namespace cli {

constexpr double mean_snap_length_m = 10e-6;
constexpr double capacity_dt_s = 1e-3;

class CapacitySubject {
 public:
  /// Settled in its motion. Throws UserError on an instruction set that is not there.
  CapacitySubject(const CapacityCase& what, std::uint64_t bristles, const std::string& isa);

  /// One step of the motion; to be timed.
  void step() noexcept {
    std::vector<bristle::Motion>& motions = motions_[turn_];
    turn_ ^= 1;
    batch_.step(capacity_dt_s, {motions.data(), motions.size()}, {responses_.data(), responses_.size()});
  }

  std::uint64_t bristles() const noexcept { return bristles_; }
  const char* isa() const noexcept { return batch_.isa(); }
  std::uint64_t state_hash() const noexcept { return batch_.state_hash(); }
  bristle::PatchInfo info() const noexcept { return batch_.info(motions_[0].front().id); }

 private:
  void set_displacement(int turn, const CapacityCase& what, double metres);

  bristle::PatchBatch batch_;
  std::uint64_t bristles_ = 0;
  int turn_ = 0;
  std::vector<bristle::Motion> motions_[2];  // of even and of odd steps
  std::vector<bristle::Response> responses_;
};

/// Step times of `steps` steps back to back.
StepTimes time_steps(CapacitySubject& subject, std::uint64_t steps);

}  // namespace cli
