// Beds of round bodies in physics engines: the part that the adapters for MuJoCo and Bullet share.
#pragma once

#include <cstdint>
#include <optional>

#include <Eigen/Core>
#include <bristle/bed.hpp>
#include <bristle/contact_frame.hpp>
#include <bristle/patch.hpp>

namespace bristle_example {

/// Bed for a contact of two elastic bodies of which one is round, so that it can roll.
struct RollingBed {
  bristle::BedMaterial material;
  bristle::BedShape shape;  ///< shape that must roll in any direction: disc().rolling()
  bristle::BedOptions options;
};

/// Options of the contacts of an engine that the adapters for MuJoCo and Bullet share.
struct ContactOptions {
  /// Options of the patch at each contact point. The infinite brush has no noise and costs less; a law with
  /// SnapRule::keep needs Population::representatives.
  bristle::PatchOptions patch = bristle::PatchOptions{}
                                    .with_max_normal_load(10.0)
                                    .with_population(bristle::Population::infinite)
                                    .with_resolution(4);
  /// Largest motion of a contact point from step to step, m, with which it is still the same contact. The
  /// motion is seen from the contact's body, in MuJoCo from the smaller geom.
  double reach = 0.01;
  /// Number of contacts for which there is room at first. A step with more contacts doubles the room, and
  /// allocates memory.
  std::uint32_t contacts = 1024;
  /// Bed of each contact of a round body, in place of a patch; by default none. Its force is multiplied by
  /// the contact's friction coefficient over the kinetic coefficient of the bed's material, and so is its
  /// stiffness.
  std::optional<RollingBed> rolling;
};

/// Returns the motion of the bed under a round body in this step. `moved`: slip along the frame's axes (m)
/// and spin about its normal (rad). `arm`: vector from the body's centre to the contact (m). `turn`: rotation
/// of the body (rad). The contact stays below the centre, so the rotation moves the body's surface through
/// the contact.
inline bristle::BedMotion bed_motion(bristle::BedId bed, const bristle::ContactFrame& frame,
                                     const Eigen::Vector3d& arm, const Eigen::Vector3d& turn,
                                     const Eigen::Vector3d& moved, double normal_load) {
  const Eigen::Vector3d carried = arm.cross(turn);
  return {bed,
          {moved[0], moved[1]},
          moved[2],
          {carried.dot(frame.along()), carried.dot(frame.aside())},
          normal_load};
}

}  // namespace bristle_example
