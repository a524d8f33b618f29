// A stand-in for CHAI3D in tests: a finger proxy that finds the surface at once.
#pragma once

#include <cstddef>

#include "world/CGenericObject.h"

namespace chai3d {

struct cCollisionEvent {
  cGenericObject* m_object = nullptr;
  cVector3d m_globalNormal;
};

struct cCollisionSettings {
  double m_collisionRadius = 0.0;
  bool m_checkVisibleObjects = false;
};

class cAlgorithmFingerProxy {
 public:
  cAlgorithmFingerProxy() {
    for (std::size_t i = 0; i < 3; ++i) m_collisionEvents[i] = &events_[i];
  }
  cAlgorithmFingerProxy(const cAlgorithmFingerProxy&) = delete;
  cAlgorithmFingerProxy& operator=(const cAlgorithmFingerProxy&) = delete;
  virtual ~cAlgorithmFingerProxy() = default;

  void initialize(cWorld* world, const cVector3d& position) {
    m_world = world;
    m_deviceGlobalPos = m_proxyGlobalPos = position;
    m_numCollisionEvents = 0;
  }
  void reset() {
    m_proxyGlobalPos = m_deviceGlobalPos;
    m_numCollisionEvents = 0;
  }
  virtual cVector3d computeForces(const cVector3d& position, const cVector3d&) {
    m_deviceGlobalPos = position;
    if (m_world == nullptr) return {};
    find_proxy();
    updateForce();
    return m_lastGlobalForce;
  }

  void setProxyRadius(const double& radius) { m_radius = m_collisionSettings.m_collisionRadius = radius; }
  double getProxyRadius() const { return m_radius; }
  void setEpsilonBaseValue(double value) { m_epsilonBaseValue = value; }
  double getEpsilonBaseValue() { return m_epsilonBaseValue; }
  cVector3d getDeviceGlobalPosition() const { return m_deviceGlobalPos; }
  cVector3d getNormalForce() { return m_normalForce; }
  cVector3d getTangentialForce() { return m_tangentialForce; }
  cWorld* getWorld() { return m_world; }
  int getNumCollisionEvents() { return static_cast<int>(m_numCollisionEvents); }

  cCollisionEvent* m_collisionEvents[3];
  bool m_useDynamicProxy = false;
  double m_frictionDynHysteresisMultiplier = 0.6;
  double m_forceShadingAngleThreshold = 0.75;
  cCollisionSettings m_collisionSettings;

 protected:
  virtual void testFrictionAndMoveProxy(const cVector3d& goal, const cVector3d& proxy, cVector3d&,
                                        cGenericObject*) {
    // Leaves the proxy in place, as friction without a limit does; a subclass overrides it.
    m_nextBestProxyGlobalPos = proxy;
    (void)goal;
  }
  virtual void updateForce() {
    m_normalForce.zero();
    m_tangentialForce.zero();
    m_lastGlobalForce.zero();
    if (m_numCollisionEvents == 0) return;
    double stiffness = 0.0;
    Eigen::Vector3d normal(0, 0, 0);
    for (unsigned int i = 0; i < m_numCollisionEvents; ++i) {
      stiffness += m_collisionEvents[i]->m_object->m_material->getStiffness() / m_numCollisionEvents;
      normal += eigen(m_collisionEvents[i]->m_globalNormal);
    }
    const Eigen::Vector3d force = stiffness * (eigen(m_proxyGlobalPos) - eigen(m_deviceGlobalPos));
    normal.normalize();
    m_normalForce = chai(normal.dot(force) * normal);
    m_tangentialForce = chai(force - normal.dot(force) * normal);
    m_lastGlobalForce = chai(force);
  }

  cWorld* m_world = nullptr;
  cVector3d m_proxyGlobalPos, m_deviceGlobalPos, m_nextBestProxyGlobalPos;
  cVector3d m_lastGlobalForce, m_normalForce, m_tangentialForce;
  double m_radius = 0.01, m_epsilonBaseValue = 1e-4;
  unsigned int m_numCollisionEvents = 0;

 private:
  /// Moves the proxy (the point that stays outside) out of one object after the other, along their normals.
  void find_proxy() {
    Eigen::Vector3d goal = eigen(m_deviceGlobalPos);
    m_numCollisionEvents = 0;
    for (cGenericObject* object : m_world->objects) {
      const Eigen::Matrix3d turned = eigen(object->turned);
      Eigen::Vector3d normal(0, 0, 0);
      const double distance =
          object->distance(turned.transpose() * (goal - eigen(object->place)), normal) - m_radius;
      if (!(distance < 0.0) || m_numCollisionEvents == 3) continue;
      goal -= distance * turned * normal;
      events_[m_numCollisionEvents++] = {object, chai(turned * normal)};
    }
    if (m_numCollisionEvents > 0) {
      cVector3d normal = events_[0].m_globalNormal;
      testFrictionAndMoveProxy(chai(goal), m_proxyGlobalPos, normal, events_[0].m_object);
      m_proxyGlobalPos = m_nextBestProxyGlobalPos;
    } else {
      m_proxyGlobalPos = m_deviceGlobalPos;
    }
  }

  cCollisionEvent events_[3];
};

}  // namespace chai3d
