#include "tools/products/virtual_room/renderer.hpp"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "tools/products/virtual_room/compared.hpp"
#include "tools/products/virtual_room/gl_program.hpp"
#include "tools/products/virtual_room/mesh.hpp"
#include "tools/products/virtual_room/shaders.hpp"

namespace room {

namespace {

using Eigen::Affine3f;
using Eigen::Matrix3f;
using Eigen::Matrix4f;
using Eigen::Vector3f;

// Colours of the bodies in the picture, in linear light (before gamma).
const Vector3f floor_paint(0.40f, 0.415f, 0.43f), wall_paint(0.27f, 0.295f, 0.34f),
    slab_paint(0.10f, 0.11f, 0.13f), wood_paint(0.53f, 0.28f, 0.11f);
const Vector3f edge_paint(0.22f, 0.25f, 0.30f), backdrop(0.014f, 0.017f, 0.022f);
const Vector3f tool_paint(0.75f, 0.78f, 0.82f), hand_paint(0.03f, 0.30f, 0.62f),
    lost_paint(0.6f, 0.08f, 0.05f);
const Vector3f lugre_paint(0.10f, 0.26f, 0.45f), coulomb_paint(0.34f, 0.35f, 0.37f),
    beside_paint(0.09f, 0.38f, 0.60f);
const Vector3f friction_paint(1.00f, 0.26f, 0.05f), applied_paint(0.05f, 0.52f, 0.95f);

enum Look { lit, tiles, glowing };

struct Body {
  const Mesh* mesh;
  Affine3f transform;
  Vector3f colour;
  int look = lit;
  float gloss = 0.1f, alpha = 1.0f;
};

Affine3f placed(const Vector3f& at, const Vector3f& scale) {
  Affine3f t = Affine3f::Identity();
  t.translate(at).scale(scale);
  return t;
}

// Returns the transform that puts a rod, whose axis is z from 0 to 1, on the line between two points.
Affine3f between(const Vector3f& from, const Vector3f& to, float radius) {
  Affine3f t = Affine3f::Identity();
  t.translate(from)
      .rotate(Eigen::Quaternionf::FromTwoVectors(Vector3f::UnitZ(), to - from))
      .scale(Vector3f(radius, radius, (to - from).norm()));
  return t;
}

// Returns the transform of a body at a position, turned by a quaternion w, x, y, z.
Affine3f pose(const Vector3f& at, const double (&wxyz)[4]) {
  const Eigen::Quaterniond turn(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
  return Eigen::Translation3f(at) * turn.cast<float>().normalized();
}

// Frame buffer with several samples per pixel. They are averaged into the target, so that pictures with and
// without a window are equal.
class DrawingBoard {
 public:
  explicit DrawingBoard(int samples) {
    GLint most = 0;
    glGetIntegerv(GL_MAX_SAMPLES, &most);
    samples_ = std::clamp(samples, 1, std::max(1, static_cast<int>(most)));
    glGenFramebuffers(1, &frame_);
    glGenRenderbuffers(2, buffers_);
  }
  DrawingBoard(const DrawingBoard&) = delete;
  DrawingBoard& operator=(const DrawingBoard&) = delete;
  ~DrawingBoard() {
    glDeleteRenderbuffers(2, buffers_);
    glDeleteFramebuffers(1, &frame_);
  }

  void begin(int width, int height) {
    glBindFramebuffer(GL_FRAMEBUFFER, frame_);
    if (width == width_ && height == height_) return;
    width_ = width;
    height_ = height;
    const GLsizei samples = samples_ > 1 ? samples_ : 0;
    const GLenum formats[] = {GL_RGBA8, GL_DEPTH_COMPONENT24};
    const GLenum places[] = {GL_COLOR_ATTACHMENT0, GL_DEPTH_ATTACHMENT};
    for (int i = 0; i < 2; ++i) {
      glBindRenderbuffer(GL_RENDERBUFFER, buffers_[i]);
      glRenderbufferStorageMultisample(GL_RENDERBUFFER, samples, formats[i], width, height);
      glFramebufferRenderbuffer(GL_FRAMEBUFFER, places[i], GL_RENDERBUFFER, buffers_[i]);
    }
    if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
      throw std::runtime_error("this OpenGL gives no frame buffer of the picture's size");
  }

  void resolve_into(GLuint target) const {
    glBindFramebuffer(GL_READ_FRAMEBUFFER, frame_);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, target);
    glBlitFramebuffer(0, 0, width_, height_, 0, 0, width_, height_, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    glBindFramebuffer(GL_FRAMEBUFFER, target);
  }

 private:
  int samples_ = 1, width_ = 0, height_ = 0;
  GLuint frame_ = 0, buffers_[2] = {0, 0};
};

}  // namespace

Matrix3f room_tilt(double slope) {
  return Eigen::AngleAxisf(static_cast<float>(slope), Vector3f::UnitY()).toRotationMatrix();
}

Vector3f to_vector(const double (&v)[3]) { return Eigen::Map<const Eigen::Vector3d>(v).cast<float>(); }

// Returns the length of a force's arrow: proportional up to 2 N, then logarithmic, so that the arrow stays in
// the room.
float arrow_length(double newtons) {
  const double f = std::abs(newtons);
  return static_cast<float>(0.07 * (f <= 2.0 ? f : 2.0 * (1.0 + std::log(f / 2.0))));
}

ForceArrows place_arrows(const Snapshot& room, const RoomMeasures& measures) {
  constexpr double least = 0.02;  // smallest force that is drawn as an arrow, N
  ForceArrows arrows;
  const Vector3f friction = to_vector(room.friction), applied = to_vector(room.applied);
  Vector3f foot = to_vector(room.block_position);
  foot.z() = std::max(0.004f, foot.z() - 0.5f * static_cast<float>(measures.block[2]) + 0.004f);
  arrows.friction = friction.norm() > least;
  if (arrows.friction) {
    arrows.friction_from = foot;
    arrows.friction_to = foot + friction.normalized() * (0.5f * static_cast<float>(measures.block[0]) +
                                                         arrow_length(friction.norm()));
    arrows.friction_from += friction.normalized() * 0.5f * static_cast<float>(measures.block[0]);
  }
  arrows.applied = applied.norm() > least;
  if (arrows.applied) {
    // Lets the arrow of the applied force end at the point where the tool touches the block.
    const Vector3f ahead = applied.normalized();
    arrows.applied_to = to_vector(room.tool) + static_cast<float>(measures.tool_radius) * ahead;
    arrows.applied_from = arrows.applied_to - ahead * arrow_length(applied.norm());
  }
  return arrows;
}

int sensible_samples() {
  const auto* const text = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
  const std::string name = text ? text : "";
  const bool software = name.find("llvmpipe") != std::string::npos ||
                        name.find("softpipe") != std::string::npos ||
                        name.find("SwiftShader") != std::string::npos;
  return software ? 1 : 4;
}

struct Renderer::Impl {
  RoomMeasures measures;
  DrawingBoard board;
  Program bodies_program{shaders::body_vertex, shaders::body_fragment};
  Program hair{shaders::hair_vertex, shaders::glass_fragment};
  Program glass_plane{shaders::glass_plane_vertex, shaders::glass_fragment};
  Mesh block, cube, sphere, rod, cone, rectangle, spring, strand;
  GLuint hairs = 0;

  const Vector3f sun = Vector3f(-0.66f, -0.16f, 0.95f).normalized();
  Affine3f tilt;  // transform from the room's axes to the world's
  std::vector<Body> bodies, clear, ghosts;

  Impl(const RoomMeasures& m, int samples)
      : measures(m),
        board(samples),
        block(make_rounded_box(half_block(), 0.0035f)),
        cube(make_rounded_box(Vector3f(1, 1, 1), 0.0f + 1e-4f)),
        sphere(make_sphere(48)),
        rod(make_rod(32, 1.0f)),
        cone(make_rod(32, 0.0f)),
        rectangle(make_rectangle()),
        spring(Triangles{}),
        strand(make_rod(6, 1.0f, 8)) {  // of short pieces, so that the shader can bend it
    glGenBuffers(1, &hairs);
    glBindVertexArray(strand.vertex_array());
    glBindBuffer(GL_ARRAY_BUFFER, hairs);
    // Number of components of each attribute of a hair: position, state and shape.
    constexpr GLint sizes[] = {4, 2, 3};
    std::size_t offset = 0;
    for (GLuint i = 2; i < 5; ++i) {
      glEnableVertexAttribArray(i);
      glVertexAttribPointer(i, sizes[i - 2], GL_FLOAT, GL_FALSE, sizeof(Hair),
                            reinterpret_cast<const void*>(offset * sizeof(float)));
      glVertexAttribDivisor(i, 1);
      offset += static_cast<std::size_t>(sizes[i - 2]);
    }
  }
  ~Impl() { glDeleteBuffers(1, &hairs); }

  Vector3f half_block() const { return 0.5f * to_vector(measures.block); }
  Vector3f half_room() const {
    return Vector3f(static_cast<float>(measures.length / 2), static_cast<float>(measures.width / 2),
                    static_cast<float>(measures.height));
  }

  // Functions that list the bodies to draw.

  void place_room(const Camera& camera) {
    const Vector3f half = half_room();
    const float thick = 0.006f;
    add(bodies, cube, placed({0, 0, -thick}, {half.x() + thick, half.y() + thick, thick}), slab_paint, lit,
        0.05f);
    add(bodies, rectangle, placed({0, 0, 0.0002f}, {half.x(), half.y(), 1}), floor_paint, tiles, 0.10f);

    // Draws a wall that stands between the eye and the room as glass, so that it hides nothing.
    const Vector3f eye = tilt.inverse() * camera.eye();
    struct Side {
      Vector3f middle, inward;
      float wide;
    };
    const Side sides[] = {{{half.x(), 0, 0}, {-1, 0, 0}, half.y()},
                          {{0, half.y(), 0}, {0, -1, 0}, half.x()},
                          {{0, -half.y(), 0}, {0, 1, 0}, half.x()}};
    for (const Side& side : sides) {
      Affine3f transform = Affine3f::Identity();
      const Vector3f up = Vector3f::UnitZ();
      transform.matrix().col(0).head<3>() = up.cross(side.inward) * side.wide;
      transform.matrix().col(1).head<3>() = up * half.z() / 2;
      transform.matrix().col(2).head<3>() = side.inward;
      transform.matrix().col(3).head<3>() = side.middle + up * half.z() / 2;
      const bool seen = side.inward.dot(eye - side.middle) > 0;
      add(seen ? bodies : clear, rectangle, transform, wall_paint, seen ? lit : glowing, 0.04f,
          seen ? 1.0f : 0.05f);
    }
    const bool under_roof = eye.z() < half.z();
    add(under_roof ? bodies : clear, rectangle, placed({0, 0, half.z()}, {half.x(), -half.y(), -1}),
        wall_paint, under_roof ? lit : glowing, 0.04f, under_roof ? 1.0f : 0.035f);
    place_edges(half);
  }

  void place_edges(const Vector3f& half) {
    constexpr float r = 0.0011f;
    const auto edge = [&](const Vector3f& from, const Vector3f& to) {
      add(bodies, rod, between(from, to, r), edge_paint, lit, 0.0f);
    };
    for (const float y : {-half.y(), half.y()}) {
      edge({-half.x(), y, half.z()}, {half.x(), y, half.z()});
      for (const float x : {-half.x(), half.x()}) edge({x, y, 0}, {x, y, half.z()});
    }
    edge({half.x(), -half.y(), half.z()}, {half.x(), half.y(), half.z()});
    edge({-half.x(), -half.y(), half.z()}, {-half.x(), half.y(), half.z()});
  }

  void place_hand(const Snapshot& room) {
    const Vector3f tool = to_vector(room.tool), hand = to_vector(room.device);
    const float radius = static_cast<float>(measures.tool_radius);
    add(bodies, sphere, placed(tool, Vector3f::Constant(radius)), tool_paint, lit, 0.6f);
    const Vector3f paint = room.device_lost ? lost_paint : hand_paint;
    add(bodies, sphere, placed(hand, Vector3f::Constant(0.55f * radius)), paint, lit, 0.5f);
    // Draws the hand as a stylus that points from above and behind at the hand's position.
    const Vector3f ahead = Vector3f(-0.42f, -0.30f, 1.0f).normalized();
    add(bodies, cone, between(hand + 0.024f * ahead, hand, 0.0042f), paint, lit, 0.5f);
    add(bodies, rod, between(hand + 0.024f * ahead, hand + 0.105f * ahead, 0.0042f), 0.35f * paint, lit,
        0.4f);
    add(bodies, rod, between(hand + 0.034f * ahead, hand + 0.042f * ahead, 0.0046f), tool_paint, lit, 0.6f);
    add(bodies, sphere, placed(hand + 0.105f * ahead, Vector3f::Constant(0.0042f)), 0.35f * paint, lit, 0.4f);
    const Vector3f path = hand - tool;
    if (room.held && path.norm() > 0.5f * radius) {
      spring.replace(make_coil(tool, hand, 9, 0.0034f, 0.00065f));
      add(bodies, spring, Affine3f::Identity(), Vector3f(0.62f, 0.64f, 0.66f), lit, 0.7f);
    }
  }

  void place_arrow(const Vector3f& from, const Vector3f& to, const Vector3f& paint) {
    const Vector3f path = to - from;
    const float length = path.norm(), head = std::min(0.018f, 0.6f * length);
    const Vector3f neck = to - path * (head / length);
    // Draws the arrow twice: as it is, and as a ghost that shows faintly through bodies in front of it.
    for (const bool ghost : {false, true}) {
      auto& list = ghost ? ghosts : bodies;
      const float alpha = ghost ? 0.22f : 1.0f;
      add(list, rod, between(from, neck, 0.0026f), paint, glowing, 0, alpha);
      add(list, cone, between(neck, to, 0.0066f), paint, glowing, 0, alpha);
    }
  }

  // Draws a disc under each patch. Its radius grows with the square root of the load; its filling shows which
  // share of the friction limit is in use.
  void place_contacts(const Snapshot& room) {
    for (std::size_t i = 0; i < room.contacts && i < most_contacts; ++i) {
      const ContactView& c = room.contact[i];
      if (!(c.load > 0)) continue;
      float wide = std::clamp(0.007f * static_cast<float>(std::sqrt(c.load)), 0.0025f, 0.014f);
      // Draws the disc under the tool's pad, a contact with an extent, at the pad's own radius.
      if (c.torque_limit > 0) wide = static_cast<float>(room.settings.pad_radius);
      const double used = c.limit > 0 ? to_vector(c.friction).norm() / c.limit : 0;
      const float u = std::clamp(static_cast<float>(used), 0.0f, 1.0f);
      const Vector3f paint = (1 - u) * Vector3f(0.15f, 0.55f, 0.60f) + u * friction_paint;
      const Vector3f at = to_vector(c.point), normal = to_vector(c.normal);
      const Vector3f top = at + 0.0006f * (normal.norm() > 0.5f ? normal : Vector3f(Vector3f::UnitZ()));
      add(ghosts, rod, between(at, top, wide), paint, glowing, 0, c.key == room.bristles.key ? 0.75f : 0.45f);
    }
  }

  void place_compared(const Snapshot& room) {
    for (std::size_t i = 0; i < std::min(room.compared, most_compared); ++i) {
      const ComparedBlock& other = room.beside[i];
      Vector3f at = to_vector(other.position);
      at.y() += aside_of(i);
      // Gives compared blocks the colours of their curves in the plots, if the scene has such curves.
      const bool first =
          scene_of(room.settings.compare).driven ? i == 0 : other.model == FrictionModel::lugre;
      const bool brush = other.model == FrictionModel::brush;
      add(bodies, block, pose(at, other.orientation),
          !first  ? coulomb_paint
          : brush ? beside_paint
                  : lugre_paint,
          lit, 0.16f);
    }
  }

  void add(std::vector<Body>& list, const Mesh& mesh, const Affine3f& transform, const Vector3f& colour,
           int look, float gloss, float alpha = 1.0f) {
    list.push_back({&mesh, tilt * transform, colour, look, gloss, alpha});
  }

  void place_all(const Snapshot& room, const Camera& camera) {
    for (auto* list : {&bodies, &clear, &ghosts}) list->clear();
    tilt = Affine3f(room_tilt(room.settings.slope));
    add(bodies, block, pose(to_vector(room.block_position), room.block_orientation), wood_paint, lit, 0.16f);
    place_compared(room);
    place_hand(room);
    place_room(camera);
    const ForceArrows arrows = place_arrows(room, measures);
    if (arrows.friction) place_arrow(arrows.friction_from, arrows.friction_to, friction_paint);
    if (arrows.applied) place_arrow(arrows.applied_from, arrows.applied_to, applied_paint);
    place_contacts(room);
  }

  // Functions that draw the listed bodies.

  void draw_bodies(const std::vector<Body>& list) {
    for (const Body& body : list) {
      const Matrix3f normals = body.transform.linear().inverse().transpose();
      bodies_program.set("model", Matrix4f(body.transform.matrix()));
      bodies_program.set("normals", normals);
      bodies_program.set("colour", body.colour);
      bodies_program.set("look", body.look);
      bodies_program.set("gloss", body.gloss);
      bodies_program.set("alpha", body.alpha);
      body.mesh->draw();
    }
  }

  void draw_scene(const Camera& camera, const Picture& picture) {
    const Area& s = picture.scene;
    const auto bottom = static_cast<GLint>(static_cast<float>(picture.height) - s.y - s.height);
    glViewport(static_cast<GLint>(s.x), bottom, static_cast<GLsizei>(s.width),
               static_cast<GLsizei>(s.height));
    const Vector3f behind = backdrop.cwiseSqrt();
    glClearColor(behind.x(), behind.y(), behind.z(), 1);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glEnable(GL_DEPTH_TEST);

    bodies_program.use();
    bodies_program.set("camera", Matrix4f(camera.projection(s.width / s.height) * camera.view()));
    bodies_program.set("eye", camera.eye());
    bodies_program.set("sun", sun);
    bodies_program.set("to_room", Matrix4f(tilt.inverse().matrix()));
    draw_bodies(bodies);
    glEnable(GL_BLEND);
    glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
    glDepthMask(GL_FALSE);
    draw_bodies(clear);
    glDisable(GL_DEPTH_TEST);
    draw_bodies(ghosts);
    glEnable(GL_DEPTH_TEST);
    glDepthMask(GL_TRUE);
    glDisable(GL_BLEND);
  }

  // Returns a camera for the magnifying glass. It looks in the direction of the main camera, so that hairs
  // lean the way the block goes.
  static Matrix4f glass_camera(const Snapshot& room, const Camera& camera) {
    Vector3f along = Vector3f::UnitX(), aside = Vector3f::UnitY();
    for (std::size_t i = 0; i < room.contacts && i < most_contacts; ++i) {
      if (room.contact[i].key != room.bristles.key) continue;
      along = to_vector(room.contact[i].along);
      aside = to_vector(room.contact[i].aside);
    }
    Matrix4f axes = Matrix4f::Identity();
    axes.block<3, 1>(0, 0) = along;
    axes.block<3, 1>(0, 1) = aside;
    axes.block<3, 1>(0, 2) = along.cross(aside);
    Camera near = camera;
    near.target = Vector3f(0, 0, 0.42f);
    near.elevation = std::clamp(camera.elevation, 0.22f, 0.32f);
    near.distance = 6.6f;
    near.field_of_view = 0.52f;
    return perspective(near.field_of_view, 1.0f, 0.5f, 20.0f) * near.view() * axes;
  }

  void draw_glass(const Snapshot& room, const BristleGlass& glass, const Camera& camera, const Picture& p) {
    if (p.glass_radius < 1) return;
    const float bottom = static_cast<float>(p.height) - p.glass_y - p.glass_radius;
    const auto x = static_cast<GLint>(p.glass_x - p.glass_radius), y = static_cast<GLint>(bottom);
    const auto wide = static_cast<GLsizei>(2 * p.glass_radius);
    glViewport(x, y, wide, wide);
    glEnable(GL_SCISSOR_TEST);
    glScissor(x, y, wide, wide);
    glClear(GL_DEPTH_BUFFER_BIT);
    const Vector3f circle(p.glass_x, static_cast<float>(p.height) - p.glass_y, p.glass_radius);
    const Matrix4f through = glass_camera(room, camera);

    const auto plane = [&](int look, float reach, float height, const Matrix4f& by) {
      glass_plane.use();
      glass_plane.set("camera", by);
      glass_plane.set("circle", circle);
      glass_plane.set("look", look);
      glass_plane.set("reach", reach);
      glass_plane.set("height", height);
      rectangle.draw();
    };
    glDisable(GL_DEPTH_TEST);
    Matrix4f whole = Matrix4f::Identity() / BristleGlass::reach;
    whole(3, 3) = 1;
    plane(3, BristleGlass::reach, 0.0f, whole);
    glEnable(GL_DEPTH_TEST);
    plane(1, BristleGlass::reach, 0.0f, through);

    glBindBuffer(GL_ARRAY_BUFFER, hairs);
    glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(glass.hairs().size() * sizeof(Hair)),
                 glass.hairs().data(), GL_STREAM_DRAW);
    hair.use();
    hair.set("by_age", glass.by_age ? 1 : 0);
    hair.set("camera", through);
    hair.set("circle", circle);
    hair.set("look", 0);
    hair.set("sun", sun);
    hair.set("reach", BristleGlass::reach);
    strand.draw_many(static_cast<GLsizei>(glass.hairs().size()));
    if (!glass.hairs().empty()) {
      glEnable(GL_BLEND);
      plane(2, BristleGlass::reach, 1.02f, through);
      glDisable(GL_BLEND);
    }
    glDisable(GL_SCISSOR_TEST);
  }
};

Renderer::Renderer(const RoomMeasures& measures, int samples) {
  if (epoxy_gl_version() < 33) throw std::runtime_error("OpenGL 3.3 is needed, and this is older");
  impl_ = std::make_unique<Impl>(measures, samples);
}

Renderer::~Renderer() = default;

void Renderer::draw(const Snapshot& room, const BristleGlass& glass, const Camera& camera,
                    const Picture& picture, std::uint32_t target) {
  Impl& i = *impl_;
  i.place_all(room, camera);
  i.board.begin(picture.width, picture.height);
  i.draw_scene(camera, picture);
  i.draw_glass(room, glass, camera, picture);
  i.board.resolve_into(target);
}

}  // namespace room
