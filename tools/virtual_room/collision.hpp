// Finds the contacts between the block, the tool and the room's five surfaces.
//
// A bristle must bend at a fixed place, so contacts are persistent features: the block's eight corners
// against a flat surface, the closest point against the tool. A box and a flat surface cannot touch at other
// points. On a mesh (floor_mesh.hpp) a corner touches the plane of the triangle below or above it; vertices
// and edges of the mesh do not touch the block's faces.
#pragma once

#include <array>
#include <cstddef>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "tools/virtual_room/room_state.hpp"

namespace room {

using Vector3 = Eigen::Matrix<double, 3, 1, Eigen::DontAlign>;
using Rotation = Eigen::Quaternion<double, Eigen::DontAlign>;

inline constexpr int corners = 8;

enum class Surface : unsigned char { floor, end_wall, left_wall, right_wall, roof };
inline constexpr int surfaces = 5;

/// Place where two bodies touch or nearly do.
struct Touch {
  enum class Pair : unsigned char { block_surface, block_tool, tool_surface } pair = Pair::block_surface;
  Surface surface = Surface::floor;  ///< surface of the room that is touched; not used for block_tool
  int corner = 0;                    ///< index of the block's corner that touches, for block_surface

  /// m, place of the touch: on block or tool if a surface is touched; on the block if the tool touches it
  Vector3 point = Vector3::Zero();
  Vector3 normal = Vector3::UnitZ();  ///< unit vector out of the other body, into the block (or the tool)
  double gap = 0.0;                   ///< m, distance of the bodies; negative: depth of their overlap

  /// Returns a key that identifies the place of this touch for as long as it lasts.
  int key() const noexcept {
    if (pair == Pair::block_tool) return surfaces * corners;
    return pair == Pair::block_surface ? static_cast<int>(surface) * corners + corner
                                       : surfaces * corners + 1 + static_cast<int>(surface);
  }
};
inline constexpr int touch_keys = surfaces * corners + 1 + surfaces;

/// Touches of one tick, in an order that depends only on the bodies' poses.
struct Touches {
  std::array<Touch, touch_keys> list;
  std::size_t count = 0;
};

struct Pose {
  Vector3 position = Vector3::Zero();           ///< m, place of the block's centre of mass
  Rotation orientation = Rotation::Identity();  ///< orientation of the block's axes in the room's
};

/// Finds all touches with a gap below a millimetre (a tenth for the tool).
void find_touches(const RoomMeasures& measures, const Pose& block, const Vector3& tool,
                  Touches& touches) noexcept;

}  // namespace room
