// An OpenGL program: a linked vertex and fragment shader, and its uniforms (parameters).
#pragma once

#include <epoxy/gl.h>

#include <Eigen/Dense>

namespace room {

/// OpenGL program. The context in which it was made must be current until its destruction.
class Program {
 public:
  /// Compiles and links the two shaders. Throws std::runtime_error with the driver's log.
  Program(const char* vertex_source, const char* fragment_source);
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;
  ~Program() { glDeleteProgram(id_); }

  void use() const { glUseProgram(id_); }
  /// @name Setters of the uniforms of the program in use. Unknown names are ignored.
  /// @{
  void set(const char* name, int value) const { glUniform1i(at(name), value); }
  void set(const char* name, float value) const { glUniform1f(at(name), value); }
  void set(const char* name, const Eigen::Vector3f& v) const { glUniform3fv(at(name), 1, v.data()); }
  void set(const char* name, const Eigen::Matrix3f& m) const {
    glUniformMatrix3fv(at(name), 1, GL_FALSE, m.data());
  }
  void set(const char* name, const Eigen::Matrix4f& m) const {
    glUniformMatrix4fv(at(name), 1, GL_FALSE, m.data());
  }
  ///@}

 private:
  GLint at(const char* name) const { return glGetUniformLocation(id_, name); }

  GLuint id_ = 0;
};

}  // namespace room
