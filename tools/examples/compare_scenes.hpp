// The common part of bristle_bullet and bristle_mujoco: runs scenes of an engine with its own friction and
// with bristles, and prints a table and, on request, CSV.
#pragma once

#include <cstdio>
#include <exception>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "tools/libraries/reports/table.hpp"

namespace bristle_example {

/// What differs between the two comparing programs (MuJoCo, Bullet): their texts, and columns of their
/// tables.
struct ComparingProgram {
  const char *name, *about, *csv_help;
  std::vector<std::string> table_columns;
  const char* csv_columns;  ///< headers of the columns after `scene` and `friction`
};

/// Runs the whole program. `run(scene)` returns a Run per kind of friction; `cells(run, first)` and
/// `numbers(sample)` return the rest of a table's row and of a CSV line, where `first` is the scene's first
/// run.
template <class Scene, class RunScene, class Cells, class Numbers>
int compare_scenes(int argc, char** argv, const ComparingProgram& program, const std::vector<Scene>& scenes,
                   const RunScene& run, const Cells& cells, const Numbers& numbers) {
  CLI::App app{program.about};
  std::string csv, only;
  app.add_option("--csv", csv, program.csv_help);
  app.add_option("--scene", only, "one scene, by the name it has in the CSV");
  CLI11_PARSE(app, argc, argv);
  try {
    std::ofstream file;
    if (!csv.empty()) {
      file.open(csv);
      file << "scene,friction," << program.csv_columns << '\n';
      if (!file) throw std::runtime_error("cannot write " + csv);
    }
    cli::Table table(program.table_columns);
    for (const Scene& scene : scenes) {
      if (!only.empty() && scene.name != only) continue;
      table.add_note(scene.title);
      const auto runs = run(scene);
      for (const auto& one : runs) {
        std::vector<cli::Cell> row = {std::string("  ") + to_string(one.friction),
                                      fmt::format("{:.5f}", 1e6 * one.creep + 0.0)};
        for (std::string& cell : cells(one, runs[0])) row.emplace_back(std::move(cell));
        table.add(std::move(row));
        for (const auto& sample : one.samples)
          if (file.is_open())
            file << fmt::format("{},\"{}\",{}\n", scene.name, to_string(one.friction), numbers(sample));
      }
    }
    if (table.empty()) throw std::runtime_error("no scene called " + only);
    std::fputs(table.text().c_str(), stdout);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", program.name, error.what());
    return 2;
  }
}

}  // namespace bristle_example
