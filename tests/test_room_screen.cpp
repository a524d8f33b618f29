// The picture of the virtual room without its window: geometry, the glass (magnified view of bristles),
// stored plots, the mouse, and pictures of states set by hand. The window itself: room_window_test.
#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "tests/made_up_room.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/products/virtual_room/bristle_glass.hpp"
#include "tools/products/virtual_room/camera.hpp"
#include "tools/products/virtual_room/history.hpp"
#include "tools/products/virtual_room/mouse_control.hpp"
#include "tools/products/virtual_room/offscreen.hpp"
#include "tools/products/virtual_room/panels.hpp"
#include "tools/products/virtual_room/plots.hpp"
#include "tools/products/virtual_room/presets.hpp"
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
std::unique_ptr<room::OffscreenRoom> try_offscreen(int width, int height, float scale = 1.0f) {
  try {
    return std::make_unique<room::OffscreenRoom>(RoomMeasures{}, width, height, scale, 1);
  } catch (const cli::UserError& error) {
    std::printf("skipped: %s\n", error.what());
    return nullptr;
  }
}

struct Pixel {
  int r, g, b;
};

Pixel pixel(const room::PixelImage& image, int x, int y) {
  const std::size_t at =
      3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(x));
  return {image.rgb[at], image.rgb[at + 1], image.rgb[at + 2]};
}

bool is_wood(Pixel p) {
  return p.r > 70 && 1.18 * p.g < p.r && p.r < 1.75 * p.g && 1.2 * p.b < p.g && p.g < 2.6 * p.b;
}

template <class Wanted>
int count(const room::PixelImage& image, Wanted wanted, double* middle_x = nullptr) {
  int found = 0;
  double sum = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      if (!wanted(pixel(image, x, y))) continue;
      ++found;
      sum += x;
    }
  }
  if (middle_x) *middle_x = sum / std::max(found, 1);
  return found;
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

TEST_CASE("A fine drag moves the hand a tenth of the pointer's way, without a jump where it begins or ends",
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

TEST_CASE("What does nothing is known, and so is the preset that is in force", "[room]") {
  room::Settings s;
  // Settings without effect are marked so: the Stribeck velocity needs a damper, the ageing time ageing.
  CHECK_FALSE(room::Effective(s).stribeck);
  CHECK_FALSE(room::Effective(s).ageing_time);
  s.damping_per_newton = 0.5;
  s.growth_per_decade = 0.05;
  CHECK(room::Effective(s).stribeck);
  CHECK(room::Effective(s).ageing_time);
  s.model = room::FrictionModel::coulomb;
  const room::Effective coulomb(s);
  for (const bool works : {coulomb.peak, coulomb.bristles, coulomb.damping, coulomb.stribeck, coulomb.pad}) {
    CHECK_FALSE(works);
  }
  room::Settings preset;
  for (std::size_t i = 0; i < room::presets.size(); ++i) {
    room::apply(room::presets[i], preset);
    CHECK(room::preset_of(preset) == static_cast<int>(i));
  }
  preset.kinetic += 0.01;
  CHECK(room::preset_of(preset) == -1);
}

TEST_CASE("A knock of some milliseconds does not set the range of a plot, a lasting force does", "[room]") {
  std::vector<float> values(1000, 0.5f);
  values[3] = 40.0f;
  values[700] = -30.0f;
  values[10] = 1.1f;  // peak that friction reaches, so the range must show it
  room::ValueRange r = room::range_of_most(values, 1.2);
  CHECK(r.low == Approx(-1.2).margin(2));
  CHECK(r.low >= -1.2);
  CHECK(r.high <= 1.2);
  CHECK(r.high >= 0.5);
  std::fill(values.begin(), values.begin() + 100, 3.0f);
  r = room::range_of_most(values, 1.2);
  CHECK(r.high == 3.0);
  values.assign(20, 0.25f);
  values[7] = 1.0f;
  CHECK(room::range_of_most(values, 1.2).high == 1.0);
  values.clear();
  CHECK(room::range_of_most(values, 1.2).high == 0.0);
}

TEST_CASE("An axis far from zero counts from a round place, in the unit of its width", "[room]") {
  const auto axis = [](double low, double high) { return room::length_axis(low, high); };
  CHECK(axis(-0.1, 0.2).unit == "mm");
  CHECK(axis(-0.1, 0.2).offset == 0.0);
  CHECK(axis(0.0, 400e-6).unit == "µm");
  CHECK(axis(0.0, 400e-6).offset == 0.0);
  // Labels of an axis around 249.6 mm, which without an offset would read "249.565".
  const room::AxisText far = axis(0.24952, 0.24968);
  CHECK(far.unit == "µm from 249 mm");
  CHECK(far.offset == Approx(0.249));
  CHECK(far.scale == 1e-6);
  CHECK(axis(-0.1000003, -0.0999998).unit == "nm from -100.001 mm");
  CHECK(axis(0.0, 0.0).offset == 0.0);
}

TEST_CASE("Room, panels and glass lie beside each other at every size", "[room]") {
  for (const auto& [width, height, scale] :
       {std::tuple{640, 480, 1.0f}, std::tuple{1280, 720, 1.0f}, std::tuple{2560, 1440, 1.0f},
        std::tuple{2560, 1440, 2.0f}, std::tuple{1280, 960, 2.0f}}) {
    INFO(width << " x " << height << " at " << scale);
    for (const bool left : {false, true}) {
      const room::Layout l = room::make_layout(width, height, scale, true, true, left);
      const Area& scene = l.picture.scene;
      CHECK(l.settings.x + l.settings.width <= scene.x);
      CHECK(l.bar.y + l.bar.height <= scene.y);
      CHECK(scene.y + scene.height <= l.plots.y);
      CHECK(scene.height >= 0.25f * static_cast<float>(height));
      const float r = l.picture.glass_radius;
      CHECK(l.picture.glass_x - r >= scene.x);
      CHECK(l.picture.glass_x + r <= scene.x + scene.width);
      CHECK(l.picture.glass_y + r <= scene.y + scene.height);
    }
  }
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

TEST_CASE("Cohorts are drawn as sheets as thick as their mass, and age until they snap", "[room]") {
  room::BristleGlass glass;
  Snapshot room = made_up::room_with_block_at(0, 1, 0);
  room.settings.infinite = true;
  const auto mean = static_cast<float>(room.presliding_length);
  // Bends a quarter of the shown bristles by 0.2 mean lengths, the rest by 0.7.
  for (std::size_t i = 0; i < room::bristles_shown; ++i) room.bristles.zx[i] = (i < 100 ? 0.2f : 0.7f) * mean;
  glass.update(room, 0.02f);
  REQUIRE(glass.shows_cohorts());
  REQUIRE(glass.hairs().size() == 2);
  CHECK(glass.hairs()[1].half[0] == Approx(3 * glass.hairs()[0].half[0]).epsilon(1e-3));
  CHECK(glass.hairs()[0].lean[0] == Approx(0.2 * room::BristleGlass::lean_per_length));
  // Bends all bristles on by 0.1 mean lengths in half a second, but for a quarter of those at 0.7, which snap
  // and draw new lengths.
  room.time += 0.5;
  room.block_position[0] += 0.1 * room.presliding_length;
  for (std::size_t i = 0; i < room::bristles_shown; ++i)
    room.bristles.zx[i] = i < 300 ? room.bristles.zx[i] + 0.1f * mean : 0.0f;
  glass.update(room, 0.02f);
  REQUIRE(glass.hairs().size() == 3);
  CHECK(glass.hairs()[0].age == 0.0f);
  CHECK(glass.hairs()[1].age == Approx(0.5));
  CHECK(glass.hairs()[2].age == Approx(0.5));
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

TEST_CASE("The histogram's figures are of its newest ticks, and a slow scene fades from them", "[room]") {
  room::TimeHistogram times;
  CHECK(times.within(0.99) == 0.0);
  for (int k = 0; k < 3000; ++k) times.add(1.79e-3);
  CHECK(times.within(0.99) >= 1.79e-3);
  CHECK(times.within(0.99) < 1.79e-3 * 1.22);  // a class is a twelfth of a decade wide
  for (std::size_t k = 0; k < room::TimeHistogram::most; ++k) times.add(50e-6);
  CHECK(times.total() == room::TimeHistogram::most);
  CHECK(times.within(1.0) < 62e-6);
  CHECK(times.within(0.5) >= 50e-6);
  // 2 % of slow ticks are seen at 99 %, 0.5 % are not.
  for (int k = 0; k < 40; ++k) times.add(2e-3);
  CHECK(times.within(0.99) < 62e-6);
  CHECK(times.within(1.0) >= 2e-3);
  for (int k = 0; k < 120; ++k) times.add(40e-3);
  CHECK(times.within(0.99) >= 40e-3);
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

TEST_CASE("A room whose scale changes draws what a room of that scale draws", "[room]") {
  constexpr int width = 900, height = 640;
  const std::vector<float> scales = {2.0f, 1.0f, 1.25f, 0.75f, 2.0f};
  const Snapshot now = made_up::room_with_block_at(0.0, 0.5, 0.2);
  std::vector<room::PixelImage> expected;
  for (const float scale : scales) {
    const auto fresh = try_offscreen(width, height, scale);
    if (!fresh) return;
    fresh->draw(now, 0.02f);  // a panel knows in its second picture whether it needs a scrollbar
    expected.push_back(fresh->draw(now, 0.02f));
  }
  const auto offscreen = try_offscreen(width, height);
  for (std::size_t i = 0; i < scales.size(); ++i) {
    INFO("scale " << scales[i]);
    offscreen->view().set_scale(scales[i]);
    offscreen->draw(now, 0.02f);
    const room::PixelImage image = offscreen->draw(now, 0.02f);
    REQUIRE(image.rgb.size() == expected[i].rgb.size());
    int different = 0;
    for (std::size_t k = 0; k < image.rgb.size(); ++k) different += image.rgb[k] != expected[i].rgb[k];
    CHECK(different == 0);
  }
}

namespace {

// Window of the room at some size and scale, the smallest that the program allows first.
struct Window {
  int width, height;
  float scale;
};
constexpr Window windows[] = {
    {640, 480, 1.0f}, {800, 600, 1.0f}, {800, 600, 2.0f}, {1280, 800, 1.0f}, {1280, 800, 2.0f}};

bool is_curve(Pixel p) { return p.r > 150 && p.g > 75 && p.g < 150 && p.b < 100; }

bool is_bright(Pixel p) { return std::max({p.r, p.g, p.b}) > 130; }

int count_in(const room::PixelImage& image, int left, int top, int right, int bottom, bool (*wanted)(Pixel)) {
  int found = 0;
  for (int y = top; y < bottom; ++y)
    for (int x = left; x < right; ++x) found += wanted(pixel(image, x, y));
  return found;
}

// Returns the inner frame of plot 0 (force over time) or 1 (over displacement), a pixel narrower on each
// side.
Area frame_of(const Area& plots, float scale, int plot) {
  const float gap = 12 * scale, line = std::round(13 * scale);
  const bool two = plots.width < 720 * scale;
  const float inner = plots.width - (two ? 3.0f : 4.0f) * gap;
  const float share[] = {two ? 0.52f : 0.40f, two ? 0.48f : 0.32f};
  const float left = plots.x + gap + (plot == 0 ? 0.0f : share[0] * inner + gap);
  return {left + 3.1f * line + 1, plots.y + gap + 1.7f * line + 1, share[plot] * inner - 3.9f * line - 2,
          plots.height - 1.7f * gap - 3.0f * line - 2};
}

}  // namespace

TEST_CASE("Nothing covers a curve: legend, bars of snaps and inset stay beside it at every size", "[room]") {
  for (const Window& window : windows) {
    const float scale = room::fitting_scale(window.scale, window.width, window.height);
    const auto offscreen = try_offscreen(window.width, window.height, scale);
    if (!offscreen) return;
    for (const float level : {0.0f, 0.5f, 1.0f, 1.3f}) {
      INFO("window " << window.width << " x " << window.height << ", friction " << level << " N");
      room::RoomView& view = offscreen->view();
      view.forget();
      view.gui.first_bending.set_length(1e-3);
      for (int k = 0; k <= 8000; ++k) {
        room::PlotPoint point;
        point.time = 1e-3f * static_cast<float>(k);
        point.displacement = 5e-7f * static_cast<float>(k);
        point.friction = -level;
        point.snaps = 50;
        view.add(point);
      }
      const Snapshot now = made_up::room_with_block_at(0.004, 0.0, 0.2);
      offscreen->draw(now, 10.0f);
      const room::PixelImage image = offscreen->draw(now, 10.0f);
      for (int plot = 0; plot < 2; ++plot) {
        const Area frame = frame_of(view.layout().plots, scale, plot);
        // Curve at a constant height: its row is that of its newest columns. In the second plot its older
        // half is faint.
        const int right = static_cast<int>(frame.x + (plot == 0 ? frame.width - 6 : 0.88f * frame.width));
        const int left = static_cast<int>(plot == 0 ? frame.x + 14 * scale : frame.x + 0.6f * frame.width);
        const int top = static_cast<int>(frame.y), bottom = static_cast<int>(frame.y + frame.height);
        std::vector<int> rows;
        for (int y = top; y < bottom; ++y) {
          if (is_curve(pixel(image, right, y))) rows.push_back(y);
        }
        INFO("plot " << plot);
        REQUIRE(!rows.empty());
        int hidden = 0;
        for (int x = left; x < right; ++x) {
          bool seen = false;
          for (const int y : rows) seen = seen || is_curve(pixel(image, x, y));
          hidden += !seen;
        }
        CHECK(hidden == 0);
        // Without a peak to label, no text and no line of a legend stands in the upper line of the frame.
        const auto line = static_cast<int>(13 * scale);
        if (plot == 0 && level == 0.0f) CHECK(count_in(image, left, top, right, top + line, is_bright) == 0);
      }
    }
  }
}

TEST_CASE("A curve that an impact drives below its range is drawn over the bars of snaps", "[room]") {
  const auto offscreen = try_offscreen(800, 600);
  if (!offscreen) return;
  room::RoomView& view = offscreen->view();
  for (int k = 0; k <= 8000; ++k) {
    room::PlotPoint point;
    point.time = 1e-3f * static_cast<float>(k);
    // A blow of 20 ms, shorter than the half per cent that sets no range.
    point.friction = k >= 4000 && k < 4020 ? 30.0f : -1.0f;
    point.snaps = 50;
    view.add(point);
  }
  const Snapshot now = made_up::room_with_block_at(0.004, 0.0, 0.2);
  offscreen->draw(now, 10.0f);
  const room::PixelImage image = offscreen->draw(now, 10.0f);
  const Area frame = frame_of(view.layout().plots, 1.0f, 0);
  const int middle = static_cast<int>(frame.x + 0.5f * frame.width);
  const int bottom = static_cast<int>(frame.y + frame.height);
  for (int y = bottom - 8; y < bottom - 1; ++y) {
    INFO("row " << y << " of " << bottom);
    CHECK(count_in(image, middle - 6, y, middle + 6, y + 1, is_curve) > 0);
  }
}

TEST_CASE("Type and panels grow only as far as the window has room for their buttons", "[room]") {
  CHECK(room::fitting_scale(2.0f, 800, 600) == 1.25f);
  CHECK(room::fitting_scale(2.0f, 1280, 800) == 1.5f);
  CHECK(room::fitting_scale(2.0f, 1280, 960) == 2.0f);
  CHECK(room::fitting_scale(1.0f, 2560, 1440) == 1.0f);
  CHECK(room::fitting_scale(2.0f, 320, 240) == 0.75f);
  const auto is_text = [](Pixel p) { return p.r > 130; };
  std::vector<int> names;
  // No button of bar and panel reaches the edge of its area: its margin there shows the panel's ground.
  for (const Window& window : windows) {
    INFO("window " << window.width << " x " << window.height << ", wanted scale " << window.scale);
    const float scale = room::fitting_scale(window.scale, window.width, window.height);
    const auto offscreen = try_offscreen(window.width, window.height, scale);
    if (!offscreen) return;
    const Snapshot now = made_up::room_with_block_at(0.0, 0.0, 0.2);
    offscreen->draw(now, 0.02f);
    const room::PixelImage image = offscreen->draw(now, 0.02f);
    const room::Layout& l = offscreen->view().layout();
    const auto is_raised = [](Pixel p) { return std::max({p.r, p.g, p.b}) > 35; };
    const auto low = static_cast<int>(l.bar.height), left = static_cast<int>(l.bar.x);
    CHECK(count_in(image, left, low - 4, window.width, low, is_raised) == 0);
    CHECK(count_in(image, window.width - 6, 0, window.width, low, is_raised) == 0);
    names.push_back(count_in(image, 0, static_cast<int>(38 * scale), static_cast<int>(l.settings.width),
                             static_cast<int>(80 * scale), is_text));
  }
  // The names of models and surfaces take as many pixels on a panel with ample room: none is cut.
  for (std::size_t i = 0; i < names.size(); ++i) {
    const float scale = room::fitting_scale(windows[i].scale, windows[i].width, windows[i].height);
    const auto ample = try_offscreen(static_cast<int>(1000 * scale), static_cast<int>(800 * scale), scale);
    const Snapshot now = made_up::room_with_block_at(0.0, 0.0, 0.2);
    ample->draw(now, 0.02f);
    const room::PixelImage image = ample->draw(now, 0.02f);
    INFO("window " << windows[i].width << " x " << windows[i].height << ", scale " << scale);
    CHECK(names[i] == count_in(image, 0, static_cast<int>(38 * scale),
                               static_cast<int>(ample->view().layout().settings.width),
                               static_cast<int>(80 * scale), is_text));
    CHECK(names[i] > 300);
  }
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

TEST_CASE("A picture shows the block where perspective puts it, its arrows, and bristles by their bending",
          "[room]") {
  const auto offscreen = try_offscreen(700, 520);
  if (!offscreen) return;
  room::RoomView& view = offscreen->view();
  view.panels = view.glass_shown = false;
  const auto is_friction = [](Pixel p) { return p.r > 205 && p.g < 140 && p.b < 75; };

  double seen[2], expected[2];
  int arrow[2];
  for (int i = 0; i < 2; ++i) {
    const double x = i == 0 ? -0.1 : 0.1;
    const room::PixelImage image =
        offscreen->draw(made_up::room_with_block_at(x, i == 0 ? 0.0 : 1.5, 0), 0.02f);
    REQUIRE(count(image, is_wood, &seen[i]) > 1000);
    float px = 0, py = 0;
    view.camera.find_pixel(view.layout().picture.scene, Vector3f(static_cast<float>(x), 0, 0.03f), px, py);
    expected[i] = static_cast<double>(px);
    arrow[i] = count(image, is_friction);
  }
  CHECK(seen[0] == Approx(expected[0]).margin(8));
  CHECK(seen[1] == Approx(expected[1]).margin(8));
  CHECK(arrow[0] == 0);
  CHECK(arrow[1] > 300);

  // In the glass straight bristles are blue, and those bent to nine tenths of their snap lengths red.
  view.glass_shown = true;
  const auto is_blue = [](Pixel p) { return p.b > p.r + 50 && p.b > p.g + 10; };
  const auto is_red = [](Pixel p) { return p.r > p.g + 60 && p.r > p.b + 60 && p.r < 250; };
  Snapshot room = made_up::room_with_block_at(0, 0, 0);
  const room::PixelImage straight = offscreen->draw(room, 0.02f);
  for (std::size_t i = 0; i < room.bristles.count; ++i)
    room.bristles.zx[i] = 0.9f * room.bristles.snap_length[i];
  room.bristles.key = 2;  // key of another patch, as if no bristle had been seen before
  const room::PixelImage bent = offscreen->draw(room, 0.02f);
  CHECK(count(straight, is_blue) > count(bent, is_blue) + 1000);
  CHECK(count(bent, is_red) > count(straight, is_red) + 1000);
}

TEST_CASE("The glass leaves the side on which the block is", "[room]") {
  const auto offscreen = try_offscreen(700, 520);
  if (!offscreen) return;
  room::RoomView& view = offscreen->view();
  view.panels = false;
  view.camera.distance = 0.5f;
  for (const double x : {0.2, -0.2, 0.2}) {
    view.camera.target = Vector3f(x > 0 ? 0.05f : -0.05f, 0, -0.04f);
    offscreen->draw(made_up::room_with_block_at(x, 0.0, 0), 0.02f);
    const room::Picture& p = view.layout().picture;
    float px = 0, py = 0;
    REQUIRE(view.camera.find_pixel(p.scene, Vector3f(static_cast<float>(x), 0, 0.03f), px, py));
    CHECK(std::hypot(px - p.glass_x, py - p.glass_y) > p.glass_radius);
  }
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
