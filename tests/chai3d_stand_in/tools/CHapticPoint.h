// A stand-in for CHAI3D in tests: a haptic point that owns its force algorithm.
#pragma once

#include "forces/CAlgorithmFingerProxy.h"

namespace chai3d {

class cHapticPoint {
 public:
  cHapticPoint() = default;
  cHapticPoint(const cHapticPoint&) = delete;
  cHapticPoint& operator=(const cHapticPoint&) = delete;
  ~cHapticPoint() { delete m_algorithmFingerProxy; }
  void setRadiusContact(double radius) { m_algorithmFingerProxy->setProxyRadius(radius); }

  cAlgorithmFingerProxy* m_algorithmFingerProxy = new cAlgorithmFingerProxy();
};

}  // namespace chai3d
