// The virtual room's floor from a file: triangles in place of the flat floor.
#include <catch2/catch.hpp>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "temporary_folder.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/products/virtual_room/floor_mesh.hpp"
#include "tools/products/virtual_room/haptic_loop.hpp"
#include "tools/products/virtual_room/parameters.hpp"

namespace bristle_test::test_room_floor {
namespace {

using namespace room;
using Vector3 = FloorMesh::Vector3;

constexpr double g = 9.80665;

/// Returns a mesh that is a plane falling by `slope` per metre to +x: `pieces` squares to a side, halved.
std::shared_ptr<const FloorMesh> falling_plane(double slope, int pieces) {
  std::vector<FloorMesh::Triangle> triangles;
  const auto corner = [&](int i, int j) {
    const double x = -0.4 + 0.8 * i / pieces, y = -0.4 + 0.8 * j / pieces;
    return Vector3(x, y, -slope * x);
  };
  for (int i = 0; i < pieces; ++i) {
    for (int j = 0; j < pieces; ++j) {
      triangles.push_back({corner(i, j), corner(i + 1, j), corner(i + 1, j + 1)});
      triangles.push_back({corner(i, j), corner(i + 1, j + 1), corner(i, j + 1)});
    }
  }
  return std::make_shared<FloorMesh>(triangles);
}

class Run {
 public:
  explicit Run(const Settings& settings, std::shared_ptr<const FloorMesh> floor,
               std::vector<HandRow> hand = {})
      : loop_(options(settings, std::move(floor)),
              std::make_unique<PlayedHand>("script", HandMotion{std::move(hand)})) {}
  const Snapshot& until(double time) {
    const auto ticks = static_cast<std::uint64_t>(std::llround(1e3 * time));
    loop_.advance(ticks - ticks_);
    ticks_ = ticks;
    loop_.exchange().room.refresh();
    return loop_.exchange().room.latest();
  }

 private:
  static LoopOptions options(const Settings& settings, std::shared_ptr<const FloorMesh> floor) {
    LoopOptions o;
    o.settings = settings;
    o.measures.floor = std::move(floor);
    return o;
  }
  HapticLoop loop_;
  std::uint64_t ticks_ = 0;
};

Settings few_bristles() {
  Settings s;
  s.bristles = 512;
  s.presliding_length = 20e-6;
  return s;
}
/// Returns the block's speed down a slope of this angle, m/s.
double speed_down(const Snapshot& s, double angle) {
  return s.block_velocity[0] * std::cos(angle) - s.block_velocity[2] * std::sin(angle);
}

TEST_CASE(
    "A block on a mesh that is an inclined plane holds below the angle of friction, and slides above it",
    "[room]") {
  for (const int pieces : {1, 9}) {
    INFO(pieces << " squares to a side");
    const double flat = 0.25, steep = 0.35;
    Run held(few_bristles(), falling_plane(std::tan(flat), pieces));  // kinetic coefficient 0.4 exceeds 0.25
    const double before = held.until(1.0).block_position[0];
    const Snapshot& at_rest = held.until(3.0);
    CHECK(std::fabs(at_rest.block_position[0] - before) < 1e-9);
    double load = 0.0, friction = 0.0;
    for (std::size_t i = 0; i < at_rest.contacts; ++i) {
      load += at_rest.contact[i].load;
      friction += std::hypot(at_rest.contact[i].friction[0], at_rest.contact[i].friction[2]);
    }
    CHECK(load == Approx(0.25 * g * std::cos(flat)).epsilon(1e-3));
    CHECK(friction == Approx(0.25 * g * std::sin(flat)).epsilon(0.02));

    Settings smooth = few_bristles();
    smooth.kinetic = 0.2;
    smooth.peak = 0.21;
    Run slides(smooth, falling_plane(std::tan(steep), pieces));
    const double v0 = speed_down(slides.until(0.2), steep), v1 = speed_down(slides.until(0.35), steep);
    CHECK((v1 - v0) / 0.15 == Approx(g * (std::sin(steep) - 0.2 * std::cos(steep))).epsilon(0.02));
  }
}

TEST_CASE("Seams between triangles of one plane change nothing", "[room]") {
  const std::vector<HandRow> push = {{0.0, {true, {-0.06, 0.01, 0.02}, {0, 0, 0}}},
                                     {1.0, {true, {0.06, 0.01, 0.02}, {0, 0, 0}}}};
  Run flat(few_bristles(), nullptr, push), seams(few_bristles(), falling_plane(0.0, 13), push);
  for (const double time : {0.3, 0.6, 0.9, 1.2}) {
    const Snapshot a = flat.until(time), b = seams.until(time);
    CHECK(a.block_position[0] == Approx(b.block_position[0]).margin(1e-12));
    CHECK(a.block_position[1] == Approx(b.block_position[1]).margin(1e-12));
  }
  CHECK(flat.until(1.3).block_position[0] > 0.08);
}

TEST_CASE("The highest triangle of a mesh counts, and beside it the flat floor", "[room]") {
  const FloorMesh mesh({{Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(0, 1, 0.5)},
                        {Vector3(0, 0, 0.2), Vector3(0, 1, 0.2), Vector3(1, 0, 0.2)}});  // clockwise
  CHECK(mesh.height(0.1, 0.1) == Approx(0.2));
  CHECK(mesh.height(0.1, 0.8) == Approx(0.4));
  CHECK(mesh.height(0.6, 0.6) == 0.0);
  CHECK(mesh.height(std::nan(""), 0.1) == 0.0);
}

TEST_CASE("A mesh is read from an OBJ file, and a wrong line is named", "[room]") {
  const TemporaryFolder folder;
  const auto read = [&](const std::string& text) { return read_floor_mesh(folder.write("floor.obj", text)); };
  const FloorMesh square =
      read("# a square\nv 0 0 0\nv 1 0 0\nv 1 1 0.5\nv 0 1 0.5\nvn 0 0 1\nf 1/1/1 2//1 3 4\n");
  CHECK(square.triangles().size() == 2);
  CHECK(square.height(0.3, 0.5) == Approx(0.25));
  for (const char* wrong : {"v 0 0\n", "v 0 0 nan\n", "v 0 0 0\nf 1 2 3\n", "v 0 0 0\nf 1 1\n", "f 0 0 0\n",
                            "v 0 0 99\n", "v 0 0 0\nv 0 0 1\nv 0 1 0\nf 1 2 3\n", ""}) {
    INFO(wrong);
    CHECK_THROWS_AS(read(wrong), cli::UserError);
  }
}

}  // namespace
}  // namespace bristle_test::test_room_floor
