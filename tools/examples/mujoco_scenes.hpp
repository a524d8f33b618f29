// Runs scenes in MuJoCo that compare MuJoCo's friction with that of bristles. All kinds of friction take
// turns in one run, so that their times compare.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <mujoco/mujoco.h>

#include "tools/examples/run_scenes.hpp"

namespace mujoco_example {

/// Kind of friction in a scene. stock: MuJoCo's own, with the scene's options. noslip: MuJoCo's with ten
/// iterations against slip added. bristle: patches of bristles.
enum class Friction { stock, noslip, bristle };
const char* to_string(Friction friction);

struct Scene {
  std::string name, title;
  std::string xml;                                     ///< model in MJCF (XML); its body "body" is observed
  double seconds = 4.0;                                ///< simulated time, s
  std::array<double, 3> direction = {0.0, 0.0, -1.0};  ///< direction of the creep that is measured
  double point[3] = {0.0, 0.0, 0.0};                   ///< observed point of the body, in the body's axes, m
  bool radial = false;  ///< whether the distance from the z axis is measured, not a displacement

  /// Function that applies forces and controls; it is called before each step.
  std::function<void(const mjModel&, mjData&)> drive = [](const mjModel&, mjData&) {};
};

/// Makes a scene with a capsule of 45 g between two pads (boxes on slides), gripped with grip_n, which swings
/// by swing_n at 1 Hz. `solref`: time constant in s and damping ratio of the contacts. At 60 N a time
/// constant of 0.05 s lets the pads sink so deep that the capsule is thrown out; 0.005 s does not.
Scene pinch(double grip_n, double swing_n = 0.0, const char* solref = "0.005 1");
/// Makes a scene with a block on a slope of 15 degrees, where it needs about half of its friction; it is
/// tapped five times a second for the first two seconds. Taps show whether friction lets it creep.
Scene tapped_block();
/// Makes a scene with a flat box pushed at a corner for 0.2 s: it slides, turns and comes to rest.
Scene pushed_box();
/// Makes the scene of pushed_box() without the push: the box turns on the spot about the vertical, at first
/// with `speed` (rad/s).
Scene spun_box(double speed);
/// Makes a scene with ten blocks side by side on a slope, to time forty contact points.
Scene ten_blocks();
/// Makes a scene with a tower of ten plates of 200 g, which has forty contact points in one island. Each
/// plate is smaller than the one below by 3 mm, since flush plates get other contact points as soon as they
/// shift. A force pushes the fifth plate: it begins at tower_push_begin_s, rises to push_n in ramp_s, and
/// ends suddenly tower_push_s after its beginning.
Scene tower(double push_n = 0.0, double ramp_s = 0.0);
inline constexpr double tower_push_begin_s = 1.0, tower_push_s = 0.2;
/// Makes a scene with a box of 200 g, given as a mesh, on a slope of 10 degrees that is a plane or also a
/// mesh. MuJoCo lists other vertices of the box from step to step, so patches must be carried over.
Scene mesh_on_slope(bool on_mesh);
/// Makes a scene with a tower of ten equal plates of 200 g. MuJoCo lists their flush corners in turn, now of
/// the upper and now of the lower plate.
Scene equal_tower();
/// Makes a scene with a box of 500 g on a table that turns at 1.5 rad/s, 1 m off its axis. Friction taken by
/// velocities lets such a box creep outwards.
Scene turntable(double seconds);
/// Makes a scene with a box of 200 g held by two round fingertips 20 mm off its centre of mass, so that
/// friction must resist spin (condim 4). The hand that holds it with grip_n is shaken with 10 m/s^2
/// vertically and 5 across.
Scene held_off_centre(double grip_n = 30.0);
/// Makes a scene with a box of 200 g held by a thumb and two fingers, 12 N on either side, with contacts of
/// condim 3. The hand rests, or moves up and down by 28 mm at 3 Hz (10 m/s^2).
Scene fingertips(bool shaken);
/// Makes a scene with a book on a table, which slides and is then held. The push is book_go times its
/// friction for book_go_s at the start of each of the first three seconds, and book_stop times it for the
/// rest.
Scene pushed_book();
inline constexpr double book_coefficient = 0.4, book_go = 1.5, book_go_s = 0.2, book_stop = 0.5;
std::vector<Scene> all_scenes();

struct Sample {
  /// Time, s; displacement of the observed point along the scene's direction, m; angle of the body about z,
  /// rad.
  double t, travel, turn;
  double position[3];  ///< displacement of the observed point, m
};

using Run = bristle_example::SceneRun<Friction, Sample>;

/// Runs a scene with all kinds of friction from one start. The kinds take turns, a block of steps each, so
/// that their times compare. Throws std::runtime_error on a bad scene.
std::vector<Run> run(const Scene& scene, const std::vector<Friction>& kinds, double sample_s = 0.01);

using Model = std::unique_ptr<mjModel, void (*)(mjModel*)>;
using Data = std::unique_ptr<mjData, void (*)(mjData*)>;
Model load(const std::string& xml);
Data make_data(const mjModel& model);

}  // namespace mujoco_example
