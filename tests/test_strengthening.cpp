// Strengthening with speed, a N asinh(v / (2 v*)) against the motion: the force of a patch in closed form,
// and bodies that it stops, against the equation of motion in steps far finer than the coupling's.
#include <catch2/catch.hpp>

#include <array>
#include <cmath>

#include "expect.hpp"
#include "scenes.hpp"
#if BRISTLE_HAS_EIGEN
#include "rail_body.hpp"
#endif

namespace bristle_test::test_strengthening {

using bristle::Population;

namespace {

constexpr double a = 0.02, slow = 3e-6;  // friction per e-fold of speed; reference speed v*, m/s

Material strengthening_material(double bristle_stiffness = 80.0) {
  return Material{}
      .with_bristle_stiffness(bristle_stiffness)
      .with_bristle_damping(0.02)
      .with_viscous_friction(0.3)
      .with_stribeck_velocity(2e-3)
      .with_snap_length(uniform)
      .with_speed_strengthening(a, slow);
}

}  // namespace

TEST_CASE("A patch adds a N asinh(v / (2 v*)) against its velocity, along one axis or two",
          "[strengthening]") {
  for (const Population population : {Population::representatives, Population::infinite}) {
    for (const int axes : {1, 2}) {
      const PatchOptions options =
          plain_options(200, axes).with_max_normal_load(4.0).with_population(population);
      OnePatch with(strengthening_material(), options);
      OnePatch without(Material(strengthening_material()).with_speed_strengthening(0.0, slow), options);
      for (int i = 0; i < 200; ++i) {
        const double size = dbar * std::pow(10.0, 0.05 * (i % 100) - 4.0);  // speeds of 1e-7 to 1 m/s in all
        const double dx = i % 3 == 0 ? -size : 0.6 * size, dy = axes == 2 ? 0.8 * size : 0.0;
        const double load = 1.0 + i % 4;
        Motion motion{with.id, {dx, dy}, load};
        const Response trial = with.batch.find_force(tick, motion);
        const Response r = with.step(motion), plain = without.step(dx, dy, load);
        const double speed = std::hypot(dx, dy) / tick;
        const double force = a * load * std::asinh(speed / (2.0 * slow));
        CAPTURE(axes, i, speed);
        for (int k = 0; k < axes; ++k) {
          const double expected = plain.damper[k] - force * (k == 0 ? dx : dy) / (speed * tick);
          REQUIRE(r.damper[k] == Approx(expected).epsilon(1e-12).margin(1e-15));
          REQUIRE(r.elastic[k] == plain.elastic[k]);
          REQUIRE(r.end[k] == r.elastic[k] + r.damper[k]);
          REQUIRE(r.mean[k] - plain.mean[k] ==
                  Approx(r.damper[k] - plain.damper[k]).epsilon(1e-9).margin(1e-12));
          REQUIRE(trial.damper[k] == r.damper[k]);
        }
        // Checks the reported damping, force over velocity, so that damping times velocity gives the force.
        REQUIRE(r.damping == Approx(plain.damping + force / speed).epsilon(1e-12));
        REQUIRE(r.damper_work == Approx(r.damping * speed * speed * tick).epsilon(1e-12));
        REQUIRE(with.batch.strengthening_damping(with.id, load, speed) ==
                Approx(force / speed).epsilon(1e-12));
      }
      // Checks a patch at rest: there is no force, and damping is the limit of force over velocity.
      const Response rest = with.step(0.0, 0.0, 2.0);
      CHECK(rest.damper[0] == 0.0);
      CHECK(rest.damping ==
            Approx(without.step(0.0, 0.0, 2.0).damping + 2.0 * a / (2.0 * slow)).epsilon(1e-12));
      CHECK(with.step(0.0, 0.0, 2.0).damping == rest.damping);
      // A velocity given by the caller replaces displacement over time; out of contact there is no force.
      Motion given{with.id, {1e-9, 0.0}, 2.0};
      given.has_velocity = 1;
      given.velocity[0] = -0.4;
      const double viscous = 2.0 / (1111.111111111111 * 1e-6) * 0.02 * std::exp(-200.0) + 0.3;
      CHECK(with.step(given).damper[0] ==
            Approx(viscous * 0.4 + 2.0 * a * std::asinh(0.4 / (2.0 * slow))).epsilon(1e-12));
      CHECK(with.step(1e-3, 0.0, 0.0).damper[0] == 0.0);
      CHECK(with.step(1e-3, 0.0, 0.0).damping == 0.0);
      CHECK(without.batch.strengthening_damping(without.id, 2.0, 1.0) == 0.0);
      CHECK(with.batch.strengthening_damping(bristle::PatchId{}, 2.0, 1.0) == 0.0);
    }
  }
}

#if BRISTLE_HAS_EIGEN

namespace {

constexpr double mass = 0.1, load = 1.0;

/// A mass on a rail over a patch whose bristles have almost no force, so that all friction comes from
/// strengthening.
struct Glider : RailBody {
  Glider(bool by_midpoint, double v0, double bristle_stiffness = 1e-9)
      : RailBody(by_midpoint, mass, load,
                 Material{}
                     .with_bristle_stiffness(bristle_stiffness)
                     .with_snap_length(uniform)
                     .with_speed_strengthening(a, slow),
                 PatchOptions{}.with_max_normal_load(load).with_bristles(64)) {
    body.velocity[0] = v0;
  }
};

/// Integrates m v' = push - a N asinh(v / (2 v*)), the motion of a body under strengthening alone, by the
/// Runge-Kutta method in thousandths of the tick.
struct Flight {
  double v, x = 0.0;
  void step(double push) {
    constexpr int parts = 1000;
    constexpr double h = tick / parts;
    const auto slope = [&](double u) { return (push - a * load * std::asinh(u / (2.0 * slow))) / mass; };
    for (int i = 0; i < parts; ++i) {
      const double k1 = slope(v), k2 = slope(v + 0.5 * h * k1), k3 = slope(v + 0.5 * h * k2),
                   k4 = slope(v + h * k3);
      const double change = h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
      x += h * (v + 0.5 * change);
      v += change;
    }
  }
};

}  // namespace

TEST_CASE("Strengthening with speed stops a body as its equation of motion says, by either coupling",
          "[strengthening][coupling]") {
  // Strengthening changes the body's speed by 2 mm/s or more per step, far above v* = 3 um/s, so an explicit
  // coupling would overshoot.
  for (const bool midpoint : {false, true}) {
    Glider glider(midpoint, 0.05);
    Flight flight{0.05};
    CAPTURE(midpoint);
    double last = 0.05;
    for (int i = 0; i < 200; ++i) {
      glider.step(0.0);
      if (i < 60) flight.step(0.0);
      const double v = glider.body.velocity[0];
      REQUIRE(std::abs(v) <= last * (1.0 + 1e-12) + 1e-12);
      last = std::abs(v);
    }
    CHECK(std::abs(flight.v) < 1e-6);
    CHECK(glider.x == Approx(flight.x).epsilon(0.03));
    CHECK(last < 1e-9);  // speed in m/s; the body rests and does not swing
  }
}

TEST_CASE("A pushed body reaches the speed at which strengthening holds the push",
          "[strengthening][coupling]") {
  for (const bool midpoint : {false, true}) {
    for (const double push : {0.05, 0.12, 0.18}) {
      Glider glider(midpoint, 0.0);
      for (int i = 0; i < 3000; ++i) glider.step(push);
      CAPTURE(midpoint, push);
      CHECK(glider.body.velocity[0] == Approx(2.0 * slow * std::sinh(push / a)).epsilon(1e-4));
    }
  }
}

TEST_CASE("A body on bristles that strengthen comes to rest, and gains no energy",
          "[strengthening][coupling][energy]") {
  for (const bool midpoint : {false, true}) {
    for (const double stiffness : {0.1, 10.0, 1000.0}) {
      Glider glider(midpoint, 0.1, stiffness);
      const auto energy = [&] {
        return 0.5 * mass * glider.body.velocity[0] * glider.body.velocity[0] + glider.patch.energy();
      };
      double before = energy();
      CAPTURE(midpoint, stiffness);
      for (int i = 0; i < 400; ++i) {
        glider.step(0.0);
        if (midpoint) REQUIRE(energy() <= before + 1e-9);
        before = energy();
      }
      // Expects the low speed at which bent bristles pull the body back against strengthening.
      CHECK(
          glider.body.velocity[0] ==
          Approx(2.0 * slow * std::sinh(glider.response.elastic[0] / (a * load))).epsilon(0.05).margin(1e-9));
      CHECK(std::abs(glider.body.velocity[0]) < 5e-6);
    }
  }
}

TEST_CASE("A plate on four patches that strengthen holds a slope, and slides where the slope is steeper",
          "[strengthening][coupling]") {
  constexpr double weight = 2.5;
  for (const double push : {0.25, 1.5}) {
    bristle::PatchBatch batch;
    std::array<Motion, 4> motions;
    std::array<Response, 4> responses;
    std::array<bristle::BodyContact<6>, 4> feet;
    for (std::size_t i = 0; i < 4; ++i) {
      motions[i].id = batch.add(Material{}.with_speed_strengthening(a, slow),
                                PatchOptions{}.with_max_normal_load(weight).with_bristles(2000).with_seed(
                                    static_cast<std::uint32_t>(i + 1)));
      motions[i].normal_load = weight / 4.0;
      feet[i] = bristle::rigid_contact(i, {i & 1 ? 0.05 : -0.05, i & 2 ? 0.03 : -0.03, 0.0},
                                       Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY());
    }
    batch.warm_up();
    auto plate = bristle::rigid_body(weight / 9.81, Eigen::Vector3d(1e-4, 2e-4, 3e-4).asDiagonal());
    const bristle::BodyVector<6> force = Eigen::Matrix<double, 6, 1>::Unit(0) * push;
    double x = 0.0, at_half = 0.0;
    for (int i = 0; i < 1000; ++i) {
      bristle::predict_displacements<6>(batch, 1e-3, plate, force, feet, motions);
      batch.step(1e-3, motions, responses);
      bristle::apply_end_forces<6>(1e-3, plate, force, feet, responses);
      x += motions[0].displacement[0];
      if (i == 499) at_half = x;
    }
    CAPTURE(push);
    if (push == 0.25) {
      // Below kinetic friction: bent bristles hold the pushed body, which does not slip.
      CHECK(std::abs(x - at_half) < 1e-3 * dbar);
    } else {
      // After a push of one second the body accelerates by the push less kinetic friction and
      // strengthening.
      const double v = plate.velocity[0];
      CHECK(v > 0.05);
      const double acceleration =
          (push - 0.4 * weight - a * weight * std::asinh(0.75 * v / (2.0 * slow))) / (weight / 9.81);
      CHECK(v == Approx(1.0 * acceleration).epsilon(0.1));
    }
  }
}

#endif

}  // namespace bristle_test::test_strengthening
