// The infinite brush (Population::infinite) against the reference tables, and in hard cases.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "expect.hpp"
#include "infinite_brush.hpp"
#include "reference_table.hpp"
#include "scenes.hpp"

namespace bristle_test::test_cohorts {

namespace {

struct Point {
  double x, y;
};

std::vector<Point> made_up_path(const std::string& name, int steps) {
  std::vector<Point> path;
  std::mt19937 generator(5);
  std::uniform_real_distribution<double> flat(-1.0, 1.0);
  const auto normal = [&] { return (flat(generator) + flat(generator) + flat(generator)); };
  Point at{0.0, 0.0};
  double angle = 0.0;
  for (int i = 0; i < steps; ++i) {
    Point d{0.0, 0.0};
    const auto moved = [&](auto point) {
      const Point a = point(i), b = point(i + 1);
      return Point{b.x - a.x, b.y - a.y};
    };
    if (name == "winding") {
      angle += 0.12 * normal();
      d = {0.15 * std::cos(angle), 0.15 * std::sin(angle)};
    } else if (name == "disc") {
      do d = {0.2 * normal(), 0.2 * normal()};
      while (std::hypot(at.x + d.x, at.y + d.y) > 2.0);
    } else if (name == "circle") {
      d = moved([](int k) { return Point{std::cos(0.1 * k), std::sin(0.1 * k)}; });
    } else if (name == "figure of eight") {
      d = moved([](int k) { return Point{2.0 * std::sin(0.05 * k), std::sin(0.1 * k)}; });
    } else if (name == "tremor") {
      d = moved([](int k) {
        return Point{0.7 * std::sin(0.1 * k) + 0.3 * std::sin(0.27 * k), 0.4 * std::sin(0.13 * k)};
      });
    }
    at = {at.x + d.x, at.y + d.y};
    path.push_back(d);
  }
  return path;
}

/// Largest errors of the infinite brush against one law's reference tables, in mean snap lengths.
struct TableErrors {
  double virgin = 0.0, reversal = 0.0, turn = 0.0;
  int points = 0;
  double largest() const { return std::max({virgin, reversal, turn}); }
};

TableErrors table_errors(const NamedLaw& law, double resolution) {
  TableErrors e;
  const PatchOptions options = infinite_options(resolution);
  const auto of_law = [&law](const Row& row) {
    return row.at("dist") == law.name && row.at("variant") == std::string("redraw");
  };
  {
    Brush brush(law.law, options);
    double x = 0.0;
    for (const Row& row : read_table("virgin_curve.csv")) {
      if (!of_law(row)) continue;
      const double to = number(row, "x_over_dbar");
      brush.step((to - x) * 0.6, (to - x) * 0.8);
      x = to;
      e.virgin = std::max(e.virgin, std::abs(brush.x() * 0.6 + brush.y() * 0.8 - number(row, "f_reference")));
      ++e.points;
    }
  }
  {
    Brush brush(law.law, options);
    for (int k = 0; k < 60; ++k) brush.step(0.83);
    double y = 0.0;
    for (const Row& row : read_table("reversal_curve.csv")) {
      if (!of_law(row)) continue;
      const double to = number(row, "y_over_dbar_after_reversal");
      brush.step(y - to);
      y = to;
      e.reversal = std::max(e.reversal, std::abs(brush.x() - number(row, "f_reference")));
      ++e.points;
    }
  }
  for (const char* turn : {"90", "180"}) {
    Brush brush(law.law, options);
    const double start = 0.4, angle = start + std::stod(turn) * M_PI / 180.0;
    for (int k = 0; k < 60; ++k) brush.step(0.83 * std::cos(start), 0.83 * std::sin(start));
    const double ex = std::cos(angle), ey = std::sin(angle);
    double y = 0.0;
    for (const Row& row : read_table("turn_2d.csv")) {
      if (!of_law(row) || row.at("turn_deg") != turn) continue;
      const double to = number(row, "y_over_dbar_after_turn");
      brush.step((to - y) * ex, (to - y) * ey);
      y = to;
      const double along = brush.x() * ex + brush.y() * ey, across = brush.x() * ey - brush.y() * ex;
      e.turn = std::max({e.turn, std::abs(along - number(row, "f_parallel_ref")),
                         std::abs(across - number(row, "f_perp_ref"))});
      ++e.points;
    }
  }
  return e;
}

}  // namespace

TEST_CASE("The infinite brush follows the tables of every law", "[cohorts][physics]") {
  for (const NamedLaw& law : reference_laws()) {
    if (law.law.law() == bristle::SnapLaw::single) continue;
    for (double resolution : {8.0, 16.0, 32.0}) {
      const TableErrors e = table_errors(law, resolution);
      INFO(law.name << ", " << resolution << " pieces: virgin " << e.virgin << ", reversal " << e.reversal
                    << ", turn " << e.turn);
      CHECK(e.points > 60);
      CHECK(e.largest() < 0.0045 * 64.0 / (resolution * resolution));
    }
  }
}

TEST_CASE("The error of the infinite brush falls with the square of the resolution", "[cohorts][physics]") {
  // Takes steps so long that the brush cuts them into pieces, whose length follows from the resolution.
  for (const SnapLength& law : {SnapLength::uniform(0.5 * dbar, 1.5 * dbar), SnapLength::lognormal(dbar, 0.3),
                                SnapLength::lognormal(dbar, 1.0), SnapLength::exponential(dbar)}) {
    std::mt19937 generator(4);
    std::uniform_real_distribution<double> flat(-1.0, 1.0);
    std::vector<Point> path;
    double angle = 0.0;
    for (int i = 0; i < 200; ++i) {
      angle += 1.5 * flat(generator);
      path.push_back({std::cos(angle), std::sin(angle)});
    }
    const auto forces = [&](double resolution) {
      Brush brush(law, infinite_options(resolution));
      std::vector<Point> result;
      for (const Point& d : path) {
        brush.step(d.x, d.y);
        result.push_back({brush.x(), brush.y()});
      }
      return result;
    };
    const std::vector<Point> truth = forces(64.0);
    std::vector<double> rms;
    for (double resolution : {4.0, 8.0, 16.0}) {
      double squares = 0.0;
      const std::vector<Point> f = forces(resolution);
      for (std::size_t i = 0; i < f.size(); ++i)
        squares += std::pow(f[i].x - truth[i].x, 2) + std::pow(f[i].y - truth[i].y, 2);
      rms.push_back(std::sqrt(squares / static_cast<double>(f.size())));
    }
    INFO(to_string(law.law()) << ", cv " << law.cv() << ": " << rms[0] << ", " << rms[1] << ", " << rms[2]);
    CHECK(0.5 * std::log2(rms[0] / rms[2]) > 1.8);
  }
}

TEST_CASE("Steady sliding in steps within a piece is exact to 1e-4 at the default resolution",
          "[cohorts][physics]") {
  // Allows less than the error of placing all bristles born in a piece of length h at its middle, h^2 / (24
  // dbar), 1.2e-3 of the force.
  for (double cv : {0.3, 0.5}) {
    const SnapLength law = SnapLength::lognormal(dbar, cv);
    const double expected = law.moment(2) / (2.0 * law.mean()) / dbar;
    for (double stroke : {0.01, 0.03, 0.1}) {
      Brush brush(law);
      double sum = 0.0;
      int counted = 0;
      for (int i = 0; i < 11.0 / stroke; ++i) {
        brush.step(0.6 * stroke, 0.8 * stroke);
        if (i < 6.0 / stroke) continue;
        sum += 0.6 * brush.x() + 0.8 * brush.y();
        ++counted;
      }
      INFO("cv " << cv << ", steps of " << stroke << ": " << sum / counted << ", expected " << expected);
      CHECK(std::abs(sum / counted - expected) < 1e-4 * expected);
      CHECK(brush.imbalance < 1e-12);
      CHECK(brush.most_negative >= 0.0);
    }
  }
}

TEST_CASE("A step that forgets how it began ends, works and loses as many small ones", "[cohorts][physics]") {
  const auto rubbed = [](const SnapLength& law, double residual) {
    return plain_material(law, SnapRule::redraw).with_residual_length(residual * dbar);
  };
  for (const SnapLength& law : {SnapLength::lognormal(dbar, 0.3), SnapLength::uniform(0.5 * dbar, 1.5 * dbar),
                                SnapLength::exponential(dbar), SnapLength::lognormal(dbar, 1.0)})
    for (double residual : {0.0, 0.4})
      for (double turn : {0.0, 1.2, 2.0, 3.1}) {
        const bool wide = law.law() == bristle::SnapLaw::lognormal && law.cv() > 0.9;
        const double length = wide ? 210.0 : law.cv() > 0.9 ? 90.0 : 18.0;
        Brush far(rubbed(law, residual)), near(rubbed(law, residual), infinite_options(24.0));
        for (Brush* brush : {&far, &near}) {
          // Moves forth, then back, which leaves cohorts bent in two directions.
          for (int i = 0; i < 300; ++i) brush->step(0.05);
          for (int i = 0; i < 12; ++i) brush->step(-0.05, 0.02);
        }
        const double ex = std::cos(turn), ey = std::sin(turn);
        double mean[2] = {0.0, 0.0}, dissipated = 0.0, snaps = 0.0;
        const int steps = static_cast<int>(length / (wide ? 0.05 : 0.02));
        for (int i = 0; i < steps; ++i) {
          near.step(length / steps * ex, length / steps * ey);
          for (int axis = 0; axis < 2; ++axis) mean[axis] += near.response.mean[axis] / steps;
          dissipated += near.response.dissipated;
          snaps += static_cast<double>(near.response.snaps);
        }
        far.step(length * ex, length * ey);
        INFO(to_string(law.law()) << ", cv " << law.cv() << ", residual " << residual << ", turned by "
                                  << turn);
        const double unit = std::abs(far.x() * ex + far.y() * ey) * load_n * dbar;
        for (int axis = 0; axis < 2; ++axis) {
          CHECK(std::abs(far.response.elastic[axis] - near.response.elastic[axis]) < 3e-3 * unit);
          CHECK(std::abs(far.response.mean[axis] - mean[axis]) < 2e-3 * unit);
        }
        CHECK(far.response.dissipated == Approx(dissipated).epsilon(2e-3));
        CHECK(static_cast<double>(far.response.snaps) == Approx(snaps).epsilon(6e-3));
        CHECK(far.imbalance < 1e-12);
      }
}

TEST_CASE("A load jump under the infinite brush follows the tables", "[cohorts][physics][load]") {
  const std::vector<Row> summary = read_table("summary.csv");
  int points = 0;
  for (const NamedLaw& law : reference_laws()) {
    if (law.law.law() == bristle::SnapLaw::single) continue;
    for (const char* jump : {"zeta x2", "zeta x0.5"}) {
      const bool doubled = std::string(jump) == "zeta x2";
      const double kinetic =
          number(find_row(summary, {{"dist", law.name}, {"variant", "redraw"}}), "f_kinetic");
      Brush brush(law.law, infinite_options(32.0));
      const double before = doubled ? 0.5 * load_n : load_n;
      brush.load = before;
      for (int k = 0; k < 60; ++k) brush.step(0.83);
      brush.load = doubled ? load_n : 0.5 * load_n;
      double x = 0.0;
      for (const Row& row : read_table("load_jump.csv")) {
        if (row.at("dist") != law.name || row.at("variant") != std::string("redraw") ||
            row.at("jump") != jump)
          continue;
        const double to = number(row, "x_over_dbar_after_jump");
        brush.step(to - x);
        x = to;
        INFO(law.name << ", " << jump << ", x = " << to);
        expect_near(brush.x() * brush.load / (before * kinetic), number(row, "F_over_Fk1_ref"), 2e-3,
                    "force over the kinetic one before");
        ++points;
      }
      CHECK(brush.imbalance < 1e-12);
    }
  }
  CHECK(points > 20);
}

TEST_CASE("Energy of the infinite brush balances at every step, and no step gains any", "[cohorts][energy]") {
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> flat(-1.0, 1.0);
  const auto redraw = [](const SnapLength& law) { return plain_material(law, SnapRule::redraw); };
  std::vector<Material> materials = {redraw(uniform), redraw(SnapLength::exponential(dbar)),
                                     redraw(SnapLength::lognormal(dbar, 2.0)),
                                     redraw(SnapLength::normal(dbar, 0.1 * dbar))};
  for (const auto& [residual, renewal] :
       {std::pair{0.0, 0.0}, {0.0, 1.0}, {0.4, 0.0}, {0.25, 2.0}, {0.0, 8.0}})
    materials.push_back(redraw(SnapLength::lognormal(dbar, 0.3))
                            .with_residual_length(residual * dbar)
                            .with_shared_renewal(renewal));
  materials.push_back(Material(materials.back()).with_ageing(bristle::Ageing::logarithmic(0.1, 1e-3)));
  for (const Material& material : materials) {
    for (double resolution : {1.0, 3.0, 0.0}) {
      INFO(to_string(material.snap_length.law())
           << ", cv " << material.snap_length.cv() << ", residual " << material.residual_length
           << ", renewal " << material.shared_renewal << ", resolution " << resolution);
      Brush brush(material, infinite_options(resolution));
      for (int i = 0; i < 3000; ++i) {
        const double s = i % 700 < 350 ? 0.08 : i % 97 == 0 ? 9.0 : 0.6;
        if (i % 3 == 0) brush.load = load_n * (0.5 + 0.4 * flat(generator));
        if (i % 11 == 0) brush.load = 1.3 * load_n;
        if (i % 501 == 500) brush.load = 0.0;
        brush.step(s * (flat(generator) + 0.3), s * flat(generator));
      }
      CHECK(brush.imbalance < 1e-12);
      CHECK(brush.most_negative >= 0.0);
    }
  }
}

TEST_CASE("Merging keeps the error of walks that never leave a small region bounded", "[cohorts]") {
  const SnapLength law = SnapLength::lognormal(dbar, 0.3);
  const double kinetic = law.moment(2) / (2.0 * law.mean()) / dbar;
  for (const auto& [name, most] : std::vector<std::pair<std::string, double>>{
           {"winding", 0.2}, {"disc", 1.0}, {"circle", 1.0}, {"figure of eight", 1.0}, {"tremor", 1.0}}) {
    const std::vector<Point> path = made_up_path(name, 3000);
    Brush fine(law, infinite_options(32.0)), brush(law);
    double squares = 0.0;
    for (const Point& d : path) {
      fine.step(d.x, d.y);
      brush.step(d.x, d.y);
      squares += std::pow(fine.x() - brush.x(), 2) + std::pow(fine.y() - brush.y(), 2);
    }
    const double percent = 100.0 * std::sqrt(squares / 3000.0) / kinetic;
    INFO(name << ": rms " << percent << " % of kinetic friction");
    CHECK(percent < most);
    CHECK(brush.imbalance < 1e-12);
  }
}

TEST_CASE("A motion and back within a step is missed, which costs what the law's density says",
          "[cohorts][physics]") {
  // In first loading, bent by x, the share p(x) a of the bristles snaps on a path a further, and each loses
  // x. In steady sliding the share a / m1 snaps, and each loses m1 on average.
  for (const double spread : {0.1, 0.3, 1.0}) {
    const SnapLength law = SnapLength::lognormal(dbar, spread);
    const double deviation = std::sqrt(std::log1p(spread * spread));
    const double most = std::max(1.0 / (deviation * std::sqrt(2.0 * M_PI)), 1.0);  // largest x p(x), or 1
    double largest = 0.0;
    for (double x = 0.1; x < 3.0; x += 0.1) {
      OnePatch patch(plain_material(law, SnapRule::redraw), infinite_options(64.0, 1));
      const double before = patch.step(x * dbar, 0.0, load_n).elastic[0], a = 0.02;
      for (int i = 0; i < 10; ++i) patch.step(0.1 * a * dbar, 0.0, load_n);
      Response out;
      for (int i = 0; i < 10; ++i) out = patch.step(-0.1 * a * dbar, 0.0, load_n);
      largest = std::max(largest, (out.elastic[0] - before) / (load_n * dbar * a));
    }
    CHECK(largest < 1.05 * most);
    if (spread < 1.0) CHECK(largest > 0.9 * most);
  }
}

TEST_CASE("What an infinite brush cannot be is refused with a way out", "[cohorts][bad_input]") {
  PatchBatch batch;
  const Material redraw = plain_material(SnapLength::lognormal(dbar, 0.3), SnapRule::redraw);
  CHECK_THROWS_WITH(batch.add(plain_material(uniform, SnapRule::keep), infinite_options()),
                    Catch::Contains("SnapRule::redraw"));
  CHECK_THROWS_WITH(batch.add(plain_material(SnapLength::single(dbar), SnapRule::redraw), infinite_options()),
                    Catch::Contains("snap_length.cv = 0") && Catch::Contains("representatives"));
  CHECK_THROWS_WITH(batch.add(redraw, infinite_options(0.5)), Catch::Contains("resolution = 0.5"));
  // Checks that the infinite brush accepts a law wider than representatives accept.
  CHECK_NOTHROW(
      batch.add(plain_material(SnapLength::lognormal(dbar, 2.0), SnapRule::redraw), infinite_options()));
}

TEST_CASE("Short bristles among long ones are followed in pieces of their own length", "[cohorts][rubbing]") {
  // Law by a table: a third of the lengths is a twentieth of the mean, which is less than half a piece (an
  // eighth of the mean).
  const std::vector<double> lengths{1e-6, 1e-6, 1e-5, 1e-4};
  for (const double renewal : {0.0, 0.3, 1.0}) {
    const Material material = Material{}
                                  .with_snap_length(SnapLength::table(lengths))
                                  .with_snap_rule(SnapRule::redraw)
                                  .with_shared_renewal(renewal);
    const double right = material.kinetic_coefficient(), step = 0.037 * material.snap_length.mean();
    const auto off = [&](double resolution) {
      OnePatch patch(material, infinite_options(resolution).with_max_normal_load(1.0));
      double mean = 0.0;
      for (int k = 0; k < 2000; ++k) {
        const Response r = patch.step(step, 0.0, 1.0);
        if (k >= 1000) mean -= r.mean[0] / 1000.0;
      }
      return mean / right - 1.0;
    };
    const double usual = off(8.0), fine = off(32.0);
    CAPTURE(renewal, right, usual, fine);
    CHECK(std::abs(usual) < 0.01);
    CHECK(std::abs(fine) < 0.01);
  }
}

TEST_CASE("A load that wavers along a path does the same along either axis", "[cohorts][load]") {
  // Checks for any direction that cohorts of snapped bristles and of those that entered elsewhere stay apart.
  Brush along_x(SnapLength::lognormal(dbar, 0.3)), along_y(SnapLength::lognormal(dbar, 0.3));
  for (int k = 0; k < 400; ++k) {
    const double load = load_n * (0.3 + 0.6 * std::abs(std::sin(0.37 * k)));
    along_x.load = along_y.load = load;
    const double distance = k % 40 < 30 ? 0.05 : -0.03;
    along_x.step(distance, 0.0);
    along_y.step(0.0, distance);
    expect_near(along_y.y(), along_x.x(), 1e-9, "mean deflection");
    expect_near(along_y.patch.energy(), along_x.patch.energy(), 1e-9 * load_n * dbar * dbar, "energy");
  }
  CHECK(along_y.x() == 0.0);
}

namespace {

/// Fills the part of the stack where the next call has its local variables, so that reading one unset shows.
[[gnu::noinline]] double fill_stack(double with) {
  volatile double numbers[40000];
  for (volatile double& x : numbers) x = with;
  return numbers[39999];
}

}  // namespace

TEST_CASE("A trial that bears many cohorts answers what the step does, whatever the stack held",
          "[cohorts]") {
  for (const double left : {1.0, 0x1p40, -3.0, static_cast<double>(NAN)})
    for (const double length : {0.9, 1.4, 2.2, 3.0})
      for (const int before : {0, 1, 3}) {
        OnePatch patch(plain_material(SnapLength::lognormal(dbar, 0.3), SnapRule::redraw),
                       infinite_options());
        patch.step(0.0, 0.0, load_n);
        for (int k = 0; k < before; ++k) patch.step(0.3 * dbar, 0.0, load_n);
        Motion motion{patch.id, {length * dbar, 0.0}, load_n};
        CHECK_FALSE(fill_stack(left) == 0.5);
        const Response trial = patch.batch.find_force(tick, motion);
        const Response done = patch.step(motion);
        INFO("stack of " << left << ", " << length << " lengths after " << before << " steps");
        CHECK(first_difference(trial, done) == "");
      }
}

}  // namespace bristle_test::test_cohorts
