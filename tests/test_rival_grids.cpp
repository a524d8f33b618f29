// Other friction models with an extent (Coulomb's disc in closed form, grids of Coulomb cells and of LuGre
// cells), compared with the tables of the limit surface, quadrature, and figures of the published LuGre grid.
#include <catch2/catch.hpp>

#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include "expect.hpp"
#include "reference_table.hpp"
#include "tools/libraries/rivals/coulomb_disc.hpp"
#include "tools/libraries/rivals/lugre.hpp"
#include "tools/libraries/rivals/rival_grid.hpp"

namespace bristle_test::test_rival_grids {

using rivals::coulomb_disc;
using rivals::DiscFriction;
using rivals::LuGreGrid;
using rivals::Pair;
using rivals::PressedCells;
using rivals::Pressure;
using rivals::RivalGrid;
using rivals::SpinForce;
using rivals::Surface;

namespace {

constexpr double radius = 0.01;  // m

// Velocity v and angular velocity omega of a disc of radius R, with v / (omega R) = eps. Its fastest points
// move at about 1 m/s.
struct Slip {
  Pair v;
  double omega;
};
Slip slip_at(double eps) { return {{eps / (1.0 + eps), 0.0}, 1.0 / (1.0 + eps) / radius}; }

// Returns friction over mu N and torque over mu N R of a grid in steady sliding. Static and kinetic
// coefficient are equal here.
template <class Grid>
DiscFriction steady(Grid grid, double eps, double load, double coefficient) {
  const Slip slip = slip_at(eps);
  const double dt = 1e-5;
  SpinForce f;
  // Slides so far that all cells slide steadily: the fastest point 200 um, and one at a tenth of a cell from
  // the centre of rotation still 1 um, far more than a bristle of 0.02 um.
  for (int k = 0; k < 20; ++k) f = grid.step(dt * slip.v, dt * slip.omega, dt, load);
  const double full = coefficient * load;
  return {std::hypot(f.mean.force.x, f.mean.force.y) / full, -f.mean.torque / (full * radius)};
}

// Returns the cells of a square, `across` times `across` equal ones, whose middle is within `reach` of its
// centre.
PressedCells square_cells(int across, double side, double reach = 1.0) {
  PressedCells cells;
  for (int i = 0; i < across; ++i)
    for (int j = 0; j < across; ++j) {
      const double x = side * ((i + 0.5) / across - 0.5), y = side * ((j + 0.5) / across - 0.5);
      if (std::hypot(x, y) > reach) continue;
      cells.x.push_back(x);
      cells.y.push_back(y);
    }
  cells.share.assign(cells.size(), 1.0 / static_cast<double>(cells.size()));
  return cells;
}

Surface dry() {
  Surface s;
  s.static_coefficient = s.kinetic_coefficient = 0.4;
  s.stiffness = 5e7;
  s.damping = s.viscous_friction = 0.0;
  return s;
}

RivalGrid coulomb_grid(PressedCells cells, double creep_velocity) {
  return {rivals::Coulomb{.surface = dry(), .creep_velocity = creep_velocity}, std::move(cells)};
}

// Returns a grid's largest error of friction and torque over the rows of spin_limit.csv of one pressure.
template <class Make>
double limit_error(const Make& make, const std::string& pressure) {
  double worst = 0.0;
  int rows = 0;
  for (const Row& row : read_table("spin_limit.csv")) {
    if (row.at("pressure") != pressure) continue;
    const DiscFriction f = steady(make(), number(row, "v_over_omegaR"), 2.0, 0.4);
    worst = std::max(worst, std::fabs(f.force - number(row, "F_over_muN")));
    worst = std::max(worst, std::fabs(f.torque - number(row, "T_over_muNR")));
    ++rows;
  }
  REQUIRE(rows > 5);
  return worst;
}

// Returns friction and torque of a disc by quadrature over rings and spokes, midpoint rule.
DiscFriction quadrature(double eps) {
  const int rings = 2000, spokes = 720;
  DiscFriction sum;
  for (int i = 0; i < rings; ++i) {
    const double r = std::sqrt((i + 0.5) / rings);
    for (int j = 0; j < spokes; ++j) {
      const double a = 2.0 * M_PI * (j + 0.5) / spokes;
      const double vx = eps - r * std::sin(a), vy = r * std::cos(a), v = std::hypot(vx, vy);
      sum.force += vx / v;
      sum.torque += r * (vy * std::cos(a) - vx * std::sin(a)) / v;
    }
  }
  return {sum.force / rings / spokes, sum.torque / rings / spokes};
}

}  // namespace

TEST_CASE("Coulomb's disc slides and spins as the table and a quadrature say", "[rivals][spin]") {
  for (const Row& row : read_table("spin_limit.csv")) {
    if (row.at("pressure") != "uniform") continue;
    const DiscFriction f = coulomb_disc(number(row, "v_over_omegaR"));
    expect_near(f.force, number(row, "F_over_muN"), 1e-5, "force of the table");
    expect_near(f.torque, number(row, "T_over_muNR"), 1e-5, "torque of the table");
    if (row.at("closed_form_F").empty()) continue;
    expect_near(f.force, number(row, "closed_form_F"), 1e-6, "force in closed form");
    expect_near(f.torque, number(row, "closed_form_T"), 1e-6, "torque in closed form");
  }
  for (const double eps : {0.003, 0.3, 0.97, 1.04, 3.0, 60.0}) {
    const DiscFriction f = coulomb_disc(eps), q = quadrature(eps);
    expect_near(f.force, q.force, 2e-5, "force by quadrature");
    expect_near(f.torque, q.torque, 2e-5, "torque by quadrature");
  }
  // Checks that coulomb_disc() is continuous where it changes between closed form and series of eps.
  for (const double eps : {1e-3, 1.0, 100.0}) {
    const DiscFriction below = coulomb_disc(eps * (1.0 - 1e-9)), above = coulomb_disc(eps * (1.0 + 1e-9));
    CHECK(below.force == Approx(above.force).epsilon(1e-7));
    CHECK(below.torque == Approx(above.torque).epsilon(1e-7));
  }
  CHECK(coulomb_disc(0.0).torque == Approx(2.0 / 3.0).epsilon(1e-12));
  CHECK(coulomb_disc(INFINITY).force == 1.0);
  CHECK(coulomb_disc(INFINITY).torque == 0.0);
}

TEST_CASE("Grids of Coulomb and LuGre cells come to the limit surface as their cells grow in number",
          "[rivals][spin]") {
  for (const std::string& pressure : {std::string("uniform"), std::string("hertz")}) {
    INFO(pressure);
    const auto cells = [&](int across) {
      return rivals::disc_cells(across, radius, pressure == "hertz" ? Pressure::hertz : Pressure::uniform);
    };
    double coarse = 0.0, fine = 0.0;
    for (const int across : {5, 9, 21}) {
      const double lugre = limit_error([&] { return LuGreGrid(dry(), cells(across)); }, pressure);
      const double coulomb = limit_error([&] { return coulomb_grid(cells(across), 1e-7); }, pressure);
      INFO(across << " across: " << lugre << ", Coulomb " << coulomb);
      // LuGre's bristles are much shorter than a cell here, so a LuGre grid has the error of a grid of
      // Coulomb cells.
      CHECK(lugre == Approx(coulomb).margin(2e-4));
      if (across == 5) coarse = lugre;
      fine = lugre;
    }
    CHECK(fine < 0.01);
    CHECK(fine < 0.3 * coarse);
  }
}

TEST_CASE("A square pad of Coulomb cells turns about its centre and its corner as integrals say",
          "[rivals][spin]") {
  const double side = 0.05;
  RivalGrid pad = coulomb_grid(square_cells(101, side), 1e-9);
  // Expected torque by the mean distance of a square's points from its centre; below, from a corner.
  const double from_centre = (std::sqrt(2.0) + std::asinh(1.0)) / 6.0 * side;
  const SpinForce spin = pad.step({}, 1e-9, 1e-5, 2.5);
  CHECK(-spin.mean.torque == Approx(from_centre * 0.4 * 2.5).epsilon(2e-4));
  // Spins the square about its corner. Spin about the corner at (side, side) / 2 also moves the centre. The
  // torque about the corner is that about the centre plus arm x force.
  const double turn = 1e-9;
  const Pair arm{-0.5 * side, -0.5 * side};
  const SpinForce f = pad.step({-turn * arm.y, turn * arm.x}, turn, 1e-5, 2.5);
  const double about_corner = f.mean.torque + rivals::cross(arm, f.mean.force);
  CHECK(-about_corner == Approx(2.0 * from_centre * 0.4 * 2.5).epsilon(2e-4));
}

TEST_CASE("A cell of the LuGre grid is the LuGre rival on the cell's own path", "[rivals][spin]") {
  Surface s;  // parameters with a static part, a damper and viscous friction
  PressedCells cells;
  cells.x = {0.004};
  cells.y = {-0.007};
  cells.share = {1.0};
  LuGreGrid grid(s, cells);
  rivals::LuGre alone{.surface = s, .z = {}};
  const double dt = 1e-3, load = 2.5;
  double turned = 0.0;
  const std::array<std::array<double, 3>, 5> steps = {
      {{1e-5, -3e-6, 0.0}, {0.0, 0.0, 4e-3}, {-2e-5, 5e-5, -0.3}, {1e-6, 0.0, 1.2}, {0.0, 2e-6, 1e-4}}};
  for (const auto& [dx, dy, angle] : steps) {
    const auto position = [&](double a) {
      return Pair{std::cos(a) * 0.004 + std::sin(a) * 0.007, std::sin(a) * 0.004 - std::cos(a) * 0.007};
    };
    const Pair path = Pair{dx, dy} + position(turned + angle) - position(turned);
    const SpinForce f = grid.step({dx, dy}, angle, dt, load);
    const rivals::Force expected = alone.step(path, dt, load);
    turned += angle;
    expect_near(f.end.force.x, expected.end.x, 1e-9, "force x");
    expect_near(f.end.force.y, expected.end.y, 1e-9, "force y");
    expect_near(f.mean.force.x, expected.mean.x, 1e-9, "mean force x");
    expect_near(f.end.torque, rivals::cross(position(turned), expected.end), 1e-11, "torque");
    // Checks the work: force and torque of the grid do that of the cell's force along the straight line
    // between its places.
    expect_near(f.mean.force.x * dx + f.mean.force.y * dy + f.mean.torque * angle, dot(expected.mean, path),
                1e-12, "work");
  }
  // Checks that without load there is no force, and that bristles are straight when the load returns.
  CHECK(grid.step({1e-5, 0.0}, 0.1, dt, 0.0).end.force.x == 0.0);
  CHECK(grid.step({}, 0.0, dt, load).end.force.y == 0.0);
}

TEST_CASE("A grid of any rival sums its cells: of LuGre, it is the LuGre grid", "[rivals][spin]") {
  const PressedCells cells = rivals::disc_cells(7, radius, Pressure::hertz);
  const Surface s;
  RivalGrid any(rivals::make_rival("lugre", s), cells);
  LuGreGrid grid(s, cells);
  for (int k = 0; k < 20; ++k) {
    const Pair path{1e-6 * k, -3e-7 * k * k};
    const double angle = 1e-4 * (k % 5) - 1e-4, load = k == 12 ? 0.0 : 2.5;
    const SpinForce a = any.step(path, angle, 1e-3, load), b = grid.step(path, angle, 1e-3, load);
    expect_near(a.end.force.x, b.end.force.x, 1e-9, "force x");
    expect_near(a.mean.force.y, b.mean.force.y, 1e-9, "mean force y");
    expect_near(a.end.torque, b.end.torque, 1e-9, "torque");
    expect_near(a.mean.torque, b.mean.torque, 1e-9, "mean torque");
  }
  // In translation without spin the grid has the force of the whole contact, for every friction model,
  // because each cell has its share of load, stiffness and damping, to which the force is in proportion.
  for (const std::string_view name : rivals::rival_names) {
    INFO(name);
    rivals::Rival whole = rivals::make_rival(name, s);
    RivalGrid shared(whole, cells);
    for (int k = 0; k < 20; ++k) {
      const Pair path{4e-6 * std::sin(k), 2e-6};
      const SpinForce f = shared.step(path, 0.0, 1e-3, 2.5);
      const rivals::Force expected = rivals::step(whole, path, 1e-3, 2.5);
      expect_near(f.end.force.x, expected.end.x, 1e-6, "force x");
      expect_near(f.mean.force.y, expected.mean.y, 1e-6, "mean force y");
      expect_near(f.end.torque, 0.0, 1e-9, "torque");
    }
  }
}

TEST_CASE("Sticking, the LuGre grid is a torsion spring of K R^2 / 2 or 2 K a^2 / 5", "[rivals][spin]") {
  const Surface s = dry();
  const double turn = 1e-12, dt = 1e-3;
  for (const auto& [pressure, share] : {std::pair{Pressure::uniform, 0.5}, std::pair{Pressure::hertz, 0.4}}) {
    LuGreGrid grid(s, rivals::disc_cells(151, radius, pressure));
    const double torque = grid.step({}, turn, dt, 2.0).end.torque;
    CHECK(-torque == Approx(share * s.stiffness * radius * radius * turn).epsilon(2e-3));
  }
}

// Returns the cells of a shape of the published LuGre grid: a square of 21 x 21, or the cells of it at most
// 10 cells from its middle.
static PressedCells published_cells(const std::string& shape) {
  return square_cells(21, 0.02, shape == "Square" ? 1.0 : 10.0001 * 0.02 / 21.0);
}

TEST_CASE("The LuGre grid gives the forces of the published one", "[rivals][spin]") {
  Surface s;
  s.kinetic_coefficient = 1.0;
  s.static_coefficient = 1.2;
  s.stribeck_velocity = 1e-3;
  s.stiffness = 1e5;
  s.damping = 20.0;
  s.viscous_friction = 0.2;
  CHECK(published_cells("Circle").size() == 317);
  for (const auto rule : {LuGreGrid::StepRule::euler, LuGreGrid::StepRule::exact}) {
    std::string shape;
    LuGreGrid grid(s, published_cells("Square"), rule);
    // Time step of Euler's method, 2.5 times the published one; the exact rule may take longer steps.
    const double dt = rule == LuGreGrid::StepRule::euler ? 2.5e-6 : 2e-5, tiny = 1e-6;
    for (const Row& row : read_table("lugre_grid_published.csv")) {
      if (row.at("shape") != shape) {
        shape = row.at("shape");
        grid = LuGreGrid(s, published_cells(shape), rule);
      }
      const Pair v{number(row, "vx"), number(row, "vy")};
      const double omega = number(row, "omega");
      const long steps = std::lround(number(row, "duration") / dt);
      SpinForce f;
      for (long k = 0; k < steps; ++k) f = grid.step(dt * v, dt * omega, dt, 1.0);
      INFO(shape << " after " << row.at("duration") << " s at " << omega << " rad/s");
      // Tolerance: the published grid's axes do not turn with the body, which changes 0.1 % at most over the
      // 0.01 rad of a run. Euler's error is a relative |v| dt / zss, zss being the steady deflection.
      CHECK(f.end.force.x == Approx(number(row, "fx")).margin(8e-4));
      CHECK(f.end.force.y == Approx(number(row, "fy")).margin(8e-4));
      CHECK(f.end.torque == Approx(number(row, "torque")).margin(4e-6));
      grid.step(tiny * v, tiny * omega, tiny, 1.0);
    }
  }
}

TEST_CASE("A grid without cells or extent is refused", "[rivals][spin]") {
  CHECK_THROWS_AS(rivals::disc_cells(0, radius), std::invalid_argument);
  CHECK_THROWS_AS(rivals::disc_cells(5, 0.0), std::invalid_argument);
  CHECK_THROWS_AS(rivals::disc_cells(3, NAN), std::invalid_argument);
}

}  // namespace bristle_test::test_rival_grids
