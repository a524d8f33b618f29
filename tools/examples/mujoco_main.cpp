// Runs bristle_mujoco, which compares MuJoCo's own friction with bristles and prints a table or, on request,
// CSV and a picture.
#include <algorithm>

#include "tools/examples/compare_scenes.hpp"
#include "tools/examples/mujoco_scenes.hpp"

using mujoco_example::Friction;
using mujoco_example::Run;
using mujoco_example::Sample;

int main(int argc, char** argv) {
  return bristle_example::compare_scenes(
      argc, argv,
      {"bristle_mujoco",
       "Sets MuJoCo's own friction beside that of bristles: creep, place, turn, time of a step.",
       "positions over time; tools/plots/mujoco.gp draws them",
       {"<scene", "creep um/s", "travel mm", "turn deg", "contacts", "us a step", "us a contact"},
       "t[s],travel[m],turn[rad],x[m],y[m],z[m]"},
      mujoco_example::all_scenes(),
      [](const mujoco_example::Scene& scene) {
        return mujoco_example::run(scene, {Friction::stock, Friction::noslip, Friction::bristle});
      },
      [](const Run& run, const Run&) -> std::vector<std::string> {
        const Sample& end = run.samples.back();
        return {fmt::format("{:.4f}", 1e3 * end.travel), fmt::format("{:.3f}", end.turn * 57.29577951308232),
                fmt::format("{:.1f}", run.contacts), fmt::format("{:.1f}", run.step_us),
                fmt::format("{:.2f}", run.step_us / std::max(run.contacts, 1.0))};
      },
      [](const Sample& s) {
        return fmt::format("{:.4f},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g}", s.t, s.travel, s.turn, s.position[0],
                           s.position[1], s.position[2]);
      });
}
