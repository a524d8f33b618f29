// HapticPoint, from device positions to forces: displacements, the damper's velocity, a force limit that adds
// no energy.
#include <catch2/catch.hpp>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <bristle/haptic_point.hpp>

#include "expect.hpp"
#include "scenes.hpp"

namespace bristle_test::test_haptic_point {

using bristle::Coefficients;
using bristle::HapticOptions;
using bristle::HapticPoint;
using bristle::WindowedVelocity;
using Eigen::Vector3d;

namespace {

/// Returns a material with skin-like friction. It is made at the first use, because making it takes longer
/// than other tests take to start.
const Material& skin() {
  static const Material made = Material::from_coefficients(
      Coefficients{}.with_kinetic(0.5).with_peak(0.55).with_presliding_length(20e-6).with_damping_per_newton(
          2.0));
  return made;
}

/// A haptic point pressed on a floor (z = 0) of the given stiffness, N/m.
struct Floor {
  explicit Floor(const HapticOptions& options, double highest_load = 12.0)
      : point(options),
        patch(batch.add(skin(), PatchOptions{}
                                    .with_max_normal_load(highest_load)
                                    .with_bristles(2000)
                                    .with_outputs(Outputs::all))) {
    motion.id = patch;
  }
  Vector3d step(const Vector3d& position, double stiffness = 500.0) {
    return step_with(position, stiffness * std::max(0.0, -position[2]));
  }
  Vector3d step_with(const Vector3d& position, double wall) {
    point.prepare(tick, position, Vector3d::UnitZ(), wall, motion);
    batch.step(tick, {&motion, 1}, {&response, 1});
    return point.finish(response);
  }
  HapticPoint point;
  PatchBatch batch;
  PatchId patch;
  Motion motion;
  Response response;
};

double rounded(double x, double count) { return count * std::round(x / count); }

/// Returns the work that the hand does on a cycle: press to the limit, slide a little while pressing on, let
/// go of the friction, come out. `force` gives the force on the hand at each position. Integrates by the
/// trapezoidal rule, so that the delay of a tick does not count.
template <class Force>
double work_of_cycle(const Force& force) {
  Vector3d position(0, 0, 0.001), before = position;
  Vector3d last = force(position);
  double work = 0.0;
  const auto go = [&](double x, double z, int ticks) {
    const Vector3d from = position, to(x, 0.0, z);
    for (int i = 1; i <= ticks; ++i) {
      before = position;
      position = from + (to - from) * (static_cast<double>(i) / ticks);
      const Vector3d now = force(position);
      work -= 0.5 * (last + now).dot(position - before);
      last = now;
    }
  };
  go(0.0, -0.005, 400);       // the hand presses to 2.5 N
  go(400e-6, -0.020, 2000);   // the hand presses on to 10 N while it slides
  go(389.5e-6, -0.020, 200);  // the hand moves back so far that friction vanishes
  go(389.5e-6, 0.001, 1000);  // the hand comes out of the wall
  return work;
}

}  // namespace

TEST_CASE("What the patch is moved by adds up to what the device moved, noise and gaps included",
          "[haptic]") {
  Floor floor(HapticOptions{}.with_resolution(20e-6));
  std::mt19937_64 random(1);
  std::normal_distribution<double> gauss;
  Vector3d position(0.01, 0.02, -0.001), first = position;
  double sum[2] = {0.0, 0.0};
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (int i = 0; i < 2000; ++i) {
    position += 1e-5 * Vector3d(gauss(random), gauss(random), 0.0);
    if (i % 50 == 7) {
      const Vector3d force = floor.step(Vector3d(nan, 0, 0));
      expect(force == Vector3d::Zero(), "no force for a position that is none");
      expect(has(floor.response.status, Status::bad_input), "and a status that says so");
      continue;
    }
    if (i == 0) first = position;
    expect(floor.step(position).allFinite(), "finite");
    for (int a : {0, 1}) sum[a] += floor.motion.displacement[a];
  }
  const Vector3d along = floor.point.frame().along(), aside = floor.point.frame().aside();
  CHECK(sum[0] == Approx((position - first).dot(along)).margin(1e-15));
  CHECK(sum[1] == Approx((position - first).dot(aside)).margin(1e-15));
  // After restart() the next position is a new start, so a jump of the device is no displacement.
  floor.point.restart();
  floor.step(position + Vector3d(1.0, 0.0, 0.0));
  CHECK(floor.motion.displacement[0] == 0.0);
}

TEST_CASE("Forces stay within the device's limit, wall and friction in their true proportion", "[haptic]") {
  const double limit = 3.3;
  Floor floor(HapticOptions{}.with_force_limit(limit).with_peak_coefficient(skin().peak_coefficient()));
  std::mt19937_64 random(2);
  std::normal_distribution<double> gauss;
  Vector3d position(0, 0, 0);
  int limited = 0;
  for (int i = 0; i < 20000; ++i) {
    position += Vector3d(2e-5 * gauss(random), 2e-5 * gauss(random), 0.0);
    position[2] = -0.006 * (1.0 - std::cos(0.003 * i));  // the hand presses up to 6 N
    if (i % 1000 < 3) position[0] += 1e-3;               // the hand jerks by 1 mm in each of three ticks
    const Vector3d force = floor.step(position);
    expect(force.norm() <= limit * (1.0 + 1e-12), "within the limit");
    limited += floor.point.limited() ? 1 : 0;
  }
  CHECK(limited > 5000);
  // Slides slowly under 1 N and 6 N of wall force: the total force leans equally far from the normal.
  double lean[2];
  for (int k : {0, 1}) {
    Floor slow(HapticOptions{}.with_force_limit(limit).with_peak_coefficient(skin().peak_coefficient()));
    Vector3d mean(0, 0, 0);
    for (int i = 0; i < 3000; ++i) {
      const Vector3d force = slow.step(Vector3d(1e-6 * i, 0.0, k == 0 ? -0.002 : -0.012));
      if (i >= 1000) mean += force / 2000.0;
    }
    lean[k] = -mean.dot(Vector3d::UnitX()) / mean[2];
  }
  CHECK(lean[0] == Approx(0.5).epsilon(0.03));
  CHECK(lean[1] == Approx(lean[0]).epsilon(0.02));
}

TEST_CASE("The limit gives no energy to the hand where scaling the whole force would", "[haptic]") {
  const double limit = 3.0;
  Floor scaled(HapticOptions{});
  const double work_scaled = work_of_cycle([&](const Vector3d& position) {
    const Vector3d force = scaled.step(position);
    return Vector3d(force * std::min(1.0, limit / std::max(1e-9, force.norm())));
  });
  Floor capped(HapticOptions{}.with_force_limit(limit).with_peak_coefficient(skin().peak_coefficient()));
  const double work_capped = work_of_cycle([&](const Vector3d& position) { return capped.step(position); });
  Floor free(HapticOptions{});
  const double work_free = work_of_cycle([&](const Vector3d& position) { return free.step(position); });
  // Work expected by hand. With kinetic friction 0.5 the wall's force is scaled to 3 N / sqrt(1.25) = 2.68 N
  // on the way in from 5.4 to 20 mm, and to 3 N on the way out to 6 mm: the hand gains some 4.5 mJ, less some
  // 0.6 mJ of friction over 0.4 mm.
  CHECK(work_scaled < -3e-3);
  CHECK(work_capped > 1e-4);
  CHECK(work_free > work_capped);
  CAPTURE(work_scaled, work_capped, work_free);
  // HapticPoint::taken() equals this work except for its delay of a tick, which adds stiffness times
  // (displacement in a tick)^2 / 2.
  const double delay =
      0.5 * 500.0 *
      (400 * std::pow(0.006 / 400, 2) + 2000 * std::pow(0.015 / 2000, 2) + 1000 * std::pow(0.021 / 1000, 2));
  CHECK(capped.point.taken() > work_capped - 1.1 * delay - 1e-4);
}

TEST_CASE("A windowed velocity is exact on a ramp and far steadier than a difference", "[haptic]") {
  const double count = 20e-6, dt = 1e-3;
  for (double speed : {0.0, 0.003, 0.05, 0.4}) {
    WindowedVelocity window;
    double worst = 0.0, worst_difference = 0.0, last = 0.0;
    for (int i = 0; i < 500; ++i) {
      const double x = rounded(speed * dt * i + 3e-6, count);
      const double v = window.update(dt, {x, 0.0, 0.0}, count)[0];
      if (i > 50) {
        worst = std::max(worst, std::abs(v - speed));
        worst_difference = std::max(worst_difference, std::abs((x - last) / dt - speed));
      }
      last = x;
    }
    INFO("speed " << speed << ": off by " << worst << ", a difference by " << worst_difference);
    // Tolerance: the velocity over a window has an error of half an encoder count at either end.
    CHECK(window.window() == WindowedVelocity::longest);
    CHECK(worst <= count / (WindowedVelocity::longest * dt) * 1.000001);
    if (speed == 0.003) CHECK(worst_difference > 0.015);
  }
  // After a reversal the window of the velocity shrinks at once to the ticks since the reversal.
  WindowedVelocity window;
  for (int i = 0; i < 100; ++i) window.update(dt, {1e-4 * i, 0.0, 0.0}, count);
  for (int i = 1; i <= 3; ++i) {
    const double v = window.update(dt, {1e-4 * (99 - i), 0.0, 0.0}, count)[0];
    CHECK(v == Approx(-0.1));
    CHECK(window.window() == i);
  }
  // Checks the velocity over a window for ticks of unequal length too.
  window.restart();
  double x = 0.0;
  for (int i = 0; i < 40; ++i) {
    const double step = i % 3 ? 1e-3 : 2.5e-3;
    x += 0.2 * step;
    window.update(step, {0.0, x, 0.0}, 1e-9);
  }
  CHECK(window.update(1e-3, {0.0, x + 2e-4, 0.0}, 1e-9)[1] == Approx(0.2));
  CHECK(window.window() == WindowedVelocity::longest);
}

TEST_CASE("A windowed velocity is that of the longest window, however long the motion lasts", "[haptic]") {
  constexpr int n = WindowedVelocity::longest;
  std::mt19937 random(2);
  std::uniform_real_distribution<double> noise(-4e-6, 4e-6);
  WindowedVelocity window;
  std::vector<double> x;
  for (int i = 0; i < 4 * n; ++i) {
    x.push_back(1e-4 * i + noise(random));  // within a band of one count, 20 um, about a ramp
    const double v = window.update(tick, {x.back(), 0.0, 0.0}, 20e-6)[0];
    const int ticks = std::min(i, n);
    CHECK(window.window() == ticks);
    if (i > 0)
      CHECK(v == Approx((x.back() - x[x.size() - 1 - static_cast<std::size_t>(ticks)]) / (ticks * tick)));
  }
}

TEST_CASE("After a restart a point has neither moved nor worked, and its velocity begins anew", "[haptic]") {
  Floor floor(HapticOptions{}.with_resolution(1e-6));
  Vector3d position(0, 0, -0.002);
  for (int i = 0; i < 50; ++i) floor.step(position += Vector3d(1e-5, 0, 0));
  REQUIRE(floor.step(position += Vector3d(1e-5, 0, 0)).norm() > 0.5);
  const double taken = floor.point.taken();
  floor.point.restart();
  floor.step(position += Vector3d(0.3, -0.2, 0));
  CHECK(floor.point.taken() == taken);
  CHECK((floor.motion.displacement[0] == 0.0 && floor.motion.displacement[1] == 0.0));
  CHECK((floor.motion.velocity[0] == 0.0 && floor.motion.velocity[1] == 0.0));
  floor.step(position += Vector3d(1e-5, 0, 0));
  const Vector3d along = floor.point.frame().along(), aside = floor.point.frame().aside();
  const Vector3d velocity = floor.motion.velocity[0] * along + floor.motion.velocity[1] * aside;
  CHECK((velocity - Vector3d(1e-5 / tick, 0, 0)).norm() < 1e-9);
}

TEST_CASE("A windowed velocity that opposes the displacement is taken as none", "[haptic]") {
  HapticPoint point(HapticOptions{}.with_resolution(20e-6));
  Motion motion;
  double x = 0.0;
  for (int i = 0; i < 20; ++i) {
    point.prepare(tick, {x, 0.0, 0.0}, {0, 0, 1}, 1.0, motion);
    x += 10e-6;
  }
  CHECK(std::abs(motion.velocity[0]) + std::abs(motion.velocity[1]) == Approx(0.01));
  // The hand moves back by less than an encoder count. The velocity over many ticks is still forward, so the
  // point must report 0, not a velocity against the displacement.
  point.prepare(tick, {x - 15e-6, 0.0, 0.0}, {0, 0, 1}, 1.0, motion);
  CHECK(std::abs(motion.displacement[0]) + std::abs(motion.displacement[1]) == Approx(5e-6));
  CHECK(motion.has_velocity);
  CHECK(motion.velocity[0] == 0.0);
  CHECK(motion.velocity[1] == 0.0);
}

TEST_CASE("Only the damper is cut where it takes a force over the limit", "[haptic]") {
  HapticPoint point(HapticOptions{}.with_force_limit(2.0).with_peak_coefficient(0.5));
  Motion motion;
  point.prepare(tick, {0, 0, 0}, {0, 0, 1}, 1.0, motion);
  CHECK(motion.normal_load == 1.0);
  Response response;
  // The limit is 2 N and the wall takes 1 N, which leaves sqrt(4 - 1) = 1.7320508 N for friction.
  response.elastic[0] = -0.5;
  response.damper[1] = -3.0;
  Vector3d force = point.finish(response);
  CHECK(point.limited());
  CHECK(force.norm() == Approx(2.0).epsilon(1e-14));
  // Checks that the force limit cuts only the damper's part, not the elastic part.
  CHECK(std::abs(point.frame().along().dot(force) + 0.5) < 1e-15);
  response.elastic[0] = -4.0;
  force = point.finish(response);
  CHECK(point.frame().along().dot(force) == Approx(-std::sqrt(3.0)));
  CHECK(std::abs(point.frame().aside().dot(force)) < 1e-15);
  response.elastic[0] = -0.1;
  response.damper[1] = 0.2;
  force = point.finish(response);
  CHECK_FALSE(point.limited());
  CHECK(force[2] == 1.0);
  CHECK(force.norm() == Approx(std::sqrt(1.0 + 0.01 + 0.04)));
  // A wall force of 5 N is capped, so that friction with the coefficient 0.5 keeps within the limit of 2 N: 2
  // / sqrt(1.25).
  point.prepare(tick, {0, 0, 0}, {0, 0, 1}, 5.0, motion);
  CHECK(motion.normal_load == Approx(2.0 / std::sqrt(1.25)));
  CHECK(point.finish(Response{}).norm() == Approx(2.0 / std::sqrt(1.25)));
  point.prepare(tick, {0, 0, 0}, {0, 0, 1}, std::numeric_limits<double>::quiet_NaN(), motion);
  response.status = Status::bad_input;
  CHECK(point.finish(response) == Vector3d::Zero());
  CHECK_FALSE(point.limited());
}

TEST_CASE("The mean of a tick, where asked for, is the force of half a tick ago with the same damper",
          "[haptic]") {
  // The bristles have one length, which the motion does not reach, so they act as a spring. At constant speed
  // a spring's mean force over a tick is its force half a tick ago.
  const Material spring = Material{}.with_snap_length(SnapLength::single(1e-3)).with_viscous_friction(200.0);
  const double step = 10e-6;
  Vector3d sent[2];
  double bent = 0.0, damper = 0.0;
  for (const bool mean : {false, true}) {
    PatchBatch batch;
    Motion motion;
    motion.id = batch.add(spring, PatchOptions{}.with_max_normal_load(2.0).with_outputs(Outputs::mean));
    Response response;
    HapticPoint point(HapticOptions{}.with_mean(mean));
    for (int i = 0; i <= 20; ++i) {
      point.prepare(tick, {step * i, 0.0, 0.0}, {0, 0, 1}, 1.0, motion);
      batch.step(tick, {&motion, 1}, {&response, 1});
      sent[mean ? 1 : 0] = point.finish(response);
    }
    bent = response.stiffness * 20.0 * step;
    damper = response.damping * step / tick;
  }
  CHECK(damper > 0.1 * bent);
  CHECK(-sent[0][0] == Approx(bent + damper).epsilon(1e-6));
  CHECK(-sent[1][0] == Approx(bent * 19.5 / 20.0 + damper).epsilon(1e-6));
  // Checks that the limit also holds for the mean force: the elastic part is kept, the damper's is cut.
  HapticPoint point(HapticOptions{}.with_force_limit(2.0).with_peak_coefficient(0.5).with_mean(true));
  Motion motion;
  point.prepare(tick, {0, 0, 0}, {0, 0, 1}, 1.0, motion);
  Response response;
  response.elastic[0] = 9.0;  // end force, which must not count: the device gets the mean
  response.damper[1] = -3.0;
  response.mean[0] = -0.5;
  response.mean[1] = -3.0;
  const Vector3d force = point.finish(response);
  CHECK(force.norm() == Approx(2.0).epsilon(1e-14));
  CHECK(point.frame().along().dot(force) == Approx(-0.5));
}

TEST_CASE("A patch without the mean force gives the hand the force at the end of the tick, and says so",
          "[haptic]") {
  const Material spring = Material{}.with_snap_length(SnapLength::single(1e-3));
  for (const bool computed : {false, true}) {
    CAPTURE(computed);
    PatchBatch batch;
    Motion motion;
    motion.id = batch.add(spring, PatchOptions{}.with_max_normal_load(2.0).with_outputs(
                                      computed ? Outputs::mean : Outputs::end));
    Response response;
    HapticPoint point(HapticOptions{}.with_mean(true));
    CHECK_FALSE(point.lacks_mean());
    for (int i = 0; i <= 20; ++i) {
      point.prepare(tick, {10e-6 * i, 0.0, 0.0}, {0, 0, 1}, 1.0, motion);
      batch.step(tick, {&motion, 1}, {&response, 1});
      point.finish(response);
    }
    CHECK(point.lacks_mean() == !computed);
    const double ticks = computed ? 19.5 : 20.0;  // the mean is half a tick old
    CHECK(-point.friction()[0] == Approx(response.stiffness * ticks * 10e-6).epsilon(1e-6));
    // Checks that a contact without a force lacks nothing.
    point.prepare(tick, {200e-6, 0.0, 0.0}, {0, 0, 1}, 0.0, motion);
    response = {};
    batch.step(tick, {&motion, 1}, {&response, 1});
    point.finish(response);
    CHECK_FALSE(point.lacks_mean());
  }
}

TEST_CASE("A wall that takes all of the limit leaves a damper no force", "[haptic]") {
  // With a peak coefficient of 0 the wall may take the whole limit, although the patch still has a damper
  // force from its lubricant.
  HapticPoint point(HapticOptions{}.with_force_limit(2.0).with_peak_coefficient(0.0));
  Motion motion;
  point.prepare(tick, {0, 0, 0}, {0, 0, 1}, 5.0, motion);
  Response response;
  response.damper[0] = -0.3;
  CHECK(point.finish(response) == Vector3d(0.0, 0.0, 2.0));
  CHECK(point.limited());
}

TEST_CASE("A bad tick in contact turns no axes, and the next velocity is taken over its time too",
          "[haptic]") {
  struct BadTick {
    Vector3d position;
    double wall;
    double taken;  // work taken by the hand, J, up to and including the bad tick
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  const Vector3d lost(nan, nan, nan), found(4e-6, 0.0, 0.0);
  // The hand presses to 3 um against 1000 N/m, and each force is held for a tick, so 0, 1 and 2 mN act over 1
  // um each. Then 3 mN act over the distance to the bad position, if that is a number.
  const BadTick bad_ticks[] = {
      {lost, 0.0, 3e-9}, {lost, nan, 3e-9}, {found, nan, 6e-9}, {found, -1.0, 6e-9}, {found, infinity, 6e-9}};
  for (const BadTick& bad : bad_ticks)
    for (const double resolution : {0.0, 1e-6}) {
      CAPTURE(bad.position[0], bad.wall, resolution);
      OnePatch patch(plain_material(SnapLength::single(dbar), SnapRule::keep), plain_options(1000));
      HapticPoint point(HapticOptions{}.with_resolution(resolution));
      Motion motion;
      motion.id = patch.id;
      const auto step = [&](const Vector3d& position, const Vector3d& normal, double wall) {
        point.prepare(tick, position, normal, wall, motion);
        return point.finish(patch.step(motion));
      };
      const Vector3d up = Vector3d::UnitZ();
      for (int i = 0; i <= 3; ++i) step({1e-6 * i, 0.0, 0.0}, up, 1000.0);
      CHECK(step(bad.position, up, bad.wall) == Vector3d::Zero());
      CHECK(has(patch.report.status, Status::bad_input));
      // Tilts the normal along x. New axes for it would begin with y, so the expected force shows that the
      // frame keeps its old axes.
      const Vector3d leaning(0.01, 0.0, 1.0);
      step({5e-6, 0.0, 0.0}, leaning, 1000.0);
      CHECK(patch.report.status == Status::ok);
      const Vector3d expected = -5e-3 * Vector3d(1.0, 0.0, -0.01).normalized();
      CHECK((point.friction() - expected).norm() < 1e-6);
      CHECK(motion.has_velocity);
      CHECK(motion.velocity[0] == Approx(1e-3).epsilon(1e-4));
      CHECK(std::abs(motion.velocity[1]) < 1e-9);
      CHECK(point.taken() == Approx(bad.taken).epsilon(1e-5));
      step({6e-6, 0.0, 0.0}, leaning, 1000.0);
      CHECK(motion.has_velocity == (resolution > 0.0));
    }
}

}  // namespace bristle_test::test_haptic_point
