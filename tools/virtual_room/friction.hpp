// Friction of all contacts in a tick, and the motion of block and tool under it.
//
// Both move as one body of nine velocities: the block's (three along, three about), the tool's three. A
// contact maps these to its tangent plane by two rows, and the tool's pad by a third, the spin. Normal forces
// and the hand's spring are already in the mass matrix and in the external force (world.cpp), so everything
// is implicit.
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

/// Contact of the block with a surface or the tool that has a patch; its load is an input, its force an
/// output.
struct PatchContact {
  std::size_t patch = 0;  ///< index of the contact's patch, 0 to patch_count - 1
  TangentRows rows = TangentRows::Zero();
  /// Row whose product with the velocities is the block's rate of turn on the tool's pad, rad/s; for a pad
  /// only.
  Velocity spin = Velocity::Zero();
  double load = 0.0;         ///< N, normal load; 0 resets the patch's bristles
  double force[2] = {0, 0};  ///< N, friction on the block. step() sets this and the members below
  bristle::Status status = bristle::Status::ok;
  double limit = 0.0;  ///< N, highest elastic friction under this load

  /// N m, torque of the pad on the block about the normal, and the highest torque.
  double torque = 0.0, torque_limit = 0.0;
};

class Friction {
 public:
  explicit Friction(bristle::PatchBatch& batch) : batch_(batch) {}

  /// Takes new parameters, on the haptic thread. After a change of model no bristle is bent.
  void take(const Parameters& parameters) noexcept;

  /// Finds the mean velocity over a step in which friction acts beside `external`; stable for any stiffness.
  /// Remembers the displacements for step(). Takes at most patch_count contacts, each with a patch of its
  /// own.
  Velocity find_motion(double dt_s, const Body& body, const Velocity& external,
                       bristle::Span<const PatchContact> contacts) noexcept;
  /// Moves the patches by the displacements of find_motion(), and gives `body` the velocity that the forces
  /// cause.
  void step(double dt_s, Body& body, const Velocity& external, bristle::Span<PatchContact> contacts) noexcept;

  /// Returns the patch of a contact; for a pad, that of its first cell.
  bristle::PatchId patch(std::size_t i) const noexcept {
    return is_pad(i) ? pad_->cell_patches(pad_id_)[0] : ids_[i];
  }
  /// Returns the number of the patch's representatives in contact, with its fraction; 0 if the model is no
  /// brush.
  double active_bristles(std::size_t i) const noexcept;
  /// Returns how many bristles on the floor snapped in the last step; 0 if the model is no brush.
  std::uint64_t snaps() const noexcept { return model_ == FrictionModel::brush ? snaps_ : 0; }
  std::uint64_t state_hash() const noexcept;  ///< hash of the patches, or of the states of the other friction
                                              ///< model

 private:
  // Contacts without friction, each of which reports two of the nine velocities: their displacements return
  // the motion that the solver has found.
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
  // Highest number of contacts of the solver: points, cells of the pad, and the frictionless probes.
  static constexpr std::size_t most_feet = patch_count + pad_cells + probes;
  std::array<bristle::BodyContact<velocities>, most_feet> feet_{};
  std::array<bristle::Motion, most_feet> motions_{};
  std::array<bristle::Response, most_feet> responses_{};
  bristle::ExtendedPatches* pad_ = nullptr;
  bristle::PatchId pad_id_;
  bristle::ExtendedMotion pad_motion_;
  std::uint64_t snaps_ = 0;
  // Number of point contacts and of cells of the tool's pad; cells_ is 0 while the pad does not touch.
  std::size_t points_ = 0, cells_ = 0;
};

}  // namespace room
