// The camera of the room: an eye that orbits a point. The axis z points up.
#pragma once

#include <Eigen/Dense>

namespace room {

struct Ray {
  Eigen::Vector3f from, along;  ///< origin of the ray, m; unit vector along it
};

/// Rectangle of a picture in pixels, from its upper left corner; y points down.
struct Area {
  float x = 0, y = 0, width = 1, height = 1;

  bool holds(float px, float py) const { return px >= x && py >= y && px < x + width && py < y + height; }
};

struct Camera {
  Eigen::Vector3f target{-0.015f, 0.0f, 0.072f};  ///< point that the eye looks at, m
  float distance = 0.99f;                         ///< distance of the eye from the target, m
  float azimuth = -1.93f, elevation = 0.40f;      ///< direction of the eye seen from the target, rad
  float field_of_view = 0.56f;                    ///< vertical angle that the picture covers, rad

  Eigen::Vector3f eye() const;
  Eigen::Matrix4f view() const;
  Eigen::Matrix4f projection(float aspect) const;

  void orbit(float azimuth_by, float elevation_by);
  void zoom(float factor);
  /// Moves the camera's target so that the picture shifts by these fractions of its height.
  void pan(float right, float up);

  /// Returns the ray from the eye through a pixel of the area in which the camera's picture is shown.
  Ray ray(const Area& area, float px, float py) const;
  /// Finds the pixel at which a point is seen. Returns false if it is behind the eye or far outside.
  bool find_pixel(const Area& area, const Eigen::Vector3f& point, float& px, float& py) const;
};

Eigen::Matrix4f look_at(const Eigen::Vector3f& eye, const Eigen::Vector3f& target, const Eigen::Vector3f& up);
Eigen::Matrix4f perspective(float field_of_view, float aspect, float nearest, float farthest);

}  // namespace room
