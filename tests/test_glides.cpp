// Glides: slides in which the infinite brush carries its steady state along a path that turns slowly, without
// visiting its pieces. They are compared with a brush that takes its pieces in each step. That brush ages by
// 1e-9, which keeps it from gliding and changes the force in the ninth digit only.
#include <catch2/catch.hpp>

#include <cmath>
#include <vector>

#include "expect.hpp"
#include "infinite_brush.hpp"
#include "scenes.hpp"

namespace bristle_test::test_glides {

namespace {

Material law_of(const SnapLength& law, double renewal, double residual) {
  Material m = plain_material(law, SnapRule::redraw);
  m.shared_renewal = renewal;
  m.residual_length = residual * dbar;
  return m;
}
Material in_pieces(Material m) { return m.with_ageing(bristle::Ageing::logarithmic(1e-9, 1.0)); }

/// Two brushes on one path: one glides, the other takes its path piece by piece. Lengths are in mean snap
/// lengths, forces over kinetic friction.
struct Pair {
  explicit Pair(const Material& m, double finer) : glides(m), pieces(in_pieces(m), infinite_options(finer)) {}

  void step(double way) {
    const double dx = way * std::cos(direction), dy = way * std::sin(direction);
    glides.step(dx, dy);
    pieces.step(dx, dy);
    const double kinetic = std::hypot(pieces.x(), pieces.y());
    error = std::hypot(glides.x() - pieces.x(), glides.y() - pieces.y()) / kinetic;
    const double(&a)[2] = glides.response.mean;
    const double(&b)[2] = pieces.response.mean;
    mean_error = std::hypot(a[0] - b[0], a[1] - b[1]) / std::hypot(b[0], b[1]);
    loss_error = std::abs(glides.response.dissipated / pieces.response.dissipated - 1.0);
  }
  bool is_gliding() const { return glides.patch.report.bristles_visited == 0; }

  Brush glides, pieces;
  double direction = 0.3;
  double error = 0.0, mean_error = 0.0, loss_error = 0.0;
};

struct Law {
  const char* name;
  Material material;
  double forget;  ///< path after which the brush may glide, mean snap lengths
};
std::vector<Law> laws() {
  return {{"lognormal 0.3", law_of(SnapLength::lognormal(dbar, 0.3), 0.0, 0.0), 30.0},
          {"lognormal 0.3, renewal", law_of(SnapLength::lognormal(dbar, 0.3), 1.0, 0.2), 30.0},
          {"exponential", law_of(SnapLength::exponential(dbar), 0.0, 0.0), 60.0}};
}

}  // namespace

TEST_CASE("On a circle an infinite brush glides, with the force of many pieces", "[cohorts][glide]") {
  // Tolerance: at eight pieces per mean length the force differs from that at 32 by at most 1.3e-3 (law with
  // renewal), 6e-4 (exponential) and 1e-4 (others), whether the brush glides or not.
  for (const Law& law : laws())
    for (const double radius : {40.0, 200.0})
      for (const double way : {0.05, 0.5, 1.0, 2.0}) {
        if (law.forget > 30.0 && way < 0.1) continue;
        if (way / radius > 0.03) continue;
        INFO(law.name << ", radius " << radius << ", steps of " << way);
        Pair pair(law.material, 32.0);
        double worst = 0.0, worst_mean = 0.0, worst_loss = 0.0;
        int glides = 0, steps = 0;
        for (double gone = 0.0; gone < law.forget + 8.0; gone += way) {
          pair.direction += way / radius;
          pair.step(way);
          if (gone < law.forget) continue;
          ++steps;
          glides += pair.is_gliding();
          worst = std::max(worst, pair.error);
          worst_mean = std::max(worst_mean, pair.mean_error);
          worst_loss = std::max(worst_loss, pair.loss_error);
        }
        CHECK(glides == steps);
        expect_near(worst, 0.0, 2e-3, "force");
        expect_near(worst_mean, 0.0, 5e-3, "mean force");
        expect_near(worst_loss, 0.0, 4e-3, "what is dissipated");
        expect_near(pair.glides.imbalance, 0.0, 1e-12, "energy");
        CHECK(pair.glides.most_negative >= 0.0);
      }
}

TEST_CASE("The force aside of a slide that turns is that of its bristles' lag", "[cohorts][glide]") {
  // A bristle whose tip has followed a path of length r and curvature c is bent by r along the path and by -c
  // r^2 / 2 across it. The mean across is -c E[delta^3] / (6 E[delta]), with delta the snap length.
  const SnapLength law = SnapLength::lognormal(dbar, 0.3);
  const double radius = 100.0, way = 0.1;
  Brush brush(law);
  double direction = 0.0;
  for (int i = 0; i < 600; ++i) {
    direction += way / radius;
    brush.step(way * std::cos(direction), way * std::sin(direction));
  }
  CHECK(brush.patch.report.bristles_visited == 0);
  const double tangent = direction + 0.5 * way / radius;
  const double aside = brush.y() * std::cos(tangent) - brush.x() * std::sin(tangent);
  const double along = brush.x() * std::cos(tangent) + brush.y() * std::sin(tangent);
  expect_near(aside, -law.moment(3) / (6.0 * law.mean() * dbar * dbar) / radius, 2e-5, "across");
  expect_near(along, kinetic(law), 3e-4, "along");
}

TEST_CASE("A glide follows a curvature that changes, and ends where the path breaks", "[cohorts][glide]") {
  for (const Law& law : laws()) {
    INFO(law.name);
    Pair pair(law.material, 32.0);
    const double way = 0.4;
    double gone = 0.0, worst = 0.0, after = 0.0;
    int glides = 0;
    for (; gone < 2.0 * law.forget; gone += way) {
      // Turns gently: the path's curvature is up to 0.02 rad per mean snap length.
      pair.direction += way * 0.02 * std::sin(gone / 12.0);
      pair.step(way);
      if (gone < law.forget) continue;
      glides += pair.is_gliding();
      worst = std::max(worst, pair.error);
    }
    CHECK(glides > 20);
    expect_near(worst, 0.0, 2.5e-3, "gliding");
    // Turns sharply back, sharply aside, then slightly; each turn ends the brush's glide (steady slide).
    for (const double turn : {3.0, 1.5, 0.1}) {
      pair.direction += turn;
      for (int i = 0; i < 12; ++i) {
        pair.step(0.2);
        CHECK_FALSE(pair.is_gliding());
        after = std::max(after, pair.error * std::hypot(pair.pieces.x(), pair.pieces.y()) / 0.5);
      }
    }
    expect_near(after, 0.0, 0.012, "after the break");
    expect_near(pair.glides.imbalance, 0.0, 1e-12, "energy");
  }
}

TEST_CASE("Bristles that are read in a glide have its force, and reading changes nothing",
          "[cohorts][glide][determinism]") {
  const Material material = law_of(SnapLength::lognormal(dbar, 0.3), 1.0, 0.1);
  OnePatch plain(material, infinite_options()), watched(material, infinite_options());
  double direction = 0.0;
  const auto turn = [&](int i) { return i < 160 ? 0.002 * std::sin(0.02 * i) : i < 180 ? 0.7 : 0.001; };
  for (int i = 0; i < 300; ++i) {
    direction += turn(i);
    const double dx = 0.3 * dbar * std::cos(direction), dy = 0.3 * dbar * std::sin(direction);
    plain.step(dx, dy, load_n);
    const Response response = watched.step(dx, dy, load_n);
    double mean[2] = {0.0, 0.0};
    const Bristles shown = read(watched, 4096);
    for (std::size_t k = 0; k < shown.zx.size(); ++k) {
      mean[0] += shown.zx[k] / static_cast<double>(shown.zx.size());
      mean[1] += shown.zy[k] / static_cast<double>(shown.zx.size());
    }
    if (i > 5)
      expect_near(std::hypot(mean[0] * load_n + response.elastic[0], mean[1] * load_n + response.elastic[1]),
                  0.0, 2e-3 * load_n * dbar, "bristles shown");
  }
  CHECK(plain.hash() == watched.hash());
}

namespace {

/// Returns step i of a motion with all kinds of steps in turns: tremor, slides that go straight on, turn
/// slowly or sharply, rests, strokes within presliding, creep, another load, a given velocity, a step of many
/// lengths.
Motion motion_of(int i) {
  const double kinds[][2] = {{0.03, 0.0},  {0.1, 0.0}, {0.1, 0.002}, {0.3, 0.7},
                             {3.0, 0.001}, {0.0, 0.0}, {0.05, 0.0}};
  const int which = i / 150 % 7;
  const double(&kind)[2] = kinds[which];
  const bool goes_back = (which == 0 && i % 2 == 1) || (which == 6 && i / 12 % 2 == 1);
  const double angle = 0.4 + kind[1] * i;
  const double way = (goes_back ? -1.0 : 1.0) * kind[0] * dbar;
  Motion motion;
  motion.displacement[0] = way * std::cos(angle);
  motion.displacement[1] = way * std::sin(angle);
  if (i % 50 == 49) motion.displacement[1] = 1e-22;
  if (i % 211 == 210) motion.displacement[0] = 1e25 * dbar;
  motion.normal_load = i % 70 < 60 ? load_n : 0.9 * load_n;
  motion.has_velocity = i % 3 == 0 ? 1 : 0;
  motion.velocity[0] = 0.1;
  return motion;
}

void check_same(const Response& a, const Response& b) {
  for (int axis = 0; axis < 2; ++axis) {
    expect(a.end[axis] == b.end[axis], "end");
    expect(a.elastic[axis] == b.elastic[axis], "elastic");
    expect(a.damper[axis] == b.damper[axis], "damper");
  }
  expect(a.status == b.status, "status");
  expect(a.stiffness == b.stiffness && a.damping == b.damping, "stiffness and damping");
  expect(a.force_limit == b.force_limit, "force limit");
}

}  // namespace

TEST_CASE("A step that sticks or glides has the same bits by the short way",
          "[cohorts][glide][determinism]") {
  // An eager batch visits every bristle: its brushes take the pieces of every step and never glide.
  const Material infinite = law_of(SnapLength::lognormal(dbar, 0.3), 1.0, 0.1);
  const Material damped = law_of(SnapLength::lognormal(dbar, 0.3), 0.0, 0.0).with_viscous_friction(2.0);
  const Material keep = plain_material(SnapLength::uniform(0.5 * dbar, 1.5 * dbar), SnapRule::keep);
  const PatchOptions representatives = plain_options(1000, 2, Precision::single, Outputs::end);
  struct Case {
    const char* name;
    Material material;
    PatchOptions options;
  };
  const Case cases[] = {{"infinite", infinite, infinite_options().with_outputs(Outputs::end)},
                        {"viscous", damped, infinite_options().with_outputs(Outputs::end)},
                        {"mean", infinite, infinite_options().with_outputs(Outputs::mean)},
                        {"representatives", keep, representatives}};
  for (const Case& what : cases) {
    INFO(what.name);
    OnePatch quick(what.material, what.options);
    OnePatch eager(what.material, what.options, stepped_eagerly());
    int unasked = 0;  // number of steps that visited no bristle, in glides
    for (int i = 0; i < 3600; ++i) {
      Motion motion = motion_of(i);
      motion.id = quick.id;
      const Response tried = quick.batch.find_force(tick, motion);
      const Response a = quick.step(motion);
      motion.id = eager.id;
      const Response b = eager.step(motion);
      check_same(a, b);
      check_same(tried, b);
      expect(quick.hash() == eager.hash(), "state");
      unasked += quick.report.bristles_visited == 0;
    }
    CHECK(unasked > 500);
  }
}

TEST_CASE("A glide counts the fractions of a bristle that its steps snap", "[cohorts][glide]") {
  // Load of a third of a bristle, which on a straight slide snaps once in three mean snap lengths, whatever
  // the steps' length.
  const double bristles = 1.0 / 3.0;
  OnePatch patch(plain_material(SnapLength::lognormal(dbar, 0.3), SnapRule::redraw),
                 infinite_options().with_max_normal_load(bristles));
  for (int k = 0; k < 100; ++k) patch.step(0.4 * dbar, 0.0, bristles);
  CHECK(patch.report.bristles_visited == 0);
  double snaps = 0.0, way = 0.0;
  for (int k = 0; k < 600; ++k) {
    const double step = k % 3 == 0 ? 1.7 : 0.4;
    way += step;
    snaps += static_cast<double>(patch.step(step * dbar, 0.0, bristles).snaps);
    if (k % 7 == 0) {
      const Motion trial{patch.id, {0.9 * dbar, 0.0}, bristles};
      patch.batch.find_force(tick, trial);
    }
  }
  CHECK(snaps == Approx(bristles * way).margin(1.1));
}

TEST_CASE("A long straight step of a glide leaves nothing of a circle before it", "[cohorts][glide]") {
  Brush brush(SnapLength::lognormal(dbar, 0.3));
  double direction = 0.0;
  for (int i = 0; i < 200; ++i) {
    direction += 0.4 / 40.0;
    brush.step(0.4 * std::cos(direction), 0.4 * std::sin(direction));
  }
  CHECK(brush.patch.report.bristles_visited == 0);
  for (const double way : {30.0, 0.02, 0.02, 0.3}) {
    brush.step(way * std::cos(direction), way * std::sin(direction));
    CHECK(brush.patch.report.bristles_visited == 0);
    const double aside = brush.y() * std::cos(direction) - brush.x() * std::sin(direction);
    INFO("after a step of " << way);
    CHECK(std::abs(aside) < 1e-4);
  }
  // A turn by a leaves bristles bent by u before it aside by a u. Until they snap, that adds up to a u^2 / 2
  // along the step, and E[u^2] is m3 / (3 m1).
  direction += 0.02;
  brush.step(4.0 * std::cos(direction), 4.0 * std::sin(direction));
  CHECK(brush.patch.report.bristles_visited == 0);
  const double(&mean)[2] = brush.response.mean;
  const double aside = (mean[0] * std::sin(direction) - mean[1] * std::cos(direction)) / (load_n * dbar);
  const SnapLength law = SnapLength::lognormal(dbar, 0.3);
  expect_near(aside, -0.02 * law.moment(3) / (6.0 * law.mean() * dbar * dbar) / 4.0, 2e-5, "mean aside");
}

TEST_CASE("A short step that turns off a long one turns no bristle bent before", "[cohorts][glide]") {
  // Bristles bent by u in steady sliding, with density S(u) / m1, stay bent by u along the old direction
  // until they snap; so across the new one, turned by a, the deflection after a step s is -sin(a) int u S(u +
  // s) du / m1, to second order in a.
  const SnapLength law = SnapLength::lognormal(dbar, 0.3);
  const double step = 0.3;
  double across = 0.0;
  constexpr int parts = 10000;
  constexpr double width = 4.0 / parts;
  for (int i = 0; i < parts; ++i) {
    const double u = (i + 0.5) * width;
    across += u * law.survival((u + step) * dbar) * width;
  }
  for (const double turn : {0.03, -0.06}) {
    Brush brush(law);
    for (int i = 0; i < 5; ++i) brush.step(8.0);
    CHECK(brush.patch.report.bristles_visited == 0);
    brush.step(step * std::cos(turn), step * std::sin(turn));
    INFO("turned by " << turn);
    const double aside = brush.y() * std::cos(turn) - brush.x() * std::sin(turn);
    expect_near(aside, -std::sin(turn) * across, 3e-4 * std::abs(turn), "across");
  }
}

}  // namespace bristle_test::test_glides
