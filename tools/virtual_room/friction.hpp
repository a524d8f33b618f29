// Friction of every contact of a tick, and the motion that block and tool make under it.
//
// Both move as one body of nine velocities: the block's (three along, three about), the tool's three. A
// contact sees them by two rows, in its tangent plane, and the tool's pad by a third, the spin. Normal forces
// and the hand's spring stand in the mass matrix and in the external force already (world.cpp), so that all
// of it is implicit.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <bristle/bristle.hpp>
#include <bristle/coupling.hpp>
#include <bristle/extended_patches.hpp>

#include "tools/rivals/rival.hpp"
#include "tools/virtual_room/parameters.hpp"

namespace room {

inline constexpr int velocities = 9;
using Body = bristle::MovingBody<velocities>;
using Velocity = bristle::BodyVector<velocities>;
using TangentRows = Eigen::Matrix<double, 2, velocities, Eigen::DontAlign>;

/// A contact that has a patch.
struct PatchContact {
  std::size_t patch = 0;  ///< 0 to patch_count - 1
  TangentRows rows = TangentRows::Zero();
  Velocity spin = Velocity::Zero();  ///< spin . u: turn of the block on the tool's pad, rad/s; else not used
  double load = 0.0;                 ///< N; 0: the patch forgets
  double force[2] = {0, 0};          ///< N, on the block: this and the rest filled in by step()
  bristle::Status status = bristle::Status::ok;
  double limit = 0.0;                       ///< N, highest elastic force
  double torque = 0.0, torque_limit = 0.0;  ///< N m, of a pad: on the block about the normal
};

class Friction {
 public:
  explicit Friction(bristle::PatchBatch& batch) : batch_(batch) {}

  /// Haptic thread. A change of the model begins with nothing bent.
  void take(const Parameters& parameters) noexcept;

  /// The mean velocity over a step in which friction acts beside `external`, stable for any stiffness.
  /// Remembers the displacements for step(). At most patch_count contacts, each with a patch of its own.
  Velocity find_motion(double dt_s, const Body& body, const Velocity& external,
                       bristle::Span<const PatchContact> contacts) noexcept;
  /// Moves the patches by these displacements, and gives `body` the velocity of the forces that acted.
  void step(double dt_s, Body& body, const Velocity& external, bristle::Span<PatchContact> contacts) noexcept;

  /// Patch of a contact; of a pad, its first cell.
  bristle::PatchId patch(std::size_t i) const noexcept {
    return is_pad(i) ? pad_->cell_patches(pad_id_)[0] : ids_[i];
  }
  /// Representatives in contact, with the fraction; 0 for a rival.
  double active_bristles(std::size_t i) const noexcept;
  /// Of bristles on the floor, in the last step; 0 for a rival.
  std::uint64_t snaps() const noexcept { return model_ == FrictionModel::brush ? snaps_ : 0; }
  std::uint64_t state_hash() const noexcept;  ///< of the brush's patches, or of the rival's states

 private:
  // Nine velocities, two to a contact without a patch: the displacements of these bring the solution out.
  static constexpr std::size_t probes = (velocities + 1) / 2;

  Velocity find_brush_motion(double dt_s, const Body& body, const Velocity& external,
                             bristle::Span<const PatchContact> contacts) noexcept;
  void step_brush(double dt_s, Body& body, const Velocity& external,
                  bristle::Span<PatchContact> contacts) noexcept;
  Velocity find_rival_motion(double dt_s, const Body& body, const Velocity& external,
                             bristle::Span<const PatchContact> contacts) noexcept;

  bool is_pad(std::size_t patch) const noexcept { return pad_ != nullptr && patch == tool_patch; }
  std::size_t add_pad_feet(const PatchContact& contact, std::size_t first) noexcept;
  void move_pad(double dt_s, const Velocity& mean, bristle::Span<const PatchContact> contacts) noexcept;

  bristle::PatchBatch& batch_;
  FrictionModel model_ = FrictionModel::brush;
  PatchIds ids_{};
  std::array<rivals::Rival, patch_count> rivals_{};
  // The points, the cells of the pad, the probes.
  static constexpr std::size_t most_feet = patch_count + pad_cells + probes;
  std::array<bristle::BodyContact<velocities>, most_feet> feet_{};
  std::array<bristle::Motion, most_feet> motions_{};
  std::array<bristle::Response, most_feet> responses_{};
  bristle::ExtendedPatches* pad_ = nullptr;
  bristle::PatchId pad_id_;
  bristle::ExtendedMotion pad_motion_;
  std::uint64_t snaps_ = 0;
  std::size_t points_ = 0, cells_ = 0;  // among the feet; cells_ 0: the pad does not touch
};

}  // namespace room
