// Camera: an eye that orbits a point, z up.
#pragma once

#include <Eigen/Dense>

namespace room {

struct Ray {
  Eigen::Vector3f from, along;  ///< m, origin of the ray; unit vector along it
};

/// Rectangle of the picture in pixels, y down.
struct Area {
  float x = 0, y = 0, width = 1, height = 1;

  bool holds(float px, float py) const { return px >= x && py >= y && px < x + width && py < y + height; }
};

struct Camera {
  Eigen::Vector3f target{-0.015f, 0.0f, 0.072f};  ///< m, point that the eye looks at
  float distance = 0.99f;                         ///< m, from the eye to the target
  float azimuth = -1.93f, elevation = 0.40f;      ///< rad, direction of the eye seen from the target
  float field_of_view = 0.56f;                    ///< rad, vertical angle that the picture covers

  Eigen::Vector3f eye() const;
  Eigen::Matrix4f view() const;
  Eigen::Matrix4f projection(float aspect) const;

  void orbit(float azimuth_by, float elevation_by);
  void zoom(float factor);
  /// Moves the target with the picture, by fractions of the picture's height.
  void pan(float right, float up);

  /// Returns the ray through a pixel of the area that the camera fills.
  Ray ray(const Area& area, float px, float py) const;
  /// Finds the pixel where a point is seen; returns false if it is behind the eye or far outside.
  bool find_pixel(const Area& area, const Eigen::Vector3f& point, float& px, float& py) const;
};

Eigen::Matrix4f look_at(const Eigen::Vector3f& eye, const Eigen::Vector3f& target, const Eigen::Vector3f& up);
Eigen::Matrix4f perspective(float field_of_view, float aspect, float nearest, float farthest);
Eigen::Matrix4f orthographic(float half_width, float half_height, float nearest, float farthest);

}  // namespace room
