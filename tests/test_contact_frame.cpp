// ContactFrame, tangent axes of a contact in space: carried along, rolled, spun, turned with the scene.
#include <catch2/catch.hpp>

#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <vector>

#include <bristle/contact_frame.hpp>

#include "expect.hpp"
#include "scenes.hpp"

namespace bristle_test::test_contact_frame {

using bristle::ContactFrame;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

constexpr double pi = 3.14159265358979323846;

Vector3d random_unit(std::mt19937_64& random) {
  std::normal_distribution<double> gauss;
  return Vector3d(gauss(random), gauss(random), gauss(random)).normalized();
}

Vector3d on_sphere(double polar, double azimuth) {
  return {std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth), std::cos(polar)};
}

/// Returns the signed solid angle of a spherical triangle of unit vectors (van Oosterom and Strackee 1983).
double solid_angle(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  return 2.0 * std::atan2(a.dot(b.cross(c)), 1.0 + a.dot(b) + b.dot(c) + c.dot(a));
}

/// Returns the angle from a to b about the axis n, rad.
double angle_about(const Vector3d& n, const Vector3d& a, const Vector3d& b) {
  return std::atan2(n.dot(a.cross(b)), a.dot(b));
}

double off_right_angles(const ContactFrame& f) {
  Matrix3d axes;
  axes << f.along(), f.aside(), f.normal();
  return (axes.transpose() * axes - Matrix3d::Identity()).cwiseAbs().maxCoeff() +
         std::abs(axes.determinant() - 1.0);
}

/// A patch in space, moved and loaded through a ContactFrame.
struct SpacePatch {
  explicit SpacePatch(std::uint32_t bristles = 400)
      : patch(batch.add(plain_material(SnapLength::uniform(0.5 * dbar, 1.5 * dbar), SnapRule::redraw),
                        plain_options(bristles, 2, precisions().back()))) {
    motion.id = patch;
    motion.normal_load = bristles;
  }
  void step(const ContactFrame& frame, const Vector3d& relative) {
    frame.set_displacement(relative, motion);
    batch.step(tick, {&motion, 1}, {&response, 1});
  }
  PatchBatch batch;
  PatchId patch;
  Motion motion;
  Response response;
};

}  // namespace

TEST_CASE("A contact frame is right-handed and orthonormal for any normal, of any length", "[frame]") {
  std::mt19937_64 random(1);
  for (int i = 0; i < 2000; ++i) {
    const Vector3d n = random_unit(random);
    const double length = std::pow(10.0, std::uniform_real_distribution<double>(-200.0, 200.0)(random));
    const ContactFrame frame(length * n);
    expect(off_right_angles(frame) < 4e-15, "axes at right angles");
    expect((frame.normal() - n).norm() < 1e-15, "the normal is the one given");
    const Vector3d wish = random_unit(random);
    const ContactFrame chosen(n, wish);
    expect(off_right_angles(chosen) < 4e-15, "axes at right angles");
    const double reachable = std::sqrt(std::max(0.0, 1.0 - std::pow(wish.dot(n), 2)));
    expect_near(chosen.along().dot(wish), reachable, 1e-12,
                "the first axis is as near as can be to the wish");
  }
  CHECK(off_right_angles(ContactFrame(Vector3d::UnitX(), 3.0 * Vector3d::UnitX())) < 4e-15);
  CHECK(ContactFrame(Vector3d::Zero()).normal() == Vector3d::UnitZ());
}

TEST_CASE("The axes follow the normal by the smallest rotation", "[frame]") {
  std::mt19937_64 random(2);
  ContactFrame frame(random_unit(random));
  for (int i = 0; i < 5000; ++i) {
    const Vector3d before = frame.normal(), along = frame.along(), aside = frame.aside();
    Vector3d to = random_unit(random);
    if (i % 5 == 1) to = (before + 1e-9 * to).normalized();
    if (i % 5 == 2) to = (-before + 1e-5 * to).normalized();  // makes the normals nearly opposite
    const Vector3d across = before.cross(to);
    const Matrix3d smallest =
        Eigen::AngleAxisd(std::atan2(across.norm(), before.dot(to)), across.normalized()).toRotationMatrix();
    REQUIRE(frame.carry(7.0 * to));
    // Near opposite normals the axis has the normals' rounding error over the sine of the angle between them.
    const double tolerance = before.dot(to) > 0.0 ? 3e-15 : 3e-15 / across.norm();
    expect_near((frame.along() - smallest * along).norm(), 0.0, tolerance, "first axis");
    expect_near((frame.aside() - smallest * aside).norm(), 0.0, tolerance, "second axis");
    expect(off_right_angles(frame) < 4e-15, "axes at right angles");
    expect_near((frame.midway_normal() - (before + to).normalized()).norm(), 0.0, tolerance,
                "normal half-way");
  }
}

TEST_CASE("A normal that turns over carries the axes half round about the first one", "[frame]") {
  for (const Vector3d& n : {Vector3d(0, 0, 1), Vector3d(1, -2, 0.5)}) {
    ContactFrame frame(n);
    const Vector3d along = frame.along(), aside = frame.aside();
    REQUIRE(frame.carry(-n));
    CHECK((frame.along() - along).norm() < 1e-15);
    CHECK((frame.aside() + aside).norm() < 1e-15);
    CHECK(off_right_angles(frame) < 4e-15);
    CHECK(std::abs(frame.midway_normal().dot(n)) < 1e-14);
  }
}

TEST_CASE("A normal that nearly turns over carries the axes by that rotation", "[frame]") {
  const Vector3d n = Vector3d(1, -2, 0.5).normalized(), about = n.cross(Vector3d(0.3, 0.1, 1.0)).normalized();
  for (const double rest : {0.5, 1e-2, 1e-4, 1e-6, 1e-8}) {
    const Eigen::AngleAxisd turn(3.141592653589793 - rest, about);
    ContactFrame frame(n);
    const Vector3d along = frame.along(), aside = frame.aside();
    REQUIRE(frame.carry(turn * n));
    CHECK((frame.along() - turn * along).norm() < 2e-15 / rest + 4e-15);
    CHECK((frame.aside() - turn * aside).norm() < 2e-15 / rest + 4e-15);
    CHECK(off_right_angles(frame) < 4e-15);
  }
}

TEST_CASE("Axes that two bodies carry half a turn apart follow the second body", "[frame]") {
  const Vector3d n = Vector3d(1, -2, 0.5).normalized();
  ContactFrame frame(n);
  const Vector3d along = frame.along();
  REQUIRE(frame.carry(n, 3.141592653589793 * n, Vector3d::Zero()));
  CHECK((frame.along() - along).norm() < 1e-7);
}

TEST_CASE("Carried round a closed path on a sphere the axes turn by the solid angle", "[frame]") {
  // Moves along great arcs, in steps of any size, for which the Gauss-Bonnet theorem holds exactly.
  const std::vector<std::vector<Vector3d>> polygons = {
      // Octant of the sphere, which encloses the solid angle pi/2.
      {on_sphere(0.0, 0.0), on_sphere(pi / 2, 0.0), on_sphere(pi / 2, pi / 2)},
      {on_sphere(0.3, 0.2), on_sphere(1.4, 0.4), on_sphere(1.1, 2.0), on_sphere(0.5, 2.4)},
      // A triangle traversed in the opposite sense, so that its solid angle is negative.
      {on_sphere(0.3, 2.4), on_sphere(1.1, 2.0), on_sphere(1.4, 0.4)}};
  for (const auto& corners : polygons) {
    double enclosed = 0.0;
    for (std::size_t k = 1; k + 1 < corners.size(); ++k)
      enclosed += solid_angle(corners[0], corners[k], corners[k + 1]);
    for (int pieces : {1, 3, 50}) {
      ContactFrame frame(corners[0]);
      const Vector3d start = frame.along();
      for (std::size_t k = 0; k < corners.size(); ++k) {
        const Vector3d &a = corners[k], &b = corners[(k + 1) % corners.size()];
        const double angle = std::acos(a.dot(b));
        for (int i = 1; i <= pieces; ++i) {
          const double share = static_cast<double>(i) / pieces;
          frame.carry((std::sin((1 - share) * angle) * a + std::sin(share * angle) * b) / std::sin(angle));
        }
      }
      CHECK(angle_about(corners[0], start, frame.along()) == Approx(enclosed).margin(1e-13));
    }
  }
  // Carries the frame round a circle of latitude in small steps: it turns by 2 pi (1 - cos polar), with an
  // error of second order in the step.
  const double polar = 0.7;
  double errors[2];
  for (int k : {0, 1}) {
    const int steps = k == 0 ? 200 : 400;
    ContactFrame frame(on_sphere(polar, 0.0));
    const Vector3d start = frame.along();
    for (int i = 1; i <= steps; ++i) frame.carry(on_sphere(polar, 2 * pi * i / steps));
    errors[k] = angle_about(on_sphere(polar, 0.0), start, frame.along()) - 2 * pi * (1 - std::cos(polar));
  }
  CHECK(std::abs(errors[0]) < 1e-3);
  CHECK(errors[0] / errors[1] == Approx(4.0).epsilon(0.01));
}

TEST_CASE("Carrying a bent patch round a sphere changes neither its energy nor the size of its force",
          "[frame]") {
  SpacePatch p;
  ContactFrame frame(Vector3d::UnitZ());
  frame.carry(Vector3d::UnitZ());
  p.step(frame, Vector3d(2.0 * dbar, 1.5 * dbar, 0.0));
  const double energy = p.batch.stored_energy(p.patch);
  const std::uint64_t hash = p.batch.state_hash(p.patch);
  const double size = std::hypot(p.response.end[0], p.response.end[1]);
  REQUIRE(energy > 0.0);
  REQUIRE(size > 0.0);
  const Vector3d before = frame.force(p.response.end);
  for (int i = 1; i <= 1000; ++i) {
    frame.carry(on_sphere(0.4 * std::sin(pi * i / 1000), 7.0 * i / 1000));
    p.step(frame, Vector3d::Zero());
    expect(p.batch.stored_energy(p.patch) == energy, "stored energy, to the bit");
    expect_near(frame.force(p.response.end).norm(), size, 1e-14 * size, "size of the force in space");
    expect_near(frame.force(p.response.end).dot(frame.normal()), 0.0, 1e-14 * size, "no normal part");
  }
  CHECK(p.batch.state_hash(p.patch) == hash);
  // After a closed path back to the pole, axes and force have been turned by the path (its holonomy), so the
  // force differs from the first.
  CHECK((frame.force(p.response.end) - before).norm() > 0.01 * size);
}

TEST_CASE("Displacements from chords are off by the step squared and no normal motion leaks in", "[frame]") {
  // Moves a point along a loxodrome, at a height that oscillates over a sphere of radius r, and compares its
  // slip path in the carried axes by fine integration with that by coarse steps.
  const double r = 0.05;
  const auto position = [r](double t) {
    return Vector3d((r + 0.01 * std::sin(9.0 * t)) * on_sphere(0.6 + 0.5 * t, 1.3 * t));
  };
  const auto walk = [&](int steps, bool midway) {
    ContactFrame frame(position(0.0));
    Vector2d sum(0, 0);
    for (int i = 1; i <= steps; ++i) {
      const Vector3d from = position((i - 1.0) / steps), to = position(static_cast<double>(i) / steps);
      const Vector3d chord = to - from;
      const Vector3d along = frame.along(), aside = frame.aside();
      frame.carry(to);
      sum += midway ? frame.displacement(chord) : Vector2d(along.dot(chord), aside.dot(chord));
    }
    return sum;
  };
  const Vector2d exact = walk(200000, true);
  const double coarse = (walk(100, true) - exact).norm(), fine = (walk(200, true) - exact).norm();
  CHECK(coarse < 1e-5);
  CHECK(coarse / fine == Approx(4.0).epsilon(0.03));
  // With displacements expressed in the axes of a step's beginning, instead of half-way, the error is of
  // first order.
  CHECK((walk(100, false) - exact).norm() / (walk(200, false) - exact).norm() == Approx(2.0).epsilon(0.1));
  CHECK((walk(200, false) - exact).norm() > 20 * fine);

  // Checks the displacement over an arc of angle a: its chord is 2 r sin(a/2).
  ContactFrame frame(Vector3d::UnitZ(), Vector3d::UnitX());
  frame.carry(on_sphere(0.02, 0.0));
  const Vector2d d = frame.displacement(r * (on_sphere(0.02, 0.0) - Vector3d::UnitZ()));
  CHECK(1.0 - d[0] / (r * 0.02) == Approx(0.02 * 0.02 / 24).epsilon(1e-3));
  CHECK(std::abs(d[1]) < 1e-17);
  // A point that moves straight up while the normal turns does not slip: both halves of the normal's change
  // cancel.
  CHECK(std::abs(frame.displacement(frame.midway_normal())[0]) < 1e-15);
}

TEST_CASE("Mean force times displacement is the same work in space and in the plane", "[frame]") {
  SpacePatch p;
  ContactFrame frame(Vector3d::UnitZ());
  std::mt19937_64 random(3);
  double in_space = 0.0, in_plane = 0.0, lost = 0.0;
  for (int i = 0; i < 300; ++i) {
    frame.carry(on_sphere(1.0 + 0.01 * i, 0.02 * i), 0.1 * random_unit(random), 0.2 * random_unit(random));
    const Vector3d relative = 0.7 * dbar * random_unit(random);
    const Vector3d tangential = relative - relative.dot(frame.midway_normal()) * frame.midway_normal();
    p.step(frame, relative);
    in_space += frame.mean_force(p.response.mean).dot(tangential);
    in_plane += p.response.mean[0] * p.motion.displacement[0] + p.response.mean[1] * p.motion.displacement[1];
    lost += p.response.dissipated;
  }
  CHECK(in_space == Approx(in_plane).epsilon(1e-12));
  CHECK(-in_space == Approx(p.batch.stored_energy(p.patch) + lost).epsilon(1e-6));
}

TEST_CASE("A ball that rolls without slip feels no friction, on a plane and over another ball", "[frame]") {
  const double dt = 1e-3;
  SECTION("on a plane, about a changing axis") {
    SpacePatch p;
    const double radius = 0.02;
    ContactFrame frame(Vector3d::UnitZ());
    const Vector3d start = frame.along();
    for (int i = 0; i < 2000; ++i) {
      const Vector3d spin(30.0 * std::cos(0.01 * i), 30.0 * std::sin(0.01 * i), 0.0);
      const Vector3d velocity = spin.cross(radius * Vector3d::UnitZ());
      const Vector3d slip = velocity + spin.cross(-radius * Vector3d::UnitZ());
      frame.carry(Vector3d::UnitZ(), dt * spin, Vector3d::Zero());
      p.step(frame, dt * slip);
    }
    CHECK(std::hypot(p.response.end[0], p.response.end[1]) == 0.0);
    // Checks that the axes have not turned although the contact point moved by 1.2 m.
    CHECK((frame.along() - start).norm() < 1e-12);
  }
  SECTION("over another ball, with positions") {
    // The ball's centre moves on an arc; the ball turns as in rolling, by (1 + R/r) times the arc's angle.
    const double big = 0.1, small = 0.02, arc = 1e-3;
    SpacePatch p;
    ContactFrame frame(Vector3d::UnitZ());
    double slipped = 0.0;
    for (int i = 1; i <= 1000; ++i) {
      const Vector3d from = on_sphere(arc * (i - 1), 0.3), to = on_sphere(arc * i, 0.3);
      const Vector3d turn = (1.0 + big / small) * arc * from.cross(to).normalized();
      frame.carry(to, turn, Vector3d::Zero());
      const Vector3d relative = (big + small) * (to - from) - turn.cross(small * frame.midway_normal());
      slipped += frame.displacement(relative).norm();
      p.step(frame, relative);
    }
    // Slip measured along chords: a chord is shorter than its arc, of radius R + r, by the share arc^2/24.
    CHECK(slipped == Approx((big + small) * 1.0 * arc * arc / 24).epsilon(1e-3));
  }
}

TEST_CASE("The force on a stuck contact turns by the mean of its bodies' spins", "[frame]") {
  // A bristle is a spring between a point of one body and a point of the other. Two discs turn about their
  // common contact point, from which either end of the bristle is half the deflection away.
  const Vector3d n = Vector3d(0.3, -0.5, 0.8).normalized();
  for (const Vector2d& spins : {Vector2d(1.0, 1.0), Vector2d(0.0, 1.0), Vector2d(1.0, 0.0),
                                Vector2d(-1.0, 1.0), Vector2d(2.5, -0.4)}) {
    SpacePatch p;
    ContactFrame frame(n);
    frame.carry(n);
    p.step(frame, 0.2 * dbar * frame.along() + 0.3 * dbar * frame.aside());
    const Vector3d before = frame.force(p.response.end);
    Vector3d bristle = 0.2 * dbar * frame.along() + 0.3 * dbar * frame.aside();
    const int steps = 2000;
    for (int i = 0; i < steps; ++i) {
      frame.carry(n, spins[0] / steps * n, spins[1] / steps * n);
      p.step(frame, Vector3d::Zero());
      // Turns one end of the bristle with disc A and the other with B, about its middle (midpoint rule).
      Vector3d middle = bristle;
      for (int k = 0; k < 3; ++k) middle = bristle + 0.25 * (spins[0] + spins[1]) / steps * n.cross(middle);
      bristle += 0.5 * (spins[0] + spins[1]) / steps * n.cross(middle);
    }
    const Vector3d after = frame.force(p.response.end);
    CHECK(angle_about(n, before, after) == Approx(0.5 * (spins[0] + spins[1])).margin(1e-12));
    CHECK((after.normalized() + bristle.normalized()).norm() < 1e-6);
    CHECK(after.norm() == Approx(before.norm()).epsilon(1e-14));
  }
}

TEST_CASE("The axes of a contact fixed to a surface turn with that surface alone", "[frame]") {
  std::mt19937_64 random(9);
  for (const double angle : {1e-6, 0.1, 1.5, 3.0}) {
    ContactFrame frame(random_unit(random));
    const Vector3d axis = random_unit(random);
    const Eigen::AngleAxisd turn(angle, axis);
    const Vector3d along = turn * frame.along(), normal = turn * frame.normal();
    REQUIRE(frame.carry_with_surface(normal, angle * axis));
    CHECK((frame.along() - along).norm() < 1e-14);
    CHECK((frame.normal() - normal).norm() < 1e-14);
    CHECK_FALSE(frame.carry_with_surface(Vector3d::Zero(), angle * axis));
  }
}

TEST_CASE("A rigid motion of the whole scene changes no force but its direction", "[frame]") {
  // Lets a body slide and spin over a curved, turning surface; repeats it while everything turns about the
  // origin, by any amount in a step.
  for (double rate : {1e-3, 0.1, 2.0}) {
    SpacePatch still, moving;
    ContactFrame still_frame(on_sphere(0.5, 0.0));
    Eigen::Quaterniond scene(Eigen::AngleAxisd(1.1, Vector3d(1, 2, -1).normalized()));
    ContactFrame moving_frame(scene * still_frame.normal(), scene * still_frame.along());
    std::mt19937_64 random(4);
    double farthest = 0.0;
    for (int i = 1; i <= 500; ++i) {
      const Vector3d n = on_sphere(0.5 + 0.002 * i, 0.01 * i);
      const Eigen::Quaterniond turn_a(Eigen::AngleAxisd(0.03, random_unit(random)));
      const Eigen::Quaterniond turn_b(Eigen::AngleAxisd(0.01, random_unit(random)));
      const Vector3d relative = (i / 100 % 2 ? 0.3 : 0.001) * dbar * random_unit(random);
      still_frame.carry(n, turn_a, turn_b);
      still.step(still_frame, relative);

      const Eigen::Quaterniond by(Eigen::AngleAxisd(rate, random_unit(random)));
      const Eigen::Quaterniond next = (by * scene).normalized();
      // Orientations change within a step from scene * Q to next * turn * Q.
      moving_frame.carry(next * n, next * turn_a * scene.conjugate(), next * turn_b * scene.conjugate());
      // Expresses the relative motion of the bodies in the axes half-way through the step.
      Matrix3d to_moving, to_still;
      to_moving << moving_frame.midway_along(), moving_frame.midway_aside(), moving_frame.midway_normal();
      to_still << still_frame.midway_along(), still_frame.midway_aside(), still_frame.midway_normal();
      moving.step(moving_frame, to_moving * to_still.transpose() * relative);
      scene = next;
      farthest = std::max(farthest, (scene * still_frame.along() - moving_frame.along()).norm());
      expect_near(
          (scene * still_frame.force(still.response.end) - moving_frame.force(moving.response.end)).norm(),
          0.0, 1e-9 * 400 * dbar, "force in space");
    }
    INFO("turn in a step " << rate);
    CHECK(farthest < 1e-12);
  }
}

TEST_CASE("Rotations by a vector are those of Eigen, without its cosine", "[frame]") {
  std::mt19937_64 random(5);
  for (double angle : {0.0, 1e-200, 1e-9, 0.01, 0.49, 0.51, 1.0, 3.0, 6.2, 40.0}) {
    const Vector3d axis = random_unit(random);
    const Matrix3d expected = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
    const Matrix3d got = bristle::detail::rotation_by(angle * axis).toRotationMatrix();
    expect_near((got - expected).cwiseAbs().maxCoeff(), 0.0, 3e-15 * (1.0 + angle), "rotation");
  }
}

TEST_CASE("A bad normal is refused and leaves the frame alone", "[frame]") {
  ContactFrame frame(Vector3d(1, 2, 3));
  const ContactFrame before = frame;
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  for (const Vector3d& bad : {Vector3d(0, 0, 0), Vector3d(nan, 0, 1), Vector3d(inf, 0, 0)}) {
    CHECK_FALSE(frame.carry(bad));
    CHECK(frame.along() == before.along());
    CHECK(frame.normal() == before.normal());
    CHECK(frame.midway_normal() == before.normal());
  }
  CHECK_FALSE(frame.carry(Vector3d(0, 0, 1), Vector3d(nan, 0, 0), Vector3d::Zero()));
  CHECK(frame.normal() == before.normal());
  CHECK(frame.carry(Vector3d(0, 0, 1)));
}

TEST_CASE("A force at an arm gives its moment", "[frame]") {
  ContactFrame frame(Vector3d::UnitZ(), Vector3d::UnitX());
  const double tangential[2] = {2.0, -3.0};
  const ContactFrame::Wrench w = ContactFrame::wrench(frame.force(tangential), Vector3d(0.5, 0.0, 0.25));
  const Vector3d force = w.head<3>(), moment = w.tail<3>();
  CHECK((force - Vector3d(2, -3, 0)).norm() < 1e-15);
  CHECK((moment - Vector3d(0.75, 0.5, -1.5)).norm() < 1e-15);  // torque r x F, by hand
}

TEST_CASE("Frames of a pool go with their keys, begin anew with a new contact, and are restored by a copy",
          "[frame][keys]") {
  std::mt19937_64 random(11);
  bristle::PatchBatch batch;
  bristle::KeyedPatches pool(batch, bristle::Material{}, plain_options(20),
                             bristle::KeyedOptions{}.with_capacity(3));
  bristle::ContactFrames frames(pool);
  // Frames as a program would keep them itself, one for each key, to compare the pool with. Key 5 ends after
  // step 6 and begins again at step 9.
  std::map<std::uint64_t, ContactFrame> own;
  bristle::ContactFrames saved = frames;
  std::vector<std::byte> keys(pool.state_size()), state(batch.state_size());
  Vector3d saved_along = Vector3d::Zero();
  for (int step = 0; step < 20; ++step) {
    std::vector<std::uint64_t> present = {7, 2};
    if (step <= 6 || step >= 9) present.push_back(5);
    for (const std::uint64_t key : present) {
      const Vector3d normal = random_unit(random), a = 0.2 * random_unit(random),
                     b = 0.1 * random_unit(random);
      const bristle::KeyedContact contact = pool.find_or_add_contact(key);
      REQUIRE(contact.index < 3);
      CHECK(contact.id == pool.find(key));
      CHECK(contact.is_new == (own.count(key) == 0));
      if (own.count(key) == 0)
        own[key] = ContactFrame(normal);
      else
        own[key].carry(normal, a, b);
      const ContactFrame& frame = frames.carry(contact, normal, a, b);
      CHECK(frame.along() == own[key].along());
      CHECK(frame.midway_aside() == own[key].midway_aside());
      CHECK(&frame == &frames[contact.index]);
    }
    pool.end_step();
    if (step == 6) own.erase(5);
    if (step == 12) {
      saved = frames;
      saved_along = own[5].along();
      batch.save_state({state.data(), state.size()});
      pool.save_state({keys.data(), keys.size()});
    }
  }
  batch.restore_state({state.data(), state.size()});
  pool.restore_state({keys.data(), keys.size()});
  frames = saved;
  CHECK(frames[pool.find_or_add_contact(5).index].along() == saved_along);
  // Contacts beyond the pool's capacity share one frame, whose values nobody reads.
  const bristle::KeyedContact fourth = pool.find_or_add_contact(1000);
  CHECK(fourth.index == 3);
  CHECK(fourth.is_new);
  CHECK(fourth.id == bristle::PatchId::no_capacity());
  frames.carry(fourth, Vector3d::UnitX());
}

TEST_CASE(
    "Contacts of surfaces whose points change keep their shares of the load, and follow the points slowly",
    "[frame][keys]") {
  bristle::SurfaceLoads loads;
  for (const std::uint64_t pair : {7u, 8u, 7u}) loads.add(pair);
  REQUIRE(loads.all().size() == 2);
  CHECK((loads.find(7) == 0 && loads.find(8) == 1 && loads.find(9) == -1));
  // Two contacts carry 3 and 1 N. Then the pair carries 8 N on a point that belongs to the second contact.
  double first = 3.0, second = 1.0;
  const auto step = [&] {
    loads[0].before = first + second;
    loads[0].now = 8.0;
    first = loads.held_load(0, first, 0.0);
    second = loads.held_load(0, second, 8.0);
  };
  step();
  CHECK(first == Approx(6.0 * 63.0 / 64.0));
  CHECK(second == Approx(8.0 - first));
  for (int i = 1; i < 64; ++i) step();
  CHECK(first == Approx(6.0 * std::pow(63.0 / 64.0, 64)));
  CHECK(loads.presses(0, first));
  for (int i = 64; i < 424; ++i) step();
  CHECK(first < 8e-3);  // less than a thousandth of the load
  CHECK_FALSE(loads.presses(0, first));
  // Surfaces that carried nothing have no shares yet, and others need none.
  CHECK(loads.held_load(1, 0.0, 2.5) == 2.5);
  CHECK(loads.held_load(-1, 1.0, 2.5) == 2.5);
  CHECK(loads.held_load(-1, 2.5, 2.5 * (1.0 + 1e-7)) == 2.5);
  CHECK(bristle::SurfaceLoads::first_load(6.4) == Approx(0.1));
}

TEST_CASE("The frame of a new contact is made anew, also if its patch was asked for before",
          "[frame][keys]") {
  bristle::PatchBatch batch;
  bristle::KeyedPatches pool(batch, bristle::Material{}, plain_options(20),
                             bristle::KeyedOptions{}.with_capacity(1));
  std::vector<std::byte> state(batch.state_size()), keys(pool.state_size());
  CHECK(pool.find_or_add_contact(1).is_new);
  pool.remove(1);
  pool.find_or_add(2);
  batch.save_state({state.data(), state.size()});
  pool.save_state({keys.data(), keys.size()});
  for (int pass = 0; pass < 2; ++pass) {  // repeats the steps after restoring the saved state
    pool.find_or_add(2);
    CHECK(pool.find_or_add_contact(2).is_new);
    CHECK_FALSE(pool.find_or_add_contact(2).is_new);
    pool.end_step();
    CHECK_FALSE(pool.find_or_add_contact(2).is_new);
    batch.restore_state({state.data(), state.size()});
    pool.restore_state({keys.data(), keys.size()});
  }
}

}  // namespace bristle_test::test_contact_frame
