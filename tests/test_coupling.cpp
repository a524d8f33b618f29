// Bodies on patches: stops, rest, energy and stability of the two coupling methods.
#include <catch2/catch.hpp>

#include <array>
#include <cmath>

#include "coupling_example.hpp"
#include "expect.hpp"
#include "rail_body.hpp"
#include "reference_table.hpp"
#include "scenes.hpp"

namespace bristle_test::test_coupling {

namespace {

enum class Solver { predictor, midpoint };

constexpr double mass = 0.1;

/// A mass on a rail over one patch, with a chosen k = K T^2/m and c = C T/m, where T = tick.
struct Rail : RailBody {
  Rail(Solver solver, double k, double c, std::uint32_t bristles, SnapRule rule = SnapRule::redraw)
      : RailBody(solver == Solver::midpoint, mass, 1.0,
                 Material{}
                     .with_bristle_stiffness(k * mass / (tick * tick) / 1000.0)
                     .with_bristle_damping(c * mass / tick / 1000.0)
                     .with_stribeck_velocity(1e12)
                     .with_normal_stiffness(1000.0)
                     .with_snap_length(uniform)
                     .with_snap_rule(rule),
                 PatchOptions{}.with_max_normal_load(1.0).with_bristles(bristles).with_precision(
                     precisions().back())),
        stiffness(k * mass / (tick * tick)) {}

  /// Slides for thirty mean snap lengths, after which friction is steady.
  void slide_in() {
    for (int i = 0; i < 400; ++i) patch.step(0.0731 * dbar, 0.0, 1.0);
  }

  double stiffness;
};

double stopping_ratio(Solver solver, double k, double path_in_dbar) {
  Rail rail(solver, k, 0.0, 4000);
  rail.slide_in();
  // Kinetic force with redraw and lengths uniform on 0.5 to 1.5: m2 / (2 m1) = 13/24 of K dbar.
  const double kinetic_n = 13.0 / 24.0 * rail.stiffness * dbar;
  rail.body.velocity[0] = std::sqrt(2.0 * kinetic_n * path_in_dbar * dbar / mass);
  double farthest = 0.0;
  for (int i = 0; i < 400; ++i) {
    rail.step();
    farthest = std::max(farthest, rail.x);
  }
  return farthest / (path_in_dbar * dbar);
}

}  // namespace

TEST_CASE("A sliding body stops where a constant friction force stops it, by either coupling", "[coupling]") {
  // The mean force of 4000 bristles with redraw, over some 20 snaps each, has a relative deviation of 0.38 /
  // sqrt(4000 * 20) = 0.0014. At the stop the bristles spring back by up to 0.3 dbar.
  for (const double k : {0.08, 0.8, 8.0}) {
    CAPTURE(k);
    CHECK(stopping_ratio(Solver::midpoint, k, 300.0) == Approx(1.0).margin(0.003));
    CHECK(stopping_ratio(Solver::midpoint, k, 20.0) == Approx(1.0).margin(5 * 0.0014 + 0.01));
    // Tolerance of Solver::predictor: in a late step it may pull with the peak force in place of the kinetic
    // force: a relative error of (peak - kinetic) / K dbar = 0.083, over the displacement of that step.
    CHECK(stopping_ratio(Solver::predictor, k, 300.0) == Approx(0.99).margin(0.015));
    CHECK(stopping_ratio(Solver::predictor, k, 20.0) == Approx(0.97).margin(0.035));
  }
}

TEST_CASE("The midpoint solve never adds energy, whatever the stiffness", "[coupling][energy]") {
  for (const double k : {1e-3, 0.8, 50.0, 1e4}) {
    for (const double c : {0.0, 0.01, 1.0, 100.0}) {
      Rail rail(Solver::midpoint, k, c, 500);
      rail.body.velocity[0] = std::sqrt(20.0 * k) * dbar / tick;
      double before = rail.kinetic_energy();
      const double start = before;
      CAPTURE(k, c);
      for (std::uint32_t i = 0; i < test_size(500); ++i) {
        rail.step();
        const double now = rail.kinetic_energy() + rail.stored_energy();
        // Bound of the energy error: a residual r of the solved force moves the body T^2 r / (2 m) too far,
        // over which the friction force does work. The patch's own balance holds to 1e-12.
        const double force = rail.stiffness * dbar + std::abs(rail.response.damper[0]);
        const double slack = force * force * rail.report.residual * tick * tick / (2.0 * mass) +
                             1e-11 * rail.stiffness * dbar * dbar + 1e-12 * start;
        expect(now <= before + slack, "energy does not rise");
        before = now;
      }
      if (c > 0.0) CHECK(before < 0.5 * start);
    }
  }
}

TEST_CASE("The midpoint solve says by its residual that a patch lacks the mean force", "[coupling]") {
  for (const Outputs outputs : {Outputs::end, Outputs::mean}) {
    PatchBatch batch;
    const PatchId patch =
        batch.add(Material{}, PatchOptions{}.with_max_normal_load(1.0).with_axes(1).with_outputs(outputs));
    bristle::MovingBody<1> body;
    bristle::BodyContact<1> contact;
    contact.axes = 1;
    contact.jacobian << 1.0, 0.0;
    Motion motion{patch, {0.0, 0.0}, 1.0};
    bristle::BodyVector<1> pull;
    pull << 0.2;
    const bristle::SolveReport report =
        bristle::solve_displacements<1>(batch, 1e-3, body, pull, {&contact, 1}, {&motion, 1});
    CHECK(std::isinf(report.residual) == (outputs == Outputs::end));
  }
}

TEST_CASE("The clipped predictor comes to rest from sliding, whatever stiffness and damping", "[coupling]") {
  for (const double k : {1e-3, 0.8, 50.0, 1e4}) {
    for (const double c : {0.0, 0.01, 1.0, 100.0}) {
      CAPTURE(k, c);
      Rail rail(Solver::predictor, k, c, 500);
      rail.slide_in();
      const double start = std::sqrt(20.0 * k) * dbar / tick;
      rail.body.velocity[0] = start;
      // A free swing of the stuck mass takes 2 pi / sqrt(k) steps and loses k/2 of its squared amplitude in a
      // step (determinant 1 / (1 + k/2)). If stiff, a step multiplies the amplitude by 1 - 4 / (1 + k/2),
      // which is negative. Runs for six decay times.
      const double decay = std::max({4.0 / std::max(k, c), 0.25 * k, 50.0});
      const auto steps = static_cast<int>(std::min(6.0 * decay, 24000.0));
      for (int i = 0; i < steps; ++i) rail.step();
      CHECK(std::abs(rail.body.velocity[0]) < 0.05 * start);
      CHECK(rail.x < 40.0 * dbar * 1.5);
    }
  }
}

TEST_CASE("A damper of any strength brakes a predicted body and does not turn it back", "[coupling]") {
  const double body_mass = 2.0;
  for (const double c : {0.1, 1.0, 10.0, 1e3, 1e6}) {  // c: damper x tick / mass
    CAPTURE(c);
    const double damper = c * body_mass / tick;
    // Material that is only a lubricating film: its bristles hold no more than 1e-14 N.
    const Material film = plain_material(uniform, SnapRule::keep).with_viscous_friction(damper);
    RailBody rail(false, body_mass, 1e-9, film, plain_options(1).with_max_normal_load(1e-9));
    rail.body.velocity[0] = 1.0;
    double before = 1.0;
    for (int k = 0; k < 400; ++k) {
      rail.step();
      REQUIRE(rail.body.velocity[0] >= -1e-9);
      REQUIRE(rail.body.velocity[0] <= before + 1e-9);
      before = rail.body.velocity[0];
    }
    CHECK(before < 1e-6);
    // The damper must have taken all momentum, which equals damper constant x distance.
    CHECK(rail.x == Approx(body_mass / damper).epsilon(1e-6));
  }
}

TEST_CASE("A rigid plate spun about its normal stops after the angle that friction allows", "[coupling]") {
  // Four feet at a radius r stop a turning plate: its energy I w^2 / 2 is the work mu N r angle.
  constexpr double inertia = 3e-4, arm_x = 0.04, arm_y = 0.03, spin = 8.0, load = 0.6;
  const double radius = std::hypot(arm_x, arm_y);
  const Material material = plain_material(uniform, SnapRule::redraw)
                                .with_normal_stiffness(1e3)
                                .with_bristle_stiffness(0.4 * 24.0 / 13.0 / (1e3 * dbar));
  REQUIRE(material.kinetic_coefficient() == Approx(0.4));
  for (const Solver solver : {Solver::predictor, Solver::midpoint}) {
    PatchBatch batch;
    std::array<Motion, 4> motions;
    std::array<Response, 4> responses;
    std::array<bristle::BodyContact<6>, 4> feet;
    for (std::size_t i = 0; i < 4; ++i) {
      motions[i].id = batch.add(material, PatchOptions{}
                                              .with_max_normal_load(load)
                                              .with_bristles(500)
                                              .with_outputs(Outputs::mean)
                                              .with_seed(static_cast<std::uint32_t>(i)));
      motions[i].normal_load = load;
      feet[i] = bristle::rigid_contact(i, {i & 1 ? arm_x : -arm_x, i & 2 ? arm_y : -arm_y, 0.0}, {1, 0, 0},
                                       {0, 1, 0});
    }
    batch.warm_up();
    auto body = bristle::rigid_body(0.25, Eigen::Vector3d(1e-4, 2e-4, inertia).asDiagonal());
    body.velocity[5] = spin;
    const bristle::BodyVector<6> none = Eigen::Matrix<double, 6, 1>::Zero();
    double angle = 0.0, farthest = 0.0;
    for (int i = 0; i < 500; ++i) {
      const double before = body.velocity[5];
      if (solver == Solver::predictor) {
        bristle::predict_displacements(batch, tick, body, none, feet, motions);
        batch.step(tick, motions, responses);
        bristle::apply_end_forces(tick, body, none, feet, responses);
      } else {
        const auto report = bristle::solve_displacements(batch, tick, body, none, feet, motions);
        // The solve is not exact, because the force of 500 bristles jumps where one of them snaps.
        expect(report.residual < 5e-3, "solved");
        batch.step(tick, motions, responses);
        bristle::apply_mean_forces(tick, body, none, feet, responses);
      }
      angle += 0.5 * tick * (before + body.velocity[5]);
      farthest = std::max(farthest, angle);
    }
    // The feet's axes do not turn with the plate, an approximation for small angles. The tolerance covers the
    // noise of 2000 bristles and the bending at the start, one mean snap length of some 300 of path.
    const double expected = inertia * spin * spin / 2.0 / (0.4 * 4.0 * load * radius);
    CHECK(farthest == Approx(expected).epsilon(0.01));
    CHECK(body.velocity.head<5>().norm() < 0.02 * spin * radius);
  }
}

TEST_CASE("Momentum is kept: a pushed body's velocity follows from the forces on it", "[coupling]") {
  Rail rail(Solver::midpoint, 0.8, 0.1, 500);
  double impulse = 0.0;
  for (int i = 0; i < 200; ++i) {
    rail.step(0.7);
    impulse += tick * (0.7 + rail.response.mean[0]);
    expect_near(mass * rail.body.velocity[0], impulse, 1e-13 * (i + 1), "momentum");
  }
}

TEST_CASE("A patch of one axis does not hold a body back along the other", "[coupling]") {
  // Patch A acts along x with 8e6 N/m. Patch B, along y, slides at once and pulls with its limit, 10,000 N/m
  // times 10 um. Row 1 of A's Jacobian, which a patch of one axis does not use, has its default, y.
  PatchBatch batch;
  const SnapLength one_length = SnapLength::single(dbar);
  const PatchId a = batch.add(plain_material(one_length, SnapRule::keep).with_bristle_stiffness(8e4),
                              plain_options(100, 1, Precision::single, Outputs::end));
  const PatchId b = batch.add(plain_material(one_length, SnapRule::keep),
                              plain_options(10000, 1, Precision::single, Outputs::end));
  batch.warm_up();
  std::array<Motion, 2> motions = {Motion{a, {0.0, 0.0}, 100.0}, Motion{b, {0.0, 0.0}, 10000.0}};
  std::array<Response, 2> responses;
  batch.step(tick, motions, responses);  // a step only to put the patches under load
  bristle::MovingBody<2> body;           // body of 1 kg with velocities along x and y
  body.velocity = Eigen::Vector2d(0.0, 0.1);
  std::array<bristle::BodyContact<2>, 2> feet;
  for (std::size_t i : {0u, 1u}) {
    feet[i].index = i;
    feet[i].axes = 1;
  }
  feet[1].jacobian << 0, 1, 1, 0;
  // Along x the force acts at the middle of the step: x = T^2 F/2 / (m + T^2 k/2), which for 40 N is 4 um of
  // the 10 that A holds. The motion along y must not count as slip of A, which would lower its force.
  for (const double pull : {0.0, 40.0}) {
    const bristle::BodyVector<2> external = Eigen::Vector2d(pull, 0.0);
    bristle::predict_displacements(batch, tick, body, external, feet, motions);
    const double half = 0.5 * tick * tick;
    CHECK(motions[0].displacement[0] == Approx(half * pull / (1.0 + half * 8e6)).epsilon(1e-9));
    CHECK(motions[1].displacement[0] == Approx(tick * (0.1 - 0.5 * tick * 0.1)).epsilon(1e-9));
  }
}

TEST_CASE("A block on a slope does not creep", "[coupling]") {
  // Pushes with two thirds of the kinetic force, in steps of 1 ms. Once the body is at rest, the step's
  // equation has only one solution, to stay.
  for (const Solver solver : {Solver::predictor, Solver::midpoint}) {
    Rail rail(solver, 0.8, 0.2, 500);
    const double push = 2.0 / 3.0 * 13.0 / 24.0 * rail.stiffness * dbar;
    for (int i = 0; i < 2000; ++i) rail.step(push);
    const double settled = rail.x;
    CHECK(settled > 0.3 * dbar);  // the push bends the bristles by at least 0.36 dbar
    CHECK(settled < 3.0 * dbar);
    for (std::uint32_t i = 0; i < test_size(200000); ++i) rail.step(push);
    // Forces are solved to a relative 1e-10; at rest such errors do not accumulate.
    CHECK(std::abs(rail.x - settled) < 1e-8 * dbar);
  }
}

TEST_CASE("A body on a moving floor is carried along", "[coupling]") {
  // Puts a body on a belt: the ground velocity enters the slip, and friction accelerates the body until both
  // move equally fast.
  PatchBatch batch;
  Motion motion;
  motion.id = batch.add(Material{}.with_bristle_damping(0.05).with_stribeck_velocity(1e6),
                        PatchOptions{}.with_outputs(Outputs::mean));
  motion.normal_load = 1.0;
  for (const Solver solver : {Solver::predictor, Solver::midpoint}) {
    bristle::MovingBody<2> body;
    body.mass *= 0.1;
    bristle::BodyContact<2> contact;
    contact.ground_velocity = Eigen::Vector2d(0.3, -0.2);
    const bristle::BodyVector<2> none = Eigen::Vector2d::Zero();
    Response response;
    for (int i = 0; i < 3000; ++i) {
      if (solver == Solver::predictor) {
        bristle::predict_displacements(batch, tick, body, none, {&contact, 1}, {&motion, 1});
      } else {
        bristle::solve_displacements(batch, tick, body, none, {&contact, 1}, {&motion, 1});
      }
      batch.step(tick, {&motion, 1}, {&response, 1});
      if (solver == Solver::predictor) {
        bristle::apply_end_forces(tick, body, none, {&contact, 1}, {&response, 1});
      } else {
        bristle::apply_mean_forces(tick, body, none, {&contact, 1}, {&response, 1});
      }
    }
    CHECK((body.velocity - contact.ground_velocity).norm() < 1e-6);
  }
}

TEST_CASE("The plate of the example holds below the limit, and accelerates beyond it", "[coupling]") {
  // The load is 0.25 kg * 9.81 = 2.45 N, kinetic friction 0.98 N. A held plate moves by less than the longest
  // bristle; past the limit (peak 0.46: 1.13 N) it accelerates by (1.3 - 0.98) / 0.25 m/s^2 for a second.
  CHECK(pushed_plate(0.5) < 15e-6);
  CHECK(pushed_plate(0.5) > 1e-6);
  CHECK(pushed_plate(1.3) == Approx(0.5 * (1.3 - 0.981) / 0.25).epsilon(0.02));
}

TEST_CASE("Small equations whose first line lacks the first unknown are solved", "[coupling]") {
  Eigen::Matrix3d a;
  a << 0.0, 2.0, 1.0, 4.0, 0.0, 0.0, 1.0, 0.0, 5.0;
  const Eigen::Vector3d x(3.0, -2.0, 7.0);
  CHECK((bristle::detail::eliminate<3>(a, a * x) - x).norm() < 1e-14);
}

}  // namespace bristle_test::test_coupling
