#include "tools/products/virtual_room/collision.hpp"

namespace room {
namespace {

// Gap (m) below which two bodies count as close and are listed as a touch: for block and surface, and for the
// tool and anything.
constexpr double block_margin = 1e-3, tool_margin = 1e-4;

struct Plane {
  Vector3 normal;
  double offset;  // plane normal . x = offset; the room is where normal . x exceeds it
};

std::array<Plane, surfaces> planes_of(const RoomMeasures& m) {
  return {{{Vector3(0, 0, 1), 0.0},
           {Vector3(-1, 0, 0), -0.5 * m.length},
           {Vector3(0, -1, 0), -0.5 * m.width},
           {Vector3(0, 1, 0), -0.5 * m.width},
           {Vector3(0, 0, -1), -m.height}}};
}

/// Returns corner i (0 to 7) of the block in its own axes; bits 0, 1, 2 of i mean the side at +x, +y, +z.
Vector3 corner_of(const RoomMeasures& m, int i) {
  return {(i & 1 ? 0.5 : -0.5) * m.block[0], (i & 2 ? 0.5 : -0.5) * m.block[1],
          (i & 4 ? 0.5 : -0.5) * m.block[2]};
}

void add_touch(Touches& touches, const Touch& touch) { touches.list[touches.count++] = touch; }

void block_on_surface(const RoomMeasures& m, const Pose& block, Surface surface, const Plane& plane,
                      Touches& touches) {
  for (int i = 0; i < corners; ++i) {
    const Vector3 point = block.position + block.orientation * corner_of(m, i);
    const double gap = plane.normal.dot(point) - plane.offset;
    if (gap < block_margin)
      add_touch(touches, {Touch::Pair::block_surface, surface, i, point, plane.normal, gap});
  }
}

void tool_on_surface(const RoomMeasures& m, const Vector3& tool, Surface surface, const Plane& plane,
                     Touches& touches) {
  const double gap = plane.normal.dot(tool) - plane.offset - m.tool_radius;
  if (gap < tool_margin) add_touch(touches, {Touch::Pair::tool_surface, surface, 0, tool, plane.normal, gap});
}

void tool_on_block(const RoomMeasures& m, const Pose& block, const Vector3& tool, Touches& touches) {
  const Vector3 half(0.5 * m.block[0], 0.5 * m.block[1], 0.5 * m.block[2]);
  const Vector3 centre = block.orientation.conjugate() * (tool - block.position);
  Vector3 closest = centre.cwiseMax(-half).cwiseMin(half);
  // Vector from the block's nearest point to the tool's centre, in the block's axes, m.
  Vector3 out = centre - closest;
  double distance = out.norm();
  if (distance > 0.0) {
    out /= distance;
  } else {  // pushes a tool whose centre is inside the block out through the nearest face
    int axis = 0;
    const double depth = (half - centre.cwiseAbs()).minCoeff(&axis);
    const double side = centre[axis] < 0.0 ? -1.0 : 1.0;
    out = side * Vector3::Unit(axis);
    closest[axis] = side * half[axis];
    distance = -depth;
  }
  const double gap = distance - m.tool_radius;
  if (gap < tool_margin)
    add_touch(touches, {Touch::Pair::block_tool, Surface::floor, 0,
                        block.position + block.orientation * closest, -(block.orientation * out), gap});
}

}  // namespace

void find_touches(const RoomMeasures& measures, const Pose& block, const Vector3& tool,
                  Touches& touches) noexcept {
  const std::array<Plane, surfaces> planes = planes_of(measures);
  touches.count = 0;
  for (std::size_t s = 0; s < surfaces; ++s) {
    block_on_surface(measures, block, static_cast<Surface>(s), planes[s], touches);
    tool_on_surface(measures, tool, static_cast<Surface>(s), planes[s], touches);
  }
  tool_on_block(measures, block, tool, touches);
}

}  // namespace room
