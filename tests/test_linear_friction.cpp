// LinearFriction and BodySystem: the equations that the predictor of coupling.hpp and solvers of engines
// share.
#include <catch2/catch.hpp>

#include <cmath>
#include <random>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <bristle/coupling.hpp>
#include <bristle/extended_coupling.hpp>
#include <bristle/linear_friction.hpp>

#include "expect.hpp"
#include "scenes.hpp"

namespace bristle_test::test_linear_friction {

using bristle::BodySystem;
using bristle::LinearFriction;
using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

constexpr double dt = 2e-3;

/// Returns an answer with elastic force (3, -4) N, damper force (-1, 0.5) N, stiffness 2000 N/m, damping
/// 5 N s/m, limit 8 N.
Response answer() {
  Response r;
  r.elastic[0] = 3.0;
  r.elastic[1] = -4.0;
  r.end[0] = 2.0;
  r.end[1] = -3.5;
  r.stiffness = 2000.0;
  r.damping = 5.0;
  r.force_limit = 8.0;
  return r;
}

}  // namespace

TEST_CASE("A patch is a spring and a damper until its spring exceeds the limit, then a constant and a damper",
          "[coupling]") {
  LinearFriction f(answer(), dt, 10.0, 0.5);
  const Vector2d slip(-1.0, 1.0);
  const double spring = 0.5 * dt * 2000.0, damper = 0.5 * 5.0;
  CHECK((f.force(slip) - (0.5 * Vector2d(3, -4) - (spring + damper) * slip)).norm() < 1e-14);
  LinearFriction held = f;
  CHECK_FALSE(held.release({-0.1, 0.1}));
  CHECK((held.force(slip) - f.force(slip)).norm() == 0.0);

  const Vector2d pulled = 0.5 * Vector2d(3, -4) - spring * Vector2d(-3, 4);
  REQUIRE(f.release({-3.0, 4.0}));
  const Vector2d limit = 4.0 * pulled.normalized();
  CHECK((f.force({0, 0}) - limit).norm() < 1e-14);
  CHECK((f.force({7, -2}) - (limit - damper * Vector2d(7, -2))).norm() < 1e-13);
  CHECK_FALSE(f.release({-9.0, 9.0}));  // once
  CHECK((f.force({0, 0}) - limit).norm() < 1e-14);

  LinearFriction unlimited(answer(), dt, 10.0);
  unlimited.limited = false;
  CHECK_FALSE(unlimited.release({-30.0, 40.0}));
}

TEST_CASE("A friction impulse is what the patch gives at the slip that the impulse leaves", "[coupling]") {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  int slipped = 0;
  for (int i = 0; i < 200; ++i) {
    Matrix2d mobility = Matrix2d::Random();
    mobility = (mobility * mobility.transpose() + 0.1 * Matrix2d::Identity()).eval();
    const Vector2d free(3.0 * number(random), 3.0 * number(random));
    const double load = 10.0, normal = dt * load * (1.0 + 0.5 * number(random)), share = normal / load;
    const LinearFriction f(answer(), dt, load);
    const Vector2d p = f.impulse(normal, dt, mobility, free);
    const Vector2d left = free + mobility * p;
    // The load scales stiffness, damping and limit; bristles that a rising load adds are straight.
    const Vector2d elastic = std::min(share, dt) * Vector2d(3, -4) - share * f.spring[0] * left;
    const Vector2d damper = -share * 5.0 * left;
    if (elastic.norm() <= share * 8.0) {
      CHECK((p - elastic - damper).norm() < 1e-12);
    } else {
      ++slipped;
      CHECK((p - damper).norm() == Approx(share * 8.0));
    }
  }
  CHECK((slipped > 20 && slipped < 180));
}

TEST_CASE("A line through a patch's answer meets it at the slip asked, with the secant as slope",
          "[coupling]") {
  const Vector2d slip(0.4, -0.3), rest(3.5, -5.0);
  const LinearFriction f = LinearFriction::through(answer(), rest, slip, dt, 10.0, 2.0);
  CHECK((f.force(slip) - 2.0 * Vector2d(2.0, -3.5)).norm() < 1e-13);
  // The elastic force fell by (0.5, -1) over the displacement dt (0.4, -0.3).
  const double secant = (0.5 * 0.4 + 1.0 * 0.3) * dt / (dt * dt * 0.25);
  CHECK(f.spring[0] == Approx(2.0 * dt * secant));
  CHECK(f.slope()[1] == Approx(2.0 * (dt * secant + 5.0)));
  CHECK_FALSE(f.limited);
  CHECK(f.limit == 16.0);
  // A force that grows along the slip has no negative slope, and none is above the patch's stiffness.
  CHECK(LinearFriction::through(answer(), {2.5, -3.0}, slip, dt, 10.0).spring[0] == 0.0);
  CHECK(LinearFriction::through(answer(), {9.0, -9.0}, slip, dt, 10.0).spring[0] == dt * 2000.0);
  const LinearFriction bed = LinearFriction::through(answer(), rest, slip, dt, 10.0, 1.0, {1.5, 0.5});
  CHECK(bed.spring[0] == Approx(3.0 * bed.spring[1]));
  CHECK((bed.force(slip) - Vector2d(2.0, -3.5)).norm() < 1e-13);
}

TEST_CASE("Equations of bodies that touch have the solution of the full matrix", "[coupling]") {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  constexpr int n = 15;
  BodySystem system;
  system.begin(n);
  std::vector<std::vector<int>> columns;
  for (const int at : {0, 4, 9, 3}) columns.push_back({at + 2, at, at + 5});
  columns.push_back({-1, 7, -1});
  for (const auto& c : columns) system.couple(c.data(), c.size());
  system.set_zero();
  CHECK(system.entries() < n * (n + 1) / 2);
  Eigen::MatrixXd full = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
  for (int i = 0; i < n; ++i) {
    full(i, i) = system.line(i)[i] = 2.0 + number(random);
    right[i] = system.right[i] = number(random);
  }
  for (const auto& c : columns) {
    Eigen::Matrix<double, 3, 2> levers;
    for (int k = 0; k < 3; ++k) levers.row(k) << number(random), number(random);
    Matrix2d gain;
    gain << 3.0, 0.5, 0.5, 2.0;
    const Vector2d pull(number(random), number(random));
    system.add(c.data(), levers, gain, pull);
    for (int i = 0; i < 3; ++i) {
      if (c[static_cast<std::size_t>(i)] < 0) continue;
      right[c[static_cast<std::size_t>(i)]] += levers.row(i).dot(pull);
      for (int k = 0; k < 3; ++k)
        if (c[static_cast<std::size_t>(k)] >= 0)
          full(c[static_cast<std::size_t>(i)], c[static_cast<std::size_t>(k)]) +=
              levers.row(i) * gain * levers.row(k).transpose();
    }
  }
  system.factor();
  system.substitute();
  CHECK((full * system.right - right).norm() < 1e-13);
}

TEST_CASE("Contacts of free bodies enter the equations summed as they do one by one", "[coupling]") {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  const int pairs[][2] = {{0, 6}, {0, 6}, {12, 6}, {-1, 0}, {12, -1}, {0, 6}};
  BodySystem summed, single;
  for (BodySystem* system : {&summed, &single}) {
    system->begin(18);
    for (int i = 0; i < 18; ++i) system->couple(i, 0);
    system->set_zero();
    for (int i = 0; i < 18; ++i) system->line(i)[i] = 5.0;
  }
  const auto add = [&](const int(&first)[2], const auto& levers, const auto& gain, const auto& pull) {
    int columns[12];
    for (int i = 0; i < 12; ++i) columns[i] = first[i / 6] < 0 ? -1 : first[i / 6] + i % 6;
    summed.add_bodies(first, levers, gain, pull);
    single.add(columns, levers, gain, pull);
  };
  for (const auto& first : pairs) {
    Eigen::Matrix<double, 12, 2> levers;
    for (int i = 0; i < 24; ++i) levers(i % 12, i / 12) = number(random);
    Matrix2d gain;
    gain << 3.0, 0.5, 0.5, 2.0;
    add(first, levers, gain, Vector2d(number(random), number(random)));
  }
  Eigen::Matrix<double, 6, 1> alone;
  for (double& x : alone) x = number(random);
  using One = Eigen::Matrix<double, 1, 1>;
  add({6, -1}, alone, One(0.7), One(0.3));
  for (BodySystem* system : {&summed, &single}) {
    system->factor();
    system->substitute();
  }
  CHECK((summed.right - single.right).norm() < 1e-13);
  CHECK(single.right.norm() > 0.1);
}

TEST_CASE("A contact of a rigid body slips with velocity, spin and arm", "[coupling]") {
  const Vector3d arm(0.3, -0.2, 0.5), v(1.0, 2.0, -1.0), spin(0.7, -0.4, 2.0);
  const Vector3d along = Vector3d(1, 2, 0).normalized(), aside = Vector3d(-2, 1, 3).normalized();
  Eigen::Matrix<double, 6, 1> u;
  u << v, spin;
  const Vector3d at_contact = v + spin.cross(arm);
  const Vector2d slip = bristle::rigid_contact(0, arm, along, aside).jacobian * u;
  CHECK(slip[0] == Approx(at_contact.dot(along)));
  CHECK(slip[1] == Approx(at_contact.dot(aside)));
  const Vector3d with_spin = bristle::rigid_contact_with_spin(0, arm, along, aside).jacobian * u;
  CHECK(with_spin[0] == Approx(slip[0]));
  CHECK(with_spin[1] == Approx(slip[1]));
  CHECK(with_spin[2] == Approx(spin.dot(along.cross(aside))));
}

TEST_CASE("A cell of an outline moves by the chord of its turn, however fast the body spins", "[coupling]") {
  bristle::PatchBatch batch;
  bristle::ExtendedPatches patches(batch);
  bristle::ExtendedMotion motion;
  motion.id = patches.add(bristle::Material{}, PatchOptions{}.with_bristles(100),
                          bristle::Outline::rectangle(0.02, 0.01, bristle::Pressure::uniform, 3, 2));
  motion.normal_load = 1.0;
  bristle::CellContacts<3> cells;
  bristle::ExtendedContact<3> contact;
  contact.jacobian.setIdentity();
  contact.ground_velocity = {0.1, -0.2, 30.0};
  bristle::detail::lay_out_cells<3>(patches, {&contact, 1}, {&motion, 1}, cells);
  REQUIRE(cells.contacts.size() == 6);
  for (const double spin : {-1000.0, 20.0, 800.0}) {  // rad/s: turns of -2 to 1.6 rad in a step
    const Vector3d u(0.4, 0.3, spin);
    bristle::detail::FollowTurn<3>(patches, dt, {&contact, 1}, {&motion, 1}, cells)(u);
    const double turn = dt * (spin - 30.0);
    const Matrix2d rotation = Eigen::Rotation2Dd(turn).toRotationMatrix();
    for (std::size_t k = 0; k < cells.contacts.size(); ++k) {
      const Vector2d at(cells.positions[k].position[0], cells.positions[k].position[1]);
      const Vector2d moved = dt * (cells.contacts[k].jacobian * u - cells.contacts[k].ground_velocity);
      CHECK((moved - (dt * Vector2d(0.3, 0.5) + rotation * at - at)).norm() < 1e-12);
    }
  }
}

TEST_CASE("Friction that strengthens with speed leaves the predictor its dampers", "[coupling]") {
  const auto stop = [](double strengthening) {
    bristle::PatchBatch batch;
    const auto material =
        bristle::Material{}.with_viscous_friction(400.0).with_speed_strengthening(strengthening, 1e-3);
    Motion motion;
    motion.id = batch.add(material, PatchOptions{}.with_max_normal_load(1.0).with_axes(1).with_bristles(64));
    motion.normal_load = 1.0;
    bristle::MovingBody<1> body;
    body.velocity[0] = 0.5;
    bristle::BodyContact<1> contact;
    contact.axes = 1;
    const auto mean = bristle::predict_displacements<1>(batch, dt, body, bristle::BodyVector<1>::Zero(),
                                                        {&contact, 1}, {&motion, 1});
    CHECK(motion.displacement[0] == dt * mean[0]);
    return mean[0];
  };
  // A damper of 400 N s/m takes 44 % of the velocity of 1 kg in 2 ms; 0.1 % of 1 N hardly any.
  const double damped = stop(0.0);
  CHECK(damped < 0.4);
  CHECK(stop(1e-3) == Approx(damped).epsilon(1e-3));
  CHECK(stop(1e-3) < damped);
}

TEST_CASE(
    "The root of a falling function that is flat at the root is found by halving, where secants are slow",
    "[coupling]") {
  for (const double root : {0.3, 0.7}) {
    for (const double start : {-1.0, 2.0}) {
      bristle::detail::Effort effort(1.0);
      const auto cubic = [&](double x) {
        effort.count(0.0);
        return std::pow(root - x, 3);
      };
      const double found = bristle::detail::find_falling_root(
          cubic, start, [] { return 1.0; }, effort);
      CHECK(std::abs(cubic(found)) < 1e-7);
      CHECK(effort.report(0.0).evaluations < 40);
    }
  }
}

}  // namespace bristle_test::test_linear_friction
