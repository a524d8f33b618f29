#include "tools/products/virtual_room/mesh.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace room {

namespace {

constexpr float pi = 3.14159265f;

using Eigen::Vector3f;

// Adds the skin of a tube: vertex(ring, i) is vertex i of a ring, which goes round from 0 to `around`. Quads
// of two triangles join each ring to the next one.
template <class MakeVertex>
void add_skin(Triangles& shape, int rings, int around, const MakeVertex& vertex) {
  const auto first = static_cast<std::uint32_t>(shape.vertices.size());
  const auto per_ring = static_cast<std::uint32_t>(around + 1);
  for (int ring = 0; ring < rings; ++ring) {
    for (int i = 0; i <= around; ++i) shape.vertices.push_back(vertex(ring, i));
  }
  for (std::uint32_t ring = 0; ring + 1 < static_cast<std::uint32_t>(rings); ++ring) {
    for (std::uint32_t i = 0; i + 1 < per_ring; ++i) {
      const std::uint32_t a = first + ring * per_ring + i, above = a + per_ring;
      shape.indices.insert(shape.indices.end(), {a, a + 1, above + 1, a, above + 1, above});
    }
  }
}

float share(int i, int of) { return static_cast<float>(i) / static_cast<float>(of); }

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
      const auto vertex = [&](int row, int i) -> Vertex {
        Vector3f point;
        point[axis] = side * half[axis];
        point[u] = across[static_cast<std::size_t>(i)];
        point[v] = up[static_cast<std::size_t>(row)];
        const Vector3f inner = point.cwiseMax(-core).cwiseMin(core);
        const Vector3f normal = (point - inner).normalized();
        return {inner + radius * normal, normal};
      };
      add_skin(shape, static_cast<int>(up.size()), static_cast<int>(across.size()) - 1, vertex);
    }
  }
  return shape;
}

Triangles make_sphere(int around) {
  Triangles shape;
  const int rings = around / 2 + 1;
  add_skin(shape, rings, around, [&](int ring, int i) -> Vertex {
    const float latitude = pi * (share(ring, rings - 1) - 0.5f), longitude = 2 * pi * share(i, around);
    const Vector3f out(std::cos(latitude) * std::cos(longitude), std::cos(latitude) * std::sin(longitude),
                       std::sin(latitude));
    return {out, out};
  });
  return shape;
}

Triangles make_rod(int around, float end_radius, int pieces) {
  Triangles shape;
  const auto place = [&](float z, float narrower, int i) {
    const float angle = 2 * pi * share(i, around), radius = narrower * (1 + z * (end_radius - 1));
    return Vector3f(radius * std::cos(angle), radius * std::sin(angle), z);
  };
  add_skin(shape, pieces + 1, around, [&](int ring, int i) -> Vertex {
    const float angle = 2 * pi * share(i, around);
    return {place(share(ring, pieces), 1, i),
            Vector3f(std::cos(angle), std::sin(angle), 1 - end_radius).normalized()};
  });
  for (const float end : {0.0f, 1.0f}) {  // adds discs that close both ends of the rod
    add_skin(shape, 2, around, [&](int ring, int i) -> Vertex {
      return {place(end, static_cast<float>(ring), i), Vector3f(0, 0, 2 * end - 1)};
    });
  }
  return shape;
}

Triangles make_rectangle() {
  Triangles shape;
  add_skin(shape, 2, 1, [](int row, int i) -> Vertex {
    return {Vector3f(2 * share(i, 1) - 1, 2 * share(row, 1) - 1, 0), Vector3f::UnitZ()};
  });
  return shape;
}

Triangles make_coil(const Vector3f& from, const Vector3f& to, int turns, float radius, float thickness) {
  constexpr int around = 8, per_turn = 20;
  Triangles shape;
  const Vector3f path = to - from;
  const float length = path.norm();
  if (!(length > 1e-6f)) return shape;
  const Vector3f ahead = path / length;
  const Vector3f side = ahead.unitOrthogonal(), third = ahead.cross(side);
  const int rings = turns * per_turn + 1;
  add_skin(shape, rings, around, [&](int ring, int i) -> Vertex {
    const float t = share(ring, rings - 1), angle = 2 * pi * static_cast<float>(turns) * t;
    // Narrows the coil spring to its axis at both ends, where it is attached to tool and hand.
    const float open = std::min(1.0f, 6 * std::min(t, 1 - t));
    const Vector3f out = std::cos(angle) * side + std::sin(angle) * third;
    const Vector3f turn = -std::sin(angle) * side + std::cos(angle) * third;
    const Vector3f tangent =
        (ahead * length / (2 * pi * static_cast<float>(turns)) + turn * radius * open).normalized();
    const float a = 2 * pi * share(i, around);
    const Vector3f normal = std::cos(a) * out + std::sin(a) * tangent.cross(out).normalized();
    return {from + path * t + out * radius * open + thickness * normal, normal};
  });
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
