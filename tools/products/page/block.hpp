// A block on a rough floor that a hand pulls through a spring, along one line: the simulation of the
// interactive page.
#pragma once

#include <bristle/bristle.hpp>
#include <bristle/coupling.hpp>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace page {

struct BlockSettings {
  bristle::Coefficients coefficients;
  bool infinite = false;           ///< whether the contact has an infinite brush
  std::uint32_t bristles = 1000;   ///< number of representative bristles, all in contact
  double normal_load = 1.0;        ///< normal load, N
  double mass = 0.1;               ///< mass of the block, kg
  double spring_stiffness = 60.0;  ///< stiffness of the spring between hand and block, N/m
};

/// State of the block at the end of one of the past steps, which last a millisecond.
struct Sample {
  double time = 0.0;      ///< time, s
  double position = 0.0;  ///< position of the block, m
  double friction = 0.0;  ///< friction on the block, N
  double pull = 0.0;      ///< force of the spring on the block, N
};

class Block {
 public:
  static constexpr double step_s = 1e-3;
  static constexpr std::size_t remembered = 1u << 14;

  Block();
  /// Changes the settings. Throws bristle::Error and keeps the old settings if the new ones make no valid
  /// material. Bristles keep their bends if only the material or the spring changes.
  void set(const BlockSettings& settings);
  /// Puts the block at rest in the middle, with straight bristles, and deletes all samples of its past.
  void reset();

  /// Starts a pull by the hand from where the block is. move_hand() then sets the hand's target relative to
  /// that place; the hand reaches it smoothly within some 40 ms, even if the target jumps as a pointer
  /// does.
  void grab();
  void move_hand(double position_m) { wanted_ = position_m; }
  void release() { held_ = false; }

  void step();

  double position() const { return position_; }
  double velocity() const { return body_.velocity[0]; }
  double hand() const { return held_ ? hand_ : position_; }
  bool held() const { return held_; }
  const bristle::Response& response() const { return response_; }
  bristle::PatchInfo info() const { return batch_.info(patch_); }
  double kinetic_friction() const { return kinetic_; }  ///< kinetic friction, N
  double peak_friction() const { return peak_; }        ///< peak friction, N
  std::uint64_t steps() const { return steps_; }
  /// Returns the ring buffer of past states; the newest is at index (steps() - 1) % remembered.
  const std::vector<Sample>& samples() const { return samples_; }
  /// Writes the deflections (m) of some bristles in contact to `bends`, to be drawn. Returns their number.
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
