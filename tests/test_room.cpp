// The virtual room without its window: motion of the block, messages between the loops, behaviour when
// something fails. Uses the virtual clock, except in tests of threads.
#include <catch2/catch.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include "expect.hpp"
#include "temporary_folder.hpp"
#include "tools/libraries/files/text_file.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/products/virtual_room/collision.hpp"
#include "tools/products/virtual_room/compared.hpp"
#include "tools/products/virtual_room/haptic_loop.hpp"
#include "tools/products/virtual_room/motion_axis.hpp"
#include "tools/products/virtual_room/mouse_device.hpp"
#include "tools/products/virtual_room/parameters.hpp"
#include "tools/products/virtual_room/presets.hpp"
#include "tools/products/virtual_room/script.hpp"
#include "tools/products/virtual_room/slow_pull.hpp"
#include "tools/products/virtual_room/udp_device.hpp"

namespace bristle_test::test_room {

namespace {

using namespace room;

constexpr double g = 9.80665;
constexpr double pi = 3.14159265358979323846;

Settings few_bristles() {
  Settings s;
  s.bristles = 512;
  return s;
}

HandRow hand_at(double t, double x, double y, double z) { return {t, {true, {x, y, z}, {0, 0, 0}}}; }
/// Returns a row of a scripted hand that pushes the tool with a force instead of a spring.
HandRow with_force(double t, double fx, double fy, double fz) {
  return {t, {false, {0, 0, 0}, {fx, fy, fz}}};
}

const Snapshot& now_of(HapticLoop& loop) {
  loop.exchange().room.refresh();
  return loop.exchange().room.latest();
}
const Snapshot& after(HapticLoop& loop, std::uint64_t ticks) {
  loop.advance(ticks);
  return now_of(loop);
}

/// A run of the virtual room with a scripted hand, on the virtual clock.
class Run {
 public:
  explicit Run(const Settings& settings, std::vector<HandRow> hand = {}, double lost_at = 1e300)
      : loop_(options(settings),
              std::make_unique<PlayedHand>("script", HandMotion{std::move(hand)}, lost_at)) {}

  const Snapshot& until(double time) {
    while (ticks_ < std::llround(1e3 * time)) tick();
    return now();
  }
  const Snapshot& tick() {
    loop_.advance(1);
    ++ticks_;
    loop_.exchange().room.refresh();
    while (loop_.exchange().plot.pop(point_)) continue;
    return now();
  }
  const PlotPoint& point() const { return point_; }  ///< values of the last tick for the plots
  const Snapshot& now() { return loop_.exchange().room.latest(); }
  HapticLoop& loop() { return loop_; }

 private:
  static LoopOptions options(const Settings& settings) {
    LoopOptions o;
    o.settings = settings;
    o.record_to =
        (std::filesystem::temp_directory_path() / ("room_test_" + std::to_string(getpid()))).string();
    return o;
  }
  HapticLoop loop_;
  PlotPoint point_;
  long ticks_ = 0;
};

double load_of(const Snapshot& s, Between between) {
  double sum = 0.0;
  for (std::size_t i = 0; i < s.contacts; ++i)
    sum += s.contact[i].between == between ? s.contact[i].load : 0.0;
  return sum;
}
double friction_of(const Snapshot& s, Between between, int axis) {
  double sum = 0.0;
  for (std::size_t i = 0; i < s.contacts; ++i) {
    sum += s.contact[i].between == between ? s.contact[i].friction[axis] : 0.0;
  }
  return sum;
}
/// Returns the angle of a rotation about one of the room's axes, for rotations about that axis alone.
double turn_about(const Snapshot& s, int axis) {
  const double* q = s.block_orientation;
  return 2.0 * std::atan2(q[1 + axis], q[0]);
}
double speed(const Snapshot& s) {
  return std::hypot(s.block_velocity[0], s.block_velocity[1], s.block_velocity[2]);
}
bool is_finite(const Snapshot& s) {
  double sum = 0.0;
  for (int i = 0; i < 3; ++i) {
    sum += s.block_position[i] + s.block_velocity[i] + s.block_spin[i] + s.tool[i] + s.device_force[i];
  }
  return std::isfinite(sum);
}

}  // namespace

// ----------------------------------------------------- exchange of messages between the loops of the room

TEST_CASE("A triple buffer gives whole values, newest last, while both sides run", "[room][exchange]") {
  struct Value {
    std::uint64_t word[64] = {};
  };
  constexpr std::uint64_t last = 20000;
  TripleBuffer<Value> buffer;
  CHECK_FALSE(buffer.refresh());
  std::thread writer([&] {
    for (std::uint64_t k = 1; k <= last; ++k) {
      for (std::uint64_t& word : buffer.draft().word) word = k;
      buffer.publish();
    }
  });
  bool whole = true, ascending = true;
  std::uint64_t seen = 0;
  while (seen < last) {
    if (!buffer.refresh()) {
      std::this_thread::yield();
      continue;
    }
    const Value& value = buffer.latest();
    for (const std::uint64_t word : value.word) whole = whole && word == value.word[0];
    ascending = ascending && value.word[0] > seen;
    seen = value.word[0];
  }
  writer.join();
  CHECK(whole);
  CHECK(ascending);
  CHECK_FALSE(buffer.refresh());
}

TEST_CASE("A ring keeps the order, and counts what finds no room", "[room][exchange]") {
  SpscRing<int, 4> small;
  for (int k = 0; k < 7; ++k) CHECK(small.push(k) == (k < 4));
  CHECK(small.dropped() == 3);
  int value = -1;
  for (int k = 0; k < 4; ++k) {
    REQUIRE(small.pop(value));
    CHECK(value == k);
  }
  CHECK_FALSE(small.pop(value));

  SpscRing<int, 64> ring;
  constexpr int last = 20000;
  std::thread writer([&] {
    for (int k = 1; k <= last;) {
      if (ring.push(k)) {
        ++k;
      } else {
        std::this_thread::yield();
      }
    }
  });
  bool in_order = true;
  for (int expected = 1; expected <= last;) {
    if (!ring.pop(value)) {
      std::this_thread::yield();
      continue;
    }
    in_order = in_order && value == expected++;
  }
  writer.join();
  CHECK(in_order);
}

// ----------------------------------------------------------- the block on the floor, pushed by the tool

TEST_CASE("Block and tool touch each surface of the room from within", "[room]") {
  const RoomMeasures m;
  const struct {
    Surface surface;
    Vector3 inward, place;
  } sides[] = {{Surface::floor, {0, 0, 1}, {0, 0, 0}},
               {Surface::end_wall, {-1, 0, 0}, {m.length / 2, 0, 0}},
               {Surface::left_wall, {0, -1, 0}, {0, m.width / 2, 0}},
               {Surface::right_wall, {0, 1, 0}, {0, -m.width / 2, 0}},
               {Surface::roof, {0, 0, -1}, {0, 0, m.height}}};
  for (const auto& side : sides) {
    CAPTURE(static_cast<int>(side.surface));
    const double overlap = 0.5e-3;
    // Moves a body of this half width from inside the room into the surface.
    const auto against = [&](const Vector3& from, double half) -> Vector3 {
      return from + side.inward * ((side.place - from).dot(side.inward) + half - overlap);
    };
    const Vector3 half(m.block[0] / 2, m.block[1] / 2, m.block[2] / 2);
    Pose block;
    block.position = against({0, 0, m.height / 2}, half.dot(side.inward.cwiseAbs()));
    Touches touches;
    find_touches(m, block, against({-0.2, 0.1, 0.2}, m.tool_radius), touches);
    REQUIRE(touches.count == 5);  // four corners of the block, and the tool
    for (std::size_t i = 0; i < touches.count; ++i) {
      CHECK(touches.list[i].surface == side.surface);
      CHECK(touches.list[i].normal == side.inward);
      CHECK(touches.list[i].gap == Approx(-overlap));
    }
  }
}

TEST_CASE("A block at rest presses with its weight and does not stir", "[room]") {
  Settings settings = few_bristles();
  settings.extra_load = 1.5;
  Run run(settings);
  const Snapshot first = run.until(0.5);
  CHECK(first.contacts == 4);
  CHECK(first.bristles.total == settings.bristles);
  CHECK(load_of(first, Between::block_floor) == Approx(settings.mass * g + 1.5).epsilon(1e-9));
  double highest = 0.0;
  for (int k = 0; k < 1000; ++k) {
    const Snapshot& s = run.tick();
    for (int i = 0; i < 3; ++i) {
      highest = std::max(highest, std::fabs(s.block_position[i] - first.block_position[i]));
    }
  }
  CHECK(highest < 1e-12);
  CHECK(speed(run.now()) < 1e-12);
}

TEST_CASE("The axis of a motion turns with it within a length, and keeps its sign when the motion comes back",
          "[room]") {
  constexpr double length = 1e-3;
  MotionAxis axis;
  CHECK(axis.along(3.0, 4.0) == 3.0);  // before any motion: along x
  for (int k = 0; k < 100; ++k) axis.move(1e-8 * (k % 2 ? 1 : -1), 1e-8, length);
  CHECK(axis.along(3.0, 4.0) == 3.0);  // trembling by a thousandth of a length is no motion
  for (int k = 0; k < 100; ++k) axis.move(3e-5, 4e-5, length);
  CHECK(axis.along(3.0, 4.0) == Approx(5.0).epsilon(1e-3));
  for (int k = 0; k < 300; ++k) axis.move(-3e-5, -4e-5, length);
  CHECK(axis.along(3.0, 4.0) == Approx(5.0).epsilon(1e-3));
  // A right corner: the place behind is dragged along a tractrix, so that the lag aside is 1 / cosh(path /
  // length).
  axis = {};
  axis.move(0.0, length, length);
  for (int k = 0; k < 3000; ++k) axis.move(1e-6, 0.0, length);
  CHECK(axis.along(0.0, 1.0) == Approx(1.0 / std::cosh(3.0)).epsilon(0.01));
  CHECK(axis.along(1.0, 0.0) == Approx(std::tanh(3.0)).epsilon(0.01));
  for (int k = 0; k < 10; ++k) axis.move(0.0, -1e-2, length);
  CHECK(axis.along(0.0, -7.0) == Approx(-7.0).epsilon(1e-3));  // towards the eye is negative
}

TEST_CASE(
    "Along the motion a pushed block sticks, shows the peak and slides at the kinetic line, aside and beside "
    "the middle too",
    "[room]") {
  struct Push {
    const char* says;
    double from[2], to[2],
        least_peak;  // least_peak: of the peak, as corners of a block that turns break away in turn
  };
  const Push pushes[] = {{"along x", {-0.0581, 0.0}, {0.0119, 0.0}, 0.96},
                         {"along y", {0.0, -0.0481}, {0.0, 0.0219}, 0.96},
                         {"beside the middle", {-0.0581, 0.02}, {0.0119, 0.02}, 0.90}};
  Settings settings = few_bristles();
  settings.bristles = 4096;
  settings.presliding_length = 200e-6;
  settings.hand_damping = 20.0;
  settings.hand_stiffness = 40.0;
  const double weight = settings.mass * g;
  for (const Push& push : pushes) {
    INFO(push.says);
    Run run(settings,
            {hand_at(0.0, push.from[0], push.from[1], 0.009), hand_at(2.3, push.to[0], push.to[1], 0.009)});
    double highest = 0.0, highest_limit = 0.0, stuck_path = 0.0, sum = 0.0, farthest = 0.0;
    int count = 0;
    while (run.now().time < 2.3) {
      const Snapshot& s = run.tick();
      double limit = 0.0;
      for (std::size_t i = 0; i < s.contacts; ++i)
        limit += s.contact[i].between == Between::block_floor ? s.contact[i].limit : 0.0;
      highest_limit = std::max(highest_limit, limit);
      if (std::hypot(s.applied[0], s.applied[1]) < 0.5 * settings.kinetic * weight)
        stuck_path = std::max(stuck_path, std::hypot(s.block_position[0], s.block_position[1]));
      highest = std::max(highest, -static_cast<double>(run.point().friction));
      farthest = std::max(farthest, static_cast<double>(run.point().displacement));
      if (std::hypot(s.block_velocity[0], s.block_velocity[1]) < 0.01 || s.time < 1.5) continue;
      sum -= static_cast<double>(run.point().friction);
      ++count;
    }
    CHECK(highest_limit == Approx(settings.peak * weight).epsilon(0.01));
    CHECK(stuck_path < settings.presliding_length);
    CHECK(highest <= 1.04 * settings.peak * weight);
    CHECK(highest > push.least_peak * settings.peak * weight);
    REQUIRE(count > 300);
    CHECK(sum / count == Approx(settings.kinetic * weight).epsilon(0.03));
    CHECK(farthest ==
          Approx(std::hypot(run.now().block_position[0], run.now().block_position[1])).epsilon(0.03));
  }
}

TEST_CASE("A block pushed against a wall has friction there too", "[room]") {
  Settings settings = few_bristles();
  // Pushes the block to the wall and presses it there with 5 N, then pushes along the wall with more than the
  // floor's friction alone holds.
  const double aside = 1.4 * settings.peak * settings.mass * g;
  std::vector<HandRow> hand = {hand_at(0.0, -0.06, 0, 0.03), hand_at(1.5, 0.195, 0, 0.03),
                               with_force(1.501, 5.0, 0, 0), with_force(2.5, 5.0, 0, 0),
                               with_force(3.0, 5.0, aside, 0)};
  Run run(settings, hand);
  run.until(2.5);
  CHECK(run.now().block_position[0] == Approx(0.25).margin(2e-4));
  const double y = run.now().block_position[1];
  run.until(4.5);
  const Snapshot& s = run.now();
  // The wall's load is the part of the hand's force that the floor's friction does not bear.
  CHECK(load_of(s, Between::block_wall) - friction_of(s, Between::block_floor, 0) ==
        Approx(5.0).epsilon(0.01));
  CHECK(std::fabs(friction_of(s, Between::block_wall, 1)) > 0.2);
  CHECK(std::fabs(friction_of(s, Between::block_wall, 1)) <
        1.01 * settings.peak * load_of(s, Between::block_wall));
  CHECK(std::fabs(s.block_position[1] - y) < 3.0 * settings.presliding_length);
  CHECK(speed(s) < 1e-3);
}

TEST_CASE("A block turned by a hand holds, breaks away at its peak torque, and slides at its kinetic torque",
          "[room]") {
  const Settings settings = few_bristles();
  const RoomMeasures measures;
  const auto turned = [](double t, double angle) -> HandRow {
    return {t, {false, {0, 0, 0}, {0, 0, 0}, true, angle}};
  };
  // All four corners are equally far from the middle, so torque over (arm times weight) is the coefficient of
  // friction.
  const double arm = 0.5 * std::hypot(measures.block[0], measures.block[1]);
  const double unit = settings.mass * g * arm;

  // Half of the peak's torque bends the bristles, a torsion spring in series with the hand's. When the hand
  // lets go, they spring back.
  const double angle = 0.5 * settings.peak * unit / turn_stiffness;
  Run held(settings, {turned(0.0, 0.0), turned(1.0, angle), turned(2.0, 0.0)});
  const double bristles = held.tick().stiffness_per_newton * settings.mass * g * arm * arm;  // N m/rad
  const double bent = angle * turn_stiffness / (turn_stiffness + bristles);
  CHECK(turn_about(held.until(1.0), 2) == Approx(bent).epsilon(0.05));
  CHECK(std::fabs(turn_about(held.until(2.5), 2)) < 0.02 * bent);

  constexpr double rate = 0.1, damper = 0.015;  // hand's rate, rad/s; damping, N m s/rad
  Run run(settings, {turned(0.0, 0.0), turned(8.0, 8.0 * rate)});
  double highest = 0.0, sum = 0.0;
  for (int k = 1; k <= 8000; ++k) {
    const double torque = turn_stiffness * (1e-3 * k * rate - turn_about(run.tick(), 2));
    highest = std::max(highest, torque);
    if (k > 6000) sum += torque / 2000.0;
  }
  CHECK(highest / unit == Approx(settings.peak).epsilon(0.03));
  CHECK((sum - damper * rate) / unit == Approx(settings.kinetic).epsilon(0.02));
}

TEST_CASE("A block pushed high on a rough floor tips, pushed lower it holds, pushed harder it slides",
          "[room]") {
  Settings settings = few_bristles();
  settings.kinetic = 1.2;
  settings.peak = 1.3;
  // Pushes with 2.6 N, less than the floor's friction holds. High on the block it tips the block, which takes
  // m g / 2 times the block's length over the height of the push.
  const double push = 2.6;
  REQUIRE(push < settings.kinetic * settings.mass * g);
  REQUIRE(push * 0.055 > settings.mass * g * 0.05);
  REQUIRE(push * 0.04 < settings.mass * g * 0.05);
  const auto pushed_at = [&](double z) {
    return std::vector<HandRow>{hand_at(0.0, -0.06, 0, z), with_force(0.01, push, 0, 0)};
  };
  Run high(settings, pushed_at(0.055));
  Run low(settings, pushed_at(0.04));
  double highest_tilt = 0.0, low_tilt = 0.0;
  while (high.now().time < 1.0) {
    highest_tilt = std::max(highest_tilt, turn_about(high.tick(), 1));
    low_tilt = std::max(low_tilt, std::fabs(turn_about(low.tick(), 1)));
  }
  CHECK(highest_tilt > 0.3);
  CHECK(low_tilt < 5e-3);
  CHECK(speed(low.now()) < 0.01);
  Run sliding(few_bristles(), pushed_at(0.04));
  sliding.until(0.3);
  CHECK(std::fabs(turn_about(sliding.now(), 1)) < 5e-3);
  CHECK(sliding.now().block_velocity[0] > 0.3);
}

TEST_CASE("A tipped block that is let go falls back and lies still, without a bounce", "[room]") {
  Settings settings = few_bristles();
  settings.kinetic = 1.2;
  settings.peak = 1.3;
  Run run(settings, {hand_at(0.0, -0.06, 0, 0.055), with_force(0.01, 2.6, 0, 0), with_force(0.2, 2.6, 0, 0),
                     with_force(0.201, -1.0, 0, 0)});
  run.until(0.2);
  const double tilt = turn_about(run.now(), 1);
  REQUIRE(tilt > 0.1);
  REQUIRE(tilt < 0.8);  // the block has not tipped beyond its balance
  while (turn_about(run.now(), 1) > 1e-4 && run.now().time < 2.0) run.tick();
  const double landed = run.now().time;
  double rebound = 0.0;
  while (run.now().time < landed + 0.5) rebound = std::max(rebound, turn_about(run.tick(), 1));
  CHECK(rebound < 0.05 * tilt);
  run.until(landed + 3.0);
  CHECK(load_of(run.now(), Between::block_floor) == Approx(settings.mass * g).epsilon(1e-6));
  CHECK(std::fabs(run.now().block_spin[1]) < 1e-4);
}

TEST_CASE("On a slope under taps the brush stays, LuGre and Coulomb creep, beside each other as each alone",
          "[room]") {
  Settings settings = comparison();
  settings.bristles = 512;
  std::uint64_t hash_alone = 0;
  const auto moved_alone = [&](FrictionModel model) {
    Settings s = settings;
    s.compare = Comparison::none;
    s.model = model;
    Run run(s);
    const double moved = run.until(10.002).moved;
    if (model == settings.model) hash_alone = run.loop().state_hash();
    return moved;
  };
  Run run(settings);
  const double settled = run.until(6.0).block_position[0];
  // The block moves with the taps, so its position is compared a whole number of tap periods (0.5 s) apart.
  CHECK(std::fabs(run.until(10.0).block_position[0] - settled) < 0.05e-6);
  const Snapshot& now = run.until(10.002);
  REQUIRE(now.compared == 2);
  INFO("brush " << 1e6 * now.moved << ", LuGre " << 1e6 * now.beside[0].moved << ", Coulomb "
                << 1e6 * now.beside[1].moved << " um");
  CHECK(std::fabs(now.moved) < 0.5e-6);
  CHECK(now.beside[0].model == FrictionModel::lugre);
  CHECK(now.beside[0].moved > 100e-6);
  CHECK(now.beside[1].moved > 5e-6);
  CHECK(now.moved == moved_alone(FrictionModel::brush));
  CHECK(now.beside[0].moved == moved_alone(FrictionModel::lugre));
  CHECK(now.beside[1].moved == moved_alone(FrictionModel::coulomb));
  // Checks that the block moves, to the bit, as it does without other models beside it.
  CHECK(hash_alone == run.loop().state_hash());
}

TEST_CASE(
    "Rubbed by strokes of 2.5 lengths the default keeps its strength, the paper's law hardens beside it",
    "[room]") {
  Settings settings = settings_of(Comparison::rubbing);
  settings.infinite = true;  // infinite brush, without sampling noise
  Run run(settings);
  const Snapshot& now = run.until(6.002);  // time after 24 cycles of rubbing
  REQUIRE(now.compared == 1);
  CHECK(now.beside[0].model == FrictionModel::brush);
  CHECK(now.strength_beside == Approx(1.0).margin(0.1));
  CHECK(now.beside[0].strength_beside > 1.3);
  // Bound of the strength after rubbing: as if all bristles were straight at the middle of the stroke,
  // stiffness times half the stroke.
  const double load = settings.mass * g;
  CHECK(now.beside[0].strength <= rubbing_amplitude * settings.presliding_length * 1.001 *
                                      material_of(settings_beside(settings, 0)).bristle_stiffness *
                                      material_of(settings_beside(settings, 0)).bristles_in_contact(load));
}

TEST_CASE("Tapped to and fro a block walks the easier way of the nap, one without a nap stays", "[room]") {
  const Settings settings = settings_of(Comparison::ratchet);
  Run run(settings);
  const Snapshot& now = run.until(10.002);
  REQUIRE(now.compared == 1);
  INFO("nap " << 1e3 * now.moved << " mm, none " << 1e3 * now.beside[0].moved << " mm");
  CHECK(now.moved < -1e-3);
  CHECK(std::fabs(now.beside[0].moved) < 0.02 * std::fabs(now.moved));
  // Checks that a nap (direction of hair) the other way round reverses the walk.
  Settings turned = settings;
  turned.nap = 1.0 / settings.nap;
  Run other(turned);
  CHECK(other.until(10.002).moved > 1e-3);
}

TEST_CASE("A pushed block slides at the friction of its direction on a nap", "[room]") {
  Settings settings = settings_of(Comparison::ratchet);
  settings.compare = Comparison::none;
  settings.tapping = 0.0;
  const double load = settings.mass * g, mean = settings.kinetic * load;
  for (const double sign : {1.0, -1.0}) {
    Run run(settings, {hand_at(0.0, -sign * 0.12, 0.0, 0.02), hand_at(1.0, -sign * 0.06, 0.0, 0.02),
                       hand_at(4.0, sign * 0.02, 0.0, 0.02)});
    const double friction = friction_of(run.until(3.5), Between::block_floor, 0);
    // Expects friction twice as large to the right as to the left, and `kinetic` in the mean.
    CHECK(-sign * friction == Approx(mean * (sign > 0.0 ? 4.0 / 3.0 : 2.0 / 3.0)).epsilon(0.02));
  }
}

TEST_CASE("After rests a block that ages starts stronger, by the growth per decade; others do not",
          "[room]") {
  const Settings settings = settings_of(Comparison::rest);
  Run run(settings);
  const double load = settings.mass * g, kinetic = settings.kinetic * load;
  // The room's carriage slides for 1 s after rests of 0.1, 0.3 and 1 s, so the third slide ends at 5.4 s.
  run.until(2.05);
  const double after_short = run.until(2.09).strength;
  CHECK(run.now().strength_beside == 0.1);
  const Snapshot& now = run.until(5.3);
  CHECK(now.strength_beside == 1.0);
  const double after_long = now.strength;
  // Expected growth of the peak: sliding bristles are renewed at an age of about 1 mm / 8 mm/s = 0.13 s, to
  // which rests of 0.1 and 1 s add.
  const double growth = settings.growth_per_decade * std::log10((0.1 + 1.0 + 0.13) / (0.1 + 0.1 + 0.13));
  CHECK((after_long - after_short) / kinetic > 0.4 * growth);
  CHECK((after_long - after_short) / kinetic < 1.2 * growth);
  CHECK(now.beside[0].strength == Approx(kinetic).epsilon(0.02));
  CHECK(now.beside[0].strength_beside == 1.0);
  CHECK(now.beside[1].model == FrictionModel::lugre);
  CHECK(now.beside[1].strength == Approx(kinetic).epsilon(0.05));
}

TEST_CASE("The carriage slides for a second, rests for longer and longer, and comes back the same way",
          "[room]") {
  double t = 0.0, position = 0.0;
  for (const double rest : rests_s) {
    position += slide_speed * slide_lasts;
    CHECK(rest_phase(t + 0.5).slides);
    CHECK(rest_phase(t + 0.5).position == Approx(position - 0.5 * slide_speed));
    t += slide_lasts;
    CHECK_FALSE(rest_phase(t + 0.5 * rest).slides);
    CHECK(rest_phase(t + 0.5 * rest).position == Approx(position));
    CHECK(rest_phase(t + 0.5 * rest).rested == rest);
    t += rest;
    CHECK(rest_phase(t + 0.5).rested == rest);
  }
  t += slide_lasts;  // end of the last slide of a cycle, 20.4 s
  CHECK(t == Approx(20.4));
  CHECK(rest_phase(t).position == Approx(6 * slide_speed));
  CHECK(rest_phase(t + 0.5).position == Approx(5.5 * slide_speed));
  CHECK(rest_phase(2 * t + 0.5).position == Approx(0.5 * slide_speed));
}

TEST_CASE("A material that was saved brings back the surface and leaves block and slope", "[room]") {
  Settings saved;
  saved.kinetic = 0.7;
  saved.peak = 0.9;
  saved.growth_per_decade = 0.05;
  saved.mass = 3.0;
  Settings now;
  now.mass = 0.5;
  now.slope = 0.1;
  Settings wanted = now;
  wanted.kinetic = 0.7;
  wanted.peak = 0.9;
  wanted.growth_per_decade = 0.05;
  const auto read = [&](const std::string& text) { return parse_script(text, "m.toml", {}, now).settings; };
  CHECK(read("[material]\n" + material_as_toml(saved)) == wanted);
  CHECK(read("[settings]\n" + settings_as_toml(saved)) == saved);
  CHECK_THROWS_WITH(read("[material]\nmass = 1.0\n"), Catch::Contains("m.toml:2") && Catch::Contains("mass"));
}

TEST_CASE("What moved is what crept, not what swings under the taps", "[room]") {
  Moved moved;
  for (int k = 1; k <= 20000; ++k) {
    const double t = 1e-3 * k;
    moved.take(t, 0.01 * std::exp(-5.0 * t) + 1e-6 * t + 1e-3 * std::sin(2.0 * pi * t / tap_pair));
  }
  // Creep is counted between pairs of taps: from the last pair before 6 s to the end of the last whole pair,
  // 14 s at 1 um/s.
  CHECK(moved.metres() == Approx(14e-6).epsilon(0.02));
  // The count of creep restarts when the hand touches the block, so that the hand's own motion is left out.
  moved.begin(20.0);
  CHECK(std::isnan(moved.metres()));
  for (int k = 20001; k <= 30000; ++k) moved.take(1e-3 * k, 0.044 + 1e-6 * 1e-3 * k);
  CHECK(moved.metres() == Approx(4e-6).margin(0.6e-6));
}

TEST_CASE("A tool that is taken again from behind the block is not flung against it", "[room]") {
  // Positions of a hand beyond the block, and inside it, as after a mouse click on the block.
  for (const double hand_x : {0.10, -0.02}) {
    HandRow let_go = hand_at(0.2, -0.07, 0, 0.03);
    let_go.hand.holds = false;
    Run run(few_bristles(), {hand_at(0.0, -0.07, 0, 0.03), let_go, hand_at(0.5, hand_x, 0, 0.03),
                             hand_at(2.0, hand_x, 0, 0.03)});
    run.until(0.5);
    REQUIRE(run.now().tool[0] < -0.06);
    double highest = 0.0;
    while (run.now().time < 2.0) {
      const double* f = run.tick().applied;
      highest = std::max(highest, std::hypot(f[0], f[1], f[2]));
    }
    CHECK(highest > 0.5);  // the tool pushed the block
    CHECK(highest < DeviceLimits{}.force);
    CHECK(run.now().tool[0] == Approx(hand_x).margin(0.02));  // the tool reached the hand
  }
}

TEST_CASE("A script's hand that lets go leaves the tool where it is", "[room]") {
  const Script script = parse_script(
      "[[hand]]\nt = 0.0\nposition = [-0.2, 0.1, 0.03]\n[[hand]]\nt = 0.2\nforce = [0, 0, 0]\n"
      "[[hand]]\nt = 0.5\nforce = [0, 0, 0]\n",
      "let_go.toml", RoomMeasures{});
  Run run(few_bristles(), script.hand.rows);
  run.until(0.5);
  CHECK(run.now().tool[0] == Approx(-0.2).margin(1e-3));
  CHECK(run.now().tool[1] == Approx(0.1).margin(1e-3));
}

TEST_CASE("The brush chosen again begins with straight bristles", "[room]") {
  const auto mean_deflection = [](const BristleView& view) {
    double sum = 0.0;
    for (std::size_t i = 0; i < view.count; ++i) sum += view.zx[i];
    return sum / static_cast<double>(std::max<std::size_t>(view.count, 1));
  };
  Settings settings = few_bristles();
  settings.slope = 0.2;  // slope on which bent bristles hold the block
  Run run(settings);
  run.until(0.5);
  const double bent = mean_deflection(run.now().bristles);
  REQUIRE(std::fabs(bent) > 0.05 * settings.presliding_length);
  auto& wishes = run.loop().exchange().settings;
  settings.model = FrictionModel::lugre;
  settings.slope = 0.0;
  wishes.write(settings);
  run.until(1.0);
  settings.model = FrictionModel::brush;
  wishes.write(settings);
  run.until(1.1);
  REQUIRE(run.now().bristles.count > 0);
  CHECK(std::fabs(mean_deflection(run.now().bristles)) < 0.02 * std::fabs(bent));
}

TEST_CASE("A scene begins with straight bristles, whatever was compared before it", "[room]") {
  Settings settings = settings_of(Comparison::rest);
  settings.bristles = 512;
  Run run(settings);
  run.until(3.0);  // time by which the carriage has bent the bristles
  settings = settings_of(Comparison::none);
  settings.bristles = 512;
  run.loop().exchange().settings.write(settings);
  double most = 0.0;
  while (run.now().compared > 0) run.tick();
  for (int k = 0; k < 500; ++k) most = std::max(most, std::fabs(run.tick().friction[0]));
  CHECK(most < 1e-3);
}

TEST_CASE("The room turns to infinitely many bristles live, and shows them", "[room]") {
  Settings settings = few_bristles();
  settings.slope = 0.2;
  settings.kinetic = 0.4;
  settings.peak = 0.46;
  Run run(settings);
  run.until(0.3);
  auto& wishes = run.loop().exchange().settings;
  settings.infinite = true;
  wishes.write(settings);
  run.until(0.6);
  const double position = run.now().block_position[0];
  CHECK(run.now().settings.infinite);
  REQUIRE(run.now().bristles.count == bristles_shown);
  // Checks that bristles which were straight before the tilt are bent and hold the block.
  const double oldest = std::fabs(run.now().bristles.zx[bristles_shown - 1]);
  CHECK(oldest > 0.05 * settings.presliding_length);
  CHECK(oldest < settings.presliding_length);
  run.until(1.0);
  // Checks that the block swings back to where it lay.
  CHECK(std::fabs(run.now().block_position[0] - position) < 0.5 * settings.presliding_length);

  settings.shared_renewal = 2.0;
  settings.residual_share = 0.3;
  wishes.write(settings);
  run.until(1.2);
  CHECK(run.now().kinetic_coefficient == Approx(0.4).epsilon(1e-3));
  // The room leaves the infinite brush for SnapRule::keep, which needs a finite number of bristles.
  settings.rule = bristle::SnapRule::keep;
  wishes.write(settings);
  run.until(1.3);
  CHECK_FALSE(run.now().settings.infinite);
  CHECK(run.now().settings.rule == bristle::SnapRule::keep);
}

TEST_CASE("The presets are materials, and wood and rubber age as the guide has it", "[room]") {
  struct Ageing {
    std::string name;
    double growth_per_decade, time;  // a row of core/guides/MATERIALS.md
  };
  const Ageing of[] = {{"Wood", 0.05, 0.1}, {"Rubber", 0.06, 0.1}, {"Ice", 0.0, 0.0}, {"Paper", 0.0, 0.0}};
  REQUIRE(presets.size() == std::size(of));
  for (std::size_t i = 0; i < presets.size(); ++i) {
    INFO(presets[i].name);
    REQUIRE(presets[i].name == of[i].name);
    Settings wanted = few_bristles();
    wanted.growth_per_decade = 0.13;
    apply(presets[i], wanted);
    std::string message;
    const Settings s = checked_settings(wanted, Settings{}, message);
    CHECK(message.empty());
    const bristle::Material material = material_of(s);
    CHECK(material.kinetic_coefficient() == Approx(wanted.kinetic).epsilon(1e-3));
    CHECK(s.growth_per_decade == of[i].growth_per_decade);
    CHECK((material.ageing_strength > 0.0) == (of[i].growth_per_decade > 0.0));
    if (of[i].growth_per_decade > 0.0) CHECK(material.ageing_time == of[i].time);
  }
}

TEST_CASE("A slope steeper than the friction lets the block slide as the inclined plane says", "[room]") {
  for (const FrictionModel model : {FrictionModel::brush, FrictionModel::lugre, FrictionModel::coulomb}) {
    INFO("model " << static_cast<int>(model));
    Settings settings = few_bristles();
    settings.model = model;
    settings.kinetic = 0.2;
    settings.peak = 0.21;
    settings.presliding_length = 20e-6;
    settings.slope = 0.35;
    Run run(settings);
    run.until(0.1);
    const double v0 = run.now().block_velocity[0], t0 = run.now().time;
    run.until(0.3);
    const double acceleration = (run.now().block_velocity[0] - v0) / (run.now().time - t0);
    CHECK(acceleration == Approx(g * (std::sin(0.35) - 0.2 * std::cos(0.35))).epsilon(0.02));
  }
}

// --------------------------------------------------------------- the hand of a person, moved by the mouse

TEST_CASE("A mouse that leaps sixty times a second moves the hand smoothly, and arrives", "[room][hand]") {
  Exchange exchange;
  MouseDevice device(exchange);
  Hand hand;
  MouseHand mouse{true, {-0.1, 0.0, 0.01}, 0.0};
  exchange.mouse.write(mouse);
  device.read(0.0, hand);
  CHECK(hand.position[0] == -0.1);
  // Moves the mouse by a pixel, 0.8 mm, every sixtieth of a second: 48 mm/s.
  double last = hand.position[0], speed = 0.0, most = 0.0, least = 1.0;
  for (int k = 1; k <= 600; ++k) {
    if (k % 50 == 0 || k % 50 == 16 || k % 50 == 33) mouse.position[0] += 0.8e-3;
    exchange.mouse.write(mouse);
    device.read(1e-3 * k, hand);
    speed = (hand.position[0] - last) / 1e-3;
    last = hand.position[0];
    if (k > 300) most = std::max(most, speed);
    if (k > 300) least = std::min(least, speed);
  }
  CHECK(most < 1.1 * 0.048);
  CHECK(least > 0.9 * 0.048);
  CHECK(mouse.position[0] - hand.position[0] == Approx(0.048 * HandFilter::delay).epsilon(0.2));
  for (int k = 601; k < 1000; ++k) device.read(1e-3 * k, hand);
  CHECK(hand.position[0] == Approx(mouse.position[0]).margin(1e-9));
  // Lets the mouse leap by a centimetre, which must cause neither a blow nor an overshoot of the hand.
  mouse.position[0] += 0.01;
  exchange.mouse.write(mouse);
  double farthest = -1.0;
  for (int k = 1000; k < 1400; ++k) {
    device.read(1e-3 * k, hand);
    if (k == 1000) CHECK(mouse.position[0] - hand.position[0] > 0.0098);
    if (k == 1040) CHECK(std::fabs(mouse.position[0] - hand.position[0]) < 0.0045);
    farthest = std::max(farthest, hand.position[0]);
  }
  CHECK(farthest <= mouse.position[0]);
  CHECK(hand.position[0] == Approx(mouse.position[0]).margin(1e-6));
  // A reset sets the time to 0. A grip after it must begin at the mouse's present position.
  mouse.holds = false;
  exchange.mouse.write(mouse);
  device.read(0.0, hand);
  CHECK_FALSE(hand.holds);
  mouse = {true, {0.1, 0.1, 0.02}, 0.0};
  exchange.mouse.write(mouse);
  device.read(1e-3, hand);
  CHECK(hand.position[1] == 0.1);
}

TEST_CASE("Nothing is held at first, and the hand is shown at the tool", "[room][hand]") {
  LoopOptions options;
  options.settings = few_bristles();
  HapticLoop loop(options);
  const Snapshot& first = after(loop, 3);
  CHECK_FALSE(first.held);
  for (int i = 0; i < 3; ++i) CHECK(first.device[i] == first.tool[i]);
  CHECK(first.tool[0] + RoomMeasures{}.tool_radius < -0.5 * RoomMeasures{}.block[0]);
  loop.exchange().mouse.write({true, {-0.1, 0.02, 0.02}, 0.0});
  CHECK(after(loop, 100).held);
  CHECK(loop.exchange().room.latest().device[1] == 0.02);
}

TEST_CASE("The slow pull shows the peak of theory, and gives the hand back", "[room][hand]") {
  for (const double stiffness : {100.0, 400.0}) {
    LoopOptions options;
    options.settings.hand_stiffness = stiffness;
    options.settings.kinetic = 0.35;
    HapticLoop loop(options);
    loop.exchange().acts.push(Act::slow_pull);
    loop.advance(3);
    double highest = 0.0, at = 0.0, time = 0.0;
    PlotPoint point;
    const auto look = [&] {
      while (loop.exchange().plot.pop(point)) {
        time = static_cast<double>(point.time);
        if (-point.friction <= highest) continue;
        highest = static_cast<double>(-point.friction);
        at = time;
      }
    };
    for (int k = 0; k < 30; ++k) {
      loop.advance(100);
      look();
    }
    const double weight = options.settings.mass * g;
    CHECK(highest == Approx(options.settings.peak * weight).epsilon(0.03));
    CHECK(at > 1.0);
    CHECK(at < 3.5);
    for (int k = 0; k < 40; ++k) loop.advance(100), look();
    const Snapshot& end = now_of(loop);
    CHECK_FALSE(end.held);
    CHECK(end.block_position[0] > options.settings.presliding_length);
    // Checks that the block is not flung away when the mouse's hand replaces the scripted hand of the tour.
    CHECK(end.block_position[0] < 0.03);
    // Lets the mouse grip, whose hand replaces the tour's.
    loop.exchange().mouse.write({true, {-0.1, 0.05, 0.02}, 0.0});
    CHECK(after(loop, 100).held);
    // Checks that a reset ends a pull that has begun.
    loop.exchange().acts.push(Act::slow_pull);
    loop.advance(500);
    loop.exchange().acts.push(Act::reset);
    CHECK(after(loop, 5).time < 0.01);
  }
}

TEST_CASE("The tour pushes below the peak, lets the block spring back, and then breaks it away",
          "[room][hand]") {
  LoopOptions options;
  options.settings = few_bristles();
  HapticLoop loop(options);
  // Checks that the tour's hand is planned for settings sent together with the request of the tour.
  options.settings.presliding_length = 4e-3;
  loop.exchange().acts.push(Act::tour);
  loop.advance(1);
  loop.exchange().settings.write(options.settings);
  loop.advance(3);
  const auto at = [&](double t) -> const Snapshot& {
    while (now_of(loop).time < t) loop.advance(1);
    return now_of(loop);
  };
  const double rest = at(0.25).block_position[0];
  // In the tour, a push below the peak bends the bristles by a visible part of their length.
  const double pushed = at(4.9).block_position[0] - rest;
  CHECK(pushed > 0.1 * options.settings.presliding_length);
  CHECK(pushed < options.settings.presliding_length);
  CHECK(now_of(loop).applied[0] < 0.9 * options.settings.peak * options.settings.mass * g);
  CHECK(now_of(loop).applied[0] > 0.4 * options.settings.peak * options.settings.mass * g);
  // When the tour's hand has let go, the block is back except for the deflection lost in snaps.
  const double back = at(7.9).block_position[0] - rest;
  CHECK(now_of(loop).applied[0] == 0.0);
  CHECK(back < 0.4 * pushed);
  CHECK(at(tour_hand_s - 0.2).block_position[0] - rest > 2.0 * options.settings.presliding_length);
  at(tour_hand_s + 0.5);
  CHECK_FALSE(now_of(loop).held);
}

TEST_CASE("Slow motion steps a share of the ticks, and a recording is never written over", "[room][hand]") {
  const TemporaryFolder folder;
  LoopOptions options;
  options.settings = few_bristles();
  options.record_to = folder.at("recording");
  HapticLoop loop(options);
  // The virtual clock does not follow real time: every tick is stepped, whatever the machine's speed.
  for (int k = 0; k < 9; ++k) loop.exchange().acts.push(Act::slower);
  CHECK(after(loop, 100).speed == Approx(0.01));
  CHECK(loop.exchange().room.latest().time == Approx(0.1));
  loop.start();
  const auto time_after = [&](int milliseconds) {
    std::this_thread::sleep_for(std::chrono::milliseconds(milliseconds));
    return now_of(loop).time;
  };
  const double begin = time_after(50);
  const double slow = time_after(400) - begin;
  CHECK(slow > 0.0);
  CHECK(slow < 0.02);  // duration, s: 4 ms expected, plus a busy machine's delays
  loop.stop();
  for (int k = 0; k < 9; ++k) loop.exchange().acts.push(Act::faster);
  loop.advance(1);
  for (int take = 0; take < 3; ++take) {
    loop.exchange().acts.push(Act::record);
    loop.advance(50);
    loop.exchange().acts.push(Act::stop_recording);
    loop.advance(50);
  }
  loop.finish_recording();
  for (const char* name : {"recording.toml", "recording-2.toml", "recording-3.toml", "recording-3.csv"}) {
    INFO(name);
    CHECK(std::filesystem::exists(folder.at(name)));
  }
}

// --------------------------------------------- a finger (pad) as the tool, which holds and turns the block

namespace {

/// A finger presses with 5 N on the top of a block of 1 kg, 25 mm beside its middle, and pulls it along x by
/// 60 mm. Friction is 1.5 at the finger and 0.1 at the floor: if the finger holds the block, its torque
/// exceeds the moment of the floor's friction about it.
struct OffCentrePull {
  static constexpr double press = 5.0, aside = 0.025, floor = 0.1, of_pad = 1.5;
  // Moment of the floor's friction about the finger, N m, which does not depend on the finger's load.
  static constexpr double moment = floor * 1.0 * g * aside;
  // Turn of the block at the end, rad, and mean torque during the pull, N m. Positive is about the finger's
  // outward normal, which points down.
  double turned = 0.0, torque = 0.0;
  double gap = 0.0;  // distance of the finger from its position on the block, m

  OffCentrePull(double pad_radius, bool infinite) {
    Settings s = few_bristles();
    s.mass = 1.0;
    s.kinetic = floor;
    s.peak = 1.05 * floor;
    s.presliding_length = 50e-6;
    s.infinite = infinite;
    s.pad_radius = pad_radius;
    s.pad_friction = of_pad;
    const auto hand = [](double t, double x) {
      return HandRow{t, {true, {x, aside, 0.06 + RoomMeasures{}.tool_radius}, {0, 0, -press}}};
    };
    Run run(s, {hand(0.0, 0.0), hand(0.3, 0.0), hand(2.3, 0.06)});
    run.until(0.8);
    int count = 0;
    while (run.now().time < 2.3) {
      const Snapshot& now = run.tick();
      for (std::size_t i = 0; i < now.contacts; ++i) {
        if (now.contact[i].between == Between::block_tool) torque += now.contact[i].torque;
      }
      ++count;
    }
    torque /= count;
    const Snapshot& end = run.now();
    turned = turn_about(end, 2);
    const double c = std::cos(turned), sn = std::sin(turned);
    gap = std::hypot(end.tool[0] - end.block_position[0] + sn * aside,
                     end.tool[1] - end.block_position[1] - c * aside);
  }
  /// Returns the highest torque of a uniform disc that spins without sliding.
  static double limit(double pad_radius) { return 2.0 / 3.0 * of_pad * press * pad_radius; }
};

}  // namespace

TEST_CASE("A finger with a pad holds a block off its middle up to the torsional limit, a point lets it turn",
          "[room][pad]") {
  for (const bool infinite : {false, true}) {
    INFO((infinite ? "infinitely many bristles" : "representatives"));
    // The floor's moment is 0.82 of the torque that the finger's pad holds, so the block moves straight.
    REQUIRE(OffCentrePull::moment < 0.85 * OffCentrePull::limit(6e-3));
    const OffCentrePull held(6e-3, infinite);
    CHECK(std::fabs(held.turned) < 0.02);
    CHECK(-held.torque == Approx(OffCentrePull::moment).epsilon(0.03));
    CHECK(held.gap < 100e-6);
    // The floor's moment is 1.23 of the torque the pad holds in sliding, above its peak (1.05). The block
    // turns against the torque of a disc that also transmits a fifth of its largest force.
    REQUIRE(OffCentrePull::moment > 1.2 * OffCentrePull::limit(4e-3));
    const OffCentrePull turning(4e-3, infinite);
    CHECK(turning.turned < -0.06);
    CHECK(-turning.torque < 1.03 * OffCentrePull::limit(4e-3));
    CHECK(-turning.torque > 0.93 * OffCentrePull::limit(4e-3));
  }
  const OffCentrePull point(0.0, false);
  CHECK(point.turned < -0.3);
  CHECK(point.torque == 0.0);
}

TEST_CASE("A pad grows and shrinks while it presses, and becomes a point, without a jump", "[room][pad]") {
  Settings s = few_bristles();
  s.pad_radius = 4e-3;
  s.pad_friction = 1.0;
  Run run(s, {{0.0, {true, {0.0, 0.02, 0.068}, {0, 0, -3.0}}}});
  for (const double radius : {4e-3, 10e-3, 1e-3, 0.0, 8e-3}) {
    s.pad_radius = radius;
    run.loop().exchange().settings.write(s);
    for (int k = 0; k < 200; ++k) {
      REQUIRE(is_finite(run.tick()));
    }
    CHECK(run.now().settings.pad_radius == radius);
    CHECK(speed(run.now()) < 1e-4);
    CHECK(std::fabs(turn_about(run.now(), 2)) < 1e-3);
  }
}

// ------------------------------------------------------ runs of equal bits, recordings and scripts in files

TEST_CASE("A script of a point gives the bits on record, another one others", "[room]") {
  const auto hash = [](double end) {
    Run run(few_bristles(), {hand_at(0.0, -0.08, 0.01, 0.02), hand_at(1.0, end, 0.01, 0.02)});
    run.until(1.0);
    return run.loop().state_hash();
  };
  CHECK(hash(0.0) == 0x2936a66e05d2fd7bu);
  CHECK(hash(0.0001) != 0x2936a66e05d2fd7bu);
}

TEST_CASE("A recording is played again to the same bits, changes of the settings included", "[room]") {
  Settings settings = few_bristles();
  std::vector<HandRow> hand = {hand_at(0.0, -0.08, 0.01, 0.02), hand_at(1.0, 0.0, 0.01, 0.02)};
  for (HandRow& row : hand) row.hand.turns = true;  // the hand's torsion spring acts too
  hand.back().hand.angle = 0.3;
  Run run(settings, hand);
  run.until(0.137);
  REQUIRE(run.loop().exchange().acts.push(Act::record));
  run.tick();
  run.tick();
  REQUIRE(run.now().recording);
  REQUIRE(run.now().time == Approx(1e-3));  // starting a recording restarts the room
  for (int k = 0; k < 300; ++k) run.tick();
  settings.kinetic = 0.2;
  settings.peak = 0.25;
  settings.extra_load = 0.7;
  run.loop().exchange().settings.write(settings);
  for (int k = 0; k < 400; ++k) run.tick();
  const double end = run.now().time;
  const std::uint64_t hash = run.loop().state_hash();
  REQUIRE(run.loop().exchange().acts.push(Act::stop_recording));
  for (int k = 0; k < 5; ++k) run.tick();
  REQUIRE_FALSE(run.now().recording);

  REQUIRE(run.loop().exchange().acts.push(Act::replay));
  run.tick();
  run.tick();
  while (run.now().time < end - 5e-4) run.tick();
  CHECK(run.loop().state_hash() == hash);

  // Checks that the files of a recording can be played as a script.
  const std::string base =
      (std::filesystem::temp_directory_path() / ("room_test_" + std::to_string(getpid()))).string();
  const Script script = read_script(base + ".toml", RoomMeasures{});
  CHECK(script.changes.size() == 1);
  LoopOptions options;
  options.settings = script.settings;
  options.changes = script.changes;
  HapticLoop again(options, std::make_unique<PlayedHand>("script", script.hand));
  again.advance(static_cast<std::uint64_t>(std::llround(1e3 * end)));
  CHECK(again.state_hash() == hash);
  for (const char* ending : {".toml", ".csv", ".hand.csv"}) {
    CHECK(std::filesystem::remove(base + ending));
  }
}

TEST_CASE("A reset, a replay or a lost block ends a recording, whose files are whole", "[room]") {
  const TemporaryFolder folder;
  const std::string base = folder.at("recording");
  const auto run_to = [](HapticLoop& loop, const char* line) {
    for (int k = 0; k < 3000; ++k)
      if (std::strstr(after(loop, 1).message, line)) return true;
    return false;
  };
  LoopOptions options;
  options.settings = few_bristles();
  options.record_to = base;
  HandMotion push{{hand_at(0.0, -0.08, 0.01, 0.02), hand_at(1.0, 0.0, 0.01, 0.02)}};
  SECTION("reset") {
    HapticLoop loop(options, std::make_unique<PlayedHand>("script", push));
    loop.exchange().acts.push(Act::record);
    loop.advance(300);
    loop.exchange().acts.push(Act::reset);
    CHECK(run_to(loop, "recorded 30"));
    CHECK(after(loop, 100).time < 0.15);
    CHECK_FALSE(loop.exchange().room.latest().recording);
  }
  SECTION("replay") {
    HapticLoop loop(options, std::make_unique<PlayedHand>("script", push));
    loop.exchange().acts.push(Act::record);
    REQUIRE(run_to(loop, "recording to"));
    std::vector<std::uint64_t> hashes;
    for (int k = 0; k < 300; ++k) {
      hashes.push_back(loop.state_hash());
      loop.advance(1);
    }
    loop.exchange().acts.push(Act::replay);
    REQUIRE(run_to(loop, "replay of"));
    int same = 0;
    for (const std::uint64_t hash : hashes) {
      same += loop.state_hash() == hash;
      loop.advance(1);
    }
    CHECK(same == 300);
  }
  SECTION("the block leaves the room") {
    HapticLoop loop(options,
                    std::make_unique<PlayedHand>(
                        "script", HandMotion{{hand_at(0.0, 0.07, 0, 0.03), with_force(0.3, -1000.0, 0, 0),
                                              with_force(0.6, -1000.0, 0, 0)}}));
    loop.exchange().acts.push(Act::record);
    REQUIRE(run_to(loop, "recording to"));
    REQUIRE(run_to(loop, "left the room"));
    CHECK(run_to(loop, "recorded"));
  }
  // Checks that the recording's times never go back, which read_script() would refuse.
  const Script script = read_script(base + ".toml", RoomMeasures{});
  CHECK(script.seconds > 0.25);
  CHECK(script.hand.end() == Approx(script.seconds).margin(1.5e-3));
}

TEST_CASE("Forces written from the start go on through a reset", "[room]") {
  const TemporaryFolder folder;
  LoopOptions options;
  options.settings = few_bristles();
  options.forces_csv = folder.at("forces.csv");
  HapticLoop loop(options, std::make_unique<PlayedHand>("script", HandMotion{}));
  loop.advance(100);
  loop.exchange().acts.push(Act::reset);
  loop.advance(100);
  loop.finish_recording();
  const std::string text = cli::read_text_file(options.forces_csv);
  CHECK(std::count(text.begin(), text.end(), '\n') > 4 * 195);
}

TEST_CASE("Replays can be begun anew by replay or reset, and give back what was before", "[room]") {
  const TemporaryFolder folder;
  LoopOptions options;
  options.settings = few_bristles();
  options.record_to = folder.at("recording");
  Settings later = few_bristles();
  later.kinetic = 0.25;
  later.peak = 0.3;
  options.changes = {{0.6, later}};
  HapticLoop loop(
      options, std::make_unique<PlayedHand>(
                   "script", HandMotion{{hand_at(0.0, -0.08, 0.01, 0.02), hand_at(1.0, 0.0, 0.01, 0.02)}}));
  Exchange& exchange = loop.exchange();
  const auto now = [&]() -> const Snapshot& { return now_of(loop); };
  const auto run_until = [&](double time) {
    while (now().time < time - 5e-4) loop.advance(1);
  };
  exchange.acts.push(Act::record);
  loop.advance(100);
  Settings settings = few_bristles();
  settings.kinetic = 0.2;
  settings.peak = 0.24;
  exchange.settings.write(settings);
  run_until(0.2);
  const double end = now().time;
  const std::uint64_t hash = loop.state_hash();
  exchange.acts.push(Act::stop_recording);
  loop.advance(5);
  settings.kinetic = 0.3;
  settings.peak = 0.36;
  exchange.settings.write(settings);
  loop.advance(5);
  for (const Act again : {Act::replay, Act::reset}) {
    exchange.acts.push(Act::replay);
    loop.advance(2);
    run_until(0.15);
    REQUIRE(now().settings.kinetic == 0.2);
    exchange.acts.push(again);
    loop.advance(2);
    REQUIRE(now().time < 0.01);
    CHECK(now().settings.kinetic == 0.4);
    run_until(end);
    CHECK(loop.state_hash() == hash);
    for (int k = 0; k < 50 && !std::strstr(now().message, "replay has ended"); ++k) loop.advance(1);
    CHECK_THAT(now().message, Catch::Contains("replay has ended"));
    CHECK(now().settings.kinetic == 0.3);
  }
  // Checks that after the replay the script that was played before it continues, and that a recording of it
  // begins its changes anew.
  run_until(0.7);
  CHECK(now().settings.kinetic == 0.25);
  exchange.acts.push(Act::record);
  loop.advance(5);
  exchange.settings.write(settings);
  loop.advance(5);
  CHECK(now().settings.kinetic == 0.3);
  run_until(0.7);
  CHECK(now().settings.kinetic == 0.25);
}

TEST_CASE("Pause holds world and plots, a single step moves both by one tick, reset begins anew", "[room]") {
  Run run(few_bristles(), {hand_at(0.0, -0.06, 0, 0.03), hand_at(1.0, 0.06, 0, 0.03)});
  run.until(0.5);
  auto& acts = run.loop().exchange().acts;
  acts.push(Act::pause);
  run.tick();
  const double paused_at = run.now().time;
  const std::uint64_t hash = run.loop().state_hash();
  CHECK(run.now().paused);
  PlotPoint point;
  auto& plot = run.loop().exchange().plot;
  CHECK(after(run.loop(), 50).time == paused_at);
  CHECK_FALSE(plot.pop(point));
  CHECK(run.loop().state_hash() == hash);
  acts.push(Act::single_step);
  CHECK(after(run.loop(), 10).time == Approx(paused_at + 1e-3));
  CHECK(plot.pop(point));
  CHECK_FALSE(plot.pop(point));
  acts.push(Act::run);
  acts.push(Act::reset);
  run.tick();
  run.tick();
  CHECK(run.now().time == Approx(1e-3));
  CHECK(run.now().block_position[0] == 0.0);
}

TEST_CASE("A script that is wrong says where", "[room]") {
  const auto message = [](const std::string& text) -> std::string {
    return message_of<cli::UserError>([&] { parse_script(text, "push.toml", RoomMeasures{}); });
  };
  CHECK(parse_script("[room]\ntitle = \"A push\"\n", "push.toml", RoomMeasures{}).title == "A push");
  CHECK_THAT(message("[settings]\nkinetic = 7.0\n"),
             Catch::Contains("push.toml:2") && Catch::Contains("kinetic"));
  CHECK_THAT(message("[settings]\nbristle = 7\n"),
             Catch::Contains("push.toml:2") && Catch::Contains("unknown key"));
  CHECK_THAT(message("[[hand]]\nt = 1.0\nposition = [0, 0]\n"), Catch::Contains("three numbers"));
  CHECK_THAT(message("[[hand]]\nt = 1.0\n[[hand]]\nt = 0.5\n"), Catch::Contains("push.toml:4"));
  CHECK_THAT(message("[settings]\nkinetic = 0.3\npeak = 0.2\n"), Catch::Contains("peak"));
  CHECK_THAT(message("[settings\n"), Catch::Contains("push.toml:1"));
}

// ------------------------------------------------------------------------------------------------ faults

TEST_CASE("A device lost in mid-push lets go smoothly, and says so in one line", "[room]") {
  Settings settings = few_bristles();
  settings.kinetic = 1.0;  // strong friction, so the block holds and the hand's spring pushes steadily
  settings.peak = 1.1;
  Run run(settings, {hand_at(0.0, -0.06, 0, 0.012), hand_at(0.5, -0.053, 0, 0.012)}, 0.8);
  run.until(0.8);
  const double before = run.now().device_force[0];
  REQUIRE(before < -0.5);
  CHECK_FALSE(run.now().device_lost);
  double last = before, largest_jump = 0.0;
  while (run.now().time < 0.9) {
    const double force = run.tick().device_force[0];
    largest_jump = std::max(largest_jump, std::fabs(force - last));
    last = force;
  }
  CHECK(largest_jump < 0.1 * std::fabs(before));
  CHECK(last == 0.0);
  CHECK(run.now().device_lost);
  CHECK_THAT(run.now().message, Catch::Contains("device script lost"));
  CHECK(speed(run.until(1.5)) < 0.01);
}

namespace {

/// A device that plays a hand's motion and records the forces sent to it.
class FeltHand final : public Device {
 public:
  struct Felt {
    long reads = 0;
    std::vector<double> force;  // force on the hand along x, N
  };
  FeltHand(HandMotion motion, std::shared_ptr<Felt> felt)
      : motion_(std::move(motion)), felt_(std::move(felt)) {}
  const char* name() const noexcept override { return "felt"; }
  DeviceLimits limits() const noexcept override { return {}; }
  bool read(double time_s, Hand& hand) noexcept override {
    ++felt_->reads;
    hand = motion_.at(time_s);
    return true;
  }
  void write(const double (&force)[3]) noexcept override { felt_->force.push_back(force[0]); }

 private:
  HandMotion motion_;
  std::shared_ptr<Felt> felt_;
};

}  // namespace

TEST_CASE("A device feels nothing in a pause, under another device and at the end", "[room]") {
  const TemporaryFolder folder;
  LoopOptions options;
  options.settings = few_bristles();
  // Strong friction, so the block holds and the hand's spring pushes steadily.
  options.settings.kinetic = 1.0;
  options.settings.peak = 1.1;
  options.record_to = folder.at("recording");
  const HandMotion push{{hand_at(0.0, -0.06, 0, 0.012), hand_at(0.5, -0.053, 0, 0.012)}};
  const auto felt = std::make_shared<FeltHand::Felt>();
  HapticLoop loop(options, std::make_unique<FeltHand>(push, felt));
  loop.advance(800);
  const double before = felt->force.back();
  REQUIRE(before < -0.5);
  auto& acts = loop.exchange().acts;
  acts.push(Act::pause);
  const long reads = felt->reads;
  loop.advance(20);
  CHECK(felt->force.back() == 0.0);
  CHECK(felt->reads == reads + 20);  // read in every tick, so packets do not queue up

  acts.push(Act::run);
  double largest_jump = 0.0;
  for (int k = 0; k < 100; ++k) {
    const double last = felt->force.back();
    loop.advance(1);
    largest_jump = std::max(largest_jump, std::fabs(felt->force.back() - last));
  }
  CHECK(largest_jump < 0.1 * std::fabs(before));
  CHECK(felt->force.back() == Approx(before).epsilon(0.05));
  HapticLoop straight(options, std::make_unique<PlayedHand>("script", push));
  straight.advance(900);
  // Checks that a pause of the room in between does not change its state.
  CHECK(loop.state_hash() == straight.state_hash());

  acts.push(Act::record);
  loop.advance(700);
  acts.push(Act::stop_recording);
  loop.advance(5);
  REQUIRE(felt->force.back() < -0.5);
  acts.push(Act::replay);
  loop.advance(5);
  CHECK(felt->force.back() == 0.0);
  loop.advance(1000);  // time by which the replay has ended
  REQUIRE(felt->force.back() < -0.5);
  loop.start();
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  loop.stop();
  CHECK(felt->force.back() == 0.0);
}

TEST_CASE("A recording that cannot be begun leaves the block its friction", "[room]") {
  LoopOptions options;
  options.settings = few_bristles();
  options.settings.slope = 0.2;
  options.record_to = "/no/such/folder/x";
  HapticLoop loop(options, std::make_unique<PlayedHand>("script", HandMotion{}));
  const double before = after(loop, 500).block_position[0];
  loop.exchange().acts.push(Act::record);
  const Snapshot& now = after(loop, 1000);
  CHECK_THAT(now.message, Catch::Contains("/no/such/folder/x"));
  CHECK_FALSE(now.recording);
  CHECK(now.time == Approx(1.5));
  CHECK(now.block_position[0] == Approx(before).margin(2e-4));
  loop.exchange().acts.push(Act::reset);  // a reset makes new patches, complete as the first
  CHECK(std::fabs(after(loop, 1000).block_position[0]) < 1e-3);
}

TEST_CASE("A disk that fills up ends the recording, says so, and is not forgotten", "[room]") {
  const TemporaryFolder folder;
  LoopOptions options;
  options.settings = few_bristles();
  SECTION("at the end of a recording") {
    options.record_to = folder.at("recording");
    std::filesystem::create_symlink("/dev/full", options.record_to + ".hand.csv");
    HapticLoop loop(options, std::make_unique<PlayedHand>("script", HandMotion{}));
    loop.exchange().acts.push(Act::record);
    loop.advance(50);
    loop.exchange().acts.push(Act::stop_recording);
    for (int k = 0; k < 20; ++k) {
      CHECK_THAT(after(loop, 1).message, !Catch::StartsWith("recorded"));
    }
    CHECK_THAT(loop.exchange().room.latest().message, Catch::Contains("cannot be written"));
    CHECK_THROWS_AS(loop.finish_recording(), cli::UserError);
  }
  SECTION("while it is written") {
    options.forces_csv = "/dev/full";
    options.rate_hz = 10000.0;
    HapticLoop loop(options, std::make_unique<PlayedHand>("script", HandMotion{}));
    loop.start();
    bool recording = true;
    // Waits until the recording's buffer of 1 MB is full, after half a second.
    for (int k = 0; k < 20000 && recording; ++k) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      if (loop.exchange().room.refresh() && loop.exchange().room.latest().tick > 1) {
        recording = loop.exchange().room.latest().recording;
      }
    }
    CHECK_FALSE(recording);
    CHECK_THAT(loop.exchange().room.latest().message, Catch::Contains("/dev/full: cannot be written"));
    loop.stop();
    CHECK_THROWS_AS(loop.finish_recording(), cli::UserError);
  }
}

TEST_CASE("Absurd settings are clamped or refused, and the block stays finite", "[room]") {
  std::mt19937_64 random(7);
  const double absurd[] = {NAN, INFINITY, -INFINITY, 1e300, -1e300, 1e-300, 0.0, -1.0, 1e9, 1.0, 0.3};
  const auto any = [&] { return absurd[random() % std::size(absurd)]; };
  Run run(few_bristles(), {hand_at(0.0, -0.08, 0.01, 0.02), hand_at(2.0, 0.2, 0.01, 0.02)});
  int messages = 0;
  for (int round = 0; round < 24; ++round) {
    Settings s = few_bristles();
    for (const SettingRange& range : setting_ranges) {
      if (random() % 3 == 0) s.*range.member = any();
    }
    if (random() % 4 == 0) s.bristles = random() % 2 ? 0 : 100;
    s.rule = static_cast<bristle::SnapRule>(random() % 3);
    s.infinite = random() % 2;
    s.model = static_cast<FrictionModel>(random() % 3);
    run.loop().exchange().settings.write(s);
    for (int k = 0; k < 20; ++k) run.tick();
    const Snapshot& now = run.now();
    REQUIRE(is_finite(now));
    messages += now.message[0] != '\0';
    for (const SettingRange& range : setting_ranges) {
      INFO(range.name);
      CHECK(now.settings.*range.member >= range.min);
      CHECK(now.settings.*range.member <= range.max);
    }
  }
  CHECK(messages > 12);
  run.loop().exchange().settings.write(few_bristles());
  CHECK(is_finite(run.until(run.now().time + 1.0)));
}

TEST_CASE("A hand that jumps or is no number leaves the world finite", "[room]") {
  std::vector<HandRow> hand;
  for (int k = 0; k < 40; ++k) {
    const double far = k % 4 == 0 ? 1e300 : k % 4 == 1 ? NAN : k % 4 == 2 ? -5.0 : 0.0;
    hand.push_back(hand_at(0.02 * k, far, k % 3 - 1.0, 0.02));
  }
  Run run(few_bristles(), hand);
  while (run.now().time < 1.0) REQUIRE(is_finite(run.tick()));
}

// ----------------------------------------------------------------- a haptic device on the network (UDP)

namespace {

/// A sender that acts as a device server on this machine.
class Sender {
 public:
  explicit Sender(int port) {
    socket_ = socket(AF_INET, SOCK_DGRAM, 0);
    to_.sin_family = AF_INET;
    to_.sin_port = htons(static_cast<std::uint16_t>(port));
    to_.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    timeval patience{2, 0};
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  }
  ~Sender() { close(socket_); }
  void send(const void* bytes, std::size_t size) {
    sendto(socket_, bytes, size, 0, reinterpret_cast<const sockaddr*>(&to_), sizeof to_);
  }
  void send(std::uint32_t sequence, bool holds, double x, double z = 0.0, double force_z = 0.0) {
    HandPacket packet;
    packet.sequence = sequence;
    packet.holds = holds;
    packet.position[0] = x;
    packet.position[2] = z;
    packet.force[2] = force_z;
    send(&packet, sizeof packet);
  }
  bool receive(ForcePacket& packet) {
    return recv(socket_, &packet, sizeof packet, 0) == sizeof packet &&
           std::memcmp(packet.magic, "BRFC", 4) == 0 && packet.version == 2;
  }

 private:
  int socket_;
  sockaddr_in to_{};
};

/// Tries a condition every millisecond. Loopback usually delivers a packet at once, but does not promise it.
template <class Condition>
bool wait_for(Condition&& condition, int tries = 200) {
  for (int k = 0; k < tries; ++k) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return false;
}

}  // namespace

TEST_CASE("The network device takes positions, answers with forces, and refuses what is no packet",
          "[room]") {
  // Device with a timeout of 60 s, so that a delay of a busy machine does not count as silence.
  UdpDevice device(0, 60.0);
  Sender sender(device.port());
  Hand hand;
  CHECK_FALSE(device.read(0.0, hand));
  const auto read = [&](double x) {
    return wait_for([&] { return device.read(0.0, hand) && hand.position[0] == x; });
  };
  sender.send(7, true, 0.01, 0.03, -1.0);
  REQUIRE(read(0.01));
  CHECK(hand.holds);
  CHECK(hand.position[2] == 0.03);
  CHECK(hand.force[2] == -1.0);
  device.write({1.0, -2.0, 0.5});
  ForcePacket force;
  REQUIRE(sender.receive(force));
  CHECK(force.sequence == 7);
  CHECK(force.force[1] == -2.0);

  sender.send("hello", 5);
  const HandPacket long_packet[2];
  sender.send(long_packet, sizeof long_packet);
  sender.send(6, true, 0.5);  // packet with an older number than the last one's
  sender.send(8, true, NAN);
  sender.send(9, false, 0.04);
  REQUIRE(read(0.04));
  CHECK(device.refused() == 4);
  CHECK_FALSE(hand.holds);
}

TEST_CASE("No stray or repeated packet takes the network device's place", "[room]") {
  UdpDevice device(0, 60.0);
  Sender sender(device.port());
  const auto position_after = [&](std::uint64_t refused) {
    Hand hand;
    wait_for([&] { return device.read(0.0, hand), device.refused() >= refused; });
    return hand.position[0];
  };
  // Sends a number far ahead, under which all later packets of the true device would count as old.
  sender.send(1, true, 0.1);
  sender.send(1 + 65537, true, 0.9);
  CHECK(position_after(1) == 0.1);
  sender.send(2, true, 0.2);
  sender.send(2, true, 0.9);
  CHECK(position_after(2) == 0.2);
  sender.send(2 + 65536, true, 0.3);  // not too far ahead, hence accepted
  sender.send(3, true, 0.9);
  CHECK(position_after(3) == 0.3);
}

TEST_CASE("The network device is lost after a silence, and comes back with any packet", "[room]") {
  UdpDevice device(0);
  Sender sender(device.port());
  Hand hand;
  const auto read = [&] { return wait_for([&] { return device.read(0.0, hand); }); };
  sender.send(7, true, 0.01);
  REQUIRE(read());
  std::this_thread::sleep_for(std::chrono::milliseconds(150));
  CHECK_FALSE(device.read(0.0, hand));
  // Simulates a restart of the device server, whose packet numbers begin at 1 again.
  sender.send(1, true, 0.05);
  CHECK(read());
  CHECK(hand.position[0] == 0.05);
}

// ----------------------------------------------------------------- the simulation on a thread of its own

TEST_CASE("The loops run beside each other: settings arrive, acts are served, a stalled screen delays nobody",
          "[room][threads]") {
  LoopOptions options;
  options.settings = few_bristles();
  HapticLoop loop(options);
  Exchange& exchange = loop.exchange();
  loop.start();
  const auto comes = [&](auto&& condition) {
    return wait_for([&] { return exchange.room.refresh(), condition(exchange.room.latest()); }, 5000);
  };
  CHECK(comes([](const Snapshot& s) { return s.time > 0.05; }));
  Settings settings = few_bristles();
  settings.kinetic = 0.2;
  settings.peak = 0.24;
  settings.bristles = 1024;
  exchange.settings.write(settings);
  CHECK(comes([](const Snapshot& s) { return s.settings.bristles == 1024 && s.settings.kinetic == 0.2; }));
  MouseHand mouse;
  mouse.holds = true;
  for (int k = 0; k <= 300; ++k) {
    mouse.position[0] = -0.1 + 0.0005 * k;
    mouse.position[2] = 0.03;
    exchange.mouse.write(mouse);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  CHECK(comes([](const Snapshot& s) { return s.block_position[0] > 0.01; }));
  mouse.holds = false;  // releases the tool where the block will return to
  exchange.mouse.write(mouse);
  exchange.acts.push(Act::reset);
  CHECK(comes([](const Snapshot& s) { return s.block_position[0] < 0.005; }));
  exchange.acts.push(Act::pause);
  CHECK(comes([](const Snapshot& s) { return s.paused; }));
  exchange.acts.push(Act::run);
  CHECK(comes([](const Snapshot& s) { return !s.paused; }));

  exchange.room.refresh();
  double before = exchange.room.latest().time, went_on = 0.0;
  for (int k = 0; k < 20 && went_on <= 0.05; ++k) {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));  // nobody reads the room's state meanwhile
    exchange.room.refresh();
    went_on = exchange.room.latest().time - std::exchange(before, exchange.room.latest().time);
  }
  CHECK(went_on > 0.05);
  loop.stop();
  const double stopped = now_of(loop).time;
  loop.start();
  CHECK(comes([&](const Snapshot& s) { return s.time > stopped; }));
  loop.stop();
}

}  // namespace bristle_test::test_room
