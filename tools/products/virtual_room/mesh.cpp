#include "tools/products/virtual_room/mesh.hpp"

#include <cmath>
#include <cstddef>

namespace room {

namespace {

constexpr float pi = 3.14159265f;

using Eigen::Vector3f;

void add_quad(Triangles& shape, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  shape.indices.insert(shape.indices.end(), {a, b, c, a, c, d});
}

// Joins each ring of vertices to the next one by triangles, which makes the skin of a tube.
void join_rings(Triangles& shape, std::uint32_t first, int rings, int around) {
  const auto per_ring = static_cast<std::uint32_t>(around + 1);
  for (std::uint32_t ring = 0; ring + 1 < static_cast<std::uint32_t>(rings); ++ring) {
    for (std::uint32_t i = 0; i + 1 < per_ring; ++i) {
      const std::uint32_t a = first + ring * per_ring + i;
      add_quad(shape, a, a + 1, a + per_ring + 1, a + per_ring);
    }
  }
}

// Returns the positions of vertices across a face of the rounded box. They are dense at the rims, which are
// curved.
std::vector<float> rounded_stations(float half, float radius) {
  constexpr int steps = 5;
  std::vector<float> stations;
  for (int i = 0; i <= steps; ++i)
    stations.push_back(-half + radius * (1 - std::cos(pi / 4 * static_cast<float>(i) / steps)) * 3.4142135f);
  for (int i = steps; i >= 0; --i) stations.push_back(-stations[static_cast<std::size_t>(i)]);
  return stations;
}

}  // namespace

Triangles make_rounded_box(const Vector3f& half, float radius) {
  Triangles shape;
  const Vector3f core = half.array() - radius;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const auto across = rounded_stations(half[u], radius), up = rounded_stations(half[v], radius);
    for (const float side : {-1.0f, 1.0f}) {
      const auto first = static_cast<std::uint32_t>(shape.vertices.size());
      for (const float y : up) {
        for (const float x : across) {
          Vector3f point;
          point[axis] = side * half[axis];
          point[u] = x;
          point[v] = y;
          const Vector3f inner = point.cwiseMax(-core).cwiseMin(core);
          const Vector3f normal = (point - inner).normalized();
          shape.vertices.push_back({inner + radius * normal, normal});
        }
      }
      const auto row = static_cast<std::uint32_t>(across.size());
      for (std::uint32_t j = 0; j + 1 < up.size(); ++j) {
        for (std::uint32_t i = 0; i + 1 < row; ++i) {
          const std::uint32_t a = first + j * row + i;
          if (side > 0) {
            add_quad(shape, a, a + 1, a + row + 1, a + row);
          } else {
            add_quad(shape, a, a + row, a + row + 1, a + 1);
          }
        }
      }
    }
  }
  return shape;
}

Triangles make_sphere(int around) {
  Triangles shape;
  const int rings = around / 2 + 1;
  for (int j = 0; j < rings; ++j) {
    const float latitude = pi * (static_cast<float>(j) / static_cast<float>(rings - 1) - 0.5f);
    for (int i = 0; i <= around; ++i) {
      const float longitude = 2 * pi * static_cast<float>(i) / static_cast<float>(around);
      const Vector3f out(std::cos(latitude) * std::cos(longitude), std::cos(latitude) * std::sin(longitude),
                         std::sin(latitude));
      shape.vertices.push_back({out, out});
    }
  }
  join_rings(shape, 0, rings, around);
  return shape;
}

Triangles make_rod(int around, float end_radius) {
  Triangles shape;
  const float lean = 1 - end_radius;
  for (int j = 0; j < 2; ++j) {
    const float radius = j == 0 ? 1.0f : end_radius;
    for (int i = 0; i <= around; ++i) {
      const float angle = 2 * pi * static_cast<float>(i) / static_cast<float>(around);
      const Vector3f out(std::cos(angle), std::sin(angle), 0);
      shape.vertices.push_back({radius * out + static_cast<float>(j) * Vector3f::UnitZ(),
                                Vector3f(out.x(), out.y(), lean).normalized()});
    }
  }
  join_rings(shape, 0, 2, around);
  for (int j = 0; j < 2; ++j) {  // adds discs that close both ends of the rod
    const auto centre = static_cast<std::uint32_t>(shape.vertices.size());
    const Vector3f normal(0, 0, j == 0 ? -1.0f : 1.0f);
    const float radius = j == 0 ? 1.0f : end_radius;
    shape.vertices.push_back({static_cast<float>(j) * Vector3f::UnitZ(), normal});
    for (int i = 0; i <= around; ++i) {
      const float angle = (j == 0 ? -2 : 2) * pi * static_cast<float>(i) / static_cast<float>(around);
      shape.vertices.push_back(
          {Vector3f(radius * std::cos(angle), radius * std::sin(angle), static_cast<float>(j)), normal});
    }
    for (std::uint32_t i = 1; i <= static_cast<std::uint32_t>(around); ++i)
      shape.indices.insert(shape.indices.end(), {centre, centre + i, centre + i + 1});
  }
  return shape;
}

Triangles make_rectangle() {
  Triangles shape;
  for (const float y : {-1.0f, 1.0f}) {
    for (const float x : {-1.0f, 1.0f}) shape.vertices.push_back({Vector3f(x, y, 0), Vector3f::UnitZ()});
  }
  add_quad(shape, 0, 1, 3, 2);
  return shape;
}

Triangles make_coil(const Vector3f& from, const Vector3f& to, int turns, float radius, float thickness) {
  constexpr int around = 8, per_turn = 20;
  Triangles shape;
  const Vector3f way = to - from;
  const float length = way.norm();
  if (!(length > 1e-6f)) return shape;
  const Vector3f ahead = way / length;
  const Vector3f side = ahead.unitOrthogonal(), third = ahead.cross(side);
  const int rings = turns * per_turn + 1;
  for (int j = 0; j < rings; ++j) {
    const float t = static_cast<float>(j) / static_cast<float>(rings - 1);
    const float angle = 2 * pi * static_cast<float>(turns) * t;
    // Narrows the coil spring to its axis at both ends, where it is attached to tool and hand.
    const float open = std::min(1.0f, 6 * std::min(t, 1 - t));
    const Vector3f out = std::cos(angle) * side + std::sin(angle) * third;
    const Vector3f turn = -std::sin(angle) * side + std::cos(angle) * third;
    const Vector3f tangent =
        (ahead * length / (2 * pi * static_cast<float>(turns)) + turn * radius * open).normalized();
    const Vector3f across = tangent.cross(out).normalized();
    for (int i = 0; i <= around; ++i) {
      const float a = 2 * pi * static_cast<float>(i) / around;
      const Vector3f normal = std::cos(a) * out + std::sin(a) * across;
      shape.vertices.push_back({from + way * t + out * radius * open + thickness * normal, normal});
    }
  }
  join_rings(shape, 0, rings, around);
  return shape;
}

Mesh::Mesh(const Triangles& shape) {
  glGenVertexArrays(1, &array_);
  glGenBuffers(1, &vertices_);
  glGenBuffers(1, &indices_);
  glBindVertexArray(array_);
  glBindBuffer(GL_ARRAY_BUFFER, vertices_);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices_);
  glEnableVertexAttribArray(0);
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(Vertex), nullptr);
  glEnableVertexAttribArray(1);
  glVertexAttribPointer(1, 3, GL_FLOAT, GL_FALSE, sizeof(Vertex),
                        reinterpret_cast<const void*>(offsetof(Vertex, normal)));
  replace(shape);
}

Mesh::~Mesh() {
  glDeleteBuffers(1, &indices_);
  glDeleteBuffers(1, &vertices_);
  glDeleteVertexArrays(1, &array_);
}

void Mesh::replace(const Triangles& shape) {
  glBindVertexArray(array_);
  glBindBuffer(GL_ARRAY_BUFFER, vertices_);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(shape.vertices.size() * sizeof(Vertex)),
               shape.vertices.data(), GL_DYNAMIC_DRAW);
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(shape.indices.size() * sizeof(std::uint32_t)),
               shape.indices.data(), GL_DYNAMIC_DRAW);
  count_ = static_cast<GLsizei>(shape.indices.size());
}

void Mesh::draw() const {
  glBindVertexArray(array_);
  glDrawElements(GL_TRIANGLES, count_, GL_UNSIGNED_INT, nullptr);
}

void Mesh::draw_many(GLsizei instances) const {
  glBindVertexArray(array_);
  glDrawElementsInstanced(GL_TRIANGLES, count_, GL_UNSIGNED_INT, nullptr, instances);
}

}  // namespace room
