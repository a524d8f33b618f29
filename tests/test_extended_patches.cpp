// Extended patches: moments of their cells against closed forms, torque and force against the tables of
// tests/data, energy; and a point gives the results of a plain patch.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "expect.hpp"
#include "infinite_brush.hpp"
#include "reference_table.hpp"
#include "scenes.hpp"
#include "statistics.hpp"
#include "variants.hpp"

namespace bristle_test::test_extended_patches {

using bristle::ExtendedMotion;
using bristle::ExtendedPatches;
using bristle::ExtendedResponse;
using bristle::Outline;
using bristle::PatchCell;
using bristle::Population;
using bristle::Pressure;

namespace {

constexpr double pi = 3.14159265358979323846;
const SnapLength smooth = SnapLength::lognormal(dbar, 0.3);

/// Returns the moment sum(weight x^i y^j) of an outline's cells.
double moment(const Outline& outline, int i, int j) {
  double sum = 0.0;
  for (const PatchCell& cell : outline.cells)
    sum += cell.weight * std::pow(cell.position[0], i) * std::pow(cell.position[1], j);
  return sum;
}

/// Returns the mean of cos^i sin^j over the circle of directions, in closed form.
double circle_mean(int i, int j) {
  if (i % 2 != 0 || j % 2 != 0) return 0.0;
  return std::tgamma((i + 1) / 2.0) * std::tgamma((j + 1) / 2.0) / (pi * std::tgamma((i + j) / 2.0 + 1.0));
}
/// Returns the load-weighted mean of r^k over a disc of radius 1, in closed form.
double radial_mean(Pressure pressure, int k) {
  if (pressure == Pressure::uniform) return 2.0 / (k + 2);
  return 1.5 * std::tgamma(k / 2.0 + 1.0) * std::tgamma(1.5) / std::tgamma(k / 2.0 + 2.5);
}
/// Returns the load-weighted mean of x^k over -1 to 1, in closed form.
double line_mean(Pressure pressure, int k) {
  if (k % 2 != 0) return 0.0;
  if (pressure == Pressure::uniform) return 1.0 / (k + 1);
  return std::tgamma((k + 1) / 2.0) * 2.0 / (std::sqrt(pi) * std::tgamma(k / 2.0 + 2.0)) / 2.0 * 1.0;
}

/// One extended patch in a batch of its own, which checks the energy of every step.
struct Pad {
  Pad(const Material& material, const PatchOptions& options, const Outline& outline, double its_load)
      : pads(batch), id(pads.add(material, options, outline)), load(its_load) {}

  const ExtendedResponse& step(double dx, double dy, double spin, double seconds = tick) {
    const ExtendedMotion motion{id, {dx, dy, spin}, load};
    const double before = pads.stored_energy(id);
    pads.step(seconds, {&motion, 1}, {&response, 1});
    const double after = pads.stored_energy(id);
    const double work = -(response.mean[0] * dx + response.mean[1] * dy + response.mean[2] * spin);
    const double error =
        work - (after - before) - response.dissipated - response.contact_loss - response.damper_work;
    imbalance = std::max(imbalance, std::abs(error) / (std::abs(work) + before + after + 1e-30));
    return response;
  }

  PatchBatch batch;
  ExtendedPatches pads;
  PatchId id;
  double load;
  ExtendedResponse response;
  double imbalance = 0.0;
};

Pressure pressure_named(const std::string& name) {
  return name == "hertz" ? Pressure::hertz : Pressure::uniform;
}

PatchOptions contact_of(Population population, std::uint32_t bristles) {
  PatchOptions options = infinite_options(8.0);
  if (population == Population::representatives)
    options.with_population(population).with_bristles(bristles).with_precision(precisions().back());
  return options;
}

/// Errors of a slide with spin against a row of the limit surface, each over the largest value of its column.
struct LimitError {
  double force = 0.0, side = 0.0, torque = 0.0, imbalance = 0.0;
};
LimitError limit_error(const Row& row, int rings, double snap_over_radius, const PatchOptions& options) {
  const Pressure pressure = pressure_named(row.at("pressure"));
  const double radius = dbar / snap_over_radius, ratio = number(row, "v_over_omegaR");
  Pad pad(plain_material(smooth, SnapRule::redraw), options, Outline::disc(radius, pressure, rings), load_n);
  // Chooses the spin for which the rim moves by a mean snap length per step, and so many steps that all but a
  // few cells have snapped often.
  const double spin = snap_over_radius / (1.0 + ratio);
  const int steps = static_cast<int>(std::ceil((ratio > 1.0 ? 40.0 : 100.0 + 100.0 * ratio)));
  const double coulomb = load_n * kinetic(smooth) * dbar;
  LimitError error;
  for (int i = 0; i < steps; ++i) {
    pad.step(ratio * radius * spin * 0.6, ratio * radius * spin * 0.8, spin);
    if (i < steps - 12) continue;
    const double(&f)[3] = pad.response.mean;
    const double along = -(0.6 * f[0] + 0.8 * f[1]) / coulomb, aside = (0.8 * f[0] - 0.6 * f[1]) / coulomb;
    const double full = pressure == Pressure::uniform ? 2.0 / 3.0 : 3.0 * pi / 16.0;
    error.force = std::max(error.force, std::abs(along - number(row, "F_over_muN")));
    error.side = std::max(error.side, std::abs(aside));
    error.torque =
        std::max(error.torque, std::abs(-f[2] / (coulomb * radius) - number(row, "T_over_muNR")) / full);
  }
  error.imbalance = pad.imbalance;
  return error;
}

}  // namespace

TEST_CASE("Cells of a disc give the moments of its pressure", "[extended]") {
  for (Pressure pressure : {Pressure::uniform, Pressure::hertz}) {
    for (int rings : {1, 2, 3, 5, 8, 16}) {
      const Outline outline = Outline::ellipse(2.0, 0.5, pressure, rings);
      CHECK(outline.cells.size() == static_cast<std::size_t>(rings == 1 ? 4 : 3 * rings * rings));
      for (int i = 0; i < 2 * rings; ++i) {
        for (int j = 0; i + j < 2 * rings; ++j) {
          INFO(rings << " rings, x^" << i << " y^" << j);
          const double exact =
              std::pow(2.0, i) * std::pow(0.5, j) * radial_mean(pressure, i + j) * circle_mean(i, j);
          expect_near(moment(outline, i, j), exact, 1e-13 * std::pow(2.0, i), "moment");
        }
      }
    }
  }
}

TEST_CASE("Cells of a rectangle give the moments of its pressure", "[extended]") {
  for (Pressure pressure : {Pressure::uniform, Pressure::hertz}) {
    for (int nx : {1, 2, 5, 9}) {
      const int ny = nx == 5 ? 3 : nx;
      const Outline outline = Outline::rectangle(0.3, 0.7, pressure, nx, ny);
      REQUIRE(outline.cells.size() == static_cast<std::size_t>(nx * ny));
      for (int i = 0; i < 2 * nx; ++i) {
        for (int j = 0; j < 2 * ny; ++j) {
          INFO(nx << " by " << ny << " cells, x^" << i << " y^" << j);
          const double exact =
              std::pow(0.3, i) * std::pow(0.7, j) * line_mean(pressure, i) * line_mean(Pressure::uniform, j);
          expect_near(moment(outline, i, j), exact, 1e-14, "moment");
        }
      }
    }
  }
}

TEST_CASE("Weights of every outline sum to one, and a size of zero is a point", "[extended]") {
  for (const Outline& outline :
       {Outline::disc(0.0, Pressure::hertz, 7), Outline::rectangle(0.0, 0.0, Pressure::uniform)}) {
    REQUIRE(outline.cells.size() == 1);
    CHECK(outline.cells[0].weight == 1.0);
    CHECK(outline.cells[0].position[0] == 0.0);
    CHECK(outline.cells[0].position[1] == 0.0);
  }
  for (int rings : {1, 4, 13, 64})
    CHECK(moment(Outline::disc(1.0, Pressure::hertz, rings), 0, 0) == Approx(1.0).epsilon(1e-12));
  // Cells of a rectangle of no width are on a line.
  CHECK(Outline::rectangle(0.1, 0.0, Pressure::uniform, 4, 1).cells.size() == 4);
}

TEST_CASE("Outlines that cannot be are refused by name", "[extended]") {
  CHECK(names(message_of([] { Outline::disc(-1.0, Pressure::uniform); }), {"half_x_m = -1", "0 to 1000 m"}));
  CHECK(names(message_of([] { Outline::disc(1.0, Pressure::uniform, 0); }), {"rings = 0", "1 to 64"}));
  CHECK(names(message_of([] { Outline::disc(1.0, Pressure::uniform, 3, 2); }), {"around = 2", "3 to 256"}));
  CHECK(names(message_of([] { Outline::rectangle(1.0, NAN, Pressure::uniform); }), {"half_y_m = nan"}));
  CHECK(names(message_of([] { Outline::rectangle(1.0, 1.0, Pressure::uniform, 65); }), {"nx = 65"}));

  PatchBatch batch;
  ExtendedPatches pads(batch);
  const Material material = plain_material(uniform, SnapRule::redraw);
  const auto add = [&](const Outline& outline, PatchOptions options = {}) {
    return message_of([&] { pads.add(material, options.with_bristles(100), outline); });
  };
  Outline outline = Outline::disc(1e-3, Pressure::uniform, 2);
  outline.cells[3].weight *= 0.5;
  CHECK(names(add(outline), {"sum of weights", "divide each by their sum"}));
  outline = Outline::disc(1e-3, Pressure::uniform, 2);
  outline.cells[0].weight += 1e-6;
  CHECK(names(add(outline), {"sum of weights"}));
  outline = Outline::disc(1e-3, Pressure::uniform, 2);
  outline.cells[3].weight = -outline.cells[3].weight;
  CHECK(names(add(outline), {"weight = -"}));
  outline = Outline::disc(1e-3, Pressure::uniform, 2);
  outline.cells[3].position[1] = INFINITY;
  CHECK(names(add(outline), {"position = inf"}));
  outline.cells.clear();
  CHECK(names(add(outline), {"cells = 0"}));
  CHECK(
      names(add(Outline::disc(1e-3, Pressure::uniform), PatchOptions{}.with_axes(1)), {"axes = 1", "2 for"}));
  CHECK(names(add(Outline::disc(1e-3, Pressure::uniform).grow_with_load(-1.0)), {"full_size_load = -1"}));
  // Checks that an outline's cells are removed if the batch refuses its last cell.
  CHECK(add(Outline::disc(1e-3, Pressure::uniform), PatchOptions{}.with_max_normal_load(-1.0)) !=
        "(no error)");
  batch.warm_up();
  CHECK(batch.patch_count() == 0);
  CHECK(pads.patch_count() == 0);
  CHECK(names(message_of([&] { pads.remove(PatchId{77}); }), {"no patch with id 77"}));
}

TEST_CASE("Bristles that stick resist a turn with K R^2/2, under Hertz's pressure with 2 K a^2/5",
          "[extended]") {
  const double radius = 4e-3;
  for (Population population : {Population::infinite, Population::representatives}) {
    for (Pressure pressure : {Pressure::uniform, Pressure::hertz}) {
      INFO((pressure == Pressure::hertz ? "Hertz, " : "uniform, ") << static_cast<int>(population));
      // Cells get whole numbers of representatives, so each must bring the right share of them into contact
      // under a part of the load.
      Pad pad(plain_material(SnapLength::uniform(0.5 * dbar, 1.5 * dbar), SnapRule::redraw),
              contact_of(population, 100000), Outline::disc(radius, pressure, 2), load_n);
      const double stiffness = load_n;  // N/m
      const double against_spin = stiffness * radius * radius * (pressure == Pressure::hertz ? 0.4 : 0.5);
      const double spin = 1e-3 * dbar / radius;
      const ExtendedResponse first = pad.step(0.0, 0.0, spin);
      CHECK(first.elastic[2] == Approx(-against_spin * spin).epsilon(1e-6));
      CHECK(first.stiffness[2][2] == Approx(against_spin).epsilon(1e-6));
      CHECK(first.stiffness[0][0] == Approx(stiffness).epsilon(1e-9));
      expect_near(first.elastic[0], 0.0, 1e-9 * stiffness * radius * spin, "force of a pure turn");
      pad.step(1e-3 * dbar, -2e-3 * dbar, 0.0);
      CHECK(pad.response.elastic[0] == Approx(-1e-3 * dbar * stiffness).epsilon(1e-6));
      CHECK(pad.response.elastic[1] == Approx(2e-3 * dbar * stiffness).epsilon(1e-6));
    }
  }
}

TEST_CASE("A patch without extent is the patch of before, to the bit", "[extended][determinism]") {
  std::vector<PatchCase> cases;
  add_infinite_variants(cases);
  cases.resize(std::min<std::size_t>(cases.size(), 40));
  for (int axes : {1, 2})
    for (SnapRule rule : {SnapRule::keep, SnapRule::redraw})
      cases.push_back({"representatives", plain_material(smooth, rule), plain_material(uniform, rule),
                       plain_options(300, axes).with_seed(9)});
  for (const PatchCase& c : cases) {
    INFO(c.name);
    PatchBatch points, batch;
    ExtendedPatches pads(batch);
    const PatchId point = points.add(c.material, c.options);
    const PatchId pad = pads.add(c.material, c.options, Outline::disc(0.0, Pressure::uniform));
    for (int k = 0; k < 60; ++k) {
      if (k == 30) {
        points.set_material(point, c.later);
        pads.set_material(pad, c.later);
      }
      Motion motion = scripted_motion(3, k, c.options.axes);
      motion.id = point;
      ExtendedMotion turned;
      turned.id = pad;
      turned.displacement[0] = motion.displacement[0];
      turned.displacement[1] = motion.displacement[1];
      turned.displacement[2] = 0.3 * std::sin(k);
      turned.has_velocity = motion.has_velocity;
      turned.velocity[0] = motion.velocity[0];
      turned.velocity[1] = motion.velocity[1];
      turned.velocity[2] = 7.0;
      turned.normal_load = motion.normal_load;
      Response a;
      ExtendedResponse b;
      points.step(tick, {&motion, 1}, {&a, 1});
      pads.step(tick, {&turned, 1}, {&b, 1});
      for (int d = 0; d < 2; ++d) {
        expect(std::memcmp(&a.end[d], &b.end[d], 8) == 0 || a.end[d] == b.end[d], "end force");
        expect(a.mean[d] == b.mean[d] && a.damper[d] == b.damper[d], "mean and damper");
      }
      expect(b.end[2] == 0.0 && b.mean[2] == 0.0, "no torque");
      expect(a.dissipated == b.dissipated && a.snaps == b.snaps && a.status == b.status, "energy and status");
      expect(a.stiffness == b.stiffness[0][0] && b.stiffness[2][2] == 0.0, "stiffness");
    }
    CHECK(points.state_hash(point) == pads.state_hash(pad));
  }
}

TEST_CASE("A disc that slides and spins has the force and torque of the limit surface",
          "[extended][physics]") {
  // Outlines of 192 cells, bristles of 1/100 of the radius. Measured errors: 0.4 % (uniform), 0.48 % (Hertz).
  for (const Row& row : read_table("spin_limit.csv")) {
    INFO(row.at("pressure") << ", v / (omega R) = " << row.at("v_over_omegaR"));
    const LimitError error = limit_error(row, 8, 0.01, contact_of(Population::infinite, 0));
    expect_near(error.force, 0.0, 0.005, "error of the force");
    expect_near(error.torque, 0.0, 0.005, "error of the torque");
    // Tolerance: bristles lag behind their cell's direction, which turns, so they have a force across it of
    // the order of delta / R.
    expect_near(error.side, 0.0, 0.015, "force across the motion");
    expect_near(error.imbalance, 0.0, 1e-12, "energy");
  }
}

TEST_CASE("The error on the limit surface falls with the area of a cell", "[extended][physics]") {
  const std::vector<Row> rows = read_table("spin_limit.csv");
  const auto worst = [&](int rings) {
    double error = 0.0;
    for (const Row& row : rows) {
      if (row.at("pressure") != "uniform") continue;
      const LimitError e = limit_error(row, rings, 0.01, contact_of(Population::infinite, 0));
      error = std::max({error, e.force, e.torque});
    }
    return error;
  };
  const double few = worst(2), more = worst(4), many = worst(8);
  CHECK(few < 0.15);
  CHECK(more < 0.25 * few);  // error of four times as many cells, of second order
  CHECK(many < 0.07 * few);  // error of sixteen times as many cells
}

TEST_CASE("A disc turned from rest has the torque of the virgin curve", "[extended][physics]") {
  // Discs of twelve rings with three cells each suffice here, because nothing varies round the centre.
  struct Case {
    const char* dist;
    Pressure pressure;
    SnapLength law;
  };
  const Case cases[] = {{"uniform_0.5_1.5", Pressure::uniform, uniform},
                        {"uniform_0.5_1.5", Pressure::hertz, uniform},
                        {"lognormal_cv0.3", Pressure::uniform, smooth}};
  const std::vector<Row> rows = read_table("spin_virgin.csv");
  for (const Case& c : cases) {
    INFO(c.dist << (c.pressure == Pressure::hertz ? ", Hertz" : ", uniform"));
    const double radius = 100.0 * dbar;
    Pad pad(plain_material(c.law, SnapRule::redraw), infinite_options(32.0),
            Outline::disc(radius, c.pressure, 12, 3), load_n);
    const double full = c.pressure == Pressure::uniform ? 2.0 / 3.0 : 3.0 * pi / 16.0;
    const double torque = full * load_n * kinetic(c.law) * dbar * radius;
    double turned = 0.0;
    int points = 0;
    for (const Row& row : rows) {
      if (row.at("dist") != c.dist || pressure_named(row.at("pressure")) != c.pressure) continue;
      const std::string& text = row.at("s=phi*R/dbar");
      if (text.find("peak") != std::string::npos) continue;
      const double to = number(row, "s=phi*R/dbar");
      const int steps = static_cast<int>(std::ceil((to - turned) / 0.05 - 1e-9));
      for (int i = 0; i < steps; ++i) pad.step(0.0, 0.0, (to - turned) / steps * dbar / radius);
      turned = to;
      INFO("s = " << to);
      expect_near(-pad.response.elastic[2] / torque, number(row, "T_over_T_kinetic"), 0.005, "torque");
      ++points;
    }
    CHECK(points == 18);
    expect_near(pad.imbalance, 0.0, 1e-12, "energy");
  }
}

TEST_CASE("Energy of an extended patch balances at every step of a random walk", "[extended]") {
  for (Population population : {Population::infinite, Population::representatives}) {
    std::mt19937_64 random(5);
    std::normal_distribution<double> gauss;
    const Material material = plain_material(smooth, SnapRule::redraw)
                                  .with_bristle_stiffness(70.0)
                                  .with_bristle_damping(0.02)
                                  .with_viscous_friction(0.3);
    Pad pad(material, contact_of(population, 3000), Outline::rectangle(3e-4, 1e-4, Pressure::uniform, 4, 3),
            load_n);
    for (int i = 0; i < 2000; ++i) {
      const double size = i % 7 == 0 ? 5.0 : 0.3;
      pad.load = i % 100 == 50 ? load_n * 0.7 : pad.load;
      pad.step(size * dbar * gauss(random), size * dbar * gauss(random), size * 0.1 * gauss(random));
      expect(pad.response.dissipated >= 0.0, "snaps dissipate");
    }
    // Energy balances to double precision if the build has it for representatives, which cells use here.
    expect_near(pad.imbalance, 0.0,
                population == Population::infinite ? 1e-11 : (BRISTLE_WITH_DOUBLE ? 1e-11 : 1e-5), "energy");
  }
}

TEST_CASE("A pose reached in one turn or in many gives the same forces", "[extended]") {
  // Snap lengths are three times the outline's half width, so a turn of 1.2 rad sticks.
  const Material long_bristles = plain_material(SnapLength::single(dbar), SnapRule::keep);
  const Outline outline = Outline::rectangle(0.3 * dbar, 0.1 * dbar, Pressure::uniform, 3, 2);
  const auto turned = [&](int pieces) {
    Pad pad(long_bristles, contact_of(Population::representatives, 6000), outline, load_n);
    for (int i = 0; i < pieces; ++i) pad.step(0.1 * dbar / pieces, 0.05 * dbar / pieces, 1.2 / pieces);
    return pad.response;
  };
  const ExtendedResponse once = turned(1), often = turned(60);
  for (int a = 0; a < 2; ++a) CHECK(often.elastic[a] == Approx(once.elastic[a]).margin(1e-9 * load_n * dbar));
  CHECK(often.elastic[2] == Approx(once.elastic[2]).margin(1e-9 * load_n * dbar * dbar));
  // Expects in closed form: the root of each cell went from r to d + R(1.2) r, with R the rotation, and pulls
  // back with K w times its displacement.
  double torque = 0.0, x = 0.0;
  const double c = std::cos(1.2), s = std::sin(1.2);
  for (const PatchCell& cell : outline.cells) {
    const double(&r)[2] = cell.position;
    const double at[2] = {c * r[0] - s * r[1], s * r[0] + c * r[1]};
    const double force[2] = {-cell.weight * load_n * (0.1 * dbar + at[0] - r[0]),
                             -cell.weight * load_n * (0.05 * dbar + at[1] - r[1])};
    x += force[0];
    torque += at[0] * force[1] - at[1] * force[0];
  }
  CHECK(once.elastic[0] == Approx(x).epsilon(1e-9));
  CHECK(once.elastic[2] == Approx(torque).epsilon(1e-9));
}

TEST_CASE("Dampers of an extended patch resist its velocity and its spin", "[extended]") {
  // Viscous friction is given per patch, bristles' damping per newton: c = 0.3 + load * 0.02, and c R^2/2
  // against spin.
  const double radius = 2e-3, spin_velocity = 4.0, velocity = 0.01;
  const Material material = plain_material(smooth, SnapRule::redraw)
                                .with_bristle_damping(0.02)
                                .with_viscous_friction(0.3)
                                .with_stribeck_velocity(1e9);

  const double c = 0.3 + 0.02 * load_n;
  for (bool given : {false, true}) {
    INFO((given ? "velocity given" : "velocity of the displacement"));
    Pad pad(material, infinite_options(8.0), Outline::disc(radius, Pressure::uniform, 2), load_n);
    ExtendedMotion motion;
    motion.id = pad.id;
    motion.normal_load = load_n;
    motion.has_velocity = given;
    double(&to)[3] = given ? motion.velocity : motion.displacement;
    const double seconds = 1e-6;
    to[0] = velocity * (given ? 1.0 : seconds);
    to[2] = spin_velocity * (given ? 1.0 : seconds);
    ExtendedResponse r = step_one(pad.pads, motion, seconds);
    CHECK(r.damper[0] == Approx(-c * velocity).epsilon(1e-6));
    CHECK(r.damper[2] == Approx(-c * spin_velocity * radius * radius / 2.0).epsilon(1e-6));
    CHECK(r.damping[0][0] == Approx(c).epsilon(1e-9));
    CHECK(r.damping[2][2] == Approx(c * radius * radius / 2.0).epsilon(1e-9));
    pad.pads.set_material(pad.id, Material(material).with_viscous_friction(0.0));
    pad.pads.step(seconds, {&motion, 1}, {&r, 1});
    CHECK(r.damping[0][0] == Approx(0.02 * load_n).epsilon(1e-9));
  }
}

TEST_CASE("Limits of force and torque are those of a first loading and a first turn", "[extended]") {
  // Force and torque limits suppose that all cells are at the peak of the virgin curve at once; in a uniform
  // disc the mean lever is 2/3 R.
  const double radius = 1e-3;
  Pad pad(plain_material(smooth, SnapRule::redraw), infinite_options(8.0),
          Outline::disc(radius, Pressure::uniform, 3), load_n);
  const PatchId point = pad.batch.add(plain_material(smooth, SnapRule::redraw), infinite_options(8.0));
  Motion motion;
  motion.id = point;
  motion.normal_load = load_n;
  const double limit = pad.batch.find_force(tick, motion).force_limit;
  pad.step(0.0, 0.0, 0.0);
  CHECK(pad.response.force_limit == Approx(limit).epsilon(1e-9));
  CHECK(pad.response.torque_limit == Approx(limit * radius * 2.0 / 3.0).epsilon(1e-9));
}

TEST_CASE("The tangent is the change of force and torque in sticking, and turns with the outline",
          "[extended]") {
  // Cells whose weighted mean position is off the centre, so that a spin changes the force.
  Outline outline;
  outline.cells = {{{2e-3, 1e-3}, 0.5}, {{-1e-3, 0.0}, 0.3}, {{0.0, 4e-3}, 0.2}};
  for (double angle : {0.0, 1.0, -2.5}) {
    Pad pad(plain_material(smooth, SnapRule::redraw), infinite_options(8.0), outline, load_n);
    pad.load = 0.0;  // turns the outline while out of contact, without force
    pad.step(0.0, 0.0, angle);
    pad.load = load_n;
    pad.step(0.0, 0.0, 0.0);
    double stiffness[3][3];
    std::copy_n(&pad.response.stiffness[0][0], 9, &stiffness[0][0]);
    const double unit[3] = {1e-6 * dbar, 1e-6 * dbar, 1e-6 * dbar / 1e-3};
    for (int to = 0; to < 3; ++to) {
      ExtendedMotion trial;
      trial.id = pad.id;
      trial.normal_load = load_n;
      trial.displacement[to] = unit[to];
      const ExtendedResponse moved = pad.pads.find_force(tick, trial);
      for (int of = 0; of < 3; ++of) {
        INFO("angle " << angle << ", " << of << " by " << to);
        const double scale = load_n * (of == 2 ? 1e-3 : 1.0) * (to == 2 ? 1e-3 : 1.0);
        expect_near(-moved.elastic[of] / unit[to], stiffness[of][to], 2e-6 * scale, "slope");
        CHECK(stiffness[of][to] == stiffness[to][of]);
      }
    }
  }
}

TEST_CASE("The force limit of an outline that ages grows while it rests", "[extended][ageing]") {
  PatchBatch batch;
  ExtendedPatches pads(batch);
  ExtendedMotion rest;
  rest.id = pads.add(
      plain_material(smooth, SnapRule::redraw).with_ageing(bristle::Ageing::logarithmic(0.1, 1e-3)),
      infinite_options(8.0).with_outputs(bristle::Outputs::end), Outline::disc(1e-3, Pressure::uniform, 2));
  rest.normal_load = load_n;
  ExtendedResponse first, last;
  pads.step(tick, {&rest, 1}, {&first, 1});
  for (int i = 0; i < 100; ++i) pads.step(tick, {&rest, 1}, {&last, 1});
  CHECK(last.force_limit > 1.2 * first.force_limit);
}

TEST_CASE("Cells can be stepped with other patches of the batch", "[extended]") {
  PatchBatch batch, alone_batch;
  ExtendedPatches pads(batch), alone(alone_batch);
  const Material material = plain_material(smooth, SnapRule::redraw);
  const PatchId point = batch.add(material, infinite_options(8.0));
  const PatchId pad = pads.add(material, infinite_options(8.0), Outline::disc(1e-3, Pressure::hertz, 2));
  const PatchId same = alone.add(material, infinite_options(8.0), Outline::disc(1e-3, Pressure::hertz, 2));
  const std::size_t count = pads.cell_count(pad);
  REQUIRE(count == 12);
  REQUIRE(pads.cell_patches(pad).size() == count);
  std::vector<Motion> motions(count + 1);
  std::vector<Response> responses(count + 1);
  for (int k = 0; k < 100; ++k) {
    ExtendedMotion motion{pad, {0.5 * dbar, 0.0, 0.02}, load_n};
    REQUIRE(pads.write_motions({&motion, 1}, motions) == count);
    motions[count] = {};
    motions[count].id = point;
    motions[count].displacement[0] = 0.5 * dbar;
    motions[count].normal_load = load_n;
    batch.step(tick, motions, responses);
    ExtendedResponse a, b;
    CHECK(pads.read_responses({&motion, 1}, responses, {&a, 1}) == Status::ok);
    motion.id = same;
    alone.step(tick, {&motion, 1}, {&b, 1});
    expect(std::memcmp(&a.end, &b.end, sizeof a.end) == 0, "end");
  }
  CHECK(pads.info(pad).along[0] == Approx(std::cos(2.0)).margin(1e-13));
  std::vector<PatchCell> cells(count);
  REQUIRE(pads.read_cells(pad, 0.5, load_n, cells) == count);
  // Turns the cells' positions back by 2.5 rad, to the orientation in which the outline was given.
  const Outline given = Outline::disc(1e-3, Pressure::hertz, 2);
  for (std::size_t i = 0; i < count; ++i) {
    const double c = std::cos(2.5), s = std::sin(2.5);
    const double(&p)[2] = cells[i].position;
    expect_near(c * p[0] + s * p[1], given.cells[i].position[0], 1e-15, "x of a cell");
    expect_near(c * p[1] - s * p[0], given.cells[i].position[1], 1e-15, "y of a cell");
  }
}

TEST_CASE("A creep far below the resolution of a position counts in full for an outline too", "[extended]") {
  PatchBatch batch;
  ExtendedPatches pads(batch);
  const ExtendedMotion motion{
      pads.add(plain_material(smooth, SnapRule::redraw), infinite_options(8.0).with_outputs(Outputs::end),
               Outline::disc(1e-3, Pressure::uniform, 2)),
      {1e-15 * dbar, 0.0, 0.0},
      load_n};
  ExtendedResponse response;
  for (int k = 0; k < 20000; ++k) pads.step(tick, {&motion, 1}, {&response, 1});
  // Expected force of one bristle of 1 N/m per newton. Rounding changes each cell's sum by a third of a per
  // cent.
  CHECK(response.elastic[0] == Approx(-load_n * 20000 * 1e-15 * dbar).epsilon(0.01));
}

TEST_CASE("An outline grows with the cube root of the load where that is asked", "[extended]") {
  Pad pad(plain_material(smooth, SnapRule::redraw), infinite_options(8.0),
          Outline::disc(1e-3, Pressure::hertz, 2).grow_with_load(125.0), load_n);
  const double spin = 1e-9;
  pad.step(0.0, 0.0, spin);
  CHECK(pad.pads.info(pad.id).scale == Approx(2.0).epsilon(1e-14));
  CHECK(pad.response.stiffness[2][2] == Approx(load_n * 0.4 * 4e-6).epsilon(1e-9));
  const double torque_limit = pad.response.torque_limit;
  pad.load = 125.0;
  pad.step(0.0, 0.0, spin);
  // Under an eighth of the load this outline has half the size, so its torque limit is a sixteenth.
  CHECK(pad.response.torque_limit == Approx(torque_limit / 16.0).epsilon(1e-9));
  CHECK(pad.response.stiffness[2][2] == Approx(125.0 * 0.4 * 1e-6).epsilon(1e-9));
  const std::uint64_t hash = pad.pads.state_hash(pad.id);
  REQUIRE(pad.pads.set_scale(pad.id, 3.0));
  CHECK(pad.pads.state_hash(pad.id) != hash);  // the scale is a part of the state
  pad.step(0.0, 0.0, spin);
  CHECK(pad.response.stiffness[2][2] == Approx(125.0 * 0.4 * 9e-6).epsilon(1e-9));
  CHECK_FALSE(pad.pads.set_scale(pad.id, NAN));
  CHECK_FALSE(pad.pads.set_scale(PatchId{}, 1.0));
}

TEST_CASE("Extended patches by key begin anew like added ones", "[extended][keys]") {
  PatchBatch batch, fresh_batch;
  ExtendedPatches pads(batch), fresh(fresh_batch);
  const Material material = plain_material(smooth, SnapRule::redraw);
  const PatchOptions options = plain_options(900).with_max_normal_load(load_n).with_seed(5);
  const Outline outline = Outline::disc(2e-4, Pressure::uniform, 2);
  bristle::KeyedPatches keyed(pads, material, options, outline, bristle::KeyedOptions{}.with_capacity(3));
  const auto slide = [](ExtendedPatches& of, PatchId id) {
    ExtendedResponse response;
    for (int k = 0; k < 30; ++k) {
      const ExtendedMotion motion{id, {0.3 * dbar, 0.0, 0.02}, load_n};
      of.step(tick, {&motion, 1}, {&response, 1});
    }
    return response;
  };
  slide(pads, keyed.find_or_add(11));
  keyed.end_step();
  keyed.end_step();  // key 11 is lost when two steps went without it
  CHECK_FALSE(static_cast<bool>(keyed.find(11)));
  const ExtendedResponse again = slide(pads, keyed.find_or_add(12));
  PatchOptions of_key = options;
  of_key.with_seed(keyed.seed_of(12)).with_key(12);
  const PatchId added = fresh.add(material, of_key, outline);
  const ExtendedResponse first = slide(fresh, added);
  CHECK(std::memcmp(&again.end, &first.end, sizeof again.end) == 0);
  CHECK(pads.state_hash(keyed.find(12)) == fresh.state_hash(added));
  CHECK(pads.patch_count() == 3);
}

namespace {

PatchOptions end_options() { return infinite_options(4.0).with_outputs(Outputs::end); }

ExtendedMotion motion_of(PatchId id, double dx, double spin, double load) {
  return {id, {dx, 0.0, spin}, load};
}

/// Moves an outline so little that it sticks. With plain_material its stiffness in N/m is its load in
/// newtons.
ExtendedResponse stick(ExtendedPatches& pads, PatchId id, double load) {
  return step_one(pads, motion_of(id, 0.01 * dbar, 0.0, load));
}

}  // namespace

TEST_CASE("An outline has the stiffness of its material, load and contact from the first step that has them",
          "[extended]") {
  // Checks that a stiffness that doubles, a load that halves, or a lost contact changes the next step's
  // response, whatever was computed before.
  const Material soft = plain_material(smooth, SnapRule::redraw);
  const Material stiff = Material(soft).with_bristle_stiffness(2.0);
  PatchBatch batch;
  ExtendedPatches pads(batch);
  const PatchId pad = pads.add(soft, end_options(), Outline::disc(1e-3, Pressure::uniform, 2));
  CHECK(pads.info(pad).max_normal_load == end_options().max_normal_load);
  for (int i = 0; i < 3; ++i) CHECK(stick(pads, pad, load_n).stiffness[0][0] == Approx(load_n));
  const double limit = stick(pads, pad, load_n).force_limit;

  pads.set_material(pad, stiff);
  const ExtendedResponse changed = stick(pads, pad, load_n);
  CHECK(changed.stiffness[0][0] == Approx(2.0 * load_n));
  CHECK(changed.stiffness[1][1] == Approx(2.0 * load_n));
  // The stiffness of a uniform disc against spin is R^2 / 2 times that against displacement.
  CHECK(changed.stiffness[2][2] == Approx(2.0 * load_n * 0.5e-6));
  CHECK(changed.force_limit == Approx(2.0 * limit));
  CHECK(changed.torque_limit > 0.0);
  pads.set_material(pad, soft);
  CHECK(stick(pads, pad, load_n).stiffness[0][0] == Approx(load_n));

  const std::vector<std::byte> state = saved_state(pads);
  for (int i = 0; i < 3; ++i) CHECK(stick(pads, pad, 0.5 * load_n).stiffness[0][0] == Approx(0.5 * load_n));
  pads.restore_state(state);
  CHECK(pads.info(pad).normal_load == load_n);
  const ExtendedResponse restored = stick(pads, pad, load_n);
  CHECK(restored.stiffness[0][0] == Approx(load_n));
  CHECK(restored.force_limit == Approx(limit));

  // Gives an invalid motion with a velocity, which is refused, so that every cell computes its response.
  ExtendedMotion nowhere = motion_of(pad, INFINITY, 0.0, load_n);
  nowhere.has_velocity = 1;
  const ExtendedResponse refused = step_one(pads, nowhere);
  CHECK(refused.status == Status::bad_input);
  CHECK(refused.stiffness[0][0] == 0.0);
  const ExtendedResponse next = stick(pads, pad, load_n);
  CHECK(next.status == Status::ok);
  CHECK(next.stiffness[0][0] == Approx(load_n));

  for (int i = 0; i < 3; ++i) stick(pads, pad, load_n);
  const auto key = [&] { return batch.info(pads.cell_patches(pad)[0]).key; };
  REQUIRE(pads.reset(pad, 5, 9));
  CHECK(key() == 9);
  const std::vector<std::byte> reset = saved_state(pads);
  REQUIRE(pads.reset(pad, 6, 10));
  CHECK(key() == 10);
  pads.restore_state(reset);
  REQUIRE(pads.reset(pad));  // with the seed and key of the state
  CHECK(key() == 9);
  CHECK(pads.info(pad).normal_load == 0.0);
  const ExtendedResponse lifted = stick(pads, pad, 0.0);
  CHECK(lifted.stiffness[0][0] == 0.0);
  CHECK(lifted.force_limit == 0.0);
  CHECK(lifted.torque_limit == 0.0);
}

TEST_CASE("A state of other outlines is refused by that name, and changes nothing", "[extended][state]") {
  // Batches with equal outlines that were added in different orders.
  PatchBatch first_batch, second_batch;
  ExtendedPatches first(first_batch), second(second_batch);
  const Outline disc = Outline::disc(1e-3, Pressure::uniform, 2);
  const Outline point = Outline::disc(0.0, Pressure::uniform, 1);
  REQUIRE(disc.cells.size() > point.cells.size());
  const Material material = plain_material(smooth, SnapRule::redraw);
  first.add(material, end_options(), disc);
  first.add(material, end_options(), point);
  second.add(material, end_options(), point);
  const PatchId pad = second.add(material, end_options(), disc);
  stick(second, pad, load_n);
  const std::vector<std::byte> state = saved_state(first);
  const std::uint64_t before = second.state_hash();
  CHECK(names(message_of([&] { second.restore_state(state); }), {"ExtendedPatches", "other outlines"}));
  CHECK(second.state_hash() == before);
}

TEST_CASE("Motions of cells that a shorter list leaves over name no patch", "[extended]") {
  Pad pad(Material{}, PatchOptions{}.with_max_normal_load(1.0), Outline::disc(1e-3, Pressure::uniform, 1),
          1.0);
  const ExtendedMotion motion{pad.id, {dbar, 0.0, 0.0}, 1.0};
  std::vector<Motion> cells(10);
  for (Motion& cell : cells) cell.id = PatchId{1};
  const std::size_t written = pad.pads.write_motions({&motion, 1}, {cells.data(), cells.size()});
  REQUIRE(written == 4);
  for (std::size_t k = written; k < cells.size(); ++k) CHECK_FALSE(cells[k].id);
}

TEST_CASE("A response holds what was asked for and keeps the rest as the caller left it", "[extended]") {
  // With damping each cell of the outline computes its own response. Without damping a step in which nothing
  // snaps, here from the second step on, returns the sum of the cells' elastic forces.
  for (const double damping : {0.01, 0.0}) {
    INFO("bristle damping " << damping);
    PatchBatch batch;
    ExtendedPatches pads(batch);
    const Material material = plain_material(smooth, SnapRule::redraw).with_bristle_damping(damping);
    ExtendedMotion motion = motion_of(
        pads.add(material, end_options(), Outline::disc(1e-3, Pressure::uniform, 2)), dbar, 0.0, load_n);
    for (int k = 0; k < 3; ++k) {
      ExtendedResponse out;
      for (double& x : out.damper) x = 5.0;
      for (double& x : out.mean) x = 7.0;
      out.snaps = 77;
      out.dissipated = 3.0;
      pads.step(tick, {&motion, 1}, {&out, 1});
      CHECK(out.snaps == 77);
      CHECK(out.dissipated == 3.0);
      for (int i = 0; i < 3; ++i) CHECK(out.mean[i] == 7.0);
      CHECK((out.damper[0] != 0.0) == (damping != 0.0));
      CHECK(out.damper[0] != 5.0);
      CHECK(std::abs(out.damper[2]) < 1e-12);
    }
  }
}

TEST_CASE("A lubricant resists in every step, whatever was known from the one before", "[extended]") {
  PatchBatch batch;
  ExtendedPatches pads(batch);
  const double lubricant = 0.5;
  const Material material = plain_material(smooth, SnapRule::redraw).with_viscous_friction(lubricant);
  ExtendedMotion motion = motion_of(
      pads.add(material, end_options(), Outline::disc(1e-3, Pressure::uniform, 2)), dbar, 0.0, load_n);
  for (int k = 0; k < 3; ++k) {
    const ExtendedResponse out = step_one(pads, motion);
    CHECK(out.damper[0] == Approx(-lubricant * dbar / tick));
  }
}

TEST_CASE("An outline reports the memory and the visits of all its cells, and gives its place back",
          "[extended]") {
  PatchBatch batch, points;
  ExtendedPatches pads(batch);
  const Material material = plain_material(smooth, SnapRule::redraw).with_bristle_damping(0.01);
  const PatchOptions options = plain_options(900, 2, Precision::double_);
  const Outline pair = {{{{-1e-3, 0.0}, 0.5}, {{1e-3, 0.0}, 0.5}}, 0.0};
  const PatchId pad = pads.add(material, options, pair);
  std::size_t memory = 0;
  for (const PatchId cell : pads.cell_patches(pad))
    memory += batch.info(cell).memory_bytes + sizeof(PatchCell) + sizeof(PatchId);
  CHECK(pads.info(pad).memory_bytes == memory);
  PatchOptions half = options;
  half.with_bristles(450).with_max_normal_load(450.0);
  const PatchId point = points.add(material, half);
  ExtendedMotion motion = motion_of(pad, 0.7 * dbar, 0.0, 900.0);
  Motion of_point{point, {0.7 * dbar, 0.0}, 450.0};
  for (int k = 0; k < 3; ++k) {
    ExtendedResponse out;
    Response answer;
    const auto visits = pads.step(tick, {&motion, 1}, {&out, 1}).bristles_visited;
    CHECK(visits == 2 * points.step(tick, {&of_point, 1}, {&answer, 1}).bristles_visited);
    CHECK(visits > 0);
  }
  // The lower half of an id is its slot, which is reused: few slots suffice for outlines that come and go.
  std::uint32_t highest = 0;
  for (int k = 0; k < 100; ++k) {
    const PatchId more = pads.add(material, options, pair);
    highest = std::max(highest, static_cast<std::uint32_t>(more.value));
    pads.remove(more);
    pads.step(tick, {&motion, 0}, {static_cast<ExtendedResponse*>(nullptr), 0});
  }
  CHECK(highest < static_cast<std::uint32_t>(pad.value) + 4);
}

TEST_CASE("An outline to the left alone has an extent, and a cell that is gone stops its turn",
          "[extended]") {
  PatchBatch batch;
  ExtendedPatches pads(batch);
  const Material material = plain_material(smooth, SnapRule::redraw);
  const Outline left = {{{{-1e-3, 0.0}, 0.25}, {{-2e-3, 0.0}, 0.75}}, 0.0};
  CHECK_THROWS_AS(pads.add(material, end_options().with_axes(1), left), bristle::Error);
  const PatchId pad = pads.add(material, end_options(), left);
  ExtendedMotion turn = motion_of(pad, 0.0, 1e-4, load_n);
  ExtendedResponse out;
  for (int k = 0; k < 2; ++k) pads.step(tick, {&turn, 1}, {&out, 1});
  const double along = pads.info(pad).along[1];
  CHECK(along == Approx(2e-4));
  const double stiffness = out.stiffness[0][0], limit = out.force_limit;
  batch.remove(pads.cell_patches(pad)[0]);  // leaves the cell with three quarters of the load
  pads.step(tick, {&turn, 1}, {&out, 1});
  CHECK(out.status == Status::unknown_id);
  CHECK(out.stiffness[0][0] == Approx(0.75 * stiffness));
  CHECK(out.force_limit == Approx(0.75 * limit));
  CHECK(pads.info(pad).along[1] == along);
}

}  // namespace bristle_test::test_extended_patches
