// Finds the contacts between the block, the tool and the room's five surfaces.
// A bristle bends at a fixed place, so contacts must be features that persist: the block's eight corners
// against a flat surface, the closest point against the tool. A box and a flat surface cannot touch at other
// points.
#pragma once

#include <array>
#include <cstddef>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "tools/products/virtual_room/room_state.hpp"

namespace room {

using Vector3 = Eigen::Matrix<double, 3, 1, Eigen::DontAlign>;
using Rotation = Eigen::Quaternion<double, Eigen::DontAlign>;

inline constexpr int corners = 8;

enum class Surface : unsigned char { floor, end_wall, left_wall, right_wall, roof };
inline constexpr int surfaces = 5;

/// Point at which two bodies (block, tool, or a surface of the room) touch or nearly do.
struct Touch {
  enum class Pair : unsigned char { block_surface, block_tool, tool_surface } pair = Pair::block_surface;
  Surface surface = Surface::floor;  ///< surface of the room; unused for block_tool
  int corner = 0;                    ///< index of the block's corner, for block_surface

  /// Position of the touch, m: on the block, or on the tool if the tool touches a surface.
  Vector3 point = Vector3::Zero();
  Vector3 normal = Vector3::UnitZ();  ///< unit vector from the other body into the block (or tool)
  double gap = 0.0;                   ///< distance of the bodies, m; negative: depth of overlap

  /// Returns the index under which the state of this contact is stored. It identifies the two bodies and the
  /// corner of the block, so it stays the same for as long as they touch.
  int key() const noexcept {
    if (pair == Pair::block_tool) return surfaces * corners;
    return pair == Pair::block_surface ? static_cast<int>(surface) * corners + corner
                                       : surfaces * corners + 1 + static_cast<int>(surface);
  }
};
inline constexpr int touch_keys = surfaces * corners + 1 + surfaces;

/// Touches found in one tick, in an order that depends only on the poses of block and tool.
struct Touches {
  std::array<Touch, touch_keys> list;
  std::size_t count = 0;
};

struct Pose {
  Vector3 position = Vector3::Zero();           ///< place of the block's centre of mass, m
  Rotation orientation = Rotation::Identity();  ///< rotation from the block's axes to the room's
};

/// Finds all pairs of places with a gap below 1 mm, or below 0.1 mm if the tool is one of the two.
void find_touches(const RoomMeasures& measures, const Pose& block, const Vector3& tool,
                  Touches& touches) noexcept;

}  // namespace room
