// Beds of round bodies in engines: what the adapters for MuJoCo and Bullet share.
#pragma once

#include <Eigen/Core>
#include <bristle/bed.hpp>
#include <bristle/contact_frame.hpp>

namespace bristle_example {

/// Bed of a contact of two elastic bodies, one of them round.
struct RollingBed {
  bristle::BedMaterial material;
  bristle::BedShape shape;  ///< shape that must roll in any direction: disc().rolling()
  bristle::BedOptions options;
};

/// Returns the motion of a round body's bed. `moved`: slip along the frame's axes (m) and spin about its
/// normal (rad) in this step; `arm`: from its centre to the contact (m); `turn`: its rotation in this step
/// (rad), which carries its surface through the contact, since the contact stays below its centre.
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
