// Saves and restores the state of a run: `bristle run --save-state` and `--restore-state`.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/scene/scene_stepper.hpp"

namespace cli {

/// Path of a patch's copy.
struct Way {
  double x = 0.0, y = 0.0;            ///< m, displacement since the beginning of the run
  double slid_x = 0.0, slid_y = 0.0;  ///< m, displacement since the copy last reversed or lost contact
};

/// Checks before a long run, as far as possible, that its state can be written to the file. Throws UserError.
void check_place_of_state(const std::string& path);

/// Writes everything that later steps depend on: the states of all patches, the time, the places of bodies
/// and the paths of copies. `steps` is the number done since the beginning of the scene. Throws UserError.
void save_run(const std::string& path, const SceneStepper& stepper, std::uint64_t steps, double dt,
              const std::vector<Way>& ways);

/// Restores a saved state into a stepper of the same scene. Returns the number of steps done before it was
/// saved. Throws UserError if the file belongs to another scene.
std::uint64_t restore_run(const std::string& path, SceneStepper& stepper, double dt, std::vector<Way>& ways);

}  // namespace cli
