// Saves and restores the state of a run: `bristle run --save-state` and `--restore-state`.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/libraries/scene/scene_stepper.hpp"

namespace cli {

/// Path of one copy of a patch, by which sliding is detected.
struct CopyPath {
  double x = 0.0, y = 0.0;            ///< displacement since the beginning of the run, m
  double slid_x = 0.0, slid_y = 0.0;  ///< displacement since the last reversal or loss of contact, m
};

/// Saves all that later steps depend on: the states of all patches, the time, the states of bodies and the
/// paths of copies (`copy_paths`). Returns the bytes. `steps` counts from the beginning of the scene.
std::string save_run(const SceneStepper& stepper, std::uint64_t steps, double dt,
                     const std::vector<CopyPath>& copy_paths);

/// Restores what save_run() returned, from a file, into a stepper of the same scene. Returns the number of
/// steps that had led to the saved state. Throws UserError if the file cannot be read or belongs to another
/// scene.
std::uint64_t restore_run(const std::string& path, SceneStepper& stepper, double dt,
                          std::vector<CopyPath>& copy_paths);

}  // namespace cli
