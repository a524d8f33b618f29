// Runs bristle_bullet, which compares Bullet's own friction with bristles and prints a table and, on request,
// CSV.
#include "tools/examples/bullet_scenes.hpp"
#include "tools/examples/compare_scenes.hpp"

using bullet_example::Friction;
using bullet_example::Run;
using bullet_example::Sample;

int main(int argc, char** argv) {
  return bristle_example::compare_scenes(
      argc, argv,
      {"bristle_bullet",
       "Sets Bullet's own friction beside that of bristles: creep, place, turn, time of a step.",
       "positions over time",
       {"<scene", "creep um/s", "x mm", "y mm", "turn deg", "contacts", "us a step", "of Bullet's"},
       "t[s],x[m],y[m],z[m],turn[rad]"},
      bullet_example::all_scenes(),
      [](const bullet_example::Scene& scene) {
        return bullet_example::run(scene, {Friction::stock, Friction::anchored, Friction::bristle});
      },
      [](const Run& run, const Run& stock) -> std::vector<std::string> {
        const Sample &first = run.samples.front(), &last = run.samples.back();
        return {fmt::format("{:.4f}", 1e3 * (last.position[0] - first.position[0])),
                fmt::format("{:.4f}", 1e3 * (last.position[1] - first.position[1])),
                fmt::format("{:.3f}", last.turn * 57.29577951308232),
                fmt::format("{:.1f}", run.contacts),
                fmt::format("{:.1f}", run.step_us),
                fmt::format("{:.2f}", run.step_us / stock.step_us)};
      },
      [](const Sample& s) {
        return fmt::format("{:.4f},{:.9g},{:.9g},{:.9g},{:.9g}", s.t, s.position[0], s.position[1],
                           s.position[2], s.turn);
      });
}
