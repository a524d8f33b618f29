#include "tools/products/virtual_room/camera.hpp"

#include <algorithm>
#include <cmath>

namespace room {

Eigen::Matrix4f look_at(const Eigen::Vector3f& eye, const Eigen::Vector3f& target,
                        const Eigen::Vector3f& up) {
  const Eigen::Vector3f back = (eye - target).normalized();
  const Eigen::Vector3f right = up.cross(back).normalized();
  const Eigen::Vector3f above = back.cross(right);
  Eigen::Matrix4f m = Eigen::Matrix4f::Identity();
  m.block<1, 3>(0, 0) = right.transpose();
  m.block<1, 3>(1, 0) = above.transpose();
  m.block<1, 3>(2, 0) = back.transpose();
  m.block<3, 1>(0, 3) = -m.block<3, 3>(0, 0) * eye;
  return m;
}

Eigen::Matrix4f perspective(float field_of_view, float aspect, float nearest, float farthest) {
  const float focal = 1.0f / std::tan(field_of_view / 2);
  Eigen::Matrix4f m = Eigen::Matrix4f::Zero();
  m(0, 0) = focal / aspect;
  m(1, 1) = focal;
  m(2, 2) = (farthest + nearest) / (nearest - farthest);
  m(2, 3) = 2 * farthest * nearest / (nearest - farthest);
  m(3, 2) = -1;
  return m;
}

Eigen::Vector3f Camera::eye() const {
  const Eigen::Vector3f out(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                            std::sin(elevation));
  return target + distance * out;
}

Eigen::Matrix4f Camera::view() const { return look_at(eye(), target, Eigen::Vector3f::UnitZ()); }

Eigen::Matrix4f Camera::projection(float aspect) const {
  return perspective(field_of_view, aspect, 0.02f, 6.0f);
}

void Camera::orbit(float azimuth_by, float elevation_by) {
  azimuth += azimuth_by;
  elevation = std::clamp(elevation + elevation_by, -0.05f, 1.5f);
}

void Camera::zoom(float factor) { distance = std::clamp(distance * factor, 0.12f, 3.0f); }

void Camera::pan(float right, float up) {
  const Eigen::Matrix4f m = view();
  const float height = 2 * distance * std::tan(field_of_view / 2);
  target -= height * (right * m.block<1, 3>(0, 0) + up * m.block<1, 3>(1, 0)).transpose();
  target = target.cwiseMax(-0.6f).cwiseMin(0.6f);
}

Ray Camera::ray(const Area& area, float px, float py) const {
  const float tall = std::tan(field_of_view / 2), wide = tall * area.width / area.height;
  const float right = (2 * (px - area.x) / area.width - 1) * wide;
  const float up = (1 - 2 * (py - area.y) / area.height) * tall;
  const Eigen::Matrix3f axes = view().block<3, 3>(0, 0).transpose();
  return {eye(), (axes * Eigen::Vector3f(right, up, -1)).normalized()};
}

bool Camera::find_pixel(const Area& area, const Eigen::Vector3f& point, float& px, float& py) const {
  const Eigen::Vector4f clip = projection(area.width / area.height) * view() * point.homogeneous();
  if (!(clip.w() > 0)) return false;
  px = area.x + area.width * 0.5f * (1 + clip.x() / clip.w());
  py = area.y + area.height * 0.5f * (1 - clip.y() / clip.w());
  return std::abs(px) < 1e6f && std::abs(py) < 1e6f;
}

}  // namespace room
