// Block on a rough floor, pulled by a hand through a spring, along one line.
#pragma once

#include <bristle/bristle.hpp>
#include <bristle/coupling.hpp>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace page {

struct BlockSettings {
  bristle::Coefficients coefficients;
  bool infinite = false;           ///< whether the contact is computed as an infinite brush
  std::uint32_t bristles = 1000;   ///< number of representative bristles, all in contact
  double normal_load = 1.0;        ///< N
  double mass = 0.1;               ///< kg
  double spring_stiffness = 60.0;  ///< N/m, of the spring between hand and block
};

/// State of the block at the end of a past step (a millisecond).
struct Sample {
  double time = 0.0;      ///< s
  double position = 0.0;  ///< m, position of the block
  double friction = 0.0;  ///< N, friction on the block
  double pull = 0.0;      ///< N, force of the spring on the block
};

class Block {
 public:
  static constexpr double step_s = 1e-3;
  static constexpr std::size_t remembered = 1u << 14;

  Block();
  /// Changes the settings. Throws bristle::Error and keeps the old ones if the new ones are no valid
  /// material. Bristles keep their bends if only the material or the spring changed.
  void set(const BlockSettings& settings);
  /// Puts the block back to the middle at rest, with straight bristles, and removes the samples.
  void reset();

  /// Starts a pull from the place where the block is. move_hand() then sets the hand's target relative to
  /// that place, which the hand reaches smoothly within some 40 ms, even if the target jumps as a pointer
  /// does.
  void grab();
  void move_hand(double position_m);
  void release() { held_ = false; }

  void step();

  double position() const { return position_; }
  double velocity() const { return body_.velocity[0]; }
  double hand() const { return held_ ? hand_ : position_; }
  bool held() const { return held_; }
  const bristle::Response& response() const { return response_; }
  bristle::PatchInfo info() const { return batch_.info(patch_); }
  double kinetic_friction() const { return kinetic_; }  ///< N
  double peak_friction() const { return peak_; }        ///< N
  std::uint64_t steps() const { return steps_; }
  /// Returns the last samples as a ring buffer; the newest is at index (steps() - 1) % remembered.
  const std::vector<Sample>& samples() const { return samples_; }
  /// Writes the bends of some bristles in contact to `bends`, m. Returns how many it wrote.
  std::size_t read_bends(bristle::Span<double> bends) const;

 private:
  bristle::PatchOptions patch_options(const BlockSettings& settings) const;

  BlockSettings settings_;
  bristle::PatchBatch batch_;
  bristle::PatchId patch_;
  bristle::MovingBody<1> body_;
  bristle::BodyContact<1> contact_;
  bristle::Motion motion_;
  bristle::Response response_;
  double position_ = 0.0, hand_ = 0.0, wanted_ = 0.0;
  double kinetic_ = 0.0, peak_ = 0.0;
  bool held_ = false;
  std::uint64_t steps_ = 0;
  std::vector<Sample> samples_;
};

}  // namespace page
