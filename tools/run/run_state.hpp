// Saves and restores the state of a run: `bristle run --save-state` and `--restore-state`.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/scene/scene_stepper.hpp"

namespace cli {

/// Path of a copy.
struct Way {
  double x = 0.0, y = 0.0;            ///< m, displacement since the beginning
  double slid_x = 0.0, slid_y = 0.0;  ///< m, displacement since it last reversed or lost contact
};

/// Checks before a long run that a state file can be written, as far as that can be known. Throws UserError.
void check_place_of_state(const std::string& path);

/// Writes the state of all patches, the time, the bodies' places and the paths: everything that the next
/// steps depend on. `steps` were done since the scene's beginning. Throws UserError.
void save_run(const std::string& path, const SceneStepper& stepper, std::uint64_t steps, double dt,
              const std::vector<Way>& ways);

/// Restores the state into a stepper of the same scene; returns the steps done before. Throws UserError if
/// the file belongs to another scene.
std::uint64_t restore_run(const std::string& path, SceneStepper& stepper, double dt, std::vector<Way>& ways);

}  // namespace cli
