#include "tools/products/virtual_room/floor_mesh.hpp"

#include <algorithm>
#include <sstream>

#include <Eigen/Geometry>

#include "tools/libraries/files/text_file.hpp"
#include "tools/libraries/files/user_error.hpp"

namespace room {
namespace {

constexpr std::size_t most_triangles = 100000;
constexpr double farthest = 10.0;  // limit of a vertex's coordinates, m

// Returns twice the area of the triangle a, b, (x, y) seen from above; negative if clockwise.
double area(const FloorMesh::Vector3& a, const FloorMesh::Vector3& b, double x, double y) {
  return (b.x() - a.x()) * (y - a.y()) - (b.y() - a.y()) * (x - a.x());
}
double area(const FloorMesh::Triangle& t) { return area(t[0], t[1], t[2].x(), t[2].y()); }

}  // namespace

FloorMesh::Vector3 normal_of(const FloorMesh::Triangle& t) noexcept {
  const FloorMesh::Vector3 a = t[1] - t[0], b = t[2] - t[0];
  return a.cross(b).normalized();
}

FloorMesh::FloorMesh(const std::vector<Triangle>& triangles) {
  constexpr double least_area = 1e-12;  // twice the area (m^2) below which a triangle is vertical or a line
  for (Triangle t : triangles) {
    if (area(t) < 0.0) std::swap(t[1], t[2]);
    if (area(t) > least_area) triangles_.push_back(t);
  }
  if (triangles_.empty()) return;
  for (int axis = 0; axis < 2; ++axis) {
    low_[axis] = high_[axis] = triangles_.front()[0][axis];
    for (const Triangle& t : triangles_) {
      for (const Vector3& corner : t) {
        low_[axis] = std::min(low_[axis], corner[axis]);
        high_[axis] = std::max(high_[axis], corner[axis]);
      }
    }
  }
  for (std::size_t i = 0; i < triangles_.size(); ++i) {
    const Triangle& t = triangles_[i];
    const Vector3 least = t[0].cwiseMin(t[1]).cwiseMin(t[2]), most = t[0].cwiseMax(t[1]).cwiseMax(t[2]);
    for (std::size_t x = cell_of(least.x(), 0); x <= cell_of(most.x(), 0); ++x) {
      for (std::size_t y = cell_of(least.y(), 1); y <= cell_of(most.y(), 1); ++y)
        grid_[x * cells + y].push_back(i);
    }
  }
}

std::size_t FloorMesh::cell_of(double value, int axis) const noexcept {
  const double share = (value - low_[axis]) / (high_[axis] - low_[axis]);
  return static_cast<std::size_t>(std::clamp(share * cells, 0.0, cells - 1.0));
}

const FloorMesh::Triangle* FloorMesh::at(double x, double y) const noexcept {
  if (!(x >= low_[0] && x <= high_[0] && y >= low_[1] && y <= high_[1])) return nullptr;
  const Triangle* best = nullptr;
  double highest = 0.0;
  for (const std::size_t i : grid_[cell_of(x, 0) * cells + cell_of(y, 1)]) {
    const Triangle& t = triangles_[i];
    const double a = area(t[1], t[2], x, y), b = area(t[2], t[0], x, y), c = area(t[0], t[1], x, y);
    if (a < 0.0 || b < 0.0 || c < 0.0) continue;
    const double height = (a * t[0].z() + b * t[1].z() + c * t[2].z()) / (a + b + c);
    if (best != nullptr && height <= highest) continue;
    best = &t;
    highest = height;
  }
  return best;
}

double FloorMesh::height(double x, double y) const noexcept {
  const Triangle* triangle = at(x, y);
  if (triangle == nullptr) return 0.0;
  const Vector3 normal = normal_of(*triangle), &corner = (*triangle)[0];
  return corner.z() + (normal.x() * (corner.x() - x) + normal.y() * (corner.y() - y)) / normal.z();
}

FloorMesh read_floor_mesh(const std::string& path) {
  std::istringstream file(cli::read_text_file(path, std::size_t{1} << 24));
  std::vector<FloorMesh::Vector3> vertices;
  std::vector<FloorMesh::Triangle> triangles;
  std::string line;
  for (long number = 1; std::getline(file, line); ++number) {
    const auto refuse = [&](const std::string& why) {
      throw cli::UserError(path + ":" + std::to_string(number) + ": " + why);
    };
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word == "v") {
      FloorMesh::Vector3 at;
      if (!(words >> at.x() >> at.y() >> at.z()) || at.cwiseAbs().maxCoeff() > farthest)
        refuse("a vertex needs three numbers of at most 10 m");
      vertices.push_back(at);
    } else if (word == "f") {
      std::vector<std::size_t> face;  // words "7", "7/2" or "7/2/3", whose first number is the vertex
      while (words >> word) {
        const long index = std::strtol(word.c_str(), nullptr, 10);
        if (index < 1 || index > static_cast<long>(vertices.size()))
          refuse("'" + word + "' is not the number of a vertex above; allowed: 1 to " +
                 std::to_string(vertices.size()));
        face.push_back(static_cast<std::size_t>(index - 1));
      }
      if (face.size() < 3) refuse("a face needs at least three vertices");
      for (std::size_t i = 2; i < face.size(); ++i)
        triangles.push_back({vertices[face[0]], vertices[face[i - 1]], vertices[face[i]]});
      if (triangles.size() > most_triangles) refuse("more than 100,000 triangles");
    }
  }
  FloorMesh mesh(triangles);
  if (mesh.triangles().empty()) throw cli::UserError(path + ": no face that lies under the block");
  return mesh;
}

}  // namespace room
