// The other friction models that bristle is compared with: their steps against closed forms, against an
// independent fine solution of their differential equations, and against the tables of drift.
#include <catch2/catch.hpp>

#include <algorithm>

#include <cmath>
#include <functional>
#include <vector>

#include "expect.hpp"
#include "reference_table.hpp"
#include "tools/libraries/rivals/rival.hpp"

namespace bristle_test::test_rivals {

using rivals::Force;
using rivals::Pair;
using rivals::Rival;
using rivals::Surface;

namespace {

Rival make(std::string_view name, const Surface& surface = {}) { return rivals::make_rival(name, surface); }

// Takes `steps` equal steps along `path` in the time `dt`. Returns the last force and the mean over all
// steps.
Force go(Rival& rival, Pair path, double dt, double load, int steps) {
  Force total;
  const double share = 1.0 / steps;
  for (int k = 0; k < steps; ++k) {
    const Force f = rivals::step(rival, share * path, share * dt, load);
    total.end = f.end;
    total.mean = total.mean + share * f.mean;
  }
  return total;
}

void expect_equal(const Force& a, const Force& b, double tolerance, const char* what) {
  expect_near(a.end.x, b.end.x, tolerance, what);
  expect_near(a.end.y, b.end.y, tolerance, what);
  expect_near(a.mean.x, b.mean.x, tolerance, what);
  expect_near(a.mean.y, b.mean.y, tolerance, what);
}

// A part of the test path, with its time (s). The path goes forwards, back, round corners, slowly and fast.
struct Stretch {
  Pair path;  // m
  double dt;
};
const std::vector<Stretch> crooked = {{{8e-6, 0.0}, 2e-3},    {{7e-6, 3e-6}, 1e-3},  {{-4e-6, 1e-6}, 5e-3},
                                      {{-3e-5, -2e-5}, 1e-2}, {{0.0, 6e-6}, 3e-2},   {{2e-4, 1e-4}, 1e-2},
                                      {{-1e-6, -1e-6}, 1e-1}, {{-6e-6, 2e-6}, 4e-3}, {{5e-5, -5e-5}, 6e-3}};

// Integrates dz/dt = v - alpha |v| z / zss (LuGre and elasto-plastic, one dimension) by the Runge-Kutta
// method. Returns z at the end.
double reference_deflection(double z, double v, double dt, const std::function<double(double)>& alpha,
                            double zss) {
  const auto rate = [&](double q) { return v - alpha(q) * std::fabs(v) * q / zss; };
  const int steps = 20000;
  const double h = dt / steps;
  for (int k = 0; k < steps; ++k) {
    const double a = rate(z), b = rate(z + 0.5 * h * a), c = rate(z + 0.5 * h * b), d = rate(z + h * c);
    z += h / 6.0 * (a + 2.0 * b + 2.0 * c + d);
  }
  return z;
}

}  // namespace

TEST_CASE("Maxwell-slip with elements of its own is their sum", "[rivals]") {
  // Model of parallel elements, of which two have stiffness. Each of their springs is stretched to its own
  // slip length at most.
  rivals::MaxwellSlip model;
  model.surface.kinetic_coefficient = 0.5;
  model.surface.stiffness = 1e5;
  model.stiffness_share.fill(0.0);
  model.stiffness_share[2] = 0.3;
  model.stiffness_share[7] = 0.2;
  model.slip_length[2] = 0.4;
  model.slip_length[7] = 3.0;
  // Unit of the slip lengths of the elements, m: mu N / sigma0.
  const double unit = 0.5 * 2.0 / 1e5;
  double a = 0.0, b = 0.0;
  for (const double path : {0.3, 0.3, 4.0, -0.5, -1.0, 0.2}) {
    const double force = model.step({path * unit, 0.0}, 1e-3, 2.0).end.x;
    a = std::clamp(a + path, -0.4, 0.4);
    b = std::clamp(b + path, -3.0, 3.0);
    CHECK(force == Approx(-1e5 * unit * (0.3 * a + 0.2 * b)).margin(1e-12));
  }
}

TEST_CASE("A rival's step is the same in one piece or in a thousand", "[rivals]") {
  // Tolerances of the models' forces, N. Exact steps agree to rounding, 1e-12 of the force for each.
  // Elasto-plastic holds its plasticity constant over pieces of up to a 16th of the steady deflection (1 N):
  // an error of at most (1/16)^3 for each piece. Errors decay, so some ten pieces count.
  for (const std::string_view name : rivals::rival_names) {
    INFO(name);
    // Tolerance of rate-and-state friction: each of some hundred pieces of a stretch is integrated to 1e-7 of
    // its direct effect, 0.05 N.
    const double tolerance = name == "elasto_plastic" ? 2.5e-3 : name == "rate_state" ? 1e-7 : 1e-9;
    Rival coarse = make(name), fine = make(name);
    for (const Stretch& s : crooked) {
      expect_equal(go(coarse, s.path, s.dt, 2.5, 1), go(fine, s.path, s.dt, 2.5, 1000), tolerance, "force");
    }
  }
}

TEST_CASE("Rivals in the plane turn with the axes, and along one axis they are the one-dimensional models",
          "[rivals]") {
  const double c = std::cos(0.7), s = std::sin(0.7);
  const auto turned = [&](Pair a) { return Pair{c * a.x - s * a.y, s * a.x + c * a.y}; };
  for (const std::string_view name : rivals::rival_names) {
    INFO(name);
    Rival straight = make(name), aslant = make(name);
    for (const Stretch& stretch : crooked) {
      const Force a = go(straight, stretch.path, stretch.dt, 2.5, 1);
      const Force b = go(aslant, turned(stretch.path), stretch.dt, 2.5, 1);
      expect_equal({turned(a.end), turned(a.mean)}, b, 1e-9, "turned force");
    }
  }
}

TEST_CASE("LuGre and elasto-plastic follow their differential equations", "[rivals]") {
  const Surface s;
  const double load = 2.5;
  for (const bool plastic : {false, true}) {
    INFO((plastic ? "elasto-plastic" : "LuGre"));
    Rival rival = make(plastic ? "elasto_plastic" : "lugre");
    double z = 0.0;
    for (const double v : {2e-3, 5e-4, -1e-3, -4e-3, 3e-4, 0.02, -1e-4}) {
      const double dt = 4e-6 / std::fabs(v) + 1e-3;
      const double u = v / 1e-3;
      // Steady deflection for kinetic friction of 1 N and static friction of 1.5 N.
      const double zss = (1.0 + 0.5 * std::exp(-u * u)) / 1e5;
      const double zba = std::min(0.9 * 1.5e-5, 0.99 * zss);
      const auto alpha = [&](double q) {
        if (!plastic) return 1.0;
        if (q * v < 0.0 || std::fabs(q) <= zba) return 0.0;
        if (std::fabs(q) >= zss) return 1.0;
        return 0.5 + 0.5 * std::sin(M_PI * (std::fabs(q) - 0.5 * (zss + zba)) / (zss - zba));
      };
      const double before = z;
      z = reference_deflection(z, v, dt, alpha, zss);
      const Force f = go(rival, {v * dt, 0.0}, dt, load, 1);
      const double rate = v - alpha(z) * std::fabs(v) * z / zss;
      // Tolerance: the reference has an error where the elasto-plastic alpha has a kink, in steps of 1/20000
      // of the path. Elasto-plastic has the error of its pieces too.
      const double tolerance = plastic ? 3e-3 : 1e-8;
      expect_near(-f.end.x, 1e5 * z + s.damping * rate + 0.4 * v, tolerance, "end force");
      // Expected mean force: the mean of dz/dt in a step is (z1 - z0)/dt, for z from z0 to z1. Where the
      // equation is linear, its integral gives the mean of z: zss/|v| (v - (z1 - z0)/dt).
      if (!plastic) {
        const double mean = zss / std::fabs(v) * (v - (z - before) / dt);
        expect_near(-f.mean.x, 1e5 * mean + s.damping * (z - before) / dt + 0.4 * v, 1e-7, "mean force");
      }
    }
  }
}

// The deflection z obeys dz/dt = a z + v, with a = -stiffness |v| / g(v) constant over a step h, so the step
// ends at z' = e^(a h) z + (e^(a h) - 1) / a v. MuJoCo's torque is -(stiffness z + damping dz/dt) at the
// beginning of the step, without a viscous part.
TEST_CASE("LuGre takes the step that MuJoCo 3.7 documents for its dcmotor", "[rivals]") {
  Surface joint;
  joint.kinetic_coefficient = 0.5;
  joint.static_coefficient = 0.7;
  joint.stiffness = 100.0;
  joint.damping = 1.0;
  joint.viscous_friction = 0.0;
  joint.stribeck_velocity = 10.0;
  rivals::LuGre ours{joint, {}};
  double z = 0.0;
  const double h = 2e-3;
  for (const double v : {1e-3, 0.3, -2.0, 20.0, 0.0, -0.05}) {
    const double g = 0.5 + 0.2 * std::exp(-(v / 10.0) * (v / 10.0)), a = -100.0 * std::abs(v) / g;
    const double begins = -(100.0 * z + 1.0 * (a * z + v));
    // Takes a step of almost no length, which ends with the torque at the beginning of MuJoCo's step.
    rivals::LuGre at_once = ours;
    expect_near(at_once.step({v * 1e-12, 0.0}, 1e-12, 1.0).end.x, begins, 1e-6, "torque");
    z = v == 0.0 ? z : std::exp(a * h) * z + (std::exp(a * h) - 1.0) / a * v;
    ours.step({v * h, 0.0}, h, 1.0);
    expect_near(ours.z.x, z, 1e-14, "deflection");
  }
}

TEST_CASE("In steady sliding each rival has the friction of its formula", "[rivals]") {
  for (const double v : {1e-5, 3e-4, 1e-3, 2e-3, 0.01, 1.0}) {
    for (const std::string_view name : rivals::rival_names) {
      INFO(name << " at " << v << " m/s");
      Rival rival = make(name);
      const double u = v / 1e-3;
      double expected = 1.0;  // expected friction, N: 0.4 times 2.5 N
      if (name == "lugre" || name == "elasto_plastic" || name == "gms") expected += 0.5 * std::exp(-u * u);
      if (name == "rate_state") {
        // Steady friction is mu0 + (a - b) ln(v/v0) with a = 0.02, b = 0.04, v0 = 1 mm/s. The library's asinh
        // changes it by (v0/v)^2 exp(-40) only.
        expected += 2.5 * (0.02 - 0.04) * std::log(u);
      } else if (name != "dahl" && name != "maxwell_slip") {
        expected += 0.4 * v;
      }
      // Slides 100 steady deflections, or for 100 times GMS's attraction time, to the steady state.
      const double dt = std::max(1e-3 / v, 0.5);
      const Force f = go(rival, {v * dt, 0.0}, dt, 2.5, 20);
      expect_near(-f.end.x, expected, 1e-9, "steady friction");
    }
  }
}

TEST_CASE("Rivals hold at 1 kHz at any speed, where explicit Euler would not", "[rivals]") {
  // At 10 m/s a step is a thousand steady deflections of LuGre; explicit Euler would allow less than two.
  for (const std::string_view name : rivals::rival_names) {
    INFO(name);
    Rival rival = make(name);
    for (int k = 0; k < 2000; ++k) {
      const double v = 10.0 * std::sin(0.7 * k) * std::pow(10.0, -6.0 * (k % 7) / 6.0);
      const Force f = rivals::step(rival, {v * 1e-3, 0.3 * v * 1e-3}, 1e-3, 2.5);
      // Bound on the force, N: static friction, viscous friction, and the damper of a bristle whose stretch
      // changes in a step by at most twice its largest value of 1.5e-5 m.
      const double most = 1.5 + 0.4 * 10.5 + 316.3 * 2.0 * 1.5e-5 / 1e-3;
      expect(rivals::length(f.mean) <= most, "the mean force is bounded");
      expect(std::isfinite(f.end.x) && std::isfinite(f.end.y), "the force is finite");
    }
  }
}

TEST_CASE("Rate and state follows the published tables of an open solver", "[rivals]") {
  // Expected values from the tests of rsfmodel (John Leeman, MIT License, commit d04d546, tests/rsf_tests.py,
  // TestDeiterichOneStateVar): mu0 0.6, a 0.005, b 0.01, Dc 10 um, stiffness 1e-3 / um, steady sliding at 1
  // um/s. From 10 s on the load point moves at 10 um/s. The tables have friction and state at 11, 12, ... s
  // in eight digits. rsfmodel has a logarithm where the library has asinh, which differ by exp(-2 mu/a) =
  // 1e-104.
  const double friction[] = {0.60720485, 0.60186637, 0.5840091,  0.58563096, 0.58899543,
                             0.58998186, 0.58879751, 0.58803412, 0.58825653, 0.58858313,
                             0.58860319, 0.58848625, 0.58844431, 0.58847472, 0.58849913};
  const double state[] = {8.39993716, 2.2355129,  0.54248237, 0.94936884, 1.21163659,
                          1.13491241, 0.96889358, 0.94896281, 0.99777122, 1.01876822,
                          1.00674821, 0.99515136, 0.9961297,  1.00063816, 1.00161995};
  for (const Pair direction : {Pair{1.0, 0.0}, Pair{0.6, -0.8}}) {
    rivals::RateState model;  // lengths in um, load 1 N
    model.surface.kinetic_coefficient = 0.6;
    model.surface.stiffness = 1e-3;
    model.direct_effect = 0.005;
    model.state_effect = 0.01;
    model.state_length = 10.0;
    model.reference_speed = 1.0;
    model.z = 600.0 * direction;
    const auto along = [&](Pair f) { return -dot(f, direction); };
    for (int k = 1; k <= 10; ++k) {
      expect_near(along(model.step(1.0 * direction, 1.0, 1.0).end), 0.6, 1e-9, "steady friction");
    }
    for (int k = 0; k < 15; ++k) {
      INFO("after " << 11 + k << " s");
      const Force f = model.step(10.0 * direction, 1.0, 1.0);
      // Tolerance: one unit of the tables' last digit, 1e-8. The model integrates friction over load to 1e-7
      // of a, and psi to 1e-7. Both together say the speed of the slider.
      CHECK(std::abs(along(f.end) - friction[k]) < 1e-8);
      CHECK(std::abs(10.0 * std::exp(model.psi) - state[k]) < 1e-6);
    }
  }
}

TEST_CASE("Rate and state: the direct effect, the state's exponential over its length, and the slope between",
          "[rivals]") {
  // Here the slider's spring is so stiff that the slider moves as the body does.
  const double n = 2.5, a = 0.012, b = 0.03, dc = 1e-5, v0 = 1e-4, mu0 = 0.4;
  const auto steady = [&](double v) {
    rivals::RateState model;
    model.surface.kinetic_coefficient = mu0;
    model.surface.stiffness = 1e10;
    model.direct_effect = a;
    model.state_effect = b;
    model.state_length = dc;
    model.reference_speed = v0;
    model.z = {mu0 * n / model.surface.stiffness, 0.0};
    for (int k = 0; k < 40; ++k) model.step({dc, 0.0}, dc / v, n);
    return model;
  };
  for (const double v : {1e-6, 1e-4, 1e-2}) {
    INFO(v << " m/s");
    rivals::RateState model = steady(v);
    const double before = model.surface.stiffness * model.z.x / n;
    CHECK(before == Approx(mu0 + (a - b) * std::log(v / v0)).margin(1e-9));
    // Jumps in speed by a factor of 10. The step is 1e-4 Dc long: enough for the spring to follow, which
    // takes some a N / sigma0 = 3e-12 m, while the state decays by no more than 1e-4.
    const double ratio = 10.0;
    rivals::RateState fast = model;
    const double at_once = -fast.step({1e-4 * dc, 0.0}, 1e-4 * dc / (ratio * v), n).end.x / n - before;
    CHECK(at_once == Approx(a * std::log(ratio)).margin(2.0 * b * ratio * 1e-4));
    // Changes the speed a little, from v to v'. Over the path x the state theta moves from Dc/v to Dc/v' as
    // exp(-x / Dc), and friction follows its logarithm.
    rivals::RateState little = model;
    const double e = 0.01, x = 0.7 * dc;
    const double after = -little.step({x, 0.0}, x / ((1.0 + e) * v), n).end.x / n - before;
    const double theta = 1.0 + e * std::exp(-x / dc);  // state over its final value
    CHECK(after == Approx((a - b) * std::log(1.0 + e) + b * std::log(theta)).margin(1e-8));
    CHECK(little.psi == Approx(std::log(v0 / v / (1.0 + e) * theta)).margin(1e-7));
  }
  // Holds at rest: the slider hardly creeps, so theta grows by the time t, and psi = ln(v0 (theta + t) / Dc).
  rivals::RateState held = steady(1e-4);
  held.z = {0.5 * held.z.x, 0.0};
  held.step({}, 100.0, n);
  CHECK(held.psi == Approx(std::log(v0 / dc * (dc / 1e-4 + 100.0))).margin(1e-6));
  // Backward motion mirrors forward motion, as by the asinh form.
  rivals::RateState there = held, back = held;
  back.z = -there.z;
  const Force f = there.step({3e-6, 0.0}, 0.1, n), g = back.step({-3e-6, 0.0}, 0.1, n);
  CHECK(f.end.x == -g.end.x);
  CHECK(f.mean.x == -g.mean.x);
}

TEST_CASE("A rate-and-state slider sticks and slips below the critical stiffness (b - a) N / Dc",
          "[rivals]") {
  // Pulls the slider's spring at constant speed (Ruina 1983), and measures whether a small disturbance grows
  // or decays.
  for (const double over : {0.9, 1.1}) {
    INFO("stiffness over the critical one: " << over);
    rivals::RateState model;  // critical stiffness 2500 N/m: a 0.02, b 0.04, Dc 20 um, load 2.5 N
    model.surface.stiffness = over * (0.04 - 0.02) * 2.5 / 2e-5;
    model.z = {(1.0 + 0.0005) / model.surface.stiffness, 0.0};
    // Largest deviation of the force from 1 N, among early and among late steps, N.
    double early = 0.0, late = 0.0;
    for (int k = 0; k < 4000; ++k) {
      const double f = -model.step({1e-6, 0.0}, 1e-3, 2.5).end.x;
      if (k < 1000) early = std::max(early, std::fabs(f - 1.0));
      if (k >= 1500 && k < 2500) late = std::max(late, std::fabs(f - 1.0));
    }
    // Linear theory: the swing changes by half the relative excess of stiffness per radian, and by more than
    // 1.5 in all here.
    CHECK((over < 1.0 ? late > 1.5 * early : late < early / 1.5));
  }
}

TEST_CASE("A load that falls lets rate and state slip at once, and no load is too small", "[rivals]") {
  rivals::RateState model;
  for (int k = 0; k < 100; ++k) model.step({1e-6, 0.0}, 1e-3, 2.5);
  for (const double load : {0.25, 1e-3, 1e-9}) {
    INFO(load << " N");
    const Force f = model.step({}, 1e-3, load);
    CHECK(-f.end.x > 0.0);
    // In 1 ms the spring unloads to the friction at the slider's own speed of creep, below the load.
    CHECK(-f.end.x < 1.0 * load);
  }
}

TEST_CASE("Dahl's first pull is an exponential, Maxwell-slip's a chain of straight lines", "[rivals]") {
  Rival dahl = make("dahl"), maxwell = make("maxwell_slip");
  for (int k = 1; k <= 100; ++k) {
    const double x = 3e-7 * k;
    const Force d = rivals::step(dahl, {3e-7, 0.0}, 1e-3, 2.5);
    const Force m = rivals::step(maxwell, {3e-7, 0.0}, 1e-3, 2.5);
    expect_near(-d.end.x, -std::expm1(-x / 1e-5), 1e-12, "Dahl");
    double sum = 0.0;
    for (int i = 0; i < 10; ++i) sum += 1e4 * std::min(x, 2e-5 * (i + 0.5) / 10);
    expect_near(-m.end.x, sum, 1e-12, "Maxwell-slip");
  }
}

TEST_CASE("Maxwell-slip drags its blocks along tractrices", "[rivals]") {
  // Stretches all springs along x, then pulls them along y: the angle a of the slipping ones obeys tan(a/2) =
  // exp(-y/D), from 90 degrees.
  Rival rival = make("maxwell_slip");
  rivals::step(rival, {1e-3, 0.0}, 1.0, 2.5);
  double y = 0.0;
  for (const double dy : {1e-6, 3e-6, 2e-6, 1e-5}) {
    y += dy;
    const Force f = rivals::step(rival, {0.0, dy}, 1e-3, 2.5);
    double fx = 0.0, fy = 0.0;
    for (int i = 0; i < 10; ++i) {
      const double limit = 2e-5 * (i + 0.5) / 10, t = std::exp(-y / limit);
      fy += 1e4 * limit * (1.0 - t * t) / (1.0 + t * t);
      fx += 1e4 * limit * 2.0 * t / (1.0 + t * t);
    }
    expect_near(-f.end.x, fx, 1e-11, "across");
    expect_near(-f.end.y, fy, 1e-11, "along");
  }
}

TEST_CASE("LuGre and Dahl drift under a wavering force by the amount of the table, elasto-plastic does not",
          "[rivals]") {
  // Moves the body quasi-statically until the elastic part carries the given force; displacements by
  // bisection.
  Surface surface;
  surface.damping = 0.0;
  surface.viscous_friction = 0.0;
  const auto drift = [&](std::string_view name, double low, double high) {
    Rival rival = make(name, surface);
    const double slow = 1e-9;  // speed (m/s) so slow that friction is static
    const auto move_to_force = [&](double force) {
      const double now = -rivals::find_force(rival, {}, 1.0, 2.5).end.x;
      const double sign = force > now ? 1.0 : -1.0;
      double shortest = 0.0, longest = 1e-3;
      for (int k = 0; k < 200; ++k) {
        const double path = 0.5 * (shortest + longest);
        const double f = -rivals::find_force(rival, {sign * path, 0.0}, path / slow, 2.5).end.x;
        (sign * (f - force) < 0.0 ? shortest : longest) = path;
      }
      rivals::step(rival, {sign * shortest, 0.0}, shortest / slow, 2.5);
      return sign * shortest;
    };
    move_to_force(high);
    const double back = move_to_force(low);
    return back + move_to_force(high);
  };
  for (const Row& row : read_table("drift_lugre.csv")) {
    const double low = number(row, "Fmin_N"), high = number(row, "Fmax_N");
    INFO(low << " to " << high << " N");
    // Tolerance: the table has a dozen digits, and 1e-9 m/s lowers the static force by a relative 1e-12.
    const double lugre = number(row, "lugre_drift_per_cycle_formula_m");
    CHECK(std::abs(drift("lugre", low, high) - lugre) <= 1e-9 * 1e-5 + 1e-10 * std::abs(lugre));
    if (row.at("dahl_drift_formula_Fc_m") != "slides" && high < 1.0) {
      const double dahl = number(row, "dahl_drift_formula_Fc_m");
      CHECK(std::abs(drift("dahl", low, high) - dahl) <= 1e-9 * 1e-5 + 1e-10 * std::abs(dahl));
    }
    CHECK(std::abs(drift("elasto_plastic", low, high)) < 1e-15);
    if (high < 1.0) {
      // The Maxwell-slip model closes every cycle after the first, so it does not drift.
      CHECK(std::abs(drift("maxwell_slip", low, high)) < 1e-15);
    }
  }
}

TEST_CASE("A trial step leaves a rival as it was, and without load there is neither force nor memory",
          "[rivals]") {
  for (const std::string_view name : rivals::rival_names) {
    INFO(name);
    Rival rival = make(name), fresh = make(name);
    go(rival, {3e-6, 2e-6}, 1e-3, 2.5, 3);
    const Force trial = rivals::find_force(rival, {5e-6, 0.0}, 1e-3, 2.5);
    expect_equal(rivals::find_force(rival, {5e-6, 0.0}, 1e-3, 2.5), trial, 0.0, "second trial");
    expect_equal(rivals::step(rival, {5e-6, 0.0}, 1e-3, 2.5), trial, 0.0, "step after trials");
    expect_equal(rivals::step(rival, {1e-6, 0.0}, 1e-3, 0.0), {}, 0.0, "force without load");
    expect_equal(rivals::step(rival, {1e-6, 0.0}, 1e-3, 2.5), rivals::step(fresh, {1e-6, 0.0}, 1e-3, 2.5),
                 0.0, "force after contact was lost");
  }
  CHECK_THROWS_WITH(rivals::make_rival("karnopp", {}), Catch::Matchers::Contains("karnopp"));
}

}  // namespace bristle_test::test_rivals
