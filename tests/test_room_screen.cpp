// The picture of the virtual room without its window: geometry, the glass (magnified view of bristles),
// stored plots, the mouse, and pictures of states set by hand. The window itself: room_window_test.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>

#include "tests/made_up_room.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/products/virtual_room/bristle_glass.hpp"
#include "tools/products/virtual_room/camera.hpp"
#include "tools/products/virtual_room/history.hpp"
#include "tools/products/virtual_room/mouse_control.hpp"
#include "tools/products/virtual_room/offscreen.hpp"
#include "tools/products/virtual_room/panels.hpp"
#include "tools/products/virtual_room/plots.hpp"
#include "tools/products/virtual_room/quantity_text.hpp"

namespace bristle_test::test_room_screen {

using Eigen::Vector3f;
using room::Area;
using room::Camera;
using room::RoomMeasures;
using room::Snapshot;

#if defined(__SANITIZE_ADDRESS__)
// Suppresses reports of memory that software OpenGL keeps until the end.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:libLLVM\nleak:swrast_dri.so\n"; }
#endif

namespace {

// Returns null, and prints one line, on a machine without OpenGL.
std::unique_ptr<room::OffscreenRoom> try_offscreen(int width, int height) {
  try {
    return std::make_unique<room::OffscreenRoom>(RoomMeasures{}, width, height, 1.0f, 1);
  } catch (const cli::UserError& error) {
    std::printf("skipped: %s\n", error.what());
    return nullptr;
  }
}

}  // namespace

TEST_CASE("A camera sees its target in the middle and offsets by the rules of perspective", "[room]") {
  Camera camera;
  camera.target = Vector3f(0.1f, -0.2f, 0.05f);
  camera.distance = 2.0f;
  camera.azimuth = -1.5707963f;  // the camera looks along +y, so +x is to the right and +z is up
  camera.elevation = 0.0f;
  camera.field_of_view = 2 * std::atan(0.5f);
  const Area area{100, 50, 800, 400};
  float x = 0, y = 0;
  REQUIRE(camera.find_pixel(area, camera.target, x, y));
  CHECK(x == Approx(500).margin(0.01));
  CHECK(y == Approx(250).margin(0.01));
  // At the camera's target the picture is 2 m * 2 * 0.5 = 2 m high: 200 pixels per metre.
  REQUIRE(camera.find_pixel(area, camera.target + Vector3f(0.5f, 0, 0.25f), x, y));
  CHECK(x == Approx(600).margin(0.02));
  CHECK(y == Approx(200).margin(0.02));
  // A length at half the target's distance from the eye is twice as large.
  REQUIRE(camera.find_pixel(area, camera.target + Vector3f(0.5f, -1.0f, 0), x, y));
  CHECK(x == Approx(700).margin(0.02));
  CHECK_FALSE(camera.find_pixel(area, camera.target + Vector3f(0, -2.5f, 0), x, y));
}

TEST_CASE("The ray through a pixel meets the point that is seen there", "[room]") {
  Camera camera;
  const Area area{312, 46, 968, 546};
  for (const Vector3f& point :
       {Vector3f(0, 0, 0), Vector3f(0.2f, -0.1f, 0.02f), Vector3f(-0.28f, 0.17f, 0.25f)}) {
    float x = 0, y = 0;
    REQUIRE(camera.find_pixel(area, point, x, y));
    const room::Ray ray = camera.ray(area, x, y);
    CHECK(ray.along.cross(point - ray.from).norm() < 1e-5f);
  }
}

TEST_CASE("The mouse holds the tool where its ray meets the plane of the hand, on a slope too", "[room]") {
  for (const double slope : {0.0, 0.3}) {
    Camera camera;
    const Area area{0, 0, 900, 600};
    Snapshot room;
    room.settings.slope = slope;
    const RoomMeasures measures;
    room::MouseControl mouse;
    const Vector3f wanted(-0.12f, 0.05f, 0.01f);  // displacement in the room's axes, m
    float x = 0, y = 0;
    REQUIRE(camera.find_pixel(area, room::room_tilt(slope) * wanted, x, y));
    mouse.move(x, y, {true, false, false}, area, camera, room, measures);
    REQUIRE(mouse.hand_changed());
    CHECK(mouse.hand().holds);
    for (int axis = 0; axis < 3; ++axis)
      CHECK(mouse.hand().position[axis] == Approx(wanted[axis]).margin(1e-5));

    // Checks the mouse wheel: a notch raises the tool by 2 mm, with control it presses by 0.1 N more; the
    // tool stays in the room.
    mouse.turn_wheel(3, false, camera, measures);
    CHECK(mouse.hand().position[2] == Approx(0.016));
    mouse.turn_wheel(-2, true, camera, measures);
    CHECK(mouse.hand().press == Approx(0.2));
    mouse.turn_wheel(1e6f, false, camera, measures);
    CHECK(mouse.hand().position[2] == Approx(measures.height - measures.tool_radius));
    mouse.move(1e5f, 300, {true, false, false}, area, camera, room, measures);
    CHECK(std::fabs(mouse.hand().position[0]) <= measures.length / 2);

    mouse.move(1e5f, 300, {}, area, camera, room, measures);
    CHECK(mouse.hand_changed());
    CHECK_FALSE(mouse.hand().holds);
    CHECK_FALSE(mouse.hand_changed());
  }
}

TEST_CASE("A drag that begins on the panels never moves the tool", "[room]") {
  Camera camera;
  room::MouseControl mouse;
  mouse.move(10, 10, {true, false, false}, {300, 0, 600, 600}, camera, Snapshot{}, RoomMeasures{});
  mouse.move(400, 300, {true, false, false}, {300, 0, 600, 600}, camera, Snapshot{}, RoomMeasures{});
  CHECK_FALSE(mouse.hand_changed());
  CHECK_FALSE(mouse.hand().holds);
}

TEST_CASE("A fine drag moves the hand a tenth of the pointer's path, without a jump where it begins or ends",
          "[room]") {
  Camera camera;
  const Area area{0, 0, 900, 600};
  const RoomMeasures measures;
  const Snapshot room;
  room::MouseControl mouse;
  const auto move_to = [&](float wanted_x, bool fine) {
    float x = 0, y = 0;
    REQUIRE(camera.find_pixel(area, Vector3f(wanted_x, 0, 0.01f), x, y));
    mouse.move(x, y, {true, false, false, fine}, area, camera, room, measures);
    return mouse.hand().position[0];
  };
  CHECK(move_to(-0.10f, false) == Approx(-0.10).margin(1e-5));
  CHECK(mouse.hand().position[2] == Approx(0.01));
  CHECK(move_to(-0.08f, false) == Approx(-0.08).margin(1e-5));
  CHECK(move_to(-0.08f, true) == Approx(-0.08).margin(1e-5));
  CHECK(move_to(-0.03f, true) == Approx(-0.075).margin(1e-5));
  CHECK(move_to(-0.03f, false) == Approx(-0.075).margin(1e-5));
  CHECK(move_to(-0.01f, false) == Approx(-0.055).margin(1e-5));
}

TEST_CASE("Keys take the tool where it is, push it at 10 mm/s, and hold on until they let go", "[room]") {
  room::MouseControl mouse;
  const RoomMeasures measures;
  Snapshot room;
  room.tool[0] = -0.1;
  room.tool[1] = 0.02;
  room.tool[2] = 0.03;
  mouse.push(0, 0, false, 0.1, room, measures);
  CHECK_FALSE(mouse.hand_changed());
  for (int k = 0; k < 50; ++k) mouse.push(1, 0, false, 0.01, room, measures);
  CHECK(mouse.hand().holds);
  CHECK(mouse.hand().position[0] == Approx(-0.095));
  CHECK(mouse.hand().position[1] == Approx(0.02));
  CHECK(mouse.hand().position[2] == Approx(0.03));
  for (int k = 0; k < 50; ++k) mouse.push(0, -1, true, 0.01, room, measures);
  CHECK(mouse.hand().position[1] == Approx(0.0195));
  for (int k = 0; k < 10000; ++k) mouse.push(1, 1, false, 0.01, room, measures);
  CHECK(mouse.hand().position[0] <= measures.length / 2);
  CHECK(mouse.hand_changed());
  mouse.let_go();
  CHECK(mouse.hand_changed());
  CHECK_FALSE(mouse.hand().holds);
}

TEST_CASE("Keys turn the block from where it lies at half a radian per second, until they let go", "[room]") {
  room::MouseControl mouse;
  Snapshot room;
  room.block_orientation[0] = std::cos(0.1);  // block turned by 0.2 rad about the floor's normal
  room.block_orientation[3] = std::sin(0.1);
  CHECK(mouse.turn(0, false, 0.1, room) == 0.0);
  CHECK_FALSE(mouse.hand_changed());
  CHECK(mouse.turn(1, false, 0.1, room) == Approx(0.05 * room::turn_stiffness));
  CHECK(mouse.hand().angle == Approx(0.25));
  CHECK(mouse.turn(-1, true, 0.2, room) == Approx(0.04 * room::turn_stiffness));
  CHECK(mouse.hand().turns);
  CHECK_FALSE(mouse.hand().holds);
  mouse.let_go();
  CHECK_FALSE(mouse.hand().turns);
}

TEST_CASE("An undone change of the settings brings back what was before it, a dragged slider at once",
          "[room]") {
  room::SettingsUndo undo;
  room::Settings s;
  CHECK_FALSE(undo.undo(s));
  const auto change = [&](double mass, bool active) {
    const room::Settings before = s;
    s.mass = mass;
    undo.note(before, true, active);
  };
  change(0.3, true);  // a drag over three pictures counts as one change
  change(0.4, true);
  change(0.5, true);
  undo.note(s, false, false);
  change(1.0, false);  // two clicks count as two changes
  change(2.0, false);
  for (const double mass : {1.0, 0.5, 0.25}) {
    REQUIRE(undo.undo(s));
    CHECK(s.mass == mass);
  }
  CHECK(undo.empty());
}

TEST_CASE("The glass bends every hair as far as its bristle and tells who has snapped", "[room]") {
  room::BristleGlass glass;
  Snapshot room = made_up::room_with_block_at(0, 1, 0.3);
  glass.update(room, 0.02f);
  REQUIRE(glass.hairs().size() == room::bristles_shown);
  const auto mean = static_cast<float>(room.presliding_length);
  for (std::size_t i = 0; i < 400; i += 37) {
    CHECK(glass.hairs()[i].lean[0] ==
          Approx(room::BristleGlass::lean_per_length * room.bristles.zx[i] / mean));
    CHECK(glass.hairs()[i].bent == Approx(room.bristles.zx[i] / room.bristles.snap_length[i]));
    CHECK(std::hypot(glass.hairs()[i].root[0], glass.hairs()[i].root[1]) < room::BristleGlass::reach);
  }

  // Moves the block by 0.2 mean lengths and back: no bristle in the glass snaps, in either direction.
  for (const float step : {0.2f, -0.4f, 0.3f}) {
    for (float& z : room.bristles.zx) z += step * mean;
    glass.update(room, 0.02f);
    CHECK(glass.snaps() == 0);
  }
  // Makes three bristles nearly straight and bends the others on, so these three have snapped. One of them
  // has drawn a new length.
  for (float& z : room.bristles.zx) z += 0.05f * mean;
  for (const std::size_t i : {3u, 50u, 399u}) room.bristles.zx[i] = 0.02f * mean;
  room.bristles.snap_length[50] *= 1.5f;
  glass.update(room, 0.02f);
  CHECK(glass.snaps() == 3);
  CHECK(glass.hairs()[50].flash == 1.0f);
  CHECK(glass.hairs()[51].flash == 0.0f);
  glass.update(room, 1.0f);
  CHECK(glass.snaps() == 0);
  CHECK(glass.hairs()[50].flash == 0.0f);
}

TEST_CASE("A bristle's age is the time since it snapped", "[room]") {
  room::BristleGlass glass;
  Snapshot room = made_up::room_with_block_at(0, 1, 0.3);
  glass.update(room, 0.02f);
  room.time += 2.0;
  room.bristles.zx[7] = 0.0f;
  room.bristles.snap_length[7] *= 1.4f;
  glass.update(room, 0.02f);
  CHECK(glass.hairs()[7].age == 0.0f);
  CHECK(glass.hairs()[8].age == Approx(2.0));
}

TEST_CASE("The first bending is kept from the reset to four lengths, and no further", "[room]") {
  room::FirstBending first;
  first.set_length(1e-3);
  const auto add = [&](float time, float x, float friction) {
    room::PlotPoint p;
    p.time = time;
    p.displacement = x;
    p.friction = -friction;
    first.add(p);
  };
  for (int i = 0; i <= 1000; ++i)
    add(0.001f * static_cast<float>(i), 0.1f + 1e-5f * static_cast<float>(i), 0.5f);
  REQUIRE(first.size() > 300);
  CHECK(first[0].first == 0.0f);
  CHECK(first[first.size() - 1].first == Approx(4e-3).epsilon(0.02));
  CHECK(first[1].second == 0.5f);
  const std::size_t size = first.size();
  add(2.0f, 0.1f, 0.1f);  // a return after first loading, which adds no point to the curve
  CHECK(first.size() == size);
  add(0.0f, 0.3f, 0.0f);  // a reset begins a new curve
  CHECK(first.size() == 1);
  for (int i = 0; i <= 200; ++i)
    add(0.001f * static_cast<float>(i), 0.3f + 1e-5f * static_cast<float>(i), 0.5f);
  for (int i = 0; i <= 200; ++i)
    add(0.3f + 0.001f * static_cast<float>(i), 0.302f - 1e-5f * static_cast<float>(i), 0.5f);
  // When the block is rubbed to and fro, the curve of first loading ends at the first reversal.
  CHECK(first[first.size() - 1].first > 1.49e-3f);
  CHECK(first[first.size() - 1].first < 1.53e-3f);
}

TEST_CASE("The plots' memory keeps the newest points in order and begins anew when time goes back",
          "[room]") {
  room::History history;
  const std::size_t pushed = room::History::capacity + 1000;
  for (std::size_t i = 0; i < pushed; ++i) history.add({static_cast<float>(i), 0, 0, 0, 0});
  REQUIRE(history.size() == room::History::capacity);
  CHECK(history[0].time == static_cast<float>(1000));
  CHECK(history.newest().time == static_cast<float>(pushed - 1));
  CHECK(history.size() - history.first_of_last(10.5f) == 11);
  history.add({1.0f, 0, 0, 0, 0});
  CHECK(history.size() == 1);
}

TEST_CASE("The histogram counts a time in the class that holds it", "[room]") {
  room::TimeHistogram times;
  for (const double t : {0.0, -1.0, std::nan("")}) times.add(t);
  CHECK(times.total() == 0);
  for (const double t : {1e-9, 3.3e-6, 0.99e-3, 1.01e-3, 5.0}) times.add(t);
  CHECK(times.total() == 5);
  CHECK(times.count(0) == 1);
  CHECK(times.count(room::TimeHistogram::classes - 1) == 1);
  int inside = 0;
  for (int i = 0; i < room::TimeHistogram::classes; ++i) {
    for (const double t : {3.3e-6, 0.99e-3, 1.01e-3}) {
      if (room::TimeHistogram::begin_of(i) <= t && t < room::TimeHistogram::begin_of(i + 1)) {
        inside += times.count(i) > 0;
      }
    }
  }
  CHECK(inside == 3);
}

TEST_CASE("A scene that misses the deadline says so, in the figures of the histogram beside it", "[room]") {
  room::TimeHistogram times;
  room::LoopStatistics loop;
  loop.period_p50 = 1e-3;
  for (int k = 0; k < 999; ++k) times.add(1.5e-3);
  CHECK(room::deadline_warning(times, loop).empty());  // less than a second of ticks
  times.add(1.5e-3);
  CHECK_THAT(room::deadline_warning(times, loop), Catch::Contains("1.00 ms") && Catch::Contains("1.78 ms"));
  loop.period_p50 = 0.0;  // no real clock, no deadline
  CHECK(room::deadline_warning(times, loop).empty());
  loop.period_p50 = 1e-3;
  loop.p99 = 1.5e-3;  // of all ticks since the start, which counts for nothing here
  for (std::size_t k = 0; k < room::TimeHistogram::most; ++k) times.add(0.4e-3);
  CHECK(room::deadline_warning(times, loop).empty());
}

TEST_CASE("Quantities are written with the prefix that fits", "[room]") {
  CHECK(room::with_unit(1.32e-3, "m") == "1.32 mm");
  CHECK(room::with_unit(0.00012345, "s") == "123 µs");
  CHECK(room::with_unit(-42.04, "N") == "-42.0 N");
  CHECK(room::with_unit(0.99999, "N") == "1.00 N");
  CHECK(room::with_unit(1234.0, "N/m") == "1.23 kN/m");
  CHECK(room::with_unit(0.0, "N") == "0 N");
  CHECK(room::with_unit(std::nan(""), "N") == "– N");
}

TEST_CASE("Absurd states of the room are drawn without harm", "[room]") {
  const auto offscreen = try_offscreen(320, 240);
  if (!offscreen) return;
  const double inf = INFINITY, nan = std::nan("");
  for (const double bad : {nan, inf, 1e30, -1e300}) {
    Snapshot room = made_up::room_with_block_at(0, 1, 0.5);
    room.block_position[0] = room.tool[1] = room.device[2] = bad;
    room.applied[0] = room.friction[1] = room.time = room.settings.slope = bad;
    room.loop.p99 = room.loop.max = room.loop.deadline = room.kinetic_coefficient = bad;
    room.contacts = 1000;
    room.bristles.count = 1000;
    room.bristles.zx[0] = static_cast<float>(nan);
    const auto point = static_cast<float>(nan);
    offscreen->view().add({point, point, point, point, point});
    offscreen->view().add({1, 1e30f, -1e30f, 1e30f, 1e30f});
    CHECK(offscreen->draw(room, 0.02f).rgb.size() == 3u * 320 * 240);
  }
  Snapshot empty;
  empty.block_orientation[0] = 0;
  empty.presliding_length = 0;
  CHECK(offscreen->draw(empty, 0.0f).rgb.size() == 3u * 320 * 240);
}

}  // namespace bristle_test::test_room_screen
