// A stand-in for CHAI3D in tests: the classes that tools/examples/chai3d_finger_proxy.hpp uses, under their
// names, over shapes given by a distance function. It contains no code of CHAI3D.
#pragma once

#include <cmath>
#include <functional>
#include <memory>
#include <vector>

#include <Eigen/Core>

namespace chai3d {

struct cVector3d {
  cVector3d() = default;
  cVector3d(double x, double y, double z) : values{x, y, z} {}
  double& operator()(unsigned int i) { return values[i]; }
  double operator()(unsigned int i) const { return values[i]; }
  void zero() { *this = cVector3d(); }
  double length() const { return std::hypot(values[0], values[1], values[2]); }

  double values[3] = {0.0, 0.0, 0.0};
};

struct cMatrix3d {
  double& operator()(int i, int j) { return values[i][j]; }
  const double& operator()(int i, int j) const { return values[i][j]; }

  double values[3][3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};
};

inline Eigen::Vector3d eigen(const cVector3d& v) { return {v(0), v(1), v(2)}; }
inline Eigen::Matrix3d eigen(const cMatrix3d& m) {
  Eigen::Matrix3d to;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) to(i, j) = m(i, j);
  return to;
}
inline cVector3d chai(const Eigen::Vector3d& v) { return {v[0], v[1], v[2]}; }
inline cMatrix3d chai_rotation(const Eigen::Matrix3d& m) {
  cMatrix3d to;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) to(i, j) = m(i, j);
  return to;
}

struct cMaterial {
  bool getUseHapticFriction() const { return friction; }
  void setUseHapticFriction(bool on) { friction = on; }
  double getStiffness() const { return stiffness; }
  void setStiffness(double newtons_per_metre) { stiffness = newtons_per_metre; }

  bool friction = true;
  double stiffness = 500.0;
};

class cGenericObject {
 public:
  /// Returns a point's distance from the surface, in the object's frame, negative inside. Sets the normal.
  using Distance = std::function<double(const Eigen::Vector3d&, Eigen::Vector3d&)>;

  explicit cGenericObject(Distance shape) : distance(std::move(shape)) {}
  cVector3d getGlobalPos() const { return place; }
  cMatrix3d getGlobalRot() const { return turned; }

  Distance distance;
  cVector3d place;
  cMatrix3d turned;
  std::shared_ptr<cMaterial> m_material = std::make_shared<cMaterial>();
};

struct cWorld {
  std::vector<cGenericObject*> objects;
};

}  // namespace chai3d
