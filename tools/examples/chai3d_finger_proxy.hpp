// CHAI3D's finger proxy with the friction of a brush. It needs CHAI3D 3.x (www.chai3d.org) and
// bristle::eigen.
//
//   BrushFingerProxy* brush = install_brush(*tool->m_hapticPoint, skin,              // a cToolCursor's point
//                                           BrushProxyOptions{}.with_force_limit(max_force));
//   tool->enableDynamicObjects(true);                                                // where objects move
//
// The proxy itself slides without friction, so it stays where CHAI3D finds the surface; its spring gives the
// force of the wall, which is the load on the patch. The patch is moved by what the device moved over the
// surface: positions are those in the frame of the object that is touched, so that a block held by two tools
// carries its bristles along. An object has friction when its material has setUseHapticFriction(true);
// setStaticFriction and setDynamicFriction are not read: the coefficients are those of `skin`.
//
// - When the contact goes over to another object (the next mesh of a floor, the other wall of an edge), bent
//   bristles stay bent, and the frame of the new object is followed from the next tick on. An object may be
//   deleted while it is touched, once it is out of the world. Where one with the same material then takes its
//   memory, call restart().
// - In an edge or a corner (2 or 3 collision events) the walls have one patch together, under the sum of
//   their forces: that of the proxy's spring.
// - A tool frame that turns or moves (a camera that flies) moves the tool over the surface. Call restart()
//   where the hand should not feel it.
// - A workspace scale s (cGenericTool::setWorkspaceRadius over the device's) makes each count c of an encoder
//   a displacement of s c. See count_step().
#pragma once

#include <limits>
#include <memory>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <bristle/bristle.hpp>
#include <bristle/haptic_point.hpp>

#include "forces/CAlgorithmFingerProxy.h"
#include "tools/CHapticPoint.h"
#include "world/CGenericObject.h"

struct BrushProxyOptions {
  /// Options of the patch. The infinite brush has no ripple; a law with SnapRule::keep needs
  /// Population::representatives.
  bristle::PatchOptions patch =
      bristle::PatchOptions{}.with_max_normal_load(10.0).with_population(bristle::Population::infinite);
  double dt_s = 1e-3;                                            ///< period of the servo thread, s
  double force_limit = std::numeric_limits<double>::infinity();  ///< N, cHapticDeviceInfo::m_maxLinearForce

  /// Motion of the tool, m, that one count of the encoders makes: the count times the workspace scale. The
  /// damper's velocity is smoothed by it (HapticOptions::resolution).
  double resolution = 0.0;
  /// Whether to send the mean friction of the tick instead of the friction at its end. This halves ripple
  /// with few representatives, but acts half a tick later, so the device must damp K T instead of K T / 2 (K
  /// stiffness, T tick).
  bool mean = false;

  BrushProxyOptions& with_patch(const bristle::PatchOptions& value) {
    patch = value;
    return *this;
  }
  BrushProxyOptions& with_period(double seconds) {
    dt_s = seconds;
    return *this;
  }
  BrushProxyOptions& with_force_limit(double newtons) {
    force_limit = newtons;
    return *this;
  }
  BrushProxyOptions& with_resolution(double metres) {
    resolution = metres;
    return *this;
  }
  BrushProxyOptions& with_mean(bool value) {
    mean = value;
    return *this;
  }
};

class BrushFingerProxy : public chai3d::cAlgorithmFingerProxy {
 public:
  /// Makes the proxy. Call it before the servo thread runs. Throws bristle::Error.
  explicit BrushFingerProxy(const bristle::Material& material, const BrushProxyOptions& options = {})
      : options_(options),
        point_(bristle::HapticOptions{}
                   .with_force_limit(options.force_limit)
                   .with_peak_coefficient(material.peak_coefficient())
                   .with_resolution(options.resolution)
                   .with_mean(options.mean)) {
    bristle::PatchOptions patch = options.patch;
    if (options.mean) patch.outputs = patch.outputs | bristle::Outputs::mean;
    motion_.id = batch_.add(material, patch);
    batch_.warm_up();
  }

  const bristle::HapticPoint& point() const { return point_; }
  const bristle::Response& response() const { return response_; }

  /// Copies the settings of the finger proxy that this one replaces: radius, dynamic mode, collision
  /// settings, tolerances. install_brush() calls it.
  void take_settings(cAlgorithmFingerProxy& from) {
    setEpsilonBaseValue(from.getEpsilonBaseValue());
    m_collisionSettings = from.m_collisionSettings;
    setProxyRadius(from.getProxyRadius());
    m_useDynamicProxy = from.m_useDynamicProxy;
    m_forceShadingAngleThreshold = from.m_forceShadingAngleThreshold;
    m_frictionDynHysteresisMultiplier = from.m_frictionDynHysteresisMultiplier;
  }

  /// Straightens the bristles. Call it after a jump that the hand did not make, which would be felt as
  /// friction: the device was indexed, the tool's frame or the scene moved, an object was replaced.
  void restart() {
    point_.restart();
    object_ = nullptr;
  }

  struct CountStep {
    double force_n;  ///< step of friction when an encoder moves by one count, N
    double share;    ///< force step of one count over the highest friction; above 0.2 it is felt as grain

    /// Damping, N s/m, that the device itself needs at the hand to make the loop passive.
    double damping_n_s_per_m;
  };
  /// Returns the effect of a count of `count_m` (m, at the hand) in a workspace scaled by `scale`, under a
  /// wall force of `load_n`: the patch, of stiffness K, moves by scale times the count, and the hand feels
  /// scale times K. Remedies are a presliding length of at least ten counts times the scale (share 0.2; it
  /// divides all three), the material's damping with `resolution` set to that product, or a faster loop.
  CountStep count_step(double count_m, double scale, double load_n) {
    const bristle::Response rest =
        batch_.find_force(options_.dt_s, bristle::Motion{motion_.id, {0.0, 0.0}, load_n});
    const double step = rest.stiffness * scale * count_m;
    return {step, step / rest.force_limit,
            0.5 * rest.stiffness * scale * options_.dt_s * (options_.mean ? 2 : 1)};
  }

 protected:
  /// Moves the proxy as on a surface without friction, in place of CHAI3D's rule, because the patch supplies
  /// the friction.
  void testFrictionAndMoveProxy(const chai3d::cVector3d& a_goal, const chai3d::cVector3d&, chai3d::cVector3d&,
                                chai3d::cGenericObject*) override {
    m_nextBestProxyGlobalPos = a_goal;
  }

  void updateForce() override {
    cAlgorithmFingerProxy::updateForce();
    follow_object();
    // Takes the load from the spring force. On a face the load is the part along the normal (the rest comes
    // from a proxy that lags behind), in an edge or corner the whole force.
    const Eigen::Vector3d wall = from(m_numCollisionEvents == 1 ? m_normalForce : m_lastGlobalForce);
    bool rough = m_numCollisionEvents > 0 && wall.squaredNorm() > 0.0;
    for (unsigned int i = 0; rough && i < m_numCollisionEvents; ++i)
      rough = m_collisionEvents[i]->m_object->m_material->getUseHapticFriction();
    point_.prepare(options_.dt_s, surface_.inverse() * from(m_deviceGlobalPos),
                   surface_.linear().transpose() * wall, rough ? wall.norm() : 0.0, motion_);
    batch_.step(options_.dt_s, {&motion_, 1}, {&response_, 1});
    const Eigen::Vector3d force = surface_.linear() * point_.finish(response_);
    if (!rough) return;
    const Eigen::Vector3d friction = surface_.linear() * point_.friction();
    m_tangentialForce = to(friction);
    m_normalForce = to(force - friction);
    m_lastGlobalForce = to(force);
  }

 private:
  using Pose = Eigen::Transform<double, 3, Eigen::Isometry, Eigen::DontAlign>;

  static Eigen::Vector3d from(const chai3d::cVector3d& v) { return {v(0), v(1), v(2)}; }
  static chai3d::cVector3d to(const Eigen::Vector3d& v) { return {v[0], v[1], v[2]}; }
  static Pose pose_of(const chai3d::cGenericObject& object) {
    const chai3d::cMatrix3d turned = object.getGlobalRot();
    Pose pose;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) pose.linear()(i, j) = turned(i, j);
    pose.translation() = from(object.getGlobalPos());
    return pose;
  }

  /// Moves the contact's frame with the touched object, so that a moving object carries the bristles along.
  /// Reads only objects touched in this tick, since others may be deleted. A new object at an old address is
  /// recognised by its material.
  void follow_object() {
    bool held = false;
    for (unsigned int i = 0; i < m_numCollisionEvents; ++i)
      held = held || is_followed(*m_collisionEvents[i]->m_object);
    if (held) {
      surface_ = pose_of(*object_) * on_object_;
    } else {
      object_ = m_numCollisionEvents > 0 ? m_collisionEvents[0]->m_object : nullptr;
      if (object_ != nullptr) {
        material_ = object_->m_material;
        on_object_ = pose_of(*object_).inverse() * surface_;
      }
    }
    // Makes the rotation matrix orthonormal again, since rounding errors of the products of many ticks add
    // up.
    surface_.linear() = Eigen::Quaterniond(surface_.linear()).normalized().toRotationMatrix();
  }

  bool is_followed(const chai3d::cGenericObject& object) const {
    return &object == object_ && !material_.owner_before(object.m_material) &&
           !object.m_material.owner_before(material_);
  }

  BrushProxyOptions options_;
  bristle::PatchBatch batch_;
  bristle::Motion motion_;
  bristle::Response response_;
  bristle::HapticPoint point_;
  chai3d::cGenericObject* object_ = nullptr;  // object touched in the last tick
  // Material of object_, by which a new object at the same address is recognised.
  std::weak_ptr<chai3d::cMaterial> material_;
  Pose surface_ = Pose::Identity(),
       on_object_ = Pose::Identity();  // poses of the contact in the world, and on object_
};

/// Replaces the finger proxy of a haptic point by one with bristles. The new one takes over radius, dynamic
/// mode and tolerances, and belongs to the point. Call it once the tool is in its world, before the servo
/// thread runs. Throws bristle::Error.
inline BrushFingerProxy* install_brush(chai3d::cHapticPoint& point, const bristle::Material& material,
                                       const BrushProxyOptions& options = {}) {
  auto* brush = new BrushFingerProxy(material, options);
  chai3d::cAlgorithmFingerProxy* old = point.m_algorithmFingerProxy;
  brush->take_settings(*old);
  brush->initialize(old->getWorld(), old->getDeviceGlobalPosition());
  point.m_algorithmFingerProxy = brush;
  delete old;
  return brush;
}
