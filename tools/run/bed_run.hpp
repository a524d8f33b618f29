// `bristle run` of a scene of beds (tools/scenes/README.md): elastic bodies on prescribed paths.
#pragma once

#include <string>
#include <vector>

#include <bristle/bed.hpp>

#include "tools/run/run.hpp"

namespace cli {

/// Where a bed has gone by time t, since the beginning; linear between rows.
struct BedRow {
  double t = 0.0;                 ///< s
  double x = 0.0, y = 0.0;        ///< m
  double spin = 0.0;              ///< rad
  double rolled[2] = {0.0, 0.0};  ///< m
  double load = 0.0;              ///< N
};

struct SceneBed {
  std::string name, where;
  bristle::BedMaterial material;
  bristle::BedShape shape;
  bristle::BedOptions options;
  std::vector<BedRow> path;
};

struct BedScene {
  Scene scene;  ///< without patches
  std::vector<SceneBed> beds;
};

/// Throws UserError with file, line and key.
BedScene parse_bed_scene(const std::string& text, const std::string& path);

/// Runs a scene with this text if it has a [[bed]], and reports; false for another scene. Throws UserError.
bool run_bed_scene(const RunOptions& options, const std::string& text);

}  // namespace cli
