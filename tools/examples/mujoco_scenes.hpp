// Scenes of MuJoCo that set its own friction beside that of bristles, all kinds in turns in one run.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <mujoco/mujoco.h>

namespace mujoco_example {

/// Whose friction moves a scene.
enum class Friction { stock, noslip, bristle };  ///< as the scene asks; with ten noslip iterations; ours
const char* to_string(Friction friction);

struct Scene {
  std::string name, title;
  std::string xml;                         ///< MJCF; the body looked at is called "body"
  double seconds = 4.0;                    ///< of simulated time
  double direction[3] = {0.0, 0.0, -1.0};  ///< in which the body is expected to creep
  double point[3] = {0.0, 0.0, 0.0};       ///< m, of the body, in its axes: whose place is looked at
  std::function<void(const mjModel&, mjData&)> drive = [](const mjModel&, mjData&) {};  ///< before each step
};

/// A capsule of 45 g between two pads (boxes on slides), gripped with grip_n and swing_n more and less of it
/// at 1 Hz. `solref`: time constant in s and damping ratio of the contacts. At 60 N a time constant of 0.05 s
/// lets the pads sink so deep that the capsule is thrown out; 0.005 s does not.
Scene pinch(double grip_n, double swing_n = 0.0, const char* solref = "0.005 1");
/// A block on a slope, half way to sliding, tapped five times a second for the first two seconds.
Scene tapped_block();
/// A flat box pushed at a corner for 0.2 s: it slides, turns and comes to rest.
Scene pushed_box();
/// The box of pushed_box(), turning on the spot at `speed` (rad/s) about the vertical, left alone.
Scene spun_box(double speed);
/// Ten blocks side by side on a slope: forty contact points.
Scene ten_blocks();
/// Ten plates of 200 g on each other, each smaller than the one below by 3 mm (flush ones get other contact
/// points as soon as they shift): forty contact points in one island. The fifth is pushed
/// with push_n from tower_push_begin_s on, rising for ramp_s, and after tower_push_s more let go at once.
Scene tower(double push_n = 0.0, double ramp_s = 0.0);
inline constexpr double tower_push_begin_s = 1.0, tower_push_s = 0.2;
/// A box of 200 g between two round fingertips 20 mm off its centre of mass, contacts of condim 4; the hand
/// that holds it with grip_n is shaken with 10 m/s^2 up and down and 5 across.
Scene held_off_centre(double grip_n = 30.0);
/// A box of 200 g between a thumb and two fingers, 12 N on either side, contacts of condim 3. The hand rests,
/// or it goes up and down, 28 mm at 3 Hz: 10 m/s^2.
Scene fingertips(bool shaken);
/// A book on a table, pushed with book_go times its friction for book_go_s in each of the first three
/// seconds, and with book_stop times it for the rest of the time.
Scene pushed_book();
inline constexpr double book_coefficient = 0.4, book_go = 1.5, book_go_s = 0.2, book_stop = 0.5;
std::vector<Scene> all_scenes();

struct Sample {
  double t, travel, turn;  ///< s; m in the scene's direction (or across, below); rad about z
  double place[3];         ///< m
};

struct Run {
  Friction friction = Friction::stock;
  std::vector<Sample> samples;  ///< every tenth of a simulated second, or finer
  double creep = 0.0;           ///< m/s, mean over the last quarter
  double step_us = 0.0;         ///< CPU time of a step, median over blocks of steps
  double contacts = 0.0;        ///< mean number of contact points
};

/// All kinds from the same start, a block of steps each in turns. Throws std::runtime_error on a bad scene.
std::vector<Run> run(const Scene& scene, const std::vector<Friction>& kinds, double sample_s = 0.01);

using Model = std::unique_ptr<mjModel, void (*)(mjModel*)>;
using Data = std::unique_ptr<mjData, void (*)(mjData*)>;
Model load(const std::string& xml);
Data make_data(const mjModel& model);

}  // namespace mujoco_example
