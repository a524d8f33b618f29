// Runs bristle_mujoco: compares MuJoCo's own friction with bristles, as a table, as CSV and as a picture.
#include <cstdio>
#include <exception>
#include <fstream>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "tools/examples/mujoco_scenes.hpp"
#include "tools/reports/table.hpp"

namespace {

using mujoco_example::Friction;
using mujoco_example::Run;
using mujoco_example::Scene;

void add_rows(cli::Table& table, const Scene& scene, const std::vector<Run>& runs) {
  table.add_note(scene.title);
  for (const Run& run : runs) {
    const auto& end = run.samples.back();
    table.add({std::string("  ") + to_string(run.friction), fmt::format("{:.5f}", 1e6 * run.creep + 0.0),
               fmt::format("{:.4f}", 1e3 * end.travel), fmt::format("{:.3f}", end.turn * 57.29577951308232),
               fmt::format("{:.1f}", run.contacts), fmt::format("{:.1f}", run.step_us),
               fmt::format("{:.2f}", run.step_us / std::max(run.contacts, 1.0))});
  }
}

void write_csv(std::ostream& file, const Scene& scene, const std::vector<Run>& runs) {
  for (const Run& run : runs) {
    for (const auto& s : run.samples) {
      file << fmt::format("{},\"{}\",{:.4f},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g}\n", scene.name,
                          to_string(run.friction), s.t, s.travel, s.turn, s.place[0], s.place[1], s.place[2]);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Sets MuJoCo's own friction beside that of bristles: creep, place, turn, time of a step."};
  std::string csv, only;
  app.add_option("--csv", csv, "positions over time; tools/plots/mujoco.gp draws them");
  app.add_option("--scene", only, "one scene, by the name it has in the CSV");
  CLI11_PARSE(app, argc, argv);
  try {
    std::ofstream file;
    if (!csv.empty()) {
      file.open(csv);
      file << "scene,friction,t[s],travel[m],turn[rad],x[m],y[m],z[m]\n";
      if (!file) throw std::runtime_error("cannot write " + csv);
    }
    cli::Table table(
        {"<scene", "creep um/s", "travel mm", "turn deg", "contacts", "us a step", "us a contact"});
    for (const Scene& scene : mujoco_example::all_scenes()) {
      if (!only.empty() && scene.name != only) continue;
      const std::vector<Run> runs =
          mujoco_example::run(scene, {Friction::stock, Friction::noslip, Friction::bristle});
      add_rows(table, scene, runs);
      if (file.is_open()) write_csv(file, scene, runs);
    }
    if (table.empty()) throw std::runtime_error("no scene called " + only);
    std::fputs(table.text().c_str(), stdout);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bristle_mujoco: %s\n", error.what());
    return 2;
  }
}
