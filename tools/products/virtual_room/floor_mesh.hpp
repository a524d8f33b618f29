// Floor of the room read from a file: a mesh of triangles, of which the highest counts at each place.
#pragma once

#include <array>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace room {

class FloorMesh {
 public:
  using Vector3 = Eigen::Matrix<double, 3, 1, Eigen::DontAlign>;
  using Triangle = std::array<Vector3, 3>;  ///< corners in the room's axes, m, anticlockwise from above

  /// Copies the triangles into a grid for fast search; leaves out vertical ones.
  explicit FloorMesh(const std::vector<Triangle>& triangles);

  /// Returns the highest triangle above or below the place (x, y); nullptr outside the mesh.
  const Triangle* at(double x, double y) const noexcept;
  double height(double x, double y) const noexcept;  ///< height of that triangle at (x, y), m; 0 outside
  const std::vector<Triangle>& triangles() const noexcept { return triangles_; }

 private:
  static constexpr std::size_t cells = 32;  // number of cells of the grid along x and y
  std::size_t cell_of(double value, int axis) const noexcept;

  std::vector<Triangle> triangles_;
  std::array<std::vector<std::size_t>, cells * cells> grid_;  // for each cell, triangles that may reach it
  double low_[2] = {0, 0}, high_[2] = {0, 0};                 // bounds of the mesh in x and y, m
};

/// Returns the unit normal of a triangle, pointing up.
FloorMesh::Vector3 normal_of(const FloorMesh::Triangle& triangle) noexcept;

/// Reads a mesh (m, z up) from an OBJ file of Wavefront's format: its lines v and f. Throws cli::UserError.
FloorMesh read_floor_mesh(const std::string& path);

}  // namespace room
