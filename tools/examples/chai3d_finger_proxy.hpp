// CHAI3D's finger proxy with brush friction. Wants CHAI3D 3.x (www.chai3d.org) and bristle::eigen.
//
//   cHapticPoint* point = tool->m_hapticPoint;            // cToolCursor
//   delete point->m_algorithmFingerProxy;
//   point->m_algorithmFingerProxy = new BrushFingerProxy(skin, options, 1e-3, max_force);
//   point->initialize();                                  // or m_algorithmFingerProxy->initialize(world,
//   place)
//
// The proxy itself slides without friction, so that it stays where CHAI3D finds the surface; its spring gives
// the force of the wall, which is the load on the patch, and the patch is moved by what the device moved.
// Friction of an object is on when its material has setUseHapticFriction(true); setStaticFriction and
// setDynamicFriction are not read: the coefficients are the material's that is given here.
#pragma once

#include <limits>

#include <bristle/bristle.hpp>
#include <bristle/haptic_point.hpp>

#include "forces/CAlgorithmFingerProxy.h"
#include "world/CGenericObject.h"

class BrushFingerProxy : public chai3d::cAlgorithmFingerProxy {
 public:
  /// `dt_s`: period of the servo thread, s. `max_force_n`: cHapticDeviceInfo::m_maxLinearForce. Throws
  /// bristle::Error. To be made before the servo thread runs.
  BrushFingerProxy(const bristle::Material& material, const bristle::PatchOptions& options, double dt_s,
                   double max_force_n = std::numeric_limits<double>::infinity())
      : dt_s_(dt_s),
        point_(bristle::HapticOptions{}
                   .with_force_limit(max_force_n)
                   .with_peak_coefficient(material.peak_coefficient())) {
    motion_.id = batch_.add(material, options);
    batch_.warm_up();
  }

  const bristle::HapticPoint& point() const { return point_; }
  const bristle::Response& response() const { return response_; }

 protected:
  /// Where the surface alone lets the proxy go; what holds it back is the patch.
  void testFrictionAndMoveProxy(const chai3d::cVector3d& a_goal, const chai3d::cVector3d&, chai3d::cVector3d&,
                                chai3d::cGenericObject*) override {
    m_nextBestProxyGlobalPos = a_goal;
  }

  void updateForce() override {
    cAlgorithmFingerProxy::updateForce();
    // On a face the wall pushes along its normal; what else the spring has there is a proxy that lags. In an
    // edge or a corner the spring of a proxy without friction is the force of the contact as a whole.
    const Eigen::Vector3d wall = from(m_numCollisionEvents == 1 ? m_normalForce : m_lastGlobalForce);
    bool rough = m_numCollisionEvents > 0 && wall.squaredNorm() > 0.0;
    for (unsigned int i = 0; rough && i < m_numCollisionEvents; ++i)
      rough = m_collisionEvents[i]->m_object->m_material->getUseHapticFriction();
    point_.prepare(dt_s_, from(m_deviceGlobalPos), wall, rough ? wall.norm() : 0.0, motion_);
    batch_.step(dt_s_, {&motion_, 1}, {&response_, 1});
    const Eigen::Vector3d force = point_.finish(response_);
    if (!rough) return;
    m_tangentialForce = to(point_.friction());
    m_normalForce = to(force - point_.friction());
    m_lastGlobalForce = to(force);
  }

 private:
  static Eigen::Vector3d from(const chai3d::cVector3d& v) { return {v(0), v(1), v(2)}; }
  static chai3d::cVector3d to(const Eigen::Vector3d& v) { return {v[0], v[1], v[2]}; }

  bristle::PatchBatch batch_;
  bristle::Motion motion_;
  bristle::Response response_;
  double dt_s_;
  bristle::HapticPoint point_;
};
