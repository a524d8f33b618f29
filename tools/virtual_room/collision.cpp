#include "tools/virtual_room/collision.hpp"

#include <algorithm>
#include <cmath>

#include <btBulletCollisionCommon.h>

namespace room {
namespace {

// m, gaps below which block and tool count as close.
constexpr double block_margin = 1e-3, tool_margin = 1e-4;

struct Plane {
  Vector3 normal;
  double offset;  // the plane is normal . x = offset; inside the room normal . x is larger
};

std::array<Plane, surfaces> planes_of(const RoomMeasures& m) {
  return {{{Vector3(0, 0, 1), 0.0},
           {Vector3(-1, 0, 0), -0.5 * m.length},
           {Vector3(0, -1, 0), -0.5 * m.width},
           {Vector3(0, 1, 0), -0.5 * m.width},
           {Vector3(0, 0, -1), -m.height}}};
}

btVector3 to_bullet(const Vector3& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace

Vector3 corner_of(const RoomMeasures& m, int i) noexcept {
  return {(i & 1 ? 0.5 : -0.5) * m.block[0], (i & 2 ? 0.5 : -0.5) * m.block[1],
          (i & 4 ? 0.5 : -0.5) * m.block[2]};
}

// Collision world of the library Bullet. Its objects are numbered: first the surfaces, then block and tool.
struct Collision::Bullet {
  static constexpr int block_index = surfaces, tool_index = surfaces + 1, objects = surfaces + 2;

  explicit Bullet(const RoomMeasures& m)
      : planes(planes_of(m)),
        dispatcher(&configuration),
        world(&dispatcher, &broadphase, &configuration),
        box(btVector3(0.5 * m.block[0], 0.5 * m.block[1], 0.5 * m.block[2])),
        sphere(m.tool_radius) {
    box.setMargin(1e-3);
    for (int i = 0; i < surfaces; ++i) {
      const Plane& plane = planes[static_cast<std::size_t>(i)];
      shapes[static_cast<std::size_t>(i)] =
          std::make_unique<btStaticPlaneShape>(to_bullet(plane.normal), plane.offset);
      add(i, shapes[static_cast<std::size_t>(i)].get(), btBroadphaseProxy::StaticFilter);
    }
    add(block_index, &box, btBroadphaseProxy::DefaultFilter);
    add(tool_index, &sphere, btBroadphaseProxy::DefaultFilter);
  }
  ~Bullet() {
    for (btCollisionObject& object : bodies) world.removeCollisionObject(&object);
  }

  void add(int index, btCollisionShape* shape, int group) {
    btCollisionObject& object = bodies[static_cast<std::size_t>(index)];
    object.setCollisionShape(shape);
    object.setUserIndex(index);
    const bool still = group == btBroadphaseProxy::StaticFilter;
    object.setCollisionFlags(still ? btCollisionObject::CF_STATIC_OBJECT : 0);
    object.setActivationState(DISABLE_DEACTIVATION);
    world.addCollisionObject(&object, group,
                             still ? btBroadphaseProxy::DefaultFilter : btBroadphaseProxy::AllFilter);
  }

  std::array<Plane, surfaces> planes;
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher;
  btDbvtBroadphase broadphase;
  btCollisionWorld world;
  btBoxShape box;
  btSphereShape sphere;
  std::array<std::unique_ptr<btStaticPlaneShape>, surfaces> shapes;
  std::array<btCollisionObject, objects> bodies;
};

namespace {

void add_touch(Touches& touches, const Touch& touch) { touches.list[touches.count++] = touch; }

void block_on_plane(const RoomMeasures& m, const Pose& block, Surface surface, const Plane& plane,
                    Touches& touches) {
  for (int i = 0; i < corners; ++i) {
    const Vector3 point = block.position + block.orientation * corner_of(m, i);
    const double gap = plane.normal.dot(point) - plane.offset;
    if (gap < block_margin) {
      add_touch(touches, {Touch::Pair::block_surface, surface, i, point, plane.normal, gap});
    }
  }
}

void tool_on_plane(double radius, const Vector3& tool, Surface surface, const Plane& plane,
                   Touches& touches) {
  const double gap = plane.normal.dot(tool) - plane.offset - radius;
  if (gap < tool_margin) {
    add_touch(touches, {Touch::Pair::tool_surface, surface, 0, tool, plane.normal, gap});
  }
}

void tool_on_block(const RoomMeasures& m, const Pose& block, const Vector3& tool, Touches& touches) {
  const Vector3 half(0.5 * m.block[0], 0.5 * m.block[1], 0.5 * m.block[2]);
  const Vector3 centre = block.orientation.conjugate() * (tool - block.position);
  Vector3 closest = centre.cwiseMax(-half).cwiseMin(half);
  Vector3 out = centre - closest;  // vector from the block to the tool
  double distance = out.norm();
  if (distance > 0.0) {
    out /= distance;
  } else {  // the tool's centre is inside the block: pushes it out through the nearest face
    int axis = 0;
    const double depth = (half - centre.cwiseAbs()).minCoeff(&axis);
    const double side = centre[axis] < 0.0 ? -1.0 : 1.0;
    out = side * Vector3::Unit(axis);
    closest[axis] = side * half[axis];
    distance = -depth;
  }
  const double gap = distance - m.tool_radius;
  if (gap < tool_margin) {
    add_touch(touches, {Touch::Pair::block_tool, Surface::floor, 0,
                        block.position + block.orientation * closest, -(block.orientation * out), gap});
  }
}

}  // namespace

Collision::Collision(const RoomMeasures& measures)
    : measures_(measures), bullet_(std::make_unique<Bullet>(measures)) {}
Collision::~Collision() = default;

void Collision::find(const Pose& block, const Vector3& tool, Touches& touches) {
  Bullet& b = *bullet_;
  const Rotation& q = block.orientation;
  b.bodies[Bullet::block_index].setWorldTransform(
      btTransform(btQuaternion(q.x(), q.y(), q.z(), q.w()), to_bullet(block.position)));
  b.bodies[Bullet::tool_index].setWorldTransform(btTransform(btQuaternion::getIdentity(), to_bullet(tool)));
  b.world.performDiscreteCollisionDetection();

  std::array<std::array<bool, Bullet::objects>, Bullet::objects> close{};
  for (int i = 0; i < b.dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold& manifold = *b.dispatcher.getManifoldByIndexInternal(i);
    if (manifold.getNumContacts() == 0) continue;
    const auto one = static_cast<std::size_t>(manifold.getBody0()->getUserIndex());
    const auto other = static_cast<std::size_t>(manifold.getBody1()->getUserIndex());
    close[std::min(one, other)][std::max(one, other)] = true;
  }
  touches.count = 0;
  for (std::size_t s = 0; s < surfaces; ++s) {
    const auto surface = static_cast<Surface>(s);
    if (close[s][Bullet::block_index]) block_on_plane(measures_, block, surface, b.planes[s], touches);
    if (close[s][Bullet::tool_index])
      tool_on_plane(measures_.tool_radius, tool, surface, b.planes[s], touches);
  }
  if (close[Bullet::block_index][Bullet::tool_index]) tool_on_block(measures_, block, tool, touches);
}

}  // namespace room
