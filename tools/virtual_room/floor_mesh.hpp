// Floor that a file gives: triangles over the room's plan, of which the highest counts at each place.
#pragma once

#include <array>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace room {

class FloorMesh {
 public:
  using Vector3 = Eigen::Matrix<double, 3, 1, Eigen::DontAlign>;
  using Triangle = std::array<Vector3, 3>;  ///< m, corners in the room's axes, anticlockwise seen from above

  /// Copies triangles; vertical ones are left out.
  explicit FloorMesh(const std::vector<Triangle>& triangles);

  /// Returns the triangle over or under a place of the plan, the highest of several; nullptr beside the mesh.
  const Triangle* at(double x, double y) const noexcept;
  double height(double x, double y) const noexcept;  ///< m, of that triangle; 0 beside the mesh
  const std::vector<Triangle>& triangles() const noexcept { return triangles_; }

 private:
  static constexpr std::size_t cells = 32;  // of the grid, along x and along y
  std::size_t cell_of(double value, int axis) const noexcept;

  std::vector<Triangle> triangles_;
  std::array<std::vector<std::size_t>, cells * cells> grid_;  // triangles whose bounds reach into each cell
  double low_[2] = {0, 0}, high_[2] = {0, 0};                 // m, bounds of the mesh
};

/// Returns the unit normal that points up.
FloorMesh::Vector3 normal_of(const FloorMesh::Triangle& triangle) noexcept;

/// Reads a mesh in Wavefront's OBJ format (m, z up), of which the lines v and f count. Throws cli::UserError.
FloorMesh read_floor_mesh(const std::string& path);

}  // namespace room
