// Triangle meshes of simple bodies, and their buffers in graphics memory.
#pragma once

#include <epoxy/gl.h>

#include <cstdint>
#include <vector>

#include <Eigen/Dense>

namespace room {

struct Vertex {
  Eigen::Vector3f position, normal;
};

struct Triangles {
  std::vector<Vertex> vertices;
  /// Indices of the vertices of the triangles, three each.
  std::vector<std::uint32_t> indices;
};

/// Makes a box with rounded edges. `half` has the half lengths along x, y and z.
Triangles make_rounded_box(const Eigen::Vector3f& half, float radius);
Triangles make_sphere(int around);  ///< makes a sphere of radius 1; `around` vertices per ring

/// Makes a rod along z, with radius 1 at z = 0 and end_radius at z = 1, of `pieces` along its length.
Triangles make_rod(int around, float end_radius, int pieces = 1);
Triangles make_rectangle();  ///< makes a square in x and y from -1 to 1, with its normal along z
Triangles make_coil(const Eigen::Vector3f& from, const Eigen::Vector3f& to, int turns, float radius,
                    float thickness);

/// Mesh in graphics memory. The OpenGL context in which it was made must stay current while it lives.
class Mesh {
 public:
  explicit Mesh(const Triangles& shape);
  Mesh(const Mesh&) = delete;
  Mesh& operator=(const Mesh&) = delete;
  ~Mesh();

  void replace(const Triangles& shape);
  void draw() const;
  void draw_many(GLsizei instances) const;
  GLuint vertex_array() const { return array_; }

 private:
  GLuint array_ = 0, vertices_ = 0, indices_ = 0;
  GLsizei count_ = 0;
};

}  // namespace room
