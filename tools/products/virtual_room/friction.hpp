// Computes the friction of all contacts in a tick, and the motion of block and tool under it.
//
// Block and tool are one body of nine velocities: three of the block's translation, three of its rotation,
// three of the tool. A contact maps these to its tangent plane by two rows; the tool's pad (a disc) has a
// third row for spin. Normal forces and the hand's spring are already part of mass matrix and external force
// (world.cpp), so that everything is implicit.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <bristle/bristle.hpp>
#include <bristle/coupling.hpp>
#include <bristle/extended_patches.hpp>

#include "tools/libraries/rivals/rival.hpp"
#include "tools/products/virtual_room/parameters.hpp"

namespace room {

inline constexpr int velocities = 9;
using Body = bristle::MovingBody<velocities>;
using Velocity = bristle::BodyVector<velocities>;
using TangentRows = Eigen::Matrix<double, 2, velocities, Eigen::DontAlign>;

/// Contact of the block, with a surface of the room or with the tool, that has a patch. Its load is an input,
/// its friction an output.
struct PatchContact {
  std::size_t patch = 0;  ///< index of the patch, below patch_count
  TangentRows rows = TangentRows::Zero();
  /// Row vector that gives the spin of the block against the tool's pad, rad/s, from the velocities. Zero for
  /// point contacts.
  Velocity spin = Velocity::Zero();
  double load = 0.0;         ///< normal load, N; 0 resets the bristles
  double force[2] = {0, 0};  ///< friction on the block, N; it and the members below are set by step()
  bristle::Status status = bristle::Status::ok;
  double limit = 0.0;  ///< highest elastic friction at this load, N

  /// Torque that the tool's pad exerts on the block about the normal, and its highest value, N m.
  double torque = 0.0, torque_limit = 0.0;
};

class Friction {
 public:
  explicit Friction(bristle::PatchBatch& batch) : batch_(batch) {}

  /// Takes new parameters, on the haptic thread. After a change of the friction model all bristles are
  /// straight.
  void take(const Parameters& parameters) noexcept;

  /// Returns the velocities, averaged over a step, under friction and the force `external`. Stable for any
  /// stiffness. Stores the displacements for step(). Takes at most patch_count contacts, each with a patch of
  /// its own.
  Velocity find_motion(double dt_s, const Body& body, const Velocity& external,
                       bristle::Span<const PatchContact> contacts) noexcept;
  /// Moves the patches by the displacements that find_motion() stored, and gives `body` the velocity that
  /// results from the forces.
  void step(double dt_s, Body& body, const Velocity& external, bristle::Span<PatchContact> contacts) noexcept;

  /// Returns the patch of contact number i; for the tool's pad, the patch of its first cell.
  bristle::PatchId patch(std::size_t i) const noexcept {
    return is_pad(i) ? pad_->cell_patches(pad_id_)[0] : ids_[i];
  }
  /// Returns the number of representatives in contact, which may have a fraction; NaN for an infinite brush,
  /// 0 if the friction model is no brush.
  double active_bristles(std::size_t i) const noexcept;
  /// Returns how many bristles on the floor snapped in the last step; 0 if the friction model is no brush.
  std::uint64_t snaps() const noexcept { return model_ == FrictionModel::brush ? snaps_ : 0; }
  /// Returns a hash of the patches' states or, with a rival friction model, of its states.
  std::uint64_t state_hash() const noexcept;

 private:
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
  // Largest number of contacts in the solver: points, and cells of the tool's pad.
  static constexpr std::size_t most_feet = patch_count + pad_cells;
  std::array<bristle::BodyContact<velocities>, most_feet> feet_{};
  std::array<bristle::Motion, most_feet> motions_{};
  std::array<bristle::Response, most_feet> responses_{};
  bristle::ExtendedPatches* pad_ = nullptr;
  bristle::PatchId pad_id_;
  bristle::ExtendedMotion pad_motion_;
  std::uint64_t snaps_ = 0;
  // Numbers of point contacts and of cells of the tool's pad; cells_ is 0 while the pad touches nothing.
  std::size_t points_ = 0, cells_ = 0;
};

}  // namespace room
