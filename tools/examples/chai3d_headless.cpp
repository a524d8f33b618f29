// Tries BrushFingerProxy without a device or a window: a point is pushed into a CHAI3D mesh, pulled within
// the stick range, slid over it and lifted, beside CHAI3D's own friction cone. Exits with 1 when something is
// off.
#include <cmath>
#include <cstdio>

#include "chai3d_finger_proxy.hpp"
#include "world/CMesh.h"
#include "world/CWorld.h"

namespace {

constexpr double dt = 1e-3;
constexpr double stiffness = 500.0;  // N/m
constexpr double kinetic = 0.5;

/// A floor of 0.4 m by 0.4 m at z = 0, of many triangles.
chai3d::cMesh* make_floor() {
  auto* mesh = new chai3d::cMesh();
  constexpr int n = 20;
  const double width = 0.4 / n;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const double x = -0.2 + width * i, y = -0.2 + width * j;
      mesh->newTriangle(chai3d::cVector3d(x, y, 0), chai3d::cVector3d(x + width, y, 0),
                        chai3d::cVector3d(x + width, y + width, 0));
      mesh->newTriangle(chai3d::cVector3d(x, y, 0), chai3d::cVector3d(x + width, y + width, 0),
                        chai3d::cVector3d(x, y + width, 0));
    }
  mesh->computeAllNormals();
  mesh->m_material->setStiffness(stiffness);
  mesh->m_material->setUseHapticFriction(true);
  mesh->m_material->setStaticFriction(0.55);
  mesh->m_material->setDynamicFriction(kinetic);
  mesh->createAABBCollisionDetector(0.002);
  mesh->setHapticEnabled(true);
  mesh->computeGlobalPositions(true);
  return mesh;
}

struct Outcome {
  double wall = 0.0;        // N, at rest on the floor
  double held_first = 0.0;  // N, friction when the pull of 4 um has just ended
  double held_last = 0.0;   // N, two seconds later
  double lean = 0.0;        // friction over wall force in sliding
  double across = 0.0;      // N, sideways in sliding
  double lifted = 0.0;      // N, in the air
};

Outcome run(chai3d::cAlgorithmFingerProxy& proxy, chai3d::cWorld& world) {
  Outcome out;
  chai3d::cVector3d position(0.003, 0.001, 0.01);
  proxy.setProxyRadius(0.001);
  proxy.initialize(&world, position);
  const auto go = [&](double x, double z, int ticks, const auto& look) {
    const chai3d::cVector3d from = position;
    for (int i = 1; i <= ticks; ++i) {
      const double s = static_cast<double>(i) / ticks;
      position = chai3d::cVector3d(from(0) + s * (x - from(0)), from(1), from(2) + s * (z - from(2)));
      look(proxy.computeForces(position, chai3d::cVector3d(0, 0, 0)));
    }
  };
  chai3d::cVector3d force(0, 0, 0);
  const auto keep = [&](const chai3d::cVector3d& f) { force = f; };
  go(0.003, -0.003, 300, keep);
  out.wall = force(2);
  go(0.003004, -0.003, 20, keep);
  out.held_first = -force(0);
  go(0.003004, -0.003, 2000, keep);
  out.held_last = -force(0);
  go(0.020, -0.003, 500, keep);
  go(0.120, -0.003, 2000, [&](const chai3d::cVector3d& f) {
    out.lean -= f(0) / f(2) / 2000;
    out.across = std::fmax(out.across, std::fabs(f(1)));
  });
  go(0.120, 0.01, 300, keep);
  out.lifted = force.length();
  return out;
}

void print(const char* name, const Outcome& o) {
  std::printf(
      "%-14s wall %.3f N  held %.4f N, after 2 s %.4f N  sliding %.4f of the wall's force, %.4f N aside\n",
      name, o.wall, o.held_first, o.held_last, o.lean, o.across);
}

}  // namespace

int main() {
  chai3d::cWorld world;
  world.addChild(make_floor());
  const auto material = bristle::Material::from_coefficients(
      bristle::Coefficients{}.with_kinetic(kinetic).with_peak(0.55).with_presliding_length(100e-6));
  const auto options =
      bristle::PatchOptions{}.with_max_normal_load(4.0).with_population(bristle::Population::infinite);
  BrushFingerProxy brush(material, BrushProxyOptions{}.with_patch(options).with_period(dt));
  chai3d::cAlgorithmFingerProxy cone;
  const Outcome ours = run(brush, world), theirs = run(cone, world);
  print("brush", ours);
  print("CHAI3D's cone", theirs);
  // 2 mm deep (the proxy is a ball of 1 mm): 1 N and more; held by the stiffness of 1 / 52 um per newton.
  const bool right = ours.wall > 0.9 && ours.held_first > 0.0 && ours.held_last == ours.held_first &&
                     std::fabs(ours.lean - kinetic) < 0.02 * kinetic && ours.lifted == 0.0;
  if (!right) std::printf("not as it should be\n");
  return right ? 0 : 1;
}
